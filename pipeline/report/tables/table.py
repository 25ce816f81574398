"""A table of the report, and how its numbers are written."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

MOST_ROWS = 40
# begins a cell that is shown in grey
FAINT = "\u2009"


@dataclass(frozen=True)
class Table:
    """A table with a title; a note stands below it."""

    title: str
    head: Sequence[str]
    rows: Sequence[Sequence[str]]
    note: str = ""


def share_in_words(row: Mapping[Any, Any], name: str) -> str:
    """Write a share with its bounds: ``0.54``, ``0.54 (0.50 to 0.61)``, ``unknown (0.00 to 1.00)``."""
    text = bounded(row, name, f"{name}_lower", f"{name}_upper")
    return f"unknown ({text.partition(' (')[2]}" if is_open(row, name) else text


def is_open(row: Mapping[Any, Any], name: str) -> bool:
    """Say that no run settles a share: to two decimals it may be anything from 0 to 1."""
    lower, upper = row[f"{name}_lower"], row[f"{name}_upper"]
    return bool(round(lower, 2) == 0 and round(upper, 2) == 1)


def bounded(row: Mapping[Any, Any], estimate: str, lower: str, upper: str) -> str:
    """Write a number of two decimals with its bounds, where they differ."""
    return between(*(f"{row[name]:.2f}" for name in (estimate, lower, upper)))


def between(value: str, lower: str, upper: str) -> str:
    """Write a number beside its bounds, where they differ."""
    return value if lower == upper else f"{value} ({lower} to {upper})"


def short(value: Any) -> str:
    """Write a result for people, by the digits that a model can mean; a missing one as a dash."""
    if not np.isfinite(value):
        return "–"
    rounded = float(f"{value:.3g}" if abs(value) >= 1 else f"{value:.2g}")
    return f"{rounded:,.0f}" if abs(rounded) >= 100 else f"{rounded:g}"
