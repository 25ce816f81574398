"""Worker processes forked from this one, without Dask: for few runs, which would wait for a cluster to start.

A process keeps what this one has loaded, and takes a hundredth of a second to start. It ends with its driver,
however that ends, and is replaced where it dies of a run.
"""

from __future__ import annotations

import ctypes
import multiprocessing
import os
import signal
import sys
from collections.abc import Callable, Iterator
from contextlib import contextmanager, suppress
from multiprocessing.connection import Connection, wait
from multiprocessing.process import BaseProcess
from pathlib import Path

from pipeline.batch.compilation import leave_out_blas
from pipeline.batch.interrupts import deaf, uncut
from pipeline.batch.limits import STUCK_EXIT
from pipeline.batch.scheduling import Died, Finished, Trouble
from pipeline.batch.task import Job, Solve, perform

ENDING_SECONDS = 10.0
HEARING_SECONDS = 0.2
# of prctl, in sys/prctl.h of Linux
_PARENT_DEATH_SIGNAL = 1


def can_fork() -> bool:
    """Whether forked processes can be relied on: system libraries other than those of Linux forbid it."""
    return sys.platform == "linux" and not multiprocessing.current_process().daemon


@contextmanager
def forked_pool(width: int, solve: Solve) -> Iterator[ForkedPool]:
    """Give a pool of as many forked processes, and end them; killed at once on a KeyboardInterrupt."""
    pool = ForkedPool(width, solve)
    try:
        yield pool
    except KeyboardInterrupt:
        pool.kill()
        raise
    finally:
        pool.end()


class ForkedPool:
    """Jobs done by processes of this one; a process is started where none is free.

    Parameters
    ----------
    width : int
        As many jobs may be under way.
    """

    def __init__(self, width: int, solve: Solve) -> None:
        self.width, self._solve = width, solve
        self._free: list[_Worker] = []
        self._busy: dict[Connection, tuple[_Worker, Job]] = {}

    def __str__(self) -> str:
        return f"worker processes: {self.width}"

    def submit(self, job: Job) -> None:
        """Hand a job to a process that is free, or to a new one."""
        worker = self._worker()
        worker.connection.send(job)
        self._busy[worker.connection] = worker, job

    def next(self) -> Finished | Died | Trouble | None:
        """Wait for a job that ends; None where none is under way."""
        if not self._busy:
            return None
        # loads pandas, which the end of a batch needs, while the first run computes
        with uncut():
            import pipeline.store.run_table  # noqa: F401

        # an interrupt that another thread of this process took is heard between two waits only
        while not (found := wait(list(self._busy), HEARING_SECONDS)):
            pass
        ready = found[0]
        assert isinstance(ready, Connection)
        worker, job = self._busy.pop(ready)
        try:
            answer = ready.recv()
        except (EOFError, OSError):
            return Died(job, stuck=worker.gone() == STUCK_EXIT)
        self._free.append(worker)
        return Trouble(job, answer) if isinstance(answer, str) else Finished(job, answer)

    def start(self, work: Callable[[], None]) -> Callable[[], bool]:
        """Have a process do something else; gives what says whether it is done, however it went."""
        worker = self._worker()
        worker.connection.send(work)

        def done() -> bool:
            if not worker.connection.poll():
                return False
            with suppress(EOFError, OSError):
                worker.connection.recv()
                self._free.append(worker)
            return True

        return done

    def end(self) -> None:
        """End the processes once they are done; kill those that do not end."""
        for worker in self._workers():
            worker.connection.close()
        for worker in self._workers():
            worker.process.join(ENDING_SECONDS)
        self.kill()

    def kill(self) -> None:
        """Kill the processes."""
        for worker in self._workers():
            worker.process.kill()
        for worker in self._workers():
            worker.process.join()
        self._free.clear()
        self._busy.clear()

    def _workers(self) -> list[_Worker]:
        return [*self._free, *(worker for worker, _ in self._busy.values())]

    def _worker(self) -> _Worker:
        while self._free:
            worker = self._free.pop()
            # one may have been killed since
            if worker.process.is_alive():
                return worker
        return _Worker(self._solve)


class _Worker:
    """A forked process, and the end of a pipe that it is given work through."""

    def __init__(self, solve: Solve) -> None:
        self.connection, theirs = multiprocessing.Pipe()
        fork = multiprocessing.get_context("fork")
        self.process: BaseProcess = fork.Process(
            target=_serve, args=(theirs, solve, os.getpid()), daemon=True
        )
        with deaf():
            self.process.start()
        theirs.close()

    def gone(self) -> int | None:
        """Wait for the end of a process that hung up; its exit code."""
        self.process.join(ENDING_SECONDS)
        self.connection.close()
        return self.process.exitcode


def _serve(connection: Connection, solve: Solve, driver: int) -> None:
    """Do what comes through the pipe until it is closed; answer with outcomes, or with what is wrong."""
    _let_go(connection.fileno())
    _die_with(driver)
    leave_out_blas()
    with suppress(EOFError, BrokenPipeError):
        while True:
            work = connection.recv()
            answer: object
            try:
                answer = perform(work, solve) if isinstance(work, Job) else work()
            except OSError as error:
                answer = str(error)
            except Exception as error:
                answer = f"{type(error).__name__}: {error}"
            connection.send(answer)


def _let_go(*kept: int) -> None:
    """Let go of the files of the driver: of its lock, which would outlast it, and of the pipes of others.

    Their numbers stay taken, by nothing, as the objects that hold them are still there.
    """
    nothing = os.open(os.devnull, os.O_RDWR)
    for number in [int(each.name) for each in Path("/proc/self/fd").iterdir()]:
        if number > 2 and number not in (*kept, nothing):
            with suppress(OSError):
                # the folder that is listed is closed by now
                os.fstat(number)
                os.dup2(nothing, number, inheritable=False)


def _die_with(driver: int) -> None:
    """Have the system kill this process when the driver ends."""
    with suppress(AttributeError):
        ctypes.CDLL(None).prctl(_PARENT_DEATH_SIGNAL, signal.SIGKILL)
    if os.getppid() != driver:
        os._exit(1)
