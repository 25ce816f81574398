"""Layers between banks come to rest with a level surface, and deposits do not creep along their banks."""

import numpy as np
import pytest

from solver.physics.friction import Coulomb
from solver.points.lattice import Lattice
from solver.scene import Scene
from solver.simulation import simulate
from solver.surface.levels import levels_at_edges, steps_of_surface
from solver.verification.bank_cases import BASIN, in_gully, moving_share, pond
from solver.verification.surfaces import Gully


@pytest.mark.parametrize("tilt", [0.3, 2.0, -0.3, -2.0])
@pytest.mark.parametrize("h", [0.01, 0.5, 3.0])
def test_gravity_on_a_level_layer_is_balanced_by_what_its_edges_show(h, tilt):
    low, high = levels_at_edges(h, tilt)
    assert min(low, high) >= 0
    np.testing.assert_allclose(0.5 * (high**2 - low**2), 2 * h * tilt, rtol=1e-14)
    # what is below a plane over a cell, one wide, that falls by twice the tilt
    length = min(1.0, max(low, high) / abs(2 * tilt))
    np.testing.assert_allclose(0.5 * (high + low) * length, h, rtol=1e-14)


def test_a_level_surface_has_no_step_over_a_crease_nor_at_its_shore():
    # a floor, and a bank that rises to 2 m over each of two cells; the surface is at 0.5 m and at 3 m
    tilts = 0.0, -1.0, -1.0
    low, high, back, forth = steps_of_surface((0.5, 0.5**2 / 4, 0.0), tilts)
    assert (low, high) == (0.5, 0.0)
    assert back == forth == 0.0
    low, high, back, forth = steps_of_surface((3.0, 2.0, 1.0**2 / 4), tilts)
    assert (low, high) == (3.0, 1.0)
    assert back == forth == 0.0


def test_a_pond_in_a_basin_comes_to_rest_at_a_level():
    run = pond(2.0, end=100.0)
    assert run.rest_time < 20
    assert moving_share(run) == 0.0
    assert abs(run.ledger.error) < 1e-14
    x, y = run_points(2.0).coordinates
    surface = BASIN.at(x, y) + run.depth[-1]
    floor = np.hypot(x, y) < BASIN.radius - 2
    # it stands as steep as friction of 10 degrees lets it
    assert np.ptp(surface[floor]) < 2 * BASIN.radius * np.tan(np.radians(10))


def test_a_level_layer_without_friction_stays_at_rest_between_banks():
    points = run_points(2.0)
    x, y = points.coordinates
    tilt = 0.6 * np.sqrt(1 + 0.6**2)
    depth = np.where(np.abs(y) < 7, 0.5, np.where(np.abs(y) < 9, 0.5**2 / (4 * tilt), 0.0))
    trough = Gully(0.0, half_width=7.0, bank=0.6, steep=0.0, gentle=0.0)
    run = simulate(Scene(points, trough, depth, 0 * depth, 0 * depth, Coulomb(0.0)), [2.0])
    # what leaves through the open ends is not yet felt there
    middle = np.abs(x) < 15
    assert run.steps > 5
    assert np.hypot(run.velocity_x[-1], run.velocity_y[-1])[middle].max() < 1e-13


def run_points(spacing: float) -> Lattice:
    return Lattice((-30.0, 30.0), (-30.0, 30.0), spacing)


def test_a_deposit_in_a_gully_lies_where_that_on_a_finer_lattice_does():
    coarse, fine = in_gully(4.0), in_gully(2.0)
    assert abs(fine.front - coarse.front) < 16
    assert abs(fine.centroid - coarse.centroid) < 8
