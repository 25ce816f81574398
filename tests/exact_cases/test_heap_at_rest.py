"""Exact case 7 on every layout of points: what friction holds stays, to the last bit."""

import numpy as np
import pytest
from clouds import shaken_lattice
from scenes import material

from solver.kernels.earth_pressure import at_rest
from solver.physics.earth_pressure import MohrCoulomb
from solver.physics.friction import Coulomb
from solver.physics.terrain import Plane
from solver.points.cloud import given_points, graded_points, random_points
from solver.points.lattice import Lattice
from solver.points.spacing import Refinement
from solver.scene import Scene, WeightedResidual
from solver.simulation import simulate

X, Y, CENTRE, RADIUS, FRICTION = (0.0, 18.0), (0.0, 8.0), (5.0, 4.0), 3.0, 30.0
# the top is round over about so many m: no spacing resolves the tip of a cone
TOP = 1.0
FEET = RADIUS + CENTRE[0] + 2


def stretched(spacing):
    """Shaken columns, four times closer along x than across."""
    columns, rows = round((X[1] - X[0]) / spacing * 2) + 1, round((Y[1] - Y[0]) / spacing / 2) + 1
    return shaken_lattice(columns, rows, 0.3, X, Y, 4)


def thrown(spacing, twins=0.0):
    """Points anywhere, some with a second one at a thousandth of the spacing."""
    rng = np.random.default_rng(6)
    low, high = np.transpose([X, Y])
    places = rng.uniform(low, high, (round(np.prod(high - low) / spacing**2), 2))
    beside = places[: round(twins * len(places))] + 1e-3 * spacing
    return given_points(np.clip(np.concatenate([places, beside]), low, high), X, Y)


def shaken(spacing):
    columns, rows = (round((b - a) / spacing) + 1 for a, b in (X, Y))
    return shaken_lattice(columns, rows, 0.4, X, Y, 3)


LAYOUTS = {
    "lattice": lambda spacing: Lattice(X, Y, spacing),
    "even cloud": lambda spacing: random_points(X, Y, round(144 / spacing**2), 1),
    "graded cloud": lambda spacing: graded_points(
        X, Y, spacing, [Refinement((3.0, 6.0), (2.0, 5.0), spacing / 3)], 0.2, 2
    ),
    "shaken lattice": shaken,
    "stretched cloud": stretched,
    "thrown points": thrown,
    "nearly coincident": lambda spacing: thrown(spacing, 0.05),
}


def scene(points, share, angle, pressure):
    """A heap as steep at its feet as a share of the limit where gravity helps it most, and a slide beyond."""
    x, y = points.coordinates if isinstance(points, Lattice) else points.control_volumes.centroid.T
    k = at_rest(material(pressure))[0] if pressure else 1.0
    limit = (np.tan(np.radians(FRICTION)) - np.tan(np.radians(angle))) / k
    square = (x - CENTRE[0]) ** 2 + (y - CENTRE[1]) ** 2 + TOP**2
    edge = np.hypot(RADIUS, TOP)
    heap = share * limit * edge / RADIUS * np.maximum(0.0, edge - np.sqrt(square))
    sliding = x > FEET + 3
    depth = np.where(sliding, 0.3, heap)
    # the slide keeps the steps coming
    scheme = WeightedResidual(cfl=0.001, rest_share=0.0)
    given = {"earth_pressure": pressure} if pressure else {}
    return Scene(
        points, Plane(angle), depth, 3.0 * sliding, 0 * depth, Coulomb(FRICTION), scheme=scheme, **given
    )


@pytest.mark.parametrize("spacing", [0.6, 0.35])
@pytest.mark.parametrize(("angle", "pressure"), [(0.0, None), (12.0, MohrCoulomb(40.0, FRICTION))])
@pytest.mark.parametrize("layout", LAYOUTS)
def test_a_heap_below_its_limit_is_the_same_to_the_last_bit_after_a_thousand_steps(
    layout, angle, pressure, spacing
):
    heap = scene(LAYOUTS[layout](spacing), 0.9, angle, pressure)
    run = simulate(heap, [10.0], max_steps=1000)
    assert run.steps == 1000
    mine = heap.points.coordinates[0] < FEET
    assert heap.depth[mine].max() > (0.5 if pressure is None else 0.25)
    assert run.deposit_depth[mine].tobytes() == heap.depth[mine].tobytes()
    assert not run.max_speed[mine].any()


@pytest.mark.parametrize("layout", LAYOUTS)
def test_beyond_its_limit_it_moves(layout):
    heap = scene(LAYOUTS[layout](0.35), 1.15, 0.0, None)
    run = simulate(heap, [10.0], max_steps=100)
    assert run.max_speed[heap.points.coordinates[0] < FEET].max() > 1e-4
