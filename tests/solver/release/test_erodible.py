"""Erodible depth on points: its volume, and how it is measured."""

import numpy as np
import pytest

from solver.physics.elevation import ElevationModel
from solver.physics.terrain import Bend, Plane
from solver.points.cloud import random_points
from solver.points.lattice import Lattice
from solver.release.erodible import erodible_on_profile, erodible_on_surface
from solver.verification.surfaces import Inclined

LATTICE = Lattice((0.0, 20.0), (-5.0, 5.0), 1.0)
CLOUD = random_points((0.0, 20.0), (-5.0, 5.0), 300, 4)
REGION = (3.3, 11.1), (-2.4, 1.9)


@pytest.mark.parametrize("points", [LATTICE, CLOUD], ids=["lattice", "cloud"])
def test_a_region_holds_its_depth_times_its_area(points):
    depth = erodible_on_profile(0.7, points, Plane(30), REGION)
    assert float((depth * points.cell_area).sum()) == pytest.approx(0.7 * 7.8 * 4.3, rel=1e-12)
    assert depth.min() == 0.0
    assert depth.max() == pytest.approx(0.7, rel=1e-12)


def test_without_a_region_all_is_erodible():
    assert (erodible_on_profile(0.7, CLOUD, Plane(30)) == 0.7).all()
    assert not erodible_on_profile(0.0, LATTICE, Plane(30), REGION).any()


def test_vertical_depths_are_larger_than_normal_ones_by_the_inclination():
    bend = Bend(40, start=5, end=15)
    depth = erodible_on_profile(0.7, LATTICE, bend, vertical=True)
    np.testing.assert_allclose(depth, 0.7 * np.cos(bend.inclination(*LATTICE.coordinates)), rtol=1e-14)
    on_surface = erodible_on_surface(0.7, LATTICE, Inclined(30.0, 40.0), vertical=True)
    np.testing.assert_allclose(on_surface, 0.7 * np.cos(np.radians(40)), rtol=1e-12)


def test_polygons_add_up_and_a_raster_counts_within_them():
    box = np.array([(2.0, -3.0), (9.5, -3.0), (9.5, 2.0), (2.0, 2.0)])
    level = Inclined(0.0, 0.0)
    twice = erodible_on_surface(None, LATTICE, level, [([box], 0.2), ([box], 0.3)])
    assert twice.sum() == pytest.approx(0.5 * 7.5 * 5.0, rel=1e-12)
    x, y = np.arange(-5.0, 26.0), np.arange(-10.0, 11.0)
    values = np.where(x < 6, 0.4, np.nan) * np.ones((len(y), 1))
    raster = ElevationModel(x, y, values, None)
    within = erodible_on_surface(raster, LATTICE, level, [([box], 9.0)])
    # the cells from 2 to 5 have data, half of the first lies in the polygon
    assert within.sum() == pytest.approx(0.4 * 3.5 * 5.0, rel=1e-12)


def test_there_is_nothing_to_erode_where_nothing_is_known():
    x, y = np.arange(-3.0, 24.0), np.arange(-8.0, 9.0)
    elevation = np.zeros((len(y), len(x)))
    elevation[:, x > 12] = np.nan
    depth = erodible_on_surface(0.7, LATTICE, ElevationModel(x, y, elevation))
    assert (depth[:, LATTICE.x_points <= 12] == 0.7).all()
    assert not depth[:, LATTICE.x_points > 12].any()
