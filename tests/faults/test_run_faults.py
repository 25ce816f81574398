"""A fault inside a run: what the result and the store hold of it, and that the batch goes on."""

import warnings
from dataclasses import replace

import numpy as np
import pytest
from batches import run
from checkpoints import CASES, Memory, assert_same
from scenes import scene
from stub_solvers import still

from pipeline.store import zarr_store
from pipeline.store.variables import Status
from solver import simulation
from solver.checks.invariants import Laws
from solver.checks.plausibility import doubts, laws_of_speed
from solver.checks.states import state_of_run
from solver.forms import begin
from solver.kernels.runge_kutta import NOT_FINITE, OUT_OF_STEPS
from solver.physics.friction import Coulomb
from solver.physics.terrain import Plane
from solver.scene import Boundaries, WeightedResidual
from solver.simulation import simulate

TIMES = (0.0, 0.2, 0.4, 0.8)


def spoilt_at(step, monkeypatch):
    """Let every run make a value that is not finite in a step."""

    def spoilt(*args):
        run = begin(*args)
        advance = run._advance

        def advanced(target, max_steps):
            outcome = advance(target, min(step, max_steps))
            if outcome != OUT_OF_STEPS or run.progress.steps[0] < step:
                return outcome
            run.now.h[:], run.progress.ledger[:], run.progress.place[:] = np.nan, np.nan, 3
            for field in run.record:
                field[:] = np.inf
            return NOT_FINITE

        run._advance = advanced
        return run

    monkeypatch.setattr(simulation, "begin", spoilt)


@pytest.mark.parametrize("every", [0.0, 1e9])
@pytest.mark.parametrize("name", ["cloud", "collocation on a lattice", "mixed sides", "several blobs"])
def test_a_run_that_fails_gives_the_state_before_its_last_step(name, every, monkeypatch):
    monkeypatch.setattr("solver.checkpoint.COPY_SECONDS", every)
    case = CASES[name][0]
    whole = simulate(case, TIMES, arrival_depth=0.01)
    last = whole.steps - 2
    good = simulate(case, TIMES, arrival_depth=0.01, max_steps=last)
    spoilt_at(last + 1, monkeypatch)
    memory = Memory()
    for options in ({}, {"max_wall": 1e9}, {"keeper": memory}):
        failed = simulate(case, TIMES, arrival_depth=0.01, **options)
        assert failed.failure.reason == "a value that is not finite"
        assert good.time < failed.failure.time <= TIMES[-1]
        assert np.isfinite([failed.failure.x, failed.failure.y]).all()
        assert_same(replace(failed, failure=None), replace(good, failure=None))
    restarted = simulate(case, TIMES, arrival_depth=0.01, keeper=Memory(memory.saved[-2]))
    assert_same(restarted, failed)


@pytest.mark.parametrize("name", ["frictionless", "cloud", "collocation on a cloud"])
def test_a_run_that_would_take_for_ever_is_ended_amid_its_steps(name):
    case = replace(CASES[name][0], terrain=Plane(0), friction=Coulomb(0))
    sides = Boundaries("wall", "wall", "wall", "wall")
    late = simulate(replace(case, boundaries=sides), [1e5], max_wall=0.3)
    assert late.failure.reason == "more time than allowed"
    assert late.steps > 0
    assert 0 < late.failure.time == late.time < 1e5
    (x0, x1), (y0, y1) = case.points.extent
    assert x0 <= late.failure.x <= x1
    assert y0 <= late.failure.y <= y1
    assert np.isnan(late.depth).all()
    assert np.isfinite(late.deposit_depth).all()


@pytest.mark.usefixtures("shared_workers")
@pytest.mark.parametrize(
    ("limit", "reason", "others"),
    [
        ("max_steps: 3", "more steps than allowed", Status.DONE),
        ("max_wall: 1.0e-9", "more time than allowed (1e-09 s)", Status.FAILED),
    ],
)
def test_a_run_over_its_budget_has_its_good_frames_in_the_store(scenario_file, out, limit, reason, others):
    file = scenario_file(20, 89, replace=("output_every: 0.5", f"output_every: 0.01, {limit}"))
    run(out, file, solve=simulate)
    assert zarr_store.statuses(out / "box.zarr").tolist() == [Status.FAILED, others]
    with zarr_store.open_store(out / "box.zarr") as opened:
        failed = opened.isel(run=0).load()
    until = failed["failure_time"].item()
    assert failed["failure_reason"].item().startswith(f"{reason} at t = {until:.6g} s, x = ")
    assert failed["last_time"].item() == until
    assert (failed["depth"].notnull().all(("y", "x")) == (failed["time"] <= until)).all()
    assert failed["depth"][-1].isnull().all()
    assert failed["deposit_depth"].notnull().all()
    assert 0 <= failed["failure_x"].item() <= 10
    assert -2 <= failed["failure_y"].item() <= 2


def warning(scene, times, **options):
    """Warn of what no kernel would."""
    warnings.simplefilter("error", UserWarning)
    for _ in range(3):
        np.log(np.array([-1.0]))
    return still(scene, times, **options)


def test_warnings_are_counted_in_the_store_and_not_shown(scenario_file, out, capsys, shared_workers):
    assert run(out, scenario_file(20), solve=warning).exit_code == 0
    with zarr_store.open_store(out / "box.zarr") as opened:
        assert opened["warnings"].to_numpy().tolist() == [3]
        assert opened["warning"].to_numpy().tolist() == ["invalid value encountered in log"]
    assert capsys.readouterr().err == ""


def test_a_sound_result_raises_no_doubts_and_others_say_what_is_wrong():
    case = scene()
    sound = simulate(case, [0.5])
    assert list(doubts(case, sound)) == []
    ledger, h = sound.ledger, sound.deposit_depth
    for changed, told in (
        (replace(sound, ledger=replace(ledger, now=1.01 * ledger.now)), "ledger of volume is off by 0.01"),
        (replace(sound, max_speed=20 * sound.max_speed), "times what it has a source for"),
        (replace(sound, deposit_depth=h - 0.01), "below a depth of zero"),
    ):
        (found,) = doubts(case, changed)
        assert told in found
    (found,) = doubts(replace(case, scheme=WeightedResidual(wet_limit=0.2)), sound)
    assert "counts as dry" in found


@pytest.mark.parametrize("name", ["mixed sides", "several blobs", "rough", "cloud"])
def test_the_speed_that_has_a_source_is_that_of_the_whole_scene(name):
    case = CASES[name][0]
    run = begin(case, 1.0, 0.0, True)
    whole, strip = Laws(case, state_of_run(run), 1.0), laws_of_speed(case)
    assert strip.speed_limit(1.0) == pytest.approx(whole.speed_limit(1.0), rel=1e-12)
