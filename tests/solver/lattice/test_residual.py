import dense
import numpy as np
import pytest
from scenes import SCENES, rough, scene

from solver.kernels.limiter import EMPTIED
from solver.kernels.runge_kutta import weight_of_start
from solver.kernels.state import RETAINED, Fields, Fluxes, Grid
from solver.lattice.outflow import limit_outflow, note_emptied, outflow_exceeds
from solver.lattice.residual import stage
from solver.lattice.run import LatticeRun
from solver.lattice.spans import copy_surroundings, spread
from solver.lattice.status import classify
from solver.physics.friction import Coulomb, Voellmy
from solver.physics.terrain import Plane
from solver.simulation import simulate

CASES = pytest.mark.parametrize(("case", "end"), SCENES.values(), ids=SCENES)


def assert_same(actual, expected, part=1e-12):
    """Equal to a part of the largest value."""
    np.testing.assert_allclose(actual, expected, rtol=0, atol=part * (np.nanmax(np.abs(expected)) + 1e-3))


@CASES
def test_a_run_is_that_of_the_dense_scheme(case, end):
    times = np.array([0, 0.01, 0.02, 0.5, 1]) * end
    run, (twin, frames) = simulate(case, times, arrival_depth=0.01), dense.simulate(case, times, 0.01)
    assert run.failure is None
    assert run.steps == twin.steps
    assert_same(run.depth, frames.h)
    assert_same(run.velocity_x, frames.u)
    assert_same(run.velocity_y, frames.v)
    assert_same(run.max_depth, twin.max_depth)
    assert_same(run.max_speed, twin.max_speed)
    assert_same(run.max_momentum_flux, twin.max_flux)
    assert_same(run.arrival_time, twin.arrival)
    assert run.ledger.inflow == pytest.approx(twin.ledger[:, 0].sum(), rel=1e-12)
    assert run.ledger.outflow == pytest.approx(twin.ledger[:, 1].sum(), rel=1e-12)
    assert run.rest_time == pytest.approx(twin.rest_time, rel=1e-12, nan_ok=True)


@CASES
def test_depth_stays_above_zero_and_the_ledger_closes(case, end):
    run = simulate(case, np.linspace(0, end, 6))
    assert run.depth.min() >= 0
    assert abs(run.ledger.error) <= 1e-14


def test_the_scenes_have_what_they_are_named_for():
    names = ("rough, long steps", "rough, long steps, walls", "leaving the domain", "given depth")
    long, walls, leaving, given = (dense.simulate(SCENES[name][0], [SCENES[name][1]])[0] for name in names)
    assert long.drained > 100
    assert walls.drained > 100
    assert leaving.ledger[:, 1].sum() > 0.99 * leaving.released
    assert given.ledger[:, 0].sum() > 10
    partly = dense.Run(SCENES["partly at rest"][0])
    partly.classify()
    held = partly.static[dense.INNER][partly.state.h > partly.dry] == 2
    assert 0.1 < held.mean() < 0.9


def stepped(run, spans, first, last, dt):
    """The stages of one step over given spans; copies."""
    stages = [run.now, *run.stages]
    for source, out, part in ((0, 1, 1.0), (1, 2, 1 / 4), (2, 0, 2 / 3)):
        arrays = run.arrays._replace(spans=run.spans._replace(stepped=spans))
        if source == 0:
            for other in run.stages:
                copy_surroundings(run.now, other, spans, run.grid, first, last)
        ledger = np.zeros((2, 4, 2))
        stage(arrays, stages[0], stages[source], stages[out], first, last, part, 1.0, dt, ledger)
    return run.state


