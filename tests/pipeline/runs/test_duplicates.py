from functools import partial

import numpy as np
import xarray as xr
from batches import computed, files, run
from commands import pipeline
from stub_solvers import FAILS, by_friction

from pipeline.runs.duplicates import copies
from pipeline.scenario.scenario import load


def test_runs_of_several_scenarios_with_the_same_physics_are_found(scenario_file, out):
    first = scenario_file(24, 25, 26, name="first")
    second = scenario_file(26, 27.0, 24, name="second", replace=("description: a box", "description: it"))
    third = scenario_file(name="third", replace=("bed_friction: 25", "bed_friction: 27"))
    fourth = scenario_file(24, name="fourth", replace=("end: 1,", "end: 2,"))
    found = copies(load([first, second, third, fourth]), out)
    at = {name: out / f"{name}.zarr" for name in ("first", "second", "third")}
    assert found == {
        at["second"]: {0: (at["first"], 2), 2: (at["first"], 0)},
        at["third"]: {0: (at["second"], 1)},
    }


def test_what_is_drawn_twice_from_a_list_is_found(scenario_file, out):
    values = "{material.bed_friction: {distribution: discrete, values: [20, 21]}}"
    (same,) = copies(load([scenario_file(more=f"sample: {{count: 8, values: {values}}}\n")]), out).values()
    assert len(same) == 6


def test_they_are_computed_once_and_stored_as_if_computed(scenario_file, out, log, tmp_path, shared_workers):
    first, second = scenario_file(24, 25, name="first"), scenario_file(25, 26, FAILS, name="second")
    solve = partial(by_friction, log=log)
    assert run(out, first, solve=solve).exit_code == 0
    assert run(out, first, second, solve=solve).exit_code == 1
    assert computed(log) == {24: 1, 25: 1, 26: 1, FAILS: 1}
    alone = tmp_path / "alone"
    assert run(alone, second, solve=solve).exit_code == 1
    assert files(out / "second.zarr") == files(alone / "second.zarr")
    store = xr.open_zarr(out / "second.zarr", consolidated=False)
    assert float(store["cpu_time"][0]) == 0
    assert np.isnan(store["front_x"][2])
    assert pipeline("verify", out).exit_code == 0


def test_a_failed_run_is_no_source(scenario_file, out, log, shared_workers):
    first, second = scenario_file(FAILS, name="first"), scenario_file(FAILS, 26, name="second")
    assert run(out, first, second, solve=partial(by_friction, log=log)).exit_code == 1
    assert computed(log) == {FAILS: 2, 26: 1}
