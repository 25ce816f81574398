"""Runs with inflows and sections: kernels against NumPy, restarts, rest, elevation models, ledgers."""

from dataclasses import replace

import numpy as np
import pytest
from checkpoints import assert_carried_alike, with_and_without_a_restart

import solver
from solver.forms import begin
from solver.inflow.entrance import entrance
from solver.kernels.sections.inflow import fill_section, inflow_depth
from solver.physics.erosion import ErodibleBed, GrowthRate
from solver.verification.inflow_cases import fed, voellmy

RISE = solver.Hydrograph(np.array([0.0, 5.0, 20.0]), np.array([0.0, 10.0, 0.0]))
VOELLMY = voellmy(0.1, 300)


def valley(steepness=0.2, spacing=2.0, cells=40):
    """A channel of V shape that falls by 15 degrees along x."""
    x = np.arange(cells) * spacing
    z = 100 - np.tan(np.radians(15)) * x + steepness * np.abs(x - x.mean())[:, None]
    return solver.ElevationModel(x, x, z, 20.0)


def down_valley(**changes):
    model = valley()
    lattice = solver.Lattice((0, 78), (0, 78), 2)
    flat = np.zeros(lattice.shape)
    scene = solver.Scene(
        lattice,
        model,
        flat,
        flat,
        flat,
        VOELLMY,
        inflows=(solver.Inflow("top", ((10, 33), (10, 45)), RISE, "normal"),),
        sections=(
            solver.Section("below", ((50, 20), (50, 58))),
            solver.Section("oblique", ((40, 60), (60, 18))),
        ),
        section_times=np.arange(0, 41.0),
    )
    return replace(scene, **changes)


@pytest.mark.parametrize("discharge", [0.01, 1.0, 10.0, 300.0])
@pytest.mark.parametrize("condition", [{"depth": "normal"}, {"froude": 1.5}, {"speed": 3.0}, {"depth": 1.2}])
def test_kernels_share_a_discharge_as_numpy_does(condition, discharge):
    scene = down_valley(inflows=(solver.Inflow("top", ((10, 33), (10, 45)), RISE, **condition),))
    run = begin(scene, 10.0, 0.0, True)
    made = entrance(scene.inflows[0], scene.points, scene.terrain, VOELLMY, scene.gravity)
    fill_section(run.inflows, 0, discharge)
    assert run.inflows.mass.sum() == pytest.approx(discharge, rel=1e-13)
    assert run.inflows.depth == pytest.approx(made.depths(discharge), rel=1e-9, abs=1e-9)
    assert run.inflows.speed == pytest.approx(made.speeds(discharge), rel=1e-6, abs=1e-9)
    # the bed is deepest in the middle, and the surface is level there
    assert run.inflows.depth.argmax() in (2, 3)


def test_slow_inflow_meets_the_invariant_from_inside():
    beta, q = 9.0, 4.0
    depth = inflow_depth(q, 1.0, 2.0, beta)
    assert q / depth - 2 * np.sqrt(beta * depth) == pytest.approx(1.0 - 2 * np.sqrt(2 * beta), rel=1e-12)
    # on to a dry bed it is critical
    assert inflow_depth(q, 0.0, 0.0, beta) == pytest.approx((q**2 / beta) ** (1 / 3), rel=1e-12)
    # a thin cell that deep flow runs through is no deep reservoir
    assert inflow_depth(1e-3, -100.0, 0.1, beta) < 20


def test_what_lies_above_a_section_does_not_push_thin_cells_below_it_where_nothing_comes_in():
    layer, film = down_valley(), np.zeros((40, 40))
    x, y = layer.points.coordinates
    # high up on one bank, held by friction
    film[(x < 10) & (y > 12) & (y < 24)] = 1.0
    film[(x > 10) & (x < 13) & (y > 14) & (y < 22)] = 2e-3
    section = solver.Inflow("wide", ((10, 10), (10, 68)), RISE, froude=1.0)
    run = solver.simulate(replace(layer, depth=film, friction=solver.Coulomb(40), inflows=(section,)), [1.0])
    above = y < 24
    assert np.hypot(run.velocity_x[0], run.velocity_y[0])[above].max() < 1.0
    assert run.depth[0][~above].max() > 0.1


