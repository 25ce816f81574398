"""Level surfaces between banks: what a slow layer shows at the edges of its cells where the bed turns.

A depth that is reconstructed with a limiter has no level surface over a crease of the bed, nor at a shore.
Here the surface is reconstructed instead, as far as it is more nearly level than the depth is even.
"""

from __future__ import annotations

import math

from solver.arrays import Array
from solver.compiled import kernel
from solver.kernels.limiter import ALL


@kernel(inline=True)
def levels_at_edges(h: float, tilt: float) -> tuple[float, float]:
    """Depths at the low and high edge of a cell whose surface is level, m (S11).

    What does not cover its cell is a wedge, ``2 sqrt(h tilt)`` deep at its foot, and nothing at its other
    edge.

    Parameters
    ----------
    h : float
        Mean depth, m.
    tilt : float
        Depth that a level surface gains from the middle of the cell to its high edge, m.
    """
    wedge, covers = 2.0 * math.sqrt(h * abs(tilt)), h >= abs(tilt)
    low = h - tilt if covers else (wedge if tilt < 0.0 else 0.0)
    return low, h + tilt if covers else (wedge if tilt > 0.0 else 0.0)


@kernel(inline=True)
def steps_of_surface(
    h: tuple[float, float, float], tilt: tuple[float, float, float]
) -> tuple[float, float, float, float]:
    """Depths at both edges of a cell with a level surface, and the steps of it to the next cells.

    Parameters
    ----------
    h, tilt : tuple
        Of the cell behind, of the cell and of the one ahead, m.

    Returns
    -------
    tuple
        Depth at the low edge and at the high edge, m; differences of the surface from behind and to ahead, m.
    """
    h_b, h_i, h_a = h
    t_b, t_i, t_a = tilt
    low, high = levels_at_edges(h_i, t_i)
    return low, high, low - levels_at_edges(h_b, t_b)[1], levels_at_edges(h_a, t_a)[0] - high


@kernel(inline=True)
def is_level(h: tuple[float, float, float], back: float, forth: float) -> bool:
    """Whether the surface of a cell is more nearly level than its depth is even (S12).

    Parameters
    ----------
    h, back, forth
        As of `steps_of_surface`.
    """
    h_b, h_i, h_a = h
    return abs(forth) + abs(back) < abs(h_a - h_i) + abs(h_i - h_b)


@kernel(inline=True)
def with_level(
    shown: tuple[float, float, float],
    mean: tuple[float, float, float],
    level: float,
    step: float,
    share: float,
    h_beyond: float,
    sign: float,
    dry: float,
) -> tuple[float, float, float]:
    """Move what a cell has at an edge toward a level surface (S13).

    Parameters
    ----------
    shown : tuple
        Depth (m), normal and tangential velocity (m s-1) at the edge, from `face_state`.
    mean : tuple
        The same of the cell.
    level, step : float
        Depth at the edge if the surface is level, and the limited step of the surface to there, m.
    share : float
        How far the surface counts, 0 to 1.
    h_beyond, sign, dry
        As of `face_state`.
    """
    depth, n, t = shown
    h = mean[0]
    # what ends within the cell has nothing at its other edge, and what is not shown to a dry cell stays so
    wanted = level + step if level > 0.0 else 0.0
    wanted = wanted if wanted > 0.0 else 0.0
    most = depth if depth < wanted else wanted
    wanted = most if h_beyond <= dry else wanted
    wanted = depth + share * (wanted - depth)
    # what is all at the edge that it leaves through leaves with the velocity of all
    all_there = (wanted > ALL * h) & (wanted > depth) & (sign * n > 0.0)
    return wanted, mean[1] if all_there else n, mean[2] if all_there else t


@kernel(inline=True)
def slopes_by_level(h: Array, tilt: Array, i: int, step: int, over: float) -> tuple[float, float]:
    """Slopes of depth at both edges of a cell in one direction, by its surface where that counts (S14).

    Parameters
    ----------
    tilt : flat array
        Depth that a level surface gains from the middle of a cell to its high edge, m.
    i, step : int
        The cell, and the distance in memory to the one ahead.
    over : float
        1 / spacing, m-1.
    """
    b, a = i - step, i + step
    depths, tilts = (h[b], h[i], h[a]), (tilt[b], tilt[i], tilt[a])
    low, high, back, forth = steps_of_surface(depths, tilts)
    if not is_level(depths, back, forth):
        return (depths[1] - depths[0]) * over, (depths[2] - depths[1]) * over
    # a wedge is held at its foot
    back, forth = back if low > 0.0 else forth, forth if high > 0.0 else back
    return (2.0 * tilts[1] + back) * over, (2.0 * tilts[1] + forth) * over
