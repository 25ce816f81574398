import time
from functools import partial

import pytest

from pipeline import compilation
from pipeline.compilation import compile_once
from pipeline.interrupts import Interrupts


def fail():
    raise OSError("no room for compiled kernels")


def test_compiling_is_said_once_and_loading_is_not(cluster, monkeypatch):
    told = []
    compile_once(cluster, told.append, Interrupts(), partial(time.sleep, 0.01))
    assert told == []
    monkeypatch.setattr(compilation, "LOADING_SECONDS", 0.1)
    compile_once(cluster, told.append, Interrupts(), partial(time.sleep, 0.5))
    assert told == ["compiling the solver (once after installing or upgrading)"]


def test_an_interrupt_does_not_wait_for_it(cluster):
    began = time.monotonic()
    with pytest.raises(KeyboardInterrupt):
        compile_once(cluster, print, Interrupts(asked=True), partial(time.sleep, 2))
    assert time.monotonic() - began < 1


def test_what_goes_wrong_is_left_to_the_runs(cluster):
    compile_once(cluster, print, Interrupts(), fail)
