"""What a batch promises: whatever dies, the next one completes exactly what is missing."""

import os
import signal
import subprocess
import sys
from functools import partial
from pathlib import Path

import psutil
import pytest
from batches import computed, counts, files, interrupt, open_gate, run, start_driver, until
from commands import pipeline
from stub_solvers import HANGS, KILLS, RAISES, SWELLS, by_friction, full_from, heal, read_only_from, slow

from pipeline.batch.limits import Limits
from pipeline.store import zarr_store
from pipeline.store.variables import Status

ANGLES = range(20, 32)


@pytest.fixture
def undisturbed(tmp_path, any_workers):
    """Give what the store of a scenario holds after a batch that nothing happened to."""

    def do(file: Path, solve=None) -> dict[str, bytes]:
        out = tmp_path / "undisturbed"
        solve = solve or partial(by_friction, log=tmp_path / "other-log", harm=False)
        assert run(out, file, solve=solve).exit_code == 0
        return files(out / "box.zarr")

    return do


def told(out: Path) -> tuple[str, str]:
    """The counts that ``pipeline status`` tells, and who is at the place."""
    lines = pipeline("status", out).stdout.splitlines()
    return lines[0], lines[-1]


def finish(file: Path, out: Path, log: Path, whole: dict[str, bytes]) -> None:
    """Check what a fault left, complete it, and check that nothing was lost or done twice."""
    path = out / "box.zarr"
    before, once = zarr_store.statuses(path), computed(log)
    done = int((before == Status.DONE).sum())
    assert set(before) <= {Status.DONE, Status.PENDING}
    assert told(out) == (
        f"box: {len(ANGLES)} runs: {len(ANGLES) - done} pending, {done} done, 0 failed, 0 done but overrun",
        "no process uses it",
    )
    assert pipeline("verify", out).exit_code == 0
    assert run(out, file, solve=partial(by_friction, log=log)).exit_code == 0
    again = computed(log) - once
    assert again == {angle: 1 for angle, s in zip(ANGLES, before, strict=True) if s == Status.PENDING}
    assert files(path) == whole
    assert pipeline("verify", out).exit_code == 0


def gone(processes: list[psutil.Process]) -> bool:
    return not any(p.is_running() and p.status() != psutil.STATUS_ZOMBIE for p in processes)


def test_a_running_batch_is_read_safely_and_a_second_one_is_told(scenario_file, out, log):
    file, path = scenario_file(*ANGLES), out / "box.zarr"
    process = start_driver(file, out, log, free=22)
    until(lambda: path.exists() and counts(path)[Status.DONE] == 2)
    assert told(out)[1].startswith(f"in use by process {process.pid} on ")
    assert pipeline("verify", out).exit_code == 0
    second = pipeline("run", file, "--out", out)
    assert second.exit_code == 4
    assert f"{out} is in use by process {process.pid} on " in second.stderr
    process.kill()
    process.communicate()


@pytest.mark.parametrize(
    ("fault", "group"),
    [("driver killed", 1), ("all killed", 3), ("interrupted", 3), ("interrupted twice", 1)],
)
def test_a_batch_that_was_stopped_is_completed(
    scenario_file, out, log, monkeypatch, undisturbed, any_workers, fault, group
):
    monkeypatch.setattr("pipeline.runs.template.group_size", lambda *_: group)
    file, path = scenario_file(*ANGLES), out / "box.zarr"
    # some runs are done and both workers wait, with groups of three one of them amid its group
    free, begun = {1: (22, 4), 3: (24, 6)}[group]
    process = start_driver(file, out, log, free, group, any_workers)
    until(lambda: log.exists() and len(log.read_text().split()) == begun)
    children = psutil.Process(process.pid).children(recursive=True)
    if fault == "driver killed":
        process.kill()
    elif fault == "all killed":
        os.killpg(process.pid, signal.SIGKILL)
    else:
        interrupt(process)
        if fault == "interrupted twice":
            os.killpg(process.pid, signal.SIGINT)
        else:
            open_gate(log)
    shown, _ = process.communicate(timeout=60)
    assert "Traceback" not in shown
    if fault.startswith("interrupted"):
        assert process.returncode == 130, shown
    if fault == "interrupted":
        assert counts(path)[Status.DONE] == sum(computed(log).values())
    # the workers of a driver that was killed end by themselves
    until(lambda: gone(children))
    assert counts(path)[Status.PENDING] > 0
    finish(file, out, log, undisturbed(file))


