"""Inflow through sections against exact cases; ``python -m solver.verification.inflow_cases`` prints errors.

A plane of three rows between walls, or a cloud that is six cells wide, is fed from x = 0, or from a section
inside. Below it flow is steady with Voellmy friction, or spreads on to a dry bed where friction and gravity
balance.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from solver.arrays import Array
from solver.inflow.conditions import Inflow, Section
from solver.inflow.hydrograph import Hydrograph
from solver.physics.constants import GRAVITY
from solver.physics.friction import Coulomb, Friction, Voellmy, friction_angle
from solver.physics.terrain import Plane
from solver.points.cloud import PointCloud, random_points
from solver.points.lattice import Lattice
from solver.release.shares import shares
from solver.scene import Boundaries, Scene, Side, WeightedResidual, Zone
from solver.simulation import simulate

SPACINGS = (1.0, 0.5, 0.25)
# Steady depths (m) at places below a section (m), of 10 m2/s that come in 0.6 m deep on 15 degrees, mu 0.1
# and xi 500 m s-2, by the ordinary differential equation of steady flow.
STEADY = {5: 0.679114, 10: 0.750473, 20: 0.866989, 50: 1.03231, 100: 1.07039}
# The same discharge at normal depth that comes to a zone of mu 0.2, by the distance from where it begins, m.
ZONED = {5: 1.13498, 10: 1.19066, 20: 1.28064, 50: 1.41228, 100: 1.44750}
# Place at which it begins, m.
ZONE = 20.0
# Front on a dry bed of 25 degrees: depth and speed of what comes in, and how long it has, s.
FIRST_DEPTH, FIRST_SPEED, SLOPE, LASTS = 1.0, 8.0, 25.0, 5.0
# Cells across a cloud, and half the length over which its values are fitted for one at a place, m.
CLOUD_ROWS, FITTED = 6, 2.0


def voellmy(coefficient: float, turbulent_friction: float) -> Voellmy:
    """Make Voellmy friction of a coefficient mu and xi, m s-2."""
    return Voellmy(friction_angle(coefficient), turbulent_friction)


def fed(
    slope: float,
    friction: Friction,
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


def scattered(scene: Scene, seed: int) -> Scene:
    """Put a scene of `fed` on a cloud of its spacing that is `CLOUD_ROWS` cells wide, as deep and as fast."""
    lattice = scene.points
    assert isinstance(lattice, Lattice)
    spacing, x = lattice.spacing, lattice.extent[0]
    half = CLOUD_ROWS * spacing / 2
    cloud = random_points(x, (-half, half), round((x[1] - x[0]) * 2 * half / spacing**2), seed)
    wider = 2 * half / (3 * spacing)

    def across(line: Sequence[tuple[float, float]]) -> tuple[tuple[float, float], ...]:
        return (line[0][0], -half), (line[0][0], half)

    flat = np.zeros(cloud.shape)
    return replace(
        scene,
        points=cloud,
        depth=flat + np.asarray(scene.depth)[0, 0],
        velocity_x=flat + np.asarray(scene.velocity_x)[0, 0],
        velocity_y=flat,
        inflows=tuple(
            replace(
                each,
                line=across(each.line),
                hydrograph=Hydrograph(each.hydrograph.times, wider * each.hydrograph.discharges),
            )
            for each in scene.inflows
        ),
        sections=tuple(replace(each, line=across(each.line)) for each in scene.sections),
    )


def distances(scene: Scene) -> Array:
    """Places of the means of cells along the slope, those of the middle row on a lattice, m."""
    if isinstance(scene.points, PointCloud):
        return scene.points.control_volumes.centroid[:, 0]
    return scene.points.x_points


def along(scene: Scene, field: Array) -> Array:
    """Values of the last frame at `distances`."""
    return np.asarray(field[-1] if isinstance(scene.points, PointCloud) else field[-1][1])


def at_place(scene: Scene, field: Array, place: float) -> float:
    """Value of the last frame at a place (m): between cells on a lattice, of a parabola fitted on a cloud."""
    x, values = distances(scene), along(scene, field)
    if isinstance(scene.points, Lattice):
        return float(np.interp(place, x, values))
    near = np.abs(x - place) < FITTED
    return float(np.polyfit(x[near] - place, values[near], 2)[-1])


def steady_errors(spacing: float, at: float = 0.0, seed: int | None = None) -> Array:
    """Errors of the steady depth at the places of ``STEADY`` below a section, m; on a cloud with a seed."""
    scene = fed(15, voellmy(0.1, 500), 10, spacing=spacing, length=110 + at, end=60, at=at, depth=0.6)
    scene = scene if seed is None else scattered(scene, seed)
    depth = simulate(scene, [0, 60]).depth
    return np.array([at_place(scene, depth, at + x) - exact for x, exact in STEADY.items()])


def zone_errors(spacing: float, seed: int | None = None) -> Array:
    """Errors of the steady depth at the places of ``ZONED`` in a rougher zone, m; on a cloud with a seed."""
    friction = voellmy(0.1, 500)
    scene = fed(15, friction, 10, spacing=spacing, length=130.0, end=60, depth="normal")
    scene = scene if seed is None else scattered(scene, seed)
    rough = [np.array([(ZONE, -100.0), (1000.0, -100.0), (1000.0, 100.0), (ZONE, 100.0)])]
    scene = replace(scene, zones=(Zone(voellmy(0.2, 500), shares(rough, scene.points)),))
    depth = simulate(scene, [0, 60]).depth
    return np.array([at_place(scene, depth, ZONE + x) - exact for x, exact in ZONED.items()])


def backwater(
    depth: float, discharge: float, slope: float, coefficient: float, turbulent_friction: float, x: Array
) -> Array:
    """Steady depth (m) above a place x = 100 m where it is given, by its ordinary differential equation.

    Parameters
    ----------
    depth, discharge : float
        m, m2 s-1.
    slope : float
        degrees.
    coefficient, turbulent_friction : float
        Of Voellmy's law; the second in m s-2.
    x : array
        m.
    """
    from scipy.integrate import solve_ivp

    xi = np.radians(slope)
    normal = GRAVITY * np.cos(xi)

    def slope_of_depth(_: float, h: Array) -> Array:
        drive = h * (GRAVITY * np.sin(xi) - coefficient * normal)
        drag = GRAVITY * discharge**2 / (turbulent_friction * h**2)
        return np.asarray((drive - drag) / (normal * h - discharge**2 / h**2))

    found = solve_ivp(slope_of_depth, (100, 0), [depth], rtol=1e-10, dense_output=True)
    return np.asarray(found.sol(x)[0])


def front_exact(x: Array, time: float) -> tuple[Array, Array]:
    """Depth (m) and speed (m s-1) of the front at places below the section (m) and a time (s)."""
    normal = GRAVITY * np.cos(np.radians(SLOPE))
    wave = np.sqrt(normal * FIRST_DEPTH)
    tail, edge = (FIRST_SPEED - wave) * time, (FIRST_SPEED + 2 * wave) * time
    spread = (FIRST_SPEED + 2 * wave - x / time) ** 2 / (9 * normal)
    depth = np.where(x < tail, FIRST_DEPTH, np.where(x < edge, spread, 0.0))
    speed = np.where(x < tail, FIRST_SPEED, (FIRST_SPEED + 2 * wave + 2 * x / time) / 3)
    return np.where(x > 0, depth, 0.0), np.where((x > 0) & (x < edge), speed, 0.0)


def front_errors(
    spacing: float, at: float = 0.0, seed: int | None = None
) -> tuple[float, float, float, float]:
    """Errors of the front: L1 of depth over its volume, depth and speed at x = 50 m, and error of volume.

    They are those on a cloud with a seed.
    """
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
    scene = scene if seed is None else scattered(scene, seed)
    result = simulate(scene, [0, LASTS])
    depth, there = along(scene, result.depth), front_exact(np.array([50.0]), LASTS)
    fields = result.depth, result.velocity_x
    here = [
        at_place(scene, field, at + 50.0) - exact.item() for field, exact in zip(fields, there, strict=True)
    ]
    # of a strip of one cell's width on a lattice
    areas = scene.points.cell_area if seed is not None else np.full(len(depth), spacing**2)
    volume = discharge * LASTS * (spacing if seed is None else CLOUD_ROWS * spacing)
    l1 = float(np.abs(depth - front_exact(distances(scene) - at, LASTS)[0]) @ areas) / volume
    return l1, here[0], here[1], float(depth @ areas) / volume - 1.0


def main() -> None:
    """Print the tables of docs/method.md."""
    heads = " | ".join(f"{x} m" for x in STEADY)
    print(f"| points | section | spacing, m | {heads} |\n|---|---|---|{'---|' * len(STEADY)}")
    steady = ("lattice", "on the boundary", 0.0, None), ("cloud", "on the boundary", 0.0, 0)
    for points, name, at, seed in (*steady, ("cloud", "inside", 10.0, 0)):
        for spacing in SPACINGS:
            errors = " | ".join(f"{e:.1e}" for e in steady_errors(spacing, at, seed))
            print(f"| {points} | {name} | {spacing:g} | {errors} |")
    print(f"\n| points | spacing, m | {heads} |\n|---|---|{'---|' * len(STEADY)}")
    for points, seed in (("lattice", None), ("cloud", 0)):
        for spacing in SPACINGS:
            print(
                f"| {points} | {spacing:g} | " + " | ".join(f"{e:.1e}" for e in zone_errors(spacing, seed)),
                "|",
            )
    print("\n| points | section | spacing, m | depth L1 | depth at 50 m | speed at 50 m | volume error |")
    print("|---|---|---|---|---|---|---|")
    for points, seed in (("lattice", None), ("cloud", 0)):
        for name, at in (("on the boundary", 0.0), ("inside", 10.0)):
            for spacing in SPACINGS:
                l1, depth, speed, volume = front_errors(spacing, at, seed)
                found = f"{l1:.2e} | {depth:.1e} | {speed:.1e} | {volume:.0e}"
                print(f"| {points} | {name} | {spacing:g} | {found} |")


if __name__ == "__main__":
    main()
