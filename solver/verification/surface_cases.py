"""Flows on surfaces of which something is known, as runs, and their errors.

``python -m solver.verification.surface_cases`` prints the errors by direction and spacing.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from functools import partial
from itertools import pairwise
from typing import NamedTuple

import numpy as np
from scipy.integrate import solve_ivp
from scipy.interpolate import RegularGridInterpolator

from solver.arrays import Array
from solver.physics.constants import GRAVITY
from solver.physics.elevation import edges_of, frames_of, tangents
from solver.physics.friction import Coulomb
from solver.physics.terrain import Bend
from solver.points.cloud import PointCloud, random_points
from solver.points.lattice import Lattice
from solver.points.on_surface import area_on_bed, mean_slopes
from solver.release.initial_state import initial_state
from solver.release.shapes import Hemisphere
from solver.result import Result
from solver.scene import Scene, WeightedResidual
from solver.simulation import simulate
from solver.verification.cases import relative_l2
from solver.verification.exact_solutions import DamBreak, FrictionlessCap
from solver.verification.surfaces import Bowl, ClosedForm, Inclined, Profiled, Trough, cell_means

RADIUS = 100.0
# breadth of a patch, m: where its depth has fallen by e
BREADTH = 6.0
# of planes and of ways, degrees
AZIMUTHS = 0.0, 30.0, 45.0
# of the places of clouds
SEED = 1


class Arc(NamedTuple):
    """A patch that has moved along an arc.

    Parameters
    ----------
    energy : float
        Change of kinetic energy over what it was.
    sideways : float
        Of the centre of volume, m.
    went : float
        Way of the centre of volume along the arc, m.
    rests : bool
        Whether it came to rest.
    """

    energy: float
    sideways: float
    went: float
    rests: bool


def scattered(half_x: float, half_y: float, spacing: float) -> PointCloud:
    """Place evenly random points around the origin, one for each square of a spacing, m."""
    count = round(4 * half_x * half_y / spacing**2)
    return random_points((-half_x, half_x), (-half_y, half_y), count, SEED)


def seen(surface: ClosedForm, points: Lattice | PointCloud) -> tuple[Array, ...]:
    """Give x and y of the cells' centres, their areas on the bed, and e1, e2 and normal of their frames."""
    if isinstance(points, Lattice):
        x, y = points.coordinates
        z = surface.corners(*(edges_of(a, points.dx) for a in (points.x_points, points.y_points)))
        e_1, e_2 = frames_of(z, points.dx)
    else:
        x, y = points.control_volumes.centroid.T
        e_1, e_2 = tangents(*mean_slopes(surface, points.control_volumes))
    return x, y, area_on_bed(surface, points), e_1, e_2, np.cross(e_1, e_2, axis=0)


def centred(half_x: float, half_y: float, spacing: float) -> Lattice:
    """Lay a lattice around the origin whose points lie on multiples of the spacing, m."""
    half_x, half_y = (float(np.ceil(a / spacing) * spacing) for a in (half_x, half_y))
    return Lattice((-half_x, half_x), (-half_y, half_y), spacing)


def cap_error(azimuth: float, root: float, layout: str = "lattice") -> tuple[float, Result]:
    """Relative L2 error of depth of the frictionless cap on a plane of 35 degrees, at 5 s, and its run.

    Parameters
    ----------
    azimuth : float
        Direction of the fall, degrees.
    root : float
        Square root of the area of a cell, m.
    layout : str
        Of the points, "lattice" or "cloud".
    """
    surface, solution = Inclined(azimuth, 35.0), FrictionlessCap()
    fall = float(np.cos(np.radians(35)))
    c, s = surface.direction
    lay = centred if layout == "lattice" else scattered
    points = lay(150 + 180 * c, 150 + 180 * s, root * float(np.sqrt(fall)))
    x, y, area, *_ = seen(surface, points)

    def depth(x: Array, y: Array, time: float) -> Array:
        return solution(surface.along(x, y) / fall, surface.across(x, y), time)[0]

    first = (
        cell_means(lambda x, y: depth(x, y, 0.0), points) if isinstance(points, Lattice) else depth(x, y, 0.0)
    )
    run = simulate(Scene(points, surface, first, 0 * first, 0 * first, Coulomb(0.0)), [5.0])
    return relative_l2(run.depth[-1], depth(x, y, 5.0), area), run