@CASES
def test_skipping_changes_no_bit(case, end):
    some, everything = LatticeRun(case, end, 0.0, whole=True), LatticeRun(case, end, 0.0, whole=True)
    for steps in (0, 3, 6):
        for run in (some, everything):
            run.advance(end, steps)
            rate = classify(run.now, run.status, run.bed, run.material, run.sides, run.grid, run.spans)
        first, last, _ = spread(some.spans, some.status.static, some.sides, some.grid)
        rows, m = some.grid.rows, some.grid.stride
        spans = np.zeros((2, rows), dtype=np.int64)
        spans[:, 2:-2] = [[2], [m - 2]]
        narrow = stepped(some, some.spans.stepped, first, last, case.scheme.cfl / rate)
        wide = stepped(everything, spans, 2, rows - 3, case.scheme.cfl / rate)
        for a, b in zip(narrow, wide, strict=True):
            np.testing.assert_array_equal(a, b)
        everything.spans.wet[:] = spans


def random_fluxes(rng, shape):
    """Mass fluxes of either sign, many zero; the other fluxes follow no rule."""
    mass = rng.normal(0, 3, shape) * (rng.random(shape) < 0.7)
    return dense.Flux(mass, *rng.normal(0, 1, (3, *shape)))


def test_outflow_limits_are_their_twins_and_leave_every_cell_something():
    rng = np.random.default_rng(5)
    n, dt, grid = 200, 0.1, Grid(9, 204, 0.5, 0.25)
    h = 10.0 ** rng.uniform(-6, 1, (1, n)) * (rng.random((1, n)) < 0.9)
    x, y = random_fluxes(rng, (1, n + 1)), random_fluxes(rng, (2, n))
    # a dry cell is static, and nothing leaves it
    x.mass[0, :-1][h[0] == 0] = x.mass[0, 1:][h[0] == 0] = 0
    y.mass[:, h[0] == 0] = 0
    lost, u, v = np.zeros(2 * n + 2), *rng.normal(0, 1, (2, n))
    start, part = 10.0 ** rng.uniform(-6, 1, (1, n)) * (rng.random((1, n)) < 0.7), 2 / 3
    u_0, v_0 = rng.normal(0, 1, (2, n))
    states = Fields(start[0], u_0, v_0), Fields(h[0], u, v), weight_of_start(part)
    start[h == 0] = 0
    has = dense.in_stage(dense.State(start, u_0[None], v_0[None]), dense.State(h, u[None], v[None]), part)
    faces = x.mass[0], 0, y.mass.ravel(), 0, n
    assert outflow_exceeds(h[0], None, 0, n, *faces, dt, grid, lost, n)
    emptied = np.zeros(2 * n + 2, dtype=np.int64)
    note_emptied(h[0], start[0], weight_of_start(part), 0, 0, n, lost, n, emptied)
    wanted = dense.outflow_limits(has.h, x.mass, y.mass, dt, grid.dx, grid.dy)
    dry = np.flatnonzero(wanted[0] > EMPTIED)
    assert 10 < len(dry) < n
    assert emptied[n + 1 : n + 1 + emptied[n]].tolist() == dry.tolist()
    np.testing.assert_allclose(lost[n + dry], wanted[0, dry], rtol=1e-14)
    # the row lies at n in buffers, faces below it at 0, where no cell is short
    kernel_x = Fluxes(*(np.concatenate([np.zeros(n), q[0]]) for q in x))
    kernel_y = Fluxes(*(q.ravel().copy() for q in y))
    limit_outflow(kernel_x, kernel_y, n, 0, lost, emptied, *states, None, None, 0, 0, True)
    inner = has.u, has.v
    for actual, expected in zip(kernel_x, dense.scaled(x, wanted, *inner), strict=True):
        np.testing.assert_allclose(actual[n:], expected[0], rtol=1e-14)
    loss = dt / grid.dx * dense.out_of(dense.scaled(x, wanted, *inner).mass)
    twin_y = dense.scaled(dense.Flux(*(q.T for q in y)), wanted.T, *(q.T for q in inner[::-1]))
    loss += dt / grid.dy * dense.out_of(twin_y.mass).T
    assert (loss <= (1 - RETAINED / 2) * has.h).all()
    # what leaves the row through the faces below it; those above are limited with the next row
    down = y.mass[0] < 0
    for actual, expected in zip(kernel_y, twin_y, strict=True):
        np.testing.assert_allclose(actual[:n][down], expected.T[0][down], rtol=1e-14)
    # a next row without cells limits what goes up to it
    limit_outflow(kernel_x, kernel_y, 0, n, lost, emptied, *states, None, None, 0, 0, False)
    for actual, expected in zip(kernel_y, twin_y, strict=True):
        np.testing.assert_allclose(actual[:n][down], expected.T[0][down], rtol=1e-14)
        np.testing.assert_allclose(actual[n:][y.mass[1] > 0], expected.T[1][y.mass[1] > 0], rtol=1e-14)
    assert not outflow_exceeds(h[0], None, 0, n, *faces, 0.0, grid, lost, n)


