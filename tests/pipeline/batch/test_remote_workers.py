"""Runs done elsewhere than by workers of the driver: a running cluster, a queue, parts of a job array."""

import os
import stat
import subprocess
import sys
from contextlib import contextmanager
from functools import partial
from pathlib import Path

import dask
import dask_jobqueue  # noqa: F401 - brings its own configuration, which that of the tests comes upon
import pytest
from batches import computed, counts, files, run, until
from commands import pipeline
from distributed import Client
from root import ROOT
from stub_solvers import KILLS, by_friction

from pipeline.batch.remote_workers import EngineError, cluster, joined, queued
from pipeline.store import provenance
from pipeline.store.place import Part, PlaceInUseError, held, held_in_part
from pipeline.store.variables import Status

ENVIRONMENT = os.environ | {"PYTHONPATH": os.pathsep.join([str(ROOT / "tests" / "support"), str(ROOT)])}


@contextmanager
def started(folder: Path, *workers: list[str]):
    """Start a scheduler and workers as a user would; gives its client."""
    file = folder / "scheduler.json"
    commands = [["scheduler", "--host", "127.0.0.1", "--port", "0"]]
    commands += [["worker", "--nthreads", "1", "--local-directory", str(folder), *more] for more in workers]
    processes = [
        subprocess.Popen(
            [sys.executable, "-m", "dask", *command, "--scheduler-file", str(file), "--no-dashboard"],
            env=ENVIRONMENT,
            stdout=subprocess.DEVNULL,
            stderr=subprocess.DEVNULL,
        )
        for command in commands
    ]
    until(file.exists)
    with Client(scheduler_file=str(file), set_as_default=False) as client:
        client.wait_for_workers(len(workers), timeout=60)
        yield client
    for process in reversed(processes):
        process.terminate()
        process.wait(timeout=30)


@pytest.fixture(scope="module")
def scheduler(tmp_path_factory):
    """Address of a scheduler with two workers."""
    with started(tmp_path_factory.mktemp("cluster"), [], []) as client:
        yield client.scheduler.address


def test_a_running_cluster_does_the_runs_and_is_left_as_it_was(scenario_file, out, log, tmp_path, scheduler):
    file = scenario_file(*range(20, 26))
    outcome = run(out, file, solve=partial(by_friction, log=log), engine=partial(joined, scheduler))
    assert outcome.statuses == {Status.DONE: 6}
    assert computed(log) == dict.fromkeys(range(20, 26), 1)
    with Client(scheduler) as client:
        assert len(client.nthreads()) == 2
    run(tmp_path / "parts", file, solve=partial(by_friction, log=log), part=Part(1, 2))
    run(tmp_path / "parts", file, solve=partial(by_friction, log=log), part=Part(2, 2))
    assert files(out / "box.zarr") == files(tmp_path / "parts" / "box.zarr")


def test_a_run_that_kills_workers_of_a_cluster_fails_alone(scenario_file, out, log, scheduler):
    file = scenario_file(20, KILLS, 21, 22)
    outcome = run(out, file, solve=partial(by_friction, log=log), engine=partial(joined, scheduler))
    assert outcome.statuses == {Status.DONE: 3, Status.FAILED: 1}


def test_a_cluster_that_has_lost_its_workers_is_trouble(scenario_file, out, log, tmp_path, monkeypatch):
    monkeypatch.setattr("pipeline.batch.dask_pool.WORKERLESS_SECONDS", 0.5)
    with started(tmp_path, ["--no-nanny"]) as client:
        engine = partial(joined, client.scheduler.address)
        outcome = run(out, scenario_file(20, KILLS, 21), solve=partial(by_friction, log=log), engine=engine)
    assert outcome.exit_code == 3
    assert outcome.ending.trouble == "no worker is left, and none has come for 0.5 s"
    assert outcome.statuses == {Status.DONE: 1, Status.PENDING: 2}


def test_the_command_joins_a_cluster(scenario_file, out, scheduler):
    result = pipeline("run", scenario_file(20), "--out", out, "--scheduler", scheduler)
    assert result.exit_code == 0, result.stderr
    assert counts(out / "box.zarr") == {Status.OVERRUN_AND_CUT_OFF: 1}


def test_workers_with_other_software_are_refused(scenario_file, out, scheduler, monkeypatch):
    here = provenance.environment() | {"numpy_version": "1.0", "solver_hash": "0" * 64}
    monkeypatch.setattr(provenance, "environment", lambda: here)
    with pytest.raises(EngineError) as error, joined(scheduler, 1):
        pass
    lines = str(error.value).splitlines()
    assert len(lines) == 4
    assert all("is " in line and "here" in line for line in lines)
    assert {line.split(": ")[1].split(" ")[0] for line in lines} == {"numpy_version", "solver_hash"}


def test_a_scheduler_that_is_not_there_is_trouble(scenario_file, out, monkeypatch):
    monkeypatch.setattr("pipeline.batch.remote_workers.CONNECTING_SECONDS", 0.5)
    result = pipeline("run", scenario_file(20), "--out", out, "--scheduler", "tcp://127.0.0.1:9")
    assert result.exit_code == 3
    assert "the scheduler does not answer" in result.stderr
    assert counts(out / "box.zarr") == {Status.PENDING: 1}


def test_the_job_of_a_queue_starts_a_worker_with_the_settings_of_the_site():
    site = {"jobqueue.slurm.queue": "short", "jobqueue.slurm.walltime": "02:00:00"}
    with dask.config.set(site), cluster("slurm") as made:
        script = made.job_script()
    assert "#SBATCH -p short" in script
    assert "#SBATCH -t 02:00:00" in script
    assert "#SBATCH --cpus-per-task=1" in script
    assert "--nthreads 1" in script
    assert sys.executable in script


