import numpy as np
import pytest
import shapely

from solver.points.cloud import random_points
from solver.points.lattice import Lattice
from solver.release.shares import shares

CLOUD = random_points((0.0, 20.0), (-5.0, 5.0), 300, 1)
LATTICE = Lattice((0.5, 19.5), (-4.5, 4.5), 1.0)
STAR = [
    (10 + r * np.cos(k * np.pi / 5), r * np.sin(k * np.pi / 5))
    for k in range(10)
    for r in [4.5 if k % 2 else 1.5]
]
HOLE = [(10.5, 0.5), (10.5, -0.5), (9.5, -0.5), (9.5, 0.5)]


@pytest.mark.parametrize("points", [CLOUD, LATTICE], ids=["cloud", "lattice"])
def test_shares_add_up_to_the_area_of_a_polygon_with_its_hole(points):
    area = points.control_volumes.area if points is CLOUD else 1.0
    for rings, whole in (
        ([STAR], shapely.Polygon(STAR).area),
        ([STAR, HOLE], shapely.Polygon(STAR, [HOLE]).area),
    ):
        found = shares([np.array(ring) for ring in rings], points)
        assert found.shape == points.shape
        assert ((found >= 0) & (found <= 1)).all()
        assert (found * area).sum() == pytest.approx(whole, rel=1e-12)


@pytest.mark.parametrize("points", [CLOUD, LATTICE], ids=["cloud", "lattice"])
def test_a_cell_that_is_all_inside_has_a_share_of_one_to_the_last_bit(points):
    around = np.array([(-3.0, -9.0), (30.0, -9.0), (30.0, 9.0), (-3.0, 9.0)])
    assert (shares([around], points) == 1.0).all()
    assert (shares([around + np.array([100.0, 0.0])], points) == 0.0).all()


def test_two_halves_of_a_cloud_make_the_whole():
    west = np.array([(-1.0, -9.0), (8.3, -9.0), (8.3, 9.0), (-1.0, 9.0)])
    east = np.array([(8.3, -9.0), (30.0, -9.0), (30.0, 9.0), (8.3, 9.0)])
    both = shares([west], CLOUD), shares([east], CLOUD)
    np.testing.assert_allclose(both[0] + both[1], 1.0, rtol=1e-12)
    assert ((both[0] > 0) & (both[1] > 0)).any()
