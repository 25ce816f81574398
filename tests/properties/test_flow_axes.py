"""Earth pressure with the axes of the flow knows no frame: scenes that are turned flow as they did."""

from dataclasses import replace

import numpy as np
import pytest
from scipy.interpolate import RegularGridInterpolator

from pipeline.studies.convergence import lattice, long_heap, row
from solver.physics.earth_pressure import Isotropic, MohrCoulomb, MohrCoulombFlow
from solver.physics.friction import Coulomb
from solver.physics.terrain import Plane
from solver.points.cloud import PointCloud, random_points
from solver.points.lattice import Lattice
from solver.scene import Collocation, Scene
from solver.simulation import simulate
from solver.verification import cases
from solver.verification.surfaces import Inclined, cell_means

FLOW = MohrCoulombFlow(40.0, 25.0)
HALF = 12.0
TIMES = (0.4, 0.8, 1.6)


def turned(x, y, angle):
    """Coordinates in a frame that is turned by an angle, degrees."""
    c, s = np.cos(np.radians(angle)), np.sin(np.radians(angle))
    return c * x + s * y, c * y - s * x


def lobe(points, angle, law):
    """A heap that is long, skew and moves, on level ground, turned by an angle."""
    x, y = turned(*points.coordinates, angle)
    depth = np.maximum(0.0, 1.2 - (x / 4) ** 2 - (y / 2) ** 2 - x * y / 20)
    along, across = (depth > 0) * (2.0 + 0.3 * x), (depth > 0) * (0.6 - 0.4 * y)
    u, v = turned(along, across, -angle)
    return Scene(points, Plane(0.0), depth, u, v, Coulomb(25.0), law)


def round_cloud(count, seed):
    """Points in a disc, which turns within its domain, and where flow comes to none of the sides."""
    bounds = (-HALF, HALF)
    found = random_points(bounds, bounds, count, seed).points
    return found[np.hypot(*found.T) < HALF]


def as_cloud(points):
    return PointCloud(points, (-HALF, HALF), (-HALF, HALF))


@pytest.mark.parametrize("angle", [30.0, 45.0])
def test_the_same_cloud_turned_flows_as_before(angle):
    points = round_cloud(4000, 4)
    # so often that outputs set the steps, which know x and y
    times = np.arange(1, 121) / 100
    here = simulate(lobe(as_cloud(points), 0.0, FLOW), times)
    there = simulate(lobe(as_cloud(np.stack(turned(*points.T, -angle), axis=1)), angle, FLOW), times)
    assert here.steps == there.steps == len(times)
    np.testing.assert_allclose(there.depth, here.depth, atol=1e-9)
    u, v = turned(there.velocity_x, there.velocity_y, angle)
    np.testing.assert_allclose(u, here.velocity_x, atol=1e-6)
    np.testing.assert_allclose(v, here.velocity_y, atol=1e-6)
    profile = MohrCoulomb(FLOW.internal_friction, FLOW.bed_friction)
    other = simulate(lobe(as_cloud(points), 0.0, profile), times[-1:])
    turned_back = simulate(
        lobe(as_cloud(np.stack(turned(*points.T, -angle), axis=1)), angle, profile), times[-1:]
    )
    assert np.abs(turned_back.depth - other.depth).max() > 0.05


def on_common(scene, angle, shape=(81, 81)):
    """Depth of a run at the times on points that are turned with the scene, (times, *shape)."""
    run = simulate(scene, TIMES)
    x, y = np.meshgrid(*(np.linspace(-6.0, 6.0, n) for n in shape))
    places = np.stack(turned(x, y, -angle), axis=-1)
    nearest = scene.points.nearest(4, places.reshape(-1, 2))
    way = np.linalg.norm(scene.points.control_volumes.centroid[nearest] - places.reshape(-1, 1, 2), axis=2)
    weight = 1 / (way + 1e-9)
    weight /= weight.sum(axis=1, keepdims=True)
    return np.array([(depth[nearest] * weight).sum(axis=1) for depth in run.depth])


