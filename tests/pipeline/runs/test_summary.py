import numpy as np
import pytest

from pipeline.runs.summary import affected_area, overrun, summarise
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
            "flow_front_x": 10,
            "flow_runout_distance": 9 * np.cos(np.radians(30)),
            "peak_depth": 1.2,
            "peak_speed": 12,
        }
    )
    assert set(found) == {v.name for v in SUMMARIES} - {
        "lowest_elevation",
        "lifted_share",
        "flow_path_length",
        "affected_area",
    }


def test_the_area_that_the_flow_reached_is_in_plan():
    reached = box((4, 7), (-1, 0.5), 1.0) > 0
    assert affected_area(LATTICE, reached) == 7 * 4 * 0.25
    # 60 degrees from x = 6 on, which are 3 of the 7 columns
    inclination = np.where(LATTICE.x_points < 6, 0.0, np.radians(60))
    assert affected_area(LATTICE, reached, inclination) == pytest.approx((4 + 3 / 2) * 4 * 0.25)
    assert affected_area(LATTICE, np.zeros(LATTICE.shape, bool)) == 0


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
    flow = {"flow_front_x": 10, "flow_runout_distance": pytest.approx(9 * np.cos(np.radians(30)))}
    assert found == {"deposit_area": 0, "deposit_volume": 0, "peak_depth": 1, "peak_speed": 12, **flow}


def flow(
    bed: np.ndarray, release: np.ndarray, reached: np.ndarray, deposit: np.ndarray, distance=LATTICE.x_points
) -> dict[str, float]:
    return summarise(LATTICE, bed, distance, release, deposit, reached, X, 0.01)


# a slope of 1 in 2 down to x = 6, level beyond; its mirror image falls against x
SLOPE = np.maximum(6 - LATTICE.x_points, 0) / 2
RELEASE, REACHED, DEPOSIT = box((1, 2), (-1, 1), 1), box((1, 8.5), (-1, 1), 1), box((5, 8), (-1, 1), 0.2)


def test_a_profile_digitised_from_below_has_the_same_run_out():
    down = flow(SLOPE, RELEASE, REACHED, DEPOSIT)
    up = flow(SLOPE[::-1], *(field[:, ::-1] for field in (RELEASE, REACHED, DEPOSIT)))
    assert (down["runout_distance"], down["drop_height"], down["flow_runout_distance"]) == (7, 2.5, 7.5)
    places = ("front_x", "tail_x", "flow_front_x", "deposit_centroid_x")
    assert [up[name] for name in places] == pytest.approx([10 - down[name] for name in places])
    kept = set(down) - {*places, "peak_speed"}
    assert {name: up[name] for name in kept} == pytest.approx({name: down[name] for name in kept})


@pytest.mark.parametrize("mirrored", [False, True])
def test_the_crown_of_a_flat_release_is_its_upslope_edge(mirrored):
    bed = np.where(X[0] < 4, 3.0, 3.0 - (X[0] - 4) / 4)
    fields = [box((1, 3), (-1, 1), 1), box((0.5, 9), (-1, 1), 1), box((6, 8), (-1, 1), 1)]
    if mirrored:
        bed, fields = bed[::-1], [field[:, ::-1] for field in fields]
    # round-off in elevations must not choose
    found = flow(bed + 1e-14 * np.random.default_rng(1).random(len(bed)), *fields)
    assert found["runout_distance"] == pytest.approx(7)
    assert found["flow_runout_distance"] == pytest.approx(8)


@pytest.mark.parametrize("mirrored", [False, True])
def test_a_flow_that_leaves_the_points_goes_where_its_bed_falls(mirrored):
    """What is left lies behind the release, and says nothing of where the rest went."""
    bed, fields = 5 - X[0] / 2, [box((8, 10), (-1, 1), 1), box((7, 10), (-1, 1), 1), box((7, 9), (-1, 1), 1)]
    if mirrored:
        bed, fields = bed[::-1], [field[:, ::-1] for field in fields]
    found = flow(bed, *fields)
    assert found["runout_distance"] == pytest.approx(1)
    assert found["flow_runout_distance"] == pytest.approx(2)


def test_a_flow_that_climbs_the_other_side_of_its_valley_ends_there():
    found = flow(np.abs(X[0] - 5) / 2, RELEASE, REACHED, DEPOSIT)
    assert (found["runout_distance"], found["drop_height"]) == (7, 0.5)


def test_of_a_heap_that_stays_the_toe_is_its_lower_end():
    found = flow(SLOPE[::-1], *(3 * [box((7, 8), (-1, 1), 1)]))
    assert (found["front_x"], found["runout_distance"]) == (7, 1)


def test_what_overran_is_what_left_open_sides():
    row = {"volume_out": 3.0, "volume_out_open": 1.0, "volume_released": 8.0, "volume_in": 2.0}
    assert overrun(row) == 0.1
