import numpy as np
import pytest
from known_maps import X, Y, depths, places
from scipy.special import ndtr, ndtri

from solver.emulator import support
from solver.emulator.exceedance import exceedance, exceedances, over_paths
from solver.emulator.fields import FieldLevel, choose
from solver.emulator.latent import WET, Latent
from solver.emulator.levels import Predictor, draws, fit_levels
from solver.emulator.mixtures import below
from solver.emulator.scores import exceedance_score

THRESHOLDS = (0.25, 0.5, 1.0)


def level(at, pairs=None, **more):
    spots = {"far": np.array([10 * len(X) + 20, 10 * len(X) + 19])}
    return FieldLevel(at, depths(at, **more), Y, X, spots, pairs)


@pytest.fixture(scope="module")
def found():
    at, weight = places(64), np.full(64, 1 / 64)
    maps, spots = choose([level(at)], THRESHOLDS, weight)
    over = draws([places(4096, seed=9)], [1.0], 512)
    return {
        **{key: exceedance(each.levels, each.level, over, weight) for key, each in maps.items()},
        **{key: exceedance(each.levels, each.level, over, weight) for key, each in spots.items()},
    }


@pytest.fixture(scope="module")
def truth():
    return depths(places(8192, seed=11))


@pytest.mark.parametrize("threshold", THRESHOLDS)
def test_maps_are_nearer_to_the_truth_than_shares_and_their_intervals_hold_it(found, truth, threshold):
    known = (truth > threshold).mean(axis=0).ravel()
    open_ended = (known > 0.01) & (known < 0.99)
    error = (found[threshold].probability - known)[open_ended]
    plain = ((depths(places(64)) > threshold).mean(axis=0).ravel() - known)[open_ended]
    assert np.sqrt(np.mean(error**2)) < 0.6 * np.sqrt(np.mean(plain**2))
    assert np.mean(np.abs(error) <= found[threshold].sampling[open_ended]) > 0.95
    # half of what independent draws leave open
    alone = 1.96 * np.sqrt(known * (1 - known) / 64)[open_ended]
    assert found[threshold].sampling[open_ended].mean() < 0.6 * alone.mean()


def test_what_reaches_a_place_is_the_largest_of_its_cells(found, truth):
    row = 10 * len(X) + 20
    largest = truth.reshape(len(truth), -1)[:, [row, row - 1]].max(axis=1)
    for threshold in (0.25, 0.5):
        one = found["far", threshold]
        assert one.probability[0] == pytest.approx(np.mean(largest > threshold), abs=one.sampling[0] + 0.0025)


def test_one_level_says_nothing_of_its_spacing(found):
    assert np.isnan(found[0.5].discretisation()).all()
    assert np.isnan(found[0.5].total()).all()


def test_few_runs_of_a_finer_level_correct_many_of_a_coarser_one():
    at, over = places(32), draws([places(4096, seed=9)], [1.0], 512)
    levels = [level(at), level(at[:8], np.arange(8), thinner=0.2)]
    weight = np.full(32, 1 / 32)
    chosen = choose(levels, (0.5,), weight)[0][0.5]
    both = exceedance(chosen.levels, chosen.level, over, weight)
    known = (depths(places(8192, seed=11), thinner=0.2) > 0.5).mean(axis=0).ravel()
    open_ended = (known > 0.01) & (known < 0.99)
    error = np.abs(both.probability - known)[open_ended]
    assert np.sqrt(np.mean(error**2)) < 0.25 * np.sqrt(np.mean((both.coarse - known)[open_ended] ** 2))
    assert (both.total() >= both.sampling + both.discretisation()).all()
    assert np.mean(error <= both.total()[open_ended]) > 0.99
    assert (both.discretisation()[open_ended] >= 2 * both.typical_change - 1e-12).all()


def test_the_largest_runs_may_be_missing():
    at = places(64)
    large = np.argsort(at @ [0.7, 0.3])[-4:]
    rest = np.setdiff1d(np.arange(64), large)
    weight = np.full(60, 1 / 60)
    chosen = choose([level(at[rest])], (0.5,), weight)[0][0.5]
    filled = exceedance(chosen.levels, chosen.level, draws([places(4096, seed=9)], [1.0], 512), weight)
    known = (depths(places(8192, seed=11)) > 0.5).mean(axis=0).ravel()
    open_ended = (known > 0.01) & (known < 0.99)
    left_out = (depths(at[rest]) > 0.5).mean(axis=0).ravel()
    error = np.abs(filled.probability - known)[open_ended]
    assert np.sqrt(np.mean(error**2)) < 0.4 * np.sqrt(np.mean((left_out - known)[open_ended] ** 2))
    assert np.mean(error <= filled.sampling[open_ended]) > 0.9