def apart(one, two):
    """Relative L1."""
    return np.abs(one - two).sum(axis=1) / one.sum(axis=1)


def test_a_turned_scene_differs_by_no_more_than_another_cloud_makes_of_it():
    """Turned by 30 and 45 degrees on other points, beside the same scene on other points, and K = 1."""
    count = 9000
    clouds = [as_cloud(round_cloud(count, seed)) for seed in (1, 2, 3, 4)]
    found = {}
    for name, law in (("flow", FLOW), ("isotropic", Isotropic())):
        first, second = (on_common(lobe(cloud, 0.0, law), 0.0) for cloud in clouds[:2])
        turns = [
            on_common(lobe(cloud, angle, law), angle)
            for cloud, angle in zip(clouds[2:], (30.0, 45.0), strict=True)
        ]
        found[name] = [apart(first, each) for each in (second, *turns)]
    for same, *turns in found.values():
        for each in turns:
            assert (each < 1.3 * same).all()
            assert (each < 0.03).all()
    assert np.max(found["flow"]) < 1.5 * np.max(found["isotropic"])


def slide(azimuth, spacing, law):
    """A skew heap that slides down a plane of 35 degrees, and where it is, in the frame of the fall."""
    surface = Inclined(azimuth, 35.0)
    fall, (c, s) = float(np.cos(np.radians(35.0))), surface.direction
    points = Lattice((-8.0, np.ceil(14 * c + 8)), (-8.0, np.ceil(14 * s + 8)), spacing)

    def depth(x, y):
        p, q = turned(surface.along(x, y) / fall, surface.across(x, y), 30.0)
        return np.maximum(0.0, 1 - (p / 3) ** 2 - (q / 1.5) ** 2)

    h = cell_means(depth, points)
    run = simulate(Scene(points, surface, h, 0 * h, 0 * h, Coulomb(25.0), law), [0.5, 1.0, 2.0])
    assert run.failure is None
    assert abs(run.ledger.error) < 1e-13
    along, across = np.meshgrid(np.arange(-4, 14, 0.1) * fall, np.arange(-5, 5.01, 0.1))
    places = np.stack([along * s + across * c, along * c - across * s], axis=-1)
    axes = points.y_points, points.x_points
    return np.array(
        [
            RegularGridInterpolator(axes, h, bounds_error=False, fill_value=0.0)(places).ravel()
            for h in run.depth
        ]
    )


def test_on_a_plane_of_any_azimuth_it_flows_the_same():
    """Directions differ by the error of the scheme, which falls with the spacing, and is that of K = 1."""
    found = {}
    for law in (FLOW, Isotropic()):
        for spacing in (0.5, 0.25):
            down, *others = (slide(azimuth, spacing, law) for azimuth in (0.0, 30.0, 45.0))
            found[type(law), spacing] = np.array([apart(down, each) for each in others])
    flow, isotropic = ([found[law, d] for d in (0.5, 0.25)] for law in (MohrCoulombFlow, Isotropic))
    assert (flow[1] < 0.02).all()
    assert (flow[1] < 0.5 * flow[0]).all()
    assert (flow[1] < 1.1 * isotropic[1]).all()


def test_a_surface_that_is_level_is_a_lattice():
    points = Lattice((-12.0, 12.0), (-12.0, 12.0), 0.25)
    scene = lobe(points, 20.0, FLOW)
    here = simulate(scene, TIMES, skip=False)
    there = simulate(replace(scene, terrain=Inclined(0.0, 0.0)), TIMES, skip=False)
    assert here.steps == there.steps
    np.testing.assert_allclose(there.depth, here.depth, atol=1e-13)


@pytest.mark.parametrize(("phi", "tolerance"), [(30.0, 0.0), (40.0, 1e-8)])
def test_in_one_dimension_it_is_the_law_of_the_profile(phi, tolerance):
    """The ridge on the chute, until it rests on level ground."""
    scene = long_heap(row(0.2))
    runs = [
        simulate(replace(scene, earth_pressure=law(phi, 30.0)), [6.0, 15.0, 24.0, 50.0])
        for law in (MohrCoulomb, MohrCoulombFlow)
    ]
    assert runs[0].steps == runs[1].steps
    np.testing.assert_allclose(runs[1].depth, runs[0].depth, rtol=0, atol=tolerance)


