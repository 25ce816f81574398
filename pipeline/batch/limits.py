"""Memory and time of runs: limits that their own code cannot keep, and what is freed between them."""

# distributed leaves most of its functions without types.
# mypy: disable-error-code="no-untyped-call"

from __future__ import annotations

import ctypes
import gc
import os
import resource
import sys
import threading
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from dataclasses import dataclass
from functools import cache
from itertools import count
from time import sleep
from typing import TYPE_CHECKING

import psutil

if TYPE_CHECKING:
    from distributed import Worker

# A run looks at the clock between steps; what has not stopped by then is stuck somewhere else.
GRACE_SECONDS = 30.0
STUCK_TOPIC = "lmls-stuck"
# exit code of a process that ends because its run does not stop; EX_SOFTWARE of sysexits.h
STUCK_EXIT = 70
TELLING_SECONDS = 0.3
# of mallopt, in malloc.h of the GNU C library
M_TRIM_THRESHOLD, M_MMAP_THRESHOLD = -1, -3


@dataclass(frozen=True)
class Limits:
    """Limits of every run of a batch.

    Parameters
    ----------
    memory : int, optional
        Bytes a run may take beside what its process holds, None for no limit; kept on Linux only.
    grace : float
        Seconds beyond its own time limit after which a run that does not stop is ended with its process.
    """

    memory: int | None = None
    grace: float = GRACE_SECONDS

    @contextmanager
    def kept(self, max_wall: float | None, name: str) -> Iterator[None]:
        """Keep a run to its limits: what is too large for memory raises, what does not stop is killed.

        Parameters
        ----------
        max_wall : float, optional
            Its own limit of elapsed time, s.
        name : str
            What the driver is told before the process ends.

        Raises
        ------
        MemoryError
            If the run asks for more memory than allowed.
        """
        timer = None
        if max_wall is not None:
            timer = threading.Timer(max_wall + self.grace, _end, [_worker(), name])
            timer.daemon = True
            timer.start()
        before = resource.getrlimit(resource.RLIMIT_DATA)
        try:
            if self.memory is not None and sys.platform == "linux":
                held = psutil.Process().memory_info().data
                resource.setrlimit(resource.RLIMIT_DATA, (held + self.memory, before[1]))
            yield
        finally:
            resource.setrlimit(resource.RLIMIT_DATA, before)
            if timer is not None:
                timer.cancel()


@cache
def keep_freed_memory() -> None:
    """Have this process keep the memory that runs free for the next one, where it has the GNU C library.

    Memory given back after every array is asked for again, page by page: 3 ms a short run.
    """
    if sys.platform == "linux":
        with suppress(AttributeError):
            library = ctypes.CDLL(None)
            library.mallopt(M_TRIM_THRESHOLD, 2**28)
            library.mallopt(M_MMAP_THRESHOLD, 2**25)


def freeze_loaded() -> None:
    """Leave what the first job of this process has loaded out of the search for garbage: it stays to the end.

    Modules and compiled code are half a million objects; going through them costs 1 ms a short run. Doing so
    once takes a tenth of a second, so that it waits for the second job: many processes do one alone.
    """
    if next(_jobs) == 1:
        gc.collect()
        gc.freeze()


def _worker() -> Worker | None:
    """Give the worker this is a task of, if it is one: Dask is loaded then, which takes long to import."""
    if "distributed" not in sys.modules:
        return None
    from distributed import get_worker

    try:
        return get_worker()
    except ValueError:
        return None


def _end(worker: Worker | None, name: str) -> None:
    """End this process, and have the driver told why."""
    if worker is not None:
        worker.log_event(STUCK_TOPIC, name)
        sleep(TELLING_SECONDS)
    os._exit(STUCK_EXIT)


UNLIMITED = Limits()
_jobs = count()
