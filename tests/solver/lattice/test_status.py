from dataclasses import replace

import dense
import numpy as np
import pytest
from scenes import MIXED, SCENES, all_sides, rough, scene

from solver.kernels.state import BELOW_YIELD, DRY, LANES, Fields
from solver.lattice.run import LatticeRun
from solver.lattice.spans import copy_surroundings, hull, moving_volume_exceeds, spread
from solver.lattice.status import classify
from solver.physics.earth_pressure import MohrCoulomb
from solver.physics.friction import Coulomb, Voellmy
from solver.physics.terrain import Plane
from solver.scene import Boundaries
from solver.simulation import simulate

PRESSURE = MohrCoulomb(40, 15)
CASES = {name: case for name, (case, _) in SCENES.items()} | {
    "jumps": rough(4, earth_pressure=PRESSURE),
    "jumps, walls": rough(5, earth_pressure=PRESSURE, boundaries=all_sides("no-slip")),
    "jumps, mixed": rough(6, earth_pressure=PRESSURE, boundaries=MIXED),
    "nothing": replace(rough(1), depth=np.zeros_like(rough(1).depth)),
}


def classified(case):
    run = LatticeRun(case, 1.0, 0.0, whole=True)
    return run, classify(run.now, run.status, run.bed, run.material, run.sides, run.grid, run.spans)


@pytest.mark.parametrize("case", CASES.values(), ids=CASES)
def test_earth_pressure_status_and_wave_rate_are_their_twin(case):
    run, rate = classified(case)
    twin = dense.Run(case)
    assert rate == pytest.approx(twin.classify()[0], rel=1e-14)
    shape = run.grid.rows, run.grid.stride
    # of the ghosts those beside cells matter
    for part in (np.s_[1:-1, 2:-2], np.s_[2:-2, 1:-1]):
        for name in ("beta_x", "beta_y", "static"):
            actual, wanted = getattr(run.status, name).reshape(shape)[part], getattr(twin, name)[part]
            np.testing.assert_allclose(actual, wanted, rtol=1e-15)


