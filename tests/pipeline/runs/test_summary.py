import numpy as np
import pytest

from pipeline.runs.summary import overrun, summarise
from pipeline.store.variables import SUMMARIES
from solver.points.lattice import Lattice

LATTICE = Lattice((0.0, 10.0), (-2.0, 2.0), 0.5)
X, Y = np.meshgrid(LATTICE.x_points, LATTICE.y_points)


def box(x: tuple[float, float], y: tuple[float, float], depth: float) -> np.ndarray:
    return np.where((x[0] <= X) & (x[1] >= X) & (y[0] <= Y) & (y[1] >= Y), depth, 0.0)


def summaries(deposit: np.ndarray, release: np.ndarray, threshold: float = 0.01) -> dict[str, float]:
    slope = np.radians(30)
    x = LATTICE.x_points
    return summarise(
        LATTICE, -x * np.sin(slope), x * np.cos(slope), release, deposit, deposit + 1, X + Y, threshold
    )


def test_a_box_of_deposit_has_the_extent_of_its_points():
    found = summaries(box((4, 7), (-1, 0.5), 0.2), box((1, 2), (-1, 1), 1.0))
    assert found == pytest.approx(
        {
            "front_x": 7,
            "tail_x": 4,
            "deposit_length": 3,
            "deposit_width": 1.5,
            "deposit_area": 7 * 4 * 0.25,
            "deposit_volume": 7 * 4 * 0.25 * 0.2,
            "deposit_max_depth": 0.2,
            "deposit_centroid_x": 5.5,
            "runout_distance": 6 * np.cos(np.radians(30)),
            "drop_height": 3,
            "reach_angle": 30,
            "peak_depth": 1.2,
            "peak_speed": 12,
        }
    )
    assert set(found) == {v.name for v in SUMMARIES}


def test_what_is_not_above_the_threshold_is_no_deposit():
    film = box((0, 10), (-2, 2), 0.01)
    found = summaries(np.maximum(film, box((4, 5), (0, 0), 0.3)), box((1, 2), (0, 0), 1.0))
    assert (found["tail_x"], found["front_x"]) == (4, 5)


def test_the_crown_is_the_highest_point_of_the_release():
    x = LATTICE.x_points
    hill = -np.abs(x - 3)
    found = summarise(LATTICE, hill, x, box((1, 6), (0, 0), 1.0), box((8, 9), (0, 0), 1.0), X, X, 0.01)
    assert (found["runout_distance"], found["drop_height"]) == (6, 6)
    assert found["reach_angle"] == pytest.approx(45)


def test_no_deposit_has_no_place_but_an_area_of_zero():
    found = summaries(np.zeros(LATTICE.shape), box((1, 2), (0, 0), 1.0))
    assert found == {"deposit_area": 0, "deposit_volume": 0, "peak_depth": 1, "peak_speed": 12}


def test_what_overran_is_what_left_open_sides():
    row = {"volume_out": 3.0, "volume_out_open": 1.0, "volume_released": 8.0, "volume_in": 2.0}
    assert overrun(row) == 0.1
