"""Releases outlined by polygons: exact shares, volumes by the area of the bed."""

from fractions import Fraction

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from solver import Lattice
from solver.release.polygons import PolygonRelease, polygon_shares, ring_area, surface_state
from solver.verification.surfaces import Inclined

LATTICE = Lattice((0, 20), (-10, 10), 1.0)


def star(centre, radii):
    angles = np.linspace(0, 2 * np.pi, len(radii), endpoint=False)
    return np.array(centre) + np.array(radii)[:, None] * np.stack([np.cos(angles), np.sin(angles)], 1)


@settings(derandomize=True, deadline=None, max_examples=50)
@given(st.tuples(st.floats(6, 14), st.floats(-4, 4)), st.lists(st.floats(0.05, 5.5), min_size=3, max_size=12))
def test_the_shares_of_any_star_add_up_to_its_area(centre, radii):
    ring = star(centre, radii)
    shares = polygon_shares([ring], LATTICE)
    assert shares.sum() == pytest.approx(ring_area(ring), rel=1e-11, abs=1e-11)
    assert ((shares >= 0) & (shares <= 1)).all()


def test_shares_agree_with_sampling():
    from matplotlib.path import Path

    ring = star((9.3, 0.7), [6, 2, 5, 1, 6.5, 3, 4])
    shifts = (np.arange(40) + 0.5) / 40 - 0.5
    x, y = LATTICE.coordinates
    inside = Path(ring)
    sampled = sum(
        inside.contains_points(np.stack([(x + a).ravel(), (y + b).ravel()], 1)).reshape(x.shape)
        for a in shifts
        for b in shifts
    )
    assert np.abs(polygon_shares([ring], LATTICE) - sampled / 1600).max() < 0.02


def test_a_rectangle_on_edges_and_its_hole():
    outer = np.array([(2.5, -3.5), (8.5, -3.5), (8.5, 4.5), (2.5, 4.5)])
    hole = np.array([(4.5, -1.5), (4.5, 0.0), (6.5, 0.0), (6.5, -1.5)])
    shares = polygon_shares([outer, hole], LATTICE)
    assert shares[7:15, 3:9].sum() == 45.0
    assert shares.sum() == 45.0
    assert (shares[9, 5:7] == 0).all()
    np.testing.assert_array_equal(shares[10, 5:7], 0.5)


def test_what_is_left_of_the_lattice_covers_nothing_right_of_it():
    ring = np.array([(-9.0, -4.0), (-2.0, -4.0), (-2.0, 3.0), (-9.0, 3.0)])
    assert not polygon_shares([ring], LATTICE).any()
    across = np.array([(-9.0, -4.5), (3.5, -4.5), (3.5, 2.5), (-9.0, 2.5)])
    assert polygon_shares([across], LATTICE).sum() == 28.0


@pytest.mark.parametrize(("measured", "factor"), [("normal", 1 / np.cos(np.radians(40))), ("vertical", 1.0)])
def test_volume_is_by_the_area_of_the_bed(measured, factor):
    ring, surface = star((10, 0), [6, 2, 5, 1, 6.5, 3, 4]), Inclined(30, 40.0)
    laid = surface_state([PolygonRelease([ring], depth=1.2, measured=measured)], LATTICE, surface)
    assert laid.volume == pytest.approx(1.2 * ring_area(ring) * factor, rel=1e-12)
    assert laid.volume_lost == 0
    given = surface_state([PolygonRelease([ring], volume=500.0, measured=measured)], LATTICE, surface)
    assert given.volume == pytest.approx(500.0, rel=1e-14)


def test_an_area_far_from_the_origin_keeps_its_digits_and_nothing_is_lost():
    east, north = 2_600_000.0, 1_200_000.0
    ring = np.array([(10.3, 20.7), (70.9, 34.2), (59.6, 89.8), (0.1, 73.4)]) + np.array([east, north])
    exact = [(Fraction(x), Fraction(y)) for x, y in ring.tolist()]
    twice = sum(a * d - c * b for (a, b), (c, d) in zip(exact, exact[1:] + exact[:1], strict=True))
    assert ring_area(ring) == pytest.approx(float(twice / 2), rel=1e-12)
    lattice = Lattice((east - 20, east + 100), (north - 20, north + 120), 2.5)
    laid = surface_state([PolygonRelease([ring], depth=1.5)], lattice, Inclined(0, 20.0))
    assert laid.volume_asked == pytest.approx(laid.volume, rel=1e-12)
    assert laid.volume_lost == pytest.approx(0.0, abs=1e-9)


def test_what_lies_outside_is_lost():
    ring = np.array([(-9.0, -4.0), (3.0, -4.0), (3.0, 3.0), (-9.0, 3.0)])
    laid = surface_state([PolygonRelease([ring], volume=1200.0)], LATTICE, Inclined(0, 20.0))
    assert laid.volume == pytest.approx(1200 * 3.5 / 12)
    assert laid.volume + laid.volume_lost == pytest.approx(laid.volume_asked)


@pytest.mark.parametrize("named", [{}, {"depth": 1.0, "volume": 1.0}, {"depth": -1.0}])
def test_a_release_without_one_amount_is_refused(named):
    with pytest.raises(ValueError, match="depth"):
        PolygonRelease([star((0, 0), [1, 1, 1])], **named)
