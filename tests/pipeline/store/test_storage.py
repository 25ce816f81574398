"""Places that are URLs: what a batch promises in a folder, on a server that speaks S3."""

import logging
import os
import signal
from contextlib import contextmanager
from functools import partial
from uuid import uuid4

import numpy as np
import psutil
import pytest
from batches import computed, counts, files, interrupt, open_gate, run, start_driver, until
from commands import pipeline
from moto.server import ThreadedMotoServer
from stub_solvers import by_friction, heal, read_only_from

from pipeline.batch.checkpoints import Checkpoint
from pipeline.batch.driver import ChangedError
from pipeline.batch.local_workers import workers
from pipeline.store import lock_objects, objects, zarr_store
from pipeline.store.lock_objects import TakenError
from pipeline.store.place import Part, PlaceInUseError, held, held_in_part
from pipeline.store.storage import located
from pipeline.store.variables import Status
from solver.checkpoint import Snapshot

ANGLES = range(20, 26)
GROUP = 2


@pytest.fixture(scope="module")
def bucket():
    """Start a server that speaks S3; gives the URL of a bucket of it."""
    logging.getLogger("werkzeug").setLevel(logging.ERROR)
    server = ThreadedMotoServer(ip_address="127.0.0.1", port=0, verbose=False)
    server.start()
    host, port = server.get_host_and_port()
    given = {
        "AWS_ENDPOINT_URL": f"http://{host}:{port}",
        "AWS_ACCESS_KEY_ID": "somebody",
        "AWS_SECRET_ACCESS_KEY": "secret",
        "AWS_DEFAULT_REGION": "us-east-1",
    }
    with pytest.MonkeyPatch.context() as patch:
        for name, value in given.items():
            patch.setenv(name, value)
        located("s3://bucket").fs.mkdir("bucket")
        yield "s3://bucket"
    server.stop()


@pytest.fixture(scope="module")
def workers_there(bucket):
    """Two worker processes that know the server."""
    with workers(2) as client:
        yield client


@pytest.fixture
def there(bucket, workers_there, monkeypatch):
    """Give a place on the server, and workers that know it."""

    @contextmanager
    def given(count):
        yield workers_there

    monkeypatch.setattr("pipeline.batch.dask_pool.workers", given)
    monkeypatch.setattr("pipeline.batch.driver.FEW_RUNS", 0)
    monkeypatch.setattr("pipeline.batch.driver.LITTLE_WORK", -1.0)
    return located(f"{bucket}/{uuid4().hex}")


@pytest.fixture
def impatient(monkeypatch):
    """Let locks be renewed, and taken for dead, soon."""
    monkeypatch.setattr(lock_objects, "BEAT_SECONDS", 0.2)
    monkeypatch.setattr(lock_objects, "DEAD_SECONDS", 2.0)


@pytest.fixture
def folder():
    """Give a folder in this process's memory, by URL."""
    return located(f"memory://{uuid4().hex}")


@pytest.mark.slow
def test_a_batch_whose_worker_and_driver_were_killed_is_completed(
    scenario_file, there, out, log, tmp_path, monkeypatch, impatient
):
    monkeypatch.setattr("pipeline.runs.template.group_size", lambda *_: GROUP)
    file, path = scenario_file(*ANGLES), there / "box.zarr"
    process = start_driver(file, there, log, free=22, group=GROUP)
    until(lambda: log.exists() and len(log.read_text().split()) == 4)
    workers = [p for p in psutil.Process(process.pid).children() if "spawn_main" in " ".join(p.cmdline())]
    workers[0].kill()
    until(lambda: len(log.read_text().split()) == 5)
    shown = pipeline("status", there).stdout.splitlines()
    assert shown[0] == "box: 6 runs: 4 pending, 2 done, 0 failed, 0 done but overrun"
    assert shown[-1].startswith(f"in use by process {process.pid} on ")
    second = pipeline("run", file, "--out", there)
    assert second.exit_code == 4
    assert f"is in use by process {process.pid} on " in second.stderr
    process.kill()
    process.communicate()
    assert pipeline("verify", there).exit_code == 0
    before = computed(log)
    assert run(there, file, solve=partial(by_friction, log=log)).exit_code == 0
    assert computed(log) - before == dict.fromkeys(range(22, 26), 1)
    assert pipeline("verify", there).exit_code == 0
    run(out, file, solve=partial(by_friction, log=tmp_path / "other-log"))
    assert files(path) == files(out / "box.zarr")
    assert (there / "summary.csv").read_text().count("done") == len(ANGLES)


