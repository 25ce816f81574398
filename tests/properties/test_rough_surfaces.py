"""Laws that flows keep on rough ground: noise, steps, pits, ridges, holes in the data, in any direction."""

from dataclasses import replace

import numpy as np
import pytest
from scipy.ndimage import gaussian_filter

from solver import Coulomb, Lattice, Scene, Voellmy, simulate
from solver.checks.plausibility import doubts
from solver.physics.elevation import ElevationModel
from solver.points.cloud import random_points

SEEDS = range(12)
SPACING = 2.0
ROWS, COLUMNS = 46, 54
END = 10.0


def drawn(seed):
    """A scene on rough ground, from a seed."""
    rng = np.random.default_rng(seed)
    x, y = SPACING * np.arange(COLUMNS), SPACING * np.arange(ROWS)
    azimuth, slope = rng.uniform(0, 2 * np.pi), np.tan(np.radians(rng.uniform(5, 40)))
    column, row = np.meshgrid(x - x.mean(), y - y.mean())
    along = np.cos(azimuth) * column + np.sin(azimuth) * row
    across = np.cos(azimuth) * row - np.sin(azimuth) * column
    z = -slope * along + rng.choice([0.0, 0.05, 0.5]) * rng.normal(size=along.shape)
    z += 3 * rng.uniform() * gaussian_filter(rng.normal(size=along.shape), rng.uniform(1, 4))
    # a step down the way, a ridge along it, and pits
    z -= rng.choice([0.0, 4.0]) * (along > rng.uniform(5, 20))
    z += rng.choice([0.0, 3.0]) * np.exp(-(((across - rng.uniform(-10, 10)) / 4) ** 2)) * (along > 0)
    for _ in range(rng.integers(0, 4)):
        j, i = rng.integers(8, ROWS - 8), rng.integers(8, COLUMNS - 8)
        z[j : j + 2, i : i + 2] -= rng.uniform(1, 6)
    if rng.uniform() < 0.5:
        j, i = rng.integers(0, ROWS - 6), rng.integers(0, COLUMNS - 6)
        z[j : j + 5, i : i + 5] = np.nan
    model = ElevationModel(x, y, z, rng.choice([None, 0.0, 8.0]))
    depth = np.maximum(0.0, rng.uniform(0.5, 4) - ((along + 15) ** 2 + across**2) / rng.uniform(40, 120))
    friction = (
        Coulomb(float(rng.uniform(5, 35)))
        if rng.uniform() < 0.6
        else Voellmy(float(rng.uniform(5, 20)), float(rng.uniform(100, 1500)))
    )
    points = Lattice((x[0], x[-1]), (y[0], y[-1]), SPACING)
    return Scene(points, model, depth, 0 * depth, 0 * depth, friction)


def scaled(scene, factor):
    """Give a scene with lengths larger by a power of 4, whose times are larger by the root of it."""
    model, points = scene.terrain, scene.points
    length = model.curvature_length
    larger = ElevationModel(
        factor * model.x, factor * model.y, factor * model.elevation, length and factor * length
    )
    x, y = (tuple(factor * end for end in side) for side in (points.x, points.y))
    return replace(
        scene, points=Lattice(x, y, factor * SPACING), terrain=larger, depth=factor * scene.depth,
        velocity_x=scene.velocity_x, velocity_y=scene.velocity_y,
    )  # fmt: skip


def mirrored(scene):
    """Give the mirror image of a scene along y."""
    model = scene.terrain
    turned = ElevationModel(model.x, model.y, model.elevation[::-1].copy(), model.curvature_length)
    return replace(scene, terrain=turned, depth=scene.depth[::-1].copy())


def scattered(scene, seed):
    """Give a scene on as many random points, with the depth of the lattice's cell that holds each."""
    lattice = scene.points
    cloud = random_points(lattice.x, lattice.y, lattice.x_points.size * lattice.y_points.size, seed)
    x, y = cloud.control_volumes.centroid.T
    column, row = (np.rint(a / SPACING).astype(int) for a in (x, y))
    depth = scene.depth[row, column]
    return replace(scene, points=cloud, depth=depth, velocity_x=0 * depth, velocity_y=0 * depth)


@pytest.mark.parametrize("seed", SEEDS)
def test_laws_are_kept_on_rough_ground_by_clouds(seed):
    scene = scattered(drawn(seed), seed)
    run = simulate(scene, [END / 2, END])
    assert run.failure is None
    assert abs(run.ledger.error) < 1e-15
    assert (run.depth >= 0).all()
    assert not list(doubts(scene, run))
    # what comes to no data has left
    gaps = scene.terrain.gaps_at(*scene.points.control_volumes.centroid.T)
    assert not run.deposit_depth[gaps].any()
    # as much as on a lattice has left
    beside = simulate(drawn(seed), [END])
    left = [each.ledger.outflow / each.ledger.released for each in (run, beside)]
    assert left[0] == pytest.approx(left[1], abs=0.16)


@pytest.mark.parametrize("seed", SEEDS)
def test_laws_are_kept_on_rough_ground(seed):
    scene = drawn(seed)
    run = simulate(scene, [END / 2, END])
    assert run.failure is None
    assert abs(run.ledger.error) < 1e-15
    assert (run.depth >= 0).all()
    assert not list(doubts(scene, run))
    # what comes to no data or to the edge has left
    gaps = np.isnan(scene.terrain.elevation)
    assert not run.deposit_depth[gaps].any()
    rim = np.ones(gaps.shape, bool)
    rim[1:-1, 1:-1] = False
    assert not run.deposit_depth[rim].any()
    image = simulate(mirrored(scene), [END / 2, END])
    np.testing.assert_array_equal(image.depth[:, ::-1], run.depth)
    np.testing.assert_array_equal(-image.velocity_y[:, ::-1] + 0.0, run.velocity_y + 0.0)


@pytest.mark.parametrize("seed", [s for s in SEEDS if isinstance(drawn(s).friction, Coulomb)])
def test_a_scene_four_times_as_large_is_the_same_to_the_last_bit(seed):
    scene = drawn(seed)
    one, four = simulate(scene, [END]), simulate(scaled(scene, 4.0), [2 * END])
    assert one.steps == four.steps
    np.testing.assert_array_equal(4 * one.depth, four.depth)
    np.testing.assert_array_equal(2 * one.velocity_x, four.velocity_x)


def test_the_scenes_are_rough_and_move():
    scenes = [drawn(seed) for seed in SEEDS]
    assert any(np.isnan(scene.terrain.elevation).any() for scene in scenes)
    assert {type(scene.friction) for scene in scenes} == {Coulomb, Voellmy}
    moved = [simulate(scene, [END]).max_speed.max() for scene in scenes]
    assert np.median(moved) > 3
