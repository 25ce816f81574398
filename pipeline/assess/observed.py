"""An observed deposit, an outline or a survey of depths, brought on the cells of a store."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

import numpy as np
import pandas as pd
import xarray as xr
from matplotlib.path import Path as Outline
from numpy.typing import NDArray
from scipy.spatial import KDTree

from pipeline.assess.georeference import Frame
from pipeline.assess.receptors import Cells
from pipeline.scenario import text_table
from pipeline.scenario.scenario import stored

Array = NDArray[np.float64]
OUTLINES = (".gpkg", ".geojson", ".json", ".shp")
RASTERS = (".tif", ".tiff")


class ObservationError(Exception):
    """An observed deposit cannot be used; ``str()`` says why."""


@dataclass(frozen=True)
class Observed:
    """An observed deposit on the cells of a store.

    covered : (cells,) whether each is part of it. depth : (cells,) its depth, m; None where only the outline
    is known.
    """

    covered: NDArray[np.bool_]
    depth: Array | None


def read(path: Path, store: xr.Dataset, threshold: float) -> Observed:
    """Read an observed deposit.

    Parameters
    ----------
    path : Path
        In the coordinates of the bed, m: CSV with the columns x and y, the corners of an outline in order; or
        with x, y and depth, or NetCDF with a variable ``depth`` over x and y: a survey on places, of which
        each cell takes the mean of those within it. On the map, for a scenario with a georeference and in any
        reference system: polygons as GeoPackage, GeoJSON or Shapefile, of which those cells are part whose
        centres they hold; or a raster of depths as GeoTIFF, of which each cell takes the value at its centre.
    store : Dataset
        The store whose cells it is brought on.
    threshold : float
        Depth above which a cell is part of the deposit, m.

    Raises
    ------
    ObservationError
        If the file is none of these, or no cell is part of the deposit.
    ImportError
        If it is one on the map without the extra ``geo``.
    OSError
        If it cannot be read.
    """
    cells = Cells(store)
    if path.suffix.lower() in OUTLINES:
        return _whole(Observed(_within_polygons(path, store, cells), None), path, store)
    if path.suffix.lower() in RASTERS:
        sampled = _raster(path, store, cells)
        return _whole(Observed(sampled > threshold, sampled), path, store)
    return _whole(_on_bed(path, cells, threshold), path, store)


def _whole(observed: Observed, path: Path, store: xr.Dataset) -> Observed:
    if not observed.covered.any():
        raise ObservationError(f"{path}: no cell of {store.attrs['title']} is part of the deposit")
    return observed


def _within_polygons(path: Path, store: xr.Dataset, cells: Cells) -> NDArray[np.bool_]:
    """Say which cells have their centres in polygons on the map."""
    import pyogrio.raw
    import shapely

    easting, northing, crs = _on_map(path, store, cells)
    try:
        meta, _, shapes, _ = pyogrio.raw.read(path, columns=[])
    except pyogrio.errors.DataSourceError as error:
        raise ObservationError(f"{path}: expected polygons: {error}") from error
    area = shapely.union_all(shapely.make_valid(shapely.from_wkb(shapes)))
    if not meta["crs"]:
        missing = path.with_suffix(".prj").name
        found = f"none: {missing} is missing beside it" if path.suffix.lower() == ".shp" else "none"
        raise ObservationError(f"{path}: expected polygons with a reference system, found {found}")
    if area.geom_type not in ("Polygon", "MultiPolygon"):
        raise ObservationError(f"{path}: expected polygons, found {area.geom_type}")
    x, y = _transformed(crs, meta["crs"], easting, northing)
    return np.asarray(shapely.contains_xy(area, x, y))


def _raster(path: Path, store: xr.Dataset, cells: Cells) -> Array:
    """Depth of a raster on the map at the centres of cells, 0 where it has none, shape (cells,), m."""
    import rasterio

    easting, northing, crs = _on_map(path, store, cells)
    try:
        with rasterio.open(path) as raster:
            if raster.crs is None:
                raise ObservationError(f"{path}: expected a raster with a reference system, found none")
            x, y = _transformed(crs, raster.crs, easting, northing)
            found = np.ma.stack(list(raster.sample(zip(x, y, strict=True), indexes=1, masked=True)))
    except rasterio.RasterioIOError as error:
        raise ObservationError(f"{path}: expected a raster: {error}") from error
    return np.nan_to_num(np.ma.filled(found[:, 0].astype(np.float64), 0.0))


def _on_map(path: Path, store: xr.Dataset, cells: Cells) -> tuple[Array, Array, str]:
    """Easting and northing of the cells' centres, (cells,), m, and the reference system."""
    ground = stored(store.attrs).georeference
    if ground is None:
        raise ObservationError(f"{path}: expected a scenario with a georeference, as the file is on the map")
    if "run" in store["horizontal_distance"].dims:
        raise ObservationError(f"{path}: the profile differs between the runs, so that their places do")
    arc, first = np.unique(store["x"].to_numpy(), return_index=True)
    frame = Frame(ground, arc, store["horizontal_distance"].to_numpy()[first], np.zeros(2))
    return *frame.on_map(*cells.points.T), ground.crs


