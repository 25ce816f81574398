"""Error of emulated numbers against many runs: ``python -m pipeline.studies.emulation --case valley``.

It computes the runs of a case, prints its tables in docs/emulation.md and draws its pictures. ``--runs
PLACE`` keeps the runs there, or takes those that are there; ``--to FOLDER`` gets tables and pictures. The
valley takes half an hour of processor time, the others five to ten minutes.
"""

from __future__ import annotations

import argparse
from collections.abc import Iterator, Sequence
from pathlib import Path

import pandas as pd

import pipeline
from pipeline.store import run_table
from pipeline.studies.emulation import valley
from pipeline.studies.emulation.cases import CASES, VALLEY, Case
from pipeline.studies.emulation.pictures import draw
from pipeline.studies.emulation.thresholds import by_threshold, by_verdict, compared
from pipeline.studies.emulation.truth import Truth


def tables(case: Case, place: Path) -> Iterator[tuple[str, pd.DataFrame]]:
    """Give the tables of a case by the names of their files."""
    if case is VALLEY:
        yield from valley.tables(*(Truth(place, case.named(spacing)) for spacing in case.truth))
        return
    found = pd.DataFrame(compared(case, place))
    yield case.name, by_threshold(found)
    yield f"{case.name}-verdicts", by_verdict(found)


def main(arguments: Sequence[str] | None = None) -> None:
    """Compute the runs, print the tables and draw the pictures."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--case", choices=list(CASES), default=VALLEY.name)
    parser.add_argument("--runs", type=Path, default=None)
    parser.add_argument("--to", type=Path, default=Path("docs/emulation"))
    given = parser.parse_args(arguments)
    case = CASES[given.case]
    place = given.runs or Path("results") / f"emulation-{case.name}"
    pipeline.run([case.scenario(spacing) for spacing in case.truth], place)
    given.to.mkdir(parents=True, exist_ok=True)
    for title, table in tables(case, place):
        text = run_table.markdown(table)
        print(text)
        (given.to / f"{title}.md").write_text(text, encoding="utf-8")
    if given.case == VALLEY.name:
        wide, close = (Truth(place, case.named(spacing)) for spacing in case.truth)
        draw(wide, close, given.to / "maps.png")


if __name__ == "__main__":
    main()
