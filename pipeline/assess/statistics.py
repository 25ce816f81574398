"""Statistics over runs of which some are not known: weighted, with bounds that hold whatever those are."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray

Array = NDArray[np.float64]


@dataclass(frozen=True)
class Bounded:
    """A number of the runs that are known, and between which bounds that of all runs lies.

    Each has the shape of what was asked for, or is NaN where nothing is known.
    """

    lower: Array
    estimate: Array
    upper: Array


@dataclass(frozen=True)
class Values:
    """A quantity of runs.

    value : (runs,) NaN where it is not known. weight : (runs,) share of each run, their sum is 1.
    at_least, at_most : (runs,) whether the value may be larger, or smaller, than it is known to be, as the
    reach of a run that lost material through the boundary.
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
        above = self.value > levels[..., None]
        sure = above & ~self.at_most
        possible = above | self.at_least | ~self.known
        share = self.weight[self.known].sum()
        estimate = (above * self.weight).sum(-1) / share if share else np.full(levels.shape, np.nan)
        return Bounded((sure * self.weight).sum(-1), estimate, (possible * self.weight).sum(-1))

    def quantile(self, shares: ArrayLike) -> Bounded:
        """Give the least values that are not exceeded with given probabilities, of their shape.

        The lower bound takes what is not known as below all, the upper bound as above all; a bound that is
        not finite is NaN.
        """
        levels = np.asarray(shares, np.float64)
        known = self.known
        lower = _quantile(np.where(known & ~self.at_most, self.value, -np.inf), self.weight, levels)
        upper = _quantile(np.where(known & ~self.at_least, self.value, np.inf), self.weight, levels)
        estimate = np.full(levels.shape, np.nan)
        if known.any():
            estimate = _quantile(self.value[known], self.weight[known], levels)
        return Bounded(_finite(lower), estimate, _finite(upper))


def _quantile(values: Array, weights: Array, shares: Array) -> Array:
    return np.asarray(np.quantile(values, shares, weights=weights, method="inverted_cdf"))


def _finite(values: Array) -> Array:
    return np.where(np.isfinite(values), values, np.nan)
