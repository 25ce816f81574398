"""The ground below the page's map: elevations, their shade, and contour lines."""

from __future__ import annotations

from typing import Any

import numpy as np
import xarray as xr
from numpy.typing import NDArray

from pipeline.assess.relief import hillshade
from pipeline.report.packing import pack

Array = NDArray[np.float64]
CONTOURS = 20
# greys of the darkest and of the brightest slope, and of what is not known
DARKEST, BRIGHTEST, UNKNOWN = 0.55, 1.0, 0.9
# of a cell: how far lines may be from where they were found, and how finely their places are given
OFF, FINE = 0.2, 0.1
# of cells: shorter lines are left out
SHORTEST = 4.0


def ground(found: xr.Dataset, block: int) -> dict[str, Any] | None:
    """Pack elevations, in steps above the lowest, and the grey of the ground; None where nothing is known.

    Parameters
    ----------
    found : Dataset
        Hazard maps over a lattice.
    block : int
        Cells of the lattice along a cell of the page's map.
    """
    if "elevation" not in found.coords:
        return None
    z = found["elevation"].to_numpy().astype(np.float64)
    flat = z.ndim == 1
    x, y = (found[axis].to_numpy().astype(np.float64) for axis in ("x", "y"))
    spacing = float(x[1] - x[0])
    low, high = float(np.nanmin(z)), float(np.nanmax(z))
    span = max(high - low, 1e-6)
    step = max(span / 60000, min(0.1, span / 1000))
    coarse = np.broadcast_to(z, (len(y), len(x)))[::block, ::block]
    # a profile is the same across: its light would say nothing of the ground
    shade = np.ones(coarse.shape) if flat else hillshade(coarse, spacing * block)
    grey = np.nan_to_num(DARKEST + (BRIGHTEST - DARKEST) * shade, nan=UNKNOWN)
    rows = slice(0, 1) if flat else slice(None)
    interval = _interval(span)
    levels = interval * np.arange(np.floor(low / interval) + 1, np.ceil(high / interval))
    lines = _across(x, y, z, levels) if flat else _contours(x, y, z, levels)
    return {
        "low": low,
        "step": step,
        "interval": interval,
        "elevation": pack(np.nan_to_num((coarse[rows] - low) / step).astype(np.uint16)),
        "grey": pack((255 * grey[rows]).astype(np.uint16)),
        "rows": 1 if flat else coarse.shape[0],
        "contours": lines,
    }


def _across(x: Array, y: Array, z: Array, levels: Array) -> list[dict[str, Any]]:
    """Give the lines of a profile, straight across it."""
    found = []
    for level in levels:
        for i in np.flatnonzero(np.diff(z > level)):
            at = x[i] + (x[i + 1] - x[i]) * (level - z[i]) / (z[i + 1] - z[i])
            line = [round(float(at), 2), float(y[0]), round(float(at), 2), float(y[-1])]
            found.append({"level": float(level), "line": line})
    return found


def _contours(x: Array, y: Array, z: Array, levels: Array) -> list[dict[str, Any]]:
    """Give the lines of an elevation model: level, and places as x, y, x, y and so on, m."""
    import shapely
    from contourpy import contour_generator

    generator = contour_generator(x, y, np.ma.masked_invalid(z))
    spacing = float(x[1] - x[0])
    digits = max(0, int(np.ceil(-np.log10(FINE * spacing))))
    found = []
    for level in levels:
        for line in generator.lines(float(level)):
            curve = shapely.LineString(np.asarray(line)).simplify(OFF * spacing)
            if curve.length >= SHORTEST * spacing:
                places = np.round(shapely.get_coordinates(curve), digits)
                found.append({"level": float(level), "line": places.ravel().tolist()})
    return found


def _interval(span: float) -> float:
    power = 10.0 ** np.floor(np.log10(span / CONTOURS))
    return float(next(step * power for step in (1, 2, 5, 10) if step * power * CONTOURS >= span))
