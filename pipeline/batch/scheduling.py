"""A batch: jobs handed to worker processes through Dask, a few at a time, each forgotten when it ends."""

# distributed leaves most of its functions without types.
# mypy: disable-error-code="no-untyped-call"

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator, Mapping
from contextlib import contextmanager, suppress
from dataclasses import dataclass, field, replace
from functools import cached_property
from itertools import islice
from time import monotonic
from typing import TYPE_CHECKING, Any

import numpy as np
from distributed import Client, Future, KilledWorker, as_completed
from numpy.typing import NDArray
from tornado.ioloop import PeriodicCallback

from pipeline.batch.interrupts import Interrupts
from pipeline.batch.limits import STUCK_TOPIC, Limits
from pipeline.batch.task import Job, Outcome, Solve, condemn, perform
from pipeline.runs.template import variables
from pipeline.store import zarr_store
from pipeline.store.place import WHOLE, Part
from pipeline.store.variables import Status
from solver.simulation import simulate

if TYPE_CHECKING:
    from pipeline.batch.checkpoints import Checkpoints
    from pipeline.runs.runs import Runs
    from pipeline.runs.shared_points import SharedPoints
    from pipeline.scenario.scenario import Scenario
    from pipeline.store.storage import Location

WATCH_SECONDS = 2.0
# a nanny starts a new process in a few seconds; on a machine under load it may take a minute
WORKERLESS_SECONDS = 300.0
DEATH = "the worker process died of this run, twice"
STUCK = "more time than allowed, and the run did not stop: its worker process was ended, twice"


@dataclass
class Ending:
    """How a batch ended: whether the user stopped it, and what was wrong with the place."""

    interrupted: bool = False
    trouble: str = ""


