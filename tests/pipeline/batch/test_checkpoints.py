from dataclasses import replace
from functools import partial
from pathlib import Path

import numpy as np
import pytest
from batches import files, run
from stub_solvers import dying_after

from pipeline.batch.checkpoints import Checkpoints
from solver.checkpoint import Snapshot
from solver.simulation import simulate

RNG = np.random.default_rng(0)
FRAMES = (RNG.random((5, 3, 4)), np.zeros((0, 3, 4)), RNG.random((5, 3, 4)))


def snapshot(passed: int, wall: float = 1.0) -> Snapshot:
    carried = {"now.h": np.full(12, passed + 0.25), "progress.steps": np.array([passed])}
    return Snapshot(carried, passed, tuple(a[:passed] for a in FRAMES), wall, wall / 2)


@pytest.fixture
def checkpoints(tmp_path: Path) -> Checkpoints:
    return Checkpoints(tmp_path / ".box.checkpoints", "this")


def test_the_last_snapshot_comes_back_as_it_was_with_all_its_frames(checkpoints):
    assert checkpoints.of(3).load() is None
    keeper = checkpoints.of(3)
    for passed in (0, 2, 2, 5):
        keeper.save(snapshot(passed, passed + 0.5))
        again = checkpoints.of(3)
        found = again.load()
        assert (found.passed, found.wall, found.cpu) == (passed, passed + 0.5, passed / 2 + 0.25)
        for name, array in snapshot(passed).carried.items():
            np.testing.assert_array_equal(found.carried[name], array)
        for got, wanted in zip(found.frames, FRAMES, strict=bool(passed)):
            np.testing.assert_array_equal(got, wanted[:passed])
        keeper = again
    assert checkpoints.of(4).load() is None


def test_what_is_of_another_scenario_or_solver_or_torn_is_ignored(checkpoints):
    checkpoints.of(0).save(snapshot(2))
    assert checkpoints.of(0).load() is not None
    assert replace(checkpoints, identity="other").of(0).load() is None
    part, state = checkpoints.folder / "0-frames-0.npz", checkpoints.folder / "0.npz"
    for file in (part, state):
        whole = file.read_bytes()
        file.write_bytes(whole[: len(whole) // 2])
        assert checkpoints.of(0).load() is None
        file.write_bytes(whole)
    part.unlink()
    assert checkpoints.of(0).load() is None


def test_a_run_that_ended_leaves_no_file(checkpoints):
    for run_ in (1, 11):
        checkpoints.of(run_).save(snapshot(2))
    checkpoints.of(1).remove()
    assert sorted(p.name for p in checkpoints.folder.iterdir()) == ["11-frames-0.npz", "11.npz"]
    checkpoints.of(11).remove()
    assert not checkpoints.folder.exists()


def test_a_disk_without_room_does_not_fail_the_run(checkpoints):
    checkpoints.folder.write_text("in the way")
    checkpoints.of(0).save(snapshot(2))
    assert checkpoints.of(0).load() is None


@pytest.mark.usefixtures("shared_workers")
def test_a_long_run_whose_worker_died_goes_on_from_its_checkpoint(scenario_file, out, log, tmp_path):
    file = scenario_file(20, replace=("end: 1, output_every: 0.5", "end: 1, output_every: 0.125"))
    solve = partial(dying_after, log=log, saves=6)
    assert run(out, file, solve=solve, checkpoint_every=0).exit_code == 0
    began = [int(passed) for passed in log.read_text().split()]
    assert len(began) == 2
    assert began[0] == 0 < began[1]
    assert [p.name for p in out.iterdir() if "checkpoint" in p.name] == []
    assert run(tmp_path / "undisturbed", file, solve=simulate).exit_code == 0
    assert files(out / "box.zarr") == files(tmp_path / "undisturbed" / "box.zarr")
