"""A step is no longer than it takes to go and fall by a cell, also into cells that are dry when it begins."""

import numpy as np
import pytest

import solver
from solver.checks.states import state_of_run
from solver.forms import begin
from solver.physics.terrain import Segment, Segments
from solver.points.cloud import random_points

STEEP = 60.0
LATTICE = solver.Lattice((0.5, 39.5), (-2, 2), 1.0)
CLOUD = random_points((0, 40), (-2.5, 2.5), 200, 3)
BRINK = Segments((Segment(0, 0.0), Segment(20.0, STEEP)), joint=0.01)
WALLS = solver.Boundaries("wall", "open", "wall", "wall")
# by one cell, or by the distance between points of the cloud
FALL = np.sqrt(2 * 9.81 * np.sin(np.radians(STEEP)))


def cliff():
    x, y = np.arange(-3, 60.0), np.arange(-6, 7.0)
    z = np.minimum(0.0, -(x - 20) * np.tan(np.radians(STEEP)))
    return solver.ElevationModel(x, y, np.broadcast_to(z, (len(y), len(x))), 0.0)


def slope():
    x, y = np.arange(-3, 60.0), np.arange(-6, 7.0)
    return solver.ElevationModel(x, y, np.broadcast_to(-x * np.tan(np.radians(STEEP)), (len(y), len(x))), 0.0)


def fastest_after_one_step(scene):
    run = begin(scene, 1e4, 0.0, True)
    run.advance(1e4, 1)
    state = state_of_run(run)
    return float(np.hypot(state.u, state.v).max())


@pytest.mark.parametrize("depth", [1e-3, 1e-7])
@pytest.mark.parametrize(
    ("points", "terrain"),
    [
        pytest.param(LATTICE, BRINK, id="lattice"),
        pytest.param(LATTICE, cliff(), id="elevation model"),
        pytest.param(CLOUD, BRINK, id="cloud"),
        pytest.param(CLOUD, cliff(), id="cloud on an elevation model"),
    ],
)
def test_a_film_beside_a_brink_falls_by_a_cell_in_its_first_step(points, terrain, depth):
    """Waves of a film take 1 to 100 s over a cell; falling for so long gave 14 to 440 m/s."""
    x, _ = points.coordinates
    flat = np.zeros(points.shape)
    sides = WALLS if terrain is BRINK else solver.Boundaries()
    film = np.where(x < 20, depth, 0.0)
    scene = solver.Scene(points, terrain, film, flat, flat, solver.Coulomb(0.0), boundaries=sides)
    assert 0 < fastest_after_one_step(scene) < FALL


@pytest.mark.parametrize(
    ("points", "terrain", "part", "within"),
    [
        pytest.param(LATTICE, solver.Plane(STEEP), 1.0, 1e-3, id="lattice"),
        pytest.param(CLOUD, solver.Plane(STEEP), 1.0, 0.1, id="cloud"),
        # a spacing in plan is longer on the bed
        pytest.param(LATTICE, slope(), np.cos(np.radians(STEEP)), 1e-3, id="elevation model"),
    ],
)
def test_a_step_counts_the_velocity_that_gravity_gives_in_it(points, terrain, part, within):
    """Of dt (u + a dt) = cfl dx; the second step was as long as the first one, in which u grew from rest."""
    film, flat = np.full(points.shape, 1e-9), np.zeros(points.shape)
    run = begin(solver.Scene(points, terrain, film, flat, flat, solver.Coulomb(0.0)), 1e4, 0.0, True)
    run.advance(1e4, 1)
    first, state = run.time, state_of_run(run)
    gained = part * np.hypot(state.u, state.v)[state.h > 0].max() / (0.5 * FALL**2 * first)
    run.advance(1e4, 2)
    # the golden ratio where all cells move alike
    assert (run.time - first) / first == pytest.approx((np.sqrt(4 + gained**2) - gained) / 2, rel=within)


@pytest.mark.parametrize("depth", [1e-3, 1e-7])
@pytest.mark.parametrize("points", [LATTICE, CLOUD], ids=["lattice", "cloud"])
def test_a_film_beside_a_brink_falls_by_a_cell_in_the_collocation_form(points, depth):
    """A support reaches farther than the next points; 8 to 11,000 m/s when wet points alone were counted."""
    x, _ = points.coordinates
    flat = np.zeros(points.shape)
    film = np.where(x < 20, depth, 0.0)
    scene = solver.Scene(
        points, BRINK, film, flat, flat, solver.Coulomb(0.0), scheme=solver.Collocation(), boundaries=WALLS
    )
    assert 0 < fastest_after_one_step(scene) < FALL


@pytest.mark.parametrize("points", [LATTICE, CLOUD], ids=["lattice", "cloud"])
def test_what_a_given_depth_sends_on_to_a_dry_slope_falls_by_a_cell_in_its_first_step(points):
    flat = np.zeros(points.shape)
    sides = solver.Boundaries("wall", 1e-4, "wall", "wall")
    scene = solver.Scene(points, solver.Plane(STEEP), flat, flat, flat, solver.Coulomb(0.0), boundaries=sides)
    assert fastest_after_one_step(scene) < FALL


@pytest.mark.parametrize("points", [LATTICE, CLOUD], ids=["lattice", "cloud"])
def test_a_trickle_on_to_a_dry_slope_falls_by_a_cell_in_its_first_step(points):
    flat, times = np.zeros(points.shape), np.array([0.0, 1e4])
    trickle = solver.Inflow(
        "trickle", ((10, -2.5), (10, 2.5)), solver.Hydrograph(times, np.full(2, 1e-9)), froude=0.5
    )
    scene = solver.Scene(
        points,
        solver.Plane(STEEP),
        flat,
        flat,
        flat,
        solver.Coulomb(0.0),
        boundaries=WALLS,
        inflows=(trickle,),
    )
    assert 0 < fastest_after_one_step(scene) < FALL
