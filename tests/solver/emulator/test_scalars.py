import numpy as np
import pytest
from known_maps import places
from scipy import stats

from solver.emulator import support
from solver.emulator.extrapolation import inside
from solver.emulator.levels import draws
from solver.emulator.scalars import fit_scalar, quantiles

SHARES = (0.05, 0.5, 0.95)
OVER = draws([places(8192, seed=9)], [1.0], 512)


def test_quantiles_of_a_known_distribution_are_met_within_their_errors():
    at, weight = places(32), np.full(32, 1 / 32)
    # uniform along the first input whatever the second one is
    scalar = fit_scalar([at], [100 + 50 * at[:, 0] + 10 * np.sin(6 * at[:, 1])], [])
    found = quantiles(scalar, SHARES, OVER, weight)
    many = places(2**16, seed=4)
    known = np.quantile(100 + 50 * many[:, 0] + 10 * np.sin(6 * many[:, 1]), SHARES)
    assert (np.abs(found.values - known) <= found.sampling).all()
    assert (np.abs(found.values - known) < 1.5).all()
    assert np.isnan(found.discretisation).all()
    assert support.of_scalar(scalar.score).word == "supported"


def test_a_heavy_tail_is_emulated_by_its_logarithm():
    at = places(64)
    values = np.exp(stats.norm.ppf(np.clip(at[:, 0], 0.01, 0.99)) + at[:, 1])
    assert fit_scalar([at], [values], []).logarithm
    assert not fit_scalar([at], [values - 3], []).logarithm


def test_two_levels_have_an_allowance_for_their_spacing():
    at, weight = places(32), np.full(32, 1 / 32)
    coarse = 100 + 50 * at[:, 0]
    scalar = fit_scalar([at, at[:8]], [coarse, coarse[:8] + 7 + at[:8, 1]], [np.arange(8)])
    found = quantiles(scalar, SHARES, OVER, weight)
    known = 100 + 50 * np.array(SHARES) + 7.5
    assert (np.abs(found.values - known) < 1).all()
    assert found.discretisation == pytest.approx(15, abs=1)
    assert found.total == pytest.approx(found.sampling + found.discretisation)


def test_a_jump_and_noise_are_told():
    at = places(64)
    jump = fit_scalar([at], [np.where(at[:, 0] > 0.83, 50.0, 0.0) + at[:, 1]], []).score
    assert support.of_scalar(jump).refused or support.jumps(jump)
    noise = fit_scalar([at], [np.random.default_rng(0).normal(size=64)], []).score
    assert support.of_scalar(noise).refused.startswith("Q2 ")


def test_places_outside_of_all_others_are_told():
    square = np.array([[0.0, 0.0], [0, 1], [1, 0], [1, 1]])
    asked = np.array([[0.5, 0.5], [0.99, 0.01], [1.01, 0.5], [-1, -1]])
    assert inside(asked, square).tolist() == [True, True, False, False]


@pytest.mark.parametrize(
    ("runs", "inputs", "few"), [(31, 2, True), (32, 3, False), (59, 6, True), (60, 6, False)]
)
def test_runs_are_too_few_below_32_or_10_an_input(runs, inputs, few):
    assert bool(support.of_runs(runs, inputs)) == few


def test_pairs_are_too_few_below_4_and_few_below_8():
    assert [support.of_pairs(count)[0] for count in (3, 4, 8)] == [False, True, True]
    assert [bool(support.of_pairs(count)[1]) for count in (4, 7, 8)] == [True, True, False]
