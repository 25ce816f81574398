"""How far an emulator may be relied on, by leave-one-out."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.special import ndtr

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
    above: NDArray[np.bool_], mean: Array, deviation: Array, level: float, weight: Array
) -> ExceedanceScore:
    """Score leave-one-out predictions of being above a level.

    Parameters
    ----------
    above : array of bool, shape (n, c)
        What the runs are.
    mean, deviation : array, shape (n, c)
        Of each run as predicted from the others.
    level : float
        The threshold.
    weight : array, shape (n,)
        Share of each run, their sum is 1.
    """
    predicted = ndtr((mean - level) / deviation)
    error = (above - predicted) ** 2
    brier: Array = weight @ error
    # the share of the others: of n equal ones that of all, moved away from the run by n / (n - 1)
    share = weight @ above
    spread = weight @ ((above - share) / (1 - weight[:, None])) ** 2
    unsure = predicted * (1 - predicted)
    said = float(unsure.sum())
    whole = float(spread.sum())
    calibration = max(1.0, float(error.sum()) / said) if said > 0 else 1.0
    offset: Array = weight @ (above - predicted)
    chance = calibration * float(np.sum(weight**2 @ unsure))
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
