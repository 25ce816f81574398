"""What an interrupt may cut into."""

import signal

import pytest

from pipeline.batch.interrupts import heard, uncut


def interrupt_twice(loaded: list[bool]) -> None:
    with heard(lambda line: None):
        signal.raise_signal(signal.SIGINT)
        with uncut():
            signal.raise_signal(signal.SIGINT)
            loaded.append(True)


def test_an_interrupt_while_a_module_is_loaded_is_heard_once_it_is():
    loaded = []
    with pytest.raises(KeyboardInterrupt):
        interrupt_twice(loaded)
    assert loaded == [True]
