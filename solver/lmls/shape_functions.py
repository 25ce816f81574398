"""Local moving least squares: shape functions on a support (eqs. 15-23)."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from solver.arrays import Array, Indices
from solver.points.cloud import named

# Condition number of a moment matrix above which a support counts as unfit: its root is lost in digits.
WORST_CONDITION = 1e10


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


@dataclass(frozen=True)
class Approximation:
    """The LMLS approximation at m places as weights of the values at supports of s points each.

    Parameters
    ----------
    neighbours : (m, s) array
        Numbers of the points.
    value : (m, s) array
        Weights of the value, dimensionless.
    along, across : (m, s) array
        Weights of the derivatives by x and y, 1/m.
    condition : (m,) array
        Condition number of each moment matrix in the 2-norm.
    """

    neighbours: Indices
    value: Array
    along: Array
    across: Array
    condition: Array

    def apply(self, weights: Array, values: Array) -> Array:
        """Approximate from values (n,) at the points: ``apply(a.along, h)`` is dh/dx at the places, (m,)."""
        return np.asarray(np.einsum("ms,ms->m", weights, values[self.neighbours]))


class Local(NamedTuple):
    """The weighted least squares problem of eq. 17 at m places, on supports of s points.

    Parameters
    ----------
    offset : (m, s, 2) array
        ``(x_j - x) / r``.
    basis : (m, s, b) array
        p(x_j).
    weight : (m, s) array
        W of eq. 18.
    coefficients : (m, b, s) array
        ``A^-1 B`` of eq. 22.
    radius : (m,) array
        r, m.
    weight_shape : float
        c of eq. 18.
    """

    offset: Array
    basis: Array
    weight: Array
    coefficients: Array
    radius: Array
    weight_shape: float


Derivative = Callable[[Local], tuple[Array, Array]]


def diffuse(local: Local) -> tuple[Array, Array]:
    """Weights (m, s) of both derivatives as eq. 23 prints them: of the basis alone (WLS)."""
    r = local.radius[:, None]
    return local.coefficients[:, 1] / r, local.coefficients[:, 2] / r


def full(local: Local) -> tuple[Array, Array]:
    """Weights (m, s) of both derivatives of eq. 15, coefficients included (MLS), at constant support and r.

    With W' the derivative of the weight and N the shape functions, ``d(A^-1 B)`` adds
    ``N W'/W - sum_k N_k (W'/W)_k (A^-1 B)_kj``: what the weights' change gives to values that are not
    polynomials of the basis.
    """
    shape = local.coefficients[:, 0]
    weights = []
    for k, part in enumerate(diffuse(local)):
        change = shape * (2 * local.weight_shape / local.radius[:, None]) * local.offset[:, :, k]
        seen = np.matmul(change[:, None, :], local.basis)
        weights.append(part + change - np.matmul(seen, local.coefficients)[:, 0])
    return weights[0], weights[1]


def monomials(offset: Array, degree: int) -> Array:
    """Evaluate the basis of eq. 16 of degree 1 or 2, ``1, x, y, x^2, x y, y^2``, at offsets (..., 2)."""
    x, y = offset[..., 0], offset[..., 1]
    terms = [np.ones_like(x), x, y, x * x, x * y, y * y]
    return np.stack(terms[: terms_of(degree)], axis=-1)


def terms_of(degree: int) -> int:
    """Count the monomials up to a degree of 1 or 2."""
    if degree not in (1, 2):
        raise ValueError(f"the basis has degree 1 or 2, not {degree}")
    return (degree + 1) * (degree + 2) // 2


def approximation(
    points: Array,
    places: Array,
    neighbours: Indices,
    degree: int,
    weight_shape: float = 9.0,
    derivative: Derivative = full,
    second_moment: Array | None = None,
) -> Approximation:
    """Shape functions and their derivatives at places, from supports of points (eqs. 15-23).

    Parameters
    ----------
    points : (n, 2) array
        Coordinates, m.
    places : (m, 2) array
        Where to approximate, m.
    neighbours : (m, s) array
        Numbers of the points that support each place.
    degree : int
        Of the basis, 1 or 2.
    weight_shape : float
        Shape parameter c of the weight ``exp(-c (distance / r)^2)`` (eq. 18), r the distance of the farthest
        point of the support, dimensionless.
    derivative : function
        `diffuse` or `full`.
    second_moment : (n, 3) array, optional
        Where values are means over cells with centroids at the points: the means of ``X^2, X Y, Y^2`` about
        them, m2. By default values are those at the points.

    Returns
    -------
    Approximation

    Raises
    ------
    ValueError
        If a support has too few points for the basis, or its points cannot carry it: the condition number
        of the moment matrix is above `WORST_CONDITION`. The message names the places.
    """
    posed = _posed(points, places, neighbours, degree, weight_shape, second_moment)
    offset, basis, weight, radius, orthogonal, triangle, condition = posed
    bad = np.flatnonzero(~(condition <= WORST_CONDITION))
    if len(bad):
        raise ValueError(
            f"the nearest {neighbours.shape[1]} points cannot carry a basis of degree {degree} at "
            f"{named(places, bad)}: condition number up to {condition[bad].max():.1e}"
        )
    solved = np.linalg.solve(triangle, orthogonal.transpose(0, 2, 1))
    coefficients: Array = np.asarray(solved * np.sqrt(weight)[:, None, :], np.float64)
    local = Local(offset, basis, weight, coefficients, radius, weight_shape)
    # a copy, so that the weights of the basis are let go and rows of values lie together
    value = coefficients[:, 0].copy()
    return Approximation(neighbours, value, *derivative(local), condition)


def conditions(
    points: Array,
    places: Array,
    neighbours: Indices,
    degree: int,
    weight_shape: float = 9.0,
    second_moment: Array | None = None,
) -> Array:
    """Condition numbers of the moment matrices at places, (m,); parameters are those of `approximation`."""
    return _posed(points, places, neighbours, degree, weight_shape, second_moment)[-1]


def _posed(
    points: Array,
    places: Array,
    neighbours: Indices,
    degree: int,
    weight_shape: float,
    second_moment: Array | None,
) -> tuple[Array, Array, Array, Array, Array, Array, Array]:
    """Pose the least squares problems: offset, basis, weight, radius of `Local`, Q, R, condition numbers."""
    terms = terms_of(degree)
    if neighbours.shape[1] < terms:
        raise ValueError(f"supports of {neighbours.shape[1]} points cannot carry a basis of {terms} terms")
    offset = points[neighbours] - places[:, None, :]
    square = np.einsum("msk,msk->ms", offset, offset)
    radius = np.sqrt(square.max(axis=1))
    offset /= radius[:, None, None]
    basis = monomials(offset, degree)
    if second_moment is not None and degree == 2:
        basis[..., 3:] += second_moment[neighbours] / radius[:, None, None] ** 2
    weight = np.exp(-weight_shape * square / radius[:, None] ** 2)
    root = np.sqrt(weight)
    orthogonal, triangle = np.linalg.qr(root[:, :, None] * basis)
    stretch = np.linalg.svd(triangle, compute_uv=False)
    with np.errstate(divide="ignore"):
        condition = (stretch[:, 0] / stretch[:, -1]) ** 2
    return offset, basis, weight, radius, orthogonal, triangle, condition
