"""How far an emulator may be relied on, by leave-one-out."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]
TWO_SIDED = 1.959963984540054


@dataclass(frozen=True)
class ExceedanceScore:
    """Leave-one-out score of probabilities to be above a threshold.

    Parameters
    ----------
    ratio : float
        Brier score of the predicted probabilities over that of the share of the other runs, pooled over
        outputs; 0 is perfect, 1 no better than the share, NaN where no output ever differs.
    calibration : float
        Factor, at least 1, by which errors exceed what the predicted probabilities say.
    brier : (c,) array
        Score by output.
    offset : (c,) array
        Mean over the runs of what they are less what is predicted of them.
    excess : float
        Mean square of the offsets over what chance leaves of it, pooled over outputs.
    """

    ratio: float
    calibration: float
    brier: Array
    offset: Array
    excess: float

    @property
    def systematic(self) -> float:
        """Share of the offsets that is no chance (James & Stein); 0 of a single output, which cannot tell."""
        return max(0.0, 1 - 1 / self.excess) if len(self.offset) > 1 and self.excess > 0 else 0.0


def exceedance_score(
    values: Array, mean: Array, deviation: Array, level: float, weight: Array
) -> ExceedanceScore:
    """Score leave-one-out predictions of being above a level.

    Parameters
    ----------
    values : array, shape (n, c)
        Of the runs.
    mean, deviation : array, shape (n, c)
        Of each run as predicted from the others.
    level : float
        The threshold.
    weight : array, shape (n,)
        Share of each run, their sum is 1.
    """
    # of its kernels no import of the verdicts knows
    from solver.emulator.mixtures import NORMAL, scores_of

    count = values.shape[1]
    ends = np.full(count, np.inf), np.full(count, -np.inf)
    share, spread, brier, offset = np.zeros((4, count))
    sums = np.zeros((3, count))
    scores_of(
        *map(np.ascontiguousarray, (values, mean, deviation)), float(level), weight, NORMAL[np.dtype(float)],
        *ends, share, spread, brier, offset, sums,
    )  # fmt: skip
    # the share of the others: of n equal ones that of all, moved away from the run by n / (n - 1)
    whole = float(np.sum((1 - 2 * share) * spread + share**2 * np.sum(weight / (1 - weight) ** 2)))
    error, said, by_weight = sums.sum(axis=1).tolist()
    calibration = max(1.0, error / said) if said > 0 else 1.0
    chance = calibration * by_weight
    return ExceedanceScore(
        ratio=float(brier.sum()) / whole if whole > 0 else float("nan"),
        calibration=calibration,
        brier=brier,
        offset=offset,
        excess=float(offset @ offset) / chance if chance > 0 else 0.0,
    )


@dataclass(frozen=True)
class ScalarScore:
    """Leave-one-out score of one output.

    Parameters
    ----------
    q2 : float
        Share of the variance that is predicted.
    coverage : float
        Share of the runs within the 95 % interval as predicted from the others.
    worst : float
        Largest error in deviations.
    rmse : float
        Root mean square error.
    """

    q2: float
    coverage: float
    worst: float
    rmse: float


def scalar_score(values: Array, mean: Array, deviation: Array) -> ScalarScore:
    """Score leave-one-out predictions of one output, shape (n,) each."""
    error = values - mean
    runs = len(values)
    # the mean of the others is farther from a run than that of all
    spread = float(np.sum(((values - values.mean()) * runs / (runs - 1)) ** 2))
    relative = np.abs(error) / deviation
    return ScalarScore(
        q2=1 - float(error @ error) / spread if spread > 0 else float("nan"),
        coverage=float(np.mean(relative <= TWO_SIDED)),
        worst=float(relative.max()),
        rmse=float(np.sqrt(np.mean(error**2))),
    )
