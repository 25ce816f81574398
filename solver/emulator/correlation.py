"""Correlation of outputs at two places of the space of parameters."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]
# pairs of places whose distances are held at once
AT_ONCE = 1 << 13


def matern(one: Array, other: Array, lengths: Array) -> Array:
    """Product over the inputs of Matern correlations of smoothness 5/2.

    Parameters
    ----------
    one : array, shape (n, inputs)
        Places, inputs scaled to about one.
    other : array, shape (m, inputs)
        Further places.
    lengths : array, shape (inputs,)
        Correlation length of each input.

    Returns
    -------
    array, shape (n, m)
        ``prod_j (1 + r_j + r_j^2 / 3) exp(-r_j)`` with ``r_j = sqrt(5) |difference| / length``.

    References
    ----------
    Rasmussen & Williams 2006, Gaussian Processes for Machine Learning, section 4.2.
    """
    found = np.empty((len(one), len(other)))
    rows = max(1, AT_ONCE // max(1, len(other)))
    for start in range(0, len(one), rows):
        part = found[start : start + rows]
        part[:], total = 1.0, np.zeros(part.shape)
        for j, length in enumerate(lengths):
            distance = one[start : start + rows, j, None] * (np.sqrt(5) / length)
            distance = np.abs(distance - other[None, :, j] * (np.sqrt(5) / length))
            total += distance
            factor = distance / 3
            factor += 1
            factor *= distance
            factor += 1
            part *= factor
        np.negative(total, out=total)
        part *= np.exp(total, out=total)
    return found


def matern_slopes(places: Array, lengths: Array) -> tuple[Array, Array]:
    """Correlations of places, and what times them is their derivative by the logarithm of each length.

    Returns
    -------
    whole : array, shape (n, n)
    factors : array, shape (inputs, n, n)
    """
    distance = np.abs(places.T[:, :, None] - places.T[:, None, :]) * (np.sqrt(5) / lengths)[:, None, None]
    factor = 1 + distance * (1 + distance / 3)
    whole = np.exp(-distance.sum(axis=0)) * factor.prod(axis=0)
    # of the one factor that has the length, the others as they are
    return whole, distance**2 * (1 + distance) / (3 * factor)
