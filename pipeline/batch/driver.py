"""Scenarios completed in a place: their stores checked or made, what is left done, the table written."""

from __future__ import annotations

from collections import Counter
from collections.abc import Callable, Collection, Container, Iterator, Sequence
from contextlib import AbstractContextManager, ExitStack, contextmanager
from dataclasses import dataclass, replace
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING

from rich.console import Console

from pipeline.batch.checkpoints import EVERY_SECONDS, Checkpoints
from pipeline.batch.compilation import compile_once, cores, head_start
from pipeline.batch.failures import AGAIN, Failed, failed, listed, told_again, unfinished, without_runout
from pipeline.batch.forked_pool import ForkedPool, can_fork, forked_pool
from pipeline.batch.interrupts import heard, uncut
from pipeline.batch.limits import UNLIMITED, Limits
from pipeline.batch.main_module import main_not_imported
from pipeline.batch.progress import Progress, shown, stages
from pipeline.batch.scheduling import Ending, Todo, execute, execute_here, pending
from pipeline.batch.task import Solve
from pipeline.errors import ChangedError as ChangedError
from pipeline.runs import profile_ends, surface_summary
from pipeline.runs.domain_search import on_known_domain, settled, settled_together
from pipeline.runs.duplicates import copies
from pipeline.runs.runs import Runs, expand, share
from pipeline.runs.scene_of_run import build_scene
from pipeline.runs.shared_points import SharedPoints, kept
from pipeline.runs.template import likely_seconds, shares, template
from pipeline.scenario.scenario import Scenario, said
from pipeline.store import changes, layout, provenance, zarr_store
from pipeline.store.place import LEVEL, WHOLE, Part, checkpoint_path, hidden, store_path, summary_path
from pipeline.store.storage import Location, is_made, storage_of
from pipeline.store.variables import Status
from solver.forms import Kind
from solver.points.lattice import Lattice
from solver.simulation import simulate
from solver.warmup import compile_kernels, not_compiled

if TYPE_CHECKING:
    import pandas as pd

    from pipeline.batch.dask_pool import DaskPool, Engine

# as many runs at most, or as much work by a rough estimate, s, are done without Dask, whose cluster takes
# longer to start than short runs last
FEW_RUNS = 16
LITTLE_WORK = 1000.0


@dataclass(frozen=True)
class Outcome:
    """What a place holds after a batch: the status of every run asked for, the table, how the batch ended."""

    ending: Ending
    statuses: Counter[Status]
    table: pd.DataFrame

    @property
    def exit_code(self) -> int:
        """0 all done, 1 some failed, 3 trouble of the place, 130 interrupted."""
        if self.ending.interrupted:
            return 130
        if self.ending.trouble:
            return 3
        return 1 if self.statuses[Status.FAILED] else 0


