import subprocess
import sys
from functools import partial

import pytest
from batches import run
from commands import pipeline
from stub_solvers import FAILS, OVERRUNS, by_friction

from pipeline.batch.driver import ChangedError
from pipeline.store import provenance, zarr_store
from pipeline.store.place import holder


@pytest.fixture
def done(scenario_file, out, log, shared_workers):
    """Do a batch; gives its place."""

    def do(*angles, name="box", **options):
        run(out, scenario_file(*angles, name=name), solve=partial(by_friction, log=log), **options)
        return out

    return do


def test_it_counts_the_runs_of_each_scenario_and_says_what_made_them(done):
    out = done(20, FAILS, OVERRUNS, 21)
    done(22, name="second")
    (out / "box.zarr" / "status" / "c" / "3").unlink()
    (out / "foreign.zarr").mkdir()
    lines = pipeline("status", out).stdout.splitlines()
    assert lines[0] == "box: 4 runs: 1 pending, 1 done, 1 failed, 1 done but overrun"
    assert lines[2] == "second: 1 run: 0 pending, 1 done, 0 failed, 0 done but overrun"
    for line, name in ((lines[1], "box"), (lines[3], "second")):
        scenario = zarr_store.attributes(out / f"{name}.zarr")["scenario_hash"][:12]
        solver, summaries = (provenance.made_by()[f"{of}_hash"][:12] for of in ("solver", "summary"))
        assert line == f"  scenario {scenario}, made by lmls 0.1.0, solver {solver}, summaries {summaries}"
    assert lines[4].startswith("box run 1, bed_friction=13.0: failed: not finite at t = 0.5 s")
    assert lines[5:] == ["1 failed; run again with --retry-failed to repeat them", "no process uses it"]


def test_it_names_who_holds_the_place_and_does_not_hinder_them(done):
    out = done(20)
    code = "import sys, time; from pathlib import Path; from pipeline.store.place import held\n"
    code += "with held(Path(sys.argv[1])): print('held', flush=True); time.sleep(60)"
    with subprocess.Popen([sys.executable, "-c", code, out], stdout=subprocess.PIPE) as process:
        process.stdout.readline()
        assert (
            pipeline("status", out).stdout.splitlines()[-1].startswith(f"in use by process {process.pid} on ")
        )
        process.kill()
    assert holder(out) is None
    assert pipeline("status", out).stdout.splitlines()[-1] == "no process uses it"


def test_it_writes_nothing_and_refuses_a_place_without_results(done, tmp_path):
    out = done(20)
    (out / ".lock").unlink()
    before = {path: path.stat().st_mtime_ns for path in out.rglob("*")}
    assert pipeline("status", out).exit_code == 0
    assert {path: path.stat().st_mtime_ns for path in out.rglob("*")} == before
    assert pipeline("status", tmp_path / "nowhere").exit_code == 2


def test_a_store_of_another_solver_is_told_and_refused(done, scenario_file, monkeypatch):
    out = done(20)
    other = provenance.made_by() | {"solver_hash": "f" * 64, "numpy_version": "1.0"}
    monkeypatch.setattr(provenance, "made_by", lambda: other)
    found = provenance.differences(zarr_store.attributes(out / "box.zarr"))
    assert [line.split(":")[0] for line in found] == ["solver", "NumPy"]
    assert found[0].endswith("is ffffffffffff")
    assert f"another one here: {', '.join(found)}" in pipeline("status", out).stdout
    result = pipeline("run", scenario_file(20), "--out", out)
    assert result.exit_code == 2
    assert "made by something else: solver: was" in result.stderr
    assert "--overwrite" in result.stderr
    with pytest.raises(ChangedError, match=r"NumPy: was .*, is 1\.0"):
        done(20)
    done(20, overwrite=True)
    assert zarr_store.attributes(out / "box.zarr")["numpy_version"] == "1.0"
