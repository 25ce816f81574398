"""What the page says of the spacing: changes between levels that are known."""

import copy
import html

import pytest
from heaps import HEAP
from sampled_stores import THINNER, sheet

import pipeline
from pipeline.report.tables.spacing import changes, one_spacing


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
