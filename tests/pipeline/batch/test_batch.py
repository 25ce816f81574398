import os
import signal
import subprocess
import sys
from collections import Counter
from functools import partial
from pathlib import Path
from threading import Lock
from time import sleep

import numpy as np
import psutil
import pytest
from batches import computed, counts, interrupt, run, start_driver, until
from stub_solvers import FAILS, KILLS, OVERRUNS, RAISES, breaking, by_friction, slow

import pipeline
from pipeline.batch.driver import FEW_RUNS, ChangedError
from pipeline.batch.interrupts import MESSAGE, heard
from pipeline.batch.local_workers import workers
from pipeline.batch.progress import Progress
from pipeline.store import zarr_store
from pipeline.store.variables import Status


@pytest.mark.usefixtures("any_workers")
class TestABatch:
    def test_does_every_run_once_and_nothing_the_second_time(self, scenario_file, out, log):
        file = scenario_file(20, 21, 22, 23, 24)
        outcome = run(out, file, solve=partial(by_friction, log=log))
        assert outcome.exit_code == 0
        assert outcome.statuses == {Status.DONE: 5}
        assert run(out, file, solve=partial(by_friction, log=log)).exit_code == 0
        assert computed(log) == dict.fromkeys([20, 21, 22, 23, 24], 1)
        with zarr_store.open_store(out / "box.zarr") as opened:
            assert opened["bed_friction"].to_numpy().tolist() == [20, 21, 22, 23, 24]
            assert opened["bed_friction"].attrs["units"] == "degrees"
            assert opened["volume_released"].to_numpy() == pytest.approx(np.full(5, 2.0), rel=0.2)

    def test_records_failures_and_overruns_and_goes_on(self, scenario_file, out, log):
        outcome = run(out, scenario_file(RAISES, 20, FAILS, OVERRUNS), solve=partial(by_friction, log=log))
        assert outcome.exit_code == 1
        assert outcome.statuses == {Status.FAILED: 2, Status.DONE: 1, Status.OVERRUN: 1}
        with zarr_store.open_store(out / "box.zarr") as opened:
            assert opened["status"].to_numpy().tolist() == [2, 1, 2, 3]
            reasons = opened["failure_reason"].to_numpy().tolist()
            assert reasons == [
                "ValueError: this run raises",
                "",
                "not finite at t = 0.5 s, x = 1 m, y = 2 m",
                "",
            ]
            assert opened["failure_x"][2] == 1.0
            assert np.isnan(opened["depth"][0]).all()
            assert not np.isnan(opened["depth"][2]).any()
            assert np.isnan(opened["front_x"].to_numpy()).tolist() == [True, False, True, False]
            assert opened["volume_out"][3] == 0.125

    def test_retries_failed_runs_only_when_asked(self, scenario_file, out, log):
        file = scenario_file(RAISES, 20)
        for retry in (False, False, True):
            assert run(out, file, solve=partial(by_friction, log=log), retry_failed=retry).exit_code == 1
        assert computed(log) == {RAISES: 2, 20: 1}

    def test_condemns_only_the_run_that_kills_its_worker(self, scenario_file, out, log):
        angles = [20, 21, KILLS, 22, 23, 24]
        outcome = run(out, scenario_file(*angles), solve=partial(by_friction, log=log))
        assert outcome.exit_code == 1
        with zarr_store.open_store(out / "box.zarr") as opened:
            assert opened["status"].to_numpy().tolist() == [1, 1, 2, 1, 1, 1]
            assert "worker process died" in opened["failure_reason"][2].item()
        assert {angle: n for angle, n in computed(log).items() if angle != KILLS} == dict.fromkeys(
            [20, 21, 22, 23, 24], 1
        )

    def test_finds_the_guilty_run_of_a_group(self, scenario_file, out, log, monkeypatch):
        monkeypatch.setattr("pipeline.runs.template.group_size", lambda *_: 3)
        outcome = run(out, scenario_file(20, KILLS, 21, 22), solve=partial(by_friction, log=log))
        assert outcome.ending.trouble == ""
        assert outcome.statuses == {Status.DONE: 3, Status.FAILED: 1}
        assert zarr_store.statuses(out / "box.zarr").tolist() == [1, 2, 1, 1]

    def test_a_result_lost_with_its_worker_is_no_trouble(
        self, scenario_file, out, log, shared_workers, cluster, monkeypatch
    ):
        path, report, elapsed = out / "box.zarr", Progress.report, []

        def slow_to_fetch(self, outcome):
            report(self, outcome)
            elapsed.append(outcome.elapsed)
            if self.ended == 1:
                until(lambda: counts(path)[Status.DONE] == 2)
                for pid in cluster.run(os.getpid).values():
                    os.kill(pid, signal.SIGKILL)
                until(lambda: not cluster.nthreads())

        monkeypatch.setattr(Progress, "report", slow_to_fetch)
        outcome = run(out, scenario_file(20, 21, 22), solve=partial(by_friction, log=log), count=2)
        assert outcome.ending.trouble == ""
        assert outcome.statuses == {Status.DONE: 3}
        assert computed(log) - Counter([22]) == {20: 1, 21: 1}
        assert np.isfinite(elapsed).all()

    def test_resumes_what_is_pending_from_the_status_alone(self, scenario_file, out, log):
        file = scenario_file(20, 21, 22)
        run(out, file, solve=partial(by_friction, log=log))
        before = {p: p.read_bytes() for p in (out / "box.zarr").rglob("*") if p.is_file()}
        (out / "box.zarr" / "status" / "c" / "1").unlink()
        assert run(out, file, solve=partial(by_friction, log=log)).exit_code == 0
        assert computed(log) == {20: 1, 21: 2, 22: 1}
        assert {p: p.read_bytes() for p in (out / "box.zarr").rglob("*") if p.is_file()} == before

    def test_leaves_runs_pending_where_the_store_refuses(self, scenario_file, out):
        outcome = run(out, scenario_file(20, 21), solve=partial(breaking, store=out / "box.zarr"))
        assert outcome.exit_code == 3
        assert outcome.statuses == {Status.PENDING: 2}
        assert "box.zarr" in outcome.ending.trouble

    def test_refuses_a_store_made_from_a_changed_scenario(self, scenario_file, out, log):
        solve = partial(by_friction, log=log)
        run(out, scenario_file(), solve=solve)
        changed = scenario_file(replace=("bed_friction: 25", "bed_friction: 26"))
        with pytest.raises(ChangedError, match=r"material\.bed_friction.*25.*26"):
            run(out, changed, solve=solve)
        assert run(out, changed, solve=solve, overwrite=True).exit_code == 0
        assert computed(log) == {25: 1, 26: 1}

    def test_keeps_the_stores_of_unchanged_scenarios_when_overwriting(self, scenario_file, out, log):
        solve = partial(by_friction, log=log)
        same, other = scenario_file(20, name="same"), scenario_file(21, name="other")
        run(out, same, other, solve=solve)
        run(out, same, scenario_file(22, name="other"), solve=solve, overwrite=True)
        assert computed(log) == {20: 1, 21: 1, 22: 1}

    def test_finishes_what_runs_when_interrupted(self, scenario_file, out, log):
        file = scenario_file(*range(20, 30))

        def interrupting(outcome):
            os.kill(os.getpid(), signal.SIGINT)

        with pytest.MonkeyPatch.context() as patch:
            patch.setattr(
                "pipeline.batch.progress.Progress.report", lambda self, o: _once(log, interrupting, o)
            )
            outcome = run(out, file, solve=partial(slow, log=log, seconds=0.2))
        assert outcome.exit_code == 130
        assert outcome.statuses[Status.DONE] == sum(computed(log).values()) < 10
        assert run(out, file, solve=partial(by_friction, log=log)).exit_code == 0
        assert computed(log) == dict.fromkeys(range(20, 30), 1)


