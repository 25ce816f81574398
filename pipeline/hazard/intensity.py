"""Classes of intensity by depth and speed, and levels of hazard by intensity and return period."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import partial

import numpy as np
import xarray as xr
from numpy.typing import NDArray

from pipeline.assess.ensemble import periods
from pipeline.assess.probability import BOUNDS, Bounds, in_parts, share
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


def shares(runs: xr.Dataset, settings: Hazard) -> Bounds:
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


def usual(shares: Bounds, least: float) -> Bounds:
    """Give the highest class that a least share of the runs reaches, ``UNKNOWN`` where none was computed."""
    found = {}
    for bound in BOUNDS:
        values = shares[bound]
        enough = (values >= least - ROUND_OFF).sum("intensity_class")
        found[bound] = enough.where(values.notnull().all("intensity_class"), UNKNOWN).astype(np.int8)
    return found


@dataclass(frozen=True)
class OfPeriod:
    """Classes of intensity of the events of one return period, or of one class of periods.

    Parameters
    ----------
    shortest, longest : float
        Years.
    classes : Bounds
        By bound, over y and x, ``UNKNOWN`` where no run was computed.
    """

    shortest: float
    longest: float
    classes: Bounds


def by_period(runs: xr.Dataset, settings: Hazard) -> list[OfPeriod]:
    """Give the class of intensity that a least share of the runs of each return period reaches.

    Parameters
    ----------
    runs : Dataset
        An ensemble with return periods, years.
    settings : Hazard
        For the matrix of intensity, the share of runs that makes a class, and the classes that return periods
        are put into where they are many.
    """
    found = []
    for period in periods(runs, settings.levels.return_periods):
        some = runs.isel(run=period.runs).assign_coords(weight=("run", period.weight))
        classes = usual(shares(some, settings), settings.share)
        found.append(OfPeriod(period.shortest, period.longest, classes))
    return found


def levels(of_periods: Sequence[OfPeriod], matrix: Levels) -> Bounds:
    """Give the level of hazard: the highest over the return periods, each by the classes of its own runs."""
    found: Bounds = {}
    for each in of_periods:
        column = int(np.searchsorted(np.asarray(matrix.return_periods), each.longest))
        for bound, classes in each.classes.items():
            level = _level(classes, matrix, column)
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
