"""Shares of runs that exceed something, with bounds for the runs nobody knows; weighted quantiles."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
import xarray as xr
from numpy.typing import NDArray

from pipeline.assess.ensemble import RUNS_AT_ONCE
from pipeline.store.variables import COMPUTED, Status

# a share, and what it is called with its bounds
Shares = dict[str, xr.DataArray]
BOUNDS = ("", "_lower", "_upper")
# values of all runs that are sorted at once
SORTED_AT_ONCE = 6_000_000


def share(exceeds: xr.DataArray, runs: xr.Dataset, known: xr.DataArray | None = None) -> Shares:
    """Weigh the runs that exceed something.

    Parameters
    ----------
    exceeds : DataArray of bool
        Over ``run`` and what else there is.
    runs : Dataset
        The ensemble, for ``status`` and ``weight``.
    known : DataArray of bool, optional
        Where values are; by default everywhere.

    Returns
    -------
    dict of str to DataArray
        ``""``, the share among the runs that were computed, overrun ones included, missing where there is
        none; ``_lower`` and ``_upper``, the share of all planned ones if none of the failed and pending runs
        exceeds and overrun ones where they were seen to, and if all of these do.
    """
    weight, status = runs["weight"], runs["status"]
    if known is None:
        known = xr.ones_like(status, dtype=bool)
    computed = known & status.isin(COMPUTED)
    held = _total(computed, weight)
    lower = _total(exceeds & computed, weight)
    found = lower / held.where(held > 0)
    # of a run that lost material, what exceeds is known, and what does not is not
    settled = computed & (exceeds | (status == Status.DONE))
    upper = lower + (1 - _total(settled, weight))
    # sums of weights end a little off 0 and 1
    return {
        "": found.clip(0, 1),
        "_lower": lower.clip(0, 1),
        "_upper": upper.clip(0, 1),
    }


def exceedance(field: xr.DataArray, thresholds: Sequence[float], runs: xr.Dataset, dim: str) -> Shares:
    """Give the share of runs above each threshold, along a new first dimension, with bounds as `share` does.

    A missing value of a run that was done counts as unknown, not as dry.
    """
    field = in_parts(field)
    above = xr.DataArray(np.asarray(thresholds, np.float64), dims=dim)
    found = share(field > above, runs, field.notnull())
    return {bound: values.transpose(dim, ...) for bound, values in found.items()}


def mean_arrival(arrival: xr.DataArray, runs: xr.Dataset) -> xr.DataArray:
    """Give the weighted mean time of arrival, s, of the computed runs that arrive; missing without one."""
    arrival = in_parts(arrival)
    there = arrival.notnull() & runs["status"].isin(COMPUTED)
    held = _total(there, runs["weight"])
    times = _total(arrival.where(there, 0.0), runs["weight"])
    return times / held.where(held > 0)


def quantiles(field: xr.DataArray, levels: Sequence[float], runs: xr.Dataset) -> xr.DataArray:
    """Give the smallest value that at least a share of the computed runs keeps to, for each share.

    Cells are taken in blocks, each read and sorted by itself, so that memory does not grow with the store.

    Parameters
    ----------
    field : DataArray
        Over ``run``, ``y`` and ``x``.
    levels : sequence of float
        Shares, above 0 and at most 1.
    runs : Dataset
        The ensemble.

    Returns
    -------
    DataArray
        Over ``quantile``, ``y`` and ``x``; missing where no run was computed.
    """
    computed = runs["status"].isin(COMPUTED).to_numpy()
    field = field.isel(run=np.flatnonzero(computed))
    weight = runs["weight"].to_numpy()[computed]
    found = np.full((len(levels), *field.shape[1:]), np.nan)
    rows = max(1, SORTED_AT_ONCE // max(1, field.sizes["run"] * field.shape[-1]))
    for start in range(0, field.shape[1], rows) if weight.sum() > 0 else ():
        block = slice(start, start + rows)
        found[:, block] = _quantiles(field.isel({field.dims[1]: block}).to_numpy(), weight, levels)
    return xr.DataArray(found, dims=("quantile", *field.dims[1:]), coords={"quantile": list(levels)})


def in_parts(field: xr.DataArray) -> xr.DataArray:
    """Cut a lazy field into few runs at once: what is made of them is larger than they are."""
    return field.chunk({"run": RUNS_AT_ONCE}) if field.chunks else field


def _total(values: xr.DataArray, weight: xr.DataArray) -> xr.DataArray:
    found: xr.DataArray = xr.dot(values.astype(np.float64), weight.drop_vars(list(weight.coords)), dim="run")
    return found


def _quantiles(
    values: NDArray[np.float32], weight: NDArray[np.float64], levels: Sequence[float]
) -> NDArray[np.float64]:
    """Weighted quantiles along the first axis: (runs, ...) to (levels, ...); missing ones have no weight."""
    # the values of a cell side by side: several times faster to sort and to follow
    cells = np.ascontiguousarray(values.reshape(len(values), -1).T)
    order = np.argsort(cells, axis=1)
    ordered = np.take_along_axis(cells, order, axis=1)
    held = weight[order]
    held[np.isnan(ordered)] = 0.0
    held = np.cumsum(held, axis=1, out=held)
    total = held[:, -1:]
    found = np.empty((len(levels), len(cells)))
    for i, level in enumerate(levels):
        # a sum of weights that ends a little below the level has reached it
        at = np.argmax(held >= level * total * (1 - 1e-12), axis=1)
        found[i] = np.take_along_axis(ordered, at[:, None], axis=1)[:, 0]
    found[:, total[:, 0] == 0] = np.nan
    return found.reshape(len(levels), *values.shape[1:])
