import fcntl
import json
import logging
import os
import subprocess
import sys
from functools import partial
from importlib.metadata import version
from itertools import pairwise
from pathlib import Path

import pandas as pd
import pytest
import xarray as xr
from commands import pipeline
from rich.console import Console
from stub_solvers import RAISES, by_friction, still

from pipeline import cli
from pipeline.assess import plots
from pipeline.cli import display
from pipeline.store import zarr_store
from pipeline.store.run_table import HEAD
from pipeline.store.variables import PER_RUN


@pytest.fixture
def solve(monkeypatch, shared_workers):
    """Put a stub in the solver's place."""

    def use(stub):
        from pipeline.batch import driver

        monkeypatch.setitem(driver.complete.__kwdefaults__, "solve", stub)

    use(still)
    return use


def test_help_comes_without_what_takes_long_to_load():
    shown = subprocess.run([sys.executable, "-m", "pipeline", "--help"], capture_output=True, text=True)
    assert shown.returncode == 0
    assert "validate" in shown.stdout
    heavy = "{'numpy', 'xarray', 'dask', 'pydantic', 'rich'}"
    code = f"import sys, pipeline.cli.app; print({heavy} & set(sys.modules))"
    loaded = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert loaded.stdout.strip() == "set()"


def test_a_run_ends_with_a_table_and_the_paths(scenario_file, tmp_path, solve):
    out = tmp_path / "results"
    result = pipeline("run", scenario_file(20, 21), "--out", out)
    assert result.exit_code == 0
    lines = result.stdout.splitlines()
    assert lines[-3:-1] == [str(out / "box.zarr"), str(out / "summary.csv")]
    assert lines[-1] == f"next: pipeline tables {out}, pipeline hazard {out}, pipeline report {out}"
    assert "bed_friction=21" in result.stdout
    table = pd.read_csv(out / "summary.csv")
    assert list(table.columns) == [*HEAD, "bed_friction", "weight", *(v.name for v in PER_RUN)]
    assert table["status"].tolist() == ["done", "done"]
    assert table["front_x"].tolist() == [3, 3]


def test_the_table_keeps_scenarios_of_earlier_invocations(scenario_file, tmp_path, solve):
    out = tmp_path / "results"
    assert pipeline("run", scenario_file(20, name="first"), "--out", out).exit_code == 0
    solve(partial(by_friction, log=tmp_path / "log"))
    assert pipeline("run", scenario_file(RAISES, name="second"), "--out", out).exit_code == 1
    table = pd.read_csv(out / "summary.csv")
    assert table[["scenario", "status"]].to_numpy().tolist() == [["first", "done"], ["second", "failed"]]
    assert table["front_x"].isna().tolist() == [False, True]


@pytest.mark.parametrize(
    ("key", "values", "name", "units", "meaning"),
    [
        ("release.x.0", [0.5, 1], "release_x_0", "m", "extent along the bed"),
        ("boundaries.x_min", ["open", "wall"], "x_min", None, "upslope side"),
        ("scheme.cfl", [0.4, 0.8], "cfl", "1", "Courant number"),
    ],
)
def test_any_key_can_be_swept_and_its_coordinate_says_what_it_is(
    scenario_file, tmp_path, solve, key, values, name, units, meaning
):
    out = tmp_path / "results"
    result = pipeline("run", scenario_file(more=f"sweep: {{{key}: {values}}}\n"), "--out", out)
    assert result.exit_code == 0, result.stderr
    with zarr_store.open_store(out / "box.zarr") as opened:
        assert opened[name].to_numpy().tolist() == values
        assert opened[name].attrs.get("units") == units
        assert opened[name].attrs["key"] == key
        assert opened[name].attrs["long_name"].startswith(meaning)


def test_what_lies_outside_the_domain_is_warned_of_and_stored(scenario_file, tmp_path, solve):
    out = tmp_path / "results"
    result = pipeline("run", scenario_file(replace=("x: [1, 3]", "x: [-1.25, 1]")), "--out", out)
    assert result.exit_code == 0
    assert "lie outside the domain and are lost" in result.stderr
    with zarr_store.open_store(out / "box.zarr") as opened:
        assert opened["volume_lost"].item() == 1.0
        assert opened["volume_released"].item() == 1.25
        assert opened["volume_asked"].item() == 2.25


