import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from pipeline.assess.probability import Values, in_words

NO = np.zeros(5, bool)
FIFTHS = np.full(5, 0.2)


def values(*value, weight=FIFTHS, at_least=NO, at_most=NO):
    return Values(np.array(value), np.asarray(weight), np.asarray(at_least), np.asarray(at_most))


def test_what_is_not_known_may_exceed_or_not():
    found = values(1.0, 2.0, 3.0, 4.0, np.nan).exceedance([0, 2.5, 4])
    assert found.lower == pytest.approx([0.8, 0.4, 0])
    assert found.estimate == pytest.approx([1, 0.5, 0])
    assert found.upper == pytest.approx([1, 0.6, 0.2])


def test_a_run_that_lost_material_may_reach_farther():
    found = values(1.0, 2.0, 3.0, 4.0, 5.0, at_least=[True, False, False, False, True]).exceedance([2.5, 9])
    assert found.lower == pytest.approx([0.6, 0])
    assert found.upper == pytest.approx([0.8, 0.4])


def test_weights_count():
    found = values(1.0, 2.0, 3.0, 4.0, 5.0, weight=[0.5, 0.1, 0.1, 0.1, 0.2])
    assert found.exceedance(1.5).estimate == pytest.approx(0.5)
    assert found.quantile([0.4, 0.55, 0.95]).estimate.tolist() == [1, 2, 5]


def test_bounds_of_a_quantile_put_what_is_not_known_below_or_above_all():
    found = values(1.0, 2.0, 3.0, 4.0, np.nan).quantile([0.5, 0.9])
    assert found.lower.tolist() == [2, 4]
    assert found.upper.tolist() == [3, np.inf]
    # nothing is said of the runs that are left where those that are not could change it without a limit
    assert found.estimate[0] == 2
    assert np.isnan(found.estimate[1])


def test_without_a_run_nothing_is_known():
    found = values(*[np.nan] * 5)
    assert np.isnan(found.exceedance(1.0).estimate)
    assert (found.exceedance(1.0).lower, found.exceedance(1.0).upper) == (0, 1)
    assert np.isnan(found.quantile(0.5).estimate)


@settings(max_examples=200, derandomize=True, deadline=None)
@given(
    st.lists(st.floats(0, 10), min_size=5, max_size=5),
    st.lists(st.booleans(), min_size=5, max_size=5),
    st.floats(0, 10),
    st.sampled_from([0.1, 0.3, 0.5, 0.7, 0.9]),
)
def test_bounds_hold_whatever_the_unknown_runs_are(value, unknown, threshold, share):
    whole = values(*value)
    held = values(*np.where(unknown, np.nan, value))
    bounds = held.exceedance(threshold)
    # to the last digit, as people compare them
    assert np.isnan(bounds.estimate) or bounds.lower <= bounds.estimate <= bounds.upper
    assert bounds.lower - 1e-12 <= whole.exceedance(threshold).estimate <= bounds.upper + 1e-12
    true, bounds = whole.quantile(share).estimate, held.quantile(share)
    assert not bounds.lower > true
    assert not bounds.upper < true


def test_a_probability_is_its_own_bound_where_all_is_known():
    found = Values(np.arange(100.0), np.full(100, 0.01), *np.zeros((2, 100), bool)).exceedance([48.5, 8.5])
    assert found.estimate.tolist() == found.lower.tolist() == found.upper.tolist() == [0.51, 0.91]


@pytest.mark.parametrize(
    ("bounds", "words"),
    [
        ((120.0, 120.0, 120.0), "120"),
        ((118.0, 120.0, 123.0), "120 (118 to 123)"),
        ((136.0, np.nan, np.inf), "above 136"),
        ((-np.inf, np.nan, 22.0), "below 22"),
        ((-np.inf, np.nan, np.inf), "unknown"),
        ((-np.inf, -np.inf, -np.inf), "none"),
    ],
)
def test_quantiles_are_said_with_what_is_known_of_them(bounds, words):
    assert in_words(*bounds) == words
