"""The functions that scripts, notebooks and the command line call.

Modules that take long to import (Numba, xarray, Dask) are imported inside the functions that need them.
"""

from __future__ import annotations

import warnings
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from contextlib import contextmanager
from os import PathLike
from pathlib import Path
from typing import TYPE_CHECKING, Any

from pipeline.errors import MissingExtraError, OptionError

if TYPE_CHECKING:
    import pandas as pd
    import xarray as xr

    from pipeline.batch.dask_pool import Engine
    from pipeline.emulation.emulate import Emulated
    from pipeline.results import Results
    from pipeline.scenario.scenario import Scenario
    from pipeline.store.place import Part
    from pipeline.store.storage import Location

    Anywhere = str | PathLike[str] | Location
    Place = Anywhere | Results

Source = str | PathLike[str] | Mapping[str, Any]
Sources = Source | Iterable[Source]
Tell = Callable[[str], None]

# characters in a line where the output is no terminal
PLAIN_WIDTH = 160
# a limit below is one whose unit was forgotten
LEAST_MEMORY = 2**20
# of an emulator, below which shares have errors of their own
LEAST_DRAWS = 256
POSTERIOR_DRAWS = 2**16
TABLE_FILES = (".csv", ".parquet", ".md")


def _silent(line: str) -> None:
    """Take a line that nobody reads."""