def _transformed(crs: str, to: object, easting: Array, northing: Array) -> tuple[Array, Array]:
    from rasterio.warp import transform

    x, y = transform(crs, to, easting, northing)
    return np.asarray(x), np.asarray(y)


def _on_bed(path: Path, cells: Cells, threshold: float) -> Observed:
    """Read a file in the coordinates of the bed."""
    table = _table(path)
    if not np.isfinite(table.to_numpy(np.float64)).all():
        raise ObservationError(f"{path}: expected finite numbers in all rows")
    places = table[["x", "y"]].to_numpy(np.float64)
    if "depth" in table:
        depth = _means(cells, places, table["depth"].to_numpy(np.float64))
        covered = depth > threshold
    else:
        if len(places) < 3:
            raise ObservationError(f"{path}: expected 3 or more corners of an outline, found {len(places)}")
        depth, covered = None, Outline(np.vstack([places, places[:1]])).contains_points(cells.points)
    return Observed(covered, depth)


def _table(path: Path) -> pd.DataFrame:
    """Give the places of a file as the columns x, y and perhaps depth."""
    try:
        if path.suffix.lower() == ".nc":
            with xr.open_dataset(path) as survey:
                table = survey["depth"].to_dataframe().reset_index().dropna(subset=["depth"])
        else:
            if (found := text_table.obstacle(path)) is not None:
                raise ValueError(f"found {found}")
            table = pd.read_csv(path)
        names = [name for name in ("x", "y", "depth") if name in table]
        if names[:2] != ["x", "y"]:
            raise KeyError("x and y")
        return table[names].astype(np.float64)
    except (KeyError, ValueError) as error:
        raise ObservationError(f"{path}: expected x, y and perhaps depth, in m: {error}") from error


def _means(cells: Cells, places: Array, depth: Array) -> Array:
    """Mean depth of the places within each cell, 0 in cells without one that lie apart, shape (cells,)."""
    tree = KDTree(cells.points)
    _, index = tree.query(places)
    count = np.bincount(index, minlength=len(cells.points))
    total = np.bincount(index, depth, minlength=len(cells.points))
    mean = total / np.maximum(count, 1)
    # a survey coarser than the cells: a cell between its places takes the depth of the nearest
    survey = KDTree(places)
    apart = survey.query(places, k=2)[0][:, 1] if len(places) > 1 else np.zeros(1)
    reach = np.sqrt(0.5) * float(np.median(apart))
    near, at = survey.query(cells.points)
    found: Array = np.where(count > 0, mean, np.where(near <= reach, depth[at], 0.0))
    return found
