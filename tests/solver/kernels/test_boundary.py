import math
from dataclasses import replace

import dense
import numpy as np
import pytest
from scenes import all_sides

from solver.forms import begin
from solver.kernels.boundary import account, along_at_depth
from solver.kernels.state import DEPTH, GHOSTS, NO_SLIP, OPEN, WALL, Fields, Fluxes, Grid, Sides
from solver.lattice.ghosts import fill_ghosts
from solver.lattice.residual import restrict_side
from solver.physics.earth_pressure import Isotropic
from solver.physics.friction import Coulomb
from solver.physics.terrain import Plane
from solver.points.cloud import PointCloud, random_points
from solver.points.lattice import Lattice
from solver.scene import Boundaries, Scene
from solver.simulation import simulate

KINDS = {"open": OPEN, "wall": WALL, "no-slip": NO_SLIP}
SIDES = [("open", "wall", "no-slip", 0.7), (0.2, "open", "wall", "no-slip"), ("no-slip", 0.4, 0.3, "open")]
SIDES.append(("wall", "no-slip", "open", "wall"))


def numbered(sides, lean=(0.0, 0.0)):
    given = [0.0 if isinstance(side, str) else side for side in sides]
    return Sides(
        np.array([KINDS.get(side, DEPTH) for side in sides]),
        np.array(given),
        np.array([*lean, 0.0, 0.0]),
        *np.full((4, 4), np.inf),
    )


def full(rows, columns):
    """Spans of all cells of padded rows."""
    spans = np.zeros((2, rows), dtype=np.int64)
    spans[:, GHOSTS:-GHOSTS] = [[GHOSTS], [columns - GHOSTS]]
    return spans


@pytest.mark.parametrize("sides", SIDES)
@pytest.mark.parametrize("shape", [(2, 2), (5, 9)])
@pytest.mark.parametrize("lean", [(0.0, 0.0), (0.4, 0.3), (-0.2, -0.1)])
def test_ghosts_are_their_twin(sides, shape, lean):
    state = dense.State(*np.abs(np.random.default_rng(0).normal(size=(3, *shape))))
    rows, m = shape[0] + 2 * GHOSTS, shape[1] + 2 * GHOSTS
    flat = Fields(*(np.pad(q, GHOSTS, constant_values=np.nan).ravel() for q in state))
    beta_x, beta_y, grid = np.full(rows * m, 4.0), np.full(rows * m, 9.0), Grid(rows, m, 2.0, 1.0)
    fill_ghosts(flat, beta_x, beta_y, numbered(sides, lean), grid, full(rows, m), GHOSTS, rows - GHOSTS - 1)
    rises = -lean[0] / 2, lean[1] / 2
    for actual, expected in zip(flat, dense.padded(state, sides, rises, (4.0, 4.0, 9.0, 9.0)), strict=True):
        # nothing reads the corners
        for part in (np.s_[:, GHOSTS:-GHOSTS], np.s_[GHOSTS:-GHOSTS]):
            np.testing.assert_array_equal(actual.reshape(rows, m)[part], expected[part])


def test_ghosts_of_some_rows_are_filled_with_those_a_stage_reads():
    h, u, v = np.random.default_rng(0).normal(size=(3, 9, 6))
    state = dense.State(np.abs(h), u, v)
    sides = ("wall", "open", "no-slip", 0.5)
    expected = dense.padded(state, sides)
    for first, last in ((2, 3), (5, 7), (9, 10)):
        flat = Fields(*(np.pad(q, 2, constant_values=np.nan).ravel() for q in state))
        grid = Grid(13, 10, 1.0, 1.0)
        fill_ghosts(flat, np.ones(130), np.ones(130), numbered(sides), grid, full(13, 10), first, last)
        for actual, wanted in zip(flat, expected, strict=True):
            read = np.s_[first - 2 : last + 3, 2:-2], np.s_[first : last + 1, :]
            for part in read:
                np.testing.assert_array_equal(actual.reshape(13, 10)[part], wanted[part])


@pytest.mark.parametrize("side", ["open", "wall", "no-slip", 0.7])
@pytest.mark.parametrize("outward", [-1, 1])
def test_what_boundary_faces_carry_is_its_twin(side, outward):
    rng = np.random.default_rng(1)
    n = 50
    flux = Fluxes(*rng.normal(size=(4, n)))
    h, u, v, beta = np.abs(rng.normal(size=(4, n))) * [[1], [1], [-1], [9]]
    columns = dense.Flux(*(np.stack([q, q], axis=1) for q in flux))
    cells = [np.stack([q, q], axis=1) for q in (h, u, v, beta)]
    expected = dense.bounded(columns, *cells, side, side)
    restrict_side(flux, 0, h, u, v, beta, 0, n, KINDS.get(side, DEPTH), float(outward))
    for actual, wanted in zip(flux, expected, strict=True):
        np.testing.assert_allclose(actual, wanted[:, 0 if outward < 0 else -1], rtol=1e-14)
    if side == "open":
        assert (outward * flux.mass >= 0).all()
        assert (flux.mass != 0).any()