def _once(log: Path, action, *args) -> None:
    flag = log.with_suffix(".interrupted")
    if not flag.exists():
        flag.touch()
        action(*args)


def test_a_small_batch_loads_neither_dask_nor_xarray(scenario_file, out):
    code = (
        "import sys, pipeline\n"
        f"pipeline.run([{str(scenario_file(20))!r}], {str(out)!r}, quiet=True).table\n"
        "print(*sorted({'dask', 'distributed', 'xarray', 'scipy.linalg', 'scipy.spatial'} & {*sys.modules}))"
    )
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert done.stdout.strip() == ""
    assert counts(out / "box.zarr") == {Status.OVERRUN_AND_CUT_OFF: 1}


@pytest.mark.parametrize(("work", "loaded"), [("", ""), ("pipeline.batch.driver.LITTLE_WORK = 0.0", "dask")])
def test_more_runs_are_done_without_dask_where_they_are_short(scenario_file, out, work, loaded):
    file = scenario_file(*range(20, 20 + FEW_RUNS + 1))
    code = (
        f"import sys, pipeline, pipeline.batch.driver\n{work}\n"
        f"pipeline.run([{str(file)!r}], {str(out)!r}, quiet=True, workers=1)\n"
        "print(*{'dask'} & {*sys.modules})"
    )
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert done.stdout.strip() == loaded
    found = counts(out / "box.zarr")
    assert found[Status.OVERRUN_AND_CUT_OFF] + found[Status.CUT_OFF] == FEW_RUNS + 1