def test_groups_of_draws_count_by_their_share():
    at, weight = places(32), np.full(32, 1 / 32)
    chosen = choose([level(at)], (0.5,), weight)[0][0.5]
    halves = [places(512, seed=1) * [0.5, 1], places(512, seed=1) * [0.5, 1] + [0.5, 0]]
    one, other, both = (
        exceedance(chosen.levels, chosen.level, draws(groups, shares, 512), weight).probability
        for groups, shares in (([halves[0]], [1.0]), ([halves[1]], [1.0]), (halves, [0.25, 0.75]))
    )
    open_ended = (both > 0.001) & (both < 0.999)
    assert both[open_ended] == pytest.approx((0.25 * one + 0.75 * other)[open_ended], abs=1e-5)


def test_the_latent_depth_goes_on_falling_away_from_the_flow():
    field = np.zeros((3, 5))
    field[1, 1] = 1.0
    found = Latent(0.01).of([field], (2.0, 2.0))[0]
    assert found[1, 1] == 1
    assert found[1, 2:] == pytest.approx([WET - 0.01 * far for far in (2, 4, 6)], abs=1e-6)
    assert found[0, 0] == pytest.approx(WET - 0.01 * np.hypot(2, 2), abs=1e-6)
    rooted = Latent(0.01, root=True).of([0.25 * field], (2.0, 2.0))[0]
    assert rooted[1, 1] == 0.5
    assert Latent(0.01).of([0 * field], (2.0, 2.0)).max() < 0
    with pytest.raises(ValueError, match=r"at least 0.02, found 0.01"):
        Latent(0.01).level(0.01)


def test_a_score_of_predictions_no_better_than_the_share_is_one():
    above = np.array([[True], [False], [True], [False]])
    weight = np.full(4, 0.25)
    # a certain prediction, and one that is the share of the other runs
    sure = exceedance_score(above, np.where(above, 9.0, -9.0), np.ones((4, 1)), 0.0, weight)
    assert sure.ratio == pytest.approx(0, abs=1e-12)
    others = np.where(above, 1 / 3, 2 / 3)
    blind = exceedance_score(above, ndtri(others), np.ones((4, 1)), 0.0, weight)
    assert blind.ratio == pytest.approx(1)
    assert blind.brier == pytest.approx(4 / 9)
    assert blind.calibration == pytest.approx(2)


@pytest.mark.parametrize(("ratio", "word"), [(0.1, "supported"), (0.2, "doubtful"), (0.3, "refused")])
def test_thresholds_are_refused_by_their_ratio(ratio, word):
    from solver.emulator.scores import ExceedanceScore

    verdict = support.of_exceedance(ExceedanceScore(ratio, 1.0, np.zeros(1), np.zeros(1), 0.0))
    assert verdict.word == word
    assert (f"{ratio:.2f}" in verdict.reason) == (word != "supported")


def test_noise_is_refused():
    at = places(64)
    noise = np.random.default_rng(0).uniform(0, 1, (64, len(Y), len(X)))
    chosen = choose([FieldLevel(at, noise, Y, X, {})], (0.5,), np.full(64, 1 / 64))[0][0.5]
    assert support.of_exceedance(chosen.score).word == "refused"


def test_a_field_that_jumps_at_its_edge_is_no_worse_than_the_share():
    # as a speed or an arrival that is large up to the edge of the flow
    at, weight, level = places(64), np.full(64, 1 / 64), 0.9
    held, many = (np.where(depths(some) > 0, 1.0, 0.0) for some in (at, places(8192, seed=11)))
    chosen = choose([FieldLevel(at, held, Y, X, {})], (level,), weight)[0][level]
    moved = exceedance(chosen.levels, chosen.level, draws([places(4096, seed=9)], [1.0], 512), weight)
    known = (many > level).mean(axis=0).ravel()
    open_ended = (known > 0.01) & (known < 0.99)
    rmse, without, plain = (
        np.sqrt(np.mean((each - known)[open_ended] ** 2))
        for each in (
            moved.probability,
            moved.probability - moved.score.systematic * moved.score.offset,
            (held > level).mean(axis=0).ravel(),
        )
    )
    assert without > 2 * plain
    assert rmse < 1.1 * plain
    assert np.mean(np.abs(moved.probability - known)[open_ended] <= moved.sampling[open_ended]) > 0.95


