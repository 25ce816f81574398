"""Weights of draws by what was observed, through emulators of what is observed."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.linalg import solve_triangular

from solver.emulator.levels import Draws, Predictor
from solver.emulator.scalars import Scalar

Array = NDArray[np.float64]
# draws that a posterior must rest on
LEAST_EFFECTIVE = 100
# of a correlation of few runs
TO_NONE = 0.1


@dataclass(frozen=True)
class Posterior:
    """Share of each draw after the observation, shape (m,), sum 1. misfit : of the best draw.

    The misfit is the root mean square of its differences in standard deviations, about 1 where the model can
    give what was observed.
    """

    share: Array
    misfit: float

    @property
    def effective(self) -> float:
        """Number of equally weighted draws that say as much."""
        return float(1 / np.sum(self.share**2))

    def quantiles(self, values: Array, shares: Sequence[float]) -> Array:
        """Quantiles of a parameter of the draws, (m,), by their shares."""
        order = np.argsort(values)
        held = np.cumsum(self.share[order])
        at = np.searchsorted(held, np.asarray(shares) * held[-1]).clip(max=len(values) - 1)
        found: Array = values[order][at]
        return found


class Measured:
    """Emulated measures of draws, which observations are compared with.

    Parameters
    ----------
    scalars : sequence of Scalar
        Emulator of each measure, all of the same runs.
    draws : Draws
        The prior.

    Attributes
    ----------
    calibration : float
        Factor, at least 1, by which variances are larger than the emulators say, see `calibration`.
    """

    def __init__(self, scalars: Sequence[Scalar], draws: Draws) -> None:
        self.scalars, self.draws = tuple(scalars), draws
        held = [Predictor(each.levels.parts, draws.at)(each.levels) for each in scalars]
        self._mean = np.stack([mean[:, 0] for mean, _ in held])
        self._deviation = np.stack([deviation[:, 0] for _, deviation in held])
        # errors of several measures of one outline go together
        errors = _errors(scalars)
        self._root = np.linalg.cholesky(_correlation(errors))
        self.calibration = calibration(errors)
        self._deviation *= np.sqrt(self.calibration)

    def posterior(self, observed: Sequence[float], shift: Sequence[float]) -> Posterior:
        """Weigh the draws by a normal likelihood, whose errors go together as leave-one-out says.

        Parameters
        ----------
        observed : sequence of float
            Value of each measure.
        shift : sequence of float
            Standard deviation of each measure that the error of the observation makes; it moves all of them
            together, as an outline that is drawn too large.
        """
        logarithms = np.array([each.logarithm for each in self.scalars])
        seen, moves = np.array(observed, np.float64), np.array(shift, np.float64)
        target = np.where(logarithms, np.log(np.where(logarithms, seen, 1.0)), seen)
        moves = np.where(logarithms, moves / np.where(logarithms, seen, 1.0), moves)
        residual = solve_triangular(self._root, (target[:, None] - self._mean) / self._deviation, lower=True)
        common = solve_triangular(self._root, moves[:, None] / self._deviation, lower=True)
        # the inverse of 1 + common common' (Sherman & Morrison)
        inner = 1 + np.sum(common**2, axis=0)
        square = np.sum(residual**2, axis=0) - np.sum(common * residual, axis=0) ** 2 / inner
        logarithm = -0.5 * (square + np.log(inner)) - np.sum(np.log(self._deviation), axis=0)
        logarithm += np.log(self.draws.share)
        share = np.exp(logarithm - logarithm.max())
        best = int(np.argmax(logarithm))
        return Posterior(share / share.sum(), float(np.sqrt(square[best] / len(seen))))


def _errors(scalars: Sequence[Scalar]) -> Array:
    """Leave-one-out errors of measures of the same runs in deviations, shape (measures, n)."""
    found = []
    for scalar in scalars:
        mean, deviation = scalar.levels.leave_one_out()
        found.append(((scalar.levels.outputs[0] - mean) / deviation)[:, 0])
    return np.array(found)


def _correlation(errors: Array) -> Array:
    """Correlation of errors, (measures, n), drawn a little to none."""
    found = np.atleast_2d(np.corrcoef(errors))
    return (1 - TO_NONE) * found + TO_NONE * np.eye(len(found))


def calibration(errors: Array) -> float:
    """Factor, at least 1, by which the squares of errors exceed what is said of them.

    Each run is judged by the correlation of the others. That of few runs has an inverse that is too large
    (Hartlap et al. 2007), and predictions are a little worse than processes say whose correlation lengths
    were fitted to the same runs.

    Parameters
    ----------
    errors : array, shape (measures, n)
        Leave-one-out errors in deviations.

    References
    ----------
    Hartlap et al. 2007, Why your model parameter confidences might be too optimistic,
    https://doi.org/10.1051/0004-6361:20066170
    """
    squares = [
        error @ np.linalg.solve(_correlation(np.delete(errors, run, axis=1)), error)
        for run, error in enumerate(errors.T)
    ]
    return max(1.0, float(np.mean(squares)) / len(errors))
