from dataclasses import replace

import numpy as np
import pytest
from clouds import clouds
from dense_collocation import DenseCollocation
from hypothesis import given, settings
from hypothesis import strategies as st

from pipeline.studies.collocation_scan import COVERED, X, Y, outcome, table
from solver.collocation.operators import prepare_collocation
from solver.collocation.relaxation import relax
from solver.collocation.residual import derivatives
from solver.collocation.run import CollocationRun
from solver.forms import key, prepare
from solver.physics.earth_pressure import MohrCoulomb
from solver.physics.friction import Coulomb, Voellmy
from solver.physics.terrain import Bend, Plane
from solver.points.cloud import random_points
from solver.points.lattice import Lattice
from solver.scene import Boundaries, Collocation, Scene, WeightedResidual
from solver.simulation import simulate
from solver.verification.cases import cap, chute, measure

G = 9.81
LATTICE, CLOUD = Lattice((0, 12), (-4, 4), 0.5), random_points((0, 12), (-4, 4), 400, 5)
POINTS = {"lattice": LATTICE, "cloud": CLOUD}
CLOSED = Boundaries("wall", "wall", "wall", "wall")


def heap(points, centre=(5, 0.3), radius=2.5, height=1.0):
    x, y = points.coordinates
    return height * np.maximum(0, 1 - ((x - centre[0]) ** 2 + (y - centre[1]) ** 2) / radius**2)


def scene(points, depth, speed=(0.0, 0.0), terrain=None, friction=None, **changes):
    """A sheared initial velocity; the form with its own choices."""
    x, y = points.coordinates
    shear = 1 + 0.1 * np.sin(2 * x + y)
    choices = {k: changes.pop(k) for k in list(changes) if k in Collocation.__dataclass_fields__}
    return Scene(
        points,
        terrain or Plane(20),
        depth,
        speed[0] * shear,
        speed[1] * shear,
        friction or Coulomb(15),
        scheme=Collocation(**choices),
        **changes,
    )


@pytest.mark.parametrize("points", POINTS.values(), ids=POINTS)
def test_derivatives_of_fluxes_are_exact_where_fluxes_are_quadratic(points):
    """h, u, v with products of degree two: h constant and velocities linear, or h quadratic at rest."""
    operators = prepare_collocation(points)
    x, y = operators.coordinates.T
    inner = np.flatnonzero((abs(x - 6) < 3) & (abs(y) < 1))
    gains = np.zeros((operators.count, 5))
    one = np.ones_like(x)
    from solver.kernels.state import Fields

    derivatives(Fields(2 * one, 1 + x, y - x), inner, operators.stencils, gains)
    wanted = np.stack([4 * one, 2 * (3 + 3 * x), 2 * (3 * y - 4 * x - 1), 0 * one, 0 * one], axis=1)
    np.testing.assert_allclose(gains[inner], wanted[inner], atol=1e-9)
    derivatives(Fields(x * x - x * y, 0 * x, 0 * x), inner, operators.stencils, gains)
    np.testing.assert_allclose(gains[inner, 3:], np.c_[2 * x - y, -x][inner], atol=1e-9)


def test_a_lattice_takes_whole_shells_and_all_its_points_have_one_stencil():
    stencils = prepare_collocation(LATTICE, support=40).stencils
    assert stencils.neighbours.shape == (LATTICE.shape[0] * LATTICE.shape[1], 45)
    assert stencils.value.shape == (1, 45)
    np.testing.assert_array_equal(stencils.neighbours[:, 0], np.arange(len(stencils.neighbours)))


@given(clouds(), st.integers(0, 2**32), st.booleans())
@settings(max_examples=15, deadline=None)
def test_pairwise_relaxation_keeps_volume_on_any_cloud(cloud, seed, walled):
    rng = np.random.default_rng(seed)
    depth = 10.0 ** rng.uniform(-5, 0, len(cloud)) * (rng.random(len(cloud)) < 0.7)
    boundaries = CLOSED if walled else Boundaries()
    start = scene(cloud, depth, (3, -2), Plane(0), support=20, weight_shape=4.0, boundaries=boundaries)
    run = CollocationRun(start, 1.0, 0.0)
    run.scratch.q.h[: len(cloud)] -= 0.1 * rng.random(len(cloud))
    n = len(cloud)
    before = run.scratch.q.h[:n].copy()
    run.scratch.chosen[:], run.scratch.mark[:] = np.arange(n), 1
    assert relax(run.arrays, n) == n
    after = run.scratch.q.h[:n]
    assert abs(after - before).max() > 1e-3
    volume = (cloud.cell_area * np.abs(before)).sum()
    assert abs((cloud.cell_area * (after - before)).sum()) < 1e-13 * volume


