"""Runs on elevation models: rest, mirror images, the ledger, drains, and going on from a snapshot."""

from dataclasses import replace

import numpy as np
import pytest
from checkpoints import with_and_without_a_restart

from solver import Coulomb, Lattice, MohrCoulomb, Scene, Section, Voellmy, simulate
from solver.physics.elevation import ElevationModel, edges_of, lifted_area, plan_slopes
from solver.scene import Boundaries

POINTS = Lattice((-60, 60), (-50, 50), 2.0)


def rough(noise=0.05, slope=8.0, length=0.0, seed=1):
    x, y = np.arange(-70.0, 71.0, 2.0), np.arange(-60.0, 61.0, 2.0)
    z = -np.tan(np.radians(slope)) * x + np.random.default_rng(seed).normal(0, noise, (len(y), len(x)))
    return ElevationModel(x, y, z, length)


def heap(height=3.0, centre=(-20.0, 7.0), square=200.0):
    x, y = POINTS.coordinates
    return np.maximum(0.0, height - ((x - centre[0]) ** 2 + (y - centre[1]) ** 2) / square)


def scene(surface, depth, friction=10.0, **more):
    law = Coulomb(friction) if isinstance(friction, float) else friction
    return Scene(POINTS, surface, depth, 0 * depth, 0 * depth, law, **more)


def flipped(model, axis):
    return ElevationModel(model.x, model.y, np.flip(model.elevation, axis).copy(), model.curvature_length)


@pytest.mark.parametrize("length", [0.0, 10.0])
@pytest.mark.parametrize("axis", [0, 1])
def test_mirror_images_agree_to_the_last_bit(axis, length):
    model, depth = rough(length=length), heap()
    one = simulate(scene(model, depth), [2.0, 10.0])
    two = simulate(scene(flipped(model, axis), np.flip(depth, axis).copy()), [2.0, 10.0])
    signs = (-1, 1) if axis == 1 else (1, -1)
    np.testing.assert_array_equal(one.depth, np.flip(two.depth, axis + 1))
    np.testing.assert_array_equal(one.velocity_x, signs[0] * np.flip(two.velocity_x, axis + 1))
    np.testing.assert_array_equal(one.velocity_y, signs[1] * np.flip(two.velocity_y, axis + 1))
    assert one.steps == two.steps > 10


def steepest(model, depth):
    """Largest slope of what lies on the bed, and of the bed under it, degrees."""
    edges = [edges_of(a, 2.0) for a in (POINTS.x_points, POINTS.y_points)]
    b_x, b_y = plan_slopes(model.corners(*edges), 2.0)
    return np.degrees(np.arctan(np.hypot(b_x, b_y)[depth > 0].max()))


def test_what_friction_holds_stays_to_the_last_bit_and_what_it_does_not_moves():
    model, depth = rough(), 0.5 * (heap() > 0)
    limit = steepest(model, depth) + np.degrees(np.arctan(0.25))
    held = simulate(scene(model, depth, float(limit)), [0.0, 20.0])
    np.testing.assert_array_equal(held.depth[1], depth)
    assert held.rest_time == 0.0
    moved = simulate(scene(model, depth, 7.0), [0.0, 1.0])
    assert not np.array_equal(moved.depth[1], depth)


def test_a_heap_beside_an_avalanche_stays_to_the_last_bit():
    model = rough(noise=0.02, slope=12.0)
    resting = 0.3 * (heap(centre=(30.0, -30.0)) > 2)
    depth = heap(centre=(-30.0, 20.0)) + resting
    friction = Coulomb(23.0)
    _, y = POINTS.coordinates
    start = Scene(POINTS, model, depth, 9.0 * (y > 0) * (depth > 0), 0 * depth, friction)
    run = simulate(start, [0.0, 3.0])
    assert (run.depth[1] != depth)[y > 0].any()
    np.testing.assert_array_equal(run.depth[1][y < -10], depth[y < -10])


def needed(model, depth):
    """Tangent of the friction that holds what lies still: the largest by S5 for all pairs of differences."""
    edges = [edges_of(a, POINTS.dx) for a in (POINTS.x_points, POINTS.y_points)]
    b_x, b_y = plan_slopes(model.corners(*edges), POINTS.dx)
    bent, steep = np.sqrt(1 + b_x**2), np.sqrt(1 + b_x**2 + b_y**2)
    # gravity along the frame by that normal to the bed
    pulls = -b_x * steep / bent, -b_y / bent
    wide = np.pad(depth, 1)
    sides = (
        (wide[1:-1, 2:] - depth, depth - wide[1:-1, :-2]),
        (wide[2:, 1:-1] - depth, depth - wide[:-2, 1:-1]),
    )
    slopes = [np.array([one, other, (one + other) / 2]) / POINTS.dx for one, other in sides]
    found = 0.0
    for d_x in slopes[0]:
        for d_y in slopes[1]:
            along = d_x / bent - pulls[0]
            across = -b_x * b_y / (bent * steep) * d_x + bent / steep * d_y - pulls[1]
            found = max(found, np.hypot(along, across)[depth > 0].max())
    return found


@pytest.mark.parametrize("noise", [0.05, 0.3])
def test_a_heap_on_a_rough_bed_stays_below_its_limit_beside_an_avalanche_and_moves_beyond_it(noise):
    model, whole = rough(noise), heap(2.0, (35.0, -24.0))
    resting = whole * (whole > 0.3)
    x, y = POINTS.coordinates
    near = np.hypot(x - 35.0, y + 24.0) < 24
    depth = resting + heap(centre=(-35.0, 25.0), square=150.0)
    for share, moves in ((0.9, False), (1.1, True)):
        friction = Coulomb(float(np.degrees(np.arctan(needed(model, resting) / share))))
        start = Scene(POINTS, model, depth, 9.0 * (depth > 0) * ~near, 0 * depth, friction)
        run = simulate(start, [0.0, 3.0])
        assert (run.depth[1] != depth)[~near].any()
        assert (run.depth[1] != depth)[near].any() == moves


