"""One page about a place: findings, maps, runs to look at and to ask, inputs, versions; whole in itself."""

from __future__ import annotations

import logging
import re
from collections.abc import Sequence
from dataclasses import dataclass
from importlib.resources import files

from jinja2 import Environment, PackageLoader, StrictUndefined

from pipeline.assess.ensemble import NotTogetherError
from pipeline.emulation import emulate as emulation
from pipeline.hazard.differences import compare
from pipeline.hazard.place_maps import WHOLE, of_place
from pipeline.report.chapter import of_all, of_scenario
from pipeline.report.difference_chapter import of_difference
from pipeline.scenario.scenario import stored
from pipeline.settings.report import Report
from pipeline.store import storage
from pipeline.store.place import store_path, store_paths
from pipeline.store.storage import Location
from pipeline.store.zarr_store import open_store

TEMPLATE = "report.html"
LINES = ("date", "author", "client", "remarks")
# units after a number
UNITS = re.compile(r"(\d) (m/s|m³|m|s|ha|kPa|%|years)(?![\w/])")
_log = logging.getLogger(__name__)


@dataclass(frozen=True)
class Head:
    """What stands at the head of the page: its title, and lines of a name and a value."""

    title: str
    lines: Sequence[tuple[str, str]] = ()


def write_report(
    out: Location,
    to: Location,
    run: int | None = None,
    given: Report | None = None,
    emulate: bool = False,
    compared: tuple[str, str] | None = None,
) -> Location:
    """Write the page about a place.

    Parameters
    ----------
    out : Location
        The place.
    to : Location
        The page; one that was there is replaced.
    run : int, optional
        Position of the run that is shown in motion; by default, of each scenario, the computed one whose
        run-out is the median.
    given : Report, optional
        Title, author and what else stands at the head, in place of what the scenarios say under `report`.
    emulate : bool
        Whether to add emulated maps and tables of sampled scenarios.
    compared : tuple of str, optional
        Names of two scenarios: a chapter says how the second differs from the first.

    Returns
    -------
    Location
        The page.

    Raises
    ------
    FileNotFoundError
        If the place holds no store.
    ValueError
        If no scenario has such a run, a scenario is not known here, or two cannot be compared.
    OSError
        If the page cannot be written.
    """
    if run is not None and not any(_has_frames(path, run) for path in store_paths(out)):
        raise ValueError(f"no scenario has frames of a run {run}")
    chapters = [of_difference(compare((out, out), compared, {}))] if compared else []
    note = ""
    emulated = dict(emulation.of_place(out, {})) if emulate else {}
    try:
        for name, found in of_place(out, {}):
            _log.info("page of %s", name)
            if name == WHOLE:
                chapters.append(of_all(found))
                continue
            with open_store(store_path(out, name)) as store:
                chapters.append(of_scenario(out, store, found, run, emulated.get(name)))
    except NotTogetherError as error:
        note = f"There is no map over all scenarios: {error}."
    environment = Environment(
        loader=PackageLoader("pipeline.report", "."),
        autoescape=True,
        undefined=StrictUndefined,
        trim_blocks=True,
        lstrip_blocks=True,
    )
    environment.filters["tied"] = tied
    beside = files("pipeline.report")
    page = environment.get_template(TEMPLATE).render(
        chapters=chapters,
        note=note,
        head=_head(out, given or Report()),
        several=sum(bool(chapter.findings) for chapter in chapters) > 1,
        scripts=any(chapter.explorer for chapter in chapters),
        css=beside.joinpath("report.css").read_text(encoding="utf-8"),
        js=beside.joinpath("explorer.js").read_text(encoding="utf-8"),
    )
    storage.put(to, page.encode())
    return to


def tied(sentence: str) -> str:
    """Keep numbers and their units on one line."""
    return UNITS.sub("\\1\u00a0\\2", sentence)


def _head(out: Location, given: Report) -> Head:
    """Put together what was given for the page, and what scenarios say where nothing was."""
    said = {name: value for name, value in given if value is not None}
    for path in store_paths(out):
        with open_store(path) as store:
            for name, value in stored(store.attrs).report:
                if value is not None:
                    said.setdefault(name, value)
    title = said.pop("title", f"Report: {out.resolve().name}")
    return Head(
        title, [(name, said[name]) for name in ("date", "author", "client", "remarks") if name in said]
    )


def _has_frames(path: Location, run: int) -> bool:
    with open_store(path) as store:
        return "depth" in store and run < store.sizes["run"]
