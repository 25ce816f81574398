"""The limits of the study in small: its own comparisons, with runs that are known in closed form."""

import json

import numpy as np
import pandas as pd
import pytest
import xarray as xr
import yaml
from analytic_truth import THINNER, analytic
from root import ROOT

from pipeline.emulation.thresholds import fitted
from pipeline.studies.emulation import __main__ as command
from pipeline.studies.emulation import commands, valley
from pipeline.studies.emulation.acceptance import SHIPPED_LEVELS, acceptance
from pipeline.studies.emulation.commands import SEEDS, WAYS, compared, done, error_of_truth, maps_of, together
from pipeline.studies.emulation.pictures import THRESHOLDS, emulated
from pipeline.studies.emulation.truth import blocks
from pipeline.studies.emulation.valley import errors

COARSE, CLOSE, FINE = THINNER
BLOCK = np.arange(64, 128)


@pytest.fixture(scope="module")
def truth():
    """Many runs on three spacings."""
    return {COARSE: analytic(COARSE, 1024), CLOSE: analytic(CLOSE, 1024), FINE: analytic(FINE, 256)}


@pytest.fixture
def one_block(monkeypatch):
    """Let the study take one block of runs in place of four."""
    monkeypatch.setattr(valley, "blocks", lambda count, whole: iter([np.arange(count, 2 * count)]))


def column(rows, name):
    return np.array([row[name] for row in rows])


def pooled(rows, name):
    return np.sqrt(np.mean(column(rows, name) ** 2))


def test_maps_of_64_runs_keep_the_limits_of_error_coverage_and_width(truth):
    wide = truth[COARSE]
    rows = list(errors(wide.runs(BLOCK), wide, wide.depth(BLOCK), "few"))
    assert column(rows, "threshold").tolist() == [*THRESHOLDS]
    assert (column(rows, "rmse") < [0.008, 0.007, 0.004]).all()
    # one block: the ratio is of all thresholds
    assert pooled(rows, "rmse_of_share") > 2.5 * pooled(rows, "rmse")
    assert (column(rows, "coverage") >= 0.95).all()
    assert (column(rows, "interval") < 0.5 * column(rows, "interval_of_sampling")).all()
    # an interval that is never left says more than is so
    assert (column(rows, "interval") < 10 * column(rows, "rmse")).all()


def test_the_largest_runs_may_have_failed(truth):
    wide = truth[COARSE]
    reach = wide.store["flow_runout_distance"].to_numpy()[BLOCK]
    failed, rest = np.split(BLOCK[np.argsort(-reach)], [8])
    rows = list(errors(wide.runs(BLOCK, failed=failed), wide, wide.depth(rest), "8 failed"))
    assert (column(rows, "rmse") < 0.025).all()
    assert (column(rows, "coverage") >= 0.9).all()
    assert (column(rows, "rmse_of_share") > 3 * column(rows, "rmse")).all()


def test_the_total_error_of_two_spacings_holds_the_truth_on_both_and_on_a_closer_one(truth):
    wide, close, fine = truth.values()
    few = close.depth(BLOCK[:16])
    runs = wide.runs(BLOCK, close, 16)
    rows = list(errors(runs, close, few, "16", two_levels=True))
    assert (column(rows, "rmse") < 0.012).all()
    assert (column(rows, "coverage") >= 0.99).all()
    found = emulated(runs, [0.5])[0.5]
    known = valley.cut(runs, fine.exceedance(0.5), fine.store)
    some = (known > 0.01) & (known < 0.99)
    error = np.abs(found.probability - known)[some]
    # what was not computed is off by more than the few runs leave open, and within the allowance
    assert np.mean(error <= found.total()[some]) >= 0.9
    assert np.mean(error <= found.sampling[some]) < 0.9
    assert np.sqrt(np.mean(error**2)) > pooled(rows, "rmse")


def test_four_runs_on_a_closer_spacing_keep_their_limit(truth):
    wide, close, _ = truth.values()
    runs = wide.runs(BLOCK, close, 4)
    found = list(errors(runs, close, close.depth(BLOCK[:4]), "4", two_levels=True))
    assert (column(found, "rmse") < 0.03).all()
    assert (column(found, "rmse") < 0.3 * column(found, "rmse_of_share")).all()
    assert (column(found, "coverage") >= 0.9).all()