def complete(
    scenarios: Sequence[Scenario],
    out: Location,
    console: Console,
    *,
    count: int | None = None,
    overwrite: bool = False,
    retry_failed: bool = False,
    limits: Limits = UNLIMITED,
    checkpoint_every: float = EVERY_SECONDS,
    engine: Engine | None = None,
    part: Part = WHOLE,
    sweep: bool = True,
    log: Path | None = None,
    solve: Solve = simulate,
) -> Outcome:
    """Do what is left of scenarios in a place the caller holds, and write its table.

    Parameters
    ----------
    scenarios : sequence of Scenario
        With names of their own.
    out : Location
        The place; workers elsewhere see it under the same name.
    console : Console
        Where progress is shown.
    count : int, optional
        Worker processes at most; by default one for every core this process may use.
    overwrite, retry_failed : bool
        Replace stores that something else was made from or by; do failed runs again.
    limits : Limits
        Of every run.
    checkpoint_every : float
        Elapsed time of a run between two checkpoints, s.
    engine : callable, optional
        Gives a client of other workers than local ones, in a ``with``.
    part : Part
        What to do of the runs; a part is done in this process.
    sweep : bool
        Whether to remove what killed writers left: nobody else may be writing.
    log : Path, optional
        File that gets a line a run, by default one of the place, at a URL none: nothing is appended to there.
    solve : callable
        The solver.

    Raises
    ------
    ChangedError
        If a store was made from a changed scenario, or by another solver, and is not to be overwritten;
        nothing is done then.
    BadInput
        If points are not fit; nothing is written then.
    OSError
        If a store cannot be made or read.
    """
    out = storage_of(out).absolute()
    log = log or storage_of(out).log()
    read = scenarios
    scenarios = [on_known_domain(scenario, store_path(out, scenario.name)) for scenario in read]
    replaced = changed(scenarios, out)
    if replaced and not overwrite:
        raise ChangedError("\n".join(line for lines in replaced.values() for line in lines))
    # of those the domain is found anew
    scenarios = [old if old.name in replaced else new for old, new in zip(read, scenarios, strict=True)]
    if sweep:
        storage_of(out).sweep()
    if part == WHOLE:
        for scenario in scenarios:
            path = store_path(out, scenario.name)
            if is_made(path) and scenario.name not in replaced:
                layout.restate(path, said(scenario), shares(scenario))
    left: list[Todo] = []
    kinds: set[Kind] = set()
    with ExitStack() as stack:
        try:
            with stages(console, "prepare"):
                made = _shared(scenarios, out, replaced, retry_failed, console, count)
        except KeyboardInterrupt:
            console.print("interrupted while preparing: no run has begun", highlight=False)
            raise
        for scenario, runs, shared in made:
            kinds |= shared.kinds
            path = store_path(out, scenario.name)
            folder = checkpoint_path(out, scenario.name)
            checkpoints = Checkpoints(folder, provenance.identity(scenario.digest), checkpoint_every)
            if scenario.name in replaced or not is_made(path):
                checkpoints.clear()
                layout.create(path, template(scenario, runs, shared), replace=scenario.name in replaced)
            elif part == WHOLE:
                layout.add_summaries(path)
            carried: SharedPoints | Location = shared
            if part == WHOLE:
                carried = stack.enter_context(kept(shared, out / f".{hidden(scenario.name)}.points.partial"))
            wanted = pending(path, retry_failed)
            left.append(Todo(scenario, path, runs, carried, wanted, limits, checkpoints, part))
        work = partial(_work, left, [shared for _, _, shared in made])
        left = _sharing(left, scenarios, out)
        earlier = [each for scenario in scenarios for each in failed(out, scenario.name)]
        ending = _execute(left, kinds, console, count, engine, part, log, solve, work)
    _tell_earlier([] if retry_failed else earlier, left, console)
    from pipeline.store import run_table

    whole = run_table.read(out)
    try:
        run_table.write(whole, summary_path(out))
    except OSError as error:
        ending.trouble = ending.trouble or str(error)
    for name, rows in whole.groupby("scenario", sort=False):
        told = rows["warning"]
        if note := profile_ends.note(profile_ends.count(told)) + surface_summary.note(told):
            console.print(f"{name}: {len(rows):,} run{'s' * (len(rows) > 1)}{note}", highlight=False)
    counts: Counter[Status] = Counter()
    for scenario in scenarios:
        found = Counter(map(Status, zarr_store.statuses(store_path(out, scenario.name)).tolist()))
        rows = whole[whole["scenario"] == scenario.name]
        for line in (*unfinished(scenario, found), *without_runout(scenario, rows)):
            console.print(line, highlight=False, soft_wrap=True)
        counts += found
    return Outcome(ending, counts, whole)


def _work(left: Sequence[Todo], shared: Sequence[SharedPoints]) -> float:
    """Rough processor time of what is left, s; runs are like the first of their scenario."""
    return sum(
        each.runs_left * likely_seconds(build_scene(each.runs[0], points))
        for each, points in zip(left, shared, strict=True)
    )


def _sharing(left: Sequence[Todo], scenarios: Sequence[Scenario], out: Location) -> list[Todo]:
    """Tell what is left of the runs that others have the physics of, finished ones first."""
    names = {each.scenario.name for each in left}
    finished = [
        settled(scenario, store_path(out, scenario.name), lambda line: None)
        for scenario in scenarios
        if scenario.name not in names
    ]
    same = copies([*finished, *(each.scenario for each in left)], out) if left else {}
    return [replace(each, same=same.get(each.path, {})) for each in left]


