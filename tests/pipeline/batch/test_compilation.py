import signal
import time
from functools import partial
from types import SimpleNamespace

import pytest
from stub_solvers import lasting

from pipeline.batch import compilation
from pipeline.batch.compilation import compile_once, head_start
from pipeline.batch.dask_pool import DaskPool
from pipeline.batch.forked_pool import forked_pool
from pipeline.batch.interrupts import Interrupts
from solver.cloud import time_stepping as cloud
from solver.cloud.blocks import spread_blocks
from solver.cloud.residual import cloud_stage
from solver.cloud.status import classify_cloud
from solver.compiled import kernel
from solver.kernels.sections.inflow import await_inflow, begin_inflow
from solver.kernels.sections.measured import sample
from solver.lattice import time_stepping as lattice
from solver.lattice.residual import stage
from solver.lattice.spans import copy_surroundings, moving_volume_exceeds, spread
from solver.lattice.status import classify
from solver.run import PIECES
from solver.simulation import simulate
from solver.warmup import compile_kernels, not_compiled


@pytest.fixture(params=["forked", "dask"])
def pool(request):
    """Workers of either kind."""
    if request.param == "dask":
        yield DaskPool(request.getfixturevalue("cluster"), 2, simulate)
        return
    with forked_pool(2, simulate) as forked:
        yield forked


def fail():
    raise OSError("no room for compiled kernels")


def test_compiling_is_said_once_and_loading_is_not(pool, monkeypatch):
    told = []
    compile_once(pool.start, told.append, Interrupts(), partial(time.sleep, 0.01))
    assert told == []
    monkeypatch.setattr(compilation, "LOADING_SECONDS", 0.1)
    compile_once(pool.start, told.append, Interrupts(), partial(time.sleep, 0.5))
    assert told == ["compiling the solver (once after installing or upgrading)"]


def test_an_interrupt_does_not_wait_for_it(pool):
    began = time.monotonic()
    with pytest.raises(KeyboardInterrupt):
        compile_once(pool.start, print, Interrupts(asked=True), partial(time.sleep, 2))
    assert time.monotonic() - began < 1


def test_what_goes_wrong_is_left_to_the_runs(pool):
    compile_once(pool.start, print, Interrupts(), fail)


def test_the_pieces_compiled_ahead_are_what_a_step_calls():
    kernels = (
        *(classify, spread, moving_volume_exceeds, copy_surroundings, stage, lattice.erode),
        *(classify_cloud, spread_blocks, cloud_stage, cloud.erode),
        *(await_inflow, begin_inflow, sample),
    )
    for piece in range(PIECES):
        compile_kernels(["lattice", "cloud"], piece)
    before = [list(each.signatures) for each in kernels]
    assert all(before)
    compile_kernels(["lattice", "cloud"])
    # compiled anew, a step looks for what it calls
    for step in (lattice.advance, cloud.advance_cloud):
        kernel(cached=False)(step.py_func).compile(step.signatures[0])
    assert [list(each.signatures) for each in kernels] == before


def test_nothing_is_compiled_ahead_that_is_on_disk():
    compile_kernels(["lattice"])
    assert not_compiled(["lattice"]) == []
    with head_start(["lattice"]) as processes:
        assert processes == []


def test_what_is_compiled_ahead_ends_with_the_batch(monkeypatch):
    monkeypatch.setattr(compilation, "not_compiled", lambda kinds: list(kinds))
    monkeypatch.setattr(compilation, "compile_kernels", lasting)
    monkeypatch.setattr(compilation, "cores", lambda: PIECES)
    with head_start(["lattice"]) as processes:
        assert [process.is_alive() for process in processes] == [True] * PIECES
    for process in processes:
        process.join(10)
        assert process.exitcode == -signal.SIGTERM
    monkeypatch.setattr(compilation, "cores", lambda: 1)
    with head_start(["lattice"]) as processes:
        assert processes == []


def test_what_is_compiled_ahead_is_waited_for(pool):
    began = time.monotonic()
    ahead = SimpleNamespace(is_alive=lambda: time.monotonic() - began < 0.3)
    compile_once(pool.start, print, Interrupts(), partial(time.sleep, 0), [ahead])
    assert time.monotonic() - began >= 0.3
