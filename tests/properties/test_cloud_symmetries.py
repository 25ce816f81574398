"""What the equations cannot tell apart, the solver must not either, on clouds to round-off."""

from dataclasses import replace

import numpy as np
import pytest
from scipy.interpolate import RegularGridInterpolator

from solver.forms import begin
from solver.physics.earth_pressure import MohrCoulomb
from solver.physics.friction import Coulomb
from solver.physics.terrain import Plane
from solver.points.cloud import PointCloud, given_points, graded_points, random_points
from solver.points.lattice import Lattice
from solver.points.spacing import Refinement
from solver.release.initial_state import initial_state
from solver.release.shapes import Paraboloid
from solver.scene import Boundaries, Scene
from solver.simulation import simulate
from solver.verification import cases

X, Y = (0.0, 30.0), (-7.0, 7.0)


def mirrored(points, x, y):
    """A cloud that is its own mirror image in y: points of one half, and their images."""
    return given_points(np.concatenate([points, points * [1, -1]]), x, y)


def image(cloud):
    """Number of the mirror image of every point."""
    return cloud.nearest(1, cloud.points * [1, -1])[:, 0]


def chute(points, **changes):
    return replace(cases.chute(points, cases.CONSERVATIVE), **changes)


def patch(cloud, centre):
    """A heap that slides on a plane, far from all sides."""
    laid = initial_state([Paraboloid(centre, (3.0, 2.0), 1.0)], cloud)
    state = laid.depth, laid.velocity_x, laid.velocity_y
    return Scene(cloud, Plane(32.0), *state, Coulomb(25.0), MohrCoulomb(35.0, 25.0))


HALVES = {
    "even": random_points(X, (0.0, 7.0), 1200, 2).points,
    "graded": graded_points(X, (0.0, 7.0), 0.6, [Refinement((2, 8), (0, 3), 0.3)], seed=2).points,
}


@pytest.mark.parametrize("kind", HALVES)
def test_a_scene_symmetric_about_the_axis_stays_so(kind):
    points = HALVES[kind]
    cloud = mirrored(points[points[:, 1] > 0.05], X, Y)
    other = image(cloud)
    np.testing.assert_allclose(cloud.points[other], cloud.points * [1, -1], atol=1e-15)
    run = simulate(chute(cloud), [3.0, 9.0, 15.0])
    np.testing.assert_allclose(run.depth, run.depth[:, other], atol=1e-11)
    np.testing.assert_allclose(run.velocity_x, run.velocity_x[:, other], atol=1e-8)
    np.testing.assert_allclose(run.velocity_y, -run.velocity_y[:, other], atol=1e-8)
    assert abs(run.ledger.error) < 1e-13


def shifted(cloud, by):
    """The same points in the same order elsewhere."""
    x, y = (tuple(np.add(bounds, d)) for bounds, d in zip((cloud.x, cloud.y), by, strict=True))
    return PointCloud(cloud.points + by, x, y)


def test_a_shift_along_a_plane_shifts_the_result():
    cloud = random_points((0.0, 32.0), (-8.0, 8.0), 2048, 3)
    here = simulate(patch(cloud, (8.0, 0.0)), [1.0])
    there = simulate(patch(shifted(cloud, (128.0, 64.0)), (136.0, 64.0)), [1.0])
    np.testing.assert_allclose(here.depth, there.depth, atol=1e-11)
    np.testing.assert_allclose(here.velocity_x, there.velocity_x, atol=1e-8)


@pytest.mark.parametrize(("factor", "tolerance"), [(4.0, 0.0), (0.25, 0.0), (3.0, 1e-9)])
def test_gravity_scales_time_and_nothing_else(factor, tolerance):
    cloud = random_points(X, Y, 2500, 1)
    times = np.array([3.0, 9.0])
    slow = simulate(chute(cloud), times)
    fast = simulate(chute(cloud, gravity=factor), times / np.sqrt(factor))
    assert fast.steps == slow.steps
    np.testing.assert_allclose(fast.depth, slow.depth, rtol=0, atol=tolerance)
    np.testing.assert_allclose(
        fast.velocity_x / np.sqrt(factor), slow.velocity_x, rtol=0, atol=1e3 * tolerance
    )


def test_lattice_and_cloud_come_closer_with_the_spacing():
    """Exact case 10, at t = 12."""
    differences = []
    for spacing in (0.5, 0.25):
        lattice = Lattice(X, Y, spacing)
        cloud = random_points(X, Y, round(420 / spacing**2), 1)
        there = simulate(chute(lattice), [12.0]).depth[0]
        found = simulate(chute(cloud), [12.0]).depth[0]
        cells = cloud.control_volumes
        read = RegularGridInterpolator((lattice.y_points, lattice.x_points), there)
        wanted = read(cells.centroid[:, ::-1])
        differences.append(
            np.sqrt((cells.area * (found - wanted) ** 2).sum() / (cells.area * wanted**2).sum())
        )
    assert differences[1] < 0.65 * differences[0]
    assert differences[1] < 0.05


def test_the_chute_comes_to_rest_and_its_volume_is_exact():
    run = simulate(chute(random_points(X, Y, 2500, 1)), [24.0, 48.0, 60.0])
    assert 25 < run.rest_time < 48
    assert not run.velocity_x[1:].any()
    np.testing.assert_array_equal(run.depth[1], run.depth[2])
    assert run.depth.min() >= 0
    assert abs(run.ledger.error) <= 1e-13


def fed(cloud, sign):
    """A dry plane that falls along x, with a given depth at the side where y is least, or most."""
    nothing = np.zeros(len(cloud.points))
    sides = ("open", "open", 1.4, "open") if sign > 0 else ("open", "open", "open", 1.4)
    return Scene(
        cloud, Plane(36.83), nothing, nothing, nothing, Coulomb(5.243), boundaries=Boundaries(*sides)
    )


@pytest.mark.parametrize("seed", [4, 24, 27])
def test_a_film_that_a_side_feeds_is_that_of_the_mirrored_scene(seed):
    # cells beside the side get wet in the same step, equally fast to round-off: whichever is called the
    # faster, both show the same depth
    points = np.random.default_rng(seed).uniform([X[0], Y[0]], [X[1], Y[1]], (150, 2))
    here, there = (given_points(points * [1, sign], X, Y) for sign in (1, -1))
    runs = [begin(fed(cloud, sign), 2.0, 0.0, True) for cloud, sign in ((here, 1), (there, -1))]
    for run in runs:
        run.advance(2.0, 4)
    at = there.nearest(1, here.points * [1, -1])[:, 0]
    (h, u, v), (h_image, u_image, v_image) = runs[0].state, (q[at] for q in runs[1].state)
    assert h.max() > 0.5
    for q, other in ((h, h_image), (u, u_image), (v, -v_image)):
        np.testing.assert_allclose(q, other, atol=1e-12)
