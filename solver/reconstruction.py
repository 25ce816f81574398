"""Values at the two sides of every face: the LMLS reconstruction on a lattice, limited."""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np

from solver.compiled import Array, kernel

# The shape functions of eq. 23 at the far face of the middle of three cells, degree 2, from cell means.
BEHIND, MIDDLE, AHEAD = -1 / 6, 5 / 6, 1 / 3


class FaceValues(NamedTuple):
    """Depth (m), normal and tangential velocity (m s-1) at the low and high face of cells; flat arrays."""

    h_low: Array
    h_high: Array
    n_low: Array
    n_high: Array
    t_low: Array
    t_high: Array


@kernel()
def limited(back: float, forth: float, near: float, far: float, steepness: float) -> float:
    """Limit the step from a cell's mean to its face so that no new extremum appears.

    Parameters
    ----------
    back, forth : float
        Differences to the neighbours behind and ahead.
    near, far : float
        Weights of the two differences in the unlimited step.
    steepness : float
        Largest multiple of half a neighbour's difference: 2 stays between neighbours, 1 is minmod.
    """
    low = abs(back) if abs(back) < abs(forth) else abs(forth)
    low = 0.5 * steepness * low
    wanted = abs(near * back + far * forth)
    size = wanted if wanted < low else low
    return math.copysign(size, back) if back * forth > 0.0 else 0.0


@kernel()
def face_values(
    h: Array,
    n: Array,
    t: Array,
    cell: int,
    neighbour: int,
    count: int,
    dry: float,
    out: FaceValues,
    to: int,
) -> None:
    """Reconstruct a run of cells at their low and high faces along one direction.

    Where the flow is being stopped (from one neighbour to the other it loses at least half its speed) depth
    and normal velocity are limited by minmod: a steeper limiter rings at a granular shock, and friction turns
    the ringing into a wrong shock speed. A dry neighbour has no velocity to compress with.

    Parameters
    ----------
    h, n, t : flat arrays
        Depth (m), velocity along the direction and across it (m s-1).
    cell, count : int
        Index of the first cell, and number of cells.
    neighbour : int
        Distance in memory to the neighbour ahead: 1 along x, the row length along y.
    dry : float
        Depth up to which a cell counts as dry, m.
    out : FaceValues
        Filled from index ``to`` on.
    """
    step = np.uint64(neighbour)
    for k in range(count):
        i, o = np.uint64(cell) + np.uint64(k), np.uint64(to) + np.uint64(k)
        b, a = i - step, i + step
        ahead = n[a] if h[a] > dry else n[i]
        behind = n[b] if h[b] > dry else n[i]
        lost = behind - ahead
        slower = min(abs(ahead), abs(behind))
        steepness = 1.0 if slower < lost else 2.0
        back, forth = h[i] - h[b], h[a] - h[i]
        out.h_low[o] = h[i] - limited(back, forth, AHEAD, -BEHIND, steepness)
        out.h_high[o] = h[i] + limited(back, forth, -BEHIND, AHEAD, steepness)
        back, forth = n[i] - n[b], n[a] - n[i]
        out.n_low[o] = n[i] - limited(back, forth, AHEAD, -BEHIND, steepness)
        out.n_high[o] = n[i] + limited(back, forth, -BEHIND, AHEAD, steepness)
        back, forth = t[i] - t[b], t[a] - t[i]
        out.t_low[o] = t[i] - limited(back, forth, AHEAD, -BEHIND, 2.0)
        out.t_high[o] = t[i] + limited(back, forth, -BEHIND, AHEAD, 2.0)