def dam_break_error(azimuth: float, root: float) -> tuple[float, Result]:
    """Relative L1 error of depth of a dam break, 22 degrees with friction of 21, at 5 s, and its run.

    It is taken where the ends and the sides of the layer have not come to by then.

    Parameters
    ----------
    azimuth : float
        Direction of the fall, degrees.
    root : float
        Square root of the area of a cell, m.
    """
    solution, time = DamBreak(), 5.0
    surface = Inclined(azimuth, solution.angle)
    fall = float(np.cos(np.radians(solution.angle)))
    c, s = (abs(a) for a in surface.direction)
    points = centred(65 * c + 25 * s, 65 * s + 25 * c, root * float(np.sqrt(fall)))
    x, y, area, *_ = seen(surface, points)
    along, across = surface.along(x, y) / fall, surface.across(x, y)

    def share(x: Array, y: Array) -> Array:
        return np.where(surface.along(x, y) < 0.0, solution.depth, 0.0)

    def expected(x: Array, y: Array) -> Array:
        return solution(surface.along(x, y) / fall, time)[0]

    first = cell_means(share, points)
    run = simulate(
        Scene(points, surface, first, 0 * first, 0 * first, Coulomb(solution.bed_friction)), [time]
    )
    there = (along > -50.0) & (along < 50.0) & (np.abs(across) < 5.0)
    known, area = cell_means(expected, points)[there], area[there]
    return float((np.abs(run.depth[-1][there] - known) * area).sum() / (known * area).sum()), run


def chute_error(azimuth: float, spacing: float) -> tuple[float, Result]:
    """Relative L2 of the depth of the paper's chute as a surface against it as a profile, at t = 6.

    Parameters
    ----------
    azimuth : float
        Direction of the fall, degrees.
    spacing : float
        Of both lattices, in plan on the surface, m.
    """
    profile, friction, centre, radius = Bend(angle=35, start=17.5, end=21.5), Coulomb(30.0), 4.0, 1.85
    strip = Lattice((0.0, 30.0), (-7.0, 7.0), spacing)
    laid = initial_state([Hemisphere((centre, 0.0), radius)], strip)
    still = laid.velocity_x, laid.velocity_y
    known = simulate(Scene(strip, profile, laid.depth, *still, friction, gravity=1.0), [6.0])
    surface = Profiled(azimuth, profile, 60.0)
    c, s = surface.direction
    length = float(profile.horizontal_distance(np.array(20.0)))
    ends = [(a * c - b * s, a * s + b * c) for a in (0.0, length) for b in (-5.0, 5.0)]
    half = float(np.max(np.ptp(ends, axis=0)) / 2)
    x, y = map(float, np.mean(ends, axis=0))
    points = Lattice((x - half, x + half), (y - half, y + half), spacing)

    def depth(x: Array, y: Array) -> Array:
        arc = surface.arcs(surface.along(x, y))
        square = radius**2 - (arc - centre) ** 2 - surface.across(x, y) ** 2
        return np.sqrt(np.maximum(0.0, square))

    first = cell_means(depth, points)
    run = simulate(Scene(points, surface, first, 0 * first, 0 * first, friction, gravity=1.0), [6.0])
    there = np.stack(
        [surface.across(*points.coordinates), surface.arcs(surface.along(*points.coordinates))], axis=-1
    )
    axes = strip.y_points, strip.x_points
    read = RegularGridInterpolator(axes, known.depth[-1], bounds_error=False, fill_value=0.0)(there)
    return relative_l2(run.depth[-1], read, np.ones_like(read)), run


def differences(spacings: Sequence[float], end: float = 4.0) -> list[float]:
    """Relative L1 between the depths of a slide in a bowl on each spacing and on half of it, at its end.

    The slide is round, 2 m deep, and comes down obliquely to the lattice with 15 degrees of friction.

    Parameters
    ----------
    spacings : sequence of float
        Each half of the one before, m; the difference of the last is to the next half.
    end : float
        In s.
    """
    surface, found = Bowl(RADIUS), []
    depths, areas = [], []
    for spacing in (*spacings, spacings[-1] / 2):
        # cells fill the same square at all spacings
        half = 64.0 - spacing / 2
        points = Lattice((-half, half), (-half, half), spacing)
        *_, area, _, _, _ = seen(surface, points)
        first = cell_means(lambda x, y: np.maximum(0.0, 2 - ((x + 40) ** 2 + (y + 20) ** 2) / 100), points)
        scene = Scene(points, surface, first, 0 * first, 0 * first, Coulomb(15.0))
        depths.append(simulate(scene, [end]).depth[-1])
        areas.append(area)
    for k in range(len(spacings)):
        rows, columns = depths[k].shape
        blocks = (depths[k + 1] * areas[k + 1]).reshape(rows, 2, columns, 2).sum(axis=(1, 3))
        volume = depths[k] * areas[k]
        found.append(float(np.abs(blocks - volume).sum() / volume.sum()))
    return found


