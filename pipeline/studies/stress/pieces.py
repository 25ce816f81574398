"""Campaigns in pieces that are kept: one that was cut off goes on where it was, and seeds nobody chose."""

from __future__ import annotations

import hashlib
import json
import re
from collections.abc import Callable
from functools import cache
from pathlib import Path
from time import perf_counter
from typing import NamedTuple

from pipeline.store.provenance import COMPUTING
from pipeline.studies.stress import report
from pipeline.studies.stress.campaign import Row, campaign, files, is_repeated, same_with_any_workers
from pipeline.studies.stress.records import record_of, row_of
from pipeline.studies.stress.scenes import draw, first_numbers, read
from pipeline.studies.stress.watch import MOST_WORK
from solver import sources

# Scenes of a piece.
PIECE = 500
# The claim: so many scenes of so many seeds.
SCENES, SEEDS = 5000, 5
# What draws scenes, computes them, and checks their laws.
DECISIVE = (
    COMPUTING,
    "pipeline.studies.stress.repeats",
    "pipeline.studies.stress.scenes",
    "pipeline.studies.stress.watch",
)
Tell = Callable[[str], None]


class Plan(NamedTuple):
    """What a campaign runs.

    Parameters
    ----------
    seeds : list of int
        Each has as many scenes as the others, or one more.
    scenes : int
        Of all seeds.
    work : float
        Cell-stages after which a scene ends.
    workers : int
        Processes.
    sections : tuple of str
        That the files of all scenes have; then all scenes are repeated.
    """

    seeds: list[int]
    scenes: int
    work: float
    workers: int
    sections: tuple[str, ...] = ()


@cache
def code() -> str:
    """SHA-256 of the code that draws scenes, computes them, and checks their laws; words do not count."""
    modules = sources.modules_of("solver", "pipeline")
    return sources.fingerprint(sources.closure(DECISIVE, modules), modules)


def seeds_of(text: str, count: int = SEEDS) -> list[int]:
    """Draw seeds from a text, by SHA-256 of it and a number."""
    return [int(hashlib.sha256(f"{text} {k}".encode()).hexdigest()[:7], 16) for k in range(count)]


def in_pieces(plan: Plan, to: Path, tell: Tell) -> tuple[list[Row], float]:
    """Run the pieces of a campaign that are not kept yet; give all rows, and the time they took, s.

    A piece is kept in ``to/pieces`` as soon as it is done, failing scenes shrunk. It counts as long as the
    code is that which it was run with.
    """
    rows: list[Row] = []
    seconds = 0.0
    for k, seed in enumerate(plan.seeds):
        count = plan.scenes // len(plan.seeds) + (k < plan.scenes % len(plan.seeds))
        numbers = first_numbers(seed, count, plan.sections)
        for first in range(0, count, PIECE):
            found, took = _piece(plan, seed, numbers[first : first + PIECE], to, tell)
            rows, seconds = rows + found, seconds + took
    return rows, seconds


def _piece(plan: Plan, seed: int, numbers: list[int], to: Path, tell: Tell) -> tuple[list[Row], float]:
    of = "-".join([str(seed), *plan.sections, str(numbers[0]), str(numbers[-1] + 1), f"{plan.work:g}"])
    path = to / "pieces" / f"{of}.json"
    todo = [(draw(seed, k), bool(plan.sections) or is_repeated(seed, k)) for k in numbers]
    failing = to / "failing"
    if path.exists():
        kept = json.loads(path.read_text(encoding="utf-8"))
        if kept["code"] == code():
            tell(f"{path.name}: kept from before")
            pairs = zip(kept["rows"], todo, strict=True)
            return [row_of(record, drawn, failing) for record, (drawn, _) in pairs], kept["seconds"]
    began = perf_counter()
    rows = campaign(todo, plan.workers, tell, plan.work)
    # a tenth, also where all are repeated: each is run twice more to its end
    tenth = [row for row, k in zip(rows, numbers, strict=True) if is_repeated(seed, k)]
    same_with_any_workers(tenth, to, max(2, plan.workers))
    took = perf_counter() - began
    files(rows, failing, tell)
    path.parent.mkdir(parents=True, exist_ok=True)
    part = path.with_suffix(".part")
    part.write_text(
        json.dumps({"code": code(), "seconds": took, "rows": [record_of(row) for row in rows]}),
        encoding="utf-8",
    )
    part.replace(path)
    return rows, took


def stress(
    to: Path,
    tell: Tell,
    scenes: int,
    seed: int,
    workers: int,
    chosen: list[Path] | None = None,
    work: float = MOST_WORK,
    claim: bool = False,
    page: Path | None = None,
    sections: tuple[str, ...] = (),
) -> tuple[list[Path], list[Path]]:
    """Run a campaign, write its tables, and give what was written: reports, and files of failing scenes.

    Parameters
    ----------
    to : Path
        Folder to write to.
    tell : callable
        Told what is found as it is found.
    scenes, seed, workers : int
        Scenes to draw, what they are drawn from, and processes.
    chosen : list of Path, optional
        Scenario files in place of drawn scenes; all are repeated.
    work : float
        Cell-stages after which a scene ends.
    claim : bool
        Draw the scenes from seeds that the code gives.
    page : Path, optional
        A page of Markdown; the tables take the place of what is between its marks.
    sections : tuple of str
        Run only scenes whose files have all of them.
    """
    plan = Plan(seeds_of(code()) if claim else [seed], scenes, work, workers, sections)
    if chosen:
        began = perf_counter()
        todo = [(read(path), True) for path in chosen]
        rows = campaign(todo, workers, tell, work)
        same_with_any_workers(rows, to, max(2, workers))
        seconds = perf_counter() - began
        files(rows, to / "failing", tell)
    else:
        rows, seconds = in_pieces(plan, to, tell)
        # scenes of files are no sample
        tell(report.rate(rows))
    drawn_from = f"drawn from the code, {code()[:12]}" if claim else ""
    if sections:
        drawn_from = ", ".join(filter(None, [drawn_from, f"those with {' and '.join(sections)} alone"]))
    told = report.Told([] if chosen else plan.seeds, drawn_from, work, workers, seconds)
    written = report.write(rows, to, told)
    if page is not None:
        text = page.read_text(encoding="utf-8")
        page.write_text(filled(text, "\n".join(report.tables(rows, told, "###"))), encoding="utf-8")
        written.append(page)
    return written, [row.file for row in rows if row.file is not None]


def filled(page: str, tables: str) -> str:
    """Put the tables of a campaign between the marks of a page.

    Raises
    ------
    ValueError
        If the page has no marks ``<!-- stress -->`` and ``<!-- end -->``.
    """
    found, count = re.subn(
        r"<!-- stress -->\n.*?<!-- end -->",
        lambda match: f"<!-- stress -->\n{tables}\n<!-- end -->",
        page,
        flags=re.DOTALL,
    )
    if count != 1:
        raise ValueError("the page needs the marks <!-- stress --> and <!-- end -->, once")
    return found
