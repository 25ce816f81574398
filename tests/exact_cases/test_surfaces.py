"""Exact cases on surfaces: the compass does not matter, and the bed's curvature makes no energy."""

import numpy as np
import pytest
from scipy.integrate import solve_ivp
from scipy.interpolate import RegularGridInterpolator

from solver import Bend, Coulomb, Hemisphere, Lattice, Plane, Scene, WeightedResidual, initial_state, simulate
from solver.surface.metric import frames_of, lifted_area
from solver.surface.run import edges_of
from solver.verification.exact_solutions import FrictionlessCap
from solver.verification.surfaces import Bowl, Inclined, Profiled, Trough, cell_means

RADIUS = 100.0


def lattice(half_x, half_y, spacing):
    half_x, half_y = (np.ceil(a / spacing) * spacing for a in (half_x, half_y))
    return Lattice((-half_x, half_x), (-half_y, half_y), spacing)


def corners(surface, points):
    return surface.corners(*(edges_of(a, points.dx) for a in (points.x_points, points.y_points)))


@pytest.mark.parametrize("azimuth", [0, 30, 45])
@pytest.mark.parametrize(("root", "most"), [(4.0, 1.1e-2), (2.0, 3.6e-3)])
def test_a_cap_slides_alike_in_every_direction(azimuth, root, most):
    surface, solution = Inclined(azimuth, 35.0), FrictionlessCap()
    fall = np.cos(np.radians(35))
    c, s = surface.direction
    spacing = root * np.sqrt(fall)
    points = lattice(150 + 180 * c, 150 + 180 * s, spacing)

    def exact(x, y, time):
        return solution(surface.along(x, y) / fall, surface.across(x, y), time)[0]

    depth = cell_means(lambda x, y: exact(x, y, 0.0), points)
    run = simulate(Scene(points, surface, depth, 0 * depth, 0 * depth, Coulomb(0)), [5.0])
    known = exact(*points.coordinates, 5.0)
    assert np.linalg.norm(run.depth[-1] - known) <= most * np.linalg.norm(known)
    assert abs(run.ledger.error) < 1e-14


def test_on_flat_ground_it_is_the_lattice():
    points = lattice(20, 14, 0.5)
    x, y = points.coordinates
    depth = np.maximum(0, 2 - ((x - 3) ** 2 + y**2) / 16)
    one, two = (
        simulate(Scene(points, bed, depth, 0 * depth, 0 * depth, Coulomb(20)), [1.0, 3.0])
        for bed in (Inclined(0, 0.0), Plane(0.0))
    )
    assert one.steps == two.steps
    np.testing.assert_allclose(one.depth, two.depth, atol=1e-13)
    np.testing.assert_allclose(one.velocity_y, two.velocity_y, atol=1e-12)


def patch(surface, azimuth, points, start, speed, depth=1.0):
    """A round patch at an arc length from the lowest point, moving along the azimuth; m, m s-1."""
    c, s = np.cos(np.radians(azimuth)), np.sin(np.radians(azimuth))
    x, y = points.coordinates
    place = RADIUS * np.sin(start / RADIUS)
    h = depth * np.exp(-((x - place * c) ** 2 + (y - place * s) ** 2) / 36)
    h[h < 1e-6 * depth] = 0
    z = corners(surface, points)
    e_1, e_2 = frames_of(z, points.dx)
    e_3 = np.cross(e_1, e_2, axis=0)
    # tangent to the bed over the direction
    way = np.stack([np.full_like(x, c), np.full_like(x, s), -(e_3[0] * c + e_3[1] * s) / e_3[2]])
    way /= np.sqrt((way**2).sum(0))
    moves = speed * (h > 0)
    return h, moves * (way * e_1).sum(0), moves * (way * e_2).sum(0), lifted_area(z, points.dx)