def test_a_worker_killed_from_outside_costs_nothing_but_time(
    scenario_file, out, log, undisturbed, any_workers, cluster
):
    file = scenario_file(*ANGLES)
    if any_workers == "forked":
        # a forked process has the command line of its driver
        find = "[p.pid for p in d.children() if p.cmdline() == d.cmdline()][0]"
        victim = os.getpid()
    else:
        find, victim = "int(sys.argv[2])", next(iter(cluster.run(os.getpid).values()))
    watch = "import os, psutil, sys, time; from pathlib import Path\n"
    watch += "d = psutil.Process(int(sys.argv[2]))\n"
    watch += "while not Path(sys.argv[1]).exists(): time.sleep(0.01)\n"
    watch += f"time.sleep(0.3); os.kill({find}, 9)"
    with subprocess.Popen([sys.executable, "-c", watch, log, str(victim)]) as killer:
        outcome = run(out, file, solve=partial(slow, log=log, seconds=0.15))
    assert killer.returncode == 0
    assert any_workers == "forked" or not psutil.pid_exists(victim)
    assert outcome.statuses == {Status.DONE: len(ANGLES)}
    # only what was under way
    assert sum(computed(log).values()) - len(ANGLES) in (0, 1)
    # what it was writing just then is removed by the next batch
    assert run(out, file, solve=partial(by_friction, log=log)).exit_code == 0
    assert files(out / "box.zarr") == undisturbed(file)


@pytest.mark.parametrize(
    ("angle", "group", "reason"),
    [
        (RAISES, 1, "ValueError: this run raises"),
        (KILLS, 4, "the worker process died of this run, twice"),
        (HANGS, 1, "more time than allowed, and the run did not stop: its worker process was ended, twice"),
        (SWELLS, 4, "more memory than allowed: 200,000,000 bytes: "),
    ],
)
def test_only_the_guilty_run_fails(scenario_file, out, log, monkeypatch, undisturbed, angle, group, reason):
    monkeypatch.setattr("pipeline.runs.template.group_size", lambda *_: group)
    file = scenario_file(20, 21, angle, 22, 23, 24, replace=("end: 1,", "end: 1, max_wall: 0.5,"))
    solve = partial(by_friction, log=log)
    outcome = run(out, file, solve=solve, limits=Limits(memory=200_000_000, grace=0.2))
    assert outcome.statuses == {Status.DONE: 5, Status.FAILED: 1}
    assert told(out)[0] == "box: 6 runs: 0 pending, 5 done, 1 failed, 0 done but overrun"
    path = out / "box.zarr"
    with zarr_store.open_store(path) as opened:
        assert opened["status"].to_numpy().tolist() == [1, 1, 2, 1, 1, 1]
        assert opened["failure_reason"][2].item().startswith(reason)
    assert pipeline("verify", out).exit_code == 0
    before = computed(log)
    assert run(out, file, solve=solve).exit_code == 1
    assert computed(log) == before
    if group == 1 or angle in (RAISES, SWELLS):
        assert {a: n for a, n in before.items() if a != angle} == dict.fromkeys([20, 21, 22, 23, 24], 1)
    # what it was that failed leaves no trace once it does not fail any more
    assert run(out, file, solve=partial(solve, harm=False), retry_failed=True).exit_code == 0
    assert files(path) == undisturbed(file)


@pytest.mark.parametrize(
    ("fault", "group", "message"),
    [(full_from, 1, "File too large"), (read_only_from, 3, "Read-only file system")],
)
def test_a_store_that_cannot_be_written_leaves_its_runs_pending(
    scenario_file, out, log, monkeypatch, undisturbed, any_workers, cluster, fault, group, message
):
    monkeypatch.setattr("pipeline.runs.template.group_size", lambda *_: group)
    file = scenario_file(*ANGLES)
    outcome = run(out, file, solve=partial(fault, log=log, at=26))
    assert outcome.exit_code == 3
    assert message in outcome.ending.trouble
    assert outcome.statuses[Status.FAILED] == 0
    assert outcome.statuses[Status.PENDING] >= group
    assert not list(out.rglob("*.partial"))
    if any_workers == "dask":
        cluster.run(heal)
    finish(file, out, log, undisturbed(file))
