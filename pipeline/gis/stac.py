"""The maps of a place as one item of a SpatioTemporal Asset Catalog."""

from __future__ import annotations

import hashlib
import json
from collections.abc import Sequence
from pathlib import Path
from typing import Any

from pipeline.gis.project import PROJECT, Group, RasterFile
from pipeline.gis.raster import OUTSIDE, Grid, named
from pipeline.store.folder import whole

ITEM = "item.json"
VERSION = "1.0.0"
EXTENSIONS = tuple(
    f"https://stac-extensions.github.io/{name}/schema.json"
    for name in ("projection/v1.1.0", "file/v2.1.0", "raster/v1.1.0", "classification/v1.1.0")
)
# kinds of files by their ending
MEDIA = {
    ".tif": "image/tiff; application=geotiff; profile=cloud-optimized",
    ".gpkg": "application/geopackage+sqlite3",
    ".nc": "application/netcdf",
    ".png": "image/png",
    ".qgs": "application/xml",
}
# of a multihash: what tells SHA-256, and its length in bytes
SHA_256 = "1220"
DEGREES = 7


def write_item(groups: Sequence[Group], folder: Path, name: str, made: str) -> Path:
    """Write a STAC item of a place: where it lies, when its maps were made, and its files.

    Parameters
    ----------
    groups : sequence of Group
        What was written.
    folder : Path
        Of the maps; files are named relative to it, and are there.
    name : str
        Of the place.
    made : str
        When the maps were made, ISO 8601 with time and zone.

    Returns
    -------
    Path
        The item.

    Raises
    ------
    OSError
        If it cannot be written.
    """
    import rasterio.crs
    from rasterio.warp import transform_bounds, transform_geom

    grid = groups[0].grid
    west, south, east, north = grid.bounds
    ring = [[west, south], [east, south], [east, north], [west, north], [west, south]]
    shape = transform_geom(
        grid.crs, "EPSG:4326", {"type": "Polygon", "coordinates": [ring]}, precision=DEGREES
    )
    bounds = transform_bounds(grid.crs, "EPSG:4326", *grid.bounds)
    crs = rasterio.crs.CRS.from_user_input(grid.crs)
    code = crs.to_epsg()
    item = {
        "type": "Feature",
        "stac_version": VERSION,
        "stac_extensions": list(EXTENSIONS),
        "id": name,
        "geometry": {
            "type": shape["type"],
            "coordinates": [[list(place) for place in shape["coordinates"][0]]],
        },
        "bbox": [round(value, DEGREES) for value in bounds],
        "properties": {
            "datetime": made,
            "title": f"Hazard maps: {name}",
            "description": "; ".join(f"{group.name}: {group.runs}" for group in groups),
            "proj:epsg": code,
            # a system without a code has its text
            **({} if code else {"proj:wkt2": crs.to_wkt(version="WKT2_2019")}),
            "proj:bbox": [west, south, east, north],
        },
        "links": [],
        "assets": {
            PROJECT: {
                "href": f"./{PROJECT}",
                "type": MEDIA[".qgs"],
                "title": "project of QGIS",
                "roles": ["metadata"],
                **_file(folder / PROJECT),
            },
            **{key: asset for group in groups for key, asset in _assets(group, folder).items()},
        },
    }
    path = folder / ITEM
    with whole(path) as aside:
        aside.write_text(json.dumps(item, indent=1, ensure_ascii=False) + "\n", encoding="utf-8")
    return path


def _assets(group: Group, folder: Path) -> dict[str, dict[str, Any]]:
    rasters = {raster.path: raster for raster in group.rasters}
    found = {}
    for path in group.paths:
        if path.suffix in MEDIA:
            relative = path.relative_to(folder).as_posix()
            raster = rasters.get(path)
            shown = rasters.get(path.with_suffix(".tif"))
            title = shown.title if shown else path.stem.replace("_", " ")
            found[relative] = {
                "href": f"./{relative}",
                "type": MEDIA[path.suffix],
                "title": f"{group.name}: {title}",
                "roles": ["overview"] if path.suffix == ".png" else ["data"],
                **_file(path),
                **(_raster(raster, group.grid) if raster else {}),
            }
    return found


def _file(path: Path) -> dict[str, Any]:
    """Give size and digest of a file."""
    digest = hashlib.sha256(path.read_bytes()).hexdigest()
    return {"file:size": path.stat().st_size, "file:checksum": f"{SHA_256}{digest}"}


def _raster(raster: RasterFile, grid: Grid) -> dict[str, Any]:
    """Say of a raster where its cells lie, what their numbers are, and of classes what each means."""
    west, _, _, north = grid.bounds
    across, down = float(grid.easting[1] - grid.easting[0]), float(grid.northing[1] - grid.northing[0])
    style = raster.style
    classes = style is not None and style.discrete
    band: dict[str, Any] = {
        "data_type": "uint8" if classes else "float32",
        "nodata": OUTSIDE if classes else "nan",
        "spatial_resolution": across,
        **({"unit": raster.units} if raster.units else {}),
    }
    if style is not None and classes:
        band["classification:classes"] = [
            {"value": value, "description": word, "color_hint": colour.removeprefix("#")}
            for value, (word, colour) in named(style).items()
        ]
    return {
        "proj:shape": [len(grid.northing), len(grid.easting)],
        "proj:transform": [across, 0.0, west, 0.0, down, north],
        "raster:bands": [band],
    }