@pytest.mark.parametrize(
    "scene", [down_valley(), fed(15, VOELLMY, 0, length=40, hydrograph=RISE, depth="normal")]
)
def test_a_restart_changes_nothing(scene):
    whole, second = with_and_without_a_restart(scene, 40.0, 80)
    assert_carried_alike(whole, second)


def test_in_a_valley_volumes_are_exact_and_sections_agree_with_what_lies_below_them():
    scene = down_valley()
    result = solver.simulate(scene, [0, 40], arrival_depth=0.01)
    assert result.failure is None
    assert result.ledger.inflow == pytest.approx(100, rel=1e-13)
    assert abs(result.ledger.error) < 1e-13
    corners = scene.terrain.corners(np.arange(-1, 80, 2.0), np.arange(-1, 80, 2.0))
    from solver.physics.elevation import lifted_area

    area = lifted_area(corners, 2.0)
    held = (result.depth[-1] * area)[:, :25].sum()
    # the first section lies between the cells 24 and 25
    assert result.sections.volume[0, -1] == pytest.approx(100 - held, rel=1e-9)
    assert (np.diff(result.sections.volume[0]) > -1e-9).all()
    assert result.sections.discharge[0].sum() == pytest.approx(result.sections.volume[0, -1], rel=1e-12)
    peak, time = result.sections.peak
    assert 0 < peak[0] < 10
    assert time[0] > 5
    assert result.sections.arrival[0] > 1


def test_a_plane_as_an_elevation_model_takes_what_a_profile_does():
    """Both are fed across their whole width; the plane of the elevation model is 15 degrees steep."""
    x, spacing = np.arange(60) * 2.0, 2.0
    model = solver.ElevationModel(x, x[:20], np.broadcast_to(-np.tan(np.radians(15)) * x, (20, 60)), 20.0)
    lattice = solver.Lattice((0, 118), (0, 38), spacing)
    flat = np.zeros(lattice.shape)
    graph = solver.Hydrograph(np.array([0.0, 100.0]), np.full(2, 3.0 * 36))
    section = ((10.0, 1.0), (10.0, 37.0))
    scene = solver.Scene(
        lattice, model, flat, flat, flat, VOELLMY, inflows=(solver.Inflow("top", section, graph, "normal"),)
    )
    depth = solver.simulate(scene, [0, 30]).depth[-1][10]
    uniform = entrance(scene.inflows[0], lattice, model, VOELLMY, scene.gravity).depths(3.0 * 36)[0]
    assert depth[8:15] == pytest.approx(uniform, rel=1e-3)


def test_a_run_waits_for_its_inflow_and_then_comes_to_rest():
    late = solver.Hydrograph(np.array([30.0, 31.0, 40.0]), np.array([0.0, 5.0, 0.0]))
    scene = fed(5, solver.Coulomb(20), 0, length=40, hydrograph=late, froude=1.0)
    result = solver.simulate(scene, [0, 20, 60])
    assert not result.depth[1].any()
    assert 40 < result.rest_time < 60
    assert result.ledger.now == pytest.approx(late.volumes[-1], rel=1e-12)
    # nothing moves before, and one step goes there
    assert result.steps < 400


