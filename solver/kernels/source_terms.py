"""The model in one cell: mass, momentum, gravity and basal friction (eqs. 1 to 5).

    h_t     + (h u)_x   + (h v)_y                           = 0
    (h u)_t + (h u^2)_x + (h u v)_y + beta_x (h^2/2)_x      = g h sin xi - F u / |u|
    (h v)_t + (h u v)_x + (h v^2)_y + beta_y (h^2/2)_y      =            - F v / |u|

    F = h R(|u|, h), and at most h R(0, h) at rest; with Voellmy's law
    R = tan(delta) max(0, g cos xi + kappa u^2) + g |u|^2 / (turbulent friction h).

The three forms differ in how they find the derivatives; what these and the sources make of a cell is here.
"""

from __future__ import annotations

import math

from solver.compiled import kernel
from solver.kernels.friction import held_momentum, slowed
from solver.kernels.state import YIELD_TOLERANCE
from solver.physics.resistance import Uniform

# Depth, momentum or velocity along and across.
Cell = tuple[float, float, float]
# A speed below this share of that of waves is none, and a component of velocity below this share of the other
# one. What decays ahead of a flow switches limiters by its sign, however small it is, and once its products
# underflow a result depends on the units that it is computed in.
NOTHING = 1e-60


@kernel(inline=True)
def acting_share(before: float, after: float) -> float:
    """Share of a cell's depth that gravity, friction and pressure act on in a stage, by the depths around it.

    It is all of it, but at most twice what is left: what is left of a cell that runs dry would otherwise be
    given the momentum of all that has left it.
    """
    left = 2.0 * after if after > 0.0 else 0.0
    return left / before if left < before else 1.0


@kernel(inline=True)
def update_cell(
    start: Cell,
    now: Cell,
    transport: Cell,
    drive: tuple[float, float],
    bed: tuple[float, float],
    load: float,
    part: float,
    dt: float,
    law: Uniform,
    dry: float,
    still: float,
) -> Cell:
    """Take one stage: ``U = U_0 + part (U_1 - U_0 + dt L(U_1))``, then friction over ``part dt``.

    The convex combination comes first, then friction at rest as a force of at most ``h R(0, h)`` against the
    motion, so that it stops a cell exactly. It acts on the depth that gravity acts on: with the new depth
    instead, a front would feel friction before gravity and lag. What friction gains with speed is implicit,
    which makes terminal speeds exact.

    Parameters
    ----------
    start, now : tuple
        U_0 and U_1, depth (m) and velocity (m s-1).
    transport : tuple
        Less the divergence of the fluxes of mass (m s-1) and momentum (m2 s-2).
    drive : tuple
        Pressure and gravity along and across, so far as they are not in ``transport``, m2 s-2.
    bed : tuple
        g cos(xi) (m s-2) and kappa (m-1).
    load : float
        Depth that friction acts on, m.
    part : float
        Weight of the stage in the combination with U_0.
    dt : float
        Time step, s.
    law : named tuple
        Of basal friction.
    dry : float
        Depth up to which a cell counts as dry, m. A film keeps its velocity, unless most of it came in this
        stage: what pressure gives it, and what is left of what came and went, is divided by next to nothing.
    still : float
        Depth up to which nothing moves, m.

    Returns
    -------
    tuple
        Depth (m) and velocity (m s-1).
    """
    h_0, u_0, v_0 = start
    h_1, u_1, v_1 = now
    hu, hv = h_0 * u_0, h_0 * v_0
    h = h_0 + part * ((h_1 - h_0) + dt * transport[0])
    hu += part * ((h_1 * u_1 - hu) + dt * (transport[1] + drive[0]))
    hv += part * ((h_1 * v_1 - hv) + dt * (transport[2] + drive[1]))
    ran_dry = (h <= dry) & (dt * transport[0] <= h_1)
    hu, hv = h * u_1 if ran_dry else hu, h * v_1 if ran_dry else hv
    normal, curvature = bed
    pressure = normal + curvature * (u_1 * u_1)
    pressure = pressure if pressure > 0.0 else 0.0
    time = part * dt
    per_depth = velocity_left(hu, hv, h, held_momentum(law, h, load, pressure, time), normal, still)
    u, v = component(hu, hv) * per_depth, component(hv, hu) * per_depth
    u, v = slowed(law, u, v, h, load, pressure, time)
    return h, u, v


@kernel(inline=True)
def component(q: float, other: float) -> float:
    """Component of momentum, 0 where it is next to nothing of the other one."""
    return q if abs(q) > NOTHING * abs(other) else 0.0


@kernel(inline=True)
def velocity_left(hu: float, hv: float, h: float, brake: float, normal: float, still: float) -> float:
    """Velocity that friction at rest leaves, per unit of momentum, m-1.

    0 for what it stops, what is too thin to move, and what is next to nothing beside the speed of waves.

    Parameters
    ----------
    hu, hv, h : float
        Momentum (m2 s-1) and depth (m) without friction.
    brake : float
        Momentum that friction takes at most, m2 s-1.
    normal : float
        g cos(xi), m s-2.
    still : float
        Depth up to which nothing moves, m.
    """
    square = hu * hu + hv * hv
    size, least = math.sqrt(square), NOTHING * NOTHING * (normal * (h * h * h))
    per_depth = (size - brake) / (size * h + 1e-300)
    moves = (size > brake * YIELD_TOLERANCE) & (square > least) & (h > still)
    return per_depth if moves else 0.0
