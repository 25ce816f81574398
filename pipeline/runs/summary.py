"""What a run comes down to: extent and reach of its deposit, and its peaks."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any, Literal

import numpy as np
from numpy.typing import NDArray

from solver.points.cloud import PointCloud
from solver.points.lattice import Lattice

Array = NDArray[np.float64]
# lengths closer than this part of the extent are equal
_ROUND_OFF = 1e-9


def whole(row: Mapping[Any, Any]) -> float:
    """All that has been in the flow of a run: the volume released, come in and entrained, m3."""
    # a store that was made before has none that was entrained
    entrained = row.get("volume_entrained", 0.0)
    return float(row["volume_released"] + row["volume_in"] + (entrained if entrained > 0 else 0.0))


def overrun(row: Mapping[Any, Any]) -> float:
    """Share of all that has been in the flow that left through open sides."""
    # a store that was made before has what left through all sides alone
    lost = row.get("volume_out_open", row["volume_out"])
    return float(lost / whole(row))


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

    The deposit is where its depth is above the threshold; its places are those of the points. The toe is the
    point of the deposit farthest along the direction of the flow, whatever direction x has (`downstream`).
    The crown is the highest point the release covers; of equally high ones the farthest upstream.

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
        Depth above which a cell belongs to the deposit, or was reached by the flow, m.

    Returns
    -------
    dict of str to float
        The summaries of ``pipeline.store.variables``; those of a deposit that is not there are NaN, its area
        and volume 0.
    """
    x, y = points.coordinates
    area = np.broadcast_to(points.cell_area, points.shape)
    elevation, distance = (np.broadcast_to(a, points.shape) for a in (elevation, horizontal_distance))
    found = {"peak_depth": float(np.max(max_depth)), "peak_speed": float(np.max(max_speed))}
    covered, reached, release = deposit_depth > threshold, max_depth > threshold, release_depth > 0
    way = downstream(points, elevation, release_depth, reached)
    crown = _crown(way * x, elevation, release) if release.any() else None
    if reached.any():
        front = _farthest(way * x, reached)
        found["flow_front_x"] = float(x[front])
        if crown is not None:
            found["flow_runout_distance"] = float(way * (distance[front] - distance[crown]))
    cells = np.where(covered, deposit_depth * area, 0.0)
    volume = float(cells.sum())
    found |= {"deposit_area": float(area[covered].sum()), "deposit_volume": volume}
    if not covered.any():
        return found
    toe, tail = _farthest(way * x, covered), _farthest(-way * x, covered)
    across = y[covered]
    found |= {
        "front_x": float(x[toe]),
        "tail_x": float(x[tail]),
        "deposit_length": float(way * (x[toe] - x[tail])),
        "deposit_width": float(across.max() - across.min()),
        "deposit_max_depth": float(deposit_depth[covered].max()),
        "deposit_centroid_x": float((cells * x).sum()) / volume,
    }
    if crown is not None:
        runout = float(way * (distance[toe] - distance[crown]))
        drop = float(elevation[crown] - elevation[toe])
        found |= {
            "runout_distance": runout,
            "drop_height": drop,
            "reach_angle": float(np.degrees(np.arctan2(drop, runout))),
        }
    return found


def affected_area(
    points: Lattice | PointCloud, reached: NDArray[np.bool_], inclination: Array | float = 0.0
) -> float:
    """Area in plan of the cells that the flow reached, m2.

    Parameters
    ----------
    points : Lattice or PointCloud
        On a profile along the bed, else in plan.
    reached : array of bool
        Where the flow came, of the shape of the points.
    inclination : array or float
        Of a profile at the points, or of shape (nx,) along those of a lattice, rad.
    """
    in_plan = np.broadcast_to(points.cell_area * np.cos(inclination), points.shape)
    return float(in_plan[reached].sum())


def downstream(
    points: Lattice | PointCloud, elevation: Array, release_depth: Array, reached: NDArray[np.bool_]
) -> Literal[-1, 1]:
    """Direction of the flow along x: 1 where it goes with growing x, -1 where it goes against it.

    It is that in which the centre of the area released and reached lies from that of the release. Where the
    flow came to an end of the points, so that what it reached is cut off, it is that in which the bed falls
    under the release. Where neither says anything, as of a heap that stays where it is, it is 1.

    Parameters
    ----------
    points : Lattice or PointCloud
        The points; the shape of arrays below is theirs.
    elevation : array
        Of the bed, m.
    release_depth : array
        Depth at the start, m.
    reached : array of bool
        Where the flow came.
    """
    x, area = points.coordinates[0], np.broadcast_to(points.cell_area, points.shape)
    release = release_depth > 0
    if not (release.any() and reached.any()):
        return 1
    size, spacing = float(np.ptp(x)), float(np.sqrt(area.max()))
    released = release_depth * area
    middle = float(np.average(x, weights=released))
    either = reached | release
    moved = float(np.average(x[either], weights=area[either]) - np.average(x[release], weights=area[release]))
    fall = -float(((x - middle) * (elevation - elevation.mean()) * released).sum() / released.sum())
    ends = x[reached].min() - x.min(), x.max() - x[reached].max()
    signs = [
        0 if abs(value) <= _ROUND_OFF * scale else int(np.sign(value))
        for value, scale in ((moved, size), (fall, size * (size + float(np.ptp(elevation)))))
    ]
    if min(ends) < spacing:
        signs.reverse()
    return -1 if next(filter(None, signs), 1) < 0 else 1


def _crown(ahead: Array, elevation: Array, release: NDArray[np.bool_]) -> tuple[np.intp, ...]:
    """Index of the highest point of a release; of equally high ones that with the least ``ahead``."""
    heights = elevation[release]
    level = heights.max() - _ROUND_OFF * (np.ptp(elevation) + np.ptp(ahead))
    return _farthest(-ahead, release & (elevation >= level))


def _farthest(ahead: Array, where: NDArray[np.bool_]) -> tuple[np.intp, ...]:
    """Index of the point with the largest value among some."""
    return np.unravel_index(np.argmax(np.where(where, ahead, -np.inf)), ahead.shape)
