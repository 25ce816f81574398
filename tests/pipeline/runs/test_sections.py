"""Inflow and sections of a scenario file: in the store, in tables, over sweeps, and in the report."""

import copy

import numpy as np
import pandas as pd
import pytest
import xarray as xr

import pipeline
from pipeline.assess.sections import quantities_at
from pipeline.hazard.differences import SECTIONS
from pipeline.report.difference_chapter import of_difference
from pipeline.report.figures import hydrographs
from pipeline.report.tables.runs import sections as table_of_sections
from pipeline.runs.runs import expand, share
from pipeline.runs.scene_of_run import build_scene
from pipeline.scenario.scenario import load

ENDS = ("lower", "estimate", "upper")
SCENARIO = {
    "name": "fed",
    "terrain": {"profile": "plane", "angle": 12},
    "domain": {"x": [0, 120], "y": [-12, 12]},
    "points": {"spacing": 4},
    "inflow": [
        {
            "name": "top",
            "section": [[10, -6], [10, 6]],
            "hydrograph": {"shape": "triangle", "volume": 300, "peak_discharge": 20},
        }
    ],
    "material": {
        "friction_coefficient": 0.1,
        "turbulent_friction": 300,
        "earth_pressure": "isotropic",
    },
    "sections": [{"name": "middle", "line": [[60, -12], [60, 12]]}],
    "time": {"end": 80, "output_every": 20},
    "sweep": {"inflow.0.hydrograph.volume": [300, 600]},
}


@pytest.fixture(scope="module")
def results(tmp_path_factory):
    return pipeline.run(SCENARIO, out=tmp_path_factory.mktemp("fed") / "out")


def test_the_store_holds_the_hydrograph_of_each_section(results):
    store = results["fed"]
    assert store["section"].to_numpy().tolist() == ["middle"]
    time, discharge = store["section_time"].to_numpy(), store["section_discharge"].to_numpy()
    assert time[1] == 2.0
    assert time[-1] == 80
    volume = store["section_volume"].to_numpy()
    assert (discharge[:, 0, 1:] * np.diff(time)).sum(axis=1) == pytest.approx(volume[:, 0, -1], rel=1e-12)
    assert volume[:, 0, -1] == pytest.approx([300, 600], rel=0.1)
    peak = store["section_peak_discharge"].to_numpy()
    assert peak[:, 0] == pytest.approx(discharge.max(axis=(1, 2)))
    assert (peak > 0).all()
    assert (peak < 20).all()
    assert (store["section_arrival_time"].to_numpy() > 5).all()
    assert store["volume_in"].to_numpy() == pytest.approx([300, 600], rel=1e-12)
    assert (store["volume_released"].to_numpy() == 0).all()
    # run-out counts from the section
    assert (store["flow_runout_distance"].to_numpy() > 50).all()


def test_tables_and_the_report_show_sections(results):
    rows = pipeline.assessment_tables(results)["sections"]
    assert rows["section"].tolist() == ["middle", "middle"]
    assert (rows["volume"].diff().dropna() > 200).all()
    store = results["fed"]
    assert len(table_of_sections(store).rows) == 2
    assert hydrographs(store)[:8] == b"\x89PNG\r\n\x1a\n"


