"""Hazard maps in a reference system: rasters, NetCDF, and a GeoPackage of maps and of what they mark."""

from __future__ import annotations

import warnings
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any, TypeVar

import numpy as np
import xarray as xr
from numpy.typing import NDArray

from pipeline.assess.georeference import Frame, GeoreferenceError, north_up
from pipeline.gis import geopackage, raster
from pipeline.gis.layer import BANDS, Layer
from pipeline.gis.project import Group, RasterFile
from pipeline.gis.raster import OUTSIDE, UNKNOWN, Grid
from pipeline.gis.vectors import marked, of_layer
from pipeline.hazard import intensity
from pipeline.hazard.layers import layers
from pipeline.store.folder import whole

MAP = "map.nc"
PACKAGE = "maps.gpkg"
GROUND = "elevation"
OnGrid = TypeVar("OnGrid", xr.Dataset, xr.DataArray)


def write(
    found: xr.Dataset,
    frame: Frame,
    shares: tuple[float, ...],
    folder: Path,
    listed: Callable[[xr.Dataset], Iterator[Layer]] = layers,
) -> Group:
    """Write maps on a grid that is north up, and as polygons, to a folder that is there.

    Parameters
    ----------
    found : Dataset
        Hazard maps over a lattice.
    frame : Frame
        Of this lattice.
    shares : tuple of float
        Shares of runs whose outlines are written.
    folder : Path
        Gets a cloud-optimised GeoTIFF with its style for each map, and for its bounds where they differ;
        `MAP` and `PACKAGE`.
    listed : callable
        Gives the single maps among ``found``.

    Raises
    ------
    OSError
        If something cannot be written.
    """
    crs = frame.georeference.crs
    turned = north_up(found, frame)
    inside = _inside(found, frame)
    easting, northing = (turned[axis].to_numpy().astype(np.float64) for axis in ("x", "y"))
    grid = Grid(easting, northing, crs)
    # classes of a time are those of the lattice, whatever of it the grid holds
    made = {layer.name: layer for layer in listed(found)}
    files: list[RasterFile] = []
    paths: list[Path] = []
    for layer in listed(turned):
        style = made[layer.name].style
        for bound, values in layer.values.items():
            if bound and made[layer.name].is_certain:
                continue
            path = folder / f"{layer.name}{bound}.tif"
            about = {"description": _title(layer, bound), "units": layer.units, **turned.attrs}
            held = _classes(values, inside) if style.discrete else values.to_numpy()
            paths += raster.write(held, grid, path, style, about)
            title = _title(layer, bound)
            files.append(RasterFile(path, title, style, is_bound=bool(bound), units=layer.units))
    if "elevation" in found.coords:
        ground = _elevation(found, frame)
        path = folder / f"{GROUND}.tif"
        about = {"description": "elevation of the bed", "units": "m", "comment": turned.attrs["comment"]}
        paths += raster.write(ground, grid, path, None, about)
        files.append(RasterFile(path, "elevation of the bed", None, units="m"))
    runs = {
        "runs": found.attrs["comment"],
        **{name: int(found.attrs[name]) for name in ("runs_done", "runs_planned") if name in found.attrs},
    }
    features = [of_layer(each, frame, shares, runs) for each in made.values()]
    features += marked(found, frame)
    paths += [
        _netcdf(turned, crs, folder / MAP),
        geopackage.write(features, crs, folder / PACKAGE),
    ]
    title, comment = (str(found.attrs[name]) for name in ("title", "comment"))
    return Group(title, comment, grid, folder / PACKAGE, files, features, paths)


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


def _title(layer: Layer, bound: str) -> str:
    return f"{layer.title}, {BANDS[bound]}" if bound else layer.title


def _inside(found: xr.Dataset, frame: Frame) -> NDArray[np.bool_]:
    """Say which cells of the grid lie within the lattice."""
    ones = xr.DataArray(np.ones((found.sizes["y"], found.sizes["x"]), np.int8), dims=("y", "x"))
    turned = north_up(xr.Dataset({"inside": ones}, coords=_bare(found)), frame)
    return np.asarray(turned["inside"].to_numpy() == 1)


def _bare(found: xr.Dataset) -> dict[str, NDArray[np.float64]]:
    """Give the places of the points without what else is known of them."""
    return {axis: found[axis].to_numpy() for axis in ("x", "y")}


def _classes(values: xr.DataArray, inside: NDArray[np.bool_]) -> NDArray[np.uint8]:
    """Give classes as a picture with a palette has them."""
    held = values.to_numpy()
    known = np.where(held == intensity.UNKNOWN, UNKNOWN, held)
    return np.where(inside, known, OUTSIDE).astype(np.uint8)


def _elevation(found: xr.Dataset, frame: Frame) -> NDArray[np.float32]:
    """Give the elevation of the bed on the grid."""
    shape = (found.sizes["y"], found.sizes["x"])
    ground = np.broadcast_to(found["elevation"].to_numpy().astype(np.float32), shape)
    held = xr.DataArray(ground, dims=("y", "x"))
    turned = north_up(xr.Dataset({GROUND: held}, coords=_bare(found)), frame)
    return np.asarray(turned[GROUND].to_numpy(), np.float32)


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


def _with_crs(grid: OnGrid, crs: str) -> OnGrid:
    with warnings.catch_warnings():
        # parameters that CF has no names for; the WKT beside them has all
        warnings.filterwarnings("ignore", "angle from rectified to skew grid", UserWarning)
        found: OnGrid = grid.rio.write_crs(crs)
    return found