def test_leave_one_out_tells_which_threshold_the_runs_support(truth):
    wide = truth[COARSE]
    store = wide.store.isel(run=BLOCK)
    depth = store["max_depth"].to_numpy()
    # thin layers come and go by chance, deep ones do not
    chance = np.random.default_rng(0).uniform(0, 1, depth.shape) < 0.5
    noisy = np.where((depth < 0.3) & chance, 0.0, depth)
    runs = wide.runs(BLOCK)
    runs = type(runs)(runs.settings, (store.assign(max_depth=store["max_depth"].copy(data=noisy)),))
    asked = runs.settings.hazard.model_copy(update={"depth": (0.1, 0.9)})
    verdicts = {each.words: each for each in fitted(runs, asked)}
    assert verdicts["depth above 0.1 m, map"].verdict.word == "refused"
    good = verdicts["depth above 0.9 m, map"]
    assert good.verdict.word == "supported"
    assert good.chosen.score.ratio < 0.1
    # leave-one-out intervals of the cells that the flow always reaches hold the runs as often as they say
    mean, deviation = good.chosen.levels.leave_one_out()
    held = np.abs(good.chosen.levels.outputs[0] - mean) <= 1.96 * deviation
    deep = (depth.min(axis=0) > 0.9).ravel()
    part = runs.ensembles[-1]
    rows = np.isin(wide.store["y"], part["y"])[:, None] & np.isin(wide.store["x"], part["x"])[None, :]
    assert 0.85 < held[:, deep[rows.ravel()]].mean() <= 1


def test_chosen_runs_tell_more_of_a_rare_probability(truth, one_block, monkeypatch):
    monkeypatch.setattr(valley, "RARE", "school: depth > 0.3")
    rows = {row["what"].partition(", ")[2]: row for row in valley.next_runs(truth[COARSE])}
    assert 0.005 < rows["32 runs"]["probability"] < 0.05
    chosen = rows["32 runs and 16 chosen"]
    assert abs(chosen["rmse"]) < 0.0025
    assert chosen["coverage"] == 1
    assert chosen["interval"] < 0.8 * rows["32 runs"]["interval"]


def test_posteriors_hold_the_parameters_as_often_as_they_say(truth, one_block, monkeypatch):
    monkeypatch.setattr(valley, "OBSERVED", 100)
    table = valley.over_blocks(valley.calibrations(truth[COARSE]), ["what"]).set_index("what")
    known_to_8_m = table.loc["outline known to 8 m"]
    assert known_to_8_m["effective_draws"] > 100
    assert 0.84 <= known_to_8_m["holds_volume"] <= 0.96
    assert 0.84 <= known_to_8_m["holds_turbulent_friction"] <= 0.96


def test_more_draws_change_less_than_the_few_runs_leave_open(truth, one_block, monkeypatch):
    monkeypatch.setattr(valley, "NUMBERS_OF_DRAWS", (1024, 4096, 16384))
    table = valley.over_blocks(valley.numbers_of_draws(truth[COARSE]), ["what", "draws"])
    maps = table[table["what"] == "map above 0.5 m"].set_index("draws")
    assert maps["rmse_of_draws"].is_monotonic_decreasing
    # within what is added to every probability for them
    assert maps.loc[4096, "rmse_of_draws"] < 0.0025 / 4
    assert maps.loc[4096, "rmse_of_draws"] < 0.1 * maps.loc[4096, "interval"]
    # the interval is of the runs, and not of the draws
    assert maps.loc[16384, "interval"] == pytest.approx(maps.loc[4096, "interval"], rel=0.05)


def map_file(folder, way, truth, off):
    """Write maps as a command writes them: the truth and an error that is known."""
    plain = way.command == "hazard"
    name = "depth_exceedance" if plain else "depth_emulated"
    shares = np.stack([truth.exceedance(threshold) + off for threshold in THRESHOLDS])
    place = folder / "results" / ("hazard" if plain else "emulated") / "sheet"
    place.mkdir(parents=True)
    dims = ("depth_threshold", "y", "x")
    held = xr.Dataset(
        {name: (dims, shares), "depth_emulated_error": (dims, np.full_like(shares, 0.03))},
        coords={"depth_threshold": [*THRESHOLDS], **{a: truth.store[a].to_numpy() for a in ("y", "x")}},
    )
    held.to_netcdf(place / ("hazard.nc" if plain else "emulated.nc"))


