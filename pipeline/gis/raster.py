"""Maps as GeoTIFF: one map a file, with its colours and the names of its classes."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from xml.etree import ElementTree as Xml

import numpy as np
from matplotlib.colors import to_rgb
from numpy.typing import NDArray

from pipeline.gis.qml import raster_style, to_text
from pipeline.gis.symbology import UNKNOWN_COLOUR, UNKNOWN_WORDS, Style
from pipeline.store.folder import whole

# small enough that a map of some hundred cells has an overview
BLOCK = 128
# of classes: where nothing was computed, and what lies outside
UNKNOWN, OUTSIDE = 254, 255
# file of GDAL beside a raster with what a GeoTIFF has no place for
BESIDE = ".aux.xml"
# GDAL's numbers for kinds and uses of the columns of an attribute table
INTEGER, TEXT = 0, 2
USES = {"Value": 5, "Class": 2, "Red": 6, "Green": 7, "Blue": 8}


@dataclass(frozen=True)
class Grid:
    """Cells of a map in rows from north to south.

    Parameters
    ----------
    easting, northing : array
        Of the centres, m; northing falls.
    crs : str
        Code or WKT.
    """

    easting: NDArray[np.float64]
    northing: NDArray[np.float64]
    crs: str

    @property
    def bounds(self) -> tuple[float, float, float, float]:
        """West, south, east and north, m, of the outer cells."""
        x, y = self.easting, self.northing
        width, height = x[1] - x[0], y[0] - y[1]
        ends = (x[0] - width / 2, y[-1] - height / 2, x[-1] + width / 2, y[0] + height / 2)
        west, south, east, north = map(float, ends)
        return west, south, east, north


def write(
    values: NDArray[np.generic], grid: Grid, path: Path, style: Style | None, about: Mapping[str, object]
) -> list[Path]:
    """Write a map as cloud-optimised GeoTIFF with overviews, and its style beside it.

    Parameters
    ----------
    values : (ny, nx) array
        Floats, NaN where nothing is known; or ``uint8`` of classes with `UNKNOWN` and `OUTSIDE`.
    grid : Grid
        Of the values.
    path : Path
        The raster; its style gets the ending ``.qml``.
    style : Style or None
        How it looks; of a ground without one a hillshade.
    about : mapping
        Tags; ``description`` and ``units`` become those of the band.

    Raises
    ------
    OSError
        If one cannot be written.
    """
    import rasterio
    from rasterio.transform import Affine

    classes = style is not None and style.discrete
    west, _, _, north = grid.bounds
    side = float(grid.easting[1] - grid.easting[0]), float(grid.northing[0] - grid.northing[1])
    with whole(path, path.suffix) as aside:
        with rasterio.open(
            aside,
            "w",
            driver="COG",
            height=values.shape[0],
            width=values.shape[1],
            count=1,
            dtype="uint8" if classes else "float32",
            crs=grid.crs,
            transform=Affine(side[0], 0, west, 0, -side[1], north),
            nodata=OUTSIDE if classes else np.nan,
            compress="DEFLATE",
            blocksize=BLOCK,
            overview_resampling="mode" if classes else "average",
        ) as target:
            target.write(values, 1)
            target.set_band_description(1, str(about.get("description", "")))
            if units := about.get("units"):
                target.set_band_unit(1, str(units))
            target.update_tags(**{name: str(value) for name, value in about.items()})
            if classes:
                assert style is not None
                target.write_colormap(1, _colours(style))
        # GDAL writes one under the name that the file has until it is whole
        Path(f"{aside}{BESIDE}").unlink(missing_ok=True)
    written = [path, path.with_suffix(".qml")]
    _put(written[1], to_text(raster_style(style)))
    beside = Path(f"{path}{BESIDE}")
    beside.unlink(missing_ok=True)
    if style is not None and classes:
        _put(beside, Xml.tostring(_attribute_table(style), encoding="unicode"))
        written.append(beside)
    return written


def _put(path: Path, text: str) -> None:
    with whole(path) as aside:
        aside.write_text(text, encoding="utf-8")


def named(style: Style) -> dict[int, tuple[str, str]]:
    """Give word and colour of every value of a map of classes."""
    found = {int(each.lower): (each.label, each.colour) for each in style.entries}
    return {0: ("none", "#ffffff"), **found, UNKNOWN: (UNKNOWN_WORDS, UNKNOWN_COLOUR)}


def _colours(style: Style) -> dict[int, tuple[int, int, int, int]]:
    return {value: (*_bytes(colour), 255) for value, (_, colour) in named(style).items()}


def _bytes(colour: str) -> tuple[int, int, int]:
    red, green, blue = (round(255 * part) for part in to_rgb(colour))
    return red, green, blue


def _attribute_table(style: Style) -> Xml.Element:
    """Make GDAL's raster attribute table with the word of each value, and the list of names."""
    root = Xml.Element("PAMDataset")
    band = Xml.SubElement(root, "PAMRasterBand", band="1")
    words = named(style)
    names = Xml.SubElement(band, "CategoryNames")
    for value in range(max(each for each in words if each < UNKNOWN) + 1):
        Xml.SubElement(names, "Category").text = words[value][0]
    table = Xml.SubElement(band, "GDALRasterAttributeTable", tableType="thematic")
    for i, (name, use) in enumerate(USES.items()):
        column = Xml.SubElement(table, "FieldDefn", index=str(i))
        Xml.SubElement(column, "Name").text = name
        Xml.SubElement(column, "Type").text = str(TEXT if name == "Class" else INTEGER)
        Xml.SubElement(column, "Usage").text = str(use)
    for i, (value, (word, colour)) in enumerate(words.items()):
        row = Xml.SubElement(table, "Row", index=str(i))
        for cell in (value, word, *_bytes(colour)):
            Xml.SubElement(row, "F").text = str(cell)
    return root
