"""Depths continued below zero: what an emulator of a depth that is zero in many runs needs.

A dry cell says no more than zero, whether the flow stopped one cell or a kilometre before it. The latent
depth goes on falling with the distance to the flow, so that it is smooth across the edge of the flow.
"""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.ndimage import distance_transform_edt

Array = NDArray[np.float64]

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

        Raises
        ------
        ValueError
            If the threshold is below what counts as wet.
        """
        relative = threshold / self.size
        if relative < WET:
            raise ValueError(f"expected a threshold of at least {WET * self.size:g}, found {threshold:g}")
        return float(np.sqrt(relative)) if self.root else relative

    def of(self, fields: Iterable[Array], spacing: tuple[float, float]) -> Array:
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
            Of single precision: the values where wet; elsewhere what falls with the distance to the nearest
            wet cell. Without any wet cell the distance is the diagonal of the field.
        """
        return np.stack([self._one(np.asarray(field, np.float64), spacing) for field in fields])

    def _one(self, field: Array, spacing: tuple[float, float]) -> NDArray[np.float32]:
        relative = field / self.size
        wet = relative > WET
        if wet.any():
            distance = distance_transform_edt(~wet, sampling=spacing)
        else:
            distance = np.full(
                field.shape, np.hypot(*(n * d for n, d in zip(field.shape, spacing, strict=True)))
            )
        values = np.sqrt(np.maximum(relative, 0)) if self.root else relative
        edge = np.sqrt(WET) if self.root else WET
        return np.where(wet, values, edge - self.slope * distance).astype(np.float32)


def candidates(size: float = 1.0) -> tuple[Latent, ...]:
    """Continuations that are tried; leave-one-out chooses among them."""
    return tuple(Latent(slope, root, size) for root in (False, True) for slope in SLOPES)
