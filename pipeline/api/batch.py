"""Read scenarios and do their runs."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from os import PathLike
from pathlib import Path
from typing import TYPE_CHECKING, Any

from pipeline.api.options import Tell, size_in_bytes, warn_user
from pipeline.api.places import find_place
from pipeline.errors import OptionError

if TYPE_CHECKING:
    from pipeline.api.places import Anywhere
    from pipeline.batch.dask_pool import Engine
    from pipeline.results import Results
    from pipeline.scenario.scenario import Scenario
    from pipeline.store.place import Part
    from pipeline.store.storage import Location

Source = str | PathLike[str] | Mapping[str, Any]
Sources = Source | Iterable[Source]

# characters in a line where the output is no terminal
PLAIN_WIDTH = 160


def load(files: Sources) -> list[Scenario]:
    """Read and check scenarios.

    Parameters
    ----------
    files : path, mapping, or iterable of these
        Scenario files, or the content of one as nested mappings and lists. Files that a mapping names are
        looked for in the working directory.

    Returns
    -------
    list of Scenario
        In the order given; what each warns of is in its ``warnings``.

    Raises
    ------
    BadInput
        With every mistake of every file, a line each.
    """
    from pipeline.scenario.scenario import load as read

    one = isinstance(files, str | PathLike | Mapping)
    sources: list[Source] = [files] if one else list(files)  # type: ignore[list-item, arg-type]
    return read(dict(s) if isinstance(s, Mapping) else Path(s) for s in sources)


def run(
    files: Sources,
    out: Anywhere = "results",
    *,
    workers: int | None = None,
    overwrite: bool = False,
    retry_failed: bool = False,
    memory_limit: str | int | None = None,
    checkpoint_every: float = 60.0,
    scheduler: str | None = None,
    jobqueue: str | None = None,
    part: str | None = None,
    next: int | None = None,
    for_: str | None = None,
    log: str | PathLike[str] | None = None,
    quiet: bool = False,
    warn: Tell = warn_user,
    check: bool = True,
) -> Results:
    """Do what is left of the runs of scenarios, and give their results.

    Finished runs are not done again. Worker processes do not import the calling script, so that it needs no
    ``if __name__ == "__main__"``.

    Parameters
    ----------
    files : path, mapping, or iterable of these
        Scenarios, as `load` takes them.
    out : path or str
        Folder or URL for the results; made where it is missing.
    workers : int, optional
        Worker processes; by default one per core.
    overwrite : bool
        Replace the stores of scenarios that have changed since.
    retry_failed : bool
        Do failed runs again.
    memory_limit : str or int, optional
        Memory that a run may take, as ``"2GB"`` or in bytes; by default there is no limit.
    checkpoint_every : float
        Time between two checkpoints of a run, s.
    scheduler : str, optional
        Address of a running Dask cluster that does the runs, ``tcp://host:port``.
    jobqueue : str, optional
        Queueing system that starts the workers as jobs: ``slurm``.
    part : str, optional
        Do one of N parts of the runs, in this process: ``"2/8"``.
    next : int, optional
        Choose and do so many further runs of a sampled scenario, where the probability that ``for_`` names is
        least certain. They are in no share; `emulate` learns from them. Where some that were chosen for it
        are not done yet, these are done in their place.
    for_ : str, optional
        Receptor, quantity and threshold: ``"school: depth > 1.2"``.
    log : path, optional
        File that gets a line per run; by default ``runs.log`` in ``out``, at a URL none.
    quiet : bool
        Show no progress.
    warn : callable
        Told what the scenarios warn of, a line each; by default `warnings.warn`.
    check : bool
        Raise if the batch was interrupted or the place gave trouble. Without it the results say so.

    Returns
    -------
    Results
        The dataset of each scenario by name, opened lazily, with the table of runs. Runs that failed are in
        the table, with their reason; they raise nothing.

    Raises
    ------
    BadInput
        If there are mistakes in the scenarios, with all of them; nothing is written then.
    ChangedError
        If a store was made from a changed scenario, or by another solver, and ``overwrite`` is not given.
    PlaceInUseError
        If another process writes to the place.
    EngineError
        If the workers of ``scheduler`` or ``jobqueue`` cannot be reached.
    OptionError
        If an option has a value that it cannot have.
    OSError
        If the place cannot be written; runs that were not stored stay pending.
    KeyboardInterrupt
        If the user interrupted; the next call goes on from there.
    """
    scenarios = load(files)
    for line in (line for scenario in scenarios for line in scenario.warnings):
        warn(line)
    from functools import partial

    from rich.console import Console

    from pipeline.batch.driver import changed, complete
    from pipeline.batch.limits import Limits
    from pipeline.emulation.chosen import chosen_before
    from pipeline.results import Results
    from pipeline.runs.domain_search import on_known_domain
    from pipeline.store.place import WHOLE, held, held_in_part, store_path
    from pipeline.store.provenance import identity

    if workers is not None and workers < 1:
        raise OptionError("workers", f"expected at least 1, found {workers}")
    place, mine = find_place(out), _part(part, overwrite)
    choice = None
    if next is not None or for_ is not None:
        # takes as long to load as a short run lasts
        from pipeline.api import next_runs

        choice = next_runs.asked(scenarios, place, next, for_)
    if choice is not None and mine != WHOLE:
        raise OptionError("next", "expected without --part")
    engine, limits = _engine(scheduler, jobqueue, part, workers), Limits(size_in_bytes(memory_limit))
    console = Console(quiet=quiet)
    console = console if console.is_terminal else Console(quiet=quiet, width=PLAIN_WIDTH)
    asked = identity("".join(scenario.digest for scenario in scenarios))
    with held(place) if mine == WHOLE else held_in_part(place, mine, asked) as alone:
        do = partial(
            complete,
            out=place,
            console=console,
            count=workers,
            overwrite=overwrite,
            retry_failed=retry_failed,
            limits=limits,
            checkpoint_every=checkpoint_every,
            engine=engine,
            part=mine,
            sweep=alone is not False,
            log=None if log is None else Path(log),
        )
        # a store that is replaced takes its chosen runs with it
        replaced = (
            changed([on_known_domain(each, store_path(place, each.name)) for each in scenarios], place)
            if overwrite
            else {}
        )
        before = chosen_before([each for each in scenarios if each.name not in replaced], place)
        scenarios += before
        going_on = choice is not None and choice.going_on(before)
        quietly = choice is not None and not _anything_left(scenarios, place, retry_failed)
        ending = do(scenarios, console=Console(quiet=True) if quietly else console).ending
        if choice is not None and not (ending.interrupted or ending.trouble):
            tell = partial(console.print, markup=False, highlight=False, soft_wrap=True)
            if not going_on:
                scenarios.append(choice.scenario(tell))
                ending = do(scenarios[-1:]).ending
            tell(choice.told())
    if check and ending.interrupted:
        raise KeyboardInterrupt
    if check and ending.trouble:
        raise OSError(ending.trouble)
    names = [scenario.name for scenario in scenarios]
    return Results(place, names, interrupted=ending.interrupted, trouble=ending.trouble)


def _anything_left(scenarios: Iterable[Scenario], out: Location, retry_failed: bool) -> bool:
    from pipeline.batch.scheduling import pending
    from pipeline.store.place import store_path
    from pipeline.store.storage import is_made

    paths = [store_path(out, scenario.name) for scenario in scenarios]
    return any(not is_made(path) or pending(path, retry_failed).any() for path in paths)


def _part(text: str | None, overwrite: bool) -> Part:
    """Read a part as ``2/8``; the whole where nothing is given."""
    from pipeline.store.place import WHOLE, Part

    if text is None:
        return WHOLE
    index, _, count = text.partition("/")
    if not (index.isdecimal() and count.isdecimal() and 1 <= int(index) <= int(count)):
        raise OptionError("part", f"expected a part as 1/8 to 8/8, found '{text}'")
    if overwrite:
        found = "expected without --part, as each part would replace the store of the others"
        raise OptionError("overwrite", found)
    return Part(int(index), int(count))


def _engine(
    scheduler: str | None, jobqueue: str | None, part: str | None, workers: int | None
) -> Engine | None:
    """Choose the workers; None for those of this machine."""
    from functools import partial

    given = {"--scheduler": scheduler, "--jobqueue": jobqueue, "--part": part}
    several = [option for option, value in given.items() if value is not None]
    if len(several) > 1:
        raise OptionError(" and ".join(several), "expected one of them at most")
    if jobqueue not in (None, "slurm"):
        raise OptionError("jobqueue", f"expected slurm, found '{jobqueue}'")
    if scheduler is None and jobqueue is None:
        return None
    from pipeline.batch.remote_workers import joined, queued

    if scheduler is None:
        return partial(queued, "slurm", workers or 1)
    if "://" not in scheduler:
        raise OptionError("scheduler", f"expected an address as tcp://host:8786, found '{scheduler}'")
    return partial(joined, scheduler)
