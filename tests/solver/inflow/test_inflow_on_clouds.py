"""Runs on clouds with inflows and sections: shares, ledgers, restarts, rest, images."""

from dataclasses import replace

import numpy as np
import pytest
from checkpoints import assert_carried_alike, with_and_without_a_restart

import solver
from solver.forms import begin
from solver.inflow.entrance import entrance
from solver.kernels.sections.inflow import fill_section
from solver.kernels.state import LANES
from solver.physics.earth_pressure import MohrCoulombFlow
from solver.physics.erosion import ErodibleBed, GrowthRate
from solver.points.cloud import PointCloud, random_points
from solver.verification.inflow_cases import fed, scattered, voellmy

RISE = solver.Hydrograph(np.array([0.0, 5.0, 20.0]), np.array([0.0, 10.0, 0.0]))
LATE = solver.Hydrograph(np.array([30.0, 31.0, 40.0]), np.array([0.0, 5.0, 0.0]))
VOELLMY = voellmy(0.1, 300)
FED = scattered(fed(15, VOELLMY, 0, length=40, hydrograph=RISE, depth="normal"), 0)


def wide(points, **changes):
    """A slope of 40 by 20 m with two inflows, one of them oblique, and a measured section."""
    flat = np.zeros(points.shape)
    scene = solver.Scene(
        points,
        solver.Plane(15),
        flat,
        flat,
        flat,
        VOELLMY,
        inflows=(
            solver.Inflow("top", ((0, -3.2), (0, 3.2)), RISE, "normal"),
            solver.Inflow("oblique", ((10, 3), (14, 8)), RISE, froude=1.5),
        ),
        sections=(solver.Section("below", ((30, -10), (30, 10))),),
        section_times=np.arange(0, 41.0),
    )
    return replace(scene, **changes)


CLOUD = random_points((0, 40), (-10, 10), 800, 4)


@pytest.mark.parametrize("discharge", [0.01, 1.0, 300.0])
def test_a_discharge_is_shared_by_the_width_of_faces(discharge):
    scene = wide(CLOUD)
    run = begin(scene, 10.0, 0.0, True)
    for k, each in enumerate(run.entrances):
        fill_section(run.inflows, k, discharge)
        here = run.inflows.section == k
        assert run.inflows.mass[here].sum() == pytest.approx(discharge, rel=1e-13)
        made = entrance(scene.inflows[k], CLOUD, scene.terrain, VOELLMY, scene.gravity)
        assert each.placed.width.sum() == pytest.approx(made.placed.width.sum())
        assert run.inflows.depth[here] == pytest.approx(np.sort(made.depths(discharge))[0], rel=1e-9)


@pytest.mark.parametrize("cfl", [0.9, 0.37])
def test_volumes_are_exact_and_sections_agree_with_what_lies_below_them(cfl):
    walls = solver.Boundaries(y_min="wall", y_max="wall")
    scene = wide(CLOUD, scheme=solver.WeightedResidual(cfl=cfl), boundaries=walls)
    result = solver.simulate(scene, [0, 40], arrival_depth=0.01)
    assert result.failure is None
    assert result.ledger.inflow == pytest.approx(200, rel=1e-13)
    assert abs(result.ledger.error) < 1e-13
    left = result.ledger.outflow
    below = CLOUD.points[:, 0] > 30
    held = float((result.depth[-1] * CLOUD.cell_area)[below].sum())
    assert result.sections.volume[0, -1] == pytest.approx(held + left, rel=1e-9)
    assert (np.diff(result.sections.volume[0]) > -1e-9).all()
    assert result.sections.arrival[0] > 1


def test_what_flows_down_through_a_section_adds_to_what_comes_in():
    at = np.hypot(CLOUD.points[:, 0] - 4, CLOUD.points[:, 1]) < 3
    scene = wide(CLOUD, inflows=(solver.Inflow("inside", ((10, -3), (10, 3)), RISE, "normal"),))
    scene = replace(scene, depth=np.where(at, 0.8, 0.0))
    result = solver.simulate(scene, [0, 40])
    released = float(scene.depth @ CLOUD.cell_area)
    assert abs(result.ledger.error) < 1e-13
    assert result.ledger.now + result.ledger.outflow == pytest.approx(100 + released, rel=1e-12)
    # what lay above has gone by
    assert (result.depth[-1] @ (CLOUD.cell_area * (CLOUD.points[:, 0] < 9))) < 1e-2 * released


