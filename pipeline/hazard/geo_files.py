"""Hazard maps in a reference system, as GeoTIFF, NetCDF and GeoPackage."""

from __future__ import annotations

import warnings
from collections.abc import Iterator
from itertools import pairwise
from pathlib import Path
from typing import TYPE_CHECKING, Any, TypeVar

import numpy as np
import xarray as xr

from pipeline.assess.georeference import Frame, GeoreferenceError, north_up
from pipeline.hazard.layers import BANDS, ERROR, Layer, layers
from pipeline.store.folder import whole

if TYPE_CHECKING:
    from shapely import MultiPolygon

# small enough that a map of some hundred cells has an overview
BLOCK = 128
MAP = "map.nc"
OUTLINES = "outlines.gpkg"
Grid = TypeVar("Grid", xr.Dataset, xr.DataArray)
ABOVE_ALL = 2.0


def write(found: xr.Dataset, frame: Frame, shares: tuple[float, ...], folder: Path) -> list[Path]:
    """Write maps on a grid that is north up, and outlines, to a folder that is there.

    Parameters
    ----------
    found : Dataset
        Hazard maps over a lattice.
    frame : Frame
        Of this lattice.
    shares : tuple of float
        Shares of runs whose outlines are written.
    folder : Path
        Gets a cloud-optimised GeoTIFF a map, `MAP` and `OUTLINES`.

    Raises
    ------
    OSError
        If something cannot be written.
    """
    crs = frame.georeference.crs
    grid = north_up(found, frame)
    paths = [_geotiff(layer, grid, crs, folder / f"{layer.name}.tif") for layer in layers(grid)]
    return [*paths, _netcdf(grid, crs, folder / MAP), _outlines(found, frame, shares, folder / OUTLINES)]


def check(code: str) -> None:
    """Refuse a reference system that a grid of metres cannot be in.

    Raises
    ------
    GeoreferenceError
        If it is not known, or not one of metres on a plane.
    """
    import rasterio.crs
    import rasterio.errors

    try:
        crs = rasterio.crs.CRS.from_user_input(code)
    except rasterio.errors.CRSError as error:
        raise GeoreferenceError(f"the reference system {code} is not known: {error}") from None
    if not crs.is_projected or crs.linear_units_factor[1] != 1:
        raise GeoreferenceError(f"expected a projected reference system with metres, found {code}")


def _geotiff(layer: Layer, grid: xr.Dataset, crs: str, path: Path) -> Path:
    """Write a map and its bounds as bands of one file."""
    import rioxarray

    assert rioxarray
    classes = layer.kind == "class"
    bands = xr.concat(
        [values.reset_coords(drop=True) for values in layer.values.values()], "band", coords="minimal"
    )
    bands = bands.assign_coords(x=grid["x"], y=grid["y"])
    # GDAL's names of bands; an operation on the array would lose the reference system, so it comes last
    bands.attrs = {"long_name": tuple(BANDS[bound] for bound in layer.values)}
    bands = _with_crs(bands.rio.write_nodata(-1 if classes else np.nan), crs)
    tags = {
        key: str(value)
        for key, value in {"description": layer.title, "units": layer.units, **grid.attrs}.items()
    }
    with whole(path, path.suffix) as aside:
        bands.rio.to_raster(
            aside,
            driver="COG",
            tags=tags,
            compress="DEFLATE",
            blocksize=BLOCK,
            overview_resampling="mode" if classes else "average",
        )
    return path


def _netcdf(grid: xr.Dataset, crs: str, path: Path) -> Path:
    """Write all maps with a grid mapping of the CF conventions."""
    import rioxarray

    assert rioxarray
    encoding: dict[str, dict[str, Any]] = {str(name): {"_FillValue": None} for name in grid.coords}
    for name, values in grid.data_vars.items():
        integer = np.issubdtype(values.dtype, np.integer)
        encoding[str(name)] = {"zlib": True, "_FillValue": np.int8(-1) if integer else np.float32("nan")}
    written = _with_crs(grid, crs)
    for name in grid.data_vars:
        written[name].attrs.pop("grid_mapping", None)
        written[name].encoding["grid_mapping"] = "spatial_ref"
        encoding[str(name)]["grid_mapping"] = "spatial_ref"
    with whole(path, path.suffix) as aside:
        written.to_netcdf(aside, engine="netcdf4", encoding=encoding)
    return path


def _with_crs(grid: Grid, crs: str) -> Grid:
    with warnings.catch_warnings():
        # parameters that CF has no names for; the WKT beside them has all
        warnings.filterwarnings("ignore", "angle from rectified to skew grid", UserWarning)
        found: Grid = grid.rio.write_crs(crs)
    return found


def _outlines(found: xr.Dataset, frame: Frame, shares: tuple[float, ...], path: Path) -> Path:
    """Write where at least each share of runs exceeds each threshold, as polygons, bounds too."""
    import pyogrio.raw
    import shapely

    rows = list(_rows(found, frame, shares))
    fields = {
        "map": object, "quantity": object, "threshold": float, "units": object, "share": float,
        "bound": object, "runs": object, "runs_done": int, "runs_planned": int, "area": float,
    }  # fmt: skip
    columns: list[Any] = [
        np.array([row[name] for _, row in rows], dtype=kind) for name, kind in fields.items()
    ]
    with whole(path, path.suffix) as aside:
        pyogrio.raw.write(
            aside,
            np.array([shapely.to_wkb(shape) for shape, _ in rows], dtype=object),
            columns,
            list(fields),
            geometry_type="MultiPolygon",
            crs=frame.georeference.crs,
            driver="GPKG",
            layer="outlines",
        )
    return path


def _rows(
    found: xr.Dataset, frame: Frame, shares: tuple[float, ...]
) -> Iterator[tuple[MultiPolygon, dict[str, Any]]]:
    runs = {
        "runs": found.attrs["comment"],
        "runs_done": found.attrs["runs_done"],
        "runs_planned": found.attrs["runs_planned"],
    }
    for layer in layers(found):
        if layer.threshold is None:
            continue
        about = {
            "map": layer.name,
            "quantity": layer.quantity,
            "threshold": layer.threshold,
            "units": layer.threshold_units,
        }
        for bound, values in layer.values.items():
            for share in shares if bound != ERROR else ():
                shape = outline(values, share, frame)
                if not shape.is_empty:
                    yield shape, {**about, **runs, "share": share, "bound": BANDS[bound], "area": shape.area}


def outline(values: xr.DataArray, share: float, frame: Frame) -> MultiPolygon:
    """Outline where a map over a lattice is at least a share, in the reference system; maybe empty."""
    import shapely
    from contourpy import FillType, contour_generator

    generator = contour_generator(
        frame.arc, frame.across, np.ma.masked_invalid(values.to_numpy()), fill_type=FillType.OuterOffset
    )
    polygons = []
    for points, offsets in zip(*generator.filled(share, ABOVE_ALL), strict=True):
        assert points is not None
        assert offsets is not None
        placed = np.stack(frame.on_map(points[:, 0], points[:, 1]), axis=1)
        rings = [placed[a:b] for a, b in pairwise(offsets)]
        polygons.append(shapely.Polygon(rings[0], rings[1:]))
    whole = shapely.make_valid(shapely.MultiPolygon(polygons))
    parts = [part for part in shapely.get_parts(whole, return_index=False) if part.geom_type == "Polygon"]
    return shapely.MultiPolygon(parts)
