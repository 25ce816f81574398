"""What a run comes down to: extent and reach of its deposit, and its peaks."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np
from numpy.typing import NDArray

from solver.points.cloud import PointCloud
from solver.points.lattice import Lattice

Array = NDArray[np.float64]


def overrun(row: Mapping[Any, Any]) -> float:
    """Share of the volume, released or come in, that left through open sides."""
    # a store that was made before has what left through all sides alone
    lost = row.get("volume_out_open", row["volume_out"])
    return float(lost / (row["volume_released"] + row["volume_in"]))


def summarise(
    points: Lattice | PointCloud,
    elevation: Array,
    horizontal_distance: Array,
    release_depth: Array,
    deposit_depth: Array,
    max_depth: Array,
    max_speed: Array,
    threshold: float,
) -> dict[str, float]:
    """Summaries of a run, by name of variable.

    The deposit is where its depth is above the threshold; its places are those of the points. The crown is
    the highest point the release covers, the toe the deposit's point of largest arc length.

    Parameters
    ----------
    points : Lattice or PointCloud
        The points; the shape of arrays below is theirs.
    elevation, horizontal_distance : array
        Of the bed at the points, or of shape (nx,) along those of a lattice, m.
    release_depth, deposit_depth, max_depth : array
        Depth at the start, in the last state, and the largest over all time steps, m.
    max_speed : array
        Largest speed over all time steps, m s-1.
    threshold : float
        Depth above which a cell belongs to the deposit, m.

    Returns
    -------
    dict of str to float
        The summaries of ``pipeline.store.variables``; those of a deposit that is not there are NaN, its area
        and volume 0.
    """
    x, y = points.coordinates
    area = np.broadcast_to(points.cell_area, points.shape)
    elevation, distance = (np.broadcast_to(a, points.shape) for a in (elevation, horizontal_distance))
    peaks = {"peak_depth": float(np.max(max_depth)), "peak_speed": float(np.max(max_speed))}
    covered = deposit_depth > threshold
    cells = np.where(covered, deposit_depth * area, 0.0)
    volume = float(cells.sum())
    extent = {"deposit_area": float(area[covered].sum()), "deposit_volume": volume}
    if not covered.any():
        return extent | peaks
    along, across = x[covered], y[covered]
    extent |= {
        "front_x": float(along.max()),
        "tail_x": float(along.min()),
        "deposit_length": float(along.max() - along.min()),
        "deposit_width": float(across.max() - across.min()),
        "deposit_max_depth": float(deposit_depth[covered].max()),
        "deposit_centroid_x": float((cells * x).sum()) / volume,
    }
    release = release_depth > 0
    if not release.any():
        return extent | peaks
    crown, toe = np.argmax(elevation[release]), np.argmax(along)
    runout = float(distance[covered][toe] - distance[release][crown])
    drop = float(elevation[release][crown] - elevation[covered][toe])
    reach = {
        "runout_distance": runout,
        "drop_height": drop,
        "reach_angle": float(np.degrees(np.arctan2(drop, runout))),
    }
    return extent | reach | peaks
