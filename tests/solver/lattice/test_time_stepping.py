from dataclasses import replace

import numpy as np
import pytest
from scenes import LATTICE, SCENES, rough, scene

from solver.forms import begin
from solver.kernels.record import Record
from solver.kernels.runge_kutta import (
    AT_REST,
    COLLAPSED,
    NOT_FINITE,
    OUT_OF_STEPS,
    REACHED,
    SSP_RK3,
    Progress,
)
from solver.lattice.run import LatticeRun
from solver.lattice.time_stepping import record_maxima
from solver.physics.friction import Coulomb
from solver.physics.terrain import Plane
from solver.points.cloud import random_points
from solver.points.lattice import Lattice
from solver.scene import Boundaries, Scene, WeightedResidual
from solver.simulation import simulate


def rate(u):
    return np.stack([np.sin(u[1]) - u[0] ** 2, u[0] * np.cos(u[1])])


def step(u, dt):
    result = u
    for part in SSP_RK3:
        result = u + part * (result - u + dt * rate(result))
    return result


def test_the_weights_are_those_of_equation_14():
    u, dt = np.array([0.7, -0.4]), 0.3
    one = u + dt * rate(u)
    two = 3 / 4 * u + 1 / 4 * (one + dt * rate(one))
    np.testing.assert_allclose(step(u, dt), u / 3 + 2 / 3 * (two + dt * rate(two)), rtol=1e-15)


def test_the_weights_are_of_third_order():
    def error(steps, exact=None):
        u = np.array([0.7, -0.4])
        for _ in range(steps):
            u = step(u, 2 / steps)
        return u if exact is None else np.abs(u - exact).max()

    exact = error(20_000)
    steps = np.array([10, 20, 40, 80])
    slope = np.polyfit(np.log(steps), np.log([error(n, exact) for n in steps]), 1)[0]
    assert -3.15 < slope < -2.95


@pytest.mark.parametrize("jump", [0.4, -0.4], ids=["rarefying", "compressing"])
def test_a_smooth_frictionless_flow_converges_in_time_at_nearly_third_order(jump):
    lattice = Lattice((0, 20), (0, 1), 0.5)
    ramp = np.tile(jump * np.tanh((lattice.x_points - 10) / 4), (3, 1))

    def run(cfl):
        sides = Boundaries(y_min="wall", y_max="wall")
        start = Scene(lattice, Plane(5), 2 + ramp, 1 + ramp, 0 * ramp, Coulomb(0), boundaries=sides)
        return simulate(replace(start, scheme=WeightedResidual(cfl=cfl)), [1.0]).depth[0, 1, 6:-6]

    exact, cfl = run(0.01), np.array([0.9, 0.45, 0.225])
    errors = [np.abs(run(c) - exact).max() for c in cfl]
    assert np.polyfit(np.log(cfl), np.log(errors), 1)[0] > 2.8


def every_step(case, end, arrival_depth=0.0):
    """Times and states after each step, from the first on, and the run."""
    run = LatticeRun(case, end, arrival_depth, whole=True)
    times, states = [run.time], [run.state]
    while (outcome := run.advance(end, len(times))) == OUT_OF_STEPS:
        times.append(run.time)
        states.append(run.state)
    if run.time > times[-1]:
        times.append(run.time)
        states.append(run.state)
    return np.array(times), np.stack(states), run, outcome