def test_scenarios_differ_in_what_passes_sections(tmp_path):
    # what `pipeline compare` asks of the two
    plain = copy.deepcopy(SCENARIO) | {"output": {"threshold": 0.005}}
    rough = copy.deepcopy(plain)
    rough |= {"name": "rough", "material": {**SCENARIO["material"], "turbulent_friction": 100}}
    rough["sections"].append({"name": "never", "line": [[110, 8], [118, 12]]})
    results = pipeline.run([plain, rough], out=tmp_path / "out")
    compared = pipeline.compare(results, ("fed", "rough"), to=tmp_path / "compare", pictures=False)
    # a section that only one of them has is left out
    table = compared.sections
    assert set(table["section"]) == {"middle"}
    rows = table.set_index("quantity")
    passed = pipeline.assessment_tables(results)["sections"].query("section == 'middle'")
    one, other = (passed[passed["scenario"] == name] for name in ("fed", "rough"))
    for quantity, name, of in (
        ("largest_volume", "volume", "max"),
        ("largest_peak_discharge", "peak_discharge", "max"),
        ("median_peak_discharge", "peak_discharge", "min"),
        ("first_arrival_time", "arrival_time", "min"),
        ("median_arrival_time", "arrival_time", "min"),
    ):
        known = [float(getattr(each[name], of)()) for each in (one, other)]
        row = rows.loc[quantity]
        assert [row["first"], row["second"]] == known, quantity
        assert row["difference"] == known[1] - known[0], quantity
    # rougher ground is slower, and its peak lower
    assert rows.loc["first_arrival_time", "difference"] > 1
    assert rows.loc["largest_peak_discharge", "difference"] < -0.5
    assert rows.loc["probability", "first"] == 1
    assert rows.loc["median_volume", "units"] == "m3"
    assert rows.loc["median_volume", "runs_cut_off_first"] == 2
    assert len(pd.read_csv(tmp_path / "compare" / SECTIONS)) == len(table) == 7
    chapter = of_difference(compared)
    assert [each.title for each in chapter.tables] == ["Sections"]
    assert len(chapter.tables[0].rows) == 7


def test_bounds_at_sections_hold_whatever_missing_runs_do():
    rows = pd.DataFrame(
        {
            "volume": [100.0, 80.0, np.nan, 60.0],
            "peak_discharge": [5.0, 4.0, np.nan, 3.0],
            "arrival_time": [10.0, 20.0, np.nan, np.nan],
        }
    )
    # one done, one cut off after it had arrived, one failed, one that had not arrived when it was cut off
    store = xr.Dataset({"status": ("run", [1, 4, 2, 4]), "last_time": ("run", [40.0, 50.0, 5.0, 50.0])})
    found = dict(quantities_at(store, rows))
    assert [float(end) for end in found["probability"][1].by_bound.values()] == pytest.approx(
        [2 / 3, 0.5, 1.0]
    )
    lower, estimate, upper = (float(getattr(found["first_arrival_time"][1], end)) for end in ENDS)
    assert (lower, estimate, upper) == (-np.inf, 10.0, 10.0)
    lower, estimate, upper = (float(getattr(found["median_arrival_time"][1], end)) for end in ENDS)
    assert (lower, estimate, upper) == (10.0, 20.0, 20.0)
    lower, estimate, upper = (float(getattr(found["largest_peak_discharge"][1], end)) for end in ENDS)
    assert (lower, estimate, upper) == (5.0, 5.0, np.inf)
    # what still moves may come back through a section
    lower, estimate, upper = (float(getattr(found["median_volume"][1], end)) for end in ENDS)
    assert (lower, estimate, upper) == (-np.inf, 80.0, np.inf)


def test_sections_that_differ_are_told(results, tmp_path):
    moved = copy.deepcopy(SCENARIO) | {"name": "moved", "sweep": {}}
    moved["sections"][0]["line"] = [[64, -12], [64, 12]]
    pipeline.run(moved, out=tmp_path)
    compared = pipeline.compare(results, ("fed", "moved"), tmp_path)
    assert not len(compared.sections)
    assert compared.maps.attrs["comment"].endswith(
        "no sections compared: none has the same name and line in both"
    )


def test_thresholds_are_those_of_the_smallest_inflow():
    (scenario,) = load([SCENARIO])
    runs = expand(scenario)
    shared = share(scenario, runs)
    depths = [build_scene(run, shared).origin.max() for run in runs]
    assert shared.threshold == pytest.approx(0.01 * min(depths))
    assert depths[0] == pytest.approx(depths[1])


def test_a_scenario_without_inflow_has_the_content_of_before():
    plain = {name: value for name, value in SCENARIO.items() if name not in ("inflow", "sections", "sweep")}
    plain["release"] = {"shape": "box", "x": [10, 20], "y": [-5, 5], "height": 1}
    (scenario,) = load([plain])
    assert not {"inflow", "sections", "hydrographs", "section_every"} & set(
        scenario.content.replace('"', " ").split()
    )
