"""Buildings on clouds: the ledger, rest, walls as closed sides are, alleys, restarts, and none at all."""

from dataclasses import replace

import numpy as np
import pytest
from checkpoints import with_and_without_a_restart

from solver import Coulomb, MohrCoulomb, Plane, PointCloud, Scene, Section, graded_points, simulate
from solver.cloud.operators import prepare
from solver.inflow.conditions import Inflow
from solver.inflow.hydrograph import Triangle
from solver.lmls.supports import supports
from solver.physics.elevation import ElevationModel
from solver.points.walls import with_walls
from solver.scene import Boundaries
from solver.structures import building_cells

BOUNDS = (-20.0, 20.0), (-15.0, 15.0)
BLOCK = np.array([[-1.0, -5.0], [7.0, -5.0], [7.0, 1.0], [-1.0, 1.0]])
SLANTED = np.array([[2.0, 4.0], [9.0, 8.0], [7.0, 11.5], [0.0, 7.5]])
WALL = np.array([[11.0, -6.0], [11.6, -6.0], [11.6, 6.0], [11.0, 6.0]])
FITTED = graded_points(*BOUNDS, 1.0, seed=3, outlines=[BLOCK, SLANTED, WALL])
# whose cells are cut off by half
RAGGED = graded_points(*BOUNDS, 1.0, seed=3)


def built_on(cloud):
    return building_cells([BLOCK, SLANTED, WALL], cloud)


def bed(kind):
    if kind == "plane":
        return Plane(12.0)
    at = np.arange(-30.0, 31.0)
    z = -0.25 * at + 0.01 * at[:, None] ** 2 + np.random.default_rng(0).normal(0, 0.08, (61, 61))
    return ElevationModel(at, at, z, 2.0)


def scene(cloud, terrain, built, friction=8.0, **more):
    x, y = cloud.control_volumes.centroid.T
    depth = np.where((x < -8) & (x > -18) & (abs(y) < 9) & ~built, 3.0, 0.0)
    return Scene(
        cloud, terrain, depth, 4.0 * (depth > 0), 0 * depth, Coulomb(friction), buildings=built, **more
    )


@pytest.mark.parametrize("kind", ["plane", "surface"])
@pytest.mark.parametrize("cloud", [FITTED, RAGGED], ids=["fitted", "ragged"])
def test_flow_around_buildings_keeps_volume_and_stays_out_of_them(cloud, kind):
    built = built_on(cloud)
    run = simulate(scene(cloud, bed(kind), built), [2.0, 6.0])
    assert run.failure is None
    assert abs(run.ledger.error) < 5e-16
    assert (run.depth[:, built] == 0).all()
    assert (run.max_depth[built] == 0).all()
    assert (run.max_speed[built] == 0).all()
    assert np.isnan(run.arrival_time[built]).all()
    # and goes on behind them
    x = cloud.control_volumes.centroid[:, 0]
    assert (run.max_depth[(x > 13) & ~built] > 0.1).sum() > 80


def test_earth_pressure_and_buildings_keep_volume():
    built = built_on(FITTED)
    run = simulate(scene(FITTED, bed("plane"), built, earth_pressure=MohrCoulomb(30, 8)), [4.0])
    assert abs(run.ledger.error) < 5e-16
    assert (run.max_depth[built] == 0).all()


def test_no_building_changes_no_bit():
    none = np.zeros(len(RAGGED), bool)
    for kind in ("plane", "surface"):
        start = scene(RAGGED, bed(kind), none)
        one, two = (simulate(each, [2.0]) for each in (start, replace(start, buildings=None)))
        np.testing.assert_array_equal(one.depth, two.depth)
        np.testing.assert_array_equal(one.max_speed, two.max_speed)


@pytest.mark.parametrize("kind", ["plane", "surface"])
def test_ten_steps_are_five_and_a_restart_and_five(kind):
    whole, second = with_and_without_a_restart(scene(FITTED, bed(kind), built_on(FITTED)), 30.0, 24)
    for one, two in zip(whole.state, second.state, strict=True):
        np.testing.assert_array_equal(one, two)