@pytest.mark.parametrize("workers", ["forked", "dask"])
def test_two_interrupts_of_the_process_group_stop_at_once_and_more_change_nothing(
    scenario_file, out, log, workers
):
    process = start_driver(scenario_file(20, 21, 22, 23, 24, 25), out, log, free=20, workers=workers)
    until(lambda: log.exists() and len(log.read_text().split()) == 2)
    interrupt(process)
    while process.poll() is None:
        os.killpg(process.pid, signal.SIGINT)
        sleep(0.02)
    shown, _ = process.communicate(timeout=30)
    assert process.returncode == 130, shown
    assert "Traceback" not in shown
    assert counts(out / "box.zarr") == {Status.PENDING: 6}


def test_an_interrupt_while_the_workers_start_ends_the_batch(scenario_file, out, log):
    process = start_driver(scenario_file(20, 21), out, log, free=99)
    # the resource tracker and two workers
    until(lambda: len(psutil.Process(process.pid).children()) >= 3)
    os.killpg(process.pid, signal.SIGINT)
    shown, _ = process.communicate(timeout=60)
    assert process.returncode == 130, shown
    assert "Traceback" not in shown
    assert counts(out / "box.zarr") == {Status.PENDING: 2}


@pytest.mark.parametrize("before", [None, "empty", "other.txt"])
def test_an_interrupt_before_the_first_run_is_told_and_leaves_nothing(
    scenario_file, out, monkeypatch, capsys, before
):
    def interrupted(*_):
        raise KeyboardInterrupt

    monkeypatch.setattr("pipeline.batch.driver.settled_together", interrupted)
    if before:
        out.mkdir()
    if before == "other.txt":
        (out / before).touch()
    with pytest.raises(KeyboardInterrupt):
        pipeline.run([scenario_file()], out)
    assert "interrupted while preparing: no run has begun" in capsys.readouterr().out
    left = sorted(each.name for each in out.iterdir()) if out.exists() else None
    assert left == {None: None, "empty": [], "other.txt": [".lock", "other.txt"]}[before]


def test_workers_that_do_not_end_in_time_are_killed_and_spoil_nothing(monkeypatch):
    async def refuse(self, **options):
        raise TimeoutError

    with workers(1) as client:
        pid = next(iter(client.run(os.getpid).values()))
        monkeypatch.setattr("distributed.Nanny.close", refuse)
    until(lambda: not psutil.pid_exists(pid) or psutil.Process(pid).status() == psutil.STATUS_ZOMBIE)


def test_what_an_interrupt_cuts_into_may_be_telling_something():
    telling, told = Lock(), []

    def tell(line):
        with telling:
            told.append(line)

    with heard(tell) as interrupts, telling:
        os.kill(os.getpid(), signal.SIGINT)
        until(lambda: interrupts.asked)
    assert told == [MESSAGE]
