"""Scenes whose solution is known, on any points and in either form, and the errors of their runs."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace

import numpy as np

from solver.arrays import Array
from solver.physics.constants import GRAVITY
from solver.physics.earth_pressure import MohrCoulomb
from solver.physics.friction import Coulomb
from solver.physics.terrain import Bend, Plane
from solver.points.cloud import PointCloud, random_points
from solver.points.lattice import Lattice
from solver.release.initial_state import initial_state
from solver.release.shapes import Box, Hemisphere, Paraboloid
from solver.result import Result
from solver.scene import Boundaries, Collocation, Scene, Scheme, WeightedResidual
from solver.simulation import simulate
from solver.verification import exact_solutions as exact
from solver.verification.fine_solution import fine_solution

Points = Lattice | PointCloud
CONSERVATIVE = WeightedResidual()
WALLED = Boundaries("open", "open", "wall", "wall")
# Across a case that does not vary across the bed, m: a whole number of cells at every spacing used.
WIDTH = 12.0
SEED = 1


@dataclass(frozen=True)
class Case:
    """A scene on a rectangle, and what it should come to.

    Parameters
    ----------
    x, y : tuple[float, float]
        Bounds, m.
    time : float
        Of the comparison, s.
    scene : callable
        Makes the scene of a scheme on points.
    expected : callable
        Depth (m) and momentum along the bed (h u, m2 s-1) at that time, each of the shape of the points.
    filled : bool
        Whether the cells of a lattice fill the bounds; otherwise its points reach them.
    """

    x: tuple[float, float]
    y: tuple[float, float]
    time: float
    scene: Callable[[Points, Scheme], Scene]
    expected: Callable[[Points, Scheme], tuple[Array, Array]]
    filled: bool = False

    def lattice(self, spacing: float) -> Lattice:
        """Lay a lattice of a spacing, m."""
        if not self.filled:
            return Lattice(self.x, self.y, spacing)
        half = spacing / 2
        return Lattice((self.x[0] + half, self.x[1] - half), (self.y[0] + half, self.y[1] - half), spacing)

    def cloud(self, spacing: float) -> PointCloud:
        """Place evenly random points, one for each square of a spacing, m."""
        area = (self.x[1] - self.x[0]) * (self.y[1] - self.y[0])
        return random_points(self.x, self.y, round(area / spacing**2), SEED)

    def points(self, layout: str, spacing: float) -> Points:
        """Lay the points of a layout, "lattice" or "cloud", of a spacing, m."""
        return self.lattice(spacing) if layout == "lattice" else self.cloud(spacing)

    def against_fine(self, spacing: float) -> Case:
        """Expect what the weighted-residual form gives on a lattice of a fine spacing, m."""
        run = simulate(self.scene(lattice := self.lattice(spacing), CONSERVATIVE), [self.time])
        return replace(self, expected=fine_solution(lattice, run.depth[-1], run.velocity_x[-1]))


@dataclass(frozen=True)
class Measured:
    """Relative errors of one run, dimensionless, beside the run itself.

    Parameters
    ----------
    depth, momentum : float
        L2 norms over the points, by the area of their cells.
    depth_l1 : float
        L1 norm of depth.
    """

    depth: float
    momentum: float
    depth_l1: float
    run: Result


def relative_l2(found: Array, wanted: Array, weight: float | Array = 1.0) -> float:
    """``sqrt(sum w (found - wanted)^2 / sum w wanted^2)``, dimensionless."""
    return float(np.sqrt((weight * (found - wanted) ** 2).sum() / (weight * wanted**2).sum()))


def relative_errors(case: Case, scene: Scene, h: Array, q: Array) -> tuple[float, float, float]:
    """Errors of depth (m) and momentum along the bed (m2 s-1): L2 of both, and L1 of depth, dimensionless."""
    area = scene.points.cell_area
    depth, momentum = case.expected(scene.points, scene.scheme)
    l1 = float((area * np.abs(h - depth)).sum() / (area * depth).sum())
    return relative_l2(h, depth, area), relative_l2(q, momentum, area), l1


def compare(case: Case, scene: Scene, run: Result) -> Measured:
    """Compare the last frame of a run of the case's scene with what is expected."""
    h, u = run.depth[-1], run.velocity_x[-1]
    return Measured(*relative_errors(case, scene, h, h * u), run)


def measure(case: Case, points: Points, scheme: Scheme = CONSERVATIVE) -> Measured:
    """Run a case on points, and compare."""
    scene = case.scene(points, scheme)
    return compare(case, scene, simulate(scene, [case.time]))


def places(points: Points, scheme: Scheme) -> tuple[Array, Array]:
    """Where the values of a form stand, x and y of the shape of the points, m.

    Those of the weighted-residual form are means, which stand at the centroids of the cells.
    """
    if isinstance(points, Lattice) or isinstance(scheme, Collocation):
        return points.coordinates
    x, y = points.control_volumes.centroid.T
    return x, y


