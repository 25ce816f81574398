import numpy as np
import pytest

from pipeline.inputs.polygons import crossing, inside, overlaps, uncovered, width
from solver.release.polygons import ring_area


def box(west, south, east, north):
    return np.array([(west, south), (east, south), (east, north), (west, north)], dtype=float)


def area(rings):
    return sum(map(ring_area, rings))


def test_later_layers_lie_over_earlier_ones():
    found = uncovered([[(box(0, 0, 4, 4),)], [(box(2, 0, 6, 4),)], [(box(3, 1, 4, 2),)]])
    assert [area(rings) for rings in found] == pytest.approx([8, 15, 1])


def test_polygons_of_a_layer_count_once_and_holes_stay_holes():
    ring = (box(0, 0, 4, 4), box(1, 1, 3, 3)[::-1])
    found = uncovered([[(box(0, 0, 10, 10),)], [ring, (box(3.5, 0, 5, 4),)]])
    assert area(found[1]) == pytest.approx(12 + 4)
    assert area(found[0]) == pytest.approx(100 - 16)


def test_what_is_covered_wholly_is_nothing():
    assert uncovered([[(box(0, 0, 1, 1),)], [(box(-1, -1, 2, 2),)]])[0] == []


@pytest.mark.parametrize(
    ("corners", "said"),
    [
        ([(0, 0), (1, 0), (1, 1)], ""),
        ([(0, 0), (1, 0), (0, 1), (1, 1)], "Self-intersection"),
        ([(0, 0), (1, 0), (2, 0)], "one of no area"),
    ],
)
def test_corners_have_to_make_a_simple_polygon(corners, said):
    assert crossing(corners).startswith(said)
    assert bool(crossing(corners)) == bool(said)


def test_overlaps_are_those_of_areas_the_largest_first():
    hole = box(2, 2, 4, 4)[::-1]
    polygons = [[box(0, 0, 10, 10), hole], [box(8, 0, 12, 10)], [box(2, 2, 4, 4)], [box(12, 0, 14, 10)]]
    # what touches, or lies in a hole, does not overlap
    assert overlaps(polygons) == [(20.0, 0, 1)]
    assert overlaps([*polygons, [box(0, 0, 5, 10)]])[0] == (46.0, 0, 4)
    assert overlaps([]) == overlaps([[box(0, 0, 1, 1)]]) == []


def test_the_width_of_a_polygon_is_that_of_its_widest_part():
    assert width([box(0, 0, 60, 0.5)]) == pytest.approx(0.5)
    assert width([box(0, 0, 10, 10)]) == pytest.approx(10)
    assert width([box(0, 0, 60, 0.5), box(0, 10, 60, 14)]) == pytest.approx(4)


def test_what_lies_in_a_hole_is_not_inside():
    outer = np.array([[0, 0], [10, 0], [10, 10], [0, 10]], float)
    hole = np.array([[4, 4], [4, 6], [6, 6], [6, 4]], float)
    places = np.array([[2, 5], [5, 5], [8, 5], [12, 5]], float)
    assert inside([outer, hole], places).tolist() == [True, False, True, False]