@pytest.mark.slow
@pytest.mark.parametrize("times", [1, 2])
def test_a_batch_that_was_interrupted_is_completed(scenario_file, there, log, monkeypatch, times):
    monkeypatch.setattr("pipeline.runs.template.group_size", lambda *_: GROUP)
    file, path = scenario_file(*ANGLES), there / "box.zarr"
    process = start_driver(file, there, log, free=22, group=GROUP)
    until(lambda: log.exists() and len(log.read_text().split()) == 4)
    interrupt(process)
    if times == 1:
        open_gate(log)
    else:
        os.killpg(process.pid, signal.SIGINT)
    shown, _ = process.communicate(timeout=60)
    assert process.returncode == 130, shown
    assert "Traceback" not in shown
    assert lock_objects.holder(there / ".lock") is None
    assert pipeline("verify", there).exit_code == 0
    before, once = counts(path)[Status.DONE], computed(log)
    assert before == {1: sum(once.values()), 2: GROUP}[times]
    assert run(there, file, solve=partial(by_friction, log=log)).exit_code == 0
    assert sum((computed(log) - once).values()) == len(ANGLES) - before
    assert counts(path) == {Status.DONE: len(ANGLES)}
    assert pipeline("verify", there).exit_code == 0


def test_a_store_that_refuses_leaves_its_runs_pending(scenario_file, there, log, workers_there, monkeypatch):
    monkeypatch.setattr("pipeline.runs.template.group_size", lambda *_: GROUP)
    file, path = scenario_file(*ANGLES), there / "box.zarr"
    outcome = run(there, file, solve=partial(read_only_from, log=log, at=23))
    assert outcome.exit_code == 3
    assert "Read-only file system" in outcome.ending.trouble
    assert outcome.statuses[Status.FAILED] == 0
    assert outcome.statuses[Status.PENDING] > 0
    workers_there.run(heal)
    before, once = zarr_store.statuses(path), computed(log)
    assert run(there, file, solve=partial(by_friction, log=log)).exit_code == 0
    assert computed(log) - once == {
        angle: 1 for angle, s in zip(ANGLES, before, strict=True) if s == Status.PENDING
    }
    assert counts(path) == {Status.DONE: len(ANGLES)}


def test_a_store_is_one_once_its_root_is_there_and_is_replaced_when_asked(scenario_file, there, log):
    (there / "box.zarr" / "status" / "zarr.json").write_text("left by a driver that was killed")
    solve = partial(by_friction, log=log)
    assert run(there, scenario_file(20), solve=solve).exit_code == 0
    with pytest.raises(ChangedError):
        run(there, scenario_file(21, 22), solve=solve)
    assert run(there, scenario_file(21, 22), solve=solve, overwrite=True).exit_code == 0
    assert counts(there / "box.zarr") == {Status.DONE: 2}


