"""Inflows and sections on clouds over surfaces: shares, frames, ledgers, restarts, rest, what lies above."""

from dataclasses import replace

import numpy as np
import pytest
from checkpoints import assert_carried_alike, with_and_without_a_restart

import solver
from solver.forms import begin
from solver.inflow.clouds import frame_of_bounds
from solver.inflow.conditions import Inflow, Section
from solver.inflow.entrance import check_on_cloud, entrance
from solver.kernels.sections.inflow import fill_section
from solver.physics.earth_pressure import MohrCoulombFlow
from solver.physics.erosion import ErodibleBed, GrowthRate
from solver.points.cloud import PointCloud, given_points, random_points
from solver.points.on_surface import area_on_bed
from solver.scene import WeightedResidual
from solver.verification.inflow_cases import voellmy
from solver.verification.surfaces import Inclined

RISE = solver.Hydrograph(np.array([0.0, 5.0, 20.0]), np.array([0.0, 10.0, 0.0]))
LATE = solver.Hydrograph(np.array([30.0, 31.0, 40.0]), np.array([0.0, 5.0, 0.0]))
VOELLMY = voellmy(0.1, 300)
CLOUD = random_points((0, 40), (-10, 10), 800, 4)
IN_VALLEY = random_points((0, 78), (0, 78), 1521, 5)


def valley(*, gaps=False):
    """A channel of V shape along y = 39 that falls by 15 degrees along x, or one with gaps on a bank."""
    x = np.arange(40) * 2.0
    z = 100 - np.tan(np.radians(15)) * x + 0.2 * np.abs(x - x.mean())[:, None]
    if gaps:
        z[x > 41, 5:15] = np.nan
    return solver.ElevationModel(x, x, z, 20.0)


def down_valley(**changes):
    flat = np.zeros(IN_VALLEY.shape)
    scene = solver.Scene(
        IN_VALLEY,
        valley(),
        flat,
        flat,
        flat,
        VOELLMY,
        inflows=(Inflow("top", ((10, 33), (10, 45)), RISE, "normal"),),
        sections=(Section("below", ((50, 20), (50, 58))), Section("oblique", ((40, 60), (60, 18)))),
        section_times=np.arange(0, 41.0),
    )
    return replace(scene, **changes)


def on_plane(bed, points=CLOUD, **changes):
    """Two inflows, one at a side and one inside, and a measured section below them."""
    flat = np.zeros(points.shape)
    scene = solver.Scene(
        points,
        bed,
        flat,
        flat,
        flat,
        VOELLMY,
        inflows=(
            Inflow("side", ((0, -3.2), (0, 3.2)), RISE, froude=1.2),
            Inflow("inside", ((10.4, 1.2), (10.4, 8.1)), RISE, froude=0.7),
        ),
        sections=(Section("below", ((30.1, -10), (30.1, 10))),),
        section_times=np.arange(0, 21.0),
    )
    return replace(scene, **changes)


@pytest.mark.parametrize("discharge", [0.01, 1.0, 10.0, 300.0])
@pytest.mark.parametrize("condition", [{"depth": "normal"}, {"froude": 1.5}, {"speed": 3.0}, {"depth": 1.2}])
def test_a_discharge_has_a_level_surface_over_a_valley(condition, discharge):
    scene = down_valley(inflows=(Inflow("top", ((10, 33), (10, 45)), RISE, **condition),))
    run = begin(scene, 10.0, 0.0, True)
    made = entrance(scene.inflows[0], scene.points, scene.terrain, VOELLMY, scene.gravity)
    fill_section(run.inflows, 0, discharge)
    # the kernels have the faces in the order of their cells
    order = np.lexsort((made.placed.face, made.placed.downstream))
    depth = run.inflows.depth
    assert run.inflows.mass.sum() == pytest.approx(discharge, rel=1e-13)
    assert depth == pytest.approx(made.depths(discharge)[order], rel=1e-9, abs=1e-9)
    assert run.inflows.speed == pytest.approx(made.speeds(discharge)[order], rel=1e-6, abs=1e-9)
    wet = depth > 0
    level = run.inflows.bottom[wet] + depth[wet] / made.slant
    assert level == pytest.approx(level[0], abs=1e-9)
    assert depth[~wet].sum() == 0
    middle = scene.points.points[run.inflows.cell, 1]
    assert abs(middle[depth.argmax()] - 39) < 2


