import pickle
from dataclasses import replace

import numpy as np
import pytest
from clouds import clouds
from hypothesis import given, settings
from scenes import material

from solver.cloud.faces import beyond, connect, half_of
from solver.cloud.operators import prepare
from solver.cloud.reconstruction import find_most_slower, slopes_at, strain_at
from solver.forms import begin
from solver.kernels.earth_pressure import at_rest
from solver.kernels.state import Fields
from solver.physics.earth_pressure import Isotropic, MohrCoulomb
from solver.physics.friction import Coulomb
from solver.physics.terrain import Plane
from solver.points.cloud import given_points, graded_points, random_points
from solver.points.lattice import Lattice
from solver.points.spacing import Refinement
from solver.scene import Boundaries, Scene, WeightedResidual
from solver.simulation import simulate
from solver.verification import exact_solutions as exact

G = 9.81


def scene(cloud, state, angle=0.0, bed_friction=0.0, sides=(), **changes):
    """A scene on a plane, from means over the cells."""
    pressure = changes.pop("pressure", Isotropic())
    return Scene(
        cloud,
        Plane(angle),
        *state,
        Coulomb(bed_friction),
        pressure,
        G,
        Boundaries(*sides),
        WeightedResidual(**changes),
    )


def relative_l2(area, found, wanted):
    return np.sqrt((area * (found - wanted) ** 2).sum() / (area * wanted**2).sum())


def checked(scene, end):
    """The depth at the end of a run whose volume is exact and whose depth is nowhere negative."""
    run = simulate(scene, np.linspace(0, end, 6)[1:])
    assert run.failure is None
    assert abs(run.ledger.error) < 1e-12
    assert run.depth.min() >= 0
    return run.depth[-1]


def cap(cloud, **changes):
    """Exact case 1 at t = 5 s: relative L2 of depth."""
    solution, cells = exact.FrictionlessCap(), cloud.control_volumes
    spread = (cells.centroid**2).sum(axis=1) + cells.second_moment[:, 0] + cells.second_moment[:, 2]
    depth = solution.height * np.maximum(0, 1 - spread / solution.radius**2)
    found = checked(scene(cloud, (depth, 0 * depth, 0 * depth), solution.angle, **changes), 5.0)
    return relative_l2(cells.area, found, solution(*cells.centroid.T, 5.0)[0])


def dam_break(cloud, **changes):
    """Exact case 3 at 22 and 21 degrees, t = 5 s: relative L1 of depth."""
    solution, cells = exact.DamBreak(), cloud.control_volumes
    x = cells.centroid[:, 0]
    depth = np.where(x < 0, solution.depth, 0.0)
    sides = (solution.depth, "open", "wall", "wall")
    start = scene(cloud, (depth, 0 * x, 0 * x), solution.angle, solution.bed_friction, sides, **changes)
    wanted = solution(x, 5.0)[0]
    return (cells.area * np.abs(checked(start, 5.0) - wanted)).sum() / (cells.area * wanted).sum()


CAP, DAM = ((-150.0, 300.0), (-150.0, 150.0)), ((-60.0, 50.0), (0.0, 10.0))


def order(spacings, errors):
    return np.polyfit(np.log(spacings), np.log(errors), 1)[0]


def test_the_frictionless_cap_converges_on_random_points():
    spacings = (16, 8, 4)
    errors = [cap(random_points(*CAP, round(450 * 300 / s**2), 1)) for s in spacings]
    assert order(spacings, errors) > 1.2
    assert errors[-1] < 1.02e-2


def test_the_dam_break_converges_on_random_points():
    spacings = (2, 1, 0.5)
    errors = [dam_break(random_points(*DAM, round(1100 / s**2), 1)) for s in spacings]
    assert order(spacings, errors) > 0.9
    assert errors[-1] < 3e-3


def test_volume_is_exact_on_graded_points():
    assert cap(graded_points(*CAP, 20.0, [Refinement((-80, 150), (-60, 60), 8.0)], seed=2)) < 0.04


