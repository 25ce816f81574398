"""What lies on both sides of a section, where it is closed to backflow, is held up as by a wall."""

import numpy as np
import pytest

import solver
from solver.points.cloud import random_points
from solver.verification.inflow_cases import voellmy

WALLS = solver.Boundaries("wall", "wall", "wall", "wall")
JET = solver.Hydrograph(np.array([0.0, 100.0]), np.full(2, 0.05))


def bank(x, y):
    """Elevation of a basin with a level floor, 19 by 6 m, m."""
    return 0.5 * (np.maximum(0, np.abs(y) - 3) + np.maximum(0, np.abs(x - 10) - 9.5))


def basin():
    x, y = np.arange(-6, 27.0), np.arange(-9, 10.0)
    return solver.ElevationModel(x, y, bank(x, y[:, None]), 0.0)


def level(x, y):
    return np.zeros_like(x)


@pytest.mark.parametrize(
    ("points", "terrain", "elevation"),
    [
        pytest.param(solver.Lattice((0.5, 19.5), (-2, 2), 1.0), solver.Plane(0), level, id="lattice"),
        pytest.param(solver.Lattice((-4, 24), (-7, 7), 1.0), basin(), bank, id="elevation model"),
        pytest.param(random_points((0, 20), (-2.5, 2.5), 100, 3), solver.Plane(0), level, id="cloud"),
        pytest.param(random_points((-4, 24), (-7, 7), 392, 3), basin(), bank, id="cloud on a surface"),
    ],
)
def test_a_film_above_a_section_and_a_deep_layer_below_it_are_held_up(points, terrain, elevation):
    """The film comes at 3 m/s, and what comes in is a jet of 5 m/s, which a layer 2 m deep drowns."""
    x, y = points.coordinates
    above, floor = x < 10, elevation(x, y) == 0
    film = (x > 1) & (np.abs(y) < 2.5)
    half = 2.5 if elevation is level else 7.0
    scene = solver.Scene(
        points,
        terrain,
        np.where(above, 1e-3 * film, np.maximum(0, 2 - elevation(x, y))),
        np.where(above, 3.0, 0.0),
        np.zeros(points.shape),
        voellmy(0.001, 1e6),
        boundaries=WALLS if elevation is level else solver.Boundaries(),
        inflows=(solver.Inflow("jet", ((10, -half), (10, half)), JET, speed=5.0),),
    )
    result = solver.simulate(scene, [0, 5, 10])
    speed = np.hypot(result.velocity_x, result.velocity_y)
    # without the first rule the film goes on at 3 m/s for ever, without the second the layer falls at 4 m/s2
    assert speed[1:][:, ~above & floor].max() < 1.0
    # across, films of a cloud go on in the gutter along the foot of a bank
    near = above & film & (x > 8)
    depth, along = result.depth[2][near], np.abs(result.velocity_x[2][near])
    assert (depth * along).sum() < 0.3 * depth.sum()
    # what sloshes in the gutter
    assert along.max() < 0.8
    assert abs(result.ledger.error) < 1e-13
