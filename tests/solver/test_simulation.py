from dataclasses import replace

import numpy as np
import pytest
from scenes import MIXED, SCENES, all_sides, scene

from solver.physics.friction import Coulomb, Voellmy
from solver.physics.terrain import Plane
from solver.points.lattice import Lattice
from solver.result import Ledger
from solver.scene import Boundaries, Scene, WeightedResidual
from solver.simulation import simulate

CASE = scene()
RESTING, _ = SCENES["coming to rest"]
FIELDS = ("depth", "velocity_x", "velocity_y")
RECORDS = ("max_depth", "max_speed", "max_momentum_flux", "arrival_time", "deposit_depth")


@pytest.mark.parametrize("name", FIELDS)
@pytest.mark.parametrize(
    ("array", "message"),
    [
        (np.zeros((25, 17)), "shape"),
        (np.zeros(425), "shape"),
        (np.full((17, 25), np.nan), "finite"),
        (np.full((17, 25), np.inf), "finite"),
    ],
)
def test_an_initial_array_of_wrong_shape_or_not_finite_is_refused(name, array, message):
    with pytest.raises(ValueError, match=message):
        simulate(replace(CASE, **{name: array}), [1.0])


def test_negative_depth_is_refused():
    with pytest.raises(ValueError, match="negative"):
        simulate(replace(CASE, depth=CASE.depth - 1e-9), [1.0])


@pytest.mark.parametrize(
    "times", [[], [-1.0, 1.0], [1.0, 1.0], [2.0, 1.0], [np.nan], [0, np.nan], [1.0, np.inf], [[1.0]], 1.0]
)
def test_times_that_do_not_increase_are_refused(times):
    with pytest.raises(ValueError, match="times must be"):
        simulate(CASE, times)


@pytest.mark.parametrize("side", ["shut", -0.1, np.nan, np.inf])
def test_a_side_that_is_neither_a_kind_nor_a_depth_is_refused(side):
    with pytest.raises(ValueError, match="a side must be"):
        simulate(replace(CASE, boundaries=Boundaries(y_max=side)), [1.0])


def test_a_bed_with_lateral_slope_is_refused():
    class Tilted(Plane):
        def lateral_slope(self, x, y=0.0):
            return np.full(np.broadcast(x, y).shape, 0.1)

    with pytest.raises(ValueError, match="lateral slope"):
        simulate(replace(CASE, terrain=Tilted(20)), [1.0])


def test_frames_have_the_shape_of_times_and_lattice_and_the_first_is_the_start():
    speed = np.full_like(CASE.depth, 2.0)
    result = simulate(replace(CASE, velocity_x=speed), [0.0, 0.4])
    for name in FIELDS:
        assert getattr(result, name).shape == (2, *CASE.points.shape)
    for name in RECORDS:
        assert getattr(result, name).shape == CASE.points.shape
    assert result.time == 0.4
    assert result.times.tolist() == [0.0, 0.4]
    np.testing.assert_array_equal(result.depth[0], CASE.depth)
    # a dry cell has no velocity
    np.testing.assert_array_equal(
        result.velocity_x[0], np.where(CASE.depth > 1e-4 * CASE.depth.max(), 2.0, 0.0)
    )
    np.testing.assert_array_equal(result.deposit_depth, result.depth[-1])
    assert (result.max_depth >= result.depth.max(axis=0)).all()
    assert result.failure is None
    assert np.isnan(result.rest_time)


def test_a_run_changes_nothing_it_is_given_and_repeats_to_the_last_bit():
    copies = [getattr(CASE, name).copy() for name in FIELDS]
    first, second = simulate(CASE, [0.5]), simulate(CASE, [0.5])
    for name, copy in zip(FIELDS, copies, strict=True):
        np.testing.assert_array_equal(getattr(CASE, name), copy)
        np.testing.assert_array_equal(getattr(first, name), getattr(second, name))


def test_a_frame_at_the_start_changes_nothing():
    with_start, without = simulate(CASE, [0.0, 0.5, 1.0]), simulate(CASE, [0.5, 1.0])
    assert with_start.steps == without.steps
    np.testing.assert_array_equal(with_start.depth[1:], without.depth)


def test_a_failed_run_keeps_its_good_frames_and_says_why_and_when():
    whole = simulate(CASE, [0.1, 0.2, 1.0, 2.0])
    failed = simulate(CASE, [0.1, 0.2, 1.0, 2.0], max_steps=10)
    assert failed.failure.reason == "more steps than allowed"
    assert failed.steps == 10
    assert 0.2 < failed.failure.time < 1.0
    assert failed.failure.time == failed.time
    for name in FIELDS:
        np.testing.assert_array_equal(getattr(failed, name)[:2], getattr(whole, name)[:2])
        assert np.isnan(getattr(failed, name)[2:]).all()
    assert np.isfinite(failed.deposit_depth).all()
    assert abs(failed.ledger.error) < 1e-14


def test_a_value_that_is_not_finite_fails_the_run_at_its_place():
    failed = simulate(scene(speed=(1e160, 0)), [0.0, 1e-159])
    assert failed.failure.reason == "a value that is not finite"
    assert failed.failure.time > 0
    assert np.isfinite(failed.depth[0]).all()
    assert np.isnan(failed.depth[1]).all()
    # the heap lies around (3, 0.3)
    assert np.hypot(failed.failure.x - 3, failed.failure.y - 0.3) < 4