@pytest.mark.parametrize(
    ("angle", "bed_friction", "speed"),
    [(0, 0, (1, 0.5)), (20, 10, (2, -0.7)), (5, 30, (-1.5, 1)), (30, 30, (0.3, 2))],
)
@pytest.mark.parametrize("layer", [0.4, 0.0])
def test_on_a_lattice_a_step_is_that_of_the_lattice(layer, angle, bed_friction, speed):
    """A heap, in a moving layer or on dry ground, a step short of what the sides can reach; supports of five.

    Where neighbouring velocities are equal the limiter's choice hangs on round-off: nothing is uniform here.
    """
    lattice, end, half = Lattice((0, 12), (-6, 6), 0.5), 0.02, 0.25
    x, y = np.meshgrid(lattice.x_points, lattice.y_points)
    heap = np.maximum(0, 1 - ((x - 6) ** 2 + (y - 0.3) ** 2) / 2.2**2)
    depth = layer * (1 + 0.125 * np.sin(x - 2 * y)) + heap
    shear = 1 + 0.3 * np.sin(2 * x + y)
    arrays = depth, speed[0] * shear, speed[1] * shear
    points = np.c_[x.ravel(), y.ravel()]
    cloud = given_points(points, (-half, 12 + half), (-6 - half, 6 + half))
    order = cloud.nearest(1, points)[:, 0]
    state = tuple(array.ravel()[np.argsort(order)] for array in arrays)
    run = simulate(scene(cloud, state, angle, bed_friction, support=5), [end])
    result = simulate(Scene(lattice, Plane(angle), *arrays, Coulomb(bed_friction)), [end])
    assert run.steps == result.steps == 1
    inner = np.s_[6:-6, 6:-6]
    for name in ("depth", "velocity_x", "velocity_y"):
        found, wanted = getattr(run, name)[0], getattr(result, name)[0]
        np.testing.assert_allclose(found[order].reshape(x.shape)[inner], wanted[inner], atol=1e-13)


@pytest.mark.parametrize("kind", ["wall", "no-slip"])
def test_nothing_leaves_a_closed_box_and_no_depth_is_negative(kind):
    cloud = random_points((0, 10), (0, 8), 600, 3)
    x, y = cloud.control_volumes.centroid.T
    depth = np.where((x - 3) ** 2 + (y - 4) ** 2 < 4, 1.0, 0.0)
    state = depth, 6 + 0 * x, 4 + 0 * x
    run = simulate(scene(cloud, state, 10, 5, (kind,) * 4, pressure=MohrCoulomb(35, 5)), [0.2, 0.5, 1.0, 2.0])
    assert run.depth.min() >= 0
    assert abs(run.ledger.error) < 1e-13
    assert run.ledger.inflow == run.ledger.outflow == 0


def test_a_layer_at_rest_on_flat_ground_stays():
    cloud = random_points((0, 10), (0, 8), 400, 3)
    depth = np.full(len(cloud), 0.7)
    run = simulate(scene(cloud, (depth, 0 * depth, 0 * depth), 0, 0, ("wall",) * 4), [3.0])
    np.testing.assert_allclose(run.depth, 0.7, rtol=1e-12)
    np.testing.assert_allclose([run.velocity_x, run.velocity_y], 0, atol=1e-11)


def cone(cloud, share, angle=0.0, pressure=None):
    """A cone on a plane whose slope is a share of the friction limit where gravity helps it most."""
    x, y = cloud.control_volumes.centroid.T
    k = at_rest(material(pressure))[0] if pressure else 1.0
    slope = share * (np.tan(np.radians(30)) - np.tan(np.radians(angle))) / k
    return slope * np.maximum(0, 3.2 - np.hypot(x - 5, y - 4))


@pytest.mark.parametrize(("angle", "pressure"), [(0.0, None), (10.0, None), (0.0, MohrCoulomb(40.0, 30.0))])
@pytest.mark.parametrize("share", [0.9, 1.1])
@pytest.mark.parametrize("count", [1000, 3000])
def test_a_heap_moves_only_beyond_its_limit_slope(count, share, angle, pressure):
    """Exact case 7; a slide far away keeps the steps coming."""
    cloud = random_points((0, 24), (0, 8), round(count * 2.4), 1)
    x = cloud.control_volumes.centroid[:, 0]
    slide = x > 20
    depth = np.where(slide, 0.5, cone(cloud, share, angle, pressure))
    changes = {"pressure": pressure} if pressure else {}
    heap = scene(cloud, (depth, 3.0 * slide, 0 * x), angle, 30, cfl=0.0015, rest_share=0.0, **changes)
    run = simulate(heap, [0.06])
    mine = x < 12
    if share < 1:
        assert run.steps >= 1000
        assert run.depth[0][mine].tobytes() == depth[mine].tobytes()
        assert not run.max_speed[mine].any()
    else:
        assert run.max_speed[mine].max() > 1e-3


