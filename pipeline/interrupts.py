"""Ctrl-C while a batch runs: once to finish what runs, twice to stop at once."""

from __future__ import annotations

import signal
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from types import FrameType


@dataclass
class Interrupts:
    """Whether the user asked to stop."""

    asked: bool = False


@contextmanager
def heard(tell: Callable[[str], None]) -> Iterator[Interrupts]:
    """Count interrupts instead of raising the first; the second raises KeyboardInterrupt.

    Parameters
    ----------
    tell : callable
        Told a line for the user at the first.
    """
    interrupts = Interrupts()

    def handle(number: int, frame: FrameType | None) -> None:
        if interrupts.asked:
            raise KeyboardInterrupt
        interrupts.asked = True
        tell("interrupted: finishing the runs under way; interrupt again to stop at once")

    before = signal.signal(signal.SIGINT, handle)
    try:
        yield interrupts
    finally:
        signal.signal(signal.SIGINT, before)
