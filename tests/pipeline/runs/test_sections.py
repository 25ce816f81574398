"""Inflow and sections of a scenario file: in the store, in tables, over sweeps, and in the report."""

import numpy as np
import pytest

import pipeline
from pipeline.report.figures import hydrographs
from pipeline.report.tables.runs import sections as table_of_sections
from pipeline.runs.runs import expand, share
from pipeline.runs.scene_of_run import build_scene
from pipeline.scenario.scenario import load

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
