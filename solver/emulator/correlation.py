"""Correlation of outputs at two places of the space of parameters."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]


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
    found = np.ones((len(one), len(other)))
    for distance in _distances(one, other, lengths):
        found *= (1 + distance * (1 + distance / 3)) * np.exp(-distance)
    return found


def matern_slopes(places: Array, lengths: Array) -> Iterator[Array]:
    """Give the derivative of the correlations by the logarithm of each length, shape (n, n) each."""
    whole = matern(places, places, lengths)
    for distance in _distances(places, places, lengths):
        # of the one factor that has the length, the others as they are
        factor = distance**2 * (1 + distance) / 3 / (1 + distance * (1 + distance / 3))
        yield whole * factor


def _distances(one: Array, other: Array, lengths: Array) -> Iterator[Array]:
    for j, length in enumerate(lengths):
        yield np.sqrt(5) / length * np.abs(one[:, j, None] - other[None, :, j])
