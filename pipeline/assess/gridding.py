"""A cloud's store on the points of a lattice."""

from __future__ import annotations

import json
from collections.abc import Callable
from functools import lru_cache, partial
from typing import TYPE_CHECKING

import numpy as np
import xarray as xr
from numpy.typing import NDArray
from scipy.interpolate import make_interp_spline

from pipeline.assess.frames import on_surface
from pipeline.settings.section import Pair
from pipeline.store.variables import COORDINATES, GROUND, SURFACE_COORDINATES

if TYPE_CHECKING:
    from solver.lmls.gridding import Gridding

Array = NDArray[np.float64]


def gridded(store: xr.Dataset, spacing: float) -> xr.Dataset:
    """Evaluate the fields of a cloud's store at the points of a lattice, by LMLS.

    Depths are scaled frame by frame so that the lattice holds the same volume; velocities are weighted by
    depth; arrival times are those of the nearest point. What has no points stays as it is.

    Parameters
    ----------
    store : Dataset
        A scenario's store, opened with or without Dask; one that was loaded is computed at once.
    spacing : float
        Of the lattice, m.

    Returns
    -------
    Dataset
        With the dimensions ``y`` and ``x`` in place of ``point``, as a lattice's store has them.

    Raises
    ------
    ValueError
        If the store is not that of a cloud.
    """
    if "point" not in store.dims:
        raise ValueError("the store is not that of a cloud: it has no dimension 'point'")
    domain = json.loads(store.attrs["domain"])
    points = np.stack([store["x"].to_numpy(), store["y"].to_numpy()], axis=1)
    about = points.tobytes(), tuple(domain["x"]), tuple(domain["y"]), spacing
    built = store["building"].to_numpy() == 1 if "building" in store.variables else None
    # the ground goes on below buildings
    ground_grid = _gridding(*about)
    grid = ground_grid if built is None else _gridding(*about, built.tobytes())
    ways: dict[str, Callable[..., Array]] = {
        "depth": grid.keeping_integral,
        "deposit_depth": grid.keeping_integral,
        "arrival_time": grid.nearest,
    }
    result = store.drop_dims("point")
    for name, field in store.data_vars.items():
        if "point" not in field.dims:
            continue
        given = (store["depth"], field) if str(name).startswith("velocity") else (field,)
        way = grid.velocity if len(given) == 2 else ways.get(str(name), grid.within_range)
        result[name] = _apply(way, given, grid.lattice.shape).assign_attrs(field.attrs)
    axes = {"x": grid.lattice.x_points, "y": grid.lattice.y_points}
    ground = on_surface(store)
    known = {v.name: v.cf_attributes for v in (SURFACE_COORDINATES if ground else COORDINATES)}
    result = result.assign_coords({name: (name, at, known[name]) for name, at in axes.items()})
    if built is not None:
        stands = grid.nearest(store["building"].to_numpy())
        result = result.assign_coords(building=(("y", "x"), stands, store["building"].attrs))
    if ground:
        return _with_ground(result, store, ground_grid)
    along, first = np.unique(store["x"].to_numpy(), return_index=True)
    profile = [name for name in ("elevation", "horizontal_distance") if name in store.variables]
    for name in profile:
        line = make_interp_spline(along, store[name].to_numpy()[..., first], k=1, axis=-1)
        dims = (*store[name].dims[:-1], "x")
        result[name] = (dims, line(axes["x"]), store[name].attrs)
    return result.set_coords([name for name in profile if name in store.coords])


def _with_ground(result: xr.Dataset, store: xr.Dataset, grid: Gridding) -> xr.Dataset:
    """Give the elevation and the area of cells on the bed at the points of the lattice."""
    steepness = store["area"] / store["plan_area"] if "area" in store.variables else None
    for name, given, times in (
        ("elevation", store.get("elevation"), 1.0),
        ("area", steepness, grid.lattice.cell_area),
        ("vertical_extent", store.get("vertical_extent"), 1.0),
    ):
        if given is None:
            continue
        values = np.atleast_2d(given.to_numpy().astype(np.float64))
        # where there is no data near a place, there is none at it
        laid = [
            np.where(np.isnan(grid.nearest(each)), np.nan, grid.unlimited(_filled(each))) * times
            for each in values
        ]
        dims = (*given.dims[:-1], "y", "x")
        held = np.array(laid) if given.ndim > 1 else laid[0]
        result[name] = (dims, held, store[name].attrs)
    return result.set_coords([name for name in GROUND if name in store.coords])


def _filled(values: Array) -> Array:
    """Put the mean of what is known in place of what is not, which is left out afterwards."""
    unknown = np.isnan(values)
    return np.where(unknown, values[~unknown].mean() if not unknown.all() else 0.0, values)


@lru_cache(maxsize=4)
def _gridding(points: bytes, x: Pair, y: Pair, spacing: float, buildings: bytes | None = None) -> Gridding:
    """Prepare the approximation, once for all runs on a cloud.

    points, buildings : float64 of shape (n, 2), m, and bool of shape (n,).
    """
    # kernels take longer to import than a store to open
    from solver.lmls.gridding import gridding
    from solver.points.cloud import PointCloud
    from solver.points.lattice import Lattice

    cloud = PointCloud(np.frombuffer(points).reshape(-1, 2), x, y)
    built = None if buildings is None else np.frombuffer(buildings, bool)
    return gridding(cloud, Lattice(x, y, spacing), built)


def _apply(
    way: Callable[..., Array], given: tuple[xr.DataArray, ...], shape: tuple[int, int]
) -> xr.DataArray:
    """Apply a function of values (n,) frame by frame, in single precision as the store has it."""
    found: xr.DataArray = xr.apply_ufunc(
        partial(_frames, way, shape),
        *given,
        input_core_dims=[["point"]] * len(given),
        output_core_dims=[["y", "x"]],
        dask="parallelized",
        output_dtypes=[np.float32],
        dask_gufunc_kwargs={"output_sizes": dict(zip(("y", "x"), shape, strict=True)), "allow_rechunk": True},
    )
    return found


def _frames(way: Callable[..., Array], shape: tuple[int, int], *given: Array) -> NDArray[np.float32]:
    leading = given[0].shape[:-1]
    found = np.empty((*leading, *shape), np.float32)
    for index in np.ndindex(*leading):
        found[index] = way(*(values[index].astype(np.float64) for values in given))
    return found
