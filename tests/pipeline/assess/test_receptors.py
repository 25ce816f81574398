import numpy as np
import pytest
import xarray as xr

from pipeline.assess.receptors import Cells
from pipeline.settings.receptor import Receptor


@pytest.fixture
def cells():
    """4 x 3 cells of 2 m by 1 m, numbered row by row."""
    return Cells(xr.Dataset(coords={"y": [0.0, 1.0, 2.0], "x": [0.0, 2.0, 4.0, 6.0]}))


def of(cells, **place):
    return cells.of(Receptor(name="a", **place)).tolist()


def test_a_point_is_in_the_cell_that_holds_it(cells):
    assert of(cells, point=(2.9, 1.4)) == [5]
    assert of(cells, point=(3.1, 1.6)) == [10]


def test_a_line_is_in_all_cells_that_it_crosses(cells):
    assert of(cells, line=((0.0, 0.0), (6.0, 0.0))) == [0, 1, 2, 3]
    assert of(cells, line=((2.0, 2.0), (2.0, 0.0), (4.0, 0.0))) == [1, 2, 5, 9]


def test_an_area_is_in_all_cells_that_it_holds_or_touches(cells):
    assert of(cells, polygon=((0.9, 0.4), (5.1, 0.4), (5.1, 1.4), (0.9, 1.4))) == [0, 1, 2, 3, 4, 5, 6, 7]
    assert of(cells, polygon=((1.5, 0.6), (2.5, 0.6), (2.0, 1.4))) == [5]


def test_cells_of_a_cloud_are_those_of_the_nearest_point():
    points = np.array([[0.0, 0.0], [3.0, 0.0], [1.0, 2.0]])
    area = ("point", [1.0, 1.0, 1.0])
    store = xr.Dataset(coords={"x": ("point", points[:, 0]), "y": ("point", points[:, 1]), "area": area})
    assert of(Cells(store), point=(1.4, 0.1)) == [0]
    assert of(Cells(store), line=((0.0, 0.0), (3.0, 0.0))) == [0, 1]