@settings(derandomize=True, deadline=None, max_examples=15)
@given(clouds())
def test_faces_know_their_cells(cloud):
    cells, faces = cloud.control_volumes, connect(cloud.control_volumes)
    n, inner = len(cloud), len(cells.left)
    n_x, n_y, d_x, d_y, part, shift, length = faces.geometry
    assert faces.number[:n].sum() == 2 * inner + len(cells.side)
    assert not faces.number[n:].any()
    for i in range(0, n, 7):
        halves = np.array([half_of(faces, i, m) for m in range(faces.number[i])])
        f, j, sign = np.array([beyond(faces, half) for half in halves]).T.reshape(3, -1)
        f, j = f.astype(int), j.astype(int)
        assert ((faces.left[f] == i) == (sign > 0)).all()
        assert (np.where(sign > 0, faces.right[f], faces.left[f]) == j).all()
        assert len(set(f)) == len(f)
        turned = sign * length[f]
        np.testing.assert_allclose([turned @ n_x[f], turned @ n_y[f]], 0, atol=1e-13)
    for kind, count in ((slice(0, inner), inner), (slice(faces.outer, faces.outer + len(cells.side)), None)):
        middle = cells.midpoint if count else cells.side_midpoint
        way = np.stack([d_x, d_y])[:, kind]
        off = np.stack([-d_y, d_x])[:, kind] * shift[kind]
        here = cells.centroid[faces.left[kind]].T
        np.testing.assert_allclose((here + part[kind] * way + off).T, middle, atol=1e-12)
    there = cells.centroid[faces.right[:inner]].T - (1 - part[:inner]) * np.stack([d_x, d_y])[:, :inner]
    off = np.stack([-d_y, d_x])[:, :inner] * shift[:inner]
    np.testing.assert_allclose((there + off).T, cells.midpoint, atol=1e-12)


def box(cloud=None, **changes):
    """A heap in a closed box on a slope."""
    cloud = cloud or random_points((0, 10), (0, 8), 600, 3)
    x, y = cloud.control_volumes.centroid.T
    depth = 0.8 * np.maximum(0, 1 - ((x - 3) ** 2 + (y - 4) ** 2) / 4)
    return scene(cloud, (depth, 3 + 0 * x, 1 + 0 * x), 35, 30, ("wall",) * 4, **changes)


def test_what_leans_on_a_wall_across_a_slope_steeper_than_friction_comes_to_rest():
    """When the last cell does hangs on the cloud: half take ten seconds, one in ten a minute or more.

    Which one is slow is chance, that any last bit decides, so that only many tell of it.
    """
    rest = []
    for seed in range(24):
        run = simulate(box(random_points((0, 10), (0, 8), 600, seed)), [80.0])
        assert run.failure is None
        assert run.depth.max() > 0.2
        assert abs(run.ledger.error) < 1e-13
        rest.append(80.0 if np.isnan(run.rest_time) else run.rest_time)
    assert np.min(rest) > 1
    assert np.median(rest) < 12
    assert np.quantile(rest, 0.9) < 65


def test_results_have_the_shape_of_the_cloud_and_maxima_those_of_all_frames():
    heap = box()
    run = simulate(heap, [0.0, 0.3, 0.6], arrival_depth=0.01)
    n = len(heap.points)
    assert run.depth.shape == run.velocity_x.shape == run.velocity_y.shape == (3, n)
    assert run.max_depth.shape == run.arrival_time.shape == run.deposit_depth.shape == (n,)
    np.testing.assert_array_equal(run.depth[0], heap.depth)
    np.testing.assert_array_equal(run.deposit_depth, run.depth[-1])
    speed = np.hypot(run.velocity_x, run.velocity_y)
    assert (run.max_depth >= run.depth.max(axis=0)).all()
    assert (run.max_speed >= speed[1:].max(axis=0) * (1 - 1e-15)).all()
    assert (run.max_momentum_flux >= (run.depth * speed**2)[1:].max(axis=0) * (1 - 1e-14)).all()
    assert (np.isfinite(run.arrival_time) == (run.max_depth > 0.01)).all()