def _shared(
    scenarios: Sequence[Scenario],
    out: Location,
    replaced: Container[str],
    retry_failed: bool,
    console: Console,
    count: int | None,
) -> list[tuple[Scenario, Runs, SharedPoints]]:
    """Make the points of scenarios that have something left to do, before anything is written."""
    made = []
    open_ones: list[tuple[Scenario, Location | None]] = []
    for scenario in scenarios:
        path = store_path(out, scenario.name)
        if scenario.name in replaced or not is_made(path) or pending(path, retry_failed).any():
            open_ones.append((scenario, None if scenario.name in replaced else path))
    searched = any(scenario.settings.domain is None for scenario, _ in open_ones)
    threads = (count or cores()) if searched else 1
    for scenario in settled_together(open_ones, partial(console.print, highlight=False), threads):
        runs = expand(scenario)
        # all runs have one scheme, unless it is swept
        swept = any(key.startswith("scheme.") for key in scenario.settings.varied)
        shared = share(scenario, runs if swept else runs[:1])
        if not isinstance(shared.points, Lattice):
            console.print(f"{scenario.name}: {len(shared.points):,} points", highlight=False)
        made.append((scenario, runs, shared))
    return made


def changed(scenarios: Sequence[Scenario], out: Location) -> dict[str, list[str]]:
    """Say by name of scenario what changed since its store was made; without those that did not change."""
    found: dict[str, list[str]] = {}
    for scenario in scenarios:
        path = store_path(out, scenario.name)
        if not is_made(path):
            continue
        before = zarr_store.attributes(path)
        if "scenario_content" not in before:
            raise FileExistsError(f"{path} is not a store of scenarios; move it away")
        lines: list[str] = []
        if before["scenario_hash"] != scenario.digest:
            differing = changes.differences(str(before["scenario_content"]), scenario.content)
            lines += [f"{path}: made from a changed scenario: {line}" for line in differing]
        lines += [f"{path}: made by something else: {line}" for line in provenance.differences(before)]
        if lines:
            found[scenario.name] = lines
    for scenario in scenarios:
        # a store that is replaced takes those of its levels with it
        if scenario.name.partition(LEVEL)[0] in found:
            found.setdefault(scenario.name, [])
    return found


def _tell_earlier(earlier: Sequence[Failed], left: Sequence[Todo], console: Console) -> None:
    """Tell of runs that failed in an earlier batch and were left alone, and where nothing was left at all."""
    tell = partial(console.print, markup=False, highlight=False, soft_wrap=True)
    if not any(each.runs_left for each in left):
        tell("nothing was left to do")
    if earlier:
        tell("runs that failed earlier and were left as they are:")
    for line in told_again(earlier):
        tell(line)


@contextmanager
def _reported(console: Console, total: int, log: Path | None, left: Sequence[Todo]) -> Iterator[Progress]:
    """Show progress while a batch lasts, and list the runs that failed once it is over."""
    with shown(console, total, log) as progress:
        yield progress
    for line in listed([each.scenario for each in left], progress.failures):
        progress.tell(line)
    if progress.failures:
        progress.tell(f"{len(progress.failures)} failed; {AGAIN}")


def _pool(
    few: bool, width: int, engine: Engine | None, solve: Solve
) -> AbstractContextManager[ForkedPool | DaskPool]:
    """Give the workers of a batch, to be started and ended in a ``with``."""
    if few:
        return forked_pool(width, solve)
    # takes half a second to load
    with uncut():
        from pipeline.batch.dask_pool import dask_pool

    return dask_pool(width, engine, solve)


def _execute(
    left: Sequence[Todo],
    kinds: Collection[Kind],
    console: Console,
    count: int | None,
    engine: Engine | None,
    part: Part,
    log: Path | None,
    solve: Solve,
    work: Callable[[], float],
) -> Ending:
    total = sum(each.runs_left for each in left)
    if not total:
        return Ending()
    groups = sum(len(each.starts) for each in left)
    width = min(count or cores(), groups) if groups > 1 else 1
    # what can be copied from others comes when these are done
    jobs = (job for again in (False, True) for each in left for job in each.jobs(again=again))
    try:
        with _reported(console, total, log, left) as progress, heard(progress.tell) as interrupts:
            if part != WHOLE:
                return execute_here(jobs, progress.report, interrupts, solve)
            few = engine is None and can_fork() and (total <= FEW_RUNS or work() <= LITTLE_WORK)
            # workers elsewhere have a disk of their own
            ahead = head_start(() if engine else kinds)
            with main_not_imported(), ahead as processes, _pool(few, width, engine, solve) as pool:
                progress.tell(str(pool))
                # what is compiled a process loads with its first run
                if not few or not_compiled(kinds):
                    rest = partial(compile_kernels, sorted(kinds))
                    compile_once(pool.start, progress.tell, interrupts, rest, processes)
                return execute(pool, pool.width, jobs, progress.report, interrupts, progress.under_way)
    except KeyboardInterrupt:
        return Ending(interrupted=True)