def test_ways_to_maps_are_compared_by_time_and_error_and_done_once(truth, tmp_path, monkeypatch):
    close, fine = truth[CLOSE], truth[FINE]
    asked = []
    off, time = (
        {"plain": 0.02, "levels": 0.005, "alone": 0.008},
        {"run": 40.0, "hazard": 20.0, "emulate": 5.0},
    )

    def command_(given):
        asked.append(given[0])
        if given[0] != "run":
            folder = type(tmp_path)(given[1]).parent
            way = next(each for each in WAYS if folder.name.startswith(each.name))
            map_file(folder, way, close, off[way.name])
        return time[given[0]]

    monkeypatch.setattr(commands, "processor_time", command_)
    monkeypatch.setattr(
        commands.Way, "scenario", lambda self, seed: {"name": "sheet", "sample": {"seed": seed}}
    )
    table = together(commands.commands(tmp_path, "code", close, fine)).set_index(["what", "threshold"])
    assert len(asked) == 2 * len(WAYS) * len(SEEDS)
    plain, levels = (table.loc[(way.words, 0.5)] for way in WAYS[:2])
    assert (plain["seconds"], levels["seconds"]) == (60, 45)
    assert levels["seconds_over_plain"] == pytest.approx(0.75)
    assert (plain["rmse_4m"], levels["rmse_4m"]) == pytest.approx((0.02, 0.005))
    known = close.exceedance(0.5)
    known = known[(known > 0.01) & (known < 0.99)]
    alone = float(np.sqrt(np.mean(known * (1 - known)) / valley.SHIPPED))
    assert levels["rmse_4m_over_independent"] == pytest.approx(0.005 / alone)
    # again: nothing is done a second time, but by other code
    assert len(list(commands.commands(tmp_path, "code", close, fine))) == len(WAYS) * len(SEEDS) * 3
    assert len(asked) == 2 * len(WAYS) * len(SEEDS)
    done(WAYS[0], SEEDS[0], tmp_path / f"plain-{SEEDS[0]}", "other")
    assert asked[-2:] == ["run", "hazard"]
    assert json.loads((tmp_path / f"plain-{SEEDS[0]}" / "cost.json").read_text())["code"] == "other"


def test_a_map_is_compared_at_the_points_that_it_shares_with_the_truth(truth, tmp_path):
    folder = tmp_path / "levels-1"
    map_file(folder, WAYS[1], truth[COARSE], 0.01)
    (folder / "scenario.yaml").write_text("name: sheet\n")
    found = maps_of(WAYS[1], folder, 0.5)
    assert maps_of(WAYS[1], folder, 0.7) is None
    same = compared(found, truth[COARSE], 0.5, "own", plain=False)
    assert same["rmse_own"] == pytest.approx(0.01)
    assert same["coverage_own"] == 1
    other = compared(found, truth[CLOSE], 0.5, "close", plain=False)
    assert other["rmse_close"] > 0.02
    assert other["coverage_close"] < 1
    assert 0 < error_of_truth(truth[COARSE], 0.5) < 0.005


def test_blocks_are_within_the_truth():
    assert [*map(len, blocks(64, 1024))] == [64] * 4
    assert [(rows[0], rows[-1]) for rows in blocks(64, 128)] == [(0, 63), (64, 127)]


def test_ways_are_the_shipped_scenarios_with_another_seed():
    plain, levels, alone = (way.scenario(7) for way in WAYS)
    assert (alone["points"]["spacing"], alone["sample"]["count"]) == (4, 64)
    assert plain["sample"]["count"] == valley.SHIPPED
    assert {each["sample"]["seed"] for each in (plain, levels)} == {7}
    counts = [level["count"] for level in levels["sample"]["levels"]]
    assert tuple(counts) == commands.LEVELS_COUNTS
    assert WAYS[1].words.startswith(f"{counts[0]} at 8 m, {counts[1]} at 4 m")
    # files are named from the root
    assert plain["terrain"]["file"].startswith("/")
    assert yaml.safe_dump(plain)


