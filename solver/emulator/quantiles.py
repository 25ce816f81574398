"""Quantiles of one output over many draws, with the error of what few runs leave open."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.optimize import brentq

from solver.emulator.exceedance import PATHS, over_paths
from solver.emulator.levels import Draws, Levels, Predictor, scaled_paths
from solver.emulator.mixtures import below
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
        95 % interval of what few runs, and so many draws, leave open.
    coarse : float
        On the coarsest level.
    """

    value: float
    lower: float
    upper: float
    coarse: float


def quantiles_of(levels: Levels, shares: Sequence[float], draws: Draws, weight: Array) -> list[Quantile]:
    """Give the values that an output keeps to with given probabilities.

    An interval is that between the quantiles of the probabilities that the share may be, by the variance of
    the probability to be above the value, as `emulator.exceedance` has it: of few runs, and of so many draws.

    Parameters
    ----------
    levels : Levels
        Emulator of one output.
    shares : sequence of float
        Probabilities, between 0 and 1.
    draws : Draws
        What they are over.
    weight : array, shape (n,)
        Share of each run of the coarsest level, their sum is 1.
    """
    at = Predictor(levels.parts, draws.at)
    mean, deviation = (held[:, 0] for held in at(levels))
    coarse = [held[:, 0] for held in at(levels, only_coarsest=True)]
    paths = scaled_paths(levels.parts, draws.few.at, PATHS)
    roots, along = np.sqrt(np.stack(levels.scales)), np.stack(paths)
    predicted = levels.leave_one_out()
    found = []
    for share in shares:
        value = _solve(mean, deviation, draws.share, share)
        score = exceedance_score(levels.outputs[0], *predicted, value, weight)
        each = np.asarray(below((mean - value) / deviation), np.float64)
        unsharp = max(float(score.brier[0]), score.calibration * float(draws.share @ (each * (1 - each))))
        spread = float(over_paths((mean - value)[None, draws.first], roots, along, draws.few)[0])
        variance = score.calibration * spread + unsharp * float(weight @ weight) + draws.variance(each)
        half, least = TWO_SIDED * np.sqrt(variance), 1e-6
        low, high = (float(np.clip(share + sign * half, least, 1 - least)) for sign in (-1, 1))
        lower, upper = (_solve(mean, deviation, draws.share, end) for end in (low, high))
        found.append(Quantile(value, lower, upper, _solve(coarse[0], coarse[1], draws.share, share)))
    return found


def _solve(mean: Array, deviation: Array, weight: Array, share: float) -> float:
    """Find the value that a mixture of normal distributions keeps to with a probability."""
    low, high = (mean - BEYOND * deviation).min(), (mean + BEYOND * deviation).max()

    def over(value: float) -> float:
        return float(weight @ below((value - mean) / deviation)) - share

    return float(brentq(over, low, high, xtol=1e-9 * max(high - low, 1e-12)))
