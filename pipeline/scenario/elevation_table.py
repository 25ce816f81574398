"""Elevation tables: CSV files of horizontal distance and elevation."""

from __future__ import annotations

import hashlib
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from pipeline.mistakes import BadInput, Mistake

COLUMNS = ("distance", "elevation")


@dataclass(frozen=True, eq=False)
class ElevationTable:
    """Horizontal distances, increasing, and elevations, shape (n,), m, and the SHA-256 of both."""

    distances: NDArray[np.float64]
    elevations: NDArray[np.float64]
    digest: str


def read(path: Path) -> ElevationTable:
    """Read a CSV of two columns, horizontal distance and elevation in m, below one line of headings.

    Raises
    ------
    BadInput
        With every line that is not two finite numbers, and where distance does not increase.
    OSError
        If the file cannot be read.
    """
    rows: list[tuple[float, float]] = []
    mistakes: list[Mistake] = []
    lines = path.read_text(encoding="utf-8-sig", errors="replace").splitlines()
    if lines and all(_finite(cell) is not None for cell in lines[0].split(",")):
        found = f"expected a line of headings, found '{lines[0]}'"
        mistakes.append(Mistake(str(path), 1, 1, "", found))
    for number, line in enumerate(lines[1:], 2):
        if not line.strip():
            continue
        cells = line.split(",")
        if len(cells) != len(COLUMNS):
            found = f"expected two numbers, distance and elevation, found {len(cells)}"
            mistakes.append(Mistake(str(path), number, 1, "", found))
            continue
        numbers = [_finite(cell) for cell in cells]
        for i, (name, cell, value) in enumerate(zip(COLUMNS, cells, numbers, strict=True)):
            if value is None:
                column = 1 + i * (len(cells[0]) + 1)
                found = f"expected a finite number, found '{cell.strip()}'"
                mistakes.append(Mistake(str(path), number, column, name, found))
        distance, elevation = numbers
        if distance is None or elevation is None:
            continue
        if rows and distance <= rows[-1][0]:
            found = f"expected a number above {rows[-1][0]:.15g}, the one before, found {distance:.15g}"
            mistakes.append(Mistake(str(path), number, 1, "distance", found))
        rows.append((distance, elevation))
    if not mistakes and len(rows) < 2:
        found = f"expected a line of headings and two or more of numbers, found {len(rows)} of numbers"
        mistakes.append(Mistake(str(path), 1, 1, "", found))
    if mistakes:
        raise BadInput(mistakes)
    distances, elevations = np.array(rows).T
    return ElevationTable(distances, elevations, hashlib.sha256(np.array(rows).tobytes()).hexdigest())


def _finite(text: str) -> float | None:
    """Give the finite number that a cell holds, or None."""
    try:
        value = float(text)
    except ValueError:
        return None
    return value if np.isfinite(value) else None
