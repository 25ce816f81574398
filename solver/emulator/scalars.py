"""Emulators of one number a run, as the run-out, or of its logarithm, by leave-one-out."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from solver.emulator.exceedance import ALLOWANCE
from solver.emulator.levels import Draws, Levels, Predictor, fit_levels
from solver.emulator.quantiles import quantiles_of
from solver.emulator.scores import ScalarScore, scalar_score

Array = NDArray[np.float64]
Rows = NDArray[np.intp]


@dataclass(frozen=True)
class Scalar:
    """Emulator of one number a run. logarithm : whether that is emulated. score : on this scale."""

    levels: Levels
    logarithm: bool
    score: ScalarScore

    def coarsest(self) -> Scalar:
        """Give the emulator of the coarsest level alone."""
        return Scalar(self.levels.coarsest(), self.logarithm, self.score)

    def predict(self, at: Array) -> tuple[Array, Array, Array]:
        """Median and bounds of 95 % of the number at places, shape (m,) each."""
        predictor = Predictor(self.levels.parts, at)
        mean, deviation = (held[:, 0] for held in predictor(self.levels))
        ends = mean, mean - 2 * deviation, mean + 2 * deviation
        median, lower, upper = (np.exp(end) if self.logarithm else end for end in ends)
        return median, lower, upper


@dataclass(frozen=True)
class Quantiles:
    """Quantiles of a number a run, shape (shares,) each, with half widths of their errors.

    Parameters
    ----------
    discretisation : array
        NaN with one level.
    """

    values: Array
    sampling: Array
    discretisation: Array

    @property
    def total(self) -> Array:
        """Half width of sampling and discretisation together; NaN with one level."""
        return self.sampling + self.discretisation


def fit_scalar(inputs: Sequence[Array], values: Sequence[Array], pairs: Sequence[Rows]) -> Scalar:
    """Fit an emulator to one number a run, shape (runs of the level,), the coarsest level first.

    Raises
    ------
    ValueError
        If a level has too few runs.
    """
    found = []
    for logarithm in (False, True):
        if logarithm and min(float(each.min()) for each in values) <= 0:
            continue
        scaled = [(np.log(each) if logarithm else each)[:, None] for each in values]
        levels = fit_levels(inputs, scaled, pairs)
        mean, deviation = (held[:, 0] for held in levels.leave_one_out())
        # density of the runs as predicted from the others, of the number itself
        density = -0.5 * ((scaled[0][:, 0] - mean) / deviation) ** 2 - np.log(deviation)
        density -= np.log(values[0]) if logarithm else 0.0
        score = scalar_score(scaled[0][:, 0], mean, deviation)
        found.append((float(density.sum()), Scalar(levels, logarithm, score)))
    return max(found, key=lambda each: each[0])[1]


def quantiles(scalar: Scalar, shares: Sequence[float], draws: Draws, weight: Array) -> Quantiles:
    """Give quantiles of a number a run over draws.

    Parameters
    ----------
    scalar : Scalar
        Its emulator.
    shares : sequence of float
        Probabilities that are kept to.
    draws : Draws
        What they are over.
    weight : array, shape (n,)
        Share of each run of the coarsest level, their sum is 1.
    """
    found = quantiles_of(scalar.levels, shares, draws, weight)
    ends = [np.array([getattr(each, end) for each in found]) for end in ("value", "lower", "upper", "coarse")]
    value, lower, upper, coarse = (np.exp(end) if scalar.logarithm else end for end in ends)
    discretisation = allowance(value - coarse, len(scalar.levels.parts))
    return Quantiles(value, np.maximum(upper - value, value - lower), discretisation)


def allowance(change: Array, levels: int) -> Array:
    """Half width of the allowance for the spacing of numbers, shape (m,); NaN with one level.

    Parameters
    ----------
    change : array, shape (m,)
        From the coarsest level to the finest. Each number has its own, and at least twice the root mean
        square of all.
    levels : int
        How many there are.
    """
    if levels == 1:
        return np.full_like(change, np.nan)
    usual = ALLOWANCE * float(np.sqrt(np.mean(change**2)))
    found: Array = np.maximum(np.abs(change), usual)
    return found
