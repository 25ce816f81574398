import itertools

import numpy as np
import pytest
import xarray as xr

from pipeline.gis import symbology
from pipeline.gis.layer import Layer
from pipeline.gis.symbology import CLASSES, SCALES


def test_classes_of_depth_fit_the_run_out_and_not_the_release():
    thin, thick = (symbology.of_values("depth", "m", largest) for largest in (1.7, 40.0))
    assert thin == thick
    assert thin.edges == [0.01, 0.1, 0.25, 0.5, 1, 2, 5, np.inf]
    assert thin.caption == "depth (m)"


def test_a_model_in_a_laboratory_has_classes_of_its_own():
    style = symbology.of_values("depth", "m", 0.043)
    assert style.edges == [0.0002, 0.0005, 0.001, 0.002, 0.005, 0.01, 0.02, np.inf]


@pytest.mark.parametrize("name", [*SCALES, "time", "another quantity"])
def test_entries_leave_no_gap_and_no_colour_twice(name):
    style = symbology.of_values(name, "m", 7.3)
    for one, other in itertools.pairwise(style.entries):
        assert one.upper == other.lower > one.lower
    assert len({each.colour for each in style.entries}) == len(style.entries)


def test_differences_have_colours_to_both_sides_of_nothing():
    style = symbology.of_values("change", "m", 1.0, -3.0)
    edges = np.array(style.edges)
    np.testing.assert_allclose(edges, -edges[::-1])
    assert edges[-1] >= 3


@pytest.mark.parametrize("name", CLASSES)
def test_classes_count_from_one(name):
    style = symbology.of_classes(name, "words")
    assert [each.lower for each in style.entries] == [*range(1, len(CLASSES[name]) + 1)]


def test_times_that_are_compared_have_one_legend():
    early, late = (xr.DataArray(np.array([[last / 2, last]]), dims=("y", "x")) for last in (10.0, 80.0))
    one, other = (Layer("t", "t", "s", "time", {"": values}, largest=80.0) for values in (early, late))
    assert one.style == other.style
    assert one.style.edges[-1] >= 80


@pytest.mark.parametrize("largest", [1.5, 20.0, 100.0, 1800.0, 2100.0, 40000.0])
def test_classes_of_times_double_up_to_the_last_arrival(largest):
    entries = symbology.of_values("time", "s", largest).entries
    assert len(entries) == 8
    assert entries[0].lower == 0
    assert entries[-2].upper < largest <= entries[-1].upper
    for each in entries[1:]:
        assert 1.9 < each.upper / each.lower < 2.6