def slide_on_arc(
    surface: Trough | Bowl,
    azimuth: float,
    spacing: float,
    *,
    start: float,
    speed: float,
    depth: float,
    friction: float,
    gravity: float,
    end: float,
    layout: str = "lattice",
) -> Arc:
    """Let a round patch slide along a great circle of a surface of radius RADIUS.

    Parameters
    ----------
    azimuth : float
        Of the way, degrees.
    start : float
        Arc length from the lowest point, m.
    speed : float
        In m s-1.
    depth : float
        In m.
    friction : float
        Degrees.
    gravity : float
        In m s-2.
    end : float
        In s.
    layout : str
        Of the points, "lattice" or "cloud".
    """
    c, s = np.cos(np.radians(azimuth)), np.sin(np.radians(azimuth))
    place, room = abs(RADIUS * np.sin(start / RADIUS)), 3.8 * BREADTH * (c + s)
    lay = centred if layout == "lattice" else scattered
    points = lay(place * c + room, place * s + room, spacing)
    x, y, area, e_1, e_2, normal = seen(surface, points)
    along, across = c * x + s * y, c * y - s * x
    h = depth * np.exp(-((along - RADIUS * np.sin(start / RADIUS)) ** 2 + across**2) / BREADTH**2)
    h[h < 1e-6 * depth] = 0
    way = np.stack([np.full_like(x, c), np.full_like(x, s), -(normal[0] * c + normal[1] * s) / normal[2]])
    way *= speed * (h > 0) / np.sqrt((way**2).sum(0))
    scene = Scene(
        points,
        surface,
        h,
        (way * e_1).sum(0),
        (way * e_2).sum(0),
        Coulomb(friction),
        gravity=gravity,
        scheme=WeightedResidual(wet_limit=1e-4 if friction else 1e-9),
    )
    run = simulate(scene, [0.0, end])
    squares = run.velocity_x**2 + run.velocity_y**2
    energy = (run.depth * squares * area).reshape(2, -1).sum(axis=1)
    volume = run.depth * area
    arc = RADIUS * np.arcsin(np.clip(along / RADIUS, -1.0, 1.0))
    places = [float((each * arc).sum() / each.sum()) for each in volume]
    return Arc(
        float(energy[1] / energy[0] - 1) if energy[0] else float("nan"),
        float((volume[1] * across).sum() / volume[1].sum()),
        places[1] - places[0],
        bool(np.isfinite(run.rest_time)),
    )


def without_gravity(surface: Trough | Bowl, azimuth: float, spacing: float, layout: str = "lattice") -> Arc:
    """Let a patch of 10 m s-1 go 100 m without gravity: its energy and direction must stay."""
    free = {"start": -50.0, "speed": 10.0, "depth": 1.0, "friction": 0.0, "gravity": 1e-9, "end": 10.0}
    return slide_on_arc(surface, azimuth, spacing, layout=layout, **free)


def with_friction(
    azimuth: float,
    spacing: float,
    depth: float = 0.02,
    layout: str = "lattice",
    start: float = -70.0,
    end: float = 60.0,
) -> Arc:
    """Let a thin patch slide from rest down a trough, with a bed friction of 20 degrees, until ``end``, s."""
    held = {"start": start, "speed": 0.0, "friction": 20.0, "gravity": GRAVITY, "end": end}
    return slide_on_arc(Trough(azimuth, RADIUS), azimuth, spacing, depth=depth, layout=layout, **held)


def way_of_a_point(start: float = -70.0, friction: float = 20.0, end: float = 60.0) -> float:
    """Way of a point with Coulomb friction on the same arc until it stops, or until ``end``, s; m."""
    rough, steep = np.tan(np.radians(friction)), GRAVITY / RADIUS

    def motion(_: float, state: Array) -> tuple[float, float]:
        angle, rate = state
        return rate, -steep * np.sin(angle) - rough * (steep * np.cos(angle) + rate**2)

    def stops(_: float, state: Array) -> float:
        return float(state[1])

    stops.terminal, stops.direction = True, -1  # type: ignore[attr-defined]
    first = (start / RADIUS, 1e-9)
    angles = solve_ivp(motion, (0.0, end), first, events=stops, rtol=1e-9).y[0]
    return float(RADIUS * (angles[-1] - angles[0]))