def test_what_is_known_of_the_section_is_that_of_the_ground():
    scene = down_valley()
    placed = entrance(scene.inflows[0], IN_VALLEY, scene.terrain, VOELLMY, scene.gravity).placed
    fall = np.radians(15)
    assert placed.along == pytest.approx(9.81 * np.sin(fall), rel=1e-9)
    assert placed.normal == pytest.approx(9.81 * np.cos(fall), rel=1e-9)
    points = IN_VALLEY.points[placed.downstream]
    # a line across the valley, but for the half cell that its ends reach farther
    wanted = 100 - np.tan(fall) * 10 + 0.2 * np.abs(points[:, 1].clip(33, 45) - 39)
    assert np.abs(placed.bottom - wanted).max() < 0.3
    assert placed.bottom.min() == pytest.approx(100 - np.tan(fall) * 10, abs=0.25)


def test_on_level_ground_it_is_the_cloud_of_a_profile():
    one, two = (
        solver.simulate(on_plane(bed), [10.0, 20.0]) for bed in (solver.Plane(0.0), Inclined(0.0, 0.0))
    )
    assert one.steps == two.steps > 50
    assert one.depth.max() > 0.5
    np.testing.assert_allclose(one.depth, two.depth, atol=1e-13)
    np.testing.assert_allclose(one.velocity_x, two.velocity_x, atol=1e-11)
    np.testing.assert_allclose(one.sections.volume, two.sections.volume, atol=1e-11)


def test_on_a_plane_it_is_nearly_the_cloud_of_a_profile():
    """Cells of a lattice have the same faces on both. Gradients are fitted in plan, where they are narrow."""
    slope = 15.0
    short = np.cos(np.radians(slope))
    x, y = np.meshgrid(np.arange(0.5, 40), np.arange(-9.5, 10))
    points = np.stack([x.ravel(), y.ravel()], axis=1)
    along = given_points(points, (0, 40), (-10, 10))
    plan = given_points(points * [short, 1], (0, 40 * short), (-10, 10))
    order = [
        int(np.hypot(along.points[:, 0] * short - p, along.points[:, 1] - q).argmin()) for p, q in plan.points
    ]
    profile = on_plane(solver.Plane(slope), along)
    above = on_plane(Inclined(0.0, slope), plan)
    above = replace(
        above,
        **{
            name: tuple(
                replace(each, line=tuple((short * a, b) for a, b in each.line))
                for each in getattr(above, name)
            )
            for name in ("inflows", "sections")
        },
    )
    one, two = (solver.simulate(scene, [5.0, 10.0, 20.0]) for scene in (profile, above))
    pairs = [
        (one.depth, two.depth),
        (one.depth * one.velocity_x, two.depth * two.velocity_x),
        (one.depth * one.velocity_y, two.depth * two.velocity_y),
    ]
    for here, there in pairs:
        apart = np.abs(here[:, order] - there)
        # a cell of the front that gets wet a step earlier is off by up to 8e-3 of the largest value, at some
        # times; when the front has passed all are to 7e-5, and to 1.4e-4 in what goes across
        assert apart[-1].max() < 2e-4 * np.abs(here).max()
        assert np.linalg.norm(apart) < 2e-3 * np.linalg.norm(here)
        assert apart.sum() < 1e-3 * np.abs(here).sum()
    # 7e-6
    assert two.sections.volume[0, -1] == pytest.approx(one.sections.volume[0, -1], rel=2e-5)


def test_frames_do_not_matter_to_what_comes_in():
    """The first axis of a cell is that of its fall in one scene, and the second one in the other."""
    noise = 0.05 * np.random.default_rng(2).normal(size=(26, 46))
    x, y = np.arange(-2, 44.0), np.arange(-12, 14.0)
    z = 50 - 0.3 * x - 0.1 * y[:, None] + noise
    models = solver.ElevationModel(x, y, z), solver.ElevationModel(y, x, z.T)
    turned = PointCloud(CLOUD.points[:, ::-1], CLOUD.y, CLOUD.x)
    here = on_plane(models[0], inflows=(Inflow("inside", ((8, -5), (13, 6)), RISE, froude=0.8),), sections=())
    there = replace(
        on_plane(models[1], turned, sections=()),
        inflows=tuple(replace(each, line=tuple((b, a) for a, b in each.line)) for each in here.inflows),
    )
    one, two = (begin(scene, 40.0, 0.0, True) for scene in (here, there))
    # the length of a step depends on the axes, so that steps are shorter than that
    for steps in range(1, 101):
        one.advance(0.02 * steps, None)
        two.advance(0.02 * steps, None)
        assert one.progress.steps[0] == two.progress.steps[0] == steps
    assert one.state[0].max() > 0.2
    np.testing.assert_allclose(two.state[0], one.state[0], atol=1e-9)
    # as vectors, since the axes are not each other's images
    one_way, two_way = (in_space(run, scene) for run, scene in ((one, here), (two, there)))
    np.testing.assert_allclose(two_way[:, [1, 0, 2]], one_way, atol=1e-7)


