"""One task: the runs of one group, computed one after another and written together."""

from __future__ import annotations

import warnings
from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import contextmanager
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np

from pipeline.batch.checkpoints import Checkpoints
from pipeline.batch.limits import UNLIMITED, Limits, freeze_loaded, keep_freed_memory
from pipeline.runs import ending, shared_points
from pipeline.runs.runs import Prepared, Run, build_scene
from pipeline.runs.shared_points import SharedPoints
from pipeline.runs.summary import summarise
from pipeline.runs.template import profile_values
from pipeline.store import zarr_store
from pipeline.store.variables import COMPUTED, FIELDS, TIMINGS, Status, Variable
from solver.checks.plausibility import doubts
from solver.simulation import OUT_OF_TIME, Failure, Result, simulate

Solve = Callable[..., Result]


@dataclass(frozen=True)
class Job:
    """Runs of one group of one store, which the task that takes it alone writes.

    shared : points of the runs, or the file of them. same : by index of a run, the store and index of another
    with the same physics.
    """

    path: Path
    variables: tuple[Variable, ...]
    runs: tuple[Run, ...]
    shared: SharedPoints | Path
    limits: Limits = UNLIMITED
    checkpoints: Checkpoints | None = None
    same: Mapping[int, tuple[Path, int]] = field(default_factory=dict)

    def name(self, run: Run) -> str:
        """Name of a run that no other store has."""
        return f"{self.path}:{run.index}"


@dataclass(frozen=True)
class Outcome:
    """What became of a run: store, index, status, why it failed or is no plain end, elapsed time, s."""

    path: Path
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
    # with the first job the kernels were loaded
    freeze_loaded()
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
    most = run.settings.time
    try:
        with job.limits.kept(most.max_wall, job.name(run)), warned() as told:
            prepared = build_scene(run, shared)
            result = solve(
                prepared.scene,
                prepared.times,
                arrival_depth=prepared.threshold,
                stop_at_rest=prepared.stop_at_rest,
                frames=run.settings.output.fields,
                max_steps=most.max_steps,
                max_wall=most.max_wall,
                keeper=None if job.checkpoints is None else job.checkpoints.of(run.index),
            )
            told += doubts(prepared.scene, result)
        return ending.status(result), _row(prepared, result, most.max_wall) | _warnings(told)
    except MemoryError as error:
        limit = job.limits.memory
        allowed = f"more memory than allowed: {limit:,} bytes" if limit else "out of memory"
        return Status.FAILED, {"failure_reason": f"{allowed}: {error}"}
    except Exception as error:
        return Status.FAILED, {"failure_reason": f"{type(error).__name__}: {error}"}


@contextmanager
def warned() -> Iterator[list[str]]:
    """Collect what NumPy and SciPy warn of, that nobody reads on the terminals of workers."""
    told: list[str] = []
    with warnings.catch_warnings(record=True) as caught:
        warnings.simplefilter("always", RuntimeWarning)
        yield told
    told += [str(each.message) for each in caught]


def _warnings(told: Sequence[str]) -> dict[str, Any]:
    return {"warnings": len(told), "warning": "; ".join(dict.fromkeys(told))}


def _told(failure: Failure, max_wall: float | None) -> str:
    """Reason, time and place of a failure in words."""
    reason = failure.reason + (f" ({max_wall:g} s)" if failure.reason == OUT_OF_TIME else "")
    place = "" if np.isnan(failure.x) else f", x = {failure.x:.6g} m, y = {failure.y:.6g} m"
    return f"{reason} at t = {failure.time:.6g} s{place}"


def _row(prepared: Prepared, result: Result, max_wall: float | None) -> dict[str, Any]:
    """Values of a run by name of variable; a failed one has no summaries."""
    profile = profile_values(prepared)
    # a group holds the rows of all its runs until they are written
    row: dict[str, Any] = {v.name: np.asarray(getattr(result, v.name), v.dtype) for v in FIELDS}
    row |= profile
    row |= {
        "volume_asked": prepared.volume_asked,
        "volume_released": result.ledger.released,
        "volume_lost": prepared.volume_lost,
        "volume_in": result.ledger.inflow,
        "volume_out": result.ledger.outflow,
        **ending.volumes(result),
        "volume_error": result.ledger.error,
        "steps": result.steps,
        "last_time": result.time,
        "rest_time": result.rest_time,
        "wall_time": result.wall_time,
        "cpu_time": result.cpu_time,
    }
    if result.failure is not None:
        return row | {
            "failure_reason": _told(result.failure, max_wall),
            "failure_time": result.failure.time,
            "failure_x": result.failure.x,
            "failure_y": result.failure.y,
        }
    return row | summarise(
        prepared.scene.points,
        profile["elevation"],
        profile["horizontal_distance"],
        prepared.scene.depth,
        result.deposit_depth,
        result.max_depth,
        result.max_speed,
        prepared.threshold,
    )