def test_a_lake_without_friction_between_buildings_and_walls_has_no_current():
    for cloud in (FITTED, RAGGED):
        built = built_on(cloud)
        depth = np.where(built, 0.0, 1.7)
        sides = Boundaries("wall", "wall", "wall", "wall")
        lake = Scene(cloud, Plane(0.0), depth, 0 * depth, 0 * depth, Coulomb(0.0), buildings=built)
        run = simulate(replace(lake, boundaries=sides), [5.0], stop_at_rest=False)
        # edges of a cell add up to zero but for round-off
        assert run.max_speed.max() < 1e-12
        np.testing.assert_allclose(run.depth[0], depth, atol=1e-13)


def walled(side, kind="plane", angle=25.0):
    """Give a strip whose lower end is a building, or the side of the domain, with the same cells."""
    corners = np.array([[30.0, -9.0], [40.0, -9.0], [40.0, 9.0], [30.0, 9.0]])
    cloud = graded_points((0.0, 33.0), (-4.0, 4.0), 1.0, seed=5, outlines=[corners])
    if side:
        cloud = PointCloud(cloud.points[cloud.points[:, 0] < 30], (0.0, 30.0), cloud.y)
    terrain = Plane(angle)
    if kind == "surface":
        at = np.arange(-20.0, 51.0)
        terrain = ElevationModel(at, at, np.tile(-np.tan(np.radians(angle)) * at, (71, 1)), None)
    return cloud, terrain, None if side else building_cells([corners], cloud)


def heap(cloud, terrain, built, friction=20.0, boundaries=None, **more):
    x, y = cloud.control_volumes.centroid.T
    depth = np.where((x > 22) & (x < 30), 0.5 + 0.05 * np.sin(y), 0.0)
    sides = Boundaries() if boundaries is None else boundaries
    law = Coulomb(friction)
    return Scene(cloud, terrain, depth, 0 * depth, 0 * depth, law, buildings=built, boundaries=sides, **more)


@pytest.mark.parametrize("more", [{}, {"earth_pressure": MohrCoulomb(30, 20)}])
def test_a_building_along_a_side_is_a_wall_side(more):
    found = []
    for side in (False, True):
        cloud, terrain, built = walled(side)
        sides = Boundaries("open", "wall" if side else "open", "wall", "wall")
        run = simulate(heap(cloud, terrain, built, boundaries=sides, **more), [1.5], stop_at_rest=False)
        inside = cloud.points[:, 0] < 30
        found.append(run.depth[0][inside][np.lexsort(cloud.points[inside].T)])
    np.testing.assert_allclose(found[0], found[1], atol=1e-11)
    assert found[0].max() > 0.7


@pytest.mark.parametrize("kind", ["plane", "surface"])
def test_what_leans_on_a_building_comes_to_rest(kind):
    # steeper than friction: it would slide on without the building
    cloud, terrain, built = walled(False, kind)
    start = heap(cloud, terrain, built)
    if kind == "plane":
        start = replace(start, boundaries=Boundaries("open", "open", "wall", "wall"))
    run = simulate(start, [400.0])
    assert run.failure is None
    assert np.isfinite(run.rest_time)
    assert kind == "surface" or run.ledger.outflow == 0
    x = cloud.points[:, 0]
    assert run.deposit_depth[(x > 29) & (x < 30)].min() > 0.5


@pytest.mark.parametrize("kind", ["plane", "surface"])
def test_a_heap_beside_a_building_rests_to_the_last_bit(kind):
    # a wedge in a yard, on a bed steeper than friction
    corners = np.array(
        [[20, -6], [40, -6], [40, 6], [20, 6], [20, 2.5], [30, 2.5], [30, -2.5], [20, -2.5]], float
    )
    _, terrain, _ = walled(False, kind)
    cloud = graded_points((0.0, 33.0), (-4.0, 4.0), 1.0, seed=5, outlines=[corners])
    built = building_cells([corners], cloud)
    x, y = cloud.control_volumes.centroid.T
    depth = np.where((x < 30) & (abs(y) < 2.5), 0.4 * np.maximum(0.0, x - 24), 0.0)
    start = replace(heap(cloud, terrain, built), depth=depth)
    run = simulate(start, [5.0])
    np.testing.assert_array_equal(run.depth[0], depth)
    assert run.rest_time == 0.0
    # nothing but the walls holds it
    without = simulate(replace(start, buildings=None), [1.0], stop_at_rest=False)
    assert abs(without.depth[0] - depth).max() > 0.1


