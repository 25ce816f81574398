"""A batch: jobs handed to worker processes through Dask, a few at a time, each forgotten when it ends."""

# distributed leaves most of its functions without types.
# mypy: disable-error-code="no-untyped-call"

from __future__ import annotations

import logging
import os
import signal
from collections.abc import Callable, Iterable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass, replace
from functools import cached_property, partial
from itertools import islice
from multiprocessing import resource_tracker
from typing import TYPE_CHECKING, Any

import dask
import numpy as np
from distributed import Client, Future, KilledWorker, LocalCluster, as_completed
from distributed.core import Status as NannyStatus
from numpy.typing import NDArray
from tornado.ioloop import PeriodicCallback

from pipeline import store
from pipeline.interrupts import Interrupts
from pipeline.limits import STUCK_TOPIC, Limits
from pipeline.place import WHOLE, Part
from pipeline.task import Job, Outcome, Solve, condemn, perform
from pipeline.template import variables
from pipeline.variables import Status
from solver.simulation import simulate

if TYPE_CHECKING:
    from pathlib import Path

    from pipeline.checkpoints import Checkpoints
    from pipeline.runs import Runs
    from pipeline.scenario import Scenario
    from pipeline.shared_points import SharedPoints

RENEWAL_SECONDS = 0.5
DEATH = "the worker process died of this run, twice"
STUCK = "more time than allowed, and the run did not stop: its worker process was ended, twice"

# allowed-failures counts deaths of a worker, retries would count exceptions; saturation 1 gives a worker no
# task beside the one it runs, which could be taken for the cause of its death. A cluster closes a worker it
# has not seen for the lost-worker time-out, also one that is just starting again; `_renew` knows better.
SETTINGS = {
    "distributed.scheduler.allowed-failures": 1,
    "distributed.scheduler.worker-saturation": 1.0,
    "distributed.deploy.lost-worker-timeout": "1 day",
    # paused, a worker would wait for ever for room that only a run beside it could free, and there is none
    "distributed.worker.memory.target": False,
    "distributed.worker.memory.spill": False,
    "distributed.worker.memory.pause": False,
    "distributed.worker.preload": ["pipeline.worker"],
    "distributed.nanny.pre-spawn-environ.NUMBA_NUM_THREADS": 1,
}


@dataclass
class Ending:
    """How a batch ended: whether the user stopped it, and what was wrong with the place."""

    interrupted: bool = False
    trouble: str = ""


@dataclass(frozen=True)
class Todo:
    """What is left to do in a store, by its status alone."""

    scenario: Scenario
    path: Path
    runs: Runs
    shared: SharedPoints | Path
    wanted: NDArray[np.bool_]
    limits: Limits
    checkpoints: Checkpoints | None
    part: Part = WHOLE

    @cached_property
    def group(self) -> int:
        """Runs per task."""
        return store.group(self.path)

    @property
    def starts(self) -> NDArray[np.int64]:
        """First run of every group of this part with something left, shape (jobs,)."""
        groups = np.unique(np.flatnonzero(self.wanted) // self.group)
        return np.array([group for group in groups if self.part.has(group)], np.int64) * self.group

    @property
    def runs_left(self) -> int:
        """Runs of this part that are left."""
        return sum(int(self.wanted[start : start + self.group].sum()) for start in self.starts)

    def jobs(self) -> Iterator[Job]:
        """Go through what is left, one job a group."""
        held = variables(self.scenario)
        for start in self.starts:
            stop = min(start + self.group, len(self.runs))
            chosen = tuple(self.runs[i] for i in range(start, stop) if self.wanted[i])
            yield Job(self.path, held, chosen, self.shared, self.limits, self.checkpoints)


def pending(path: Path, retry_failed: bool) -> NDArray[np.bool_]:
    """Say of every run of a store whether it is left to do, shape (runs,)."""
    return np.isin(store.statuses(path), [Status.PENDING, *([Status.FAILED] if retry_failed else [])])


@contextmanager
def workers(count: int) -> Iterator[Client]:
    """Start worker processes of one thread each, and end them; killed at once on a KeyboardInterrupt.

    A process that dies is started again by its nanny, or with a new one where the nanny gives up.

    Raises
    ------
    OSError
        If they do not start.
    """
    # for good: what is told of processes killed at once may come after the cluster is gone
    logging.getLogger("distributed").setLevel(logging.CRITICAL)
    with dask.config.set(SETTINGS), _cluster(count) as cluster, Client(cluster) as client:
        keeper = PeriodicCallback(partial(_renew, cluster, count), 1000 * RENEWAL_SECONDS)
        client.loop.add_callback(keeper.start)
        try:
            yield client
        except KeyboardInterrupt:
            for nanny in cluster.workers.values():
                nanny.auto_restart = False
                if nanny.pid is not None:
                    os.kill(nanny.pid, signal.SIGKILL)
            raise
        finally:
            client.loop.add_callback(keeper.stop)


def _renew(cluster: LocalCluster, count: int) -> None:
    """Replace nannies that have given up, as they do when a new process dies of a task at once."""
    for name, nanny in list(cluster.workers.items()):
        if nanny.status in (NannyStatus.failed, NannyStatus.closed):
            del cluster.workers[name]
    cluster.scale(count)


def _cluster(count: int) -> LocalCluster:
    """Start worker processes that are deaf to Ctrl-C.

    It reaches the whole process group, and the driver alone decides what stops. Threads and processes
    started here inherit its being blocked; an interrupt that comes meanwhile is heard afterwards.
    """
    # started with the first process it would unblock the signal
    resource_tracker.ensure_running()
    before = signal.pthread_sigmask(signal.SIG_BLOCK, {signal.SIGINT})
    try:
        return LocalCluster(
            n_workers=count,
            threads_per_worker=1,
            dashboard_address="127.0.0.1:0",
            silence_logs=logging.CRITICAL,
        )
    except RuntimeError as error:
        raise OSError(f"the worker processes do not start: {error.__cause__ or error}") from error
    finally:
        signal.pthread_sigmask(signal.SIG_SETMASK, before)


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
        for future in completed:
            job = under_way.pop(future.key)
            try:
                self._finish(job, future, died)
            except OSError as error:
                self.trouble = f"{job.path}: {error}"
            future.release()
            submit()

    def _finish(self, job: Job, future: Future[Any], died: Callable[[Job], None]) -> None:
        if future.status == "finished":
            for outcome in future.result():
                self.report(outcome)
            return
        if future.status in ("cancelled", "lost"):
            self.trouble = "the scheduler is gone"
            return
        error = future.exception()
        if isinstance(error, KilledWorker):
            died(job)
        else:
            self.trouble = f"{job.path}: {type(error).__name__}: {error}"
