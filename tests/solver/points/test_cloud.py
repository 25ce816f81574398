import numpy as np
import pytest
from clouds import clouds
from hypothesis import given, settings

from solver.points.cloud import PointCloud, given_points, graded_points, hilbert_order, named, random_points
from solver.points.spacing import Refinement

SQUARE = (0.0, 1.0), (0.0, 1.0)


def test_points_given_are_kept_in_another_order():
    points = np.random.default_rng(0).random((200, 2))
    cloud = given_points(points, *SQUARE)
    assert sorted(map(tuple, cloud.points)) == sorted(map(tuple, points))


def test_neighbours_on_the_curve_are_neighbours_in_space():
    k = (np.arange(32) + 0.5) / 32
    points = np.stack(np.meshgrid(k, k), axis=-1).reshape(-1, 2)
    walk = points[hilbert_order(points, *SQUARE)]
    np.testing.assert_allclose(np.abs(np.diff(walk, axis=0)).sum(axis=1), 1 / 32)


def test_the_curve_covers_an_oblong_domain_bounds_included():
    points = np.array([[0, 0], [30, 0], [30, 7], [0, 7], [30, 3.5]])
    assert sorted(hilbert_order(points, (0, 30), (0, 7))) == [0, 1, 2, 3, 4]


@settings(derandomize=True, deadline=None, max_examples=15)
@given(clouds())
def test_supports_are_the_nearest_points(cloud):
    near = cloud.nearest(9)
    distance = np.hypot(*(cloud.points[:, None] - cloud.points[None]).transpose(2, 0, 1))
    found = np.take_along_axis(distance, near, axis=1)
    np.testing.assert_allclose(found, np.sort(distance, axis=1)[:, :9], atol=1e-12)
    np.testing.assert_array_equal(near[:, 0], np.arange(len(cloud)))


def test_clouds_say_how_many_points_they_got():
    cloud = random_points((0, 30), (-7, 7), 1000, seed=1)
    assert 990 <= len(cloud) <= 1010
    assert cloud.mean_spacing == pytest.approx(np.sqrt(420 / len(cloud)))


def test_refinements_are_denser():
    cloud = graded_points((0, 10), (0, 10), 1.0, [Refinement((2, 4), (2, 4), 0.2)])
    inside = np.all((cloud.points > 2) & (cloud.points < 4), axis=1)
    assert inside.sum() == pytest.approx(100, rel=0.15)
    assert (~inside).sum() / 96 < 25 / 4


@pytest.mark.parametrize(
    ("points", "message"),
    [
        ([[0.1, 0.2], [0.5, 0.5], [0.9, 0.1], [0.5, 0.5]], r"coincide: 1 at \(0.5, 0.5\), 3 at \(0.5, 0.5\)"),
        ([[0.1, 0.2], [0.5, 0.5], [0.5, 0.5 + 1e-8]], r"coincide: 1 at \(0.5, 0.5\), 2 at \(0.5, 0.5\)"),
        ([[0.1, 0.2], [0.5, 1.5], [0.3, 0.3], [-1, 0.1]], r"outside .*: 1 at \(0.5, 1.5\), 3 at \(-1, 0.1\)"),
        ([[0.1, 0.2], [0.5, np.nan], [0.3, 0.3]], r"not finite: 1 at \(0.5, nan\)"),
        ([[0.1, 0.1], [0.9, 0.9], [0.3, 0.3]], r"one line, from 0 at \(0.1, 0.1\), 1 at \(0.9, 0.9\)"),
        ([[0.1, 0.1], [0.2, 0.9]], "at least 3 points, not 2"),
        ([0.1, 0.2, 0.3], r"shape \(n, 2\)"),
    ],
)
def test_points_that_make_no_cloud_are_named(points, message):
    with pytest.raises(ValueError, match=message):
        given_points(points, *SQUARE)


def test_of_many_bad_points_a_few_are_named():
    assert named(np.zeros((9, 2)), np.arange(9)).endswith("4 at (0, 0) and 4 more")


def test_bounds_must_increase():
    with pytest.raises(ValueError, match="bounds"):
        PointCloud(np.random.default_rng(0).random((5, 2)), (1.0, 0.0), (0.0, 1.0))


def test_a_cloud_that_is_too_small_is_refused():
    with pytest.raises(ValueError, match="at least 3"):
        random_points(*SQUARE, 2)
    with pytest.raises(ValueError, match="no supports of 9"):
        random_points(*SQUARE, 5).nearest(9)
