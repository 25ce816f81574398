"""A batch: jobs handed to worker processes, a few at a time, each forgotten when it ends."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field, replace
from functools import cached_property
from itertools import islice
from typing import TYPE_CHECKING, Protocol

import numpy as np
from numpy.typing import NDArray

from pipeline.batch.interrupts import Interrupts
from pipeline.batch.limits import Limits
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


@dataclass(frozen=True)
class Finished:
    """A job that ended, and what became of its runs."""

    job: Job
    outcomes: Sequence[Outcome]


@dataclass(frozen=True)
class Died:
    """A job whose process died of it; ``stuck`` if it was ended because a run did not stop."""

    job: Job
    stuck: bool


@dataclass(frozen=True)
class Trouble:
    """What keeps a job, and those after it, from being done; ``of_place`` if it is of the job's store."""

    job: Job
    message: str
    of_place: bool = True

    def __str__(self) -> str:
        return f"{self.job.path}: {self.message}" if self.of_place else self.message


class Pool(Protocol):
    """Worker processes that jobs are handed to."""

    def submit(self, job: Job) -> None:
        """Hand a job to a process."""

    def next(self) -> Finished | Died | Trouble | None:
        """Wait for a job that ends; None where none is under way."""

    def start(self, work: Callable[[], None]) -> Callable[[], bool]:
        """Have a process do something else; gives what says whether it is done, however it went."""


def execute(
    pool: Pool,
    width: int,
    jobs: Iterable[Job],
    report: Callable[[Outcome], None],
    interrupts: Interrupts,
    under_way: Callable[[int], None] = lambda runs: None,
) -> Ending:
    """Do jobs until all are done, the user interrupts, or the place gives trouble.

    A job whose worker died is set aside and its runs are tried again one at a time with nothing beside
    them, so that a run is condemned only by deaths that are its own.

    Parameters
    ----------
    pool : Pool
        The workers.
    width : int
        Jobs under way at once: as many as there are workers, so that none waits behind one that kills.
    jobs : iterable of Job
        Taken as workers become free.
    report : callable
        Told what became of every run.
    interrupts : Interrupts
        Whether the user asked to stop; looked at before every job.
    under_way : callable
        Told how many runs are with workers.

    Returns
    -------
    Ending
        How it ended; runs that are not reported are as pending as before.
    """
    suspects: list[Job] = []

    def condemned(found: Died) -> None:
        for outcome in condemn(found.job, STUCK if found.stuck else DEATH):
            report(outcome)

    flow = _Flow(pool, report, interrupts, under_way)
    flow.run(iter(jobs), width, lambda found: suspects.append(found.job))
    flow.run((replace(job, runs=(run,)) for job in suspects for run in job.runs), 1, condemned)
    return Ending(interrupts.asked, flow.trouble)


@dataclass
class _Flow:
    """Jobs on their way through the workers, never more of them than asked for."""

    pool: Pool
    report: Callable[[Outcome], None]
    interrupts: Interrupts
    under_way: Callable[[int], None]
    trouble: str = ""

    def run(self, jobs: Iterator[Job], width: int, died: Callable[[Died], None]) -> None:
        """Do jobs, ``width`` at a time; ``died`` takes those whose worker died."""
        runs = 0

        def submit() -> None:
            nonlocal runs
            if self.interrupts.asked or self.trouble:
                return
            for job in islice(jobs, 1):
                self.pool.submit(job)
                runs += len(job.runs)
            self.under_way(runs)

        for _ in range(width):
            submit()
        while (found := self.pool.next()) is not None:
            runs -= len(found.job.runs)
            if isinstance(found, Finished):
                for outcome in found.outcomes:
                    self.report(outcome)
            elif isinstance(found, Trouble):
                self.trouble = str(found)
            else:
                try:
                    died(found)
                except OSError as error:
                    self.trouble = f"{found.job.path}: {error}"
            submit()