@pytest.mark.parametrize(
    "scene",
    [
        pytest.param(FED, id="fed"),
        pytest.param(wide(CLOUD), id="two"),
        pytest.param(
            wide(
                CLOUD,
                friction=solver.Coulomb(10),
                earth_pressure=MohrCoulombFlow(30, 10),
                inflows=(solver.Inflow("top", ((0, -3.2), (0, 3.2)), RISE, froude=1.0),),
            ),
            id="earth pressure",
            marks=pytest.mark.slow,
        ),
        pytest.param(
            wide(CLOUD, erodible_bed=ErodibleBed(np.full(CLOUD.shape, 0.05), GrowthRate(0.02))), id="erosion"
        ),
    ],
)
def test_a_restart_changes_nothing(scene):
    whole, second = with_and_without_a_restart(scene, 40.0, 80)
    assert whole.come_in > 0
    assert_carried_alike(whole, second)


def test_what_comes_in_takes_up_its_bed():
    scene = wide(CLOUD, erodible_bed=ErodibleBed(np.full(CLOUD.shape, 0.05), GrowthRate(0.02)))
    result = solver.simulate(scene, [0, 30])
    assert result.ledger.entrained > 0.01 * result.ledger.inflow
    assert result.ledger.entrained == pytest.approx(result.ledger.eroded, rel=1e-12)
    assert abs(result.ledger.error) < 1e-13


def test_a_run_waits_for_its_inflow_and_then_comes_to_rest():
    scene = scattered(fed(5, solver.Coulomb(20), 0, length=40, hydrograph=LATE, froude=1.0), 0)
    result = solver.simulate(scene, [0, 20, 60])
    assert not result.depth[1].any()
    assert 40 < result.rest_time < 60
    volume = float(scene.inflows[0].hydrograph.volumes[-1])
    assert result.ledger.now + result.ledger.outflow == pytest.approx(volume, rel=1e-12)
    # next to nothing slips back through the open side once nothing comes in
    assert result.ledger.outflow < 1e-5 * volume
    # nothing moves before, and one step goes there
    assert result.steps < 400


def test_mirrored_scenes_stay_mirrored_to_round_off():
    scene = wide(CLOUD)
    image = PointCloud(CLOUD.points * [1, -1], CLOUD.x, CLOUD.y)
    lines = [tuple((x, -y) for x, y in reversed(each.line)) for each in scene.inflows]
    turned = tuple(replace(each, line=line) for each, line in zip(scene.inflows, lines, strict=True))
    here, there = (begin(s, 40.0, 0.0, True) for s in (scene, wide(image, inflows=turned)))
    here.advance(40.0, 20)
    there.advance(40.0, 20)
    assert there.state[0] == pytest.approx(here.state[0], abs=1e-11)
    assert there.state[2] == pytest.approx(-here.state[2], abs=1e-9)
    assert here.state[0].max() > 0.05


def test_a_scene_without_sections_is_stepped_as_it_was():
    """What is measured changes nothing, nor does an inflow that has not begun."""
    at = np.hypot(CLOUD.points[:, 0] - 12, CLOUD.points[:, 1]) < 5
    bare = wide(CLOUD, inflows=(), sections=(), depth=np.where(at, 0.8, 0.0))
    measured = wide(CLOUD, inflows=(), depth=bare.depth)
    results = [solver.simulate(scene, [0, 5]) for scene in (bare, measured)]
    assert np.array_equal(results[0].depth, results[1].depth)
    assert results[1].sections.volume[0, 5] > 0


def test_after_an_inflow_what_is_not_stepped_stays_in_all_stages():
    """Deposits below a section would be seen by moving cells beside them as they never were."""
    short = solver.Hydrograph(np.array([0.0, 0.2, 0.4]), np.array([0.0, 2.0, 0.0]))
    x, y = CLOUD.points.T
    depth = np.where(np.hypot(x - 22, y) < 3, 0.8, 0.0)
    scene = wide(
        CLOUD,
        friction=solver.Coulomb(25),
        depth=depth,
        velocity_x=np.where(depth > 0, 6.0, 0.0),
        inflows=(solver.Inflow("inside", ((5, -3), (5, 3)), short, froude=1.0),),
    )
    run = begin(scene, 10.0, 0.0, True)
    run.advance(2.0, None)
    cells = np.unique(run.inflows.cell)
    assert run.state[0][cells].max() > 0.02
    stepped = run.activity.stepped
    assert stepped.any()
    assert not stepped[cells // LANES].any()
    for stage in run.stages:
        for field, now in zip(stage, run.now, strict=True):
            assert np.array_equal(field[: run.count], now[: run.count])
