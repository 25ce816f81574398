"""What the page says of the spacing: changes between levels that are known."""

import copy
import html

import numpy as np
import pandas as pd
import pytest
from heaps import HEAP
from sampled_stores import THINNER, sheet

import pipeline
from pipeline.assess import spacing, tables
from pipeline.assess.receptors import reached
from pipeline.emulation.emulate import Emulated
from pipeline.emulation.sampled import Sampled
from pipeline.emulation.scenario_quantiles import emulated_scalars, quantile_rows
from pipeline.report.tables.emulated import emulated_tables
from pipeline.report.tables.spacing import changes, one_spacing
from pipeline.scenario.scenario import stored

pytestmark = pytest.mark.usefixtures("few_pictures")


def test_changes_between_two_levels_are_those_of_their_paired_runs():
    coarse, fine = sheet(64, levels=True)
    rows = {row[0]: row[1:] for row in changes(coarse, fine)}
    runs, before, after, typical, largest = rows["runout distance (m)"]
    assert runs == "16"
    assert float(after) - float(before) == pytest.approx(THINNER, abs=0.11)
    # each run goes farther by the same
    assert float(typical) == float(largest) == pytest.approx(THINNER)


def test_a_receptor_that_runs_reach_on_one_spacing_alone_changes_sides():
    coarse, fine = sheet(64, levels=True)
    depth = fine["max_depth"].to_numpy().copy()
    depth[:4] = 0
    arrival = fine["arrival_time"].to_numpy().copy()
    arrival[:4] = float("nan")
    drier = fine.assign(max_depth=fine["max_depth"].copy(data=depth))
    drier = drier.assign(arrival_time=fine["arrival_time"].copy(data=arrival))
    same = {row[0]: row[1:] for row in changes(coarse, fine)}["near: share that reaches it"]
    changed = {row[0]: row[1:] for row in changes(coarse, drier)}["near: share that reaches it"]
    assert float(changed[3]) == pytest.approx(float(same[3]) + 4 / 16, abs=0.07)
    assert float(changed[2]) < float(same[2])


def test_a_scenario_with_one_spacing_says_that_nothing_was_computed():
    (store,) = sheet(64)
    text = one_spacing(store)
    assert "a spacing of 4 m" in text
    assert "was not computed" in text


def test_every_table_of_many_runs_has_the_error_of_the_spacing():
    coarse, fine = sheet(64, levels=True)
    # what goes farther by the same changes by the same, whatever the weights are
    for row in tables.quantiles(coarse, fine):
        assert row["discretisation"] == pytest.approx(THINNER)
    by_run = reached(coarse)
    shares = {row["receptor"]: row for row in tables.receptors(coarse, by_run, fine)}
    depths = [reached(each).set_index("receptor").loc["near"].iloc[:16] for each in (coarse, fine)]
    sides = depths[0]["reached"].to_numpy() != depths[1]["reached"].to_numpy()
    assert shares["near"]["probability_discretisation"] == pytest.approx(sides.mean())
    # the sheet is thinner by as much, but for runs that reach the place on one spacing alone
    assert shares["near"]["max_depth_discretisation"] == pytest.approx(THINNER, abs=0.03)
    assert shares["near"]["max_speed_discretisation"] == pytest.approx(5 * THINNER, abs=0.15)
    assert all(0 <= row["probability_discretisation"] <= 1 for row in tables.runout_exceedance(coarse, fine))
    assert "discretisation" not in next(tables.quantiles(coarse))


def test_the_error_of_the_spacing_is_that_of_the_events_of_a_return_period():
    coarse, fine = sheet(64, levels=True)
    years = np.where(np.arange(64) < 8, 30.0, 300.0)
    coarse["return_period"], fine["return_period"] = ("run", years), ("run", years[:16])
    depth, arrival = (fine[name].to_numpy().copy() for name in ("max_depth", "arrival_time"))
    # nothing arrives any more in the events of one period
    depth[:8], arrival[:8] = 0, np.nan
    drier = fine.assign(
        max_depth=fine["max_depth"].copy(data=depth), arrival_time=fine["arrival_time"].copy(data=arrival)
    )
    by_run = reached(coarse)
    found = {
        row["return_period"]: row["probability_discretisation"]
        for row in tables.receptors_by_period(coarse, by_run, drier)
        if row["receptor"] == "near"
    }
    near = by_run[by_run["receptor"] == "near"]["reached"].to_numpy(float)
    assert found[30.0] == pytest.approx(near[:8].mean())
    assert found[300.0] < 0.3


def test_changes_count_by_the_weight_of_the_runs():
    before, after = np.array([1.0, 2.0, np.nan]), np.array([1.0, 4.0, 9.0])
    assert spacing.typical_change(before, after) == pytest.approx(2**0.5)
    assert spacing.typical_change(before, after, np.array([3.0, 1.0, 5.0])) == pytest.approx(1.0)
    assert np.isnan(spacing.typical_change(before[2:], after[2:]))
    assert spacing.flips(before > 1.5, after > 3, np.array([1.0, 1.0, 2.0])) == pytest.approx(0.5)
    assert np.isnan(spacing.flips(before[:0] > 1, after[:0] > 1))


def test_the_page_has_emulated_quantiles_with_all_errors():
    stores = sheet(64, levels=True)
    runs = Sampled(stored(stores[0].attrs), tuple(stores))
    scalars = [each for each in emulated_scalars(runs) if each.name == "runout_distance"]
    table = pd.DataFrame(quantile_rows(runs, scalars, runs.inputs.draws(1024)))
    held = {
        "emulated-scenarios": table,
        "leave-one-out": pd.DataFrame([each.row(runs) for each in scalars]),
    }
    quantiles, _ = emulated_tables(Emulated(held, None, "sheet"))
    rows = {row[0]: row[1:] for row in quantiles.rows}
    of_runs, emulated, sampling, discretisation, error, verdict = rows["runout distance, 50 % below (m)"]
    assert float(of_runs) == pytest.approx(70, abs=1)
    assert float(emulated) == pytest.approx(70 + THINNER, abs=0.1)
    assert float(discretisation) >= THINNER
    assert float(error) == pytest.approx(float(sampling) + float(discretisation), abs=0.01)
    assert verdict == "supported"


@pytest.mark.filterwarnings("ignore:.*`pipeline emulate` will say")
def test_the_page_names_the_spacings_of_the_levels(tmp_path):
    heap = copy.deepcopy(HEAP)
    del heap["sweep"], heap["return_periods"]
    heap["sample"] = {
        "levels": [{"spacing": 4, "count": 4}, {"spacing": 2, "count": 2}],
        "values": {"material.bed_friction": {"distribution": "uniform", "lower": 24, "upper": 30}},
    }
    pipeline.run(heap, tmp_path / "results", workers=1, quiet=True)
    page = html.unescape(pipeline.write_report(tmp_path / "results").read_text(encoding="utf-8"))
    part = page.partition("What the spacing is worth")[2]
    assert '<td class="short">4 m</td><td class="short">2 m</td>' in part
    assert "Häusli: share that reaches it" in part
    assert "runout distance (m)" in part
    first = page.partition("What the spacing is worth")[0]
    assert "spacing: probability" in first
    assert "the root mean square change of a run from the widest spacing to the closest" in first