@pytest.mark.parametrize("threshold", THRESHOLDS)
def test_moving_probabilities_by_what_is_systematic_makes_none_worse(found, truth, threshold):
    each, known = found[threshold], (truth > threshold).mean(axis=0).ravel()
    open_ended = (known > 0.01) & (known < 0.99)
    error = (each.probability - known)[open_ended]
    before = error - (each.score.systematic * each.score.offset)[open_ended]
    assert np.sqrt(np.mean(error**2)) <= np.sqrt(np.mean(before**2))
    # well away from the edge of the flow nothing is off but by chance
    assert (each.score.systematic == 0) == (threshold > 0.25)


def test_only_what_is_off_alike_over_runs_and_outputs_is_systematic():
    rng, runs = np.random.default_rng(0), 64
    chance = rng.uniform(0.1, 0.9, (runs, 400))
    above, weight, one = (
        rng.uniform(size=chance.shape) < chance,
        np.full(runs, 1 / runs),
        np.ones_like(chance),
    )
    honest = exceedance_score(above, ndtri(chance), one, 0.0, weight)
    assert honest.excess == pytest.approx(1, abs=0.2)
    assert honest.systematic < 0.2
    off = exceedance_score(above, ndtri(chance - 0.09), one, 0.0, weight)
    assert off.offset.mean() == pytest.approx(0.09, abs=0.01)
    assert off.systematic > 0.6
    # of a single output chance and error cannot be told apart
    alone = exceedance_score(above[:, :1], ndtri(chance - 0.09)[:, :1], one[:, :1], 0.0, weight)
    assert alone.systematic == 0


@pytest.mark.parametrize(("kind", "close"), [(np.float32, 1.2e-7), (np.float64, 2e-11)])
def test_the_table_is_the_normal_distribution_to_its_precision(kind, close):
    deviations = np.random.default_rng(0).normal(0.7, 1.5, 100_000).clip(-5.99, 5.99).astype(kind)
    found = below(deviations)
    assert found.dtype == kind
    assert np.abs(found - ndtr(deviations.astype(np.float64))).max() < close


def test_far_away_it_is_nothing_or_all():
    found = below(np.array([-1e9, -7, 0, 7, 1e9], np.float32))
    assert found == pytest.approx([0, 0, 0.5, 1, 1], abs=2e-9)


def test_thresholds_taken_together_are_those_one_by_one(found):
    at, weight = places(64), np.full(64, 1 / 64)
    maps, _ = choose([level(at)], THRESHOLDS, weight)
    over, emulator = draws([places(4096, seed=9)], [1.0], 512), maps[0.5].levels
    together = exceedances(emulator, THRESHOLDS, over, weight)
    for threshold, one in zip(THRESHOLDS, together, strict=True):
        alone = exceedance(emulator, threshold, over, weight)
        for name in ("probability", "coarse", "variance"):
            assert getattr(one, name) == pytest.approx(getattr(alone, name), abs=1e-6)


def test_the_variance_over_paths_is_the_covariance_of_two_halves_of_the_draws():
    rng = np.random.default_rng(0)
    above, roots, paths = (
        rng.normal(0, 1, (3, 40)),
        rng.uniform(0.5, 1, (2, 3)),
        rng.normal(0, 1, (2, 40, 30)),
    )
    paths += 0.5 * rng.normal(0, 1, (2, 1, 30))
    few = draws([rng.random((40, 2))], [1.0], 40)
    whole = above[:, :, None] + np.einsum("pc,pmk->cmk", roots, paths)
    halves = [(whole[:, first::2] > 0).mean(axis=1) for first in (0, 1)]
    known = [max(np.cov(one, other)[0, 1], 0.0) for one, other in zip(*halves, strict=True)]
    assert over_paths(above, roots, paths, few) == pytest.approx(known, rel=1e-5)


def test_the_variance_over_paths_does_not_depend_on_how_many_draws_they_are_at():
    # every draw for itself has no share of its own in a variance that all have together
    rng, count = np.random.default_rng(0), 4000
    common, own = rng.normal(0, 1, (1, 1, count)), rng.normal(0, 1, (1, 512, count))
    found = []
    for size in (8, 512):
        few = draws([rng.random((size, 2))], [1.0], size)
        paths = np.sqrt(0.1) * common + np.sqrt(0.9) * own[:, :size]
        found.append(over_paths(np.zeros((1, size)), np.ones((1, 1)), paths, few)[0])
    # of the probability of two normal numbers to be above 0, whose correlation is 0.1
    assert found == pytest.approx([np.arcsin(0.1) / (2 * np.pi)] * 2, rel=0.12)


