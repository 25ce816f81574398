"""Quantiles of one output over many draws, with the error of what few runs leave open."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.optimize import brentq
from scipy.special import ndtr

from solver.emulator.exceedance import PATHS
from solver.emulator.levels import Draws, Levels, Predictor, scaled_paths
from solver.emulator.scores import TWO_SIDED, exceedance_score

Array = NDArray[np.float64]
# deviations beyond the outermost means that a quantile is looked for in
BEYOND = 8.0


@dataclass(frozen=True)
class Quantile:
    """A quantile of one output.

    Parameters
    ----------
    value : float
        On the finest level.
    lower, upper : float
        95 % interval of what few runs leave open.
    coarse : float
        On the coarsest level.
    """

    value: float
    lower: float
    upper: float
    coarse: float


def quantile(levels: Levels, share: float, draws: Draws, weight: Array) -> Quantile:
    """Give the value that an output keeps to with a probability.

    Its interval is that between the quantiles of the probabilities that the share may be, by the variance of
    the probability to be above the value, as `emulator.exceedance` has it.

    Parameters
    ----------
    levels : Levels
        Emulator of one output.
    share : float
        Probability, between 0 and 1.
    draws : Draws
        What it is over.
    weight : array, shape (n,)
        Share of each run of the coarsest level, their sum is 1.
    """
    at = Predictor(levels.parts, draws.at)
    mean, deviation = (held[:, 0] for held in at(levels))
    value = _solve(mean, deviation, draws.share, share)
    score = exceedance_score(levels.outputs[0] > value, *levels.leave_one_out(), value, weight)
    each = ndtr((mean - value) / deviation)
    unsharp = max(float(score.brier[0]), score.calibration * float(draws.share @ (each * (1 - each))))
    paths = scaled_paths(levels.parts, draws.at[draws.first], PATHS)
    whole = sum(np.sqrt(scale[0]) * path for scale, path in zip(levels.scales, paths, strict=True))
    exceeds = mean[draws.first, None] + whole > value
    over_paths = float((draws.share_of_first @ exceeds).var(ddof=1))
    half = TWO_SIDED * np.sqrt(score.calibration * over_paths + unsharp * float(weight @ weight))
    least = 1e-6
    low, high = (float(np.clip(share + sign * half, least, 1 - least)) for sign in (-1, 1))
    mean_coarse, deviation_coarse = (held[:, 0] for held in at(levels, only_coarsest=True))
    return Quantile(
        value,
        _solve(mean, deviation, draws.share, low),
        _solve(mean, deviation, draws.share, high),
        _solve(mean_coarse, deviation_coarse, draws.share, share),
    )


def _solve(mean: Array, deviation: Array, weight: Array, share: float) -> float:
    """Find the value that a mixture of normal distributions keeps to with a probability."""
    low, high = (mean - BEYOND * deviation).min(), (mean + BEYOND * deviation).max()

    def over(value: float) -> float:
        return float(weight @ ndtr((value - mean) / deviation)) - share

    return float(brentq(over, low, high, xtol=1e-9 * max(high - low, 1e-12)))
