"""One task: the runs of one group, computed one after another and written together."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from typing import Any

import numpy as np

from pipeline.batch.checkpoints import Checkpoints
from pipeline.batch.limits import UNLIMITED, Limits, freeze_loaded, keep_freed_memory
from pipeline.runs import ending, shared_points
from pipeline.runs.run import Run
from pipeline.runs.scene_of_run import compute
from pipeline.runs.shared_points import SharedPoints
from pipeline.runs.stored_values import implausible, stored, warned
from pipeline.store import zarr_store
from pipeline.store.storage import Location
from pipeline.store.variables import COMPUTED, TIMINGS, Status, Variable
from solver.result import Result
from solver.simulation import simulate

Solve = Callable[..., Result]


@dataclass(frozen=True)
class Job:
    """Runs of one group of one store, which the task that takes it alone writes.

    Parameters
    ----------
    shared : SharedPoints or Location
        Points of the runs, or the file of them.
    same : Mapping[int, tuple[Location, int]]
        By index of a run, the store and index of another with the same physics.
    """

    path: Location
    variables: tuple[Variable, ...]
    runs: tuple[Run, ...]
    shared: SharedPoints | Location
    limits: Limits = UNLIMITED
    checkpoints: Checkpoints | None = None
    same: Mapping[int, tuple[Location, int]] = field(default_factory=dict)

    def name(self, run: Run) -> str:
        """Name of a run that no other store has."""
        return f"{self.path}:{run.index}"


@dataclass(frozen=True)
class Outcome:
    """What became of a run: store, index, status, why it failed or is no plain end, elapsed time, s."""

    path: Location
    run: int
    status: Status
    reason: str = ""
    elapsed: float = float("nan")


class Outcomes(tuple[Outcome, ...]):
    """What became of the runs of a job; Dask would send each item of a plain tuple or list by itself."""


def perform(job: Job, solve: Solve = simulate) -> Outcomes:
    """Compute a job's runs and write them; what an earlier attempt finished is left alone.

    Parameters
    ----------
    job : Job
        The runs, and where they go.
    solve : callable
        The solver, called as ``solver.simulation.simulate``.

    Raises
    ------
    OSError
        If the store cannot be read or written. What goes wrong inside a run is an outcome, not an error.
    """
    keep_freed_memory()
    freeze_loaded()
    first = job.runs[0].index
    states = zarr_store.statuses(job.path, slice(first, job.runs[-1].index + 1))
    finished = {run.index: Status(states[run.index - first]) for run in job.runs}
    finished = {run: status for run, status in finished.items() if status in COMPUTED}
    runs = [run for run in job.runs if run.index not in finished]
    shared = shared_points.load(job.shared)
    rows: dict[int, dict[str, Any]] = {}
    outcomes = [
        _outcome(job, run, status, zarr_store.row(job.path, job.variables, run))
        for run, status in finished.items()
    ]
    for run in runs:
        status, rows[run.index] = _copied(job, run) or _compute(job, run, shared, solve)
        outcomes.append(_outcome(job, run.index, status, rows[run.index]))
    if rows:
        zarr_store.write(job.path, job.variables, rows, {o.run: o.status for o in outcomes if o.run in rows})
        if job.checkpoints is not None:
            for index in rows:
                job.checkpoints.of(index).remove()
    return Outcomes(outcomes)


def _copied(job: Job, run: Run) -> tuple[Status, dict[str, Any]] | None:
    """Status and values of a run whose physics another one has that is finished; it costs no time."""
    if run.index not in job.same:
        return None
    path, index = job.same[run.index]
    status = Status(zarr_store.statuses(path, slice(index, index + 1))[0])
    if status not in COMPUTED:
        return None
    return status, zarr_store.row(path, job.variables, index) | dict.fromkeys(TIMINGS, 0.0)


def _outcome(job: Job, run: int, status: Status, row: Mapping[str, Any]) -> Outcome:
    """Tell what became of a run by its values."""
    return Outcome(job.path, run, status, ending.reason(status, row), float(row.get("wall_time", np.nan)))


def condemn(job: Job, reason: str) -> list[Outcome]:
    """Mark a job's runs as failed in place of the process that died of them."""
    rows = {run.index: {"failure_reason": reason} for run in job.runs}
    zarr_store.write(job.path, job.variables, rows, dict.fromkeys(rows, Status.FAILED))
    return [Outcome(job.path, run, Status.FAILED, reason) for run in rows]


def _compute(job: Job, run: Run, shared: SharedPoints, solve: Solve) -> tuple[Status, dict[str, Any]]:
    """Status and values of one run."""
    most = run.settings.time.max_wall
    keeper = None if job.checkpoints is None else job.checkpoints.of(run.index)
    try:
        with job.limits.kept(most, job.name(run)), warned() as told:
            prepared, result = compute(run, shared, keeper=keeper, solve=solve)
            told += implausible(prepared, result)
        return stored(prepared, result, told, most)
    except MemoryError as error:
        limit = job.limits.memory
        allowed = f"more memory than allowed: {limit:,} bytes" if limit else "out of memory"
        return Status.FAILED, {"failure_reason": f"{allowed}: {error}"}
    except Exception as error:
        return Status.FAILED, {"failure_reason": f"{type(error).__name__}: {error}"}