def test_cells_beside_buildings_close_and_faces_keep_their_numbers():
    volumes, built = FITTED.control_volumes, built_on(FITTED)
    found, number = with_walls(volumes, built)
    length = np.concatenate([found.length, found.side_length])
    for part in found.outward.T:
        assert abs(found.around(length * part)).max() < 1e-12
    assert not built[np.concatenate([found.left, found.right, found.side_cell])].any()
    kept = np.flatnonzero(number >= 0)
    middle = np.concatenate([volumes.midpoint, volumes.side_midpoint])[kept]
    np.testing.assert_array_equal(np.concatenate([found.midpoint, found.side_midpoint])[number[kept]], middle)
    assert sorted(number[kept]) == list(range(len(length)))
    # an edge of the outline is made of walls
    there = (found.side == 4) & (abs(found.side_midpoint[:, 0] + 1.0) < 1e-9)
    assert found.side_length[there].sum() == pytest.approx(6.0, abs=1e-9)
    np.testing.assert_allclose(found.side_normal[there], np.tile([1.0, 0.0], (there.sum(), 1)), atol=1e-12)


def test_no_support_looks_through_a_wall():
    built = built_on(FITTED)
    near, alone = supports(FITTED, prepare(FITTED, buildings=built).volumes, built, 9, 1, 6.0)
    assert not alone[~built].any()
    assert not built[near[~built]].any()
    x, y = FITTED.points.T
    before, behind = (x < 11) & (abs(y) < 3), (x > 11.6) & (abs(y) < 3)
    assert not behind[near[before]].any()
    assert not before[near[behind]].any()


def test_flow_passes_an_alley_of_one_cell_and_a_yard_keeps_what_it_has():
    # points of a lattice: the cells of the alley stand on one line, which carries no slope across it
    x, y = (a.ravel() for a in np.meshgrid(np.arange(0.5, 24), np.arange(-4.5, 5)))
    cloud = PointCloud(np.stack([x, y], axis=1), (0.0, 24.0), (-5.0, 5.0))
    alley = (x > 8) & (x < 16) & (abs(y - 0.5) > 0.6)
    yard = (x == 11.5) & (y == 3.5)
    built = alley & ~yard
    depth = np.where(x < 5, 2.0, 0.0) + np.where(yard, 1.5, 0.0)
    start = Scene(cloud, Plane(10.0), depth, 0 * depth, 0 * depth, Coulomb(2.0), buildings=built)
    sides = Boundaries("wall", "open", "wall", "wall")
    run = simulate(replace(start, boundaries=sides), [8.0], stop_at_rest=False)
    assert run.failure is None
    assert abs(run.ledger.error) < 5e-16
    assert run.max_depth[x > 17].max() > 0.1
    assert run.depth[0, yard] == pytest.approx(1.5, rel=1e-14)


def test_a_section_counts_what_passes_beside_a_building():
    built = built_on(FITTED)
    gauge = Section("gauge", ((4.0, -14.9), (4.0, 14.9)))
    sides = Boundaries("open", "open", "wall", "wall")
    start = scene(FITTED, bed("plane"), built, boundaries=sides, sections=(gauge,), section_times=(0.0, 6.0))
    run = simulate(start, [6.0])
    x = FITTED.control_volumes.centroid[:, 0]
    beyond = (run.depth[0] * FITTED.cell_area)[x > 4].sum() + run.ledger.outflow
    assert run.sections.volume[0, -1] == pytest.approx(beyond, rel=0.1)


def test_what_buildings_cannot_have_is_refused():
    built = built_on(FITTED)
    start = scene(FITTED, bed("plane"), built)
    with pytest.raises(ValueError, match="no material"):
        simulate(replace(start, depth=start.depth + 1.0), [1.0])
    with pytest.raises(ValueError, match="other buildings"):
        simulate(replace(start, operators=prepare(FITTED)), [1.0])
    x = FITTED.control_volumes.centroid[:, 0]
    side = replace(start, buildings=built | (x > 19), boundaries=Boundaries(x_max=1.0))
    with pytest.raises(ValueError, match="given depth"):
        simulate(side, [1.0])
    through = Inflow("apex", ((11.3, -3.0), (11.3, 3.0)), Triangle(10.0, 5.0), froude=1.5)
    with pytest.raises(ValueError, match="section of an inflow"):
        simulate(replace(start, inflows=(through,)), [1.0])