def test_mirrored_scenes_stay_mirrored_to_the_last_bit():
    scene = fed(15, VOELLMY, 4, end=8, depth="normal")
    lattice = solver.Lattice((0, 40), (-8, 8), 1)
    flat = np.zeros(lattice.shape)
    wide = replace(
        scene,
        points=lattice,
        depth=flat,
        velocity_x=flat,
        velocity_y=flat,
        inflows=(solver.Inflow("top", ((6, -3.2), (6, 3.2)), RISE, "normal"),),
        sections=(),
    )
    result = solver.simulate(wide, [0, 8])
    assert np.array_equal(result.depth, result.depth[:, ::-1])
    assert np.array_equal(result.velocity_y, -result.velocity_y[:, ::-1])


def among_houses_on_loose_bed(scene, place):
    """Put a building of some cells, and loose bed all around."""
    buildings = np.zeros(scene.points.shape, bool)
    buildings[place] = True
    loose = ErodibleBed(np.full(scene.points.shape, 0.05), GrowthRate(0.02))
    return replace(scene, buildings=buildings, erodible_bed=loose)


IN_THE_VALLEY = among_houses_on_loose_bed(down_valley(), np.s_[19:22, 14:17])
ON_A_SLOPE = among_houses_on_loose_bed(
    fed(15, VOELLMY, 0, length=40, hydrograph=RISE, depth="normal"), np.s_[1:3, 20:24]
)


@pytest.mark.parametrize("scene", [IN_THE_VALLEY, ON_A_SLOPE])
def test_what_comes_in_flows_around_buildings_and_takes_up_its_bed(scene):
    result = solver.simulate(scene, [0, 30], arrival_depth=0.01)
    assert result.failure is None
    assert result.ledger.inflow == pytest.approx(RISE.volume_until(30.0), rel=1e-13)
    assert result.ledger.entrained > 0.01 * result.ledger.inflow
    assert result.ledger.entrained == pytest.approx(result.ledger.eroded, rel=1e-12)
    assert abs(result.ledger.error) < 1e-13
    assert not result.max_depth[scene.buildings].any()
    bare = solver.simulate(replace(scene, buildings=None), [0, 30], arrival_depth=0.01)
    assert bare.max_depth[scene.buildings].max() > 0.05


@pytest.mark.parametrize("scene", [IN_THE_VALLEY, ON_A_SLOPE])
def test_a_restart_among_buildings_on_loose_bed_changes_nothing(scene):
    whole, second = with_and_without_a_restart(scene, 40.0, 80)
    assert {"inflows.entered", "erosion.eroded"} <= whole.carried.keys()
    assert_carried_alike(whole, second)


def test_no_building_stands_at_an_inflow():
    scene = among_houses_on_loose_bed(down_valley(), np.s_[19:22, 3:5])
    with pytest.raises(ValueError, match="no building can stand at the section of an inflow"):
        solver.simulate(scene, [0, 1])


def test_collocation_refuses_inflows_and_sections():
    scene = fed(15, VOELLMY, 4, depth="normal")
    scene = replace(scene, scheme=solver.Collocation(support=9, degree=1))
    with pytest.raises(ValueError, match="weighted-residual form"):
        solver.simulate(scene, [0, 1])


def test_nothing_comes_into_the_outermost_cells_of_an_elevation_model():
    """A slope falls to the west; the line ends in the second column, and goes on to its far side."""
    x = np.arange(20) * 2.0
    model = solver.ElevationModel(x, x, np.broadcast_to(0.5 * x, (20, 20)), 20.0)
    lattice = solver.Lattice((4, 34), (4, 34), 2)
    flat = np.zeros(lattice.shape)
    inflow = solver.Inflow("oblique", ((5.5, 8), (9.5, 28)), RISE, froude=1.0)
    scene = solver.Scene(lattice, model, flat, flat, flat, solver.Coulomb(20), inflows=(inflow,))
    _, column = entrance(inflow, lattice, model, scene.friction, scene.gravity).placed.downstream
    assert column.min() == 1
    result = solver.simulate(scene, [0, 20])
    assert result.ledger.inflow == pytest.approx(100, rel=1e-13)
    assert abs(result.ledger.error) < 1e-13
