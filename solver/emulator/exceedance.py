"""Probabilities to be above thresholds over many draws, with the variance of what few runs leave open."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.special import ndtr

from solver.emulator.levels import Draws, Levels, Predictor, scaled_paths
from solver.emulator.scores import TWO_SIDED, ExceedanceScore, exceedance_score

Array = NDArray[np.float64]

# outputs whose draws, and whose paths, are held at once
OUTPUTS_AT_ONCE = 1000
PATHS_AT_ONCE = 100
PATHS = 100
# outputs that fewer of the first draws exceed, or all but fewer, are looked at no further
CERTAIN = 1e-4
# what the number of draws and the choices of the method leave open
REST = 0.0025
# probabilities whose change between levels is typical
TYPICAL = (0.01, 0.99)
ALLOWANCE = 2.0
# deviations that the table reaches to, and its entries
WIDEST, ENTRIES = 6.0, 1 << 16
_TABLE = ndtr(np.linspace(-WIDEST, WIDEST, ENTRIES)).astype(np.float32)
_SCALE = np.float32((ENTRIES - 1) / (2 * WIDEST))
_MIDDLE = np.float32((ENTRIES - 1) / 2 + 0.5)


@dataclass(frozen=True)
class Exceedance:
    """Probabilities of outputs to be above a threshold, shape (c,) each.

    Parameters
    ----------
    probability : array
        On the finest level.
    coarse : array
        On the coarsest one.
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
    """Give the probabilities of the outputs of an emulator to be above a level.

    ``p = mean over draws of Phi((mean - level) / deviation)``, moved by what is systematic of the offset of
    the runs from their predictions: at a jump an emulator is off alike for many runs. Its variance is that
    over paths of the emulator, times the calibration of the score, and the Brier score over the number of
    runs.

    Parameters
    ----------
    levels : Levels
        The emulator.
    level : float
        Threshold of its outputs.
    draws : Draws
        What the probability is over.
    weight : array, shape (n,)
        Share of each run of the coarsest level, their sum is 1.
    """
    coarse = levels.outputs[0]
    score = exceedance_score(coarse > level, *levels.leave_one_out(), level, weight)
    runs = 1 / float(weight @ weight)
    count = coarse.shape[1]
    found = {name: np.zeros(count) for name in ("probability", "coarse", "spread", "variance")}
    few, few_share = draws.at[draws.first], draws.share_of_first
    share = draws.share.astype(np.float32)
    at_first, at_all = Predictor(levels.parts, few, single=True), None
    paths = scaled_paths(levels.parts, few, PATHS)
    for start in range(0, count, OUTPUTS_AT_ONCE):
        block = levels.of(slice(start, start + OUTPUTS_AT_ONCE))
        mean, deviation = at_first(block)
        rough = few_share @ normal((mean - level) / deviation)
        some = np.flatnonzero((rough > CERTAIN) & (rough < 1 - CERTAIN))
        at = slice(start, start + len(rough))
        found["probability"][at] = rough
        if len(levels.parts) > 1:
            rough = few_share @ _probability(at_first, block, level, only_coarsest=True)
        found["coarse"][at] = rough
        if some.size:
            at_all = at_all or Predictor(levels.parts, draws.at, single=True)
            part, rows = block.of(some), start + some
            each = _probability(at_all, part, level)
            found["probability"][rows] = share @ each
            found["spread"][rows] = found["probability"][rows] - share @ np.square(each)
            if len(levels.parts) > 1:
                each = _probability(at_all, part, level, only_coarsest=True)
            found["coarse"][rows] = share @ each
            found["variance"][rows] = _over_paths(part, mean[:, some] - level, paths, few_share)
    unsharp = np.maximum(score.brier, score.calibration * found["spread"])
    variance = score.calibration * found["variance"] + unsharp / runs
    move = score.systematic * score.offset
    fine, rough = (np.clip(found[name] + move, 0.0, 1.0) for name in ("probability", "coarse"))
    return Exceedance(fine, rough, variance, score, len(levels.parts))


def _probability(
    at: Predictor, levels: Levels, level: float, only_coarsest: bool = False
) -> NDArray[np.float32]:
    mean, deviation = at(levels, only_coarsest)
    mean -= level
    mean /= deviation
    return normal(mean)


def _over_paths(levels: Levels, above: Array, paths: list[Array], share: Array) -> Array:
    """Variance over paths of the share of draws above 0, (c,), of outputs with means ``above``, (m, c)."""
    found, single = np.empty(above.shape[1]), [path.astype(np.float32) for path in paths]
    for start in range(0, len(found), PATHS_AT_ONCE):
        part = slice(start, start + PATHS_AT_ONCE)
        roots = [np.sqrt(scale[part]).astype(np.float32) for scale in levels.scales]
        whole = roots[0][:, None, None] * single[0]
        for root, path in zip(roots[1:], single[1:], strict=True):
            whole += root[:, None, None] * path
        exceeds = (whole > -above[:, part].T[:, :, None]).astype(np.float32)
        found[part] = (share.astype(np.float32) @ exceeds).var(axis=1, ddof=1)
    return found


def normal(deviations: NDArray[np.floating]) -> NDArray[np.float32]:
    """Give the share of a normal distribution below numbers of deviations, of single precision.

    It is off by at most 4e-5, to either side alike, so that means over draws are not; and it takes an eighth
    of the time of the function itself.

    Parameters
    ----------
    deviations : array
        Overwritten where it is of single precision.
    """
    place = np.asarray(deviations, np.float32)
    place *= _SCALE
    place += _MIDDLE
    np.clip(place, 0, ENTRIES - 1, out=place)
    found: NDArray[np.float32] = _TABLE[place.astype(np.uint16)]
    return found
