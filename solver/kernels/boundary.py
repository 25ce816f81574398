"""The four sides of the domain: what faces on the boundary may carry, and the ledger of it."""

from __future__ import annotations

import math

from solver.arrays import Array
from solver.compiled import kernel
from solver.kernels.friction import below_yield
from solver.kernels.runge_kutta import added
from solver.kernels.state import BELOW_YIELD, DRY, NO_SLIP, OPEN, WALL, Sides
from solver.physics.resistance import Uniform

# What has this share of a given depth at least may be of the layer that is fed.
LAYER = 0.5
# Relative difference of velocities that are the same.
ROUND_OFF = 1e-9


@kernel(inline=True)
def boundary_flux(
    flux: tuple[float, float, float], kind: int, outward: float, h: float, n: float, t: float, c: float
) -> tuple[float, float, float]:
    """Impose on the flux through a boundary face what its side allows.

    Nothing enters through an OPEN side, and nothing passes a WALL. At a NO_SLIP side the HLL flux between the
    flow and its mirror image, whose tangential velocity is opposite, takes tangential momentum out.

    Parameters
    ----------
    flux : tuple
        Of mass (m2 s-1), of normal and tangential momentum (m3 s-2).
    kind : int
        Of the side.
    outward : float
        Sign of the outward direction along the face normal.
    h, n, t, c : float
        Depth (m), normal and tangential velocity and wave speed (m s-1) of the cell inside.
    """
    mass, normal, tangential = flux
    if kind == OPEN and outward * mass < 0.0:
        return 0.0, 0.0, 0.0
    if kind == WALL:
        return 0.0, normal, 0.0
    if kind == NO_SLIP:
        return 0.0, normal, outward * (abs(n) + c) * h * t
    return mass, normal, tangential


@kernel(inline=True)
def stopped(impulse: float, toward: float, width: float, dt: float) -> float:
    """Momentum that a wall takes from a layer too thin to lean on it: at most what stops the cell in a stage.

    HLL takes ``h n (2 n + c)``. Of what gravity presses against the wall in a step as long as it takes to
    fall by a spacing, that is more than the cell has, and throws it back up.

    Parameters
    ----------
    impulse : float
        Flux of outward momentum through the wall, without the pressure at rest, m3 s-2.
    toward : float
        Momentum of the cell toward the wall, m2 s-1.
    width : float
        Area of the cell over the length of the wall in it, m.
    dt : float
        Time step, s.
    """
    most = max(0.0, toward) * width / (dt + 1e-300)
    return min(impulse, most)


@kernel()
def wall_flux(h: float, toward: float, c: float) -> tuple[float, float]:
    """HLL flux of momentum through a wall, convective (m3 s-2) and pressure (m2), without its beta.

    The two sides are a state and its mirror image: the speeds of waves are ``-(|n| + c)`` and ``|n| + c``.

    Parameters
    ----------
    h, toward, c : float
        Depth (m), velocity toward the wall and wave speed (m s-1) at the face.
    """
    return h * toward * (toward + abs(toward) + c), 0.5 * h * h


@kernel(inline=True)
def account(leaving: float, side: int, ledger: Array) -> None:
    """Add a volume that leaves by a side, or comes in if it is negative, m3, to the ledger (2, 4, 2)."""
    way = 1 if leaving > 0.0 else 0
    ledger[0, side, way], ledger[1, side, way] = added(
        ledger[0, side, way], ledger[1, side, way], abs(leaving)
    )


@kernel(inline=True)
def status_at_depth(
    static: float, h: float, inside: float, drive: float, beta: float, normal: float, law: Uniform
) -> tuple[float, float]:
    """Status of a ghost beyond a side of given depth, and the speed at which it drives the cell inside.

    A given depth is not dry where the cell is: where it does not drive, it is below yield.

    Parameters
    ----------
    static : float
        Status of the cell inside.
    h, inside : float
        Given depth, and that of the cell inside, m.
    drive : float
        Pressure gradient toward the cell less gravity, m s-2.
    beta, normal : float
        g cos(xi) K and g cos(xi) of the cell, m s-2.
    law : named tuple
        Of basal friction in the cell.

    Returns
    -------
    static, speed : float
        The speed is in m s-1, and 0 where it does not drive.
    """
    if below_yield(law, drive, 0.0, 0.5 * (h + inside), normal):
        return BELOW_YIELD if static == DRY else static, 0.0
    return 0.0, 2.0 * math.sqrt(beta * h)


@kernel(inline=True)
def drive_layers(sides: Sides, time: float) -> None:
    """Set how fast layers beyond sides of given depth may be at a time, s.

    Nothing is known of them but that they move as what is in the domain does at the start, and that gravity
    and dry friction act on them.
    """
    for k in range(4):
        inward = sides.excess[k] if k == 0 else -sides.excess[k]
        # an even layer inside, which is as fast, differs by round-off
        sides.fastest[k] = (1.0 + ROUND_OFF) * (sides.first[k] + max(0.0, inward) * time)
        sides.alongside[k] = (1.0 + ROUND_OFF) * (sides.first[k] + sides.driving[k] * time)


@kernel(inline=True)
def along_at_depth(along: float, depth: float, beta: float, forth: float, back: float) -> float:
    """Velocity beyond a side of given depth along it, m s-1.

    It is that of the cell inside, but no more than that of waves outside or than `drive_layers` tells. What
    comes in would bring along what pressure has made of it on its way, and feed itself.

    Parameters
    ----------
    along : float
        Velocity of the cell inside along the side, m s-1.
    depth, beta : float
        Given depth, m, and g cos(xi) K of the cell, m s-2.
    forth, back : float
        ``alongside`` of `Sides` along the side and against it, m s-1.
    """
    waves = math.sqrt(beta * depth)
    return min(max(along, -max(back, waves)), max(forth, waves))


@kernel()
def leaving_at_depth(leaving: float, h: float, depth: float, beta: float, fastest: float) -> float:
    """Outward velocity beyond a side of given depth, m s-1.

    What the flow inside sends out is its invariant ``leaving + 2 c``; where it is slower than its waves the
    depth outside gives the rest, up to waves that stand. What is faster than its waves goes out as it is, or
    comes in as the layer it is of; a film is of none. Outside this layer is slower by what it gains as it
    thins, the invariant ``leaving - 2 c`` that comes in, and no faster than `drive_layers` tells. Were the
    velocity inside fed back as it is, a layer that thins would feed itself, ever faster.

    Parameters
    ----------
    leaving, h : float
        Outward velocity (m s-1) and depth (m) of the cell inside.
    depth, beta : float
        Given depth, m, and g cos(xi) K of the cell, m s-2.
    fastest : float
        Of `Sides`, m s-1.
    """
    inside, outside = math.sqrt(beta * h), math.sqrt(beta * depth)
    if leaving >= inside > 0.0:
        return leaving
    if leaving < -inside and h >= LAYER * depth:
        return min(max(leaving, leaving + 2.0 * (outside - inside), -fastest), -outside)
    return max(leaving + 2.0 * (inside - outside), -outside)
