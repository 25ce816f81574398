"""Fields on one lattice brought to the points of another."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray
from scipy.interpolate import RegularGridInterpolator

Array = NDArray[np.float64]


def interpolated(
    fields: NDArray[np.floating], axes: tuple[Array, Array], to: tuple[Array, Array]
) -> NDArray[np.float32]:
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
    found: NDArray[np.float32] = np.moveaxis(at(points), -1, 0).astype(np.float32)
    return found