@pytest.mark.parametrize("name", ["frictionless", "mixed sides", "leaving the domain", "coming to rest"])
def test_the_record_is_that_of_all_steps(name):
    case, end = SCENES[name]
    times, states, run, outcome = every_step(case, end, arrival_depth=0.05)
    assert outcome == (AT_REST if name in ("leaving the domain", "coming to rest") else REACHED)
    assert len(times) == run.progress.steps[0] + 1
    result = simulate(case, [end], arrival_depth=0.05)
    assert result.steps == len(times) - 1
    h, u, v = states.transpose(1, 0, 2, 3)
    # what is dry has no speed
    square = np.where(h > case.scheme.wet_limit * case.depth.max(), u**2 + v**2, 0.0)
    np.testing.assert_array_equal(result.max_depth, h.max(axis=0))
    np.testing.assert_array_equal(result.max_speed, np.sqrt(square.max(axis=0)))
    np.testing.assert_allclose(result.max_momentum_flux, (h * square).max(axis=0), rtol=1e-15)
    reached = h > 0.05
    first = np.where(reached.any(axis=0), times[reached.argmax(axis=0)], np.nan)
    np.testing.assert_array_equal(result.arrival_time, first)
    assert np.isnan(first).any()
    assert (first == 0).any()
    assert (first > 0).any()


def test_steps_are_as_long_as_the_courant_number_allows_and_the_last_two_equal():
    case, end = SCENES["curvature"]
    times, states, *_ = every_step(case, end)
    lengths = np.diff(times)
    assert times[-1] == end
    assert lengths[-1] == pytest.approx(lengths[-2], rel=1e-12)
    h, u, v = states[3]
    wet = h > case.scheme.wet_limit * case.depth.max()
    c = np.sqrt(9.81 * np.cos(case.terrain.inclination(case.points.x_points)) * h)
    largest = ((np.abs(u) + c) / case.points.dx + (np.abs(v) + c) / case.points.dy)[wet].max()
    assert lengths[3] == pytest.approx(case.scheme.cfl / largest, rel=1e-12)


def test_a_frame_is_met_to_the_last_bit():
    case, end = SCENES["walls"]
    run = LatticeRun(case, end, 0.0, whole=True)
    for target in end * np.array([0.0, 1e-9, 1 / 3, 1 / 3 + 1e-9, 0.7, 1.0]):
        assert run.advance(target, None) == REACHED
        assert run.time == target


def test_a_time_already_reached_takes_no_step():
    run = LatticeRun(*SCENES["walls"], 0.0, whole=True)
    assert run.advance(0.0, None) == REACHED
    assert run.progress.steps[0] == run.progress.cell_stages[0] == 0


def test_cells_stepped_are_counted():
    run = LatticeRun(*SCENES["several blobs"], 0.0, whole=True)
    run.advance(1.0, 1)
    before = run.progress.cell_stages[0]
    assert before > 0
    run.advance(1.0, 2)
    stepped = (run.spans.stepped[1] - run.spans.stepped[0]).sum()
    assert run.progress.cell_stages[0] - before == 3 * stepped


def test_a_run_out_of_steps_has_taken_just_those():
    run = LatticeRun(*SCENES["walls"], 0.0, whole=True)
    assert run.advance(1.0, 4) == OUT_OF_STEPS
    assert run.progress.steps[0] == 4
    assert run.advance(1.0, 4) == OUT_OF_STEPS
    assert run.progress.steps[0] == 4


def test_a_time_step_next_to_nothing_is_a_collapse():
    case = scene(speed=(1e11, 0))
    assert LatticeRun(case, 1.0, 0.0, whole=True).advance(1.0, None) == COLLAPSED
    assert LatticeRun(case, 1e-9, 0.0, whole=True).advance(1e-12, 1) != COLLAPSED


@pytest.mark.parametrize("points", [LATTICE, random_points(*LATTICE.extent, 300, seed=1)])
def test_a_run_may_be_given_any_end(points):
    x, y = points.coordinates
    depth = np.maximum(0, 1 - ((x - 3) ** 2 + y**2) / 4)
    case = Scene(points, Plane(20), depth, 0 * depth, 0 * depth, Coulomb(15))
    assert begin(case, 1e9, 0.0, skip=True).advance(1e9, 20) == OUT_OF_STEPS


class Frozen(LatticeRun):
    """A run whose steps change nothing but, if it leaks, the ledger."""

    leaks = 0.0

    def _advance(self, target, max_steps):
        self.progress.ledger[0, 0, 1] += self.leaks * (max_steps - self.progress.steps[0])
        self.progress.steps[0] = max_steps
        return OUT_OF_STEPS


