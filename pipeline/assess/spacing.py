"""What changes from the coarsest level of a scenario to its finest, run by run."""

from __future__ import annotations

import numpy as np
import xarray as xr
from numpy.typing import NDArray

from pipeline.assess.ensemble import computed

Array = NDArray[np.float64]
Rows = NDArray[np.intp]


def root_rows(rows: Rows, count: int, whole: int) -> Rows:
    """Positions among the runs of the coarsest level of the runs of a finer one.

    Parameters
    ----------
    rows : Rows
        Positions among the finer ones.
    count, whole : int
        Draws of the finer and of the coarsest level, which each entry of a sweep has.
    """
    return rows // count * whole + rows % count


def paired(coarse: xr.Dataset, fine: xr.Dataset, entries: int) -> tuple[Rows, Rows]:
    """Give the positions of runs that are computed on both levels, coarse and fine, shape (pairs,) each.

    Parameters
    ----------
    entries : int
        Of the sweep, each of which has all draws.
    """
    rows = np.flatnonzero(computed(fine).to_numpy())
    root = root_rows(rows, fine.sizes["run"] // entries, coarse.sizes["run"] // entries)
    known = computed(coarse).to_numpy()[root]
    return root[known], rows[known]


def typical_change(coarse: Array, fine: Array, weight: Array | None = None) -> float:
    """Root mean square change of a quantity of paired runs, (pairs,) each; NaN where none is known.

    weight : of each pair, by default all the same.
    """
    known = np.isfinite(coarse) & np.isfinite(fine)
    return float(np.sqrt(_mean((fine - coarse)[known] ** 2, None if weight is None else weight[known])))


def flips(coarse: NDArray[np.bool_], fine: NDArray[np.bool_], weight: Array | None = None) -> float:
    """Share of paired runs, by their weight, that are above a threshold on one level alone; NaN without any.

    The probability to be above it changes by no more among these runs.
    """
    return _mean((coarse != fine).astype(np.float64), weight)


def _mean(values: Array, weight: Array | None) -> float:
    weight = np.ones(len(values)) if weight is None else weight
    return float(weight @ values / weight.sum()) if weight.sum() > 0 else float("nan")
