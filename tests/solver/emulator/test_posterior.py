import numpy as np
import pytest
from known_maps import X, Y, depths, places

from solver.emulator.levels import draws
from solver.emulator.outline import measures, moved
from solver.emulator.posterior import Measured, calibration
from solver.emulator.scalars import fit_scalar


def test_a_rectangle_has_its_area_centre_spread_and_ends():
    covered = np.zeros((2, len(Y), len(X)), bool)
    covered[0, 8:13, 5:10] = True
    found = measures(covered, Y, X)
    assert found["area"].tolist()[0] == 25 * 16
    assert [found[name][0] for name in ("centroid_x", "centroid_y")] == [28, 0]
    assert [found[name][0] for name in ("first_x", "last_x", "width")] == [20, 36, 16]
    assert found["spread_x"][0] == pytest.approx(4 * np.sqrt(2))
    assert all(np.isnan(values[1]) for values in found.values())


def test_an_outline_is_moved_outward_and_inward():
    covered = np.zeros((len(Y), len(X)), bool)
    covered[8:13, 5:10] = True
    assert measures(moved(covered, Y, X, 4.0)[None], Y, X)["width"][0] == 24
    assert measures(moved(covered, Y, X, -4.0)[None], Y, X)["width"][0] == 8
    assert (moved(covered, Y, X, 0.0) == covered).all()


@pytest.fixture(scope="module")
def measured():
    at, names = places(32), ("area", "last_x", "width")
    known = measures(depths(at) > 0.1, Y, X)
    prior = draws([places(2**14, seed=9)], [1.0], 512)
    return Measured([fit_scalar([at], [known[name]], []) for name in names], prior), names


def test_intervals_hold_the_truth_as_often_as_they_say(measured):
    model, names = measured
    truths = np.random.default_rng(1).random((150, 2))
    seen = measures(depths(truths) > 0.1, Y, X)
    held, widths = np.zeros(2), []
    for i, truth in enumerate(truths):
        found = model.posterior([seen[name][i] for name in names], [0.0] * len(names))
        for j in range(2):
            low, high = found.quantiles(model.draws.at[:, j], (0.05, 0.95))
            held[j] += low <= truth[j] <= high
            widths.append(high - low)
    assert (held / 150 >= 0.84).all()
    assert (held / 150 <= 0.96).all()
    # 0.9 of the range before
    assert np.median(widths) < 0.3


def test_an_outline_that_is_not_sure_says_less(measured):
    model, names = measured
    seen = measures(depths(np.array([[0.5, 0.5]])) > 0.1, Y, X)
    observed = [seen[name][0] for name in names]
    sure, unsure = (model.posterior(observed, shift) for shift in ([0.0] * 3, [400.0, 8.0, 8.0]))
    assert unsure.effective > 1.5 * sure.effective
    assert sure.misfit < 2
    assert sure.share.sum() == pytest.approx(1)


def test_variances_are_as_large_as_errors_of_runs_that_were_not_learned_from():
    rng, measures_of, few = np.random.default_rng(0), 7, 40
    root = np.linalg.cholesky(0.5 + 0.5 * np.eye(measures_of))
    found, needed = [], []
    for _ in range(50):
        known, new = (root @ rng.standard_normal((measures_of, count)) for count in (few, 400))
        correlation = 0.9 * np.corrcoef(known) + 0.1 * np.eye(measures_of)
        needed.append(np.mean(np.sum(new * np.linalg.solve(correlation, new), axis=0)) / measures_of)
        found.append(calibration(known))
    assert np.mean(found) == pytest.approx(np.mean(needed), rel=0.05)
    # errors that are larger than they are said to be count in full, smaller ones not at all
    assert calibration(2 * known) == pytest.approx(4 * calibration(known), rel=0.3)
    assert calibration(0.5 * known) == 1
