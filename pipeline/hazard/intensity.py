"""Classes of intensity by depth and speed, and levels of hazard by intensity and return period."""

from __future__ import annotations

from functools import partial

import numpy as np
import xarray as xr
from numpy.typing import NDArray

from pipeline.assess.exceedance import BOUNDS, Shares, in_parts, share
from pipeline.settings.hazard import Hazard, Intensity, Levels

CLASSES = ("none", "weak", "medium", "strong")
LEVELS = ("none", "residual", "low", "medium", "high")
UNKNOWN = -1
# shares are sums of weights
ROUND_OFF = 1e-9


def classes(
    depth: xr.DataArray, speed: xr.DataArray, reached: xr.DataArray, matrix: Intensity
) -> xr.DataArray:
    """Class every place of every run by its largest depth, m, and speed, m s-1; 0 where it is not reached.

    Both maxima need not be of one moment, so that a class is never too low.
    """
    found: xr.DataArray = xr.apply_ufunc(
        partial(_classes, matrix=matrix), depth, speed, reached, dask="parallelized", output_dtypes=[np.int8]
    )
    return found


def _classes(
    depth: NDArray[np.float32],
    speed: NDArray[np.float32],
    reached: NDArray[np.bool_],
    matrix: Intensity,
) -> NDArray[np.int8]:
    table = np.zeros((len(matrix.depth) + 1, len(matrix.speed)), np.int8)
    table[1:] = matrix.classes
    row = np.searchsorted(np.asarray(matrix.depth), depth)
    column = np.searchsorted(np.asarray(matrix.speed[1:]), speed)
    return np.where(reached, table[row, column], np.int8(0))


def shares(runs: xr.Dataset, settings: Hazard) -> Shares:
    """Give the share of runs that reach each class, along ``intensity_class`` 1 to 3, with bounds.

    Parameters
    ----------
    runs : Dataset
        An ensemble with the largest depth and speed, and the arrival time, which tells what was reached;
        where it was not kept, every depth above the first edge of the matrix counts.
    settings : Hazard
        For the matrix.
    """
    depth, speed = in_parts(runs["max_depth"]), in_parts(runs["max_speed"])
    reached = in_parts(runs["arrival_time"]).notnull() if "arrival_time" in runs else depth > 0
    found = classes(depth, speed, reached, settings.intensity)
    wanted = xr.DataArray([1, 2, 3], dims="intensity_class")
    held = share(found >= wanted, runs, depth.notnull() & speed.notnull())
    return {bound: values.transpose("intensity_class", ...) for bound, values in held.items()}


def usual(shares: Shares, least: float) -> Shares:
    """Give the highest class that a least share of the runs reaches, ``UNKNOWN`` where none was computed."""
    found = {}
    for bound in BOUNDS:
        values = shares[bound]
        enough = (values >= least - ROUND_OFF).sum("intensity_class")
        found[bound] = enough.where(values.notnull().all("intensity_class"), UNKNOWN).astype(np.int8)
    return found


def levels(runs: xr.Dataset, settings: Hazard) -> Shares:
    """Give the level of hazard: the highest over the classes of return period, each from its own runs.

    Parameters
    ----------
    runs : Dataset
        An ensemble with return periods, years.
    settings : Hazard
        For both matrices and the share of runs that makes a class.
    """
    runs = runs.isel(run=np.flatnonzero(runs["weight"].to_numpy() > 0))
    years = runs["return_period"].to_numpy()
    column = np.searchsorted(np.asarray(settings.levels.return_periods), years)
    found: Shares = {}
    for one in np.unique(column):
        some = runs.isel(run=np.flatnonzero(column == one))
        some = some.assign_coords(weight=some["weight"] / some["weight"].sum())
        for bound, intensity in usual(shares(some, settings), settings.share).items():
            level = _level(intensity, settings.levels, int(one))
            before = found.get(bound, level)
            unknown = (before == UNKNOWN) | (level == UNKNOWN)
            found[bound] = level.where(level > before, before).where(~unknown, UNKNOWN).astype(np.int8)
    # what the missing runs cannot change is known without them
    settled = (found[""] == UNKNOWN) & (found["_lower"] == found["_upper"])
    return found | {"": found["_lower"].where(settled, found[""])}


def _level(intensity: xr.DataArray, levels: Levels, column: int) -> xr.DataArray:
    """Look a class of intensity up in one column of the matrix; what is unknown stays so."""
    table = np.array([0, *(row[column] for row in levels.matrix), UNKNOWN], np.int8)
    found: xr.DataArray = xr.apply_ufunc(
        partial(np.take, table), intensity, dask="parallelized", output_dtypes=[np.int8]
    )
    return found
