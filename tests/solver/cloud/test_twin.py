"""The kernels of clouds against the dense scheme, on small scenes of every kind."""

from dataclasses import replace

import dense_cloud
import numpy as np
import pytest

from solver.physics.earth_pressure import MohrCoulomb
from solver.physics.friction import Coulomb, Voellmy
from solver.physics.terrain import Bend, Plane
from solver.points.cloud import graded_points, random_points
from solver.points.spacing import Refinement
from solver.scene import Boundaries, Scene, WeightedResidual
from solver.simulation import simulate

EVEN = random_points((0, 12), (-4, 4), 420, 5)
GRADED = graded_points((0, 12), (-4, 4), 0.7, [Refinement((2, 5), (-1, 2), 0.3)], seed=4)


SLOPE, FRICTION = Plane(30), Coulomb(20)


def scene(terrain=SLOPE, friction=FRICTION, heaps=(((3, 0.3), 2.5, 1.0),), speed=(0, 0), cloud=EVEN, **more):
    """Heaps of (centre, radius, height), with a sheared initial velocity."""
    x, y = cloud.control_volumes.centroid.T
    depth = sum(
        height * np.maximum(0, 1 - ((x - centre[0]) ** 2 + (y - centre[1]) ** 2) / radius**2)
        for centre, radius, height in heaps
    )
    shear = 1 + 0.1 * np.sin(2 * x + y)
    return Scene(cloud, terrain, depth, speed[0] * shear, speed[1] * shear, friction, **more)


def rough(seed, **more):
    """Depths over five decades, every third cell dry or at rest, velocities of either sign."""
    rng, n = np.random.default_rng(seed), len(EVEN)
    depth = 10.0 ** rng.uniform(-5, 0, n) * (rng.random(n) < 2 / 3)
    velocity = rng.normal(0, 3, (2, n)) * (rng.random(n) < 2 / 3)
    return replace(Scene(EVEN, Plane(20), depth, *velocity, Coulomb(15)), **more)


def all_sides(side):
    return Boundaries(side, side, side, side)


TWO, FOUR = (((3, 0), 2.9, 0.3), ((5, 1), 1.2, 0.8)), tuple(((1 + 3 * k, k - 2), 1.1, 0.5) for k in range(4))
SCENES = {
    "frictionless": (scene(friction=Coulomb(0), speed=(1, 0.5)), 0.5),
    "earth pressure jumps": (scene(earth_pressure=MohrCoulomb(40, 20), speed=(2, -1)), 0.5),
    "curvature": (scene(Bend(40, start=3, end=9), Coulomb(25), speed=(3, 0)), 0.5),
    "drag": (scene(friction=Voellmy(10, 50.0), speed=(2, 1)), 0.5),
    "walls": (scene(speed=(-3, 4), boundaries=all_sides("wall")), 0.6),
    "no-slip": (scene(speed=(-3, 4), boundaries=all_sides("no-slip")), 0.6),
    "given depth": (scene(Plane(0), heaps=(((6, 0), 2, 0.1),), boundaries=all_sides(0.5)), 0.5),
    "given depth that friction holds": (
        scene(Plane(0), Coulomb(35), heaps=(((6, 0), 2, 1.0),), boundaries=Boundaries(0.1, "open")),
        0.5,
    ),
    "partly at rest": (scene(Plane(20), Coulomb(25), TWO, earth_pressure=MohrCoulomb(35, 25)), 1.0),
    "several blobs": (scene(Plane(25), heaps=FOUR), 0.6),
    "leaving the domain": (scene(heaps=(((10, 3), 2.5, 1.0),), speed=(4, 3)), 1.0),
    "rough": (rough(1), 0.2),
    "rough, long steps": (rough(2, scheme=WeightedResidual(cfl=1.8)), 0.2),
    "rough, long steps, walls": (
        rough(3, scheme=WeightedResidual(cfl=1.8), boundaries=all_sides("wall")),
        0.2,
    ),
    "graded": (scene(cloud=GRADED, earth_pressure=MohrCoulomb(30, 20), speed=(1, 0)), 0.5),
    "other supports": (scene(scheme=WeightedResidual(support=13, degree=2, weight_shape=3.0)), 0.5),
    "coming to rest": (scene(Plane(5), Coulomb(35), speed=(1, 0), earth_pressure=MohrCoulomb(38, 35)), 10.0),
}


@pytest.mark.parametrize("name", SCENES)
def test_the_kernels_are_the_dense_scheme(name):
    start, end = SCENES[name]
    wanted = dense_cloud.simulate(start, end, arrival_depth=0.05)
    run = simulate(start, [end], arrival_depth=0.05)
    assert run.failure is None
    assert run.steps == wanted.steps >= 3
    close = {"rtol": 1e-12, "atol": 1e-12}
    np.testing.assert_allclose(run.depth[0], wanted.shown.h, **close)
    np.testing.assert_allclose(run.velocity_x[0], wanted.shown.u, rtol=1e-9, atol=1e-9)
    np.testing.assert_allclose(run.velocity_y[0], wanted.shown.v, rtol=1e-9, atol=1e-9)
    np.testing.assert_allclose(run.max_depth, wanted.max_depth, **close)
    np.testing.assert_allclose(run.max_speed, wanted.max_speed, rtol=1e-9, atol=1e-9)
    np.testing.assert_allclose(run.max_momentum_flux, wanted.max_flux, rtol=1e-9, atol=1e-10)
    np.testing.assert_allclose(run.arrival_time, wanted.arrival, rtol=1e-12)
    np.testing.assert_allclose(
        [run.ledger.inflow, run.ledger.outflow], wanted.ledger.sum(axis=0), rtol=1e-11, atol=1e-13
    )
    assert abs(run.ledger.error) < 1e-13
    assert np.isnan(run.rest_time) == np.isnan(wanted.rest_time)
    assert (wanted.limited > 0) >= ("long steps" in name)
    assert np.isfinite(run.rest_time) == (name == "coming to rest")