def test_summary_prints_and_writes_what_was_asked_for(scenario_file, tmp_path, solve):
    out = tmp_path / "results"
    pipeline("run", scenario_file(), "--out", out)
    to = tmp_path / "table.parquet"
    result = pipeline("summary", out, "--to", to)
    assert result.exit_code == 0
    assert "box" in result.stdout
    written, same = pd.read_csv(out / "summary.csv"), pd.read_parquet(to)
    assert list(same.columns) == list(written.columns)
    assert same["volume_released"].tolist() == written["volume_released"].tolist()
    assert pipeline("summary", out, "--to", tmp_path / "table.xlsx").exit_code == 2
    assert pipeline("summary", tmp_path / "nowhere").exit_code == 2


def test_bad_input_writes_nothing_and_names_every_mistake(scenario_file, tmp_path):
    out = tmp_path / "results"
    wrong = scenario_file(replace=("height: 0.5", "heigt: 0.5"), name="wrong")
    worse = scenario_file(replace=("spacing: 0.5", "spacing: -1"), name="worse")
    result = pipeline("run", wrong, worse, "--out", out)
    assert result.exit_code == 2
    assert f"{wrong}:6:" in result.stderr
    assert f"{worse}:5:" in result.stderr
    assert not out.exists()
    assert pipeline("validate", wrong).exit_code == 2


def test_a_changed_scenario_is_refused_with_what_changed(scenario_file, tmp_path, solve):
    out = tmp_path / "results"
    pipeline("run", scenario_file(), "--out", out)
    changed = scenario_file(replace=("bed_friction: 25", "bed_friction: 26"))
    result = pipeline("run", changed, "--out", out)
    assert result.exit_code == 2
    assert "material.bed_friction" in result.stderr
    assert "--overwrite" in result.stderr
    assert pipeline("run", changed, "--out", out, "--overwrite").exit_code == 0


def test_a_place_in_use_is_left_alone(scenario_file, tmp_path):
    out = tmp_path / "results"
    out.mkdir()
    with (out / ".lock").open("w") as lock:
        fcntl.flock(lock, fcntl.LOCK_EX)
        lock.write("process 1 on elsewhere")
        lock.flush()
        result = pipeline("run", scenario_file(), "--out", out)
    assert result.exit_code == 4
    assert result.stderr.strip() == f"{out} is in use by process 1 on elsewhere"
    assert [p.name for p in out.iterdir()] == [".lock"]


def test_a_place_that_cannot_be_made_is_trouble(scenario_file, tmp_path):
    (tmp_path / "file").write_text("in the way")
    assert pipeline("run", scenario_file(), "--out", tmp_path / "file" / "results").exit_code == 3


def test_something_else_of_the_stores_name_is_not_touched(scenario_file, tmp_path):
    other = tmp_path / "results" / "box.zarr"
    other.mkdir(parents=True)
    (other / "precious").write_text("data")
    assert pipeline("run", scenario_file(), "--out", tmp_path / "results", "--overwrite").exit_code == 3
    assert (other / "precious").read_text() == "data"


def test_validate_lists_the_runs_and_writes_nothing(scenario_file, tmp_path):
    file = scenario_file(20, 21)
    before = sorted(tmp_path.iterdir())
    result = pipeline("validate", file)
    assert result.exit_code == 0
    first = result.stdout.splitlines()[0]
    assert first.startswith(f"{file}: box: 2 runs, ")
    assert "points, memory" in first
    assert "bed_friction=20" in result.stdout.splitlines()[1]
    assert sorted(tmp_path.iterdir()) == before


def test_validate_lists_the_first_of_many_runs_and_the_ranges_of_all(scenario_file):
    shown = pipeline("validate", scenario_file(*(20 + k / 7 for k in range(40)))).stdout.splitlines()
    assert shown[1:3] == ["  0: bed_friction=20", "  1: bed_friction=20.14"]
    assert shown[11] == "  ... 30 more (--json lists them). All: bed_friction from 20 to 25.57"
    assert len(shown) == 12


def test_schema_is_json():
    assert json.loads(pipeline("schema").stdout)["properties"]["gravity"]["default"] == 9.81


def test_plot_draws_a_run(scenario_file, tmp_path, solve):
    out = tmp_path / "results"
    pipeline("run", scenario_file(20, 21), "--out", out)
    result = pipeline("plot", out / "box.zarr", "--run", 1)
    assert result.exit_code == 0, result.stderr
    assert (out / "box.png").read_bytes().startswith(b"\x89PNG")
    assert pipeline("plot", out / "box.zarr", "--run", 2).exit_code == 2
    assert pipeline("plot", out / "other.zarr").exit_code == 2


