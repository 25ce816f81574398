"""Probabilities and quantiles over runs: weighted, with bounds that hold whatever the unknown runs are.

A run is known where it was computed, and unknown where it failed or is pending. It is censored where it lost
material through an open side, or still moved at its end: what it exceeded counts, what it did not exceed is
unknown.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np
import xarray as xr
from numpy.typing import ArrayLike, NDArray

from pipeline.assess.ensemble import RUNS_AT_ONCE, censored, computed

Array = NDArray[np.float64]
# an estimate with its bounds, and what each is called by
Bounds = dict[str, xr.DataArray]
BOUNDS = ("", "_lower", "_upper")
# values of all runs that are sorted at once
SORTED_AT_ONCE = 6_000_000
# sums of weights end so many digits after the point a little off what they are
DIGITS = 12


@dataclass(frozen=True)
class Bounded:
    """A number of the runs that are known, and between which bounds that of all planned runs lies.

    Each has the shape of what was asked for. An estimate is NaN where nothing is known; a bound that no run
    gives is infinite.
    """

    lower: Array
    estimate: Array
    upper: Array

    @property
    def by_bound(self) -> dict[str, Array]:
        """The same by the endings of `BOUNDS`."""
        return dict(zip(BOUNDS, (self.estimate, self.lower, self.upper), strict=True))


@dataclass(frozen=True)
class Values:
    """A quantity of runs.

    Parameters
    ----------
    value : (runs,) array
        NaN where it is not known, -inf of a run that has none of it.
    weight : (runs,) array
        Share of each run, their sum is 1.
    at_least, at_most : (runs,) array
        Whether the value may be larger, or smaller, than it is known to be, as the reach of a run that
        lost material through the boundary.
    """

    value: Array
    weight: Array
    at_least: NDArray[np.bool_]
    at_most: NDArray[np.bool_]

    @property
    def known(self) -> NDArray[np.bool_]:
        """Whether each run has a value, shape (runs,)."""
        return ~np.isnan(self.value)

    def exceedance(self, thresholds: ArrayLike) -> Bounded:
        """Give the probability of a value above thresholds, of their shape.

        The lower bound takes what is not known as below them, the upper bound as above them.
        """
        levels = np.asarray(thresholds, np.float64)
        above = xr.DataArray(self.value > levels.reshape(-1, 1), dims=("threshold", "run"))
        known, at_least, at_most, weight = (
            xr.DataArray(each, dims="run") for each in (self.known, self.at_least, self.at_most, self.weight)
        )
        found = _probability(above & ~at_most, above, above | at_least | ~known, known, weight)
        lower, estimate, upper = (
            found[bound].to_numpy().reshape(levels.shape) for bound in ("_lower", "", "_upper")
        )
        return Bounded(lower, estimate, upper)

    def quantile(self, shares: ArrayLike) -> Bounded:
        """Give the least values that are not exceeded with given probabilities, of their shape.

        The lower bound takes what is not known as below all, the upper bound as above all. Where a bound is
        infinite, as too many runs are censored or unknown, there is no estimate.
        """
        levels = np.asarray(shares, np.float64)
        low = np.where(self.known & ~self.at_most, self.value, -np.inf)
        high = np.where(self.known & ~self.at_least, self.value, np.inf)
        lower, estimate, upper = (
            _quantiles(values[:, None], self.weight, levels.ravel()).reshape(levels.shape)
            for values in (low, self.value, high)
        )
        estimate = np.where(np.isfinite(lower) & np.isfinite(upper), estimate, np.nan)
        return Bounded(lower, estimate, upper)


def in_words(
    lower: float, estimate: float, upper: float, write: Callable[[float], str] = "{:.4g}".format
) -> str:
    """Write a quantile with its bounds: ``120``, ``120 (118 to 123)``, ``above 136``, ``none``."""
    if lower == upper:
        return "none" if lower == -np.inf else write(lower)
    if np.isinf(lower) and np.isinf(upper):
        return "unknown"
    if np.isinf(upper):
        return f"above {write(lower)}"
    return (
        f"below {write(upper)}"
        if np.isinf(lower)
        else f"{write(estimate)} ({write(lower)} to {write(upper)})"
    )


def share(exceeds: xr.DataArray, runs: xr.Dataset, known: xr.DataArray | None = None) -> Bounds:
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
        ``""``, the share among the runs that were computed, censored ones included, missing where there is
        none; ``_lower`` and ``_upper``, the share of all planned ones if none of the failed and pending runs
        exceeds and censored ones where they were seen to, and if all of these do.
    """
    certain = computed(runs) if known is None else known & computed(runs)
    exceeds = exceeds & certain
    return _probability(exceeds, exceeds, exceeds | censored(runs) | ~certain, certain, runs["weight"])


def exceedance(field: xr.DataArray, thresholds: Sequence[float], runs: xr.Dataset, dim: str) -> Bounds:
    """Give the share of runs above each threshold, along a new first dimension, with bounds as `share` does.

    A missing value of a run that was done counts as unknown, not as dry.
    """
    field = in_parts(field)
    above = xr.DataArray(np.asarray(thresholds, np.float64), dims=dim)
    found = share(field > above, runs, field.notnull())
    return {bound: values.transpose(dim, ...) for bound, values in found.items()}