@pytest.mark.parametrize(
    ("surface", "azimuth", "spacing", "most"),
    [
        (Trough(0, RADIUS), 0, 4, 1e-5),
        (Trough(0, RADIUS), 0, 2, 1e-5),
        (Trough(30, RADIUS), 30, 2, 1e-5),
        (Trough(45, RADIUS), 45, 2, 1e-5),
        (Bowl(RADIUS), 30, 2, 3e-4),
        (Bowl(RADIUS), 45, 1, 1e-4),
    ],
)
def test_along_an_arc_without_gravity_no_energy_is_made_or_lost(surface, azimuth, spacing, most):
    points = lattice(74 if azimuth == 0 else 62, 62, spacing)
    h, u, v, area = patch(surface, azimuth, points, -50.0, 10.0)
    scheme = WeightedResidual(wet_limit=1e-9)
    run = simulate(Scene(points, surface, h, u, v, Coulomb(0), gravity=1e-9, scheme=scheme), [0.0, 10.0])
    energy = [
        (h * (u**2 + v**2) * area).sum()
        for h, u, v in zip(run.depth, run.velocity_x, run.velocity_y, strict=True)
    ]
    assert abs(energy[1] / energy[0] - 1) <= most
    x, y = points.coordinates
    c, s = np.cos(np.radians(azimuth)), np.sin(np.radians(azimuth))
    sideways = (run.depth[-1] * area * (c * y - s * x)).sum() / (run.depth[-1] * area).sum()
    assert abs(sideways) < 0.1


@pytest.mark.parametrize("azimuth", [0, 45])
def test_a_thin_patch_with_friction_goes_as_far_as_a_point(azimuth):
    surface, points = (
        Trough(azimuth, RADIUS),
        lattice(76 if azimuth == 0 else 66, 40 if azimuth == 0 else 66, 2),
    )
    h, u, v, area = patch(surface, azimuth, points, -70.0, 0.0, depth=0.02)
    run = simulate(Scene(points, surface, h, u, v, Coulomb(20)), [0.0, 60.0])
    assert np.isfinite(run.rest_time)
    arc = RADIUS * np.arcsin(surface.along(*points.coordinates) / RADIUS)
    went = [(depth * area * arc).sum() / (depth * area).sum() for depth in run.depth]
    slide, steep = np.tan(np.radians(20)), 9.81 / RADIUS

    def motion(_, state):
        angle, rate = state
        return rate, -steep * np.sin(angle) - slide * (steep * np.cos(angle) + rate**2)

    def stops(_, state):
        return state[1]

    stops.terminal, stops.direction = True, -1
    point = solve_ivp(motion, (0, 60), (-0.7, 1e-9), events=stops, rtol=1e-9).y[0]
    assert abs((went[1] - went[0]) - RADIUS * (point[-1] - point[0])) < 1.2


@pytest.mark.parametrize("azimuth", [0, 30])
def test_the_chute_as_a_surface_is_the_chute_as_a_profile(azimuth):
    profile, friction, spacing = Bend(angle=35, start=17.5, end=21.5), Coulomb(30), 0.2
    heap = Hemisphere(centre=(4, 0), radius=1.85)
    strip = Lattice(x=(0, 30), y=(-7, 7), spacing=spacing)
    laid = initial_state([heap], strip)
    still = laid.velocity_x, laid.velocity_y
    known = simulate(Scene(strip, profile, laid.depth, *still, friction, gravity=1.0), [6.0])
    surface = Profiled(azimuth, profile, 60.0)
    c, s = surface.direction
    length = float(profile.horizontal_distance(20.0))
    ends = [(a * c - b * s, a * s + b * c) for a in (0.0, length) for b in (-5.0, 5.0)]
    half = np.max(np.ptp(ends, axis=0)) / 2
    x, y = np.mean(ends, axis=0)
    points = Lattice((x - half, x + half), (y - half, y + half), spacing)

    def depth_of(x, y):
        arc = surface.arcs(surface.along(x, y))
        return np.sqrt(np.maximum(0.0, 1.85**2 - (arc - 4) ** 2 - surface.across(x, y) ** 2))

    depth = cell_means(depth_of, points)
    run = simulate(Scene(points, surface, depth, 0 * depth, 0 * depth, friction, gravity=1.0), [6.0])
    x, y = points.coordinates
    place = np.stack([surface.across(x, y), surface.arcs(surface.along(x, y))], axis=-1)
    axes = strip.y_points, strip.x_points
    there = RegularGridInterpolator(axes, known.depth[-1], bounds_error=False, fill_value=0.0)(place)
    assert np.linalg.norm(run.depth[-1] - there) <= 4e-2 * np.linalg.norm(there)