def test_workers_started_by_a_queue_do_the_runs(scenario_file, out, log, tmp_path, monkeypatch):
    commands = tmp_path / "bin"
    commands.mkdir()
    # a queue that takes a copy of the script, as theirs do, and starts every job at once, here
    (commands / "sbatch").write_text(
        '#!/bin/sh\ncp "$1" "$0.job"\nsetsid sh "$0.job" >"$0.log" 2>&1 &\necho "Submitted batch job $!"\n'
    )
    (commands / "scancel").write_text("#!/bin/sh\nkill -- -$1\n")
    for command in commands.iterdir():
        command.chmod(command.stat().st_mode | stat.S_IXUSR)
    monkeypatch.setenv("PATH", f"{commands}{os.pathsep}{os.environ['PATH']}")
    monkeypatch.setenv("PYTHONPATH", ENVIRONMENT["PYTHONPATH"])
    monkeypatch.setattr("pipeline.batch.remote_workers.QUEUEING_SECONDS", 60)
    given = {"interface": None, "local-directory": str(tmp_path), "log-directory": str(tmp_path)}
    with dask.config.set({f"jobqueue.slurm.{name}": value for name, value in given.items()}):
        file = scenario_file(20, 21, 22)
        outcome = run(out, file, solve=partial(by_friction, log=log), engine=partial(queued, "slurm", 1))
    assert outcome.statuses == {Status.DONE: 3}
    assert computed(log) == {20: 1, 21: 1, 22: 1}


PARTS = """
import sys
from contextlib import contextmanager
from functools import partial
from pathlib import Path
from rich.console import Console
from stub_solvers import slow
import pipeline.runs.template
from pipeline.batch.driver import complete
from pipeline.store.place import Part, held_in_part
from pipeline.scenario.scenario import load

pipeline.runs.template.group_size = lambda *_: 2
file, out, log, index = sys.argv[1:]
part = Part(int(index), 3)
with held_in_part(Path(out), part, "same") as alone:
    solve = partial(slow, log=log, seconds=0.05)
    outcome = complete(load([file]), Path(out), Console(), solve=solve, part=part, sweep=alone)
sys.exit(outcome.exit_code)
"""


@pytest.mark.usefixtures("shared_workers")
def test_parts_begun_together_share_a_store_and_make_it_whole(scenario_file, out, log, tmp_path, monkeypatch):
    monkeypatch.setattr("pipeline.runs.template.group_size", lambda *_: 2)
    file = scenario_file(*range(20, 35))
    command = [sys.executable, "-c", PARTS, file, out, log]
    started = [subprocess.Popen([*command, str(i)], env=ENVIRONMENT) for i in (1, 2, 3)]
    assert [process.wait(timeout=120) for process in started] == [0, 0, 0]
    assert computed(log) == dict.fromkeys(range(20, 35), 1)
    assert run(out, file, solve=partial(by_friction, log=log)).exit_code == 0
    assert computed(log) == dict.fromkeys(range(20, 35), 1)
    run(tmp_path / "whole", file, solve=partial(by_friction, log=log))
    assert files(out / "box.zarr") == files(tmp_path / "whole" / "box.zarr")
    assert (out / "summary.csv").exists()
    assert not list(out.rglob("*.partial"))


def test_a_part_does_its_own_groups_alone(scenario_file, out, log):
    file = scenario_file(*range(20, 27))
    assert run(out, file, solve=partial(by_friction, log=log), part=Part(2, 3)).exit_code == 0
    assert computed(log) == {21: 1, 24: 1}


def test_parts_of_one_whole_share_a_place_and_nobody_else_does(out):
    with held_in_part(out, Part(1, 2), "a") as alone:
        assert alone
        with held_in_part(out, Part(2, 2), "a") as alone:
            assert not alone
            assert pipeline("status", out).exit_code == 2
        for other, whose in ((Part(1, 2), "a"), (Part(2, 3), "a"), (Part(2, 2), "b")):
            with pytest.raises(PlaceInUseError, match="in use by"), held_in_part(out, other, whose):
                pass
        with pytest.raises(PlaceInUseError, match="parts of 2, of scenarios a"), held(out):
            pass
    with held(out), pytest.raises(PlaceInUseError), held_in_part(out, Part(1, 2), "a"):
        pass
    with held_in_part(out, Part(2, 3), "b") as alone:
        assert alone


@pytest.mark.parametrize("part", ["0/2", "3/2", "1", "a/b", "1/0", "-1/2"])
def test_a_part_that_is_none_is_refused(scenario_file, out, part):
    result = pipeline("run", scenario_file(20), "--out", out, "--part", part)
    assert result.exit_code == 2
    assert f"expected a part as 1/8 to 8/8, found '{part}'" in result.stderr


def test_engines_exclude_each_other_and_a_part_does_not_overwrite(scenario_file, out):
    file = scenario_file(20)
    both = pipeline("run", file, "--out", out, "--part", "1/2", "--scheduler", "tcp://127.0.0.1:9")
    assert (both.exit_code, both.stderr) == (2, "--scheduler and --part: expected one of them at most\n")
    assert pipeline("run", file, "--out", out, "--part", "1/2", "--overwrite").exit_code == 2
    assert pipeline("run", file, "--out", out, "--jobqueue", "lsf").exit_code == 2
    assert not out.exists()