def in_space(run, scene):
    """Momentum per area of the cells, (n, 3), m2 s-1."""
    from solver.physics.elevation import tangents
    from solver.points.on_surface import mean_slopes

    h, u, v = run.state
    e_1, e_2 = tangents(*mean_slopes(scene.terrain, scene.points.control_volumes))
    return (h * (u * e_1 + v * e_2)).T


@pytest.mark.parametrize("cfl", [0.9, 0.37])
def test_in_a_valley_volumes_are_exact_and_sections_agree_with_what_lies_below_them(cfl):
    scene = down_valley(scheme=WeightedResidual(cfl=cfl))
    result = solver.simulate(scene, [0, 12.3, 40], arrival_depth=0.01)
    assert result.failure is None
    assert result.ledger.inflow == pytest.approx(100, rel=1e-13)
    assert abs(result.ledger.error) < 1e-13
    area = area_on_bed(scene.terrain, IN_VALLEY)
    below = IN_VALLEY.points[:, 0] > 50
    held = float((result.depth[-1] * area)[below].sum())
    left = result.ledger.outflow
    assert result.sections.volume[0, -1] == pytest.approx(held + left, rel=1e-9)
    assert result.sections.volume[0, -1] > 50
    assert result.sections.volume[1, -1] == pytest.approx(result.sections.volume[0, -1], rel=0.05)
    assert (np.diff(result.sections.volume[0]) > -1e-9).all()
    peak, time = result.sections.peak
    assert 0 < peak[0] < 10
    assert time[0] > 5
    assert result.sections.arrival[0] > 1


def test_what_has_come_in_is_the_hydrograph_at_any_step():
    scene = down_valley()
    run = begin(scene, 40.0, 0.0, True)
    for steps in range(2, 60):
        run.advance(40.0, steps)
        assert run.progress.steps[0] == steps
        assert run.come_in == pytest.approx(RISE.volume_until(run.time), rel=1e-13)
        # nothing has come to the sides yet
        assert run.volume == pytest.approx(run.come_in, rel=1e-13)
    assert run.time > 3


def test_what_lies_above_a_section_does_not_push_thin_cells_below_it_where_nothing_comes_in():
    x, y = IN_VALLEY.points.T
    film = np.zeros(IN_VALLEY.shape)
    # high up on one bank, held by friction
    film[(x < 10) & (y > 12) & (y < 24)] = 1.0
    film[(x > 10) & (x < 14) & (y > 14) & (y < 22)] = 2e-3
    section = Inflow("wide", ((10, 10), (10, 68)), RISE, froude=1.0)
    scene = down_valley(depth=film, friction=solver.Coulomb(40), inflows=(section,))
    made = begin(scene, 1.0, 0.0, True)
    # faces of the section with the layer above them and the film below
    between = film[made.doors.above] * film[made.inflows.cell] > 0
    assert between.sum() > 2
    run = solver.simulate(scene, [1.0])
    above = y < 24
    assert np.hypot(run.velocity_x[0], run.velocity_y[0])[above].max() < 1.0
    assert run.depth[0][~above].max() > 0.1
    assert abs(run.ledger.error) < 1e-13


LOOSE = ErodibleBed(np.full(IN_VALLEY.shape, 0.05), GrowthRate(0.02))


@pytest.mark.parametrize(
    "scene",
    [
        pytest.param(down_valley(), id="valley"),
        pytest.param(down_valley(erodible_bed=LOOSE), id="erosion"),
        pytest.param(
            down_valley(
                friction=solver.Coulomb(10),
                earth_pressure=MohrCoulombFlow(30, 10),
                inflows=(Inflow("top", ((10, 33), (10, 45)), RISE, froude=1.0),),
            ),
            id="flow axes",
            marks=pytest.mark.slow,
        ),
        pytest.param(on_plane(Inclined(30.0, 15.0)), id="plane"),
    ],
)
def test_a_restart_changes_nothing(scene):
    whole, second = with_and_without_a_restart(scene, 40.0, 80)
    assert whole.come_in > 0
    assert_carried_alike(whole, second)


def test_what_comes_in_takes_up_its_bed():
    result = solver.simulate(down_valley(erodible_bed=LOOSE), [0, 30])
    assert result.ledger.entrained > 0.01 * result.ledger.inflow
    assert result.ledger.entrained == pytest.approx(result.ledger.eroded, rel=1e-12)
    assert abs(result.ledger.error) < 1e-13


