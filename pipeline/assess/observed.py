"""An observed deposit, an outline or a survey of depths, brought on the cells of a store."""

from __future__ import annotations

import warnings
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import pandas as pd
import xarray as xr
from matplotlib.path import Path as Outline
from numpy.typing import NDArray
from scipy.spatial import KDTree

from pipeline.assess.frames import mean_spacing, on_surface
from pipeline.assess.georeference import Frame, MapAxes
from pipeline.assess.receptors import Cells
from pipeline.inputs import text_table
from pipeline.inputs.polygons import crossing
from pipeline.inputs.raster_band import scaled
from pipeline.readable import percent
from pipeline.scenario.scenario import stored
from solver.release.polygons import ring_area

Array = NDArray[np.float64]
OUTLINES = (".gpkg", ".geojson", ".json", ".shp")
RASTERS = (".tif", ".tiff")
# share of an observed deposit that may be outside the domain, and places along an edge of that on the map
SLIVER, EDGE = 0.01, 100
ALONG_BED = "x is arc length along the bed, y the distance across it"


class ObservationError(ValueError):
    """An observed deposit cannot be used; ``str()`` says why."""


@dataclass(frozen=True)
class Observed:
    """An observed deposit on the cells of a store.

    Parameters
    ----------
    covered : (cells,) array
        Whether each is part of it.
    depth : (cells,) array, optional
        Its depth, m; None where only the outline is known.
    """

    covered: NDArray[np.bool_]
    depth: Array | None


def read(path: Path, store: xr.Dataset, threshold: float) -> Observed:
    """Read an observed deposit.

    Parameters
    ----------
    path : Path
        In the coordinates of the points, m, along and across the bed or eastings and northings: CSV with the
        columns x and y, the corners of an outline in order; or with x, y and depth, or NetCDF with a variable
        ``depth`` over x and y: a survey on places, of which each cell takes the mean of those within it. On
        the map, for a scenario with a georeference or on an elevation model and in any reference system:
        polygons as GeoPackage, GeoJSON or Shapefile, of which those cells are part whose centres they hold;
        or a raster of depths as GeoTIFF, of which each cell takes the value at its centre.
    store : Dataset
        The store whose cells it is brought on.
    threshold : float
        Depth above which a cell is part of the deposit, m.

    Raises
    ------
    ObservationError
        If the file is none of these, a depth is negative, or no cell is part of the deposit; if part of the
        deposit is outside the domain, where no run could have put anything.
    OSError
        If it cannot be read.
    """
    cells = Cells(store)
    if path.suffix.lower() in OUTLINES:
        return _whole(Observed(_within_polygons(path, store, cells), None), path, store)
    if path.suffix.lower() in RASTERS:
        sampled = _raster(path, store, cells, threshold)
        return _whole(Observed(sampled > threshold, sampled), path, store)
    return _whole(_on_bed(path, store, cells, threshold), path, store)


def _whole(observed: Observed, path: Path, store: xr.Dataset) -> Observed:
    if not observed.covered.any():
        raise ObservationError(f"{path}: no cell of {store.attrs['title']} is part of the deposit")
    return observed


def _extent(store: xr.Dataset, cells: Cells) -> tuple[Array, Array]:
    """Lower and upper corners of the cells of a store and one more around them, x and y in m.

    An outline is seldom drawn more finely.
    """
    margin = mean_spacing(store) if "point" in store.dims else cells.spacing
    return cells.points.min(axis=0) - margin, cells.points.max(axis=0) + margin