@dataclass(frozen=True)
class Todo:
    """What is left to do in a store, by its status alone."""

    scenario: Scenario
    path: Location
    runs: Runs
    shared: SharedPoints | Location
    wanted: NDArray[np.bool_]
    limits: Limits
    checkpoints: Checkpoints | None
    part: Part = WHOLE
    same: Mapping[int, tuple[Location, int]] = field(default_factory=dict)

    @cached_property
    def group(self) -> int:
        """Runs per task."""
        return zarr_store.group(self.path)

    @property
    def starts(self) -> NDArray[np.int64]:
        """First run of every group of this part with something left, shape (jobs,)."""
        groups = np.unique(np.flatnonzero(self.wanted) // self.group)
        return np.array([group for group in groups if self.part.has(group)], np.int64) * self.group

    @property
    def runs_left(self) -> int:
        """Runs of this part that are left."""
        return sum(int(self.wanted[start : start + self.group].sum()) for start in self.starts)

    def jobs(self, *, again: bool) -> Iterator[Job]:
        """Go through what is left, one job a group: those that others stand for, or the rest."""
        held = zarr_store.held(self.path, variables(self.scenario))
        for start in self.starts:
            stop = min(start + self.group, len(self.runs))
            left = [int(i) for i in np.arange(start, stop) if self.wanted[i]]
            same = {i: self.same[i] for i in left if i in self.same}
            if bool(same) == again:
                chosen = tuple(self.runs[i] for i in left)
                yield Job(self.path, held, chosen, self.shared, self.limits, self.checkpoints, same)


def pending(path: Location, retry_failed: bool) -> NDArray[np.bool_]:
    """Say of every run of a store whether it is left to do, shape (runs,)."""
    return np.isin(zarr_store.statuses(path), [Status.PENDING, *([Status.FAILED] if retry_failed else [])])


def threads(client: Client) -> int:
    """Count the threads of all workers: as many jobs may be under way."""
    return int(sum(client.nthreads().values()))


def execute_here(
    jobs: Iterable[Job], report: Callable[[Outcome], None], interrupts: Interrupts, solve: Solve = simulate
) -> Ending:
    """Do jobs in this process, one after another; what kills it leaves its runs pending."""
    for job in jobs:
        if interrupts.asked:
            break
        try:
            for outcome in perform(job, solve):
                report(outcome)
        except OSError as error:
            return Ending(trouble=f"{job.path}: {error}")
    return Ending(interrupts.asked)


def execute(
    client: Client,
    width: int,
    jobs: Iterable[Job],
    report: Callable[[Outcome], None],
    interrupts: Interrupts,
    solve: Solve = simulate,
    under_way: Callable[[int], None] = lambda runs: None,
) -> Ending:
    """Do jobs until all are done, the user interrupts, or the place gives trouble.

    A job whose worker died is set aside and its runs are tried again one at a time with nothing beside
    them, so that a run is condemned only by deaths that are its own.

    Parameters
    ----------
    client : Client
        Of the workers.
    width : int
        Jobs under way at once: as many as there are workers, so that none waits behind one that kills.
    jobs : iterable of Job
        Taken as workers become free.
    report : callable
        Told what became of every run.
    interrupts : Interrupts
        Whether the user asked to stop; looked at before every job.
    solve : callable
        The solver.
    under_way : callable
        Told how many runs are with workers.

    Returns
    -------
    Ending
        How it ended; runs that are not reported are as pending as before.
    """
    suspects: list[Job] = []

    def condemned(job: Job) -> None:
        stuck = {name for _, name in client.get_events(STUCK_TOPIC)}
        for outcome in condemn(job, STUCK if job.name(job.runs[0]) in stuck else DEATH):
            report(outcome)

    flow = _Flow(client, report, interrupts, solve, under_way)
    flow.run(iter(jobs), width, suspects.append)
    flow.run((replace(job, runs=(run,)) for job in suspects for run in job.runs), 1, condemned)
    return Ending(interrupts.asked, flow.trouble)


@dataclass
class _Flow:
    """Jobs on their way through the workers, never more of them than asked for."""

    client: Client
    report: Callable[[Outcome], None]
    interrupts: Interrupts
    solve: Solve
    under_way: Callable[[int], None]
    trouble: str = ""

    def run(self, jobs: Iterator[Job], width: int, died: Callable[[Job], None]) -> None:
        """Do jobs, ``width`` at a time; ``died`` takes those whose worker died."""
        under_way: dict[Any, Job] = {}
        completed = as_completed(loop=self.client.loop)

        def submit() -> None:
            if self.interrupts.asked or self.trouble:
                return
            for job in islice(jobs, 1):
                future = self.client.submit(perform, job, self.solve, pure=False)
                under_way[future.key] = job
                completed.add(future)
            self.under_way(sum(len(job.runs) for job in under_way.values()))

        for _ in range(width):
            submit()
        with self._watched(completed):
            for future in completed:
                if future.status == "lost":
                    # its worker died of another job before the result was fetched; it is computed again,
                    # which finds all runs finished
                    completed.add(future)
                    continue
                job = under_way.pop(future.key)
                try:
                    self._finish(job, future, died)
                except OSError as error:
                    self.trouble = f"{job.path}: {error}"
                future.release()
                submit()

    @contextmanager
    def _watched(self, completed: as_completed) -> Iterator[None]:
        """Give up jobs that wait for workers of which none is left, and none has come for a while."""
        seen, loop = monotonic(), self.client.loop
        scheduler: Any = self.client.scheduler
        assert loop is not None

        async def look() -> None:
            nonlocal seen
            # a scheduler that does not answer cancels what was handed to it
            with suppress(OSError):
                if await scheduler.ncores():
                    seen = monotonic()
                elif monotonic() - seen > WORKERLESS_SECONDS:
                    self.trouble = f"no worker is left, and none has come for {WORKERLESS_SECONDS:g} s"
                    completed.clear()

        watch = PeriodicCallback(look, 1000 * WATCH_SECONDS)
        loop.add_callback(watch.start)
        try:
            yield
        finally:
            loop.add_callback(watch.stop)

    def _finish(self, job: Job, future: Future[Any], died: Callable[[Job], None]) -> None:
        if future.status == "finished":
            for outcome in future.result():
                self.report(outcome)
            return
        if future.status == "cancelled":
            self.trouble = "the scheduler is gone"
            return
        error = future.exception()
        if isinstance(error, KilledWorker):
            died(job)
        else:
            self.trouble = f"{job.path}: {type(error).__name__}: {error}"
