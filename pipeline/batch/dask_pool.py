"""Jobs done by the workers of a Dask cluster, of this machine or of another."""

# distributed leaves most of its functions without types.
# mypy: disable-error-code="no-untyped-call"

from __future__ import annotations

from collections.abc import Callable, Iterator
from contextlib import AbstractContextManager, contextmanager, suppress
from importlib.util import find_spec
from time import monotonic
from typing import Any

from distributed import Client, KilledWorker, as_completed
from tornado.ioloop import PeriodicCallback

from pipeline.batch.limits import STUCK_TOPIC
from pipeline.batch.local_workers import workers
from pipeline.batch.scheduling import Died, Finished, Trouble
from pipeline.batch.task import Job, Solve, perform

WATCH_SECONDS = 2.0
# a nanny starts a new process in a few seconds; on a machine under load it may take a minute
WORKERLESS_SECONDS = 300.0

Engine = Callable[[int], AbstractContextManager[Client]]


@contextmanager
def dask_pool(width: int, engine: Engine | None, solve: Solve) -> Iterator[DaskPool]:
    """Give a pool of as many local workers, or of those of an engine, and end what was started for it."""
    with (engine or workers)(width) as client:
        # workers elsewhere are as many as there are
        pool = DaskPool(client, width if engine is None else None, solve)
        with pool.watched():
            yield pool


class DaskPool:
    """Jobs on their way through the workers of a client.

    Parameters
    ----------
    width : int, optional
        As many jobs may be under way; by default as many as the workers have threads.
    """

    def __init__(self, client: Client, width: int | None, solve: Solve) -> None:
        self._client, self._solve = client, solve
        self.width = int(sum(client.nthreads().values())) if width is None else width
        self._jobs: dict[Any, Job] = {}
        self._completed = as_completed(loop=client.loop)
        self._trouble = ""

    def __str__(self) -> str:
        page = f", dashboard: {self._client.dashboard_link}" if find_spec("bokeh") is not None else ""
        return f"worker processes: {self.width}, of Dask{page}"

    def start(self, work: Callable[[], None]) -> Callable[[], bool]:
        """Have a worker do something else; gives what says whether it is done, however it went."""
        done: Callable[[], bool] = self._client.submit(work, pure=False).done
        return done

    def submit(self, job: Job) -> None:
        """Hand a job to a worker."""
        future = self._client.submit(perform, job, self._solve, pure=False)
        self._jobs[future.key] = job
        self._completed.add(future)

    def next(self) -> Finished | Died | Trouble | None:
        """Wait for a job that ends; None where none is under way."""
        while self._jobs:
            future = next(self._completed, None)
            if future is None:
                _, job = self._jobs.popitem()
                self._jobs.clear()
                return Trouble(job, self._trouble, of_place=False)
            if future.status == "lost":
                # its worker died of another job before the result was fetched; it is computed again, which
                # finds all runs finished
                self._completed.add(future)
                continue
            job = self._jobs.pop(future.key)
            try:
                return self._ended(job, future)
            finally:
                future.release()
        return None

    def _ended(self, job: Job, future: Any) -> Finished | Died | Trouble:
        if future.status == "finished":
            return Finished(job, future.result())
        if future.status == "cancelled":
            return Trouble(job, "the scheduler is gone", of_place=False)
        error = future.exception()
        if isinstance(error, KilledWorker):
            stuck = {name for _, name in self._client.get_events(STUCK_TOPIC)}
            return Died(job, stuck=job.name(job.runs[0]) in stuck)
        return Trouble(job, str(error) if isinstance(error, OSError) else f"{type(error).__name__}: {error}")

    @contextmanager
    def watched(self) -> Iterator[None]:
        """Give up jobs that wait for workers of which none is left, and none has come for a while."""
        seen, loop = monotonic(), self._client.loop
        scheduler: Any = self._client.scheduler
        assert loop is not None

        async def look() -> None:
            nonlocal seen
            # a scheduler that does not answer cancels what was handed to it
            with suppress(OSError):
                if await scheduler.ncores():
                    seen = monotonic()
                elif monotonic() - seen > WORKERLESS_SECONDS:
                    self._trouble = f"no worker is left, and none has come for {WORKERLESS_SECONDS:g} s"
                    self._completed.clear()

        watch = PeriodicCallback(look, 1000 * WATCH_SECONDS)
        loop.add_callback(watch.start)
        try:
            yield
        finally:
            loop.add_callback(watch.stop)
