"""Error of emulated numbers against many runs: ``python -m pipeline.studies.emulation --case valley``.

It computes the runs of a case, prints its tables in docs/emulation.md and draws its pictures. ``--runs
PLACE`` keeps the runs there, or takes those that are there; ``--to FOLDER`` gets tables and pictures, and
``--page docs/emulation.md`` the tables in place of those below their names in comments.

The tables of the valley are parts. Those that were made by the same code are taken from the place, so that
the same command goes on where it was cut off, and ``--part draws`` does one of them. Each part says what
processor time it took.
"""

from __future__ import annotations

import argparse
import re
import resource
from collections.abc import Iterator, Sequence
from functools import cache
from pathlib import Path

import pandas as pd

import pipeline
from pipeline.store import run_table
from pipeline.store.provenance import solver_hash
from pipeline.studies.emulation import commands, valley
from pipeline.studies.emulation.acceptance import acceptance
from pipeline.studies.emulation.cases import CASES, VALLEY, Case
from pipeline.studies.emulation.pictures import THRESHOLDS, draw
from pipeline.studies.emulation.thresholds import by_threshold, by_verdict, compared
from pipeline.studies.emulation.truth import Truth
from solver import sources

COMMANDS, RUNS, PICTURES = "commands", "runs", "pictures"
PARTS = (RUNS, *valley.PARTS, COMMANDS, PICTURES)


def tables(case: Case, place: Path) -> Iterator[tuple[str, pd.DataFrame]]:
    """Give the tables of a case other than the valley by the names of their files."""
    found = pd.DataFrame(compared(case, place))
    yield case.name, by_threshold(found)
    yield f"{case.name}-verdicts", by_verdict(found)


def tables_of_valley(place: Path, parts: Sequence[str]) -> Iterator[tuple[str, pd.DataFrame]]:
    """Give parts of the valley, kept in the place or made; last how they stand beside their limits."""

    @cache
    def truth() -> tuple[Truth, ...]:
        return tuple(Truth(place, VALLEY.named(spacing)) for spacing in VALLEY.truth)

    code = known_by()
    found = {}
    for part in (*valley.PARTS, COMMANDS):
        kept = place / "tables" / f"{part}-{code}.csv"
        if part in parts and not kept.exists():
            before = seconds()
            table = made(part, place, code, truth())
            print(f"{part}: {seconds() - before:.0f} s of processor time", flush=True)
            kept.parent.mkdir(parents=True, exist_ok=True)
            table.to_csv(kept, index=False)
        if kept.exists():
            found[part] = pd.read_csv(kept)
        if part in parts:
            yield part, found[part]
    yield "acceptance", acceptance(found)


def made(part: str, place: Path, code: str, truth: Sequence[Truth]) -> pd.DataFrame:
    """Make the table of a part."""
    wide, close, fine = truth
    if part == COMMANDS:
        for spacing, each in zip(list(VALLEY.truth)[1:], (close, fine), strict=True):
            errors = ", ".join(f"{commands.error_of_truth(each, threshold):.4f}" for threshold in THRESHOLDS)
            print(f"error of the truth at {spacing:g} m by its halves: {errors}")
        return commands.together(commands.commands(place / COMMANDS, code, close, fine))
    return valley.PARTS[part](wide, close, fine)


def with_table(page: str, title: str, text: str) -> str:
    """Put a table into a page, in place of the one below ``<!-- title -->``, if it has that."""
    return re.sub(rf"(?m)(^<!-- {re.escape(title)} -->\n)(^\|.*\n)*", lambda found: found[1] + text, page)


def known_by() -> str:
    """Give what the code of the study, of the emulator and of the solver is known by."""
    modules = sources.modules_of("solver", "pipeline")
    started = sources.closure([valley.__name__, commands.__name__, "pipeline.api.emulation"], modules)
    return f"{sources.fingerprint(started, modules)[:8]}{solver_hash()[:8]}"


def seconds() -> float:
    """Processor time of this process and of those that it waited for, s."""
    used = [resource.getrusage(who) for who in (resource.RUSAGE_SELF, resource.RUSAGE_CHILDREN)]
    return sum(each.ru_utime + each.ru_stime for each in used)


def main(arguments: Sequence[str] | None = None) -> None:
    """Compute the runs, print the tables and draw the pictures."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--case", choices=list(CASES), default=VALLEY.name)
    parser.add_argument("--runs", type=Path, default=None)
    parser.add_argument("--to", type=Path, default=Path("docs/emulation"))
    parser.add_argument("--page", type=Path, default=None)
    parser.add_argument("--part", choices=PARTS, action="append", help="of the valley; may be given again")
    given = parser.parse_args(arguments)
    case, parts = CASES[given.case], given.part or PARTS
    place = given.runs or Path("results") / f"emulation-{case.name}"
    before = seconds()
    for spacing in case.truth:
        pipeline.run([case.scenario(spacing)], place)
        print(f"runs at {spacing:g} m: {seconds() - before:.0f} s of processor time so far", flush=True)
    given.to.mkdir(parents=True, exist_ok=True)
    made_here = tables_of_valley(place, parts) if case is VALLEY else tables(case, place)
    for title, table in made_here:
        text = run_table.markdown(table)
        print(f"\n{title}\n\n{text}", flush=True)
        (given.to / f"{title}.md").write_text(text, encoding="utf-8")
        if given.page is not None:
            page = given.page.read_text(encoding="utf-8")
            given.page.write_text(with_table(page, title, text), encoding="utf-8")
    if case is VALLEY and PICTURES in parts:
        wide, close, _ = (Truth(place, case.named(spacing)) for spacing in case.truth)
        draw(wide, close, given.to / "maps.png")
    print(f"in all: {seconds() - before:.0f} s of processor time")


if __name__ == "__main__":
    main()
