"""What became of a scene, as a record that is kept on disk; the scene itself is drawn again."""

from __future__ import annotations

from dataclasses import fields
from pathlib import Path
from typing import Any

from pipeline.studies.stress.campaign import Row
from pipeline.studies.stress.scenes import Drawn
from pipeline.studies.stress.watch import Watched
from solver.checks.states import Check

Record = dict[str, Any]
WORST = "worst"


def record_of(row: Row) -> Record:
    """Give all of a row but its scene, for JSON."""
    found = row.watched
    return {
        "watched": None if found is None else _watched(found),
        "repeats": [_check(check) for check in row.repeats],
        "reason": row.reason,
        "repeated": row.repeated,
        "file": None if row.file is None else row.file.name,
    }


def row_of(record: Record, drawn: Drawn, folder: Path) -> Row:
    """Give the row of a record; files of failing scenes are in a folder."""
    kept = record["watched"]
    watched = None
    if kept is not None:
        worst = {law: (Check(law, *numbers), time) for law, (numbers, time) in kept[WORST].items()}
        watched = Watched(**{**kept, WORST: worst})
    repeats = [Check(law, *numbers) for law, *numbers in record["repeats"]]
    file = None if record["file"] is None else folder / record["file"]
    return Row(drawn, watched, repeats, record["reason"], record["repeated"], file)


def _check(check: Check) -> list[Any]:
    return [check.law, float(check.value), float(check.limit)]


def _watched(found: Watched) -> Record:
    numbers = {each.name: getattr(found, each.name) for each in fields(found) if each.name != WORST}
    return numbers | {WORST: {law: [_check(check)[1:], time] for law, (check, time) in found.worst.items()}}