@pytest.mark.parametrize("value", [0.5, 0.1, np.nextafter(np.float32(0.5), np.float32(1))])
@pytest.mark.parametrize("fine", [False, True])
def test_what_all_runs_agree_on_is_above_a_threshold_or_it_is_not(value, fine):
    # as the share of the runs has it: a value at the threshold does not exceed it
    threshold, at = (0.1 if value == 0.1 else 0.5), places(64)[:60]
    held = depths(at).astype(np.float32)
    held[:, 3, 4] = value
    runs = [FieldLevel(at, held, Y, X, {}), FieldLevel(at[:8], held[:8], Y, X, {}, np.arange(8))]
    weight = np.full(60, 1 / 60)
    each = choose(runs[: 1 + fine], (threshold,), weight)[0][threshold]
    one = exceedance(each.levels, each.level, draws([places(256, seed=9)], [1.0], 256), weight)
    cell, plain = 3 * len(X) + 4, float((held[:, 3, 4] > threshold).mean())
    assert plain == (value > 0.5)
    assert one.probability[cell] == one.coarse[cell] == plain
    assert one.sampling[cell] == 0


def test_few_draws_leave_more_open_than_many():
    at, weight = places(64), np.full(64, 1 / 64)
    each = choose([level(at)], (0.5,), weight)[0][0.5]
    known = exceedance(each.levels, each.level, draws([places(1 << 14, seed=3)], [1.0], 512), weight)
    open_ended = (known.probability > 0.01) & (known.probability < 0.99)
    said = []
    for count in (64, 1024):
        over = draws([places(count, seed=9)], [1.0], 512)
        mean, deviation = Predictor(each.levels.parts, over.at)(each.levels)
        of_draws = ndtr((mean - each.level) / deviation)
        half = np.sqrt([over.variance(column) for column in of_draws.T[open_ended]])
        off = (over.share @ of_draws - known.probability)[open_ended]
        off += (known.score.systematic * known.score.offset)[open_ended]
        # even draws are nearer than independent blocks of them
        assert np.sqrt(np.mean(off**2)) < np.sqrt(np.mean(half**2))
        said.append(float(half.mean()))
    assert said[0] > 4 * said[1]


def test_what_no_number_can_come_of_is_refused():
    at, weight = places(32), np.full(32, 1 / 32)
    for wrong in (np.nan, np.inf):
        field = depths(at)
        field[3, 4, 5] = wrong
        with pytest.raises(ValueError, match="expected finite values of all runs at all points"):
            choose([FieldLevel(at, field, Y, X, {})], (0.5,), weight)
        with pytest.raises(ValueError, match="expected finite outputs of all runs"):
            fit_levels([at], [field[:, 4, 5:6]])
    with pytest.raises(ValueError, match="expected ascending coordinates"):
        choose([FieldLevel(at, depths(at)[:, :, ::-1], Y, X[::-1], {})], (0.5,), weight)


@pytest.mark.parametrize(
    ("fine", "before", "told"),
    [
        # levels in another order, rows of other runs, too few of them
        (64, np.arange(64), "expected a row of 32 runs for each of 64"),
        (8, np.arange(8)[::-1], "expected paired runs at the same places"),
        (8, np.arange(7), "expected a row of 32 runs for each of 8, found 7 rows up to 6"),
    ],
)
def test_levels_whose_runs_are_no_pairs_are_refused(fine, before, told):
    at = places(64)
    with pytest.raises(ValueError, match=told):
        fit_levels([at[:32], at[:fine]], [at[:32, :1], at[:fine, :1]], [before])


def test_draws_beyond_the_range_of_the_runs_are_within_the_stated_error():
    def scores(at):
        return ndtri(np.clip(at, 1e-6, 1 - 1e-6))

    few, many = scores(places(64)), scores(places(4096, seed=9))
    low, high = few.min(axis=0), few.max(axis=0)
    at, over = ((each - low) / (high - low) for each in (few, many))
    beyond = ((over < 0) | (over > 1)).any(axis=1).mean()
    assert beyond > 0.01
    weight = np.full(64, 1 / 64)
    maps, _ = choose([FieldLevel(at, depths(ndtr(few)), Y, X, {})], (0.5,), weight)
    chosen = maps[0.5]
    found = exceedance(chosen.levels, chosen.level, draws([over], [1.0], 512), weight)
    known = (depths(places(8192, seed=11)) > 0.5).mean(axis=0).ravel()
    error = np.abs(found.probability - known)
    # cells that the draws beyond alone reach too
    rare = (known > 0.0005) & (known < beyond)
    open_ended = (known > 0.01) & (known < 0.99)
    assert rare.sum() > 5
    for some in (rare, open_ended):
        assert np.mean(error[some] <= found.sampling[some] + 0.0025) >= 0.95
    assert np.sqrt(np.mean(error[open_ended] ** 2)) < 0.007