def test_the_ledger_adds_what_leaves_and_what_comes_in():
    ledger = np.zeros((2, 4, 2))
    for volume in (2.0, -3.0, 0.0, 4.0):
        account(volume, 1, ledger)
    assert ledger.tolist() == [[[0, 0], [3, 6], [0, 0], [0, 0]], 4 * [[0, 0]]]


def test_the_ledger_is_right_to_round_off_however_many_volumes_it_adds():
    # in steady flow each is rounded alike
    volumes = np.full(100_000, 0.1)
    ledger, plain = np.zeros((2, 4, 2)), 0.0
    for volume in volumes:
        account(volume, 0, ledger)
        plain += volume
    exact = math.fsum(volumes)
    assert abs(plain - exact) > 100 * np.spacing(exact)
    assert abs(ledger.sum(axis=0)[0, 1] - exact) <= np.spacing(exact)


def thrown(side, turn, flat=0.3):
    """A wet lattice on flat ground with a jet, all of it turned; the side it is thrown at is given."""
    lattice = Lattice((0, 7), (0, 7), 0.5)
    x, y = np.meshgrid(lattice.x_points, lattice.y_points)
    depth = flat + np.exp(-((x - 1.5) ** 2) - (y - 3) ** 2)
    u, v = -2 * depth * (x < 4), 0.7 * depth
    sides = {"x_min": side, "x_max": "wall", "y_min": "open", "y_max": "no-slip"}
    if turn in ("y_min", "y_max"):
        depth, u, v = depth.T, v.T, u.T
        sides = {{"x": "y", "y": "x"}[name[0]] + name[1:]: kind for name, kind in sides.items()}
    if turn in ("x_max", "y_max"):
        axis = 1 if turn == "x_max" else 0
        depth, u, v = np.flip(depth, axis), np.flip(u, axis), np.flip(v, axis)
        u, v = (-u, v) if axis else (u, -v)
        low, high = turn[0] + "_min", turn[0] + "_max"
        sides[low], sides[high] = sides[high], sides[low]
    return Scene(lattice, Plane(0), depth, u, v, Coulomb(5), boundaries=Boundaries(**sides))


def turned_back(run, turn):
    h, u, v = run.depth, run.velocity_x, run.velocity_y
    if turn in ("x_max", "y_max"):
        axis = 2 if turn == "x_max" else 1
        h, u, v = np.flip(h, axis), np.flip(u, axis), np.flip(v, axis)
        u, v = (-u, v) if axis == 2 else (u, -v)
    if turn in ("y_min", "y_max"):
        h, u, v = h.transpose(0, 2, 1), v.transpose(0, 2, 1), u.transpose(0, 2, 1)
    return h, u, v


@pytest.mark.parametrize("turn", ["x_max", "y_min", "y_max"])
@pytest.mark.parametrize("side", ["open", "wall", "no-slip", 0.7])
def test_each_side_does_what_the_first_does(side, turn):
    here, there = simulate(thrown(side, "x_min"), [0.5, 2.0]), simulate(thrown(side, turn), [0.5, 2.0])
    assert here.steps == there.steps
    for a, b in zip(turned_back(here, "x_min"), turned_back(there, turn), strict=True):
        np.testing.assert_allclose(a, b, rtol=0, atol=1e-12)
    assert here.ledger.outflow == pytest.approx(there.ledger.outflow, rel=1e-12)
    assert here.ledger.inflow == pytest.approx(there.ledger.inflow, rel=1e-12)


def test_nothing_passes_a_wall():
    for side in ("wall", "no-slip"):
        ledger = simulate(replace(thrown("wall", "x_min"), boundaries=all_sides(side)), [3.0]).ledger
        assert ledger.inflow == ledger.outflow == 0
        assert ledger.now == pytest.approx(ledger.released, rel=1e-14)


def test_a_wall_is_the_axis_of_a_flow_and_its_mirror_image():
    half = thrown("wall", "x_min")
    double = replace(
        half,
        points=Lattice((-7.5, 7), (0, 7), 0.5),
        depth=np.hstack([half.depth[:, ::-1], half.depth]),
        velocity_x=np.hstack([-half.velocity_x[:, ::-1], half.velocity_x]),
        velocity_y=np.hstack([half.velocity_y[:, ::-1], half.velocity_y]),
        boundaries=replace(half.boundaries, x_min="wall"),
    )
    here, there = simulate(half, [1.0, 2.0]), simulate(double, [1.0, 2.0])
    np.testing.assert_allclose(here.depth, there.depth[:, :, 15:], rtol=0, atol=1e-13)
    np.testing.assert_allclose(here.velocity_x, there.velocity_x[:, :, 15:], rtol=0, atol=1e-12)


def test_no_slip_takes_momentum_that_a_wall_leaves():
    lattice = Lattice((0, 20), (0, 4), 0.5)
    h, u, v = np.ones(lattice.shape), np.full(lattice.shape, 2.0), np.zeros(lattice.shape)
    kinds = {side: Boundaries(x_max="open", y_min=side, y_max="wall") for side in ("wall", "no-slip")}
    wall, no_slip = (
        simulate(Scene(lattice, Plane(0), h, u, v, Coulomb(0), boundaries=kind), [0.5]).velocity_x[-1, :, 20]
        for kind in kinds.values()
    )
    np.testing.assert_allclose(wall, 2.0, rtol=1e-14)
    assert (no_slip <= 2 + 1e-14).all()
    assert no_slip[0] < 1