CASES = {
    "slope": {},
    "walls": {"boundaries": CLOSED, "speed": (-3, 4), "terrain": Plane(0)},
    "no-slip": {"boundaries": Boundaries(*("no-slip",) * 4), "speed": (-3, 4), "terrain": Plane(0)},
    "mixed sides": {"boundaries": Boundaries("open", "wall", "no-slip", "open"), "terrain": Plane(10)},
    "earth pressure": {"earth_pressure": MohrCoulomb(35, 15), "friction": Coulomb(15)},
    "curvature and drag": {"terrain": Bend(30, 3, 9), "friction": Voellmy(10, 50.0)},
    "printed": {"smoothing": "printed", "relaxation": 0.8},
    "printed, clipped": {"smoothing": "printed", "clip": True, "film": 0.0},
    "depth alone, linear, diffuse": {"smoothed": "depth", "degree": 1, "derivative": "diffuse"},
}


@pytest.mark.parametrize("points", POINTS.values(), ids=POINTS)
@pytest.mark.parametrize("case", CASES)
def test_a_step_is_that_of_its_twin(case, points):
    """A heap with a film around it; the step ends before what is left out could reach it."""
    changes = {"speed": (2, -1), "support": 21, "weight_shape": 5.0} | CASES[case]
    depth = heap(points) + 0.02 * heap(points, (6, 0), 5, 1.0)
    start = scene(points, depth, **changes)
    run = CollocationRun(start, 1.0, 0.0)
    twin = DenseCollocation(start, run.operators)
    end = 0.01
    run.advance(end, None)
    assert run.progress.steps[0] == 1
    twin.step(end)
    for found, wanted in zip(run.state, twin.state, strict=True):
        assert abs(wanted).max() > 0.1
        np.testing.assert_allclose(found.ravel(), wanted, atol=1e-11)


CAP = cap()


def cap_error(points):
    """Exact case 1 at t = 5 s: relative L2 of depth."""
    measured = measure(CAP, points, Collocation())
    assert measured.run.failure is None
    assert abs(measured.run.ledger.error) < 5e-3
    return measured.depth


def test_the_frictionless_cap_converges_on_a_lattice():
    errors = [cap_error(CAP.lattice(spacing)) for spacing in (16, 8, 4)]
    assert np.polyfit(np.log([16, 8, 4]), np.log(errors), 1)[0] > 1.0
    assert errors[-1] < 3.2e-2


def test_the_frictionless_cap_converges_on_random_points():
    errors = [cap_error(CAP.cloud(spacing)) for spacing in (16, 8)]
    assert errors[1] < 0.55 * errors[0]


def test_a_uniform_layer_slides_to_rest_where_it_should():
    """Exact case 6, in the middle of a layer so long that its ends are not felt there."""
    lattice = Lattice((0, 40), (0, 3), 0.5)
    start = scene(lattice, np.full(lattice.shape, 0.5), terrain=Plane(20), friction=Coulomb(30))
    start = replace(
        start, velocity_x=np.full(lattice.shape, 2.0), boundaries=Boundaries("open", "open", "wall", "wall")
    )
    braking = G * (np.cos(np.radians(20)) * np.tan(np.radians(30)) - np.sin(np.radians(20)))
    run = simulate(start, [0.5 * 2 / braking, 1.5 * 2 / braking])
    middle = np.s_[:, 30:50]
    np.testing.assert_allclose(run.velocity_x[0][middle], 1.0, atol=1e-9)
    np.testing.assert_array_equal(run.velocity_x[1][middle], 0.0)
    np.testing.assert_allclose(run.depth[1][middle], 0.5, atol=1e-9)


@pytest.mark.parametrize(("points", "error"), [("lattice", 1e-13), ("cloud", 0.04)])
def test_walls_keep_volume_and_the_ledger_tells_what_leaves(points, error):
    start = scene(POINTS[points], heap(POINTS[points]), (3, 1), Plane(0), Coulomb(5), support=21)
    closed = simulate(replace(start, boundaries=CLOSED), [1.0, 3.0]).ledger
    assert (closed.inflow, closed.outflow) == (0.0, 0.0)
    assert abs(closed.error) < error
    through = simulate(replace(start, velocity_x=8 + 0 * start.depth), [1.0, 3.0]).ledger
    assert through.outflow_open > 0.3 * through.released
    assert abs(through.error) < error


