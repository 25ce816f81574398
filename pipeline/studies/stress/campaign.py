"""The stress campaign: random scenes run, watched, repeated; what breaks a law shrunk to a scenario file."""

# distributed leaves most of its functions without types.
# mypy: disable-error-code="no-untyped-call"

from __future__ import annotations

import traceback
from collections.abc import Callable
from dataclasses import dataclass, field, replace
from pathlib import Path
from time import perf_counter

import numpy as np

from pipeline.studies.stress.repeats import repeat, steps_within
from pipeline.studies.stress.scenes import Drawn, can_be_run, prepared
from pipeline.studies.stress.shrink import shrink
from pipeline.studies.stress.watch import MOST_WORK, Watched, watch
from solver.checks.states import Check

# One scene in so many is repeated, by a draw of its own.
ONE_IN = 10
SAME = "one worker or many"
CRASH = "no error"


@dataclass
class Row:
    """One scene of a campaign.

    Parameters
    ----------
    watched : Watched, optional
        What became of it; None where it was refused, ``reason`` says why.
    repeats : list[Check]
        What came of repeating it.
    file : Path, optional
        Where a failing scene was written.
    """

    drawn: Drawn
    watched: Watched | None = None
    repeats: list[Check] = field(default_factory=list)
    reason: str = ""
    repeated: bool = False
    file: Path | None = None

    @property
    def conservative(self) -> bool:
        """Whether the scene is of the form that has to keep all laws."""
        return "scheme" not in self.drawn.data or self.drawn.data["scheme"].get("form") != "collocation"

    @property
    def broken(self) -> dict[str, str]:
        """Laws that were broken, with what was found."""
        found = {}
        if self.watched is not None:
            for law, (check, time) in self.watched.violations.items():
                found[law] = f"{check.value:.3g} where {check.limit:.3g} is allowed, at t = {time:.4g} s"
        for check in self.repeats:
            if not check.kept:
                found[check.law] = f"{check.value:.3g} where {check.limit:.3g} is allowed"
        if self.reason.startswith(CRASH):
            found[CRASH] = self.reason
        return found


def is_repeated(seed: int, number: int) -> bool:
    """Whether a scene is of the tenth that is repeated."""
    return bool(np.random.default_rng([seed, number, ONE_IN]).integers(ONE_IN) == 0)


def perform(drawn: Drawn, repeated: bool, most_work: float = MOST_WORK) -> Row:
    """Run one scene, watched, and repeat it if it is to be."""
    row = Row(drawn, repeated=repeated)
    try:
        ready = prepared(drawn)
    except ValueError as error:
        row.reason = str(error)
        return row
    try:
        row.watched = watch(ready.scene, float(ready.times[-1]), most_work)
        if repeated and row.conservative:
            most = steps_within(most_work, row.watched.steps, row.watched.work)
            row.repeats = repeat(drawn, ready, most)
    except Exception as error:
        where = traceback.extract_tb(error.__traceback__)[-1]
        row.reason = f"{CRASH}: {type(error).__name__} in {Path(where.filename).name}:{where.lineno}: {error}"
    return row


def ending(drawn: Drawn, time: float) -> Drawn:
    """Shorten a scene to a time, s."""
    return replace(drawn, data={**drawn.data, "time": {"end": time, "output_every": time}})


def shrunk(row: Row) -> Drawn:
    """Give the smallest scene found that breaks the first law that a row breaks."""
    if row.watched is None or not row.watched.violations:
        return row.drawn
    law, (check, time) = next(iter(row.watched.violations.items()))
    work = row.watched.work

    def fails(candidate: Drawn) -> bool:
        if not can_be_run(candidate):
            return False
        ready = prepared(candidate)
        found = watch(ready.scene, float(ready.times[-1]), work, stop_at_first=True)
        return law in found.violations

    smallest = shrink(row.drawn, fails)
    ready = prepared(smallest)
    found = watch(ready.scene, float(ready.times[-1]), work, stop_at_first=True)
    check, time = found.violations.get(law, (check, time))
    # beyond the step that breaks it; an end so near that it shortens that step may hide it
    ends = (ending(smallest, float(f"{times * time:.4g}")) for times in (1.1, 3.0, 10.0) if time > 0)
    smallest = next((short for short in ends if fails(short)), smallest)
    told = f"breaks the law: {law}; {check.value:.3g} where {check.limit:.3g} is allowed, at t = {time:.4g} s"
    return replace(smallest, data={"name": smallest.name, "description": told, **smallest.data})


