from functools import partial

import numpy as np
import pandas as pd
import pytest
from batches import run
from commands import pipeline
from rich.console import Console
from stub_solvers import KILLS, RAISES, by_friction

from pipeline.batch.driver import complete
from pipeline.batch.failures import MOST_LISTED, listed, place, without_runout
from pipeline.batch.task import Outcome
from pipeline.scenario.scenario import load
from pipeline.store.place import held
from pipeline.store.variables import Status

SWEEP = f"""\
sweep:
  material.bed_friction:
    - 20
    - {RAISES}
  release.height: [0.5,
    0.75]
"""


def test_a_run_is_placed_where_its_values_stand(scenario_file):
    scenario = load([scenario_file(more=SWEEP)])[0]
    lines = [place(scenario, index) for index in range(4)]
    assert lines == [f"{scenario.path}:{at}" for at in ("11,13", "11,14", "12,13", "12,14")]
    assert place(load([scenario_file()])[0], 0) == f"{scenario.path}:1"


@pytest.mark.usefixtures("shared_workers")
def test_failures_are_listed_at_the_end_with_place_and_reason(scenario_file, out, log, capsys):
    file = scenario_file(20, RAISES, 21)
    with held(out):
        solve = partial(by_friction, log=log)
        complete(load([file]), out, Console(width=200), solve=solve)
    lines = capsys.readouterr().out.splitlines()
    assert lines[-1] == "1 failed; run again with --retry-failed to repeat them"
    assert lines[-2] == f"{file}:9: box run 1, bed_friction=11.0: failed: ValueError: this run raises"
    assert any("0 running" not in line and "running" in line and "left" in line for line in lines)


def test_runs_without_a_run_out_are_told_with_the_threshold(scenario_file):
    scenario = load([scenario_file(20, more="output: {threshold: 50}\n")])[0]
    rows = pd.DataFrame(
        {
            "status": ["done", "cut_off", "failed", "pending", "done_but_overrun"],
            "runout_distance": [3.0, np.nan, np.nan, np.nan, np.nan],
        }
    )
    (told,) = without_runout(scenario, rows)
    assert told.startswith(
        "box: 2 of 3 computed runs have no run-out, as nothing deeper than output.threshold"
    )
    assert "(50 m)" in told
    assert list(without_runout(scenario, rows[:1])) == []
    assert list(without_runout(load([scenario_file(20)])[0], rows)) == []


def test_a_long_list_is_cut(scenario_file, out):
    scenario = load([scenario_file(*range(1, 31))])[0]
    failed = [Outcome(out / "box.zarr", run, Status.FAILED, "why") for run in reversed(range(30))]
    lines = list(listed([scenario], failed))
    assert len(lines) == MOST_LISTED + 1
    assert "box run 0, bed_friction=1: failed: why" in lines[0]
    assert lines[-1].startswith("and 10 more")


@pytest.mark.usefixtures("shared_workers")
def test_the_log_has_a_line_for_every_run_of_every_batch(scenario_file, out, log, tmp_path):
    file = scenario_file(20, RAISES, KILLS)
    run(out, file, solve=partial(by_friction, log=log))
    lines = sorted(line.partition(" ")[2] for line in (out / "runs.log").read_text().splitlines())
    assert lines == [
        "box run 0: done, 0 s",
        "box run 1: failed, nan s: ValueError: this run raises",
        "box run 2: failed, nan s: the worker process died of this run, twice",
    ]
    run(out, scenario_file(20, name="second"), solve=partial(by_friction, log=log))
    assert len((out / "runs.log").read_text().splitlines()) == 4
    other = tmp_path / "elsewhere.log"
    result = pipeline("run", scenario_file(20, name="third"), "--out", out, "--log", other, "--part", "1/1")
    assert result.exit_code == 0, result.stderr
    assert other.read_text().count("third run 0: ") == 1


@pytest.mark.usefixtures("shared_workers")
def test_a_log_that_cannot_be_written_stops_nothing(scenario_file, out, log):
    (out / "runs.log").mkdir(parents=True)
    assert run(out, scenario_file(20), solve=partial(by_friction, log=log)).exit_code == 0
