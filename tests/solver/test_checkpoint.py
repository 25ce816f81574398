import numpy as np
import pytest
from checkpoints import CASES, CLOUD, Memory, assert_carried_alike, assert_same, other
from scenes import scene

from solver.forms import begin
from solver.kernels.runge_kutta import OUT_OF_STEPS
from solver.points.lattice import Lattice
from solver.scene import WeightedResidual
from solver.simulation import simulate


def poison(run):
    """Put nonsense into everything that a snapshot does not hold."""
    for group in (*getattr(run, "stages", ()), *getattr(run, "buffers", ())[:-1]):
        for array in group if isinstance(group, tuple) else ():
            array[:] = 1e300


@pytest.mark.parametrize("name", CASES)
def test_ten_steps_are_five_and_a_restart_and_five(name, monkeypatch):
    monkeypatch.setattr("solver.lattice.run.LEAST_GROWTH", 2)
    case, end = CASES[name]
    whole, first, second = (begin(case, end, 0.01, True) for _ in range(3))
    outcome = whole.advance(end, 10)
    assert first.advance(end, 5) in (OUT_OF_STEPS, outcome)
    second.restore({key: array.copy() for key, array in first.carried.items()})
    poison(second)
    assert second.advance(end, 10) == outcome
    assert second.progress.steps[0] == whole.progress.steps[0] > 0
    assert_carried_alike(whole, second)


@pytest.mark.parametrize("name", CASES)
def test_a_run_restarted_anywhere_ends_as_if_it_had_not_stopped(name, monkeypatch):
    monkeypatch.setattr("solver.lattice.run.LEAST_GROWTH", 2)
    case, end = CASES[name]
    times = np.linspace(0, end, 4)
    memory = Memory()
    whole = simulate(case, times, arrival_depth=0.01)
    assert_same(simulate(case, times, arrival_depth=0.01, keeper=memory), whole)
    assert memory.saved
    for snapshot in memory.saved[:: max(1, len(memory.saved) // 3)]:
        again = simulate(case, times, arrival_depth=0.01, keeper=Memory(snapshot))
        assert_same(again, whole)
        assert again.wall_time > snapshot.wall


def test_a_snapshot_of_other_points_is_refused():
    memory = Memory()
    simulate(scene(), [1.0], keeper=memory)
    coarse = scene(lattice=Lattice((0, 12), (-4, 4), 1.0))
    for changed in (coarse, other(CLOUD, WeightedResidual())):
        with pytest.raises(ValueError, match="other points"):
            simulate(changed, [1.0], keeper=Memory(memory.saved[-1]))


def test_a_run_over_its_time_fails_and_says_so():
    whole, late = simulate(scene(), [0.0, 1.0]), simulate(scene(), [0.0, 1.0], max_wall=1e-9)
    assert late.failure.reason == "more time than allowed"
    assert late.steps < whole.steps
    assert np.isnan(late.depth[1]).all()


def test_time_used_before_a_restart_counts():
    memory = Memory()
    simulate(scene(), [1.0], keeper=memory)
    snapshot = memory.saved[0]
    object.__setattr__(snapshot, "wall", 100.0)
    assert simulate(scene(), [1.0], keeper=Memory(snapshot), max_wall=50.0).failure is not None
    assert simulate(scene(), [1.0], keeper=Memory(snapshot), max_wall=1000.0).failure is None


def test_a_limit_of_steps_holds_beside_one_of_time():
    limited = simulate(scene(), [0.0, 1.0], max_wall=1000.0, max_steps=7)
    assert limited.failure.reason == "more steps than allowed"
    assert limited.steps == 7
