"""Kernels over normal distributions, one for each draw and output: shares above a level and scores of them.

They go over draws and outputs once and keep no arrays of both. Each is compiled for single and for double
precision.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray
from scipy.special import ndtr

from solver.compiled import kernel

Array = NDArray[np.float64]
Floats = NDArray[np.floating]
# deviations that the table reaches to, and its entries by deviation: a power of 2, so that none is rounded
WIDEST, BY_DEVIATION = 6.0, 128


class Normal(NamedTuple):
    """Table of the normal distribution, and numbers of its precision, so that none is computed in another.

    Parameters
    ----------
    share, density : array
        Below each entry, and there.
    widest, entries, half, sixth, one, least
        Deviations of the last entry, entries by deviation, and numbers.
    """

    share: Floats
    density: Floats
    widest: np.floating
    entries: np.floating
    half: np.floating
    sixth: np.floating
    one: np.floating
    least: np.floating


def _table(kind: type[np.floating]) -> Normal:
    places = np.linspace(-WIDEST, WIDEST, int(2 * WIDEST * BY_DEVIATION) + 1)
    density = np.exp(-0.5 * places**2) / np.sqrt(2 * np.pi)
    numbers = (kind(number) for number in (WIDEST, BY_DEVIATION, 0.5, 1 / 6, 1.0, 1e-30))
    return Normal(ndtr(places).astype(kind), density.astype(kind), *numbers)


NORMAL = {np.dtype(kind): _table(kind) for kind in (np.float32, np.float64)}


@kernel(inline=True, unaliased=True)
def _below(x, normal):  # type: ignore[no-untyped-def]
    """Share of a normal distribution below a number of deviations, by Taylor's series at the nearest entry.

    It is off by 2e-11, or by the round-off of single precision; beyond the table it is that of its end.
    """
    x = min(max(x, -normal.widest), normal.widest)
    near = np.floor(x * normal.entries + normal.half) / normal.entries
    at = np.uint32((near + normal.widest) * normal.entries)
    off = x - near
    rest = normal.half * off * near - normal.sixth * off * off * (near * near - normal.one)
    return normal.share[at] + off * normal.density[at] * (normal.one - rest)


@kernel(from_python=True, unaliased=True)
def shares_above(mean, level, variance, scale, share, block, normal, deviation, found, square):  # type: ignore[no-untyped-def]
    """Add up the shares of draws that are above a level, and their squares.

    Parameters
    ----------
    mean : array, shape (m, c)
        Of each draw and output.
    level : float
        The level, of the precision of the mean.
    variance, scale : array, shapes (parts, m) and (parts, c)
        Whose products add up to the variance.
    share : array, shape (m,)
        Of each draw.
    block : array of int, shape (m,)
        Of draws, that each is in.
    normal : Normal
        Of the same precision.
    deviation : array, shape (c,)
        To compute in.
    found, square : array, shapes (blocks, c) and (c,)
        What is added to, of double precision.
    """
    parts, draws = variance.shape
    outputs = mean.shape[1]
    for i in range(draws):
        of_block = found[block[i]]
        for c in range(outputs):
            deviation[c] = variance[0, i] * scale[0, c]
        for j in range(1, parts):
            for c in range(outputs):
                deviation[c] += variance[j, i] * scale[j, c]
        for c in range(outputs):
            above = _below((mean[i, c] - level) / np.sqrt(deviation[c]), normal)
            of_block[c] += share[i] * above
            square[c] += share[i] * above * above


@kernel(from_python=True, unaliased=True)
def variance_over_paths(mean, roots, paths, share, path, held, found):  # type: ignore[no-untyped-def]
    """Variance over paths of the share of draws that are above 0.

    It is the covariance of the shares of two halves of the draws, every second one, and at least 0: that of
    all of them has on top what comes of their number.

    Parameters
    ----------
    mean : array, shape (c, m)
        Of each output and draw.
    roots, paths : array, shapes (parts, c) and (parts, m, k)
        Deviation of each output, and deviations of draws along each path in units of it.
    share : array, shape (m,)
        Of each draw, their sum in each half 1.
    path, held : array, shapes (k,) and (2, k)
        To compute in.
    found : array, shape (c,)
        The variance, with one degree of freedom less than paths.
    """
    outputs, draws = mean.shape
    parts, _, count = paths.shape
    for c in range(outputs):
        held[:] = share[0] - share[0]
        for i in range(draws):
            for k in range(count):
                path[k] = roots[0, c] * paths[0, i, k]
            for j in range(1, parts):
                for k in range(count):
                    path[k] += roots[j, c] * paths[j, i, k]
            least, part, half = -mean[c, i], share[i], held[i % 2]
            for k in range(count):
                half[k] += part if path[k] > least else part - part
        first, second, both = 0.0, 0.0, 0.0
        for k in range(count):
            first += held[0, k]
            second += held[1, k]
        first, second = first / count, second / count
        for k in range(count):
            both += (held[0, k] - first) * (held[1, k] - second)
        found[c] = max(both / (count - 1), 0.0)


@kernel(from_python=True, unaliased=True)
def scores_of(  # type: ignore[no-untyped-def]
    values, mean, deviation, level, weight, normal, low, high, share, spread, brier, offset, unsure
):
    """Score predictions of being above a level, output by output; all but the first arguments are added to.

    Parameters
    ----------
    values, mean, deviation : array, shape (n, c)
        Of each run, and as predicted from the others.
    level : float
        The level.
    weight : array, shape (n,)
        Of each run.
    normal : Normal
        Of double precision.
    low, high : array, shape (c,)
        Least and largest value.
    share, spread : array, shape (c,)
        Weight of the runs above, and that over the square of the weight of all other runs.
    brier, offset : array, shape (c,)
        Mean of the square of the error and of the error.
    unsure : array, shape (3, c)
        Sums of the square of the error, of the variance that is predicted, and of that by squares of weights.
    """
    runs, outputs = values.shape
    for i in range(runs):
        for c in range(outputs):
            low[c], high[c] = min(low[c], values[i, c]), max(high[c], values[i, c])
    for i in range(runs):
        part = weight[i]
        others = part / (1 - part) ** 2
        for c in range(outputs):
            above = 1.0 if values[i, c] > level else 0.0
            predicted = _below((mean[i, c] - level) / deviation[i, c], normal)
            # what all runs agree on is told by any of them
            predicted = predicted if high[c] > low[c] else above
            off, chance = above - predicted, predicted * (1 - predicted)
            share[c] += part * above
            spread[c] += others * above
            brier[c] += part * off * off
            offset[c] += part * off
            unsure[0, c] += off * off
            unsure[1, c] += chance
            unsure[2, c] += part * part * chance


def below(deviations: Floats) -> Floats:
    """Give the share of a normal distribution below numbers of deviations, of their precision."""
    found = np.empty_like(deviations)
    _all_below(deviations.ravel(), NORMAL[deviations.dtype], found.reshape(-1))
    return found


@kernel(from_python=True, unaliased=True)
def _all_below(deviations, normal, found):  # type: ignore[no-untyped-def]
    for i in range(len(deviations)):
        found[i] = _below(deviations[i], normal)