@pytest.mark.parametrize("case", CASES.values(), ids=CASES)
def test_spans_are_the_hulls_of_wet_and_moving_cells_and_of_their_neighbours(case):
    run, _ = classified(case)
    twin = dense.Run(case)
    twin.classify()
    wet, moving = np.zeros((2, run.grid.rows, run.grid.stride), dtype=bool)
    wet[dense.INNER] = twin.state.h > twin.dry
    moving[dense.INNER] = twin.static[dense.INNER] == 0

    def covered(spans):
        columns = np.arange(run.grid.stride)
        return (columns >= spans[0][:, None]) & (columns < spans[1][:, None])

    def filled(cells):
        return np.logical_or.accumulate(cells, 1) & np.logical_or.accumulate(cells[:, ::-1], 1)[:, ::-1]

    np.testing.assert_array_equal(covered(run.spans.wet), filled(wet))
    np.testing.assert_array_equal(covered(run.spans.moving), filled(moving))
    moving = filled(moving)
    # a ghost driven by a given depth moves too
    moving |= np.pad(twin.static[1:-1, 1:-1] == 0, 1) & ~filled(np.pad(np.ones_like(twin.state.h, bool), 2))
    around = moving.copy()
    for shift, axis in ((1, 0), (-1, 0), (1, 1), (-1, 1)):
        around |= np.roll(moving, shift, axis)
    around[:2] = around[-2:] = around[:, :2] = around[:, -2:] = False
    first, last, cells = spread(run.spans, run.status.static, run.sides, run.grid)
    stepped, widths = covered(run.spans.stepped), filled(around).sum(axis=1)
    assert (stepped >= filled(around)).all()
    assert not np.concatenate([stepped[:2], stepped[-2:]]).any()
    assert not np.concatenate([stepped[:, :2], stepped[:, -2:]], axis=1).any()
    # in whole vectors where the domain is wide enough
    np.testing.assert_array_equal(
        stepped.sum(axis=1), np.minimum(-(-widths // LANES) * LANES, run.grid.stride - 4)
    )
    assert cells == stepped.sum()
    rows = np.flatnonzero(around.any(axis=1))
    assert (first, last) == (rows[0], rows[-1]) if len(rows) else first > last
    assert (covered(run.spans.wet) >= filled(wet)).all()
    assert (
        covered(run.spans.wet)[around.any(axis=1)] >= covered(run.spans.stepped)[around.any(axis=1)]
    ).all()


def test_hull_covers_spans_and_ignores_empty_ones():
    spans = np.array([[0, 5, 3, 9, 0], [0, 8, 3, 12, 0]])
    assert hull(spans, 0, 4) == (5, 12)
    assert hull(spans, 1, 2) == (5, 8)
    assert hull(spans, -3, 9) == (5, 12)
    assert hull(spans, 2, 2) == hull(spans, 4, 9) == (0, 0)


def test_moving_volume_counts_what_is_not_static():
    for case, _ in SCENES.values():
        run, _ = classified(case)
        twin = dense.Run(case)
        _, volume = twin.classify()
        arrays = run.now, run.status.static, run.spans, run.sides, run.grid
        moves = bool(((run.now.u != 0) | (run.now.v != 0)).any())
        if np.isfinite(volume):
            assert volume > 0
            assert moving_volume_exceeds(*arrays, volume * (1 - 1e-12), False)
            assert not moving_volume_exceeds(*arrays, volume * (1 + 1e-12), False)
            # what a step has left at rest stays there
            assert moving_volume_exceeds(*arrays, volume * (1 - 1e-12), True) == moves
        else:
            assert moving_volume_exceeds(*arrays, 1e300, True)


def test_a_stage_reads_no_cell_that_was_not_copied():
    """What a stage reads is within two cells of what it steps."""
    run, _ = classified(SCENES["several blobs"][0])
    first, last, _ = spread(run.spans, run.status.static, run.sides, run.grid)
    shape = run.grid.rows, run.grid.stride
    target = Fields(*(np.full(shape[0] * shape[1], np.nan) for _ in range(3)))
    copy_surroundings(run.now, target, run.spans.stepped, run.grid, first, last)
    stepped = np.zeros(shape, dtype=bool)
    for j, (a, b) in enumerate(run.spans.stepped.T):
        stepped[j, a:b] = True
    near = stepped.copy()
    for shift in (-2, -1, 1, 2):
        near |= np.roll(stepped, shift, 0) | np.roll(stepped, shift, 1)
    for source, copied in zip(run.now, target, strict=True):
        source, copied = source.reshape(shape), copied.reshape(shape)
        np.testing.assert_array_equal(copied[near & ~stepped], source[near & ~stepped])
        assert np.isnan(copied[stepped]).all()


def test_a_spike_one_cell_wide_does_not_hold():
    case = scene(Plane(0), Coulomb(30), heaps=(((6, 0), 100, 0.5),))
    flat = replace(case, depth=np.full_like(case.depth, 0.5))
    assert simulate(flat, [1.0]).rest_time == 0
    flat.depth[8, 12] = 2.0
    assert simulate(flat, [1.0]).steps > 0


def test_a_dry_neighbour_makes_no_velocity_gradient():
    case = scene(Plane(0), heaps=(((6, 0), 2.2, 1.0),), speed=(0, 0), earth_pressure=PRESSURE)
    pressure = PRESSURE.coefficients()
    at_rest = (pressure.x_active + pressure.x_passive) / 2
    for u in (3.0, -3.0):
        run, _ = classified(replace(case, velocity_x=np.full_like(case.depth, u)))
        assert set(np.unique(run.status.beta_x / 9.81).round(12)) == {round(at_rest, 12)}


@pytest.mark.parametrize("depth", [0.0, 1e-6])
def test_a_given_depth_that_is_dry_does_not_keep_a_run_from_rest(depth):
    case = scene(Plane(25), Coulomb(20), heaps=(((3, 0), 2, 0.5),), boundaries=all_sides(depth))
    sloping = replace(case, terrain=Plane(25), friction=Coulomb(40))
    assert simulate(sloping, [20.0]).rest_time < 20
    empty = replace(case, depth=np.zeros_like(case.depth))
    if depth == 0:
        run = simulate(empty, [1.0])
        assert run.rest_time == 0


def test_a_film_at_an_open_side_does_not_keep_a_run_from_rest():
    def film(column):
        depth = np.zeros((17, 25))
        depth[5:12, 3:8] = 0.2
        depth[8, column] = 1e-4
        speed = np.where(np.arange(25) == column, 1.0, 0.0) * (depth > 0)
        case = scene(Plane(0), Coulomb(40))
        return simulate(replace(case, depth=depth, velocity_x=speed), [5.0])

    inside, beside = film(15), film(24)
    assert inside.rest_time == beside.rest_time == 0


def test_a_given_depth_fills_a_dry_domain():
    case = scene(
        Plane(0), Coulomb(0), heaps=(((6, 0), 2, 0.0),), boundaries=Boundaries(0.5, "wall", "wall", "wall")
    )
    run = simulate(case, [60.0])
    assert run.depth[-1].min() > 0.4
    assert run.ledger.inflow > 0.4 * 12.5 * 8.5
    assert abs(run.ledger.error) < 1e-12


def test_a_film_beside_a_layer_that_friction_holds_stays():
    """What presses on the face between them stands, for the most part, in the layer."""
    case = scene(Plane(0), Voellmy(40.0, 70.0, 30.0, 2000.0))
    depth = np.zeros_like(case.depth)
    depth[6:9, 5:20] = 0.05
    depth[9, 8:10] = 1e-4, 2e-5
    run, _ = classified(replace(case, depth=depth))
    static = run.status.static.reshape(run.grid.rows, run.grid.stride)[dense.INNER]
    np.testing.assert_array_equal(static, np.where(depth > 0, BELOW_YIELD, DRY))


@pytest.mark.parametrize(
    ("beside", "speed", "left"),
    [(0.3, 1.0, 1.0), (0.3, 5.0, 3.0), (0.0, 1.0, 0.0), (5e-5, 1.0, 0.0)],
    ids=["as it is", "faster than the flow", "nothing beside it", "films beside it"],
)
def test_a_film_moves_as_fast_as_a_deeper_cell_beside_it_at_most(beside, speed, left):
    case = scene(Plane(0), Coulomb(0), heaps=(((10, 3), 1, 1.0),))
    depth = np.zeros_like(case.depth)
    depth[3, 3] = 1.0
    run = LatticeRun(replace(case, depth=depth), 1.0, 0.0, whole=True)
    h, u, v = (q.reshape(run.grid.rows, run.grid.stride)[dense.INNER] for q in run.now)
    h[8, 10], h[8, 11] = 6e-5, beside
    u[8, 10], v[8, 10] = -0.6 * speed, 0.8 * speed
    u[8, 11] = 3.0 * (beside > 0)
    run.spans.wet[:, 2:-2] = [[2], [run.grid.stride - 2]]
    classify(run.now, run.status, run.bed, run.material, run.sides, run.grid, run.spans)
    assert (u[8, 10], v[8, 10]) == pytest.approx((-0.6 * left, 0.8 * left), rel=1e-14)
    static = run.status.static.reshape(run.grid.rows, run.grid.stride)[dense.INNER]
    assert static[8, 10] == (0.0 if left else DRY)
    # and so it is once more
    classify(run.now, run.status, run.bed, run.material, run.sides, run.grid, run.spans)
    assert (u[8, 10], v[8, 10]) == pytest.approx((-0.6 * left, 0.8 * left), rel=1e-14)


def test_a_film_beside_a_heap_at_rest_stops():
    case = scene(Plane(0), Coulomb(40), heaps=(((6, 0), 3, 0.5),))
    run = LatticeRun(case, 1.0, 0.0, whole=True)
    h, u, _ = (q.reshape(run.grid.rows, run.grid.stride)[dense.INNER] for q in run.now)
    row, column = np.argwhere((h[:, 1:] > 1e-2) & (h[:, :-1] == 0))[0]
    h[row, column], u[row, column] = 4e-5, 0.2
    run.spans.wet[:, 2:-2] = [[2], [run.grid.stride - 2]]
    classify(run.now, run.status, run.bed, run.material, run.sides, run.grid, run.spans)
    assert u[row, column] == 0.0
