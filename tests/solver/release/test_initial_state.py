import numpy as np
import pytest

from solver.points.lattice import Lattice
from solver.release.initial_state import initial_state
from solver.release.shapes import Box, Cap, Cylinder, Paraboloid

LATTICE = Lattice((0, 10), (-5, 5), 0.5)


def test_volume_laid_and_volume_lost_make_up_what_was_asked_for():
    inside, across = Paraboloid((5, 0), (2, 1), 1.0, volume=4.0), Cylinder((9.5, 4), 2.0, 1.0, volume=7.0)
    laid = initial_state([inside, across], LATTICE)
    assert laid.volume_asked == 11
    assert laid.volume_lost > 1
    assert laid.volume + laid.volume_lost == pytest.approx(11, rel=1e-12)
    assert laid.volume == pytest.approx(laid.depth.sum() * LATTICE.cell_area, rel=1e-14)


def test_the_order_of_releases_does_not_matter():
    releases = [Cap((4, 0), 2, 0.5, velocity=(1, 2)), Box((3, 6), (-1, 3), 0.4, velocity=(-2, 0))]
    here, there = initial_state(releases, LATTICE), initial_state(releases[::-1], LATTICE)
    for name in ("depth", "velocity_x", "velocity_y"):
        np.testing.assert_allclose(getattr(here, name), getattr(there, name), rtol=1e-14, atol=1e-16)


def test_momentum_is_the_sum_of_the_momenta():
    releases = [Cap((4, 0), 2, 0.5, velocity=(1, 2)), Box((3, 6), (-1, 3), 0.4, velocity=(-2, 0))]
    both, one, other = (initial_state(part, LATTICE) for part in (releases, releases[:1], releases[1:]))
    for name in ("velocity_x", "velocity_y"):
        momenta = [laid.depth * getattr(laid, name) for laid in (one, other)]
        np.testing.assert_allclose(both.depth * getattr(both, name), sum(momenta), atol=1e-15)


def test_nothing_moves_where_nothing_lies():
    laid = initial_state([Cap((4, 0), 2, 0.5, velocity=(1, 2))], LATTICE)
    assert not laid.velocity_x[laid.depth == 0].any()
    np.testing.assert_allclose(laid.velocity_x[laid.depth > 0], 1, rtol=1e-15)