def _refuse_outside(
    path: Path, share: float, reach: tuple[Array, Array], store: xr.Dataset, cells: Cells
) -> None:
    """Refuse a deposit of which more than a sliver, as a share of the whole, is outside the domain."""
    if share <= SLIVER:
        return
    low, high = _extent(store, cells)
    has, holds = (
        f"x {a[0]:.6g} to {b[0]:.6g} m and y {a[1]:.6g} to {b[1]:.6g} m" for a, b in (reach, (low, high))
    )
    axes = "x are eastings, y northings" if on_surface(store) else ALONG_BED
    raise ObservationError(
        f"{path}: {percent(share)} of the observed deposit, {has}, is outside the domain of "
        f"{store.attrs['title']}, {holds}; run it on a larger domain, or check the file's coordinates: {axes}"
    )


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
    ring = np.stack(_transformed(crs, meta["crs"], *_footprint(store, cells)), axis=1)
    outside = shapely.difference(area, shapely.make_valid(shapely.Polygon(ring)))
    _refuse_outside_map(path, float(outside.area / area.area) if area.area else 0.0, store)
    return np.asarray(shapely.contains_xy(area, x, y))


def _footprint(store: xr.Dataset, cells: Cells) -> tuple[Array, Array]:
    """Easting and northing along the edge of the domain, (corners,), m, in the system of its scenario."""
    frame, _ = _frame(store)
    low, high = _extent(store, cells)
    along = np.linspace(low[0], high[0], EDGE)
    x = np.concatenate([along, along[::-1]])
    return frame.on_map(x, np.repeat([low[1], high[1]], EDGE))


def _refuse_outside_map(path: Path, share: float, store: xr.Dataset) -> None:
    if share > SLIVER:
        raise ObservationError(
            f"{path}: {percent(share)} of the observed deposit is outside the domain of "
            f"{store.attrs['title']}; run it on a larger domain, or check the reference system"
        )


def _raster(path: Path, store: xr.Dataset, cells: Cells, threshold: float) -> Array:
    """Depth of a raster on the map at the centres of cells, 0 where it has none, shape (cells,), m."""
    import rasterio

    easting, northing, crs = _on_map(path, store, cells)
    try:
        with rasterio.open(path) as raster:
            if raster.crs is None:
                raise ObservationError(f"{path}: expected a raster with a reference system, found none")
            x, y = _transformed(crs, raster.crs, easting, northing)
            found = np.ma.stack(list(raster.sample(zip(x, y, strict=True), indexes=1, masked=True)))
            depth = np.nan_to_num(np.ma.filled(scaled(found[:, 0], raster), 0.0))
            whole = np.nan_to_num(np.ma.filled(scaled(raster.read(1, masked=True), raster), 0.0))
            ring = _transformed(crs, raster.crs, *_footprint(store, cells))
            rows, columns = np.nonzero(whole > threshold)
            places = np.stack(rasterio.transform.xy(raster.transform, rows, columns), axis=1)
    except rasterio.RasterioIOError as error:
        why = "none, or one that is cut off or damaged"
        raise ObservationError(f"{path}: expected a raster, found {why}: {error}") from error
    _refuse_negative(path, whole)
    outside = ~Outline(np.stack(ring, axis=1)).contains_points(places)
    _refuse_outside_map(path, float(outside.mean()) if outside.size else 0.0, store)
    return depth


def _refuse_negative(path: Path, depth: Array) -> None:
    """Refuse depths below 0, which are what stands for no data, or no depths."""
    if (depth < 0).any():
        raise ObservationError(
            f"{path}: expected depths of at least 0 m, found {depth.min():g} in {(depth < 0).sum()} of "
            f"{depth.size} places; leave out places without data"
        )


def _on_map(path: Path, store: xr.Dataset, cells: Cells) -> tuple[Array, Array, str]:
    """Easting and northing of the cells' centres, (cells,), m, and the reference system."""
    try:
        frame, crs = _frame(store)
    except ObservationError as error:
        raise ObservationError(f"{path}: {error}") from None
    return *frame.on_map(*cells.points.T), crs


