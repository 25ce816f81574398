"""The model in one cell: mass, momentum, gravity, dry friction and turbulent drag (eqs. 1 to 5).

    h_t     + (h u)_x   + (h v)_y                           = 0
    (h u)_t + (h u^2)_x + (h u v)_y + beta_x (h^2/2)_x      = g h sin xi - F u / |u|
    (h v)_t + (h u v)_x + (h v^2)_y + beta_y (h^2/2)_y      =            - F v / |u|

    F <= h tan(delta) max(0, g cos xi + kappa u^2),  and more by  g |u|^2 / turbulent friction.

The three forms differ in how they find the derivatives; what these and the sources make of a cell is here.
"""

from __future__ import annotations

import math

from solver.compiled import kernel
from solver.kernels.state import YIELD_TOLERANCE, Material

# Depth, momentum or velocity along and across.
Cell = tuple[float, float, float]
# A speed below this share of that of waves is none, and a component of velocity below this share of the other
# one. What decays ahead of a flow switches limiters by its sign, however small it is, and once its products
# underflow a result depends on the units that it is computed in.
NOTHING = 1e-60


@kernel(inline=True)
def below_yield(drive_x: float, drive_y: float, normal: float, material: Material) -> bool:
    """Whether dry friction balances a driving acceleration, so that what is at rest stays at rest.

    Parameters
    ----------
    drive_x, drive_y : float
        Pressure gradient less gravity along and across, ``beta h_x - g sin xi``, m s-2.
    normal : float
        g cos(xi), m s-2.
    """
    most = normal * (material.tangent * YIELD_TOLERANCE)
    return drive_x * drive_x + drive_y * drive_y <= most * most


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
    material: Material,
) -> Cell:
    """Take one stage: ``U = U_0 + part (U_1 - U_0 + dt L(U_1))``, then friction over ``part dt``.

    The convex combination comes first, then friction as a force of at most
    ``h tan(delta) max(0, g cos xi + kappa u^2)`` against the motion, so that it stops a cell exactly. It acts
    on the depth that gravity acts on: with the new depth instead, a front would feel friction before gravity
    and lag. Turbulent drag is implicit, which makes the terminal velocity exact.

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
    per_depth = velocity_left(hu, hv, h, u_1, load, bed, part * dt, material)
    u, v = component(hu, hv) * per_depth, component(hv, hu) * per_depth
    if material.drag > 0.0:
        slowed = drag_factor(math.sqrt(u * u + v * v), h, part * dt * material.drag)
        u, v = u * slowed, v * slowed
    return h, u, v


@kernel(inline=True)
def component(q: float, other: float) -> float:
    """Component of momentum, 0 where it is next to nothing of the other one."""
    return q if abs(q) > NOTHING * abs(other) else 0.0


@kernel(inline=True)
def velocity_left(
    hu: float,
    hv: float,
    h: float,
    u_before: float,
    load: float,
    bed: tuple[float, float],
    time: float,
    material: Material,
) -> float:
    """Velocity that dry friction leaves, per unit of momentum, m-1.

    0 for what it stops, for what is dry, and for what is next to nothing beside the speed of waves.

    Parameters
    ----------
    hu, hv, h : float
        Momentum (m2 s-1) and depth (m) without friction.
    u_before, load : float
        Velocity along the bed (m s-1) and depth (m) that load the friction.
    bed : tuple
        g cos(xi) (m s-2) and kappa (m-1).
    time : float
        Time that the friction acts, s.
    """
    normal, curvature = bed
    pressure = normal + curvature * (u_before * u_before)
    pressure = pressure if pressure > 0.0 else 0.0
    square, brake = hu * hu + hv * hv, time * material.tangent * pressure * load
    size, least = math.sqrt(square), NOTHING * NOTHING * (normal * (h * h * h))
    per_depth = (size - brake) / (size * h + 1e-300)
    moves = (size > brake * YIELD_TOLERANCE) & (square > least) & (h > material.dry)
    return per_depth if moves else 0.0


@kernel(inline=True)
def drag_factor(speed: float, h: float, drag: float) -> float:
    """Share of a speed (m s-1) that implicit turbulent drag leaves at depth h (m).

    Parameters
    ----------
    drag
        Coefficient of turbulent drag, g / turbulent friction, times the time that it acts, s.
    """
    resistance = 4.0 * drag * speed / (h if h > 0.0 else 1.0)
    return 2.0 / (1.0 + math.sqrt(1.0 + resistance))