def test_the_console_command_runs_the_solver_and_resumes(scenario_file, tmp_path):
    out = tmp_path / "results"
    command = [
        sys.executable,
        "-m",
        "pipeline",
        "run",
        scenario_file(20, 27),
        "--out",
        out,
        "--workers",
        "1",
    ]
    first = subprocess.run(command, capture_output=True, text=True, check=False)
    assert first.returncode == 0, first.stdout + first.stderr
    assert first.stderr == ""
    with zarr_store.open_store(out / "box.zarr") as opened:
        assert opened["steps"].min() > 1
        assert float(abs(opened["volume_error"]).max()) <= 1e-12
        assert (opened["peak_speed"] > 0.1).all()
    times = {p: p.stat().st_mtime_ns for p in Path(out / "box.zarr").rglob("*")}
    second = subprocess.run(command, capture_output=True, text=True, check=False)
    assert second.returncode == 0, second.stderr
    assert {p: p.stat().st_mtime_ns for p in Path(out / "box.zarr").rglob("*")} == times


def test_weights_may_change_without_a_run_being_done_again(scenario_file, out, solve):
    first = scenario_file(20, 21, more="return_periods: [30, 300]\n")
    assert pipeline("run", first, "--out", out).exit_code == 0
    before = xr.open_zarr(out / "box.zarr", consolidated=False).load()
    second = scenario_file(20, 21, more="weights: {material.bed_friction: [1, 3]}\n")
    assert pipeline("run", second, "--out", out).exit_code == 0
    after = xr.open_zarr(out / "box.zarr", consolidated=False).load()
    assert before.return_period.to_numpy().tolist() == [30, 300]
    assert "return_period" not in after
    assert before.weight.to_numpy().tolist() == [0.5, 0.5]
    assert after.weight.to_numpy().tolist() == [0.25, 0.75]
    assert after.attrs["scenario"] == second.read_text()
    xr.testing.assert_identical(
        after.drop_vars("weight").drop_attrs(), before.drop_vars(["weight", "return_period"]).drop_attrs()
    )
    assert pipeline("verify", out).exit_code == 0


def test_a_second_run_says_that_nothing_was_left(scenario_file, out, solve):
    file = scenario_file(20, 21)
    assert "nothing was left to do" not in pipeline("run", file, "--out", out).stdout
    assert "nothing was left to do" in pipeline("run", file, "--out", out).stdout


def test_runs_that_failed_earlier_tell_their_reason_again(scenario_file, out, log, solve):
    solve(partial(by_friction, log=log))
    file = scenario_file(20, RAISES)
    pipeline("run", file, "--out", out)
    reason = "box run 1, bed_friction=11.0: failed: ValueError: this run raises"
    for again in (pipeline("run", file, "--out", out), pipeline("status", out)):
        assert reason in again.stdout
        assert "1 failed; run again with --retry-failed to repeat them" in again.stdout
    solve(still)
    mended = pipeline("run", file, "--out", out, "--retry-failed")
    assert mended.exit_code == 0
    assert "failed:" not in mended.stdout
    assert "--retry-failed" not in mended.stdout


def test_quiet_prints_nothing(scenario_file, out, log, solve):
    result = pipeline("run", scenario_file(20, 21), "--out", out, "--quiet")
    assert (result.exit_code, result.output) == (0, "")
    assert len(pd.read_csv(out / "summary.csv")) == 2


def test_json_is_for_other_programs(scenario_file, out, log, solve):
    solve(partial(by_friction, log=log))
    file = scenario_file(20, RAISES)
    (checked,) = json.loads(pipeline("validate", file, "--json").stdout)["scenarios"]
    assert checked["runs"] == [{"bed_friction": 20.0}, {"bed_friction": RAISES}]
    pipeline("run", file, "--out", out)
    told = json.loads(pipeline("status", out, "--json").stdout)
    assert told["in_use_by"] is None
    (scenario,) = told["scenarios"]
    assert scenario["runs"] == {"done": 1, "failed": 1}
    assert scenario["failures"] == [
        {"run": 1, "parameters": {"bed_friction": RAISES}, "reason": "ValueError: this run raises"}
    ]
    rows = json.loads(pipeline("summary", out, "--json").stdout)
    assert [row["status"] for row in rows] == ["done", "failed"]
    assert [row["front_x"] for row in rows] == [3, None]
    wrong = pipeline("validate", scenario_file(replace=("height: 0.5", "height: -1")), "--json")
    assert wrong.exit_code == 2
    (mistake,) = json.loads(wrong.stdout)["mistakes"]
    assert (mistake["line"], mistake["key"]) == (6, "release.height")


def test_the_version_is_printed():
    assert pipeline("--version").stdout == f"lmls {version('lmls')}\n"


