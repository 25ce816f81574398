"""Local moving least squares: shape functions on a support (eqs. 15-23)."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]


def moments(points: Array, widths: Array, degree: int) -> Array:
    """Mean of the monomials up to ``degree`` over intervals (eq. 16, in one dimension).

    Parameters
    ----------
    points : (n,) array
        Centres of the intervals, in units of the support radius.
    widths : (n,) array
        Their widths in the same unit; 0 gives the point value.
    degree : int
        Highest power.

    Returns
    -------
    (n, degree + 1) array
        Column k is the mean of x^k over each interval.
    """
    powers = np.arange(degree + 1)
    if not np.any(widths):
        return np.asarray(points[:, None] ** powers, dtype=np.float64)
    upper, lower = points + widths / 2, points - widths / 2
    integrals = (upper[:, None] ** (powers + 1) - lower[:, None] ** (powers + 1)) / (powers + 1)
    return np.asarray(integrals / widths[:, None], dtype=np.float64)


def shape_functions(
    points: Array, at: float, degree: int, width: float = 0.0, weight_shape: float = 9.0
) -> Array:
    """Weights that give the LMLS approximation at one place from the values at the support (eq. 23).

    The basis is the local scaled monomials ``((x - at) / r)^k``, the weight the Gaussian
    ``exp(-weight_shape (distance / r)^2)`` (eq. 18) with r the support radius.

    Parameters
    ----------
    points : (n,) array
        Coordinates of the support, m.
    at : float
        Where to evaluate, m.
    degree : int
        Degree of the basis.
    width : float
        Width over which each value is a mean, m; 0 for point values. A control volume's depth is a mean,
        and eq. 17 then minimises the misfit of means.
    weight_shape : float
        Shape parameter c of the weight, dimensionless.

    Returns
    -------
    (n,) array
        The shape functions, dimensionless; they reproduce polynomials up to ``degree``.

    Raises
    ------
    ValueError
        If the support cannot carry the basis.
    """
    radius = float(np.max(np.abs(points - at)))
    scaled = (points - at) / radius
    basis = moments(scaled, np.full(len(points), width / radius), degree)
    weight = np.exp(-weight_shape * scaled**2)
    moment_matrix = basis.T @ (weight[:, None] * basis)
    if np.linalg.matrix_rank(np.sqrt(weight)[:, None] * basis) <= degree:
        raise ValueError(f"{len(points)} points cannot carry a basis of degree {degree}")
    return np.asarray(np.linalg.solve(moment_matrix, (weight[:, None] * basis).T)[0], dtype=np.float64)