def test_volume_is_kept_to_round_off_and_what_leaves_is_in_the_ledger():
    model = rough(noise=0.2, slope=25.0)
    model.elevation[20:30, 45:50] = np.nan
    run = simulate(scene(model, heap(), 5.0), [60.0])
    edges = [edges_of(a, 2.0) for a in (POINTS.x_points, POINTS.y_points)]
    area = lifted_area(model.corners(*edges), 2.0)
    assert run.ledger.outflow > 0.5 * run.ledger.released
    assert run.ledger.outflow_open == run.ledger.outflow
    assert abs(run.ledger.error) < 1e-14
    assert run.ledger.now == pytest.approx((run.deposit_depth * area).sum(), rel=1e-14, abs=1e-9)
    inside = np.isnan(model.elevation[5:-5, 5:-5])
    assert (run.deposit_depth[inside] == 0).all()
    assert (run.max_depth[inside] > 0).any()


@pytest.mark.parametrize("ratio", [1.0, 1.6])
def test_volume_is_counted_by_the_areas_that_fluxes_have_also_far_from_the_origin(ratio):
    """What is computed of a surface in a window of the lattice differs from the whole in the last digits."""
    d, x, y = 0.2584 / ratio, 2.6e6 + 0.2584 * np.arange(40) / ratio, 1.2e6 + 0.2584 * np.arange(40) / ratio
    steps = np.floor((np.arange(40) - 20.0) / 4) * 0.3
    model = ElevationModel(x, y, np.add.outer(0.3 * np.sin(np.arange(40)), -steps), 2.0)
    points = Lattice((x[0], x[-1] - 1.0), (y[0], y[-1] - 1.0), d * ratio)
    a, b = points.coordinates
    depth = np.where(np.hypot(a - x[20], b - y[14]) < 1.2 * d * 4, 0.1, 0.0)
    run = simulate(Scene(points, model, depth, 0 * depth, 0 * depth, Coulomb(5.0)), [0.2, 0.5, 2.0])
    edges = [edges_of(q, points.dx) for q in (points.x_points, points.y_points)]
    area = lifted_area(model.corners(*edges), points.dx)
    volumes = (run.depth * area).sum((1, 2))
    assert run.steps > 10
    assert abs(volumes[0] / (depth * area).sum() - 1) < 2e-15
    assert abs(run.ledger.error) < 1e-14


def test_skipping_changes_no_bit():
    model, depth = rough(noise=0.1), heap()
    one, two = (simulate(scene(model, depth), [5.0, 20.0], skip=skip) for skip in (True, False))
    np.testing.assert_array_equal(one.depth, two.depth)
    np.testing.assert_array_equal(one.max_speed, two.max_speed)


@pytest.mark.parametrize("built", [False, True])
def test_stages_swept_together_are_those_one_after_the_other_to_the_last_bit(built):
    model, depth = rough(noise=0.2), heap()
    x, y = POINTS.coordinates
    buildings = (np.abs(x - 10) < 4) & (np.abs(y - 5) < 5) if built else None
    alone = scene(model, depth, 7.0, buildings=buildings)
    # what passes a section is summed over stages, which follow each other then
    measured = replace(alone, sections=(Section("below", ((0, -20), (0, 30))),), section_times=(0.0, 20.0))
    one, two = (simulate(each, [5.0, 20.0]) for each in (alone, measured))
    assert one.steps == two.steps > 50
    for field in ("depth", "velocity_x", "velocity_y", "max_speed"):
        np.testing.assert_array_equal(getattr(one, field), getattr(two, field))


def test_ten_steps_are_five_and_a_restart_and_five(monkeypatch):
    monkeypatch.setattr("solver.lattice.run.LEAST_GROWTH", 2)
    case = scene(rough(slope=20.0), heap(), Voellmy(8.0, 500.0))
    whole, second = with_and_without_a_restart(case, 30.0, 10)
    for one, two in zip(whole.state, second.state, strict=True):
        np.testing.assert_array_equal(one, two)


def test_what_a_surface_cannot_have_is_refused():
    depth = heap()
    with pytest.raises(ValueError, match="all sides are open"):
        simulate(scene(rough(), depth, boundaries=Boundaries(y_min="wall")), [1.0])
    with pytest.raises(ValueError, match="isotropic"):
        simulate(scene(rough(), depth, earth_pressure=MohrCoulomb(30, 10)), [1.0])


def test_what_is_released_in_the_outermost_cells_leaves_by_the_ledger():
    x = np.arange(0, 100.0, 5)
    model = ElevationModel(x, x, np.zeros((20, 20)) - 0.3 * x[None, :], 0.0)
    lattice = Lattice((0, 95), (0, 95), 5.0)
    depth = np.zeros(lattice.shape)
    depth[8:12, :3] = 1.0
    released = depth.sum() * 25 * np.hypot(1, 0.3)
    run = simulate(Scene(lattice, model, depth, 0 * depth, 0 * depth, Coulomb(10)), [0.5, 3.0])
    # the raster ends half a cell before the domain: the outermost cells have an area of their own
    assert run.ledger.released == pytest.approx(released, rel=0.02)
    assert run.ledger.outflow > 0.3 * released
    assert abs(run.ledger.error) < 1e-14