def test_operators_made_before_give_the_same_run_even_from_another_process():
    heap = box()
    here = simulate(heap, [0.5])
    operators = pickle.loads(pickle.dumps(prepare(heap.points)))
    there = simulate(replace(heap, operators=operators), [0.5])
    assert here.depth.tobytes() == there.depth.tobytes()


def test_operators_of_another_cloud_or_scheme_are_refused():
    heap = box()
    with pytest.raises(ValueError, match="another cloud"):
        simulate(replace(heap, operators=prepare(random_points((0, 10), (0, 8), 600, 4))), [0.5])
    with pytest.raises(ValueError, match="weight shape"):
        simulate(replace(heap, operators=prepare(heap.points, 13)), [0.5])


def test_runs_that_cannot_go_on_say_why_and_where():
    heap = box()
    assert simulate(heap, [0.5], max_steps=3).failure.reason == "more steps than allowed"
    fast = replace(heap, velocity_x=1e11 * heap.velocity_x)
    assert simulate(fast, [0.5]).failure.reason == "the time step collapsed"
    failure = simulate(replace(heap, velocity_x=1e160 * heap.velocity_x), [1e-159]).failure
    assert failure.reason == "a value that is not finite"
    assert 0 < failure.x < 10
    assert 0 < failure.y < 8


@pytest.mark.parametrize(("degree", "most"), [(1, 0.95), (2, 0.8)])
def test_how_a_cell_is_strained_is_told_by_the_others_and_on_a_slope_by_the_deeper_side(degree, most):
    """On lopsided supports, whose slopes say that a cell that moves alone extends or shortens."""
    rng = np.random.default_rng(3)
    cloud = given_points(rng.uniform(0, 10, (150, 2)), (0, 10), (0, 10))
    tables = prepare(cloud, degree=degree).tables
    n, room = len(cloud.points), tables.faces.cells
    x, y = np.pad(cloud.control_volumes.centroid, ((0, room - n), (0, 0))).T

    def strained(u, v, h=1.0, rise=0.0):
        found = np.full((9, room), rise)
        fields = Fields(np.full(room, h), u, v)
        strain_at(fields, tables.gradient.neighbours, tables.strain, 0, room, 1e-3, found)
        return found[6:8, :n]

    for rise in (0.0, 0.02, 1.0, -1.0):
        found = strained(2 + 3 * x - y, 1 + y - 4 * x, rise=rise)
        np.testing.assert_allclose(found, [[3] * n, [1] * n], rtol=1e-8)
    lone, slopes = np.zeros(room), np.zeros((9, room))
    lone[70] = 5.0
    np.testing.assert_allclose(strained(lone, -lone)[:, 70], 0.0, atol=1e-12)
    slopes_at(Fields(np.ones(room), lone, lone), tables.gradient, 0, room, 1e-3, slopes)
    assert np.abs(slopes[2:6, 70]).max() > 0.1
    np.testing.assert_array_equal(strained(x, y, h=0.0), 0.0)
    # toward the deeper side a cell of its own velocity shortens, and away from it it extends
    for sign in (1.0, -1.0):
        own = -np.stack([w.sum(axis=0)[:n] for w in (tables.strain.bent_along, tables.strain.bent_across)])
        assert (own <= 0.0).all()
        np.testing.assert_allclose(
            strained(lone, -lone, rise=sign)[:, 70], sign * 5.0 * own[:, 70] * [1, -1], rtol=1e-9
        )
    assert (own < 0.0).mean() > most


def test_the_deeper_side_of_a_bend_in_velocity_tells_how_a_cell_is_strained():
    """On a lattice it is the derivative on that side alone, with supports of five or of nine."""
    lattice = Lattice((0, 8), (0, 8), 1.0)
    cloud = given_points(np.stack([a.ravel() for a in lattice.coordinates], axis=1), (-0.5, 8.5), (-0.5, 8.5))
    for support in (5, 9):
        tables = prepare(cloud, support).tables
        n, room = len(cloud.points), tables.faces.cells
        x, y = np.pad(cloud.control_volumes.centroid, ((0, room - n), (0, 0))).T
        middle = int(np.argmin(np.abs(x - 4) + np.abs(y - 4)))
        bent = np.where(x > 4, 3.0, 1.0) * (x - 4), np.where(y > 4, -2.0, 5.0) * (y - 4)
        for rise, expected in ((1.0, (3, -2)), (-1.0, (1, 5)), (0.0, (2, 1.5)), (0.025, (2.5, -0.25))):
            found = np.full((9, room), rise)
            fields = Fields(np.ones(room), *bent)
            strain_at(fields, tables.gradient.neighbours, tables.strain, 0, room, 1e-3, found)
            assert found[6:8, middle] == pytest.approx(expected, rel=1e-9)


