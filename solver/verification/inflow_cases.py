"""Inflow through sections against exact cases; ``python -m solver.verification.inflow_cases`` prints errors.

A plane of three rows between walls is fed from x = 0, or from a section inside. Below it flow is steady with
Voellmy friction, or spreads on to a dry bed where friction and gravity balance.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from solver.arrays import Array
from solver.inflow.conditions import Inflow, Section
from solver.inflow.hydrograph import Hydrograph
from solver.physics.constants import GRAVITY
from solver.physics.friction import Coulomb, Voellmy, friction_angle
from solver.physics.terrain import Plane
from solver.points.lattice import Lattice
from solver.scene import Boundaries, Scene, Side, WeightedResidual
from solver.simulation import simulate

SPACINGS = (1.0, 0.5, 0.25)
# Steady depths (m) at places below a section (m), of 10 m2/s that come in 0.6 m deep on 15 degrees, mu 0.1
# and xi 500 m s-2, by the ordinary differential equation of steady flow.
STEADY = {5: 0.679114, 10: 0.750473, 20: 0.866989, 50: 1.03231, 100: 1.07039}
# Front on a dry bed of 25 degrees: depth and speed of what comes in, and how long it has, s.
FIRST_DEPTH, FIRST_SPEED, SLOPE, LASTS = 1.0, 8.0, 25.0, 5.0


def voellmy(coefficient: float, turbulent_friction: float) -> Voellmy:
    """Make Voellmy friction of a coefficient mu and xi, m s-2."""
    return Voellmy(friction_angle(coefficient), turbulent_friction)


def fed(
    slope: float,
    friction: Coulomb,
    discharge: float,
    *,
    spacing: float = 1.0,
    length: float = 100.0,
    end: float = 100.0,
    at: float = 0.0,
    start: tuple[float, float] = (0.0, 0.0),
    x_max: Side = "open",
    cfl: float = 0.9,
    sections: Sequence[float] = (),
    times: Sequence[float] = (),
    hydrograph: Hydrograph | None = None,
    **condition: object,
) -> Scene:
    """Make a plane that a discharge per width, m2 s-1, comes on to from time 0 until after ``end``.

    Parameters
    ----------
    slope : float
        degrees.
    spacing, length, end : float
        m, m, s.
    at : float
        Place of the section, m.
    start : tuple of float
        Depth (m) and velocity (m s-1) at the start.
    sections, times : sequence of float
        Places of sections, m, and times of samples at them, s.
    hydrograph : Hydrograph, optional
        In place of the constant discharge.
    condition
        depth, froude or speed of `Inflow`.
    """
    half, width = spacing / 2, 3 * spacing
    lattice = Lattice((half, length - half), (-spacing, spacing), spacing)
    flat = np.zeros(lattice.shape)
    if hydrograph is None:
        hydrograph = Hydrograph(np.array([0.0, end + 1]), np.full(2, discharge * width))

    def across(x: float) -> tuple[tuple[float, float], ...]:
        return (x, -width / 2), (x, width / 2)

    return Scene(
        lattice,
        Plane(slope),
        flat + start[0],
        flat + start[1],
        flat,
        friction,
        boundaries=Boundaries(x_max=x_max, y_min="wall", y_max="wall"),
        scheme=WeightedResidual(cfl=cfl),
        inflows=(Inflow("top", across(at), hydrograph, **condition),),  # type: ignore[arg-type]
        sections=tuple(Section(f"at {x}", across(x)) for x in sections),
        section_times=times,
    )


def steady_errors(spacing: float) -> Array:
    """Errors of the steady depth at the places of ``STEADY``, m."""
    scene = fed(15, voellmy(0.1, 500), 10, spacing=spacing, length=110, end=60, depth=0.6)
    depth = simulate(scene, [0, 60]).depth[-1][1]
    found = np.interp(list(STEADY), scene.points.coordinates[0][0], depth)
    return np.asarray(found - list(STEADY.values()))


def front_exact(x: Array, time: float) -> tuple[Array, Array]:
    """Depth (m) and speed (m s-1) of the front at places below the section (m) and a time (s)."""
    normal = GRAVITY * np.cos(np.radians(SLOPE))
    wave = np.sqrt(normal * FIRST_DEPTH)
    tail, edge = (FIRST_SPEED - wave) * time, (FIRST_SPEED + 2 * wave) * time
    spread = (FIRST_SPEED + 2 * wave - x / time) ** 2 / (9 * normal)
    depth = np.where(x < tail, FIRST_DEPTH, np.where(x < edge, spread, 0.0))
    speed = np.where(x < tail, FIRST_SPEED, (FIRST_SPEED + 2 * wave + 2 * x / time) / 3)
    return np.where(x > 0, depth, 0.0), np.where((x > 0) & (x < edge), speed, 0.0)


def front_errors(spacing: float, at: float = 0.0) -> tuple[float, float, float, float]:
    """Errors of the front: L1 of depth over its volume, depth and speed at x = 50 m, and error of volume."""
    discharge = FIRST_DEPTH * FIRST_SPEED
    scene = fed(
        SLOPE,
        Coulomb(SLOPE),
        discharge,
        spacing=spacing,
        length=90 + at,
        end=LASTS,
        at=at,
        speed=FIRST_SPEED,
    )
    result = simulate(scene, [0, LASTS])
    x = scene.points.coordinates[0][0] - at
    depth, speed = result.depth[-1][1], result.velocity_x[-1][1]
    volume, there = discharge * LASTS, front_exact(np.array([50.0]), LASTS)
    here = [
        np.interp(50.0, x, found) - exact.item() for found, exact in zip((depth, speed), there, strict=True)
    ]
    l1 = float(np.abs(depth - front_exact(x, LASTS)[0]).sum()) * spacing / volume
    return l1, float(here[0]), float(here[1]), float(depth.sum()) * spacing / volume - 1.0


def main() -> None:
    """Print the tables of docs/method.md."""
    heads = " | ".join(f"{x} m" for x in STEADY)
    print(f"| spacing, m | {heads} |\n|---|{'---|' * len(STEADY)}")
    for spacing in SPACINGS:
        print(f"| {spacing:g} | " + " | ".join(f"{e:.1e}" for e in steady_errors(spacing)) + " |")
    print("\n| section | spacing, m | depth L1 | depth at 50 m | speed at 50 m | volume error |")
    print("|---|---|---|---|---|---|")
    for name, at in (("on the boundary", 0.0), ("inside", 10.0)):
        for spacing in SPACINGS:
            l1, depth, speed, volume = front_errors(spacing, at)
            print(f"| {name} | {spacing:g} | {l1:.2e} | {depth:.1e} | {speed:.1e} | {volume:.0e} |")


if __name__ == "__main__":
    main()