def test_a_run_that_a_thousand_steps_have_not_changed_is_at_rest():
    run = Frozen(scene(speed=(1, 0)), 1e9, 0.0)
    assert run.advance(1e9, 1500) == OUT_OF_STEPS
    # as if it had not stopped there, or at the step at which it is looked at, or been begun anew
    assert run.advance(1e9, 2000) == OUT_OF_STEPS
    again = Frozen(scene(speed=(1, 0)), 1e9, 0.0)
    again.restore({name: array.copy() for name, array in run.carried.items()})
    for each in (run, again, Frozen(scene(speed=(1, 0)), 1e9, 0.0)):
        assert [each.advance(1e9, None), each.advance(1e9, None)] == [AT_REST, AT_REST]
        assert each.progress.steps[0] == 2000


@pytest.mark.parametrize("change", ["a depth", "the ledger"])
def test_a_run_that_has_changed_is_not(change):
    run = Frozen(scene(speed=(1, 0)), 1e9, 0.0)
    assert run.advance(1e9, 1500) == OUT_OF_STEPS
    if change == "a depth":
        run.now.h[np.argmax(run.now.h)] *= 1 + 1e-8
    else:
        run.leaks = 1e-12
    assert run.advance(1e9, 2500) == OUT_OF_STEPS
    assert run.advance(1e9, 3500) == (AT_REST if change == "a depth" else OUT_OF_STEPS)


def test_a_value_that_is_not_finite_is_found_with_its_place():
    case = rough(1)
    for bad in (np.nan, np.inf):
        for k in range(3):
            run = LatticeRun(case, 1.0, 0.0, whole=True)
            i = np.argmax(run.now.h > 0.1)
            j, i = divmod(int(i), run.grid.stride)
            run.now[k][j * run.grid.stride + i] = bad
            spans = run.spans.wet.copy()
            arrays = spans, run.grid, 1e-4, 0.0, run.record, run.progress
            assert not record_maxima(run.now, *arrays)
            assert run.progress.place.tolist() == [j - 2, i - 2]


def test_the_record_kernel_is_its_twin_and_touches_nothing_outside_the_spans():
    case, dry, threshold = rough(2), 1e-3, 0.1
    run = LatticeRun(case, 1.0, 0.0, whole=True)
    rng, shape = np.random.default_rng(0), case.points.shape
    old = rng.uniform(0, 0.5, (3, *shape))
    arrival = np.where(rng.random(shape) < 0.3, 1.0, np.nan)
    record = Record(*(q.ravel().copy() for q in old), arrival.ravel().copy())
    unused = np.zeros(1, np.int64), np.zeros(1, np.int64), np.zeros(2), np.full(2, -1, np.int64)
    spans = run.spans.wet.copy()
    spans[:, 2:6], spans[1, 8] = 0, spans[0, 8] + 3
    assert record_maxima(run.now, spans, run.grid, dry, threshold, record, Progress(np.full(1, 5.0), *unused))
    columns = np.arange(shape[1]) + 2
    inside = (columns >= spans[0, 2:-2, None]) & (columns < spans[1, 2:-2, None])
    h, u, v = run.state
    square = u**2 + v**2
    new = h, np.where(h > dry, square, 0), h * square
    for actual, before, value in zip(record, old, new, strict=False):
        expected = np.where(inside, np.maximum(before, value), before)
        np.testing.assert_allclose(actual.reshape(shape), expected, rtol=1e-15)
    expected = np.where(inside & (h > threshold) & np.isnan(arrival), 5.0, arrival)
    np.testing.assert_array_equal(record.arrival.reshape(shape), expected)


def test_a_flow_too_fast_for_its_numbers_ends_as_not_finite():
    case = scene(speed=(1e160, 0))
    assert LatticeRun(case, 1e-159, 0.0, whole=True).advance(1e-159, None) == NOT_FINITE
