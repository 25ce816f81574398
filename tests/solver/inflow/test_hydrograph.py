"""Hydrographs: discharge and volume by time."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

import solver
from solver.inflow.hydrograph import Hydrograph

GRAPH = Hydrograph(np.array([2.0, 4.0, 10.0]), np.array([1.0, 3.0, 0.0]))


def test_discharge_is_linear_between_times_and_zero_outside():
    assert [GRAPH.volume_until(t) for t in (0, 2, 3, 4, 10, 99)] == pytest.approx([0, 0, 1.5, 4, 13, 13])
    assert [GRAPH.peak_until(t) for t in (1, 2, 3, 5)] == pytest.approx([0, 1, 2, 3])


def test_nothing_comes_in_after_the_last_discharge():
    assert GRAPH.last == 10
    assert Hydrograph(np.array([0.0, 1, 2, 3]), np.array([0.0, 1, 0, 0])).last == 2
    assert Hydrograph(np.array([0.0, 1]), np.zeros(2)).last == -np.inf


@pytest.mark.parametrize(
    ("times", "discharges", "said"),
    [
        ([0, 0], [1, 1], "increase"),
        ([-1, 0], [1, 1], "increase"),
        ([0, 1], [1, -1], "negative"),
        ([0, 1], [1, np.nan], "finite"),
        ([0], [1], "two or more"),
    ],
)
def test_what_is_no_hydrograph_is_refused(times, discharges, said):
    with pytest.raises(ValueError, match=said):
        Hydrograph(np.array(times, float), np.array(discharges, float))


@given(st.floats(1, 1e6), st.floats(0.1, 1e3), st.floats(0.01, 0.99), st.floats(0, 1e3))
def test_a_triangle_has_its_volume_and_peak(volume, peak, rise, start):
    graph = solver.Triangle(volume, peak, rise, start).hydrograph()
    assert graph.volumes[-1] == pytest.approx(volume, rel=1e-9)
    assert graph.discharges.max() == peak
    assert graph.times[0] == start


@pytest.mark.parametrize(
    "changed", [{"volume": 0}, {"peak_discharge": -1}, {"peak_discharge": "x"}, {"rise": 1}]
)
def test_parameters_of_a_triangle_have_bounds(changed):
    with pytest.raises(solver.ParameterError):
        solver.Triangle(**({"volume": 1.0, "peak_discharge": 1.0} | changed))
