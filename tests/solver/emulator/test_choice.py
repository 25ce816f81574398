import numpy as np
import pytest
from known_maps import places

from solver.emulator.choice import most_telling
from solver.emulator.exceedance import exceedance
from solver.emulator.levels import draws, fit_levels
from solver.emulator.scores import exceedance_score

RARE = 1.6


def output(at):
    return (at[:, 0] + at[:, 1] + 0.2 * np.sin(5 * at[:, 0]) * at[:, 1])[:, None]


OVER = draws([places(4096, seed=9)], [1.0], 512)


def emulated(at, counted):
    levels = fit_levels([at], [output(at)])
    weight = np.where(np.arange(len(at)) < counted, 1 / counted, 0.0)
    return exceedance(levels, RARE, OVER, weight)


@pytest.fixture(scope="module")
def few():
    return places(32)


@pytest.fixture(scope="module")
def chosen(few):
    return most_telling(fit_levels([few], [output(few)]), RARE, OVER, 8)


def test_each_draw_is_chosen_once_and_near_to_where_the_output_passes_the_level(chosen):
    assert len(set(chosen.tolist())) == 8
    distance = np.abs(output(OVER.at[chosen])[:, 0] - RARE)
    anywhere = np.abs(output(OVER.at)[:, 0] - RARE)
    assert np.median(distance) < 0.25 * np.median(anywhere)


def test_chosen_runs_leave_less_open_than_as_many_of_the_design(few, chosen):
    known = float((output(places(2**16, seed=5)) > RARE).mean())
    assert 0.01 < known < 0.05
    more = emulated(np.concatenate([few, OVER.at[chosen]]), 32)
    even = emulated(places(64)[:40], 40)
    assert abs(float(more.probability[0]) - known) <= more.sampling[0]
    assert more.variance[0] < 0.5 * even.variance[0]


def test_no_run_is_chosen_again(few):
    over = draws([np.concatenate([few, places(64)[-4:]])], [1.0], 16)
    found = most_telling(fit_levels([few], [output(few)]), RARE, over, 8)
    assert sorted(found.tolist()) == [32, 33, 34, 35]


def test_the_variance_that_is_left_does_not_depend_on_what_is_chosen_next(few, chosen):
    # the first ones of a longer choice are those of a shorter one
    longer = most_telling(fit_levels([few], [output(few)]), RARE, OVER, 12)
    assert longer[:8].tolist() == chosen.tolist()


def test_more_runs_than_are_looked_at_by_default_can_be_chosen(few):
    found = most_telling(fit_levels([few], [output(few)]), RARE, OVER, 1030)
    assert len(set(found.tolist())) == 1030


def test_runs_without_weight_are_in_no_brier_score_but_may_judge_the_emulator():
    mean, deviation = np.zeros((4, 1)), np.ones((4, 1))
    above = np.array([[False], [False], [True], [True]])
    sample = exceedance_score(above, mean, deviation, 0.0, np.array([0.5, 0.5, 0.0, 0.0]))
    assert sample.brier == pytest.approx([0.25])
    assert np.isnan(sample.ratio)
    judged = exceedance_score(above, mean, deviation, 0.0, np.full(4, 0.25))
    assert judged.ratio == pytest.approx(0.25 / (0.25 * 16 / 9))
