"""What a run on an elevation model comes down to: reach and drop in plan, area and volume of its deposit."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from solver.points.lattice import Lattice

Array = NDArray[np.float64]
Cell = tuple[np.intp, ...]
# what is thinner has no speed that counts, m
FILM = 0.05


def summarise_on_surface(
    points: Lattice,
    elevation: Array,
    area: Array,
    release_depth: Array,
    deposit_depth: Array,
    max_depth: Array,
    max_speed: Array,
    threshold: float,
) -> dict[str, float]:
    """Summaries of a run, by name of variable.

    The deposit is where its depth is above the threshold. The crown is the highest cell of the release, the
    toe the lowest cell of the deposit; of equally high ones those farthest from each other. Distances are
    horizontal and straight, from crown to toe. The area of the deposit is in plan, volumes are by the area on
    the bed.

    Parameters
    ----------
    points : Lattice
        Eastings and northings; the shape of arrays below is theirs.
    elevation : array
        Of the bed, m; NaN where nothing is known.
    area : array
        Of the cells on the bed, m2.
    release_depth, deposit_depth, max_depth : array
        Depth at the start, in the last state, and the largest over all time steps, m.
    max_speed : array
        Largest speed over all time steps, m s-1; that of films does not count.
    threshold : float
        Depth above which a cell belongs to the deposit, or was reached by the flow, m.

    Returns
    -------
    dict of str to float
        The summaries of ``pipeline.store.variables`` that have a meaning on a surface; of a deposit that is
        not there its area and volume, which are 0.
    """
    thick = max_depth > FILM
    found = {
        "peak_depth": float(np.max(max_depth)),
        "peak_speed": float(max_speed[thick].max()) if thick.any() else 0.0,
    }
    known = np.isfinite(elevation)
    covered, reached = deposit_depth > threshold, max_depth > threshold
    release = (release_depth > 0) & known
    found |= {
        "deposit_area": float(covered.sum()) * points.cell_area,
        "deposit_volume": float((deposit_depth * area)[covered].sum()),
    }
    if covered.any():
        found["deposit_max_depth"] = float(deposit_depth[covered].max())
    if (reached & known).any():
        found["lowest_elevation"] = float(elevation[reached & known].min())
    if not release.any():
        return found
    if (reached & known).any():
        crown, lowest = _between(points, elevation, release, reached & known)
        found["flow_runout_distance"] = _distance(points, crown, lowest)
    if (covered & known).any():
        crown, toe = _between(points, elevation, release, covered & known)
        runout, drop = _distance(points, crown, toe), float(elevation[crown] - elevation[toe])
        found |= {
            "runout_distance": runout,
            "drop_height": drop,
            "reach_angle": float(np.degrees(np.arctan2(drop, runout))),
        }
    return found


def _between(
    points: Lattice, elevation: Array, release: NDArray[np.bool_], reached: NDArray[np.bool_]
) -> tuple[Cell, Cell]:
    """Find the highest cell of a release and the lowest that was reached."""
    highest = np.argwhere(release & (elevation == elevation[release].max()))
    lowest = np.argwhere(reached & (elevation == elevation[reached].min()))
    pairs = [(tuple(a), tuple(b)) for a in highest for b in lowest[:: max(1, len(lowest) // 100)]]
    return max(pairs, key=lambda pair: _distance(points, *pair))


def _distance(points: Lattice, start: Cell, stop: Cell) -> float:
    """Horizontal distance between two cells, m."""
    (j, i), (n, m) = start, stop
    return float(np.hypot(points.x_points[m] - points.x_points[i], points.y_points[n] - points.y_points[j]))
