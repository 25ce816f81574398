"""The ground below a map: hillshade and contour lines of an elevation model."""

from __future__ import annotations

import numpy as np
from matplotlib.axes import Axes
from matplotlib.ticker import MaxNLocator
from numpy.typing import NDArray

Array = NDArray[np.float64]
# where the light comes from, degrees
AZIMUTH, HEIGHT = 315.0, 45.0
# greys of the darkest and of the brightest slope: light, so that colours above can be told
DARKEST, BRIGHTEST = 0.55, 1.0
CONTOURS = 16


def hillshade(elevation: Array, spacing: float) -> Array:
    """Give the brightness of slopes lit from the north-west, 0 to 1, of the same shape.

    Parameters
    ----------
    elevation : (ny, nx) array
        Rows from south to north, m; NaN where nothing is known, which stays so.
    spacing : float
        m.
    """
    north, east = (np.gradient(elevation, spacing, axis=axis) for axis in (0, 1))
    azimuth, height = np.radians([AZIMUTH, HEIGHT])
    light = (np.sin(azimuth) * np.cos(height), np.cos(azimuth) * np.cos(height), np.sin(height))
    along = light[2] - east * light[0] - north * light[1]
    return np.asarray(np.clip(along / np.sqrt(1 + east**2 + north**2), 0.0, 1.0))


def draw_relief(panel: Axes, x: Array, y: Array, elevation: Array, *, named: bool = True) -> None:
    """Draw hillshade and contour lines of the ground, below all else; x (nx,) and y (ny,), m."""
    spacing = float(x[1] - x[0])
    half = spacing / 2
    panel.imshow(
        DARKEST + (BRIGHTEST - DARKEST) * hillshade(elevation, spacing),
        origin="lower",
        extent=(x[0] - half, x[-1] + half, y[0] - half, y[-1] + half),
        cmap="gray",
        vmin=0,
        vmax=1,
        zorder=0,
        interpolation="nearest",
    )
    known = np.ma.masked_invalid(elevation)
    low, high = float(known.min()), float(known.max())
    levels = np.asarray(MaxNLocator(CONTOURS, steps=[1, 2, 2.5, 5, 10]).tick_values(low, high))
    levels = levels[(levels > low) & (levels < high)]
    if levels.size:
        lines = panel.contour(x, y, known, levels=levels, colors="0.35", linewidths=0.4, zorder=0.5)
        if named:
            panel.clabel(lines, fontsize="xx-small", fmt="%g m", inline_spacing=1)