def campaign(
    todo: list[tuple[Drawn, bool]], workers: int, tell: Callable[[str], None], most_work: float = MOST_WORK
) -> list[Row]:
    """Run scenes, and say of each that breaks a law which.

    Parameters
    ----------
    todo : list
        Scenes, and whether they are to be repeated.
    workers : int
        Processes.
    tell : callable
        Told what is found as it is found.
    most_work : float
        Cell-stages after which a scene ends.
    """
    from distributed import as_completed

    from pipeline.batch.local_workers import workers as started

    rows: dict[int, Row] = {}
    began = perf_counter()
    with started(workers) as client:
        from solver.warmup import compile_kernels, not_compiled

        # each worker compiles other kinds; what is on disk is loaded by the first scene that needs it
        client.gather([client.submit(compile_kernels, [kind], pure=False) for kind in not_compiled()])
        futures = {}
        waiting = iter(enumerate(todo))
        done = as_completed(loop=client.loop)

        def submit() -> None:
            for k, (drawn, repeated) in waiting:
                future = client.submit(perform, drawn, repeated, most_work, pure=False)
                futures[future] = k
                done.add(future)
                return

        for _ in range(2 * workers):
            submit()
        for future in done:
            k = futures.pop(future)
            drawn, repeated = todo[k]
            try:
                rows[k] = future.result()
            except Exception as error:
                rows[k] = Row(drawn, reason=f"{CRASH}: {type(error).__name__}: {error}", repeated=repeated)
            future.release()
            submit()
            row = rows[k]
            if row.conservative:
                for law, found in row.broken.items():
                    tell(f"{drawn.name}: {law}: {found}")
            if len(rows) % 50 == 0:
                tell(f"{len(rows)} scenes, {perf_counter() - began:.0f} s")
    return [rows[k] for k in range(len(todo))]


def same_with_any_workers(rows: list[Row], folder: Path, most: int = 2) -> None:
    """Run the repeated scenes by ``pipeline run`` with one worker and with several, and compare digests."""
    from rich.console import Console

    from pipeline.batch.driver import complete
    from pipeline.scenario.scenario import load
    from pipeline.store.place import held, store_path
    from pipeline.store.zarr_store import open_store

    ended = [
        (row, ending(row.drawn, row.watched.time))
        for row in rows
        if row.repeated and row.conservative and row.watched is not None
        if row.watched.time > 0 and not row.broken
    ]
    # one that ends before its hydrograph begins is no scenario
    ended = [(row, scene) for row, scene in ended if can_be_run(scene)]
    if not ended:
        return
    chosen = [row for row, _ in ended]
    scenarios = load(scene.write(folder / "repeated") for _, scene in ended)
    digests: list[list[str]] = []
    for count in (1, most):
        out = folder / f"workers-{count}"
        with held(out):
            complete(scenarios, out, Console(quiet=True), count=count, checkpoint_every=1e9)
        digests.append([])
        for scenario in scenarios:
            with open_store(store_path(out, scenario.name)) as store:
                digests[-1].append(str(store["digest"].to_numpy()[0]) + str(store["status"].to_numpy()[0]))
    for row, one, many in zip(chosen, *digests, strict=True):
        row.repeats.append(Check(SAME, float(one != many), 0.0))


def files(rows: list[Row], folder: Path, tell: Callable[[str], None]) -> list[Path]:
    """Shrink every failing scene of the conservative form, and write it."""
    written = []
    for row in rows:
        if row.conservative and row.broken:
            try:
                smallest = shrunk(row)
            except Exception as error:
                tell(f"{row.drawn.name}: not shrunk: {type(error).__name__}: {error}")
                smallest = row.drawn
            row.file = smallest.write(folder)
            written.append(row.file)
    return written
