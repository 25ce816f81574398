"""What fluxes, gravity and friction make of a cell in one Runge-Kutta stage."""

from __future__ import annotations

import math

import numpy as np

from solver.compiled import kernel
from solver.kernels.state import HOLDS, Fields


@kernel()
def braked(
    hu: float,
    hv: float,
    h: float,
    u_before: float,
    h_before: float,
    normal: float,
    curvature: float,
    braking: float,
    dry: float,
) -> float:
    """Velocity that dry friction leaves, per unit of momentum, m-1; 0 for what it stops and what is dry.

    Parameters
    ----------
    hu, hv, h : float
        Momentum (m2 s-1) and depth (m) without friction.
    u_before, h_before : float
        Velocity along the bed (m s-1) and depth (m) that load the friction.
    normal, curvature : float
        g cos(xi), m s-2, and kappa, m-1.
    braking : float
        tan(delta) times the time that friction acts, s.
    dry : float
        Depth up to which a cell counts as dry, m.
    """
    load = normal + curvature * (u_before * u_before)
    load = load if load > 0.0 else 0.0
    size, brake = math.sqrt(hu * hu + hv * hv), braking * load * h_before
    per_depth = (size - brake) / (size * h + 1e-300)
    return per_depth if (size > brake * HOLDS) & (h > dry) else 0.0


@kernel()
def loaded(before: float, after: float) -> float:
    """Depth that gravity and friction act on in a stage, m, by the depths before and after it.

    It is the one before, but at most twice the one after: what is left of a cell that runs dry would
    otherwise be given the momentum of all that has left it.
    """
    left = 2.0 * after if after > 0.0 else 0.0
    return before if before < left else left


@kernel()
def dragged(speed: float, h: float, drag: float) -> float:
    """Share of a speed (m s-1) that turbulent drag leaves at depth h (m); drag as in `drag_row`."""
    resistance = 4.0 * drag * speed / (h if h > 0.0 else 1.0)
    return 2.0 / (1.0 + math.sqrt(1.0 + resistance))


@kernel()
def drag_row(out: Fields, cell: int, count: int, drag: float) -> None:
    """Slow a run of cells by turbulent drag, implicitly, which makes the terminal velocity exact.

    drag : g / turbulent friction times the step, s.
    """
    for k in range(count):
        i = np.uint64(cell) + np.uint64(k)
        u, v, h = out.u[i], out.v[i], out.h[i]
        slowed = dragged(math.sqrt(u * u + v * v), h, drag)
        out.u[i], out.v[i] = u * slowed, v * slowed
