"""Clouds fitted to outlines: cells end at them, at corners too, and what is too fine is left as it is."""

import numpy as np
import pytest

from solver.points.cloud import graded_points, random_points
from solver.points.spacing import Refinement
from solver.release.shares import shares
from solver.structures import building_cells

BOUNDS = (-20.0, 20.0), (-15.0, 15.0)
RECTANGLE = np.array([[-4.0, -5.0], [6.0, -5.0], [6.0, 1.0], [-4.0, 1.0]])
THIN = np.array([[10.0, -6.0], [10.7, -6.0], [10.7, 8.0], [10.0, 8.0]])
CORNERED = np.array([[0, 0], [8, 0], [8, 3], [3, 3], [3, 7], [0, 7.0]])


def turned(ring, degrees, place=(0.0, 0.0)):
    c, s = np.cos(np.radians(degrees)), np.sin(np.radians(degrees))
    return ring @ np.array([[c, s], [-s, c]]) + place


@pytest.mark.parametrize(
    "ring",
    [
        RECTANGLE,
        THIN,
        turned(CORNERED, 25.0, (-15.0, 2.0)),
        turned(np.array([[0, 0], [9, 0], [4, 7.0]]), 10.0),
        turned(np.array([[0, 0], [6, 0], [8, 4], [4, 7], [-2, 4.0]]), 40.0),
    ],
    ids=["rectangle", "thin", "corner inside", "triangle", "obtuse"],
)
@pytest.mark.parametrize("seed", [1, 2])
def test_cells_end_at_the_edges_and_corners(ring, seed):
    cloud = random_points(*BOUNDS, 1200, seed, [ring])
    part = shares([ring], cloud)
    assert ((part > 1e-9) & (part < 1 - 1e-9)).sum() == 0
    built = building_cells([ring], cloud)
    x, y = ring.T
    area = abs(0.5 * (x * np.roll(y, -1) - np.roll(x, -1) * y).sum())
    assert cloud.cell_area[built].sum() == pytest.approx(area, rel=1e-9)
    # and are about as large as others
    assert cloud.cell_area[~built].min() > 0.3 * cloud.mean_spacing**2
    assert abs(len(cloud) - 1200) < 0.05 * 1200


def test_the_spacing_is_that_of_the_place():
    near = [Refinement((2.0, 20.0), (-15.0, 15.0), 0.6)]
    cloud = graded_points(*BOUNDS, 1.2, near, seed=4, outlines=[RECTANGLE])
    part = shares([RECTANGLE], cloud)
    assert ((part > 1e-9) & (part < 1 - 1e-9)).sum() == 0
    x, y = cloud.points.T
    beside = (abs(y - 1.5) < 0.7) & (y > 1)
    size = np.sqrt(cloud.cell_area)
    assert size[beside & (x > 2) & (x < 6)].mean() == pytest.approx(0.6, rel=0.2)
    assert size[beside & (x > -4) & (x < -2)].mean() == pytest.approx(1.0, rel=0.25)


def test_what_is_finer_than_the_spacing_costs_no_small_cells():
    turns = np.arange(90) * 2 * np.pi / 90
    circle = 2.5 * np.stack([np.cos(turns), np.sin(turns)], axis=1)
    sliver = np.array([[8.0, -5.0], [8.1, -5.0], [8.1, 5.0], [8.0, 5.0]])
    beside = THIN + np.array([1.1, 0.0])
    for rings in (
        [circle],
        [sliver],
        [THIN, beside],
        [circle + np.array([19.0, 0.0])],
        [RECTANGLE, RECTANGLE + 0.3],
    ):
        cloud = random_points(*BOUNDS, 1200, 3, rings)
        assert cloud.cell_area.min() > 0.1 * cloud.mean_spacing**2
    cloud = random_points(*BOUNDS, 1200, 3, [circle])
    built = building_cells([circle], cloud)
    assert cloud.cell_area[built].sum() == pytest.approx(np.pi * 2.5**2, rel=0.1)


def test_without_outlines_points_are_where_they_were():
    np.testing.assert_array_equal(
        random_points(*BOUNDS, 500, 7).points, random_points(*BOUNDS, 500, 7, []).points
    )
    elsewhere = random_points(*BOUNDS, 500, 7, [RECTANGLE + np.array([100.0, 0.0])])
    np.testing.assert_array_equal(elsewhere.points, random_points(*BOUNDS, 500, 7).points)
