"""The HLL flux through a run of faces (Harten, Lax & van Leer 1983), with dry-bed estimates of the speeds.

The speed toward a dry side is that of a dam-break front, u + 2 c (Ritter 1892; Toro 2001).
"""

from __future__ import annotations

import numpy as np

from solver.arrays import Array
from solver.compiled import kernel
from solver.kernels.state import BELOW_YIELD, FaceValues, Fluxes


@kernel(unaliased=True)
def hll(
    low: FaceValues,
    low_at: int,
    high: FaceValues,
    high_at: int,
    static: Array,
    cell: int,
    neighbour: int,
    count: int,
    dry: float,
    out: Fluxes,
    to: int,
) -> None:
    """Fluxes through faces between cells on their low side and cells on their high side.

    The pressure is given without its factor beta: each cell multiplies it by its own, so that a jump of the
    earth-pressure coefficient exerts no force by itself. Nothing leaves a static cell; otherwise HLL's
    diffusion would make a heap creep, and cells that press against a heap would never come to rest.

    Parameters
    ----------
    low, low_at, high, high_at
        Values of the cells on the two sides and the index of the first of them.
    static : flat array
        DRY or BELOW_YIELD where a cell is so at the start of the step, else 0.
    cell, neighbour, count : int
        Index of the first cell on the low side, distance to the one on the high side, number of faces.
    dry : float
        Depth up to which a side counts as dry, m.
    out : Fluxes
        Filled from index ``to`` on.
    """
    step = np.uint64(neighbour)
    for k in range(count):
        k_ = np.uint64(k)
        one, two = np.uint64(low_at) + k_, np.uint64(high_at) + k_
        i, o = np.uint64(cell) + k_, np.uint64(to) + k_
        a, b = low.h_high[one], high.h_low[two]
        p, q = low.n_high[one], high.n_low[two]
        s, t = low.t_high[one], high.t_low[two]
        c_a, c_b = low.c[one], high.c[two]
        first, second = p - c_a if a > dry else q - 2.0 * c_b, q - c_b
        slow = first if first < second else second
        slow = slow if slow < 0.0 else 0.0
        first, second = q + c_b if b > dry else p + 2.0 * c_a, p + c_a
        fast = first if first > second else second
        fast = fast if fast > 0.0 else 0.0
        per = 1.0 / (fast - slow + 1e-300)
        w_a, w_b = fast * per, -slow * per
        w = (fast * slow) * per
        ap, bq = a * p, b * q
        through = w_a * ap + w_b * bq + w * (b - a)
        # nothing leaves a static cell: what flows toward it enters, and is held up if it is below yield
        from_a, from_b = through > 0.0, through < 0.0
        static_a, static_b = static[i], static[i + step]
        a_static, b_static = static_a > 0.0, static_b > 0.0
        blocked = (from_a & a_static) | (from_b & b_static)
        moves = not (a_static & b_static)
        depth, speed = a if from_b else b, p if from_b else q
        inward = speed > 0.0 if from_b else speed < 0.0
        entering = depth * speed if inward & moves else 0.0
        impulse = w_a * (ap * p) + w_b * (bq * q) + w * (bq - ap)
        pressed = w_a * (a * a) + w_b * (b * b)
        # what was dry and got wet in an earlier stage gives nothing yet, and holds nothing up: neither side
        # is pushed through the face by what cannot pass it
        supports = (static_b if from_b else static_a) == BELOW_YIELD
        shallow = a if a < b else b
        depth = depth if supports else shallow
        through = entering if blocked else through
        out.mass[o] = through
        out.normal[o] = entering * speed if blocked else impulse
        out.tangential[o] = through * (s if through > 0.0 else t)
        out.pressure[o] = 0.5 * (depth * depth if blocked else pressed)
