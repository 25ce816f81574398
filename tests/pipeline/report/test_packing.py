import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from hypothesis.extra import numpy as hnp

from pipeline.report.packing import MISSING, coarser, pack, rounded_up, step_of, times, unpacked


@given(hnp.arrays(np.uint16, hnp.array_shapes(min_dims=1, max_dims=3, max_side=7)))
def test_what_is_packed_is_read_again(values):
    np.testing.assert_array_equal(unpacked(pack(values), values.shape), values)


@given(
    hnp.arrays(np.float32, 20, elements=st.floats(0, 60, width=32)),
    st.integers(1, 600),
    st.sampled_from([0.01, 0.1, 0.001]),
)
def test_a_value_is_above_a_threshold_as_it_was_before(values, number, step):
    threshold = round(number * step, 10)
    # the thresholds themselves too
    values = np.append(values, np.float32(threshold))
    above = values.astype(np.float64) > threshold
    np.testing.assert_array_equal(rounded_up(values, step) > number, above)


def test_what_is_thin_is_not_dry_and_what_is_missing_is_said():
    found = rounded_up(np.array([0, 1e-6, 0.02, np.nan]), 0.01)
    assert found.tolist() == [0, 1, 2, MISSING]


def test_times_are_never_late():
    assert times(np.array([np.nan, 0.0, 3.99]), 1.0).tolist() == [0, 1, 4]


@pytest.mark.parametrize(("largest", "step"), [(40.0, 0.01), (1.7, 0.01), (0.03, 1e-4), (0.0, 0.01)])
def test_steps_are_a_hundredth_of_what_there_is(largest, step):
    assert step_of(largest, 0.01) == pytest.approx(step)


def test_blocks_keep_their_largest():
    values = np.arange(15, dtype=np.uint16).reshape(3, 5)
    assert coarser(values, 2).tolist() == [[6, 8, 9], [11, 13, 14]]
    assert coarser(values, 1) is values


def test_smooth_fields_take_few_bytes():
    x, y = np.meshgrid(np.linspace(-1, 1, 300), np.linspace(-1, 1, 150))
    field = rounded_up(np.maximum(0, 2 - 4 * (x**2 + y**2)), 0.01)
    assert len(pack(field)) < 0.25 * field.size