def way_of_points(start: float = -70.0, friction: float = 20.0, end: float = 60.0) -> float:
    """Mean way of points that lie as the patch does, each by itself, m.

    The patch is round in plan: more of it lies on the steep side of its middle, and goes farther.
    """
    arcs = start + np.linspace(-4.0, 4.0, 41) * BREADTH
    apart = RADIUS * (np.sin(arcs / RADIUS) - np.sin(start / RADIUS))
    held = np.exp(-((apart / BREADTH) ** 2))
    ways = [way_of_a_point(float(arc), friction, end) for arc in arcs]
    return float((held * ways).sum() / held.sum())


def report() -> Iterator[str]:
    """Give the tables, line by line: of the lattice, then of clouds."""
    yield from of_layout("lattice")
    yield ""
    yield from of_lattices_alone()
    yield ""
    yield "On clouds:"
    yield ""
    yield from of_layout("cloud")


def _by_azimuth(
    what: str,
    error: Callable[[float, float], tuple[float, Result]],
    spacings: Sequence[float],
    unit: str = "",
) -> Iterator[str]:
    """Give a table of an error by spacing, and by azimuth in degrees, line by line."""
    yield f"| {what} | 0 | 30 | 45 degrees |"
    yield "|---|---|---|---|"
    for spacing in spacings:
        errors = (f"{error(azimuth, spacing)[0]:.2e}" for azimuth in AZIMUTHS)
        yield f"| {spacing:g}{unit} | {' | '.join(errors)} |"


def of_lattices_alone() -> Iterator[str]:
    """Give the tables of what is run on lattices alone, line by line."""
    yield from _by_azimuth(
        "dam break 22/21, relative L1 of depth at 5 s", dam_break_error, (2.0, 1.0, 0.5), " m"
    )
    yield ""
    chute = "chute as a surface against a profile, relative L2 of depth at t = 6"
    yield from _by_azimuth(chute, chute_error, (0.4, 0.2, 0.1))
    yield ""
    yield "| slide in a bowl, spacings | relative L1 of depth between them | order |"
    yield "|---|---|---|"
    spacings = 8.0, 4.0, 2.0, 1.0, 0.5
    found = differences(spacings)
    orders = ["-", *(f"{np.log2(a / b):.2f}" for a, b in pairwise(found))]
    for spacing, apart, order in zip(spacings, found, orders, strict=True):
        yield f"| {spacing:g} / {spacing / 2:g} m | {apart:.2e} | {order} |"
    yield ""
    start = -85.0
    point, points = way_of_a_point(start), way_of_points(start)
    yield f"| friction; a point goes {point:.2f} m, points as the patch {points:.2f} m | spacing | goes |"
    yield "|---|---|---|"
    for azimuth in AZIMUTHS:
        for spacing in (4.0, 2.0, 1.0):
            arc = with_friction(azimuth, spacing, start=start)
            yield f"| {azimuth:g} degrees | {spacing:g} m | {arc.went:.2f} m |"


def of_layout(layout: str) -> Iterator[str]:
    """Give the tables of points of a layout, "lattice" or "cloud", line by line."""
    cap = "frictionless cap, relative L2 of depth at 5 s"
    yield from _by_azimuth(cap, partial(cap_error, layout=layout), (8.0, 4.0, 2.0), " m")
    yield ""
    yield "| 100 m along an arc, no gravity | azimuth | spacing | change of energy | sideways |"
    yield "|---|---|---|---|---|"
    for name, surface in (("trough", Trough), ("bowl", Bowl)):
        for azimuth in AZIMUTHS:
            for spacing in (4.0, 2.0, 1.0):
                bed = Trough(azimuth, RADIUS) if surface is Trough else Bowl(RADIUS)
                arc = without_gravity(bed, azimuth, spacing, layout)
                yield f"| {name} | {azimuth:g} | {spacing:g} m | {arc.energy:.1e} | {arc.sideways:.3f} m |"
    yield ""
    yield f"| friction; a point goes {way_of_a_point():.2f} m | depth | spacing | goes | sideways |"
    yield "|---|---|---|---|---|"
    for azimuth in AZIMUTHS:
        for depth in (0.02, 0.2, 2.0):
            for spacing in (4.0, 2.0, 1.0):
                arc = with_friction(azimuth, spacing, depth, layout)
                yield (
                    f"| {azimuth:g} degrees | {depth:g} m | {spacing:g} m | {arc.went:.2f} m "
                    f"| {arc.sideways:.3f} m |"
                )


if __name__ == "__main__":
    for line in report():
        print(line, flush=True)
