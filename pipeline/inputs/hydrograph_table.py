"""Hydrographs in CSV files: columns of time and discharge."""

from __future__ import annotations

import hashlib
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from pipeline.inputs import text_table
from pipeline.inputs.text_table import Heading
from pipeline.mistakes import BadInput, Mistake
from solver.inflow.hydrograph import Hydrograph

WANTED = "a CSV of time and discharge"
# headings that are understood, in small letters and without their unit, and units, each with its factor
TIME = frozenset(("time", "t", "zeit"))
DISCHARGE = frozenset(("discharge", "q", "flow", "abfluss"))
SECONDS = {
    **dict.fromkeys(("", "s", "sec", "second", "seconds"), 1.0),
    **dict.fromkeys(("min", "minute", "minutes"), 60.0),
    **dict.fromkeys(("h", "hour", "hours"), 3600.0),
}
CUBIC_METRES = {
    **dict.fromkeys(("", "m3/s", "m\u00b3/s", "m^3/s", "m3 s-1", "cms"), 1.0),
    **dict.fromkeys(("l/s", "l s-1"), 0.001),
}


@dataclass(frozen=True, eq=False)
class HydrographTable:
    """A hydrograph, and the SHA-256 of its numbers."""

    hydrograph: Hydrograph
    digest: str


def read(path: Path) -> HydrographTable:
    """Read a CSV with the columns time and discharge, found by their headings; others are left out.

    Without a unit in the heading, as in ``time (min)``, times are in s and discharges in m3/s.

    Raises
    ------
    BadInput
        If it is no such table, with every line that has not one cell a heading, whose cells are not finite
        numbers, whose time does not increase or is negative, or whose discharge is negative.
    OSError
        If the file cannot be read.
    """
    headings, rows = text_table.split(path, text_table.read_text(path, WANTED))
    columns = [_column(path, headings, *wanted) for wanted in ((TIME, "time"), (DISCHARGE, "discharge"))]
    factors = [_factor(path, headings[i], known) for i, known in zip(columns, _UNITS, strict=True)]
    numbers: list[tuple[float, float]] = []
    mistakes: list[Mistake] = []
    for row in rows:
        if (uneven := text_table.uneven(path, headings, row)) is not None:
            mistakes.append(uneven)
            continue
        found = []
        for i, factor in zip(columns, factors, strict=True):
            value, at = text_table.number(row.cells[i]), row.columns[i]
            if value is None:
                said = text_table.wrong_number(row.cells[i])
                mistakes.append(Mistake(str(path), row.line, at, "", said))
            elif value < 0:
                said = f"expected a {headings[i].name} of 0 or more, found {value:g}"
                mistakes.append(Mistake(str(path), row.line, at, "", said))
            else:
                found.append(value * factor)
        if len(found) == 2:
            if numbers and found[0] <= numbers[-1][0]:
                said = f"expected times that increase, found {found[0]:g} s after {numbers[-1][0]:g} s"
                mistakes.append(Mistake(str(path), row.line, row.columns[columns[0]], "", said))
            numbers.append((found[0], found[1]))
    if not mistakes and len(numbers) < 2:
        said = f"expected a line of headings and two or more of numbers, found {len(numbers)} of numbers"
        mistakes.append(Mistake(str(path), 1, 1, "", said))
    if not mistakes and not any(discharge > 0 for _, discharge in numbers):
        mistakes.append(Mistake(str(path), 1, 1, "", "expected a discharge above 0, found none"))
    if mistakes:
        raise text_table.told(mistakes)
    held = np.array(numbers)
    digest = hashlib.sha256(held.tobytes()).hexdigest()
    return HydrographTable(Hydrograph(held[:, 0].copy(), held[:, 1].copy()), digest)


_UNITS = (SECONDS, CUBIC_METRES)


def _column(path: Path, headings: Sequence[Heading], names: frozenset[str], wanted: str) -> int:
    """Find the one column of a name."""
    found = text_table.column(headings, names)
    if len(found) != 1:
        shown = ", ".join(each.text for each in headings)
        again = " more than once" if found else ""
        said = f"expected the headings time and discharge, found {shown}{again} for {wanted}"
        raise BadInput([Mistake(str(path), 1, 1, "", said)])
    return found[0]


def _factor(path: Path, heading: Heading, known: dict[str, float]) -> float:
    """Give the factor of a unit to s or m3/s."""
    if heading.unit not in known:
        expected = "s, min or h" if known is SECONDS else "m3/s or l/s"
        said = f"expected {expected} as the unit of a heading, found {heading.text}"
        raise BadInput([Mistake(str(path), 1, 1, "", said)])
    return known[heading.unit]
