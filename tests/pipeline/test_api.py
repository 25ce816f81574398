import json
import subprocess
import sys
import threading
from functools import partial

import numpy as np
import pandas as pd
import pytest
import xarray as xr
import yaml
from catalogue import SCENARIO
from stub_solvers import RAISES, by_friction, still

import pipeline
from pipeline.batch import driver, interrupts
from pipeline.store.place import held

BOX = yaml.safe_load(SCENARIO.format(name="box"))

# no guard, and a running event loop, as in a notebook
SCRIPT = """
import asyncio
import sys
import pipeline

async def cell():
    return pipeline.run(sys.argv[1], out=sys.argv[2], workers=2)

results = asyncio.run(cell())
print("got", len(results.table), float(results["box"].max_depth.max()), results.exit_code)
"""

pytestmark = pytest.mark.usefixtures("few_pictures")


@pytest.fixture
def solve(monkeypatch, shared_workers):
    """Put a stub in the solver's place."""

    def use(stub):
        monkeypatch.setitem(driver.complete.__kwdefaults__, "solve", stub)

    use(still)
    return use


def swept(*angles):
    return {**BOX, "sweep": {"material.bed_friction": list(angles)}}


def test_a_script_without_a_main_guard_runs_a_batch(scenario_file, out, tmp_path):
    script = tmp_path / "script.py"
    script.write_text(SCRIPT)
    command = [sys.executable, script, scenario_file(20, 27), out]
    done = subprocess.run(command, capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stdout + done.stderr
    assert done.stderr == ""
    # the script itself ran once
    (got,) = [line.split() for line in done.stdout.splitlines() if line.startswith("got")]
    assert (got[1], got[3]) == ("2", "0")
    assert float(got[2]) > 0.4


def test_a_run_gives_datasets_and_the_table(scenario_file, out, solve):
    results = pipeline.run([scenario_file(20, 21), {**BOX, "name": "other"}], out=out, quiet=True)
    assert list(results) == ["box", "other"]
    assert results["box"].sizes["run"] == 2
    # nothing of the fields is read before it is used
    assert results["box"].depth.chunks is not None
    assert results.table["scenario"].tolist() == ["box", "box", "other"]
    assert results.table["front_x"].tolist() == [3, 3, 3]
    assert "box: 2 done" in repr(results)
    with pytest.raises(KeyError, match="the scenarios are box, other"):
        results["none"]
    opened = pipeline.open(out)
    assert list(opened) == ["box", "other"]
    pd.testing.assert_frame_equal(opened.table, results.table)
    xr.testing.assert_identical(pipeline.open(out / "box.zarr").load(), results["box"].load())
    pd.testing.assert_frame_equal(pipeline.run_table(results), pipeline.run_table(str(out)))


def test_a_mapping_is_the_scenario_that_its_file_would_be(scenario_file, out):
    (read,) = pipeline.load(scenario_file(20, 21))
    given = swept(np.int64(20), 21)
    given["domain"] = {"x": (0, 10), "y": np.array([-2, 2])}
    (made,) = pipeline.load(given)
    assert (made.digest, made.content) == (read.digest, read.content)
    # the text that is stored is a scenario too
    assert yaml.safe_load(made.text)["domain"]["y"] == [-2, 2]


def test_mistakes_of_mappings_and_files_are_raised_together(scenario_file, out):
    wrong = {**BOX, "name": "wrong", "gravity": -1, "relese": 1}
    with pytest.raises(pipeline.BadInput) as error:
        pipeline.run([wrong, scenario_file(replace=("height: 0.5", "heigt: 0.5"))], out=out)
    lines = str(error.value).splitlines()
    assert len(lines) == len(error.value.mistakes) == 4
    assert "wrong: gravity: expected a number above 0, found -1" in lines
    assert sum("box.yaml:6:" in line for line in lines) == 2
    assert not out.exists()


@pytest.mark.parametrize(
    ("options", "words"),
    [
        ({"workers": 0}, "workers: expected at least 1, found 0"),
        (
            {"memory_limit": "2"},
            "memory_limit: expected a size as 2GB or 500MiB, found '2', which is 2 bytes",
        ),
        ({"memory_limit": "two"}, "memory_limit: expected a size as 2GB or 500MiB, found 'two'"),
        ({"scheduler": "localhost"}, "scheduler: expected an address as tcp://host:8786, found 'localhost'"),
        ({"jobqueue": "pbs"}, "jobqueue: expected slurm, found 'pbs'"),
        ({"part": "3/2"}, "part: expected a part as 1/8 to 8/8, found '3/2'"),
        ({"part": "1/2", "jobqueue": "slurm"}, "--jobqueue and --part: expected one of them at most"),
    ],
)
def test_options_that_cannot_be_are_refused(out, options, words):
    with pytest.raises(pipeline.OptionError) as error:
        pipeline.run(BOX, out=out, **options)
    assert str(error.value) == words
    assert not out.exists()


def test_failed_runs_raise_nothing_and_stand_in_the_table(out, log, solve):
    solve(partial(by_friction, log=log))
    results = pipeline.run(swept(20, RAISES), out=out, quiet=True)
    assert results.table["status"].tolist() == ["done", "failed"]
    assert results.exit_code == 1


def test_a_changed_scenario_and_a_place_in_use_raise(out, solve):
    pipeline.run(BOX, out=out, quiet=True)
    changed = {**BOX, "gravity": 1.62}
    with pytest.raises(pipeline.ChangedError, match=r"gravity: was 9\.81, is 1\.62"):
        pipeline.run(changed, out=out, quiet=True)
    assert len(pipeline.run(changed, out=out, overwrite=True, quiet=True)) == 1
    with held(out), pytest.raises(pipeline.PlaceInUseError):
        pipeline.run(changed, out=out, quiet=True)


def test_an_interrupted_batch_and_trouble_of_the_place_raise_unless_unchecked(out, solve, monkeypatch):
    ending = driver.Ending(interrupted=True)
    monkeypatch.setattr(driver, "_execute", lambda *_: ending)
    with pytest.raises(KeyboardInterrupt):
        pipeline.run(BOX, out=out, quiet=True)
    assert pipeline.run(BOX, out=out, quiet=True, check=False).exit_code == 130
    ending.interrupted, ending.trouble = False, "disk full"
    with pytest.raises(OSError, match="disk full"):
        pipeline.run(BOX, out=out, quiet=True)
    assert pipeline.run(BOX, out=out, quiet=True, check=False).exit_code == 3


def test_what_a_scenario_warns_of_is_warned_of(out, solve):
    beyond = {**BOX, "release": {**BOX["release"], "x": [-1.25, 1]}}
    with pytest.warns(UserWarning, match="lie outside the domain and are lost"):
        pipeline.run(beyond, out=out, quiet=True)


def test_opening_what_is_not_there_says_so(tmp_path):
    with pytest.raises(FileNotFoundError, match="expected the store of a scenario"):
        pipeline.open(tmp_path / "box.zarr")
    with pytest.raises(FileNotFoundError, match="no results in"):
        pipeline.open(tmp_path)


def test_interrupts_outside_the_main_thread_are_left_to_others():
    asked = []

    def batch():
        with interrupts.heard(asked.append) as heard:
            asked.append(heard.asked)

    thread = threading.Thread(target=batch)
    thread.start()
    thread.join()
    assert asked == [False]


def test_maps_tables_indices_and_the_report_come_from_one_place(out, tmp_path, solve):
    several = swept(*np.linspace(15, 25, 41))
    several["output"] = {"threshold": 0.1}
    several["receptors"] = [{"name": "house", "point": [2, 0]}]
    results = pipeline.run(several, out=out, quiet=True)
    maps = pipeline.hazard_maps(results, depth=[0.25, 0.1], to=tmp_path / "maps", pictures=False)
    assert maps["box"].depth_threshold.to_numpy().tolist() == [0.1, 0.25]
    assert (tmp_path / "maps" / "box" / "hazard.nc").exists()
    tables = pipeline.assessment_tables(results)
    assert len(tables["runs"]) == 41
    told = []
    indices = pipeline.sensitivity_indices(results, warn=told.append)
    assert indices.empty
    assert "box: runout_distance: the same in all runs" in told
    observed = tmp_path / "outline.csv"
    observed.write_text("x,y\n0.9,-1.1\n3.1,-1.1\n3.1,1.1\n0.9,1.1\n")
    scores = pipeline.calibrate(out / "box.zarr", observed)["scores"]
    assert scores["critical_success_index"].tolist() == [1] * 41
    with pytest.raises(pipeline.OptionError, match="outline_error: expected with --emulate"):
        pipeline.calibrate(out / "box.zarr", observed, outline_error=5, to=tmp_path / "none")
    with pytest.raises(pipeline.OptionError, match="scenarios: expected two scenarios, found 'box' twice"):
        pipeline.compare(results, ("box", "box"), to=tmp_path / "none")
    assert not (tmp_path / "none").exists()
    page = pipeline.write_report(results, tmp_path / "page.html")
    assert page.read_text(encoding="utf-8").startswith("<!")
    assert sorted(path.name for path in out.iterdir()) == [".lock", "box.zarr", "runs.log", "summary.csv"]
    with pytest.raises(pipeline.OptionError, match="depth: expected numbers above 0, found -1"):
        pipeline.hazard_maps(out, depth=[-1])


def test_a_lattice_is_on_a_lattice_already(out, solve):
    store = pipeline.run(BOX, out=out, quiet=True)["box"]
    assert pipeline.to_lattice(store) is store
    json.loads(store.attrs["scenario_content"])