def test_a_face_without_flow_keeps_its_impulse():
    fluxes, none = Fluxes(*np.array([[0.0, 2.0, -2.0, 0.0]] * 4)), Fluxes(*np.zeros((4, 9)))
    fluxes.normal[0] = 7.0
    # the first cell and the third, each between two faces, would lose twice what they have
    lost, emptied = np.array([2.0, 0.0, 2.0]), np.array([2, 0, 2])
    state = Fields(np.ones(4), np.full(4, 3.0), np.zeros(4))
    limit_outflow(fluxes, none, 0, 0, lost, emptied, state, state, 0.0, None, None, 0, 0, True)
    assert fluxes.normal.tolist() == pytest.approx([7.0, 3.0, -3.0, 0.0])
    assert fluxes.pressure.tolist() == [0.0, 2.0, -2.0, 0.0]


@pytest.mark.parametrize("friction", [Coulomb(25), Voellmy(25, 30.0)])
@pytest.mark.parametrize("part", [1.0, 1 / 4, 2 / 3])
def test_a_stage_is_its_twin_for_every_weight(part, friction):
    start, middle = rough(7, friction=friction), rough(8)
    run, twin = LatticeRun(start, 1.0, 0.0, whole=True), dense.Run(start)
    source, wet = dense.Run(middle).state, dense.Run(middle).state.h > twin.dry
    source = dense.State(source.h, *(np.where(wet, q, 0.0) for q in source[1:]))
    inside = Fields(*(np.pad(q, 2).ravel() for q in source))
    arrays = run.status, run.bed, run.material, run.sides, run.grid
    run.spans.wet[:, 2:-2] = [[2], [run.grid.stride - 2]]
    classify(run.now, *arrays, run.spans)
    twin.classify()
    spans, dt, ledger = run.spans.wet.copy(), 0.02, np.zeros((2, 4, 2))
    spans[:, 2:-2] = [[2], [run.grid.stride - 2]]
    out = run.stages[0]
    given = run.arrays._replace(spans=run.spans._replace(stepped=spans))
    stage(given, run.now, inside, out, 2, run.grid.rows - 3, part, 0.3, dt, ledger)
    expected = twin.stage(source, part, 0.3, dt)
    for actual, wanted in zip(out, expected, strict=True):
        assert_same(actual.reshape(run.grid.rows, -1)[dense.INNER], wanted)
    np.testing.assert_allclose(ledger.sum(axis=(0, 1)), twin.ledger.sum(axis=0), rtol=1e-12, atol=1e-15)


def test_friction_brakes_along_the_motion_and_stops_exactly():
    case = scene(Plane(0), Coulomb(40), heaps=(((6, 0), 1e3, 0.5),), speed=(1, -0.5))
    middle = np.s_[5:-5, 8:-8]
    # the fastest stop after 1.23 / (g tan 40) = 0.15 s
    run = simulate(case, [0.05, 0.3])
    u, v = run.velocity_x[0][middle], run.velocity_y[0][middle]
    assert u.min() > 0.3
    np.testing.assert_allclose(v / u, -0.5, atol=0.05)
    assert not run.velocity_x[1][middle].any()
    assert not run.velocity_y[1][middle].any()