def test_the_shell_completes_commands():
    shown = subprocess.run(
        [sys.executable, "-m", "pipeline"],
        env=os.environ
        | {"_PIPELINE_COMPLETE": "complete_bash", "COMP_WORDS": "pipeline sta", "COMP_CWORD": "1"},
        capture_output=True,
        text=True,
        check=False,
    )
    assert "status" in shown.stdout + shown.stderr


@pytest.mark.parametrize(
    ("options", "words"),
    [
        (
            ["--memory-limit", "2"],
            "--memory-limit: expected a size as 2GB or 500MiB, found '2', which is 2 bytes",
        ),
        (
            ["--scheduler", "localhost"],
            "--scheduler: expected an address as tcp://host:8786, found 'localhost'",
        ),
        (["--part", "1/2", "--overwrite"], "--overwrite: expected without --part"),
    ],
)
def test_options_that_cannot_be_end_with_a_sentence(scenario_file, out, options, words):
    result = pipeline("run", scenario_file(), "--out", out, *options)
    assert result.exit_code == 2
    assert result.stderr.startswith(words)
    assert not out.exists()


def test_plot_chooses_frames_evenly_or_by_their_times(scenario_file, out, solve, monkeypatch):
    drawn = []
    monkeypatch.setattr(plots, "_label", lambda panel, time, ticks: drawn.append(round(time, 3)))
    pipeline("run", scenario_file(replace=("output_every: 0.5", "output_every: 0.01")), "--out", out)

    def times(*options):
        drawn.clear()
        result = pipeline("plot", out / "box.zarr", *options, "--to", out / "pictures" / "box.png")
        assert result.exit_code == 0, result.stderr
        return drawn

    evenly = times()
    assert 10 <= len(evenly) <= 12
    assert evenly[-1] == 1
    assert len({round(later - earlier, 3) for earlier, later in pairwise(evenly)}) == 1
    # the nearest of the frames
    assert times("--times", "0.502,0,1") == [0, 0.5, 1]
    beyond = pipeline("plot", out / "box.zarr", "--times", "2")
    assert (beyond.exit_code, beyond.stderr.strip()) == (
        2,
        "expected times from 0 to 1 s, the end of run 0, found 2",
    )
    assert pipeline("plot", out / "box.zarr", "--times", "now").exit_code == 2


def test_a_long_command_shows_what_it_is_doing_on_a_terminal(monkeypatch, capsys):
    monkeypatch.setattr(display, "Console", partial(Console, force_terminal=True, width=80))
    with display.working("hazard") as told:
        told.line("box: 2 of 2 runs done")
        logging.getLogger("pipeline.hazard").info("box")
        shown = capsys.readouterr()
        assert shown.out == ""
    assert capsys.readouterr().out == "box: 2 of 2 runs done\n"
    monkeypatch.undo()
    with display.working("hazard") as told:
        told.line("at once where nothing moves")
        assert capsys.readouterr() == ("at once where nothing moves\n", "")


def test_a_store_given_as_a_place_and_a_place_as_a_store_are_told_apart(scenario_file, out, solve):
    pipeline("run", scenario_file(), "--out", out)
    store = out / "box.zarr"
    for command in (["tables", store], ["status", store], ["run", scenario_file(), "--out", store]):
        result = pipeline(*command)
        words = f"{store}: expected the place that stores lie in, {out}, found the store of one scenario"
        assert (result.exit_code, result.stderr.strip()) == (2, words)
    result = pipeline("plot", out)
    assert (result.exit_code, result.stderr.strip()) == (
        2,
        f"{out}: expected a store, found a place; its stores are {store}",
    )
    result = pipeline("plot", out / "other.zarr")
    assert (result.exit_code, result.stderr.strip()) == (
        2,
        f"{out / 'other.zarr'}: expected the store of a scenario, as <out>/<name>.zarr, found none",
    )
    result = pipeline("status", "s3:/bucket/path")
    words = "s3:/bucket/path: expected a URL as s3://bucket/path, or a folder"
    assert (result.exit_code, result.stderr.strip()) == (2, words)


def test_commands_use_one_thread_of_blas_unless_told_otherwise(monkeypatch):
    monkeypatch.setattr("pipeline.cli.app.main", lambda: None)
    # set first, so that what the command sets is undone
    monkeypatch.setenv("OPENBLAS_NUM_THREADS", "")
    monkeypatch.delenv("OPENBLAS_NUM_THREADS")
    monkeypatch.setenv("MKL_NUM_THREADS", "3")
    cli.main()
    assert (os.environ["OPENBLAS_NUM_THREADS"], os.environ["MKL_NUM_THREADS"]) == ("1", "3")