def test_a_heap_below_the_friction_angle_is_at_rest_after_a_step():
    start = scene(LATTICE, heap(LATTICE, height=0.2), terrain=Plane(0), friction=Coulomb(30))
    run = simulate(start, [1.0])
    assert run.steps == 1
    assert run.rest_time < 0.2
    assert not run.velocity_x.any()


@pytest.mark.parametrize(
    ("points", "volume"),
    [(Lattice(X, Y, 0.2), 1e-3), (random_points(X, Y, 6_000, 1), 3e-3)],
    ids=["lattice", "cloud"],
)
def test_the_chute_runs_to_24_beside_the_conservative_form(points, volume):
    wanted, found = outcome(points, WeightedResidual()), outcome(points, Collocation())
    assert found.run.failure is None
    assert found.run.time == 24
    assert abs(found.run.ledger.error) < volume
    assert abs(found.front - wanted.front) < 0.3
    assert found.film[-1] <= found.body[-1]
    assert found.run.max_speed.max() < 1.05 * wanted.run.max_speed.max()
    least = -COVERED * found.run.max_depth.max()
    assert least < found.run.depth.min() < 0


def test_relaxation_as_printed_makes_volume_where_depth_is_clipped():
    lattice = Lattice(X, Y, 0.4)
    printed = Collocation(smoothing="printed", clip=True)
    kept, made = (simulate(chute(lattice, scheme), [3.0]).ledger.error for scheme in (Collocation(), printed))
    assert abs(kept) < 1e-9
    assert made > 0.02


def test_a_run_that_fails_says_so():
    unsmoothed = Collocation(relaxation=0.0, film=0.0)
    run = simulate(chute(Lattice(X, Y, 0.4), unsmoothed), [12.0], max_steps=60)
    assert run.failure is not None
    assert run.failure.reason == "more steps than allowed"
    assert np.isnan(run.depth).all()


@pytest.mark.parametrize(
    ("changes", "message"),
    [
        ({"boundaries": Boundaries(x_min=0.3)}, "no given depth"),
        ({"boundaries": Boundaries(x_max="wall")}, "steeper than friction"),
        ({"operators": prepare(CLOUD, Collocation())}, "not those of the collocation form"),
        ({"operators": prepare(LATTICE, Collocation(support=25))}, "the scheme"),
    ],
)
def test_what_the_form_cannot_do_is_refused(changes, message):
    start = replace(scene(LATTICE, heap(LATTICE)), **changes)
    with pytest.raises(ValueError, match=message):
        simulate(start, [1.0])


@pytest.mark.parametrize(
    "choice",
    [
        {"relaxation": 1.5},
        {"threshold": -0.1},
        {"smoothing": "some"},
        {"smoothed": "velocity"},
        {"derivative": "central"},
        {"floor": float("nan")},
    ],
)
def test_unknown_choices_are_refused(choice):
    with pytest.raises(ValueError, match=next(iter(choice))):
        Collocation(**choice)


def test_operators_are_shared_by_runs_of_the_same_choices():
    scheme = Collocation(support=25, weight_shape=4.0)
    start = scene(CLOUD, heap(CLOUD), (1, 1), support=25, weight_shape=4.0)
    own, shared = simulate(start, [0.3]), simulate(replace(start, operators=prepare(CLOUD, scheme)), [0.3])
    np.testing.assert_array_equal(own.depth, shared.depth)
    assert key(CLOUD, scheme) == key(CLOUD, replace(scheme, relaxation=0.1))
    assert key(CLOUD, scheme) != key(CLOUD, replace(scheme, derivative="diffuse"))


def test_the_scan_is_a_table(monkeypatch):
    monkeypatch.setattr(
        "pipeline.studies.collocation_scan.PARTS", {"one": [Collocation(degree=1, support=25)]}
    )
    monkeypatch.setattr("pipeline.studies.collocation_scan.TIMES", np.array([0.5]))
    head, rule, line = table(["one"], ["regular"])
    assert head.count("|") == rule.count("|") == line.count("|")
    assert "support 25, degree 1" in line