@pytest.mark.parametrize(("angle", "bed_friction"), [(35.0, 20.0), (25.0, 20.0), (25.0, 24.0), (19.0, 20.0)])
@pytest.mark.parametrize("side", ["wall", "no-slip"])
def test_what_slides_against_a_wall_comes_to_rest_there(angle, bed_friction, side):
    lattice = Lattice((0.0, 12.0), (0.0, 4.0), 0.5)
    depth = np.where((lattice.x_points > 2) & (lattice.x_points < 6), 0.5, 0.0) * np.ones(lattice.shape)
    still = np.zeros(lattice.shape)
    sides = Boundaries("open", side, "wall", "wall")
    scene = Scene(lattice, Plane(angle), depth, still, still, Coulomb(bed_friction), boundaries=sides)
    run = simulate(scene, [60.0])
    assert run.rest_time < 60
    assert abs(run.ledger.error) < 1e-14
    # as deep toward the wall as the part of gravity that friction leaves asks for
    if angle > bed_friction:
        deposit = run.depth[-1][4]
        assert deposit[-1] > deposit[-3] > deposit[-5]


@pytest.mark.parametrize("layout", ["lattice", "cloud"])
def test_a_wall_does_not_throw_back_what_gravity_presses_against_it(layout):
    """A film of 1 mm in cells of 10 m: a step is as long as a fall by a spacing."""
    lattice = Lattice((5, 55), (5, 25), 10.0)
    x, y = (a.ravel() for a in np.meshgrid(lattice.x_points, lattice.y_points))
    cloud = PointCloud(np.stack([x, y], axis=1), (0, 60), (0, 30))
    points = lattice if layout == "lattice" else cloud
    film = np.full(points.shape, 1e-3)
    case = Scene(points, Plane(23.05), film, 0 * film, 0 * film, Coulomb(3.0), Isotropic())
    run = begin(replace(case, boundaries=Boundaries(x_max="wall")), 80.0, 0.0, True)
    uphill = []
    for k in range(40):
        run.advance(80.0, k + 1)
        h, u, _ = run.state
        uphill.append(float(u[h > run.material.dry].min(initial=0.0)))
    assert run.state[0].max() > 3e-3
    # HLL between the layer and its image throws it back at some m/s
    assert min(uphill) > -0.05


@pytest.mark.parametrize("layout", ["lattice", "cloud"])
def test_a_given_depth_does_not_feed_what_it_sends_in(layout):
    """Depth 1 beside a dry floor that is open on all other sides: once 17 m/s on this cloud after 200 s."""
    lattice, cloud = Lattice((0, 5), (0, 4), 0.5), random_points((0, 5), (0, 4), 80, 1)
    points = lattice if layout == "lattice" else cloud
    dry = np.zeros(points.shape)
    case = Scene(points, Plane(0), dry, dry, dry, Coulomb(0), boundaries=Boundaries(y_min=1.0))
    run = simulate(case, [10.0, 40.0, 100.0])
    fastest = [float(np.hypot(u, v).max()) for u, v in zip(run.velocity_x, run.velocity_y, strict=True)]
    # it comes in as fast as its waves
    assert max(fastest) < 1.3 * np.sqrt(9.81)
    assert fastest[2] <= fastest[1] * (1 + 1e-3)


def test_a_layer_beyond_a_given_depth_goes_along_it_no_faster_than_its_waves_or_than_it_is_driven():
    waves = np.sqrt(9.81 * 0.2)
    assert [along_at_depth(t, 0.2, 9.81, 3.0, 0.0) for t in (5.0, 2.0, -1.0, -2.0)] == [
        3.0,
        2.0,
        -1.0,
        -waves,
    ]
    assert [along_at_depth(t, 0.2, 9.81, 0.0, 0.0) for t in (5.0, -5.0)] == [waves, -waves]


@pytest.mark.parametrize("across", ["wall", 0.2])
@pytest.mark.parametrize("layout", ["lattice", "cloud"])
def test_an_even_layer_goes_on_beyond_given_depths_as_gravity_and_friction_drive_it(layout, across):
    lattice, cloud = Lattice((0, 5), (0, 4), 0.5), random_points((0, 5), (0, 4), 80, 1)
    points = lattice if layout == "lattice" else cloud
    depth = np.full(points.shape, 0.2)
    sides = Boundaries(0.2, "open", across, across)
    case = Scene(points, Plane(30), depth, 0 * depth + 2.5, 0 * depth, Coulomb(20), boundaries=sides)
    run = simulate(case, [2.0])
    pull = 9.81 * (np.sin(np.radians(30)) - np.tan(np.radians(20)) * np.cos(np.radians(30)))
    np.testing.assert_allclose(run.depth[-1], 0.2, rtol=1e-12)
    np.testing.assert_allclose(run.velocity_x[-1], 2.5 + 2 * pull, rtol=1e-12)