def test_a_collapsed_time_step_fails_the_run_where_the_fastest_waves_are():
    case = scene()
    speed = np.zeros_like(case.depth)
    speed[9, 5] = 1e11
    failed = simulate(replace(case, velocity_x=speed), [1.0])
    assert failed.failure.reason == "the time step collapsed"
    assert failed.steps == 0
    assert (failed.failure.x, failed.failure.y) == (case.points.x_points[5], case.points.y_points[9])
    np.testing.assert_array_equal(failed.deposit_depth, case.depth)


def test_later_frames_of_a_run_at_rest_hold_the_deposit():
    result = simulate(RESTING, [0.5, 2.0, 5.0, 9.0])
    assert 0.5 < result.rest_time < 2.0
    assert result.time == result.rest_time
    assert result.velocity_x[0].any()
    assert not result.velocity_x[1:].any()
    assert not result.velocity_y[1:].any()
    for later in result.depth[1:]:
        np.testing.assert_array_equal(later, result.deposit_depth)


def test_frames_are_the_same_whether_or_not_a_run_stops_at_rest():
    stopped, went_on = (simulate(RESTING, [0.5, 2.0, 9.0], stop_at_rest=stop) for stop in (True, False))
    for name in (*FIELDS, *RECORDS):
        np.testing.assert_array_equal(getattr(stopped, name), getattr(went_on, name))
    assert stopped.rest_time == went_on.rest_time == stopped.time
    assert went_on.time == 9.0
    assert stopped.steps == went_on.steps


def test_what_comes_in_and_goes_out_is_in_the_ledger():
    case = scene(Plane(15), boundaries=Boundaries(x_min=0.4), friction=Coulomb(10))
    ledger = simulate(case, [8.0]).ledger
    assert ledger.inflow > 20
    assert ledger.outflow > 20
    assert ledger.released == pytest.approx(case.depth.sum() * case.points.cell_area, rel=1e-14)
    assert abs(ledger.error) <= 1e-12
    total = ledger.released + ledger.inflow - ledger.outflow
    assert ledger.now == pytest.approx(total, rel=1e-12)


@pytest.mark.parametrize("sides", [MIXED, *map(all_sides, ("open", "wall", "no-slip", 0.2))])
def test_the_ledger_closes_for_every_kind_of_side(sides):
    case = scene(Plane(12), Voellmy(5, 80.0), boundaries=sides, speed=(3, -2))
    ledger = simulate(case, [6.0]).ledger
    assert abs(ledger.error) <= 1e-12


def test_the_error_of_a_ledger_is_relative_to_what_was_put_in():
    assert Ledger(8.0, 2.0, 1.0, 9.0).error == 0
    assert Ledger(8.0, 2.0, 1.0, 9.5).error == pytest.approx(0.05)
    assert Ledger(0.0, 0.0, 0.0, 0.0).error == 0


def test_an_empty_domain_is_at_rest():
    result = simulate(replace(CASE, depth=np.zeros_like(CASE.depth)), [1.0, 2.0])
    assert result.rest_time == 0
    assert result.steps == 0
    assert not result.depth.any()
    assert np.isnan(result.arrival_time).all()


def test_what_is_thinner_than_the_wet_limit_stays_and_is_kept():
    depth = CASE.depth.copy()
    depth[2, -3] = 5e-3
    result = simulate(replace(CASE, depth=depth, scheme=WeightedResidual(wet_limit=1e-2)), [0.1])
    assert result.depth[0, 2, -3] == 5e-3
    assert result.velocity_x[0, 2, -3] == 0
    assert abs(result.ledger.error) <= 1e-14


def test_arrival_is_counted_above_the_given_depth():
    some, more = (simulate(CASE, [1.0], arrival_depth=depth).arrival_time for depth in (0.0, 0.2))
    assert np.isnan(more).sum() > np.isnan(some).sum()
    both = ~np.isnan(more)
    assert (more[both] >= some[both]).all()
    assert (some[CASE.depth > 0] == 0).all()
    assert (more[CASE.depth > 0.2] == 0).all()


def test_lists_and_integers_make_a_scene_too():
    level = np.ones(CASE.points.shape, dtype=int)
    result = simulate(replace(CASE, depth=level.tolist(), velocity_x=level, velocity_y=0 * level), [0, 1])
    assert result.depth.dtype == np.float64
    assert result.steps > 0


def test_what_leaves_through_open_sides_is_told_from_what_leaves_through_given_depths():
    lattice = Lattice((0.0, 10.0), (0.0, 4.0), 0.5)
    still = np.zeros(lattice.shape)
    layer = still + 0.5
    for sides, is_open in (
        (Boundaries("wall", "open", "wall", "wall"), True),
        (Boundaries("wall", 0.1, "wall", "wall"), False),
    ):
        run = simulate(
            Scene(lattice, Plane(30.0), layer, still, still, Coulomb(20.0), boundaries=sides), [2.0]
        )
        assert run.ledger.outflow > 1
        assert run.ledger.outflow_open == (run.ledger.outflow if is_open else 0)
