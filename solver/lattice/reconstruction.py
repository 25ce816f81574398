"""Values at the two sides of every face: the LMLS reconstruction on a lattice, limited."""

from __future__ import annotations

import math

import numpy as np

from solver.arrays import Array
from solver.compiled import kernel
from solver.kernels.limiter import AHEAD, ALL, BEHIND, FRONT, LEAST
from solver.kernels.state import FaceValues


@kernel()
def limited(back: float, forth: float, steepness: float) -> tuple[float, float]:
    """Limit the steps from a cell's mean to its low and high face so that no new extremum appears.

    Parameters
    ----------
    back, forth : float
        Differences to the neighbours behind and ahead.
    steepness : float
        Largest multiple of half a neighbour's difference: 2 stays between neighbours, 1 is minmod.
    """
    b, f = abs(back), abs(forth)
    most = 0.5 * steepness * (b if b < f else f)
    most = most if back * forth > 0.0 else 0.0
    low, high = AHEAD * b - BEHIND * f, -BEHIND * b + AHEAD * f
    return math.copysign(low if low < most else most, back), math.copysign(
        high if high < most else most, back
    )


@kernel(unaliased=True)
def face_values(
    h: Array,
    n: Array,
    t: Array,
    beta: Array,
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

    A velocity is the mean over the mass of a cell. Of one that shows twice its mean depth at a face, all is
    there, and leaves with this mean: if it left slower, the rest, ever thinner, would be ever faster. A dry
    neighbour has no velocity to differ by: toward it a cell shows its mean. Where it moves to it shows LEAST
    of its depth at least: below a steep heap at rest it would show none, and fall without going anywhere.

    A cell beside a dry one shows it no depth before it holds the share FRONT of what lies behind: a front
    would run ahead as a film otherwise, and most of the error of a flow is in the few cells along its front.
    What lies behind has to follow, and the cell may be faster than it by no more than a front is, 2 c: what
    has come off a heap at rest would stay for ever otherwise, and fall without going anywhere.

    Parameters
    ----------
    h, n, t : flat arrays
        Depth (m), velocity along the direction and across it (m s-1).
    beta : flat array
        g cos(xi) K in the direction (eq. 7), m s-2.
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
        # loaded before they are chosen from: a choice of address would be gathered
        here, ahead, behind = n[i], n[a], n[b]
        ahead, behind = ahead if h[a] > dry else here, behind if h[b] > dry else here
        lost = behind - ahead
        slower = min(abs(ahead), abs(behind))
        steepness = 1.0 if slower < lost else 2.0
        out.c[o] = math.sqrt(beta[i] * h[i])
        low, high = limited(h[i] - h[b], h[a] - h[i], steepness)
        # a front follows what is behind it, at most as fast as that can send it
        n_a, n_b = n[a], n[b]
        more_a, more_b = n_a - here, here - n_b
        more_a, more_b = more_a if more_a > 0.0 else 0.0, more_b if more_b > 0.0 else 0.0
        led_a = (here >= 0.0) | ((n_a < 0.0) & (more_a * more_a <= 4.0 * (beta[a] * h[a])))
        led_b = (here <= 0.0) | ((n_b > 0.0) & (more_b * more_b <= 4.0 * (beta[b] * h[b])))
        low_depth, high_depth, least = h[i] - low, h[i] + high, LEAST * h[i]
        low_depth = least if (here < 0.0) & (low_depth < least) else low_depth
        high_depth = least if (here > 0.0) & (high_depth < least) else high_depth
        out.h_low[o] = 0.0 if (h[b] <= dry) & (h[i] < FRONT * h[a]) & led_a else low_depth
        out.h_high[o] = 0.0 if (h[a] <= dry) & (h[i] < FRONT * h[b]) & led_b else high_depth
        low, high = limited(here - behind, ahead - here, steepness)
        low, high = here - low, here + high
        # what is all at the face that it leaves through leaves with the velocity of all
        all_low = (low_depth > ALL * h[i]) & (low < 0.0)
        all_high = (high_depth > ALL * h[i]) & (high > 0.0)
        out.n_low[o], out.n_high[o] = here if all_low else low, here if all_high else high
        t_i, t_a, t_b = t[i], t[a], t[b]
        t_a, t_b = t_a if h[a] > dry else t_i, t_b if h[b] > dry else t_i
        low, high = limited(t_i - t_b, t_a - t_i, 2.0)
        out.t_low[o], out.t_high[o] = t[i] - (0.0 if all_low else low), t[i] + (0.0 if all_high else high)