def test_a_run_waits_for_its_inflow_and_then_comes_to_rest():
    section = Inflow("inside", ((10, -6), (10, 6)), LATE, froude=1.0)
    result = solver.simulate(
        on_plane(Inclined(0.0, 5.0), friction=solver.Coulomb(20), inflows=(section,), sections=()),
        [0, 20, 60],
    )
    assert not result.depth[1].any()
    assert 40 < result.rest_time < 60
    volume = float(LATE.volumes[-1])
    assert result.ledger.now + result.ledger.outflow == pytest.approx(volume, rel=1e-12)
    # nothing moves before, and one step goes there
    assert result.steps < 400


def test_what_flows_down_through_a_section_adds_to_what_comes_in():
    x, y = IN_VALLEY.points.T
    heap = np.where(np.hypot(x - 5, y - 39) < 4, 0.8, 0.0)
    scene = down_valley(depth=heap)
    result = solver.simulate(scene, [0, 40])
    area = area_on_bed(scene.terrain, IN_VALLEY)
    released = float(heap @ area)
    assert abs(result.ledger.error) < 1e-13
    assert result.ledger.now + result.ledger.outflow == pytest.approx(100 + released, rel=1e-12)
    # what lay above has gone by
    assert float((result.depth[-1] * area)[x < 8].sum()) < 2e-2 * released


def test_nothing_comes_into_cells_without_data():
    section = Inflow("wide", ((12, 30), (12, 50)), RISE, froude=1.0)
    scene = down_valley(terrain=valley(gaps=True), inflows=(section,))
    placed = entrance(section, IN_VALLEY, scene.terrain, VOELLMY, scene.gravity).placed
    everywhere = entrance(section, IN_VALLEY, valley(), VOELLMY, scene.gravity).placed
    assert 0 < len(placed.face) < len(everywhere.face)
    assert not scene.terrain.gaps_at(*IN_VALLEY.control_volumes.centroid[placed.downstream].T).any()
    result = solver.simulate(scene, [0, 20])
    assert result.ledger.inflow == pytest.approx(100, rel=1e-13)
    assert abs(result.ledger.error) < 1e-13
    lost = Inflow("lost", ((16, 46), (16, 60)), RISE, froude=1.0)
    with pytest.raises(ValueError, match="found one that nothing comes in from"):
        entrance(lost, IN_VALLEY, scene.terrain, VOELLMY, scene.gravity)
    # before the points are placed too
    frame = frame_of_bounds(IN_VALLEY.x, IN_VALLEY.y, 2.0, 2.0)
    with pytest.raises(ValueError, match="found one that nothing comes in from"):
        check_on_cloud(lost, frame, scene.terrain, VOELLMY, scene.gravity)
    check_on_cloud(section, frame, scene.terrain, VOELLMY, scene.gravity)


@pytest.mark.parametrize(("line", "way"), [(((10, -2), (10, 2)), (1, 0)), (((10, 2), (10, -2)), (-1, 0))])
def test_on_level_ground_flow_goes_to_the_right_hand(line, way):
    x = np.arange(-12, 46.0, 2.0)
    level = solver.ElevationModel(x, x, np.full((len(x), len(x)), 1234.567))
    placed = entrance(Inflow("level", line, RISE, froude=1.0), CLOUD, level, VOELLMY, 9.81).placed
    assert placed.direction == pytest.approx(way)
    assert placed.along == 0.0


def test_at_a_side_flow_goes_inward_though_the_bed_rises():
    section = Inflow("side", ((40, -6), (40, 6)), RISE, froude=2.0)
    made = entrance(section, CLOUD, Inclined(0.0, 10.0), VOELLMY, 9.81)
    assert made.placed.direction == pytest.approx((-1, 0))
    assert made.placed.along == pytest.approx(-9.81 * np.sin(np.radians(10)), rel=1e-9)
    result = solver.simulate(on_plane(Inclined(0.0, 10.0), inflows=(section,), sections=()), [0, 5, 30])
    assert result.depth[1][CLOUD.points[:, 0] > 35].max() > 0.1
    assert result.ledger.inflow == pytest.approx(100, rel=1e-13)
    assert abs(result.ledger.error) < 1e-13


def test_a_dry_cell_below_a_face_that_nothing_comes_in_through_stays_dry_to_the_last_bit():
    x, y = IN_VALLEY.points.T
    heap = np.where(np.hypot(x - 14, y - 50) < 8, 1.5, 0.0)
    section = Inflow("wide", ((10, 10), (10, 68)), RISE, froude=1.0)
    scene = down_valley(depth=heap, friction=solver.Coulomb(5.0), inflows=(section,))
    run = begin(scene, 20.0, 0.0, True)
    for steps in range(1, 100):
        run.advance(20.0, steps)
        assert run.state[0].min() >= 0.0
    assert run.come_in > 10