def along_the_bed(
    solution: Callable[[Array, float], tuple[Array, Array]], time: float
) -> Callable[[Points, Scheme], tuple[Array, Array]]:
    """Expect a solution that does not vary across the bed: depth and velocity by x (m) and time (s)."""

    def expected(points: Points, scheme: Scheme) -> tuple[Array, Array]:
        depth, velocity = solution(places(points, scheme)[0], time)
        return depth, depth * velocity

    return expected


def nothing_known(points: Points, scheme: Scheme) -> tuple[Array, Array]:
    """Refuse to compare."""
    raise ValueError("no solution of this case is known; compare it with a fine one")


def slide(
    points: Points,
    depth: Array,
    velocity: Array,
    angle: float,
    bed_friction: float,
    boundaries: Boundaries,
    gravity: float = GRAVITY,
    scheme: Scheme = CONSERVATIVE,
) -> Scene:
    """Scene on a plane, K = 1; depth (m) and velocity along x (m s-1) fit the shape of the points."""
    h, u = (np.broadcast_to(a, points.shape).copy() for a in (depth, velocity))
    return Scene(
        points,
        Plane(angle),
        h,
        u,
        np.zeros_like(h),
        Coulomb(bed_friction),
        gravity=gravity,
        boundaries=boundaries,
        scheme=scheme,
    )


def cap(bed_friction: float = 0.0) -> Case:
    """Exact case 1 at t = 5 s; with friction, of case 2, whose closed form is no true solution."""
    solution = exact.FrictionlessCap()
    time = 5.0

    def scene(points: Points, scheme: Scheme) -> Scene:
        laid = initial_state(
            [Paraboloid((0.0, 0.0), (solution.radius, solution.radius), solution.height)], points
        )
        return slide(
            points, laid.depth, laid.velocity_x, solution.angle, bed_friction, Boundaries(), scheme=scheme
        )

    def expected(points: Points, scheme: Scheme) -> tuple[Array, Array]:
        depth, velocity, _ = solution(*places(points, scheme), time)
        return depth, depth * velocity

    return Case((-150.0, 300.0), (-150.0, 150.0), time, scene, nothing_known if bed_friction else expected)


def dam_break(
    angle: float = 22.0,
    bed_friction: float = 21.0,
    bounds: tuple[float, float] = (-60.0, 50.0),
    time: float = 5.0,
) -> Case:
    """Exact case 3: the dam stands on a cell face, and the layer behind it is fed at its depth.

    Flat and frictionless it is Ritter's, exact case 8.
    """
    solution = exact.DamBreak(angle, bed_friction)

    def scene(points: Points, scheme: Scheme) -> Scene:
        layer = initial_state([Box((bounds[0], 0.0), (0.0, WIDTH), solution.depth)], points)
        sides = Boundaries(solution.depth, "open", "wall", "wall")
        return slide(points, layer.depth, layer.velocity_x, angle, bed_friction, sides, scheme=scheme)

    return Case(bounds, (0.0, WIDTH), time, scene, along_the_bed(solution, time), filled=True)


def stoker() -> Case:
    """Exact case 8: flat and frictionless, onto a layer at rest, t = 3 s."""
    solution, bounds, time = exact.WetDamBreak(), (-20.0, 30.0), 3.0

    def scene(points: Points, scheme: Scheme) -> Scene:
        layers = ((bounds[0], 0.0), solution.depth), ((0.0, bounds[1]), solution.ahead)
        laid = initial_state([Box(x, (0.0, WIDTH), depth) for x, depth in layers], points)
        return slide(points, laid.depth, laid.velocity_x, 0.0, 0.0, WALLED, scheme=scheme)

    return Case(bounds, (0.0, WIDTH), time, scene, along_the_bed(solution, time), filled=True)


def parabolic_cap() -> Case:
    """Exact case 4 at t = 4 s; it begins with means over squares of the areas of the cells."""
    solution, time = exact.ParabolicCap(), 4.0

    def scene(points: Points, scheme: Scheme) -> Scene:
        x, _ = places(points, scheme)
        width = np.sqrt(np.broadcast_to(points.cell_area, x.shape)).reshape(-1, 1)
        depth = exact.cell_means(solution, x.ravel(), width, 0.0).reshape(x.shape)
        return slide(points, depth, 0 * x, solution.angle, solution.bed_friction, WALLED, scheme=scheme)

    return Case((-25.0, 65.0), (0.0, WIDTH), time, scene, along_the_bed(solution, time), filled=True)


def chute(points: Points, scheme: Scheme) -> Scene:
    """Lay out the paper's chute, section 4: linear transition, curvature, g = 1."""
    laid = initial_state([Hemisphere((4.0, 0.0), 1.85)], points)
    return Scene(
        points,
        Bend(35.0, 17.5, 21.5),
        laid.depth,
        laid.velocity_x,
        laid.velocity_y,
        Coulomb(30.0),
        MohrCoulomb(30.0, 30.0),
        1.0,
        WALLED,
        scheme,
    )


CHUTE = Case((0.0, 30.0), (-7.0, 7.0), 24.0, chute, nothing_known)