def mean_arrival(arrival: xr.DataArray, runs: xr.Dataset) -> xr.DataArray:
    """Give the weighted mean time of arrival, s, of the computed runs that arrive; missing without one."""
    return mean_of(arrival, runs)


def mean_of(field: xr.DataArray, runs: xr.Dataset) -> xr.DataArray:
    """Give the weighted mean of the computed runs that have a value; missing without one."""
    field = in_parts(field)
    there = field.notnull() & computed(runs)
    held = _total(there, runs["weight"])
    total = _total(field.where(there, 0.0), runs["weight"])
    return total / held.where(held > 0)


def earliest_arrival(arrival: xr.DataArray, runs: xr.Dataset) -> xr.DataArray:
    """Give the first time of arrival, s, of any computed run of a weight above 0; missing without one."""
    counted = computed(runs) & (runs["weight"] > 0)
    times = in_parts(arrival).where(counted.drop_vars(list(counted.coords)))
    # of cells that no run reaches NumPy would warn
    first = times.fillna(np.inf).min("run", skipna=False)
    found: xr.DataArray = first.where(first < np.inf)
    return found


def quantiles(field: xr.DataArray, levels: Sequence[float], runs: xr.Dataset, least: float = 0.0) -> Bounds:
    """Give the smallest value that at least a share of the runs keeps to, for each share.

    Cells are taken in blocks, each read and sorted by itself, so that memory does not grow with the store.

    Parameters
    ----------
    field : DataArray
        Over ``run``, ``y`` and ``x``.
    levels : sequence of float
        Shares, above 0 and at most 1.
    runs : Dataset
        The ensemble.
    least : float
        What no value of the quantity is below; -inf of one that grows and falls, of which censored runs may
        have had less too.

    Returns
    -------
    dict of str to DataArray
        Over ``quantile``, ``y`` and ``x``. ``""``, that of the computed runs, missing where there is none;
        ``_lower`` and ``_upper``, that of all planned runs if unknown values are the least, and if they and
        those of censored runs are above all others, missing where it is then infinite.
    """
    known, settled = computed(runs).to_numpy(), (computed(runs) & ~censored(runs)).to_numpy()
    weight = runs["weight"].to_numpy()
    found = {bound: np.full((len(levels), *field.shape[1:]), np.nan) for bound in BOUNDS}
    if settled.all():
        # a sum of weights that is 1 in all of them
        known = np.ones_like(known)
    rows = max(1, SORTED_AT_ONCE // max(1, field.sizes["run"] * field.shape[-1]))
    for start in range(0, field.shape[1], rows):
        block = slice(start, start + rows)
        values = field.isel({field.dims[1]: block}).to_numpy()
        if weight[known].sum() > 0:
            found[""][:, block] = _quantiles(values[known], weight[known], levels)
        missing = np.isnan(values) | ~known[:, None, None]
        if settled.all() and not missing.any():
            found["_lower"][:, block] = found["_upper"][:, block] = found[""][:, block]
            continue
        open_ended = missing | ~settled[:, None, None]
        unknown = open_ended if np.isinf(least) else missing
        lower = _quantiles(np.where(unknown, least, values), weight, levels)
        found["_lower"][:, block] = np.where(np.isinf(lower), np.nan, lower)
        upper = _quantiles(np.where(open_ended, np.inf, values), weight, levels)
        found["_upper"][:, block] = np.where(np.isinf(upper), np.nan, upper)
    dims, coords = ("quantile", *field.dims[1:]), {"quantile": list(levels)}
    return {bound: xr.DataArray(values, dims=dims, coords=coords) for bound, values in found.items()}


def in_parts(field: xr.DataArray) -> xr.DataArray:
    """Cut a lazy field into few runs at once: what is made of them is larger than they are."""
    return field.chunk({"run": RUNS_AT_ONCE}) if field.chunks else field


def _probability(
    sure: xr.DataArray,
    exceeds: xr.DataArray,
    possible: xr.DataArray,
    known: xr.DataArray,
    weight: xr.DataArray,
) -> Bounds:
    """Weigh the runs that surely, as far as is known, and possibly exceed; the estimate is of known ones."""
    held = _total(known, weight)
    lower, upper = (_total(runs, weight).round(DIGITS).clip(0, 1) for runs in (sure, possible))
    found = (_total(exceeds, weight) / held.where(held > 0)).round(DIGITS)
    # the estimate is rounded as its bounds are, and never outside them
    found = found.where(found > lower, lower).where(found < upper, upper)
    return {"": found.where(held > 0), "_lower": lower, "_upper": upper}


def _total(values: xr.DataArray, weight: xr.DataArray) -> xr.DataArray:
    found: xr.DataArray = xr.dot(values.astype(np.float64), weight.drop_vars(list(weight.coords)), dim="run")
    return found


def _quantiles(values: NDArray[np.floating], weight: Array, levels: Sequence[float] | Array) -> Array:
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
