"""What an emulator leaves open beyond the computed runs, as where it is the largest events that failed.

There a process says little of its own error: cells that no computed run came to look dry for certain. How far
an outline is predicted wrong is measured instead, on the outermost of the computed runs.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.ndimage import distance_transform_edt, maximum_filter
from scipy.optimize import linprog

from solver.emulator.kriging import LEAST_KNOWN, centred
from solver.emulator.levels import Draws, Levels, Predictor
from solver.emulator.mixtures import below

Array = NDArray[np.float64]
Rows = NDArray[np.intp]
# runs at least that tell how wrong predictions are beyond the others
LEAST_OUTERMOST = 4
OUTPUTS_AT_ONCE = 1000
DRAWS_AT_ONCE = 512


@dataclass(frozen=True)
class Beyond:
    """Draws beyond the computed runs: those that are nearest to a run that is missing outside of the others.

    Parameters
    ----------
    at : array, shape (m, inputs)
        Places of the draws.
    share : float
        Of them in all draws.
    outermost : array of int
        Rows of the computed runs next to them.
    """

    at: Array
    share: float
    outermost: Rows


def beyond(draws: Draws, outside: Array, known: Array) -> Beyond | None:
    """Find the draws beyond the computed runs; None where no run is missing outside of them.

    Parameters
    ----------
    draws : Draws
        What probabilities are over.
    outside, known : array, shape (k, inputs) and (n, inputs)
        Places of the runs that have no values and lie outside of those that have some, and of these.
    """
    if not len(outside):
        return None
    nearer = _nearest(draws.at, outside) < _nearest(draws.at, known)
    if not nearer.any():
        return None
    count = min(max(LEAST_OUTERMOST, len(outside)), len(known) // 4)
    outermost = np.argsort(_nearest(known, outside), kind="stable")[:count]
    return Beyond(draws.at[nearer][:DRAWS_AT_ONCE], float(draws.share[nearer].sum()), outermost)


def on_lattice(
    levels: Levels, level: float, past: Beyond, shape: tuple[int, int], spacing: tuple[float, float]
) -> Array:
    """Half width that draws beyond the runs add to probabilities over a lattice, shape (c,).

    The outermost runs are predicted from the others, and the outlines that are found are off by some
    distance: the median over these runs of how far the farthest cell lies that is wrong. The probability of
    the draws beyond may be that of any cell within this distance.

    Parameters
    ----------
    levels : Levels
        Emulator whose outputs are the flattened cells.
    level : float
        Threshold of the outputs.
    past : Beyond
        The draws.
    shape : tuple of int
        Of the lattice, (ny, nx).
    spacing : tuple of float
        Distance of its points along y and x, m.
    """
    predicted, above = _outermost(levels, level, past)
    reached = (predicted > level).reshape(-1, *shape)
    by_run = []
    for found, known in zip(reached, above.reshape(-1, *shape), strict=True):
        by_run.append(0.0)
        for wrong, away in ((known & ~found, ~found), (found & ~known, found)):
            if wrong.any():
                off = distance_transform_edt(away, sampling=spacing) if not away.all() else np.inf
                by_run[-1] = max(by_run[-1], float(np.max(np.where(wrong, off, 0.0))))
    farthest = float(np.median(by_run))
    share = _share(levels, level, past).reshape(shape)
    reach = [int(min(farthest, step * size) / step) for step, size in zip(spacing, shape, strict=True)]
    y, x = np.ogrid[-reach[0] : reach[0] + 1, -reach[1] : reach[1] + 1]
    near = np.hypot(y * spacing[0], x * spacing[1]) <= max(farthest, 1e-9)
    highest = maximum_filter(share, footprint=near, mode="nearest")
    lowest = -maximum_filter(-share, footprint=near, mode="nearest")
    half: Array = past.share * np.maximum(highest - share, share - lowest).ravel()
    return half


def at_place(levels: Levels, level: float, past: Beyond) -> Array:
    """Half width that draws beyond the runs add to the probability of one output, shape (1,).

    It is their share times the root of the Brier score of the outermost runs as predicted from the others,
    among which one more counts as undecided.
    """
    predicted, above = _outermost(levels, level, past)
    wrong = np.sum((predicted > level) != above)
    return np.array([past.share * np.sqrt((wrong + 0.25) / (len(above) + 1))])


def _outermost(levels: Levels, level: float, past: Beyond) -> tuple[Array, NDArray[np.bool_]]:
    """Predict the outputs of the outermost runs from all others, and say which are above the level."""
    part, outputs, rows = levels.parts[0], levels.outputs[0], past.outermost
    # the others need not determine the trend: then the least error that agrees with them
    residual = part.precision[rows] @ centred(outputs)
    error = np.linalg.lstsq(part.precision[np.ix_(rows, rows)], residual, rcond=LEAST_KNOWN)[0]
    return outputs[rows] - error, outputs[rows] > level


def _share(levels: Levels, level: float, past: Beyond) -> Array:
    """Probability over the draws beyond the runs, shape (c,)."""
    at, found = Predictor(levels.parts, past.at, single=True), []
    count = levels.outputs[0].shape[1]
    for start in range(0, count, OUTPUTS_AT_ONCE):
        mean, deviation = at(levels.of(slice(start, start + OUTPUTS_AT_ONCE)))
        found.append(below((mean - np.float32(level)) / deviation).mean(axis=0))
    return np.concatenate(found).astype(np.float64)


def _nearest(places: Array, known: Array) -> Array:
    """Distance of places to the nearest known one, shape (m,)."""
    return np.concatenate(
        [
            np.sqrt(((places[i : i + 1000, None] - known) ** 2).sum(axis=2)).min(axis=1)
            for i in range(0, len(places), 1000)
        ]
    )


def inside(places: Array, known: Array) -> NDArray[np.bool_]:
    """Whether places lie in the convex hull of known ones.

    Parameters
    ----------
    places : array, shape (m, inputs)
        What is asked about.
    known : array, shape (n, inputs)
        What the hull is of.

    Returns
    -------
    array of bool, shape (m,)
    """
    # a mean of the known places with weights of at least 0 that is the place
    rows = np.concatenate([known.T, np.ones((1, len(known)))])
    cost = np.zeros(len(known))
    return np.array(
        [
            linprog(cost, A_eq=rows, b_eq=np.append(place, 1.0), method="highs").status == 0
            for place in places
        ],
        dtype=bool,
    )