def test_a_face_that_stands_behind_a_cell_takes_no_step_from_it():
    """Among pairs of points; a step that is turned round would lead away from the cell beyond."""
    rng = np.random.default_rng(5)
    first = rng.uniform(0, 10, (150, 2))
    pairs = np.concatenate([first, np.clip(first + rng.normal(0, 0.05, first.shape), 0.01, 9.99)])
    cloud = given_points(pairs, (0, 10), (0, 10))
    cells = cloud.control_volumes
    start, way = cells.centroid[cells.left], cells.centroid[cells.right] - cells.centroid[cells.left]
    stands = ((cells.midpoint - start) * way).sum(axis=1) / (way**2).sum(axis=1)
    assert stands.min() < -0.05
    part = prepare(cloud).tables.faces.geometry[4, : len(stands)]
    np.testing.assert_allclose(part, stands.clip(0, 1), rtol=1e-13)


def test_what_a_cell_is_slower_at_a_face_is_bounded_by_all_around_it():
    """By waves and a hundredth of its speed, their square over its lead, and twice what others have more."""
    rng = np.random.default_rng(3)
    cloud = given_points(rng.uniform(0, 10, (150, 2)), (0, 10), (0, 10))
    tables = prepare(cloud).tables
    room, one = tables.faces.cells, 70
    normal = np.full(room, 9.0)

    def bound(h, lead):
        u, v, found = np.full(room, 3.0), np.full(room, 4.0), np.zeros((9, room))
        u[one], v[one] = 3.0 + 0.6 * lead, 4.0 + 0.8 * lead
        now = Fields(np.full(room, h), u, v)
        slopes_at(now, tables.gradient, 0, room, 1e-9, found)
        assert found[8, one] == pytest.approx(-lead * (5.0 + lead), rel=1e-12)
        find_most_slower(now, normal, 0, room, found)
        return found[8, one] / (5.0 + lead)

    wave = 3.0 * np.sqrt(0.01)
    for lead in (0.5, 2.0, 4.0, 20.0):
        allowed = 4.0 * wave**2 + (0.01 * (5.0 + lead * wave)) ** 2
        most = min(np.sqrt(allowed), allowed / (lead * wave))
        assert bound(0.01, lead * wave) == pytest.approx(most, rel=1e-12)
    allowed = 4.0 * wave**2 + (0.01 * 4.0) ** 2
    assert bound(0.01, -1.0) == pytest.approx(np.sqrt(allowed) + 2.0, rel=1e-12)


@pytest.mark.parametrize("seed", [3, 18])
def test_no_cell_leaves_by_its_slow_part_and_gets_ever_faster(seed):
    """Thin layers on pairs of points, every cell with a velocity of its own; once it got 1.1 times faster."""
    rng = np.random.default_rng(seed)
    first = rng.uniform(0.2, 9.8, (150, 2))
    pairs = np.concatenate([first, np.clip(first + rng.normal(0, 0.05, first.shape), 0.01, 9.99)])
    cloud = given_points(pairs, (0, 10), (0, 10))
    u = 1 + np.random.default_rng(seed + 100).uniform(-0.5, 0.5, len(cloud.points))
    v = np.random.default_rng(seed + 200).uniform(-0.3, 0.3, len(cloud.points))
    first_speed, layer = np.hypot(u, v).max(), np.full(len(u), 1e-4)
    run = begin(Scene(cloud, Plane(0.0), layer, u, v, Coulomb(0.0)), 3.0, 0.0, True)
    fastest = 0.0
    while run.time < 3.0:
        run.advance(3.0, int(run.progress.steps[0]) + 1)
        h, u, v = run.state
        fastest = max(fastest, float(np.hypot(u, v)[h > 1e-8].max()))
    # pressure makes a layer faster by 2 c at most
    assert fastest < 1.01 * (first_speed + 2 * np.sqrt(9.81 * 1e-4))