def test_mirror_images_agree_to_the_last_bit_and_volume_is_exact():
    scene = replace(cases.chute(lattice(0.4), cases.CONSERVATIVE), earth_pressure=MohrCoulombFlow(40.0, 30.0))
    half, all_ = (simulate(scene, [6.0, 15.0, 24.0], skip=skip) for skip in (True, False))
    for run in (half, all_):
        np.testing.assert_array_equal(run.depth, run.depth[:, ::-1])
        np.testing.assert_array_equal(run.velocity_y, -run.velocity_y[:, ::-1])
        assert abs(run.ledger.error) < 1e-13
    np.testing.assert_array_equal(half.depth, all_.depth)


@pytest.mark.parametrize(
    ("kind", "share", "rests"),
    [
        ("lattice", 0.85, True),
        ("lattice", 1.15, False),
        ("surface", 0.85, True),
        ("surface", 1.15, False),
        # the depths at points that are thrown about have slopes of their own
        ("cloud", 0.6, True),
        ("cloud", 1.15, False),
    ],
)
def test_a_cone_on_level_ground_rests_up_to_its_limit(kind, share, rests):
    """Its slope may be tan(delta)/K, with K that of rest along the fall of the cone."""
    bounds = (-6.0, 6.0)
    points = random_points(bounds, bounds, 3000, 1) if kind == "cloud" else Lattice(bounds, bounds, 0.25)
    k = FLOW.coefficients()
    steep = share * np.tan(np.radians(25.0)) / ((k.x_active + k.x_passive) / 2)
    depth = steep * np.maximum(0.0, 4.0 - np.hypot(*points.coordinates))
    ground = Inclined(0.0, 0.0) if kind == "surface" else Plane(0.0)
    scene = Scene(points, ground, depth, 0 * depth, 0 * depth, Coulomb(25.0), FLOW)
    run = simulate(scene, [0.05, 1.0])
    if rests:
        np.testing.assert_array_equal(run.depth[-1], depth)
        assert not run.velocity_x.any()
    else:
        assert run.velocity_x[0].any()


@pytest.mark.parametrize("built", [False, pytest.param(True, marks=pytest.mark.slow)])
def test_what_is_skipped_on_a_surface_changes_no_bit(built, monkeypatch):
    monkeypatch.setattr("solver.lattice.run.LEAST_GROWTH", 2)
    points = Lattice((-12.0, 12.0), (-12.0, 12.0), 0.5)
    scene = replace(lobe(points, 20.0, FLOW), terrain=Inclined(30.0, 15.0))
    x, y = points.coordinates
    built = (np.abs(x - 6.5) < 0.6) & (np.abs(y - 4.5) < 0.6) if built else None
    skipped, whole = (simulate(replace(scene, buildings=built), TIMES, skip=skip) for skip in (True, False))
    assert skipped.failure is None
    assert abs(skipped.ledger.error) < 1e-13
    np.testing.assert_array_equal(skipped.depth, whole.depth)
    np.testing.assert_array_equal(skipped.velocity_x, whole.velocity_x)


def test_collocation_and_surfaces_say_what_they_take():
    points = Lattice((-4.0, 4.0), (-4.0, 4.0), 0.5)
    scene = replace(lobe(points, 0.0, FLOW), scheme=Collocation(support=9, degree=1))
    with pytest.raises(ValueError, match="no earth pressure with the axes of the flow"):
        simulate(scene, [0.1])
    profile = replace(lobe(points, 0.0, MohrCoulomb(40.0, 25.0)), terrain=Inclined(0.0, 0.0))
    with pytest.raises(ValueError, match="must be isotropic or have the axes of the flow"):
        simulate(profile, [0.1])