def _warn(line: str) -> None:
    warnings.warn(line, stacklevel=3)


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
    log: str | PathLike[str] | None = None,
    quiet: bool = False,
    warn: Tell = _warn,
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
    from rich.console import Console

    from pipeline.batch.driver import complete
    from pipeline.batch.limits import Limits
    from pipeline.results import Results
    from pipeline.store.place import WHOLE, held, held_in_part
    from pipeline.store.provenance import identity

    if workers is not None and workers < 1:
        raise OptionError("workers", f"expected at least 1, found {workers}")
    place, mine = find_place(out), _part(part, overwrite)
    engine, limits = _engine(scheduler, jobqueue, part, workers), Limits(_bytes(memory_limit))
    console = Console(quiet=quiet)
    asked = identity("".join(scenario.digest for scenario in scenarios))
    with held(place) if mine == WHOLE else held_in_part(place, mine, asked) as alone:
        outcome = complete(
            scenarios,
            place,
            console if console.is_terminal else Console(quiet=quiet, width=PLAIN_WIDTH),
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
    ending = outcome.ending
    if check and ending.interrupted:
        raise KeyboardInterrupt
    if check and ending.trouble:
        raise OSError(ending.trouble)
    names = [scenario.name for scenario in scenarios]
    return Results(place, names, interrupted=ending.interrupted, trouble=ending.trouble)


def open(path: str | PathLike[str]) -> xr.Dataset | Results:
    """Open a store, or all stores of a place.

    Parameters
    ----------
    path : path or str
        Store of a scenario, ``<out>/<name>.zarr``, or the place ``<out>``; a folder or a URL.

    Returns
    -------
    Dataset or Results
        The store as an `xarray.Dataset`, its values read when they are used; of a place the datasets by name
        of scenario, with the table of runs.

    Raises
    ------
    FileNotFoundError
        If there is neither.
    """
    from pipeline.results import Results, open_lazily

    found = _located(path)
    return open_lazily(find_store(found)) if found.suffix == ".zarr" else Results(find_place(found))


def to_lattice(store: xr.Dataset, spacing: float | None = None) -> xr.Dataset:
    """Evaluate the fields of a cloud's store at the points of a lattice, by LMLS, with the volume kept.

    Parameters
    ----------
    store : Dataset
        Store of a scenario on a cloud of points; that of a lattice is given back as it is.
    spacing : float, optional
        Of the lattice, m; by default the mean spacing of the cloud.

    Returns
    -------
    Dataset
        With the dimensions ``y`` and ``x`` in place of ``point``.
    """
    from pipeline.assess.frames import mean_spacing
    from pipeline.assess.gridding import gridded

    if "point" not in store.dims and spacing is None:
        return store
    return gridded(store, mean_spacing(store) if spacing is None else spacing)


def run_table(out: Place, *, to: Anywhere | None = None) -> pd.DataFrame:
    """Read the table of a place: a row per run.

    Parameters
    ----------
    out : path, str or Results
        The place.
    to : path, optional
        File that it is written to, ``.csv``, ``.parquet`` or ``.md``; by default nothing is written.

    Returns
    -------
    DataFrame
        Scenario, run, status, the varied parameters and every summary; failed and pending runs included.

    Raises
    ------
    FileNotFoundError
        If the place holds no store.
    OptionError
        If the file ends otherwise.
    """
    from pipeline.store import run_table as table

    if to is not None and Path(str(to)).suffix not in TABLE_FILES:
        raise OptionError("to", f"expected a file ending in {', '.join(TABLE_FILES)}, found '{to}'")
    found = table.read(_place(out))
    if to is not None:
        with _extra("parquet"):
            table.write(found, _writable(to))
    return found


def hazard_maps(
    out: Place,
    *,
    to: str | PathLike[str] | None = None,
    depth: Sequence[float] | None = None,
    speed: Sequence[float] | None = None,
    momentum_flux: Sequence[float] | None = None,
    pressure: Sequence[float] | None = None,
    erosion_depth: Sequence[float] | None = None,
    spacing: float | None = None,
    pictures: bool = True,
    emulate: bool = False,
    tell: Tell = _silent,
    warn: Tell = _warn,
) -> dict[str, xr.Dataset]:
    """Map the hazard of each scenario of a place, and of all together.

    Parameters
    ----------
    out : path, str or Results
        The place.
    to : path, optional
        Folder that the maps are written to: NetCDF and PNG, on the ground also GeoTIFF, GeoPackage, a project
        of QGIS and a STAC item.
        By default nothing is written.
    depth, speed, momentum_flux, pressure, erosion_depth : sequence of float, optional
        Thresholds (m, m s-1, m3 s-2, kPa, m) in place of those of the scenarios.
    spacing : float, optional
        Of the lattice that clouds are brought to, m; by default their mean spacing.
    pictures : bool
        Whether to draw the maps, where ``to`` is given.
    emulate : bool
        Whether to add emulated maps of sampled scenarios, see `emulate`, each with its error.
    tell, warn : callable
        Told what was made and written, and what could not be, a line each.

    Returns
    -------
    dict of str to Dataset
        Maps by name of scenario, those over all under ``"all scenarios"``; without these where the scenarios
        cannot be laid over each other, which is warned of. Emulated ones are under ``"<name>, emulated"``.

    Raises
    ------
    FileNotFoundError
        If the place holds no store.
    OptionError
        If a threshold or the spacing is not above 0.
    OSError
        If something cannot be written.
    """
    from pipeline.assess.ensemble import NotTogetherError
    from pipeline.hazard.map_files import Written, write_maps, write_place
    from pipeline.hazard.mapping import WHOLE, of_place, write

    given = {
        "depth": depth,
        "speed": speed,
        "momentum_flux": momentum_flux,
        "pressure": pressure,
        "erosion_depth": erosion_depth,
    }
    thresholds = {name: _positive(name, values) for name, values in given.items() if values is not None}
    if spacing is not None:
        _positive("spacing", [spacing])
    made: dict[str, xr.Dataset] = {}
    written: list[Written] = []
    place = _place(out)
    try:
        for name, found in of_place(place, thresholds, spacing):
            made[name] = found
            tell(f"{name}: {found.attrs['comment']}")
            if to is not None:
                folder = Path(to) if name == WHOLE else Path(to) / name
                tell(str(write(found, folder)))
                if pictures:
                    written.append(write_maps(found, folder))
                    for path in written[-1].paths:
                        tell(str(path))
    except NotTogetherError as error:
        warn(f"no map over all scenarios: {error}")
    for name, each in _emulated(out, thresholds, warn) if emulate else ():
        if each.maps is not None:
            made[f"{name}, emulated"] = each.maps
            tell(each.comment)
        if to is not None:
            _write_emulated(each, Path(to) / name / "emulated", pictures, tell)
    if to is not None:
        for path in write_place(written, Path(to), place.resolve().name):
            tell(str(path))
    return made


def compare(
    out: Place,
    scenarios: tuple[str, str],
    other: Place | None = None,
    *,
    to: str | PathLike[str] | None = None,
    depth: Sequence[float] | None = None,
    speed: Sequence[float] | None = None,
    momentum_flux: Sequence[float] | None = None,
    pressure: Sequence[float] | None = None,
    spacing: float | None = None,
    pictures: bool = True,
    tell: Tell = _silent,
) -> tuple[xr.Dataset, pd.DataFrame]:
    """Map and table how a second scenario differs from a first one, as with a dam and without it.

    Parameters
    ----------
    out : path, str or Results
        The place of the first scenario, and of the second where no other is given.
    scenarios : tuple of str
        Names of the first and of the second scenario.
    other : path, str or Results, optional
        The place of the second scenario.
    to : path, optional
        Folder that maps and table are written to: NetCDF, PNG and CSV. By default nothing is written.
    depth, speed, momentum_flux, pressure : sequence of float, optional
        Thresholds (m, m s-1, m3 s-2, kPa) in place of those of the scenarios.
    spacing : float, optional
        Of the lattice that clouds are brought to, m, which they need.
    pictures : bool
        Whether to draw the maps, where ``to`` is given.
    tell : callable
        Told what was made and written, a line each.

    Returns
    -------
    Dataset, DataFrame
        Maps of the second less the first, and a row a receptor and quantity; with bounds.

    Raises
    ------
    FileNotFoundError
        If there is no such scenario.
    ValueError
        If the scenarios do not have the same cells, thresholds and events.
    OptionError
        If a threshold or the spacing is not above 0.
    OSError
        If something cannot be written.
    """
    from pipeline.hazard import differences
    from pipeline.hazard.map_files import draw_differences
    from pipeline.hazard.mapping import write

    given = {"depth": depth, "speed": speed, "momentum_flux": momentum_flux, "pressure": pressure}
    thresholds = {name: _positive(name, values) for name, values in given.items() if values is not None}
    if spacing is not None:
        _positive("spacing", [spacing])
    places = _place(out), _place(out if other is None else other)
    found, table = differences.compare(places, scenarios, thresholds, spacing)
    tell(f"{found.attrs['title']}: {found.attrs['comment']}")
    if to is not None:
        folder = Path(to)
        tell(str(write(found, folder, differences.FILE)))
        if len(table):
            tell(str(differences.write_table(table, folder)))
        for path in draw_differences(found, folder) if pictures else ():
            tell(str(path))
    return found, table


def assessment_tables(
    out: Place,
    *,
    to: str | PathLike[str] | None = None,
    kinds: Sequence[str] = ("csv", "md"),
    emulate: bool = False,
    tell: Tell = _silent,
    warn: Tell = _warn,
) -> dict[str, pd.DataFrame]:
    """Table runs, quantiles by scenario, the run-out curve and receptors, with bounds.

    Parameters
    ----------
    out : path, str or Results
        The place.
    to : path, optional
        Folder that the tables are written to; by default nothing is written.
    kinds : sequence of str
        How they are written: ``csv``, ``parquet``, ``md``.
    emulate : bool
        Whether to add the tables of `emulate`.
    tell, warn : callable
        Told the path of each file, and what cannot be emulated.

    Returns
    -------
    dict of str to DataFrame
        ``runs``, ``scenarios``, ``runout-exceedance``, ``receptors`` and ``receptor-runs``, emulated ones
        where they are asked for; those that have no row are left out.

    Raises
    ------
    FileNotFoundError
        If the place holds no store.
    ValueError
        If a store lacks a field that its receptors need.
    ImportError
        If Parquet is asked for without pyarrow.
    """
    from pipeline.assess.tables import assess, write

    made = assess(_place(out))
    if emulate:
        from pipeline.emulation.emulate import TABLES, table_of

        found = [each for _, each in _emulated(out, {}, warn)]
        added = {name: table_of(found, name) for name in TABLES}
        made |= {name: table for name, table in added.items() if len(table)}
    if to is not None:
        with _extra("parquet"):
            for path in write(made, Path(to), list(kinds)):
                tell(str(path))
    return made


def sensitivity_indices(out: Place, *, to: Anywhere | None = None, warn: Tell = _warn) -> pd.DataFrame:
    """Table which varied parameter drives run-out, deposit and what reaches receptors.

    Parameters
    ----------
    out : path, str or Results
        The place.
    to : path, optional
        Table that is written, ``.csv``, ``.parquet`` or ``.md``; by default nothing is written.
    warn : callable
        Told which scenario or quantity has no indices, and why.

    Returns
    -------
    DataFrame
        A row per scenario, quantity, parameter and index: PAWN's, and Sobol's for the design ``saltelli``.

    Raises
    ------
    FileNotFoundError
        If the place holds no store.
    ImportError
        If SALib is not installed, or Parquet is asked for without pyarrow.
    """
    from pipeline.assess.sensitivity import sensitivity_indices as indices
    from pipeline.store import run_table as table

    with _extra("sensitivity"):
        found = indices(_place(out), warn)
    if to is not None and len(found):
        with _extra("parquet"):
            table.write(found, _writable(to))
    return found


def emulate(
    out: Place,
    name: str | None = None,
    *,
    draws: int = 4096,
    to: str | PathLike[str] | None = None,
    depth: Sequence[float] | None = None,
    speed: Sequence[float] | None = None,
    momentum_flux: Sequence[float] | None = None,
    pressure: Sequence[float] | None = None,
    kinds: Sequence[str] = ("csv", "md"),
    pictures: bool = True,
    tell: Tell = _silent,
    warn: Tell = _warn,
) -> dict[str, Emulated]:
    """Emulate the runs of sampled scenarios: maps, receptors and quantiles of many draws, with their errors.

    Parameters
    ----------
    out : path, str or Results
        The place.
    name : str, optional
        One scenario; by default all that are sampled.
    draws : int
        Draws of maps; single numbers are over 4 times as many.
    to : path, optional
        Folder that tables and maps are written to, one by scenario. By default nothing is written.
    depth, speed, momentum_flux, pressure : sequence of float, optional
        Thresholds (m, m s-1, m3 s-2, kPa) in place of those of the scenarios.
    kinds : sequence of str
        How tables are written: ``csv``, ``parquet``, ``md``.
    pictures : bool
        Whether to draw the maps, where ``to`` is given.
    tell, warn : callable
        Told what was made and written, and what leave-one-out does not support, a line each.

    Returns
    -------
    dict of str to Emulated
        By name of scenario: ``tables`` with ``leave-one-out``, ``emulated-scenarios``, ``emulated-receptors``
        and ``emulated-missing``, and ``maps``. Scenarios that cannot be emulated are left out with a warning.

    Raises
    ------
    FileNotFoundError
        If the place holds no store.
    OptionError
        If a threshold is not above 0, there are too few draws, or the scenario that is named cannot be
        emulated.
    OSError
        If something cannot be written.
    """
    from pipeline.assess.tables import write

    given = {"depth": depth, "speed": speed, "momentum_flux": momentum_flux, "pressure": pressure}
    thresholds = {key: _positive(key, values) for key, values in given.items() if values is not None}
    if draws < LEAST_DRAWS:
        raise OptionError("draws", f"expected at least {LEAST_DRAWS}, found {draws}")
    made: dict[str, Emulated] = {}
    for each, found in _emulated(out, thresholds, warn, name, draws):
        made[each] = found
        tell(found.comment)
        if to is not None:
            with _extra("parquet"):
                for path in write(dict(found.tables), Path(to) / each, list(kinds)):
                    tell(str(path))
            _write_emulated(found, Path(to) / each, pictures, tell)
    return made


def _emulated(
    out: Place,
    thresholds: Mapping[str, tuple[float, ...]],
    warn: Tell,
    name: str | None = None,
    draws: int = 4096,
) -> Iterator[tuple[str, Emulated]]:
    """Emulate the scenarios of a place; warn of those that cannot be, and of what leave-one-out refuses."""
    from pipeline.emulation.emulate import of_place
    from pipeline.emulation.errors import NotEmulatedError

    for each, found in of_place(_place(out), thresholds, name, draws):
        if isinstance(found, NotEmulatedError):
            if name is not None:
                raise OptionError("", f"{each}: cannot be emulated: {found}")
            warn(f"{each}: cannot be emulated: {found}")
            continue
        for line in found.refused:
            warn(f"{each}: {line}; plain shares stand in the tables")
        yield each, found


def _write_emulated(found: Emulated, folder: Path, pictures: bool, tell: Tell) -> None:
    """Write emulated maps to a folder; where there is none nothing is written."""
    from pipeline.emulation.emulate import FILE
    from pipeline.hazard.map_files import write_maps
    from pipeline.hazard.mapping import write

    if found.maps is None:
        return
    tell(str(write(found.maps, folder, FILE)))
    for path in write_maps(found.maps, folder).paths if pictures else ():
        tell(str(path))


def calibrate(
    store: Anywhere,
    observed: str | PathLike[str],
    *,
    threshold: float | None = None,
    accepted: float = 0.1,
    emulate: bool = False,
    outline_error: float | None = None,
    to: str | PathLike[str] | None = None,
    tell: Tell = _silent,
    warn: Tell = _warn,
) -> dict[str, pd.DataFrame]:
    """Score the runs of a scenario by an observed deposit, and give the ranges of their parameters.

    Parameters
    ----------
    store : path or str
        Store of the scenario.
    observed : path
        Outline (CSV of x, y; GeoPackage, GeoJSON, Shapefile) or depths (CSV, NetCDF, GeoTIFF).
    threshold : float, optional
        Depth of a deposit, m; by default the scenario's ``output.threshold``.
    accepted : float
        Share of the runs that is accepted.
    emulate : bool
        Whether to give the posterior of sampled parameters over many emulated draws too.
    outline_error : float, optional
        Standard deviation of where the observed outline lies, m, for the posterior; by default the spacing.
    to : path, optional
        Folder that the tables are written to, as CSV and Markdown; by default nothing is written.
    tell, warn : callable
        Told the path of each file, and why there is no posterior.

    Returns
    -------
    dict of str to DataFrame
        ``scores``, a row per run, the best first; ``parameters``, ranges over all and over accepted runs;
        ``posterior``, where it is asked for and the runs support it.

    Raises
    ------
    FileNotFoundError
        If there is no store.
    ObservationError
        If the observation cannot be compared with the runs.
    OptionError
        If no threshold is given, by the scenario neither.
    """
    from pipeline.assess.calibration import posterior, score
    from pipeline.assess.observed import read
    from pipeline.assess.tables import write
    from pipeline.scenario.scenario import stored
    from pipeline.store.zarr_store import open_store

    with open_store(find_store(store)) as opened:
        least = threshold if threshold is not None else stored(opened.attrs).output.threshold
        if least is None:
            raise OptionError("threshold", "expected a depth, as the scenario gives no output.threshold")
        deposit = read(Path(observed), opened, least)
        scores = score(opened, deposit, least)
        made = {"scores": scores, "parameters": posterior(opened, scores, accepted)}
        if emulate:
            from pipeline.emulation.calibrated import posterior_table
            from pipeline.emulation.errors import NotEmulatedError
            from pipeline.emulation.sampled import sampled

            try:
                with sampled(find_store(store)) as runs:
                    found = posterior_table(runs, deposit, least, outline_error, POSTERIOR_DRAWS)
                made["posterior"] = found
            except NotEmulatedError as error:
                warn(f"no posterior: {error}")
    if to is not None:
        for path in write(made, Path(to), ["csv", "md"]):
            tell(str(path))
    return made


def write_report(
    out: Place,
    to: Anywhere | None = None,
    *,
    run: int | None = None,
    title: str | None = None,
    author: str | None = None,
    client: str | None = None,
    date: str | None = None,
    emulate: bool = False,
) -> Location:
    """Write one page about a place, whole in itself: findings, maps, runs to look at and to ask, inputs.

    Parameters
    ----------
    out : path, str or Results
        The place.
    to : path, optional
        The page; by default ``report.html`` in the place.
    run : int, optional
        Position of the run shown in motion; by default that of median run-out.
    title, author, client, date : str, optional
        Head of the page, in place of what the scenarios say under ``report``; a date is as 2026-03-31.
    emulate : bool
        Whether to add emulated maps and tables, see `emulate`.

    Returns
    -------
    Path
        The page.

    Raises
    ------
    FileNotFoundError
        If the place holds no store.
    ValueError
        If no scenario has such a run.
    OptionError
        If the date is none.
    OSError
        If the page cannot be written.
    """
    from pipeline.report.page import write_report as write
    from pipeline.settings.report import Report, is_date

    if date is not None and not is_date(date):
        raise OptionError("date", f"expected a day as 2026-03-31, found '{date}'")
    place = _place(out)
    head = Report(title=title, author=author, client=client, date=date)
    return write(place, place / "report.html" if to is None else _writable(to), run, head, emulate)


def _located(path: Anywhere) -> Location:
    """Give the path of a folder or of a URL."""
    from pipeline.store.storage import located

    if not isinstance(path, str):
        # of a folder, or what stands for a URL
        return Path(path) if isinstance(path, PathLike) else path
    try:
        return located(path)
    except (ImportError, ValueError) as error:
        raise OptionError("", str(error)) from None


def _writable(path: Anywhere) -> Location:
    """Give the path of a file, its folder made where it is missing."""
    found = _located(path)
    if isinstance(found, Path):
        found.parent.mkdir(parents=True, exist_ok=True)
    return found


def _place(out: Place) -> Location:
    """Give the path of a place, or of results."""
    # results know their place; to ask for their type would import xarray
    place: Any = getattr(out, "place", out)
    return find_place(place)


def find_place(path: Anywhere) -> Location:
    """Give the path of a place, a folder or a URL, whether it is there or not.

    Raises
    ------
    OptionError
        If it is the store of a scenario, a file, or a URL that is not written as one.
    """
    from pipeline.store.place import not_a_place

    found = _located(path)
    if _is_store(found):
        raise OptionError("", not_a_place(found))
    if isinstance(found, Path) and found.is_file():
        raise OptionError("", f"{found}: expected a folder, found a file")
    return found


def find_store(path: Anywhere) -> Location:
    """Give the path of a store.

    Raises
    ------
    OptionError
        If it is a place of several.
    FileNotFoundError
        If there is none.
    """
    from pipeline.store.place import not_a_store

    found = _located(path)
    if not _is_store(found):
        raise FileNotFoundError(not_a_store(found))
    return found


def _is_store(path: Location) -> bool:
    return path.suffix == ".zarr" and (path / "zarr.json").exists()


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


def _bytes(size: str | int | None) -> int | None:
    """Read a size as ``2GB``."""
    if size is None:
        return None
    from dask.utils import parse_bytes

    try:
        found = int(parse_bytes(size))
    except ValueError:
        found = -1
    if found < LEAST_MEMORY:
        note = "" if found < 0 else f", which is {found:,} bytes"
        raise OptionError("memory_limit", f"expected a size as 2GB or 500MiB, found '{size}'{note}")
    return found


def _positive(option: str, values: Sequence[float]) -> tuple[float, ...]:
    """Give numbers above 0 in ascending order, each once."""
    for value in values:
        if not 0 < value < float("inf"):
            raise OptionError(option, f"expected numbers above 0, found {value:g}")
    return tuple(sorted({float(value) for value in values}))


@contextmanager
def _extra(name: str) -> Iterator[None]:
    """Name the extra of the package that a missing import comes with."""
    try:
        yield
    except ImportError as error:
        raise MissingExtraError(f"{error}: pip install 'lmls[{name}]'") from error