def _frame(store: xr.Dataset) -> tuple[Frame, str]:
    """Give the frame of the cells on the map, and the reference system."""
    if on_surface(store):
        x, y = (store[axis].to_numpy() for axis in ("x", "y"))
        crs = str(store.attrs["crs"])
        return Frame(MapAxes(crs), x, x, y), crs
    ground = stored(store.attrs).georeference
    if ground is None:
        raise ObservationError("expected a scenario with a georeference, as the file is on the map")
    if "run" in store["horizontal_distance"].dims:
        raise ObservationError("the profile differs between the runs, so that their places do")
    arc, first = np.unique(store["x"].to_numpy(), return_index=True)
    return Frame(ground, arc, store["horizontal_distance"].to_numpy()[first], np.zeros(2)), ground.crs


def _transformed(crs: str, to: object, easting: Array, northing: Array) -> tuple[Array, Array]:
    from rasterio.warp import transform

    x, y = transform(crs, to, easting, northing)
    return np.asarray(x), np.asarray(y)


def _on_bed(path: Path, store: xr.Dataset, cells: Cells, threshold: float) -> Observed:
    """Read a file in the coordinates of the bed."""
    table = _table(path)
    if not np.isfinite(table.to_numpy(np.float64)).all():
        raise ObservationError(f"{path}: expected finite numbers in all rows")
    places = table[["x", "y"]].to_numpy(np.float64)
    low, high = _extent(store, cells)
    if "depth" in table:
        given = table["depth"].to_numpy(np.float64)
        _refuse_negative(path, given)
        within = ((places >= low) & (places <= high)).all(axis=1)
        deposit = given > threshold
        beyond = float(given[deposit & ~within].sum() / given[deposit].sum()) if deposit.any() else 0.0
        if deposit.any():
            reach = places[deposit].min(axis=0), places[deposit].max(axis=0)
            _refuse_outside(path, beyond, reach, store, cells)
        if not within.any():
            raise ObservationError(
                f"{path}: expected places in the domain of {store.attrs['title']}, found none"
            )
        # what was surveyed beyond the domain says nothing of the cells at its edge
        depth = _means(cells, places[within], given[within])
        covered = depth > threshold
    else:
        if len(places) < 3:
            raise ObservationError(f"{path}: expected 3 or more corners of an outline, found {len(places)}")
        if why := crossing(list(map(tuple, places))):
            wanted = "expected the corners of an outline in turn around the deposit"
            raise ObservationError(f"{path}: {wanted}, found {why}")
        depth, covered = None, Outline(np.vstack([places, places[:1]])).contains_points(cells.points)
        part = _clipped(places, low, high)
        whole, inside = abs(ring_area(places)), abs(ring_area(part)) if len(part) else 0.0
        share = 1 - inside / whole if whole > 0 else 0.0
        _refuse_outside(path, share, (places.min(axis=0), places.max(axis=0)), store, cells)
    return Observed(covered, depth)


def _clipped(corners: Array, low: Array, high: Array) -> Array:
    """Corners of the part of a polygon within a box (Sutherland & Hodgman 1974)."""
    for axis in (0, 1):
        for sign, edge in ((1, high[axis]), (-1, -low[axis])):
            kept = []
            for start, end in zip(corners, np.roll(corners, -1, axis=0), strict=True):
                a, b = sign * start[axis] - edge, sign * end[axis] - edge
                if a <= 0:
                    kept.append(start)
                if a * b < 0:
                    kept.append(start + a / (a - b) * (end - start))
            corners = np.array(kept).reshape(-1, 2)
    return corners


def _table(path: Path) -> pd.DataFrame:
    """Give the places of a file as the columns x, y and perhaps depth."""
    try:
        if path.suffix.lower() == ".nc":
            with xr.open_dataset(path) as survey:
                table = survey["depth"].to_dataframe().reset_index().dropna(subset=["depth"])
        else:
            if (found := text_table.obstacle(path)) is not None:
                raise ValueError(f"found {found}")
            try:
                # a row with a cell too many would be shifted, or cut, with a warning alone
                with warnings.catch_warnings(action="error", category=pd.errors.ParserWarning):
                    table = pd.read_csv(path, index_col=False)
            except (pd.errors.ParserError, pd.errors.ParserWarning):
                raise ValueError("found lines of another number of values") from None
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
