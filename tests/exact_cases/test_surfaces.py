"""Exact cases on surfaces: the compass does not matter, and the bed's curvature makes no energy."""

import numpy as np
import pytest
from scipy.interpolate import RegularGridInterpolator

from solver import Bend, Coulomb, Hemisphere, Lattice, Plane, Scene, initial_state, simulate
from solver.verification.surface_cases import (
    RADIUS,
    cap_error,
    centred,
    way_of_a_point,
    with_friction,
    without_gravity,
)
from solver.verification.surfaces import Bowl, Inclined, Profiled, Trough, cell_means


@pytest.mark.parametrize("azimuth", [0, 30, 45])
@pytest.mark.parametrize(("root", "most"), [(4.0, 1.1e-2), (2.0, 3.6e-3)])
def test_a_cap_slides_alike_in_every_direction(azimuth, root, most):
    error, run = cap_error(azimuth, root)
    assert error <= most
    assert abs(run.ledger.error) < 1e-14


@pytest.mark.parametrize("azimuth", [0, 30, 45])
def test_a_cap_on_a_cloud_slides_alike_in_every_direction(azimuth):
    # the cloud of a slope profile has 9.9e-3 and 3.9e-3 there
    for root, most in ((4.0, 1.1e-2), (2.0, 4e-3)):
        error, run = cap_error(azimuth, root, "cloud")
        assert error <= most
        assert abs(run.ledger.error) < 1e-14


@pytest.mark.parametrize("azimuth", [0, 30, 45])
def test_on_a_cloud_a_thin_patch_with_friction_goes_as_far_as_a_point(azimuth):
    arc = with_friction(azimuth, 2.0, layout="cloud")
    assert arc.rests
    assert abs(arc.went - way_of_a_point()) < 1.2


def test_a_patch_that_brakes_on_a_cloud_drifts_less_on_a_finer_one():
    coarse, fine = (with_friction(30, spacing, depth=2.0, layout="cloud").sideways for spacing in (4.0, 2.0))
    assert abs(fine) < 0.5 * abs(coarse) < 0.1


def test_on_flat_ground_it_is_the_lattice():
    points = centred(20, 14, 0.5)
    x, y = points.coordinates
    depth = np.maximum(0, 2 - ((x - 3) ** 2 + y**2) / 16)
    one, two = (
        simulate(Scene(points, bed, depth, 0 * depth, 0 * depth, Coulomb(20)), [1.0, 3.0])
        for bed in (Inclined(0, 0.0), Plane(0.0))
    )
    assert one.steps == two.steps
    np.testing.assert_allclose(one.depth, two.depth, atol=1e-13)
    np.testing.assert_allclose(one.velocity_y, two.velocity_y, atol=1e-12)


ARCS = [
    (Trough(0, RADIUS), 0, 2, 1.5e-5),
    (Trough(30, RADIUS), 30, 2, 1.5e-5),
    (Trough(45, RADIUS), 45, 2, 1.5e-5),
    (Bowl(RADIUS), 30, 2, 3e-4),
    (Bowl(RADIUS), 45, 1, 1e-4),
]
# once what was as fast as its neighbour to round-off counted as torn off it: 2.7e-2 and 3.3e-3 on the sphere
COARSE_ARCS = [
    *((Trough(azimuth, RADIUS), azimuth, 4, 1.5e-5) for azimuth in (0, 30, 45)),
    (Bowl(RADIUS), 0, 4, 1.8e-4),
    (Bowl(RADIUS), 0, 2, 1.1e-4),
]


@pytest.mark.parametrize(
    ("layout", "surface", "azimuth", "spacing", "most"),
    [("lattice", *arc) for arc in COARSE_ARCS]
    + [(layout, *arc) for layout in ("lattice", "cloud") for arc in ARCS],
)
def test_along_an_arc_without_gravity_no_energy_is_made_or_lost(layout, surface, azimuth, spacing, most):
    arc = without_gravity(surface, azimuth, spacing, layout)
    assert abs(arc.energy) <= most
    assert abs(arc.sideways) < (0.3 if spacing == 4 else 0.1)


@pytest.mark.parametrize("azimuth", [0, 45])
def test_a_thin_patch_with_friction_goes_as_far_as_a_point(azimuth):
    arc = with_friction(azimuth, 2.0)
    assert arc.rests
    assert abs(arc.went - way_of_a_point()) < 1.2


def test_a_patch_that_brakes_obliquely_drifts_less_on_a_finer_lattice():
    coarse, fine = (with_friction(30, spacing, depth=2.0).sideways for spacing in (2.0, 1.0))
    assert abs(fine) < 0.5 * abs(coarse) < 0.1


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