@pytest.mark.slow
def test_every_command_takes_a_url(scenario_file, there, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    monkeypatch.setattr("pipeline.runs.template.group_size", lambda *_: len(ANGLES) // 2)
    monkeypatch.setattr("pipeline.assess.sensitivity.LEAST_RUNS", len(ANGLES))
    for part in ("1/2", "2/2"):
        result = pipeline("run", scenario_file(*ANGLES), "--out", there, "--part", part)
        assert result.exit_code == 0, result.stderr
    assert pipeline("summary", there).exit_code == 0
    assert pipeline("plot", there / "box.zarr").stdout == "box.png\n"
    assert (tmp_path / "box.png").exists()
    assert pipeline("tables", there).exit_code == 0
    assert (tmp_path / "tables" / "runs.csv").exists()
    for command in ("hazard", "report", "sensitivity"):
        assert pipeline(command, there).exit_code == 0, command
    assert (tmp_path / "hazard" / "box" / "hazard.nc").exists()
    assert "<html" in (there / "report.html").read_text()
    assert (there / "sensitivity.csv").exists()
    (tmp_path / "outline.csv").write_text("x,y\n1,-1\n3,-1\n3,1\n1,1\n")
    given = ("--observed", tmp_path / "outline.csv", "--threshold", 0.1)
    assert pipeline("calibrate", there / "box.zarr", *given).exit_code == 0
    assert (tmp_path / "box-calibration" / "scores.csv").exists()
    assert pipeline("figures", there).exit_code == 0
    assert (tmp_path / "figures" / "comparison.csv").exists()
    assert pipeline("status", located(f"{there}/nowhere")).exit_code == 2


def test_a_server_that_does_not_answer_is_trouble(scenario_file, bucket, monkeypatch):
    monkeypatch.setenv("AWS_ENDPOINT_URL", "http://127.0.0.1:9")
    monkeypatch.setenv("AWS_MAX_ATTEMPTS", "1")
    monkeypatch.setattr(objects, "OPTIONS", {**objects.OPTIONS, "skip_instance_cache": True})
    result = pipeline("run", scenario_file(20), "--out", "s3://bucket/silent")
    assert result.exit_code == 3
    assert "Could not connect" in result.stderr


def test_a_url_that_nothing_speaks_to_is_refused(scenario_file):
    result = pipeline("run", scenario_file(20), "--out", "nonsense://place")
    assert result.exit_code == 2
    assert "nonsense" in result.stderr


@pytest.mark.usefixtures("impatient")
class TestALock:
    def test_is_held_by_one_and_let_go(self, folder):
        with held(folder):
            with (
                pytest.raises(PlaceInUseError, match=f"is in use by process {os.getpid()} on "),
                held(folder),
            ):
                pass
            with pytest.raises(PlaceInUseError), held_in_part(folder, Part(1, 2), "a"):
                pass
        with held(folder):
            pass
        assert lock_objects.holder(folder / ".lock") is None

    def test_is_shared_by_the_parts_of_one_whole_alone(self, folder):
        with held_in_part(folder, Part(1, 2), "a"), held_in_part(folder, Part(2, 2), "a"):
            for other, whose in ((Part(1, 2), "a"), (Part(2, 3), "a"), (Part(2, 2), "b")):
                with pytest.raises(PlaceInUseError), held_in_part(folder, other, whose):
                    pass

    def test_of_a_dead_owner_is_taken_over(self, folder):
        objects.create(folder / "whole.1", b"somebody, as of long ago")
        with lock_objects.held(folder, "whole", "another"):
            assert [lock.name for lock in folder.iterdir()] == ["whole.2"]
            assert lock_objects.holder(folder).startswith("another, as of ")

    def test_goes_to_nobody_or_one_of_two_that_come_at_once(self, folder, monkeypatch):
        dead = lock_objects._dead

        def overtaken(folder, role):
            found = dead(folder, role)
            objects.create(folder / "part-1-of-2-a.1", b"the other")
            return found

        monkeypatch.setattr(lock_objects, "_dead", overtaken)
        with pytest.raises(TakenError), lock_objects.held(folder, "whole", "one"):
            pass
        assert [lock.name for lock in folder.iterdir()] == ["part-1-of-2-a.1"]

    def test_that_was_taken_over_interrupts_its_owner(self, folder, capsys):
        heard = []
        before = signal.signal(signal.SIGINT, lambda *_: heard.append(True))
        with lock_objects.held(folder, "whole", "one"):
            (folder / "whole.1").unlink()
            until(lambda: heard)
        signal.signal(signal.SIGINT, before)
        assert "the lock was taken over" in capsys.readouterr().err


def test_a_checkpoint_at_a_url_is_found_again_and_removed(folder):
    keeper = Checkpoint(folder, 3, "identity", 1.0)
    carried = {"depth": np.arange(6.0).reshape(2, 3)}
    for passed in (1, 2):
        frames = (np.arange(passed * 2.0).reshape(passed, 2),)
        keeper.save(Snapshot(carried, passed, frames, 1.5, 1.25))
    found = Checkpoint(folder, 3, "identity", 1.0).load()
    assert (found.passed, found.wall, found.cpu) == (2, 1.5, 1.25)
    assert (found.carried["depth"] == carried["depth"]).all()
    assert (found.frames[0] == frames[0]).all()
    assert Checkpoint(folder, 3, "another", 1.0).load() is None
    keeper.remove()
    assert list(folder.iterdir()) == []
