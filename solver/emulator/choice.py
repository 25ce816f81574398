"""The next runs: where a further run would tell most of whether an output is above a level."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray
from scipy.special import ndtr

from solver.emulator.levels import SAME, Draws, Levels, Predictor

Array = NDArray[np.float64]
Rows = NDArray[np.intp]
# draws, of those that are least certain, among which runs are chosen and whose certainty counts
MOST_LOOKED_AT = 1024


def most_telling(levels: Levels, level: float, draws: Draws, count: int) -> Rows:
    """Choose draws whose runs on the coarsest level leave the probability to be above a level most certain.

    One after another, each is the draw that lowers most the variance of the output over all draws, weighted
    by its density at the level: the targeted mean square error of Picheny et al. The variance that is left
    after a choice does not depend on what its run will give. No place of a run is chosen again: it would give
    the same.

    Parameters
    ----------
    levels : Levels
        Emulator of one output.
    level : float
        Threshold of the output.
    draws : Draws
        What the probability is over.
    count : int
        Runs to choose.

    Returns
    -------
    array of int, shape (count,)
        Positions among the draws, each once; fewer where there are not so many places.

    References
    ----------
    Picheny et al. 2010, Adaptive designs of experiments for accurate approximation of a target region,
    https://doi.org/10.1115/1.4001873
    """
    mean, deviation = (held[:, 0] for held in Predictor(levels.parts, draws.at)(levels))
    above = ndtr((mean - level) / deviation)
    most = min(max(MOST_LOOKED_AT, count), len(mean))
    some = np.argsort(-draws.share * above * (1 - above), kind="stable")[:most]
    part, scale = levels.parts[0], float(levels.scales[0][0])
    # of the process; what a run gives has the nugget on top
    covariance = scale * part.covariance(draws.at[some])
    noise = scale * part.nugget
    covariance[np.diag_indices_from(covariance)] -= noise
    # of the finer levels, and of the nugget
    rest = deviation[some] ** 2 - np.diag(covariance)
    distance, share, found = mean[some] - level, draws.share[some], []
    at = draws.at[some]
    free = np.array([not _is(part.inputs, place).any() for place in at])
    for _ in range(count):
        if not free.any():
            break
        spread = np.maximum(np.diag(covariance), 0.0)
        whole = spread + np.maximum(rest, 0.0)
        density = share * np.exp(-0.5 * distance**2 / whole) / np.sqrt(whole)
        gain = np.einsum("ij,i->j", covariance**2, density) / (spread + noise)
        best = int(np.argmax(np.where(free, gain, -1.0)))
        free &= ~_is(at, at[best])
        found.append(int(some[best]))
        column = covariance[:, best].copy()
        covariance -= np.outer(column, column) / (spread[best] + noise)
    return np.array(found, np.intp)


def _is(places: Array, place: Array) -> NDArray[np.bool_]:
    same: NDArray[np.bool_] = np.abs(places - place).max(axis=1) < SAME
    return same
