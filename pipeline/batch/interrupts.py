"""Ctrl-C while a batch runs: once to finish what runs, twice to stop at once."""

from __future__ import annotations

import signal
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from multiprocessing import resource_tracker
from queue import SimpleQueue
from threading import Thread, current_thread, main_thread
from types import FrameType

MESSAGE = "interrupted: finishing the runs under way; interrupt again to stop at once"


@dataclass
class Interrupts:
    """Whether the user asked to stop."""

    asked: bool = False


@contextmanager
def heard(tell: Callable[[str], None]) -> Iterator[Interrupts]:
    """Count interrupts instead of raising the first; the second raises KeyboardInterrupt.

    Outside the main thread no signal can be caught: interrupts are left to whoever runs the main thread.
    Later ones are not heard any more: they would cut into the ending of workers, and of the process.

    Parameters
    ----------
    tell : callable
        Told a line for the user at the first, from a thread of its own: what an interrupt cuts into may be
        telling something just then, and can be gone into once only.
    """
    interrupts = Interrupts()
    if current_thread() is not main_thread():
        yield interrupts
        return
    lines: SimpleQueue[str | None] = SimpleQueue()

    def handle(number: int, frame: FrameType | None) -> None:
        if interrupts.asked:
            signal.signal(signal.SIGINT, signal.SIG_IGN)
            raise KeyboardInterrupt
        interrupts.asked = True
        lines.put(MESSAGE)

    def pass_on() -> None:
        while (line := lines.get()) is not None:
            tell(line)

    teller = Thread(target=pass_on, daemon=True)
    teller.start()
    before = signal.signal(signal.SIGINT, handle)
    try:
        yield interrupts
    finally:
        if signal.getsignal(signal.SIGINT) is handle:
            signal.signal(signal.SIGINT, before)
        lines.put(None)
        teller.join()


@contextmanager
def uncut() -> Iterator[None]:
    """Hear interrupts that come meanwhile afterwards.

    A module whose import is cut into cannot be imported again. Only the main thread is cut into.
    """
    if current_thread() is not main_thread():
        yield
        return
    came: list[int] = []
    before = signal.signal(signal.SIGINT, lambda number, frame: came.append(number))
    try:
        yield
    finally:
        signal.signal(signal.SIGINT, before)
        for number in came:
            signal.raise_signal(number)


@contextmanager
def deaf() -> Iterator[None]:
    """Have threads and processes that are started meanwhile be deaf to Ctrl-C.

    It reaches the whole process group, and the driver alone decides what stops. They inherit its being
    blocked; an interrupt that comes meanwhile is heard afterwards.
    """
    # started with the first process it would unblock the signal
    resource_tracker.ensure_running()
    before = signal.pthread_sigmask(signal.SIG_BLOCK, {signal.SIGINT})
    try:
        yield
    finally:
        signal.pthread_sigmask(signal.SIG_SETMASK, before)
