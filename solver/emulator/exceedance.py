"""Probabilities to be above thresholds over many draws, with the variance of what few runs leave open."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from solver.emulator.levels import Draws, Levels, Predictor, scaled_paths, variance_of_draws
from solver.emulator.mixtures import NORMAL, Floats, shares_above, variance_over_paths
from solver.emulator.scores import TWO_SIDED, ExceedanceScore, exceedance_score

Array = NDArray[np.float64]
Rows = NDArray[np.intp]

# outputs whose draws are held at once
OUTPUTS_AT_ONCE = 1000
PATHS = 100
# outputs that fewer of the first draws exceed, or all but fewer, are looked at no further
CERTAIN = 1e-4
# what the number of draws and the choices of the method leave open
REST = 0.0025
# probabilities whose change between levels is typical
TYPICAL = (0.01, 0.99)
ALLOWANCE = 2.0
SINGLE = np.dtype(np.float32)


@dataclass(frozen=True)
class Exceedance:
    """Probabilities of outputs to be above a threshold, shape (c,) each.

    Parameters
    ----------
    probability : array
        On the finest level.
    coarse : array
        On the coarsest one; its difference to the finest is over the few draws.
    variance : array
        Of the probability over what the runs leave open.
    score : ExceedanceScore
        By leave-one-out.
    levels : int
        How many.
    past : array or float
        Half width of what draws beyond the computed runs add, where runs are missing there.
    """

    probability: Array
    coarse: Array
    variance: Array
    score: ExceedanceScore
    levels: int
    past: Array | float = 0.0

    @property
    def sampling(self) -> Array:
        """Half the width of the 95 % interval of what few runs leave open, and missing ones."""
        half: Array = np.hypot(TWO_SIDED * np.sqrt(self.variance), self.past)
        return half

    @property
    def typical_change(self) -> float:
        """Root mean square change between the levels where it is not certain; NaN without any such output."""
        low, high = TYPICAL
        open_ended = (self.probability > low) & (self.probability < high)
        change = (self.probability - self.coarse)[open_ended]
        return float(np.sqrt(np.mean(change**2))) if change.size else float("nan")

    def discretisation(self, typical: float | None = None) -> Array:
        """Give an allowance for the finest spacing; NaN with one level, which says nothing of it.

        It is the change from the coarsest level to the finest, and where the probability is neither next to 0
        nor to 1 at least twice the typical change: differences of levels vary in sign from place to place.
        """
        if self.levels == 1:
            return np.full_like(self.probability, np.nan)
        change = np.abs(self.probability - self.coarse)
        usual = self.typical_change if typical is None else typical
        low, high = TYPICAL
        open_ended = (self.probability > low) & (self.probability < high)
        return np.where(open_ended, np.fmax(change, ALLOWANCE * usual), change)

    def total(self, typical: float | None = None) -> Array:
        """Half width of sampling and discretisation together; NaN with one level."""
        return self.sampling + self.discretisation(typical) + REST


def exceedance(levels: Levels, level: float, draws: Draws, weight: Array) -> Exceedance:
    """Give the probabilities of the outputs of an emulator to be above one level, see `exceedances`."""
    return exceedances(levels, [level], draws, weight)[0]


def exceedances(levels: Levels, asked: Sequence[float], draws: Draws, weight: Array) -> list[Exceedance]:
    """Give the probabilities of the outputs of an emulator to be above each of some levels.

    ``p = mean over draws of Phi((mean - level) / deviation)``, moved by what is systematic of the offset of
    the runs from their predictions: at a jump an emulator is off alike for many runs. Its variance is that
    over paths of the emulator, times the calibration of the score, the Brier score over the number of
    runs, and that of the number of draws. An output that all runs agree on is above a level or it is not.

    Parameters
    ----------
    levels : Levels
        The emulator.
    asked : sequence of float
        Thresholds of its outputs.
    draws : Draws
        What the probabilities are over.
    weight : array, shape (n,)
        Share of each run of the coarsest level, their sum is 1.
    """
    predicted, few = levels.leave_one_out(), draws.few
    found = [
        _Sums(level, exceedance_score(levels.outputs[0], *predicted, level, weight), levels)
        for level in asked
    ]
    at_first, at_all = (Predictor(levels.parts, each.at, single=True) for each in (few, draws))
    paths = np.stack(scaled_paths(levels.parts, few.at, PATHS)).astype(SINGLE)
    for start in range(0, levels.outputs[0].shape[1], OUTPUTS_AT_ONCE):
        block = levels.of(slice(start, start + OUTPUTS_AT_ONCE))
        means = at_first.means(block)
        uncertain = [each.roughly(start, at_first, few, block, means) for each in found]
        some = np.flatnonzero(np.any(uncertain, axis=0))
        if not some.size:
            continue
        part = block.of(some)
        whole, of_paths = at_all.means(part)[-1], np.ascontiguousarray(means[-1][:, some].T)
        scales = np.stack(part.scales)
        for each, open_ended in zip(found, uncertain, strict=True):
            rows, columns = start + some[open_ended[some]], np.flatnonzero(open_ended[some])
            each.fully(rows, columns, at_all, draws, scales, whole)
            each.over_paths(rows, columns, scales, of_paths, paths, few)
    return [each.exceedance(levels, 1 / float(weight @ weight)) for each in found]


class _Sums:
    """What is added up of one level, over all outputs.

    Parameters
    ----------
    level : float
        The level.
    score : ExceedanceScore
        Of it.
    levels : Levels
        The emulator of all outputs.
    """

    def __init__(self, level: float, score: ExceedanceScore, levels: Levels) -> None:
        self.level, self.score, self.several = level, score, len(levels.parts) > 1
        count = levels.outputs[0].shape[1]
        self.probability, self.coarse, self.spread, self.variance = np.zeros((4, count))

    def roughly(
        self, start: int, at: Predictor, few: Draws, block: Levels, means: Array
    ) -> NDArray[np.bool_]:
        """Take the few draws for a block of outputs, and say which are not certain by them, (c,)."""
        scales = np.stack(block.scales)
        rough = _above(at, few, scales, means[-1], self.level)[0]
        rows = slice(start, start + len(rough))
        self.probability[rows] = self.coarse[rows] = rough
        if self.several:
            self.coarse[rows] = _above(at, few, scales[:1], means[0], self.level)[0]
        uncertain: NDArray[np.bool_] = (rough > CERTAIN) & (rough < 1 - CERTAIN)
        return uncertain

    def fully(
        self, rows: Rows, columns: Rows, at: Predictor, draws: Draws, scales: Array, mean: Array
    ) -> None:
        """Take all draws for outputs in rows, of these columns; the change of levels is of the few."""
        part = mean if len(columns) == mean.shape[1] else mean[:, columns]
        share, spread, of_draws = _above(at, draws, scales[:, columns], part, self.level)
        self.coarse[rows] += share - self.probability[rows]
        self.probability[rows] = share
        self.spread[rows], self.variance[rows] = spread, of_draws

    def over_paths(
        self, rows: Rows, columns: Rows, scales: Array, means: Floats, paths: Floats, few: Draws
    ) -> None:
        """Add the variance over paths for outputs in rows, of these columns of means of shape (c, m)."""
        found = over_paths(means[columns] - SINGLE.type(self.level), scales[:, columns] ** 0.5, paths, few)
        self.variance[rows] += self.score.calibration * found

    def exceedance(self, levels: Levels, runs: float) -> Exceedance:
        """Put the sums together; runs : how many equally weighted ones say as much."""
        score, alike = self.score, levels.alike
        for probability, of in ((self.probability, levels), (self.coarse, levels.coarsest())):
            probability[alike] = of.of_first[alike] > self.level
        unsharp = np.maximum(score.brier, score.calibration * self.spread)
        variance = np.where(alike, 0.0, self.variance + unsharp / runs)
        move = score.systematic * score.offset
        fine, coarse = (np.clip(each + move, 0.0, 1.0) for each in (self.probability, self.coarse))
        return Exceedance(fine, coarse, variance, score, len(levels.parts))


def over_paths(above: Floats, roots: Array, paths: Floats, few: Draws) -> Array:
    """Variance over paths of the share of draws above 0, shape (c,).

    Parameters
    ----------
    above : array, shape (c, m)
        Mean of each output at each draw.
    roots, paths : array, shapes (parts, c) and (parts, m, k)
        Deviation of each output's process, and paths of one of deviation 1.
    few : Draws
        The draws.
    """
    share, found = few.share.copy(), np.empty(len(above))
    # each half has all events
    for half in (share[::2], share[1::2]):
        half /= half.sum()
    path, held = np.empty(paths.shape[2], SINGLE), np.empty((2, paths.shape[2]), SINGLE)
    variance_over_paths(
        above.astype(SINGLE), roots.astype(SINGLE), paths.astype(SINGLE), share.astype(SINGLE),
        path, held, found,
    )  # fmt: skip
    return found


def _above(
    at: Predictor, draws: Draws, scales: Array, mean: Array, level: float
) -> tuple[Array, Array, Array]:
    """Share of the draws above a level, (c,), how unsure they are and the variance of so many draws.

    scales, mean : shapes (parts, c) and (m, c), of the level that the parts make up together.
    """
    (parts, outputs), single = scales.shape, scales.astype(SINGLE)
    found, square = np.zeros((draws.blocks, outputs)), np.zeros(outputs)
    shares_above(
        mean, SINGLE.type(level), at.variances[:parts], single, draws.share.astype(SINGLE),
        draws.block, NORMAL[SINGLE], np.empty(outputs, SINGLE), found, square,
    )  # fmt: skip
    share = found.sum(axis=0)
    return share, share - square, variance_of_draws(found)
