from functools import partial

import numpy as np
import pandas as pd
import pytest
from batches import run
from commands import pipeline
from scipy import stats
from stub_solvers import FAILS, OVERRUNS, by_friction

from pipeline.assess.tables import assess
from solver.simulation import simulate

LAYER = """\
name: layer
terrain: {profile: plane, angle: 30}
domain: {x: [0, 20], y: [-1, 1]}
points: {spacing: 0.5}
release: {shape: box, x: [0, 20], y: [-1, 1], height: 0.5}
material: {bed_friction: 20, earth_pressure: isotropic}
boundaries: {y_min: wall, y_max: wall}
time: {end: 1}
sample:
  count: 64
  values: {material.bed_friction: {distribution: triangular, lower: 12, mode: 18, upper: 28}}
receptors:
  - {name: middle, point: [15, 0]}
"""


def test_a_block_that_slides_with_random_friction_exceeds_speeds_as_often_as_theory_says(
    tmp_path, out, shared_workers
):
    """Speed after 1 s is g (sin 30 - cos 30 tan delta), so that it exceeds s for all delta below one."""
    file = tmp_path / "layer.yaml"
    file.write_text(LAYER)
    assert run(out, file, solve=simulate).exit_code == 0
    rows = assess(out)["receptor-runs"]
    friction = stats.triang(6 / 16, 12, 16)
    for speed in (0.5, 1.0, 2.0, 3.0):
        limit = np.degrees(np.arctan((np.sin(np.pi / 6) - speed / 9.81) / np.cos(np.pi / 6)))
        share = (rows["max_speed"] > speed).mean()
        # draws in layers leave one of them in doubt
        assert share == pytest.approx(friction.cdf(limit), abs=1 / 64)
        assert (rows["max_pressure"] > 2 * speed**2).mean() == share


def test_failed_and_overrun_runs_are_counted_in_every_number(scenario_file, out, shared_workers, log):
    receptors = "receptors: [{name: near, point: [2, 0]}, {name: far, line: [[8, -1], [8, 1]]}]\n"
    file = scenario_file(20, FAILS, 22, OVERRUNS, more=receptors)
    assert run(out, file, solve=partial(by_friction, log=log)).exit_code == 1
    tables = assess(out)
    runout = tables["scenarios"].set_index("quantity").loc["deposit_length"]
    assert (runout["runs_planned"], runout["runs_done"], runout["runs_failed"]) == (4, 3, 1)
    assert runout["q50"] == runout["q50_lower"] == 2.0
    assert np.isnan(runout["q95_upper"])
    near, far = (row for _, row in tables["receptors"].iterrows())
    assert (near["probability_lower"], near["probability"], near["probability_upper"]) == (0.75, 1, 1)
    # the run that failed, and the one that lost material
    assert (far["probability_lower"], far["probability"], far["probability_upper"]) == (0, 0, 0.5)
    assert np.isnan(far["median_max_depth"])
    by_run = tables["receptor-runs"]
    assert by_run["reached"].isna().tolist() == [False, True, False, False] * 2


def test_tables_are_written_as_they_are_asked_for(scenario_file, out, shared_workers, log):
    run(out, scenario_file(20, 21), solve=partial(by_friction, log=log))
    told = pipeline("tables", out, "--kind", "parquet", "--kind", "md")
    assert told.exit_code == 0
    written = sorted(path.name for path in (out / "tables").iterdir())
    assert written == sorted(
        f"{name}.{kind}" for name in ("runs", "scenarios", "runout-exceedance") for kind in ("parquet", "md")
    )
    assert len(pd.read_parquet(out / "tables" / "runs.parquet")) == 2
    assert pipeline("tables", out / "nowhere").exit_code == 2


def test_an_overrun_run_says_by_how_much(scenario_file, out, shared_workers, log):
    file = scenario_file(20, OVERRUNS)
    assert run(out, file, solve=partial(by_friction, log=log)).exit_code == 0
    shown = pipeline("summary", out).stdout
    lost = float(pd.read_csv(out / "summary.csv")["volume_out"][1]) / 2
    assert f"overrun {100 * lost:.2g} %" in shown
    assert f"{100 * lost:.2g} % of the volume left the domain" in (out / "runs.log").read_text()