def limits(error):
    """Tables of the valley whose maps have an error."""
    wide = [f"{count} runs at 8 m" for count in (32, 64)]
    names = [
        *wide,
        "64 runs at 8 m, the 8 largest failed",
        "64 runs at 8 m and 16 at 4 m",
        SHIPPED_LEVELS,
        "64 runs at 8 m and 4 at 2 m",
        "64 runs at 8 m and 16 at 4 m, against 2 m",
    ]
    row = {
        "rmse": error,
        "coverage": 0.97,
        "interval": 0.03,
        "interval_of_sampling": 0.1,
        "rmse_of_share": 0.02,
    }
    maps = pd.DataFrame([{"what": name, "threshold": t, **row} for name in names for t in THRESHOLDS])
    ratio = {"seconds_over_plain": 0.3, "rmse_4m_over_plain": 0.3, "rmse_2m_over_plain": 0.2}
    # so that independent runs have an error of 0.02
    ratio |= {"rmse_4m": 0.004, "rmse_4m_over_independent": 0.2}
    ratio |= {"coverage_4m": 1.0, "coverage_2m": 0.8}
    both = pd.DataFrame([{"what": way.words, "threshold": t, **ratio} for way in WAYS for t in THRESHOLDS])
    return {"maps": maps, "commands": both}


def test_figures_stand_beside_their_limits_and_those_that_fail_are_marked():
    table = acceptance(limits(0.003)).set_index("what")
    words = f"{WAYS[1].words}, over {WAYS[0].words}"
    assert table.loc["64 runs: error of maps", "measured"] == "0.003, 0.003, 0.003"
    failed = table[table["verdict"] != "pass"]
    assert [*failed.index] == [
        f"{words}: error of maps against 4 m",
        f"{WAYS[2].words}, over {WAYS[0].words}: error of maps against 4 m",
        f"{WAYS[1].words}: coverage of the total error, 2 m",
    ]
    worse = acceptance(limits(0.006)).set_index("what")["verdict"]
    assert worse["64 runs: error of maps"] == "**fail**"
    blocks = f"{SHIPPED_LEVELS}, over {WAYS[0].words} that are independent: error of maps over blocks"
    assert table.loc[blocks, "measured"] == "0.15, 0.15, 0.15"
    assert worse[blocks] == "**fail**"
    assert len(acceptance({})) == 0


def test_parts_of_the_valley_are_kept_and_taken_again_by_the_same_code(tmp_path, monkeypatch, capsys):
    asked = []
    monkeypatch.setattr(command, "Truth", lambda place, name: name)
    monkeypatch.setattr(command, "made", lambda part, *_: asked.append(part) or limits(0.003)[part])
    monkeypatch.setattr(command, "known_by", lambda: "code")
    for _ in range(2):
        found = dict(command.tables_of_valley(tmp_path, ["maps"]))
        assert [*found] == ["maps", "acceptance"]
    assert asked == ["maps"]
    assert "maps: 0 s of processor time" in capsys.readouterr().out
    # a further part is judged with those that are there
    found = dict(command.tables_of_valley(tmp_path, ["commands"]))
    assert [*found] == ["commands", "acceptance"]
    assert found["acceptance"]["what"].str.startswith("64 runs: error of maps").any()
    monkeypatch.setattr(command, "known_by", lambda: "other")
    dict(command.tables_of_valley(tmp_path, ["maps"]))
    assert asked == ["maps", "commands", "maps"]


def test_a_table_takes_the_place_of_the_one_below_its_name():
    page = "a\n\n<!-- maps -->\n| old |\n| --- |\n\n| other |\n<!-- draws -->\n\nb\n"
    found = command.with_table(page, "maps", "| new |\n")
    assert found == page.replace("| old |\n| --- |\n", "| new |\n")
    assert command.with_table(found, "draws", "| 1 |\n").endswith("<!-- draws -->\n| 1 |\n\nb\n")
    assert command.with_table(page, "none", "| 1 |\n") == page


def test_the_page_has_a_place_for_every_table_of_the_valley():
    page = (ROOT / "docs" / "emulation.md").read_text(encoding="utf-8")
    for title in (*valley.PARTS, command.COMMANDS, "acceptance"):
        assert f"<!-- {title} -->\n" in page
