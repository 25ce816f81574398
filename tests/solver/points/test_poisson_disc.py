import hashlib

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.spatial import cKDTree
from spacing import spacing_twin

from solver.points import poisson_disc as pd
from solver.points.poisson_disc import poisson_disc
from solver.points.spacing import Refinement, Spacing, points_per_domain

X, Y = (0.0, 30.0), (-7.0, 7.0)
GRADED = Spacing(1.5, (Refinement((2, 6), (-2, 2), 0.4), Refinement((20, 20), (0, 0), 0.6)), 0.2)


def scatter_twin(bounds, spacing, distance, raw, capacity):
    """Throw the same candidates, and compare each with all points."""
    low, high = np.array([bounds[0], bounds[2]]), np.array([bounds[1], bounds[3]])
    parts = np.stack([raw >> np.uint64(32), raw & np.uint64(2**32 - 1)], axis=-1) / 2.0**32

    def margin(s):
        return np.minimum(0.5 * distance * s, 0.25 * (high - low))

    p = low + parts[0] * (high - low)
    s = spacing_twin(spacing, *p)
    points, spacings = [np.clip(p, low + margin(s), high - margin(s))], [s]
    parent = 0
    while parent < len(points):
        reach = pd.REACH * distance * spacings[parent]
        for part in parts[1 + parent * pd.CANDIDATES :][: pd.CANDIDATES]:
            p = points[parent] + (2 * part - 1) * reach
            s = spacing_twin(spacing, *p)
            if np.any(p < low + margin(s)) or np.any(p > high - margin(s)):
                continue
            square = ((np.array(points) - p) ** 2).sum(axis=1)
            if np.all(square >= (0.5 * distance * (s + np.array(spacings))) ** 2):
                points.append(p)
                spacings.append(s)
                if len(points) == capacity:
                    return np.array(points)
        parent += 1
    return np.array(points)


@pytest.mark.parametrize("spacing", [Spacing(1.3), GRADED])
def test_placement_is_that_of_its_twin_to_the_last_bit(spacing):
    bounds = np.array([0.0, 12.0, -4.0, 5.0])
    raw = np.random.PCG64(5).random_raw(pd.CANDIDATES * 400 + 1)
    points = np.empty((400, 2))
    n = pd.scatter(bounds, spacing.coarsest, spacing.table, spacing.growth, 0.8, raw, 0.7, points)
    assert 50 < n < 400
    np.testing.assert_array_equal(points[:n], scatter_twin(bounds, spacing, 0.8, raw, 400))


def test_a_full_placement_stops_at_its_capacity():
    raw = np.random.PCG64(5).random_raw(pd.CANDIDATES * 50 + 1)
    points = np.empty((50, 2))
    bounds = np.array([*X, *Y])
    assert pd.scatter(bounds, 1.0, Spacing(1).table, 0.1, 0.8, raw, 0.7, points) == 50
    np.testing.assert_array_equal(points, scatter_twin(bounds, Spacing(1.0), 0.8, raw, 50))


def test_points_are_the_same_on_every_machine():
    points = poisson_disc(X, Y, GRADED, seed=7)
    digest = hashlib.sha256(points.astype("<f8").tobytes()).hexdigest()
    assert (len(points), digest[:16]) == (444, "0bd1732bd09cea31")


def test_seeds_differ():
    one, two = (poisson_disc(X, Y, Spacing(1.0), seed) for seed in (0, 1))
    assert len(one) != len(two) or not np.array_equal(one, two)


@settings(derandomize=True, deadline=None, max_examples=40)
@given(st.integers(1, 3000), st.integers(0, 2**63), st.floats(0.05, 20))
def test_the_count_is_met_within_one_percent_with_no_pair_too_close(count, seed, aspect):
    x, y = (3.0, 3.0 + 10 * aspect), (-5.0, 5.0)
    spacing = Spacing(float(np.sqrt(100 * aspect / count)))
    points = poisson_disc(x, y, spacing, seed, count)
    assert abs(len(points) - count) <= 0.01 * count
    assert np.all((points > [x[0], y[0]]) & (points < [x[1], y[1]]))
    if len(points) > 1 and spacing.coarsest < min(10 * aspect, 10) / 4:
        assert cKDTree(points).query(points, 2)[0][:, 1].min() > 0.65 * spacing.coarsest


@settings(derandomize=True, deadline=None, max_examples=15)
@given(st.floats(0.02, 0.4), st.floats(0.05, 0.4), st.integers(0, 1000))
def test_distances_follow_the_spacing(finest, growth, seed):
    spacing = Spacing(1.0, (Refinement((4, 6), (-1, 3), finest),), growth)
    if finest < 0.1:
        spacing = Spacing(1.0, (Refinement((4, 4), (-1, -1), finest),), growth)
    points = poisson_disc((0, 20), (-7, 7), spacing, seed)
    wanted = spacing_twin(spacing, *points.T)
    distance, near = cKDTree(points).query(points, 7)
    assert np.all(distance[:, 1] > 0.7 * (wanted + wanted[near[:, 1]]) / 2)
    # the mean of six neighbours' distances, away from the sides, is the spacing of a hexagonal grid or so
    inner = np.all(np.abs(points - [10, 0]) < [8, 5], axis=1)
    ratio = distance[inner, 1:].mean(axis=1) / wanted[inner]
    assert np.all((ratio > 0.75) & (ratio < 1.6))
    assert 0.95 < ratio.mean() < 1.25


def test_the_number_of_points_is_what_the_spacing_asks_for():
    law = GRADED.coarsest, GRADED.table, GRADED.growth
    wanted = points_per_domain(np.array([*X, *Y]), *law, 300, 140)
    assert len(poisson_disc(X, Y, GRADED, 3)) == pytest.approx(wanted, rel=0.011)


def test_a_spacing_that_leaves_no_room_is_refused():
    with pytest.raises(ValueError, match="must leave room"):
        poisson_disc(X, Y, Spacing(100.0), 0)
