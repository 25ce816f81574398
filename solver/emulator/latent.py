"""Depths continued below zero: what an emulator of a depth that is zero in many runs needs.

A dry cell says no more than zero, whether the flow stopped one cell or a kilometre before it. The latent
depth goes on falling with the distance to the flow, so that it is smooth across the edge of the flow.
"""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.interpolate import RegularGridInterpolator
from scipy.ndimage import distance_transform_edt

Array = NDArray[np.float64]
Single = NDArray[np.float32]

# depth above which a cell is wet, and depths by metre that dry cells lie below it
WET = 0.02
SLOPES = (0.005, 0.01, 0.02, 0.04)


@dataclass(frozen=True)
class Latent:
    """How a field is continued.

    Parameters
    ----------
    slope : float
        Fall by metre of distance to the nearest wet cell, for a field whose ``size`` is 1.
    root : bool
        Whether the square root of the field is continued.
    size : float
        What values of the field are relative to; depths in m have 1.
    """

    slope: float
    root: bool = False
    size: float = 1.0

    def level(self, threshold: float) -> float:
        """Give the latent value that a threshold of the field has.

        It is rounded as latent values are: a field at the threshold is at the level, and not above.

        Raises
        ------
        ValueError
            If the threshold is below what counts as wet.
        """
        relative = _relative(np.array([np.float32(threshold)]), self.size)
        if threshold < WET * self.size:
            raise ValueError(f"expected a threshold of at least {WET * self.size:g}, found {threshold:g}")
        return float((np.sqrt(relative) if self.root else relative).astype(np.float32)[0])

    def of(self, fields: Iterable[NDArray[np.floating]], spacing: tuple[float, float]) -> Single:
        """Continue fields of runs.

        Parameters
        ----------
        fields : iterable of array, shape (ny, nx)
            Of each run, at least 0.
        spacing : tuple of float
            Distance of neighbouring cells along y and x, m.

        Returns
        -------
        array, shape (runs, ny, nx)
            Of single precision; see `Wet.continued`.
        """
        return wet(fields, spacing, self.size).continued(self)


@dataclass(frozen=True)
class Wet:
    """Fields of runs apart from how they are continued, of single precision, shape (runs, ny, nx) each.

    Parameters
    ----------
    values, roots : array
        Relative to a size, and their square roots, of what is wet; elsewhere those of the edge.
    away : array
        Distance to the nearest wet cell, m, 0 where wet. Without any wet cell it is the diagonal of the
        field.
    """

    values: Single
    roots: Single
    away: Single

    def continued(self, latent: Latent) -> Single:
        """Give the values where wet; elsewhere what falls with the distance to the nearest wet cell."""
        found: Single = (self.roots if latent.root else self.values) - np.float32(latent.slope) * self.away
        return found

    def interpolated(self, axes: tuple[Array, Array], to: tuple[Array, Array]) -> Wet:
        """Bring the fields to other points, see `interpolated`."""
        return Wet(*(interpolated(each, axes, to) for each in (self.values, self.roots, self.away)))


def wet(fields: Iterable[NDArray[np.floating]], spacing: tuple[float, float], size: float = 1.0) -> Wet:
    """Find what is wet of fields of runs, (ny, nx) each, and how far all else is from it."""
    values, roots, away = [], [], []
    for field in fields:
        relative = _relative(field, size)
        covered = relative > WET
        if covered.any():
            distance = distance_transform_edt(~covered, sampling=spacing)
        else:
            diagonal = np.hypot(*(n * d for n, d in zip(field.shape, spacing, strict=True)))
            distance = np.full(field.shape, diagonal)
        held = np.where(covered, relative, WET)
        values.append(held.astype(np.float32))
        roots.append(np.sqrt(held).astype(np.float32))
        away.append(distance.astype(np.float32))
    return Wet(np.stack(values), np.stack(roots), np.stack(away))


def _relative(field: NDArray[np.floating], size: float) -> Array:
    found: Array = np.asarray(field, np.float64) / size
    return found


def interpolated(fields: NDArray[np.floating], axes: tuple[Array, Array], to: tuple[Array, Array]) -> Single:
    """Interpolate fields bilinearly; beyond the outer points they go on as at the edge.

    Parameters
    ----------
    fields : array, shape (runs, ny, nx)
        Of each run.
    axes : tuple of array, shapes (ny,) and (nx,)
        Ascending coordinates of the points.
    to : tuple of array, shapes (my,) and (mx,)
        Those of the points that are asked for.

    Returns
    -------
    array, shape (runs, my, mx)
        Of single precision; the fields as they are where the points are the same.
    """
    if all(len(a) == len(b) and np.allclose(a, b, rtol=0, atol=1e-9) for a, b in zip(axes, to, strict=True)):
        return fields.astype(np.float32, copy=False)
    places = [np.clip(b, a[0], a[-1]) for a, b in zip(axes, to, strict=True)]
    points = np.stack(np.meshgrid(*places, indexing="ij"), axis=-1)
    at = RegularGridInterpolator(axes, np.moveaxis(fields, 0, -1).astype(np.float64))
    found: Single = np.moveaxis(at(points), -1, 0).astype(np.float32)
    return found


def candidates(size: float = 1.0) -> tuple[Latent, ...]:
    """Continuations that are tried; leave-one-out chooses among them."""
    return tuple(Latent(slope, root, size) for root in (False, True) for slope in SLOPES)
