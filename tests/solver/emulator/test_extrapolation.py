import numpy as np
import pytest
from known_maps import X, Y, depths, places

from solver.emulator.exceedance import exceedance
from solver.emulator.extrapolation import Beyond, at_place, beyond, on_lattice
from solver.emulator.fields import FieldLevel, choose
from solver.emulator.levels import draws, fit_levels

THRESHOLD, MISSING = 0.5, 8
SPACING = float(Y[1] - Y[0]), float(X[1] - X[0])


@pytest.fixture(scope="module")
def runs():
    """Runs without those of the largest second parameter, and draws beyond them."""
    at = places(64)
    order = np.argsort(at[:, 1])
    known, missing = at[order[:-MISSING]], at[order[-MISSING:]]
    over = draws([places(4096, seed=9)], [1.0], 512)
    return known, over, beyond(over, missing, known)


def test_draws_beyond_are_those_near_to_missing_runs(runs):
    known, _, past = runs
    assert past.share == pytest.approx(MISSING / 64, abs=0.03)
    assert past.at[:, 1].min() > np.sort(known[:, 1])[-MISSING]
    assert len(past.outermost) == MISSING
    assert known[past.outermost, 1].min() > np.median(known[:, 1])


def test_without_missing_runs_outside_nothing_lies_beyond(runs):
    known, over, _ = runs
    assert beyond(over, np.empty((0, 2)), known) is None


def test_intervals_hold_the_truth_where_the_largest_runs_are_missing(runs):
    known, over, past = runs
    weight = np.full(len(known), 1 / len(known))
    spot = {"far": np.array([10 * len(X) + 21])}
    maps, spots = choose([FieldLevel(known, depths(known), Y, X, spot)], [THRESHOLD], weight)
    each, one = maps[THRESHOLD], spots["far", THRESHOLD]
    truth = (depths(places(8192, seed=11)) > THRESHOLD).mean(axis=0).ravel()
    open_ended = (truth > 0.01) & (truth < 0.99)
    found = exceedance(each.levels, each.level, over, weight)
    added = on_lattice(each.levels, each.level, past, depths(known).shape[1:], SPACING)
    half = np.hypot(found.sampling, added)
    error = np.abs(found.probability - truth)[open_ended]
    assert np.mean(error <= half[open_ended]) > 0.95
    # nowhere more than all draws beyond
    assert (added >= 0).all()
    assert added.max() <= past.share
    assert added.mean() < past.share / 4
    place = at_place(one.levels, one.level, past)
    assert 0 < place[0] <= past.share
    assert (
        abs(exceedance(one.levels, one.level, over, weight).probability[0] - truth[10 * len(X) + 21]) <= 0.05
    )


def test_outermost_runs_that_alone_have_a_value_are_predicted_by_what_the_others_tell():
    at = np.concatenate([places(64), np.zeros((64, 1))], axis=1)
    rows = np.array([5, 9, 20, 33])
    at[rows, 2] = 1.0
    held = depths(at[:, :2])[:, 10, 18:19]
    levels = fit_levels([at], [held])
    half = at_place(levels, THRESHOLD, Beyond(at[rows], 0.1, rows))
    # the value does nothing, and the others tell the runs right
    assert half == pytest.approx([0.1 * np.sqrt(0.25 / 5)])
