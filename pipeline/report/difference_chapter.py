"""What the page says of two scenarios beside each other, as with a dam and without it."""

from __future__ import annotations

import tempfile
from collections.abc import Hashable, Iterator, Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd

from pipeline.gis.layer import Layer
from pipeline.hazard.differences import Compared, difference_layers
from pipeline.hazard.map_files import ground
from pipeline.readable import written
from pipeline.report.chapter import Chapter, anchor_of, picture
from pipeline.report.tables.table import Table, between, share_in_words, short

# maps that are shown at once: of each quantity the first threshold, and the largest quantile of depth
QUANTITIES = ("depth", "pressure")
LARGEST = {
    "largest_depth": ("largest depth", "m"),
    "largest_pressure": ("largest dynamic pressure", "kPa"),
    "largest_erosion_depth": ("largest depth of erosion", "m"),
}
ENDS = ("first", "second", "difference")
NOTE = (
    "The second less the first. Depths, speeds and pressures are of all runs, 0 of those that do not reach "
    "the receptor. Bounds are those of both carried through: they hold whatever missing runs would give."
)
OF_SECTIONS = (
    "The second less the first, of all runs; what passed until the end of a run. A run that does not arrive "
    "is later than all that do: the median arrival is missing where half of the runs do not."
)


def of_difference(compared: Compared) -> Chapter:
    """Put together the chapter of two scenarios.

    Parameters
    ----------
    compared : Compared
        Maps and tables of the second less the first, of `pipeline.hazard.differences`.
    """
    found, table, sections = compared
    first, second = (str(found.attrs[f"{each}_scenario"]) for each in ("first", "second"))
    frame = ground(found)
    listed = {layer.name: layer for layer in difference_layers(found)}
    held = {name: layer for name, layer in listed.items() if not _is_nothing(layer)}
    alike = [layer.title for name, layer in listed.items() if name not in held]
    wanted = list(dict.fromkeys(_wanted(held)))
    others = [name for name in held if name not in wanted]
    with tempfile.TemporaryDirectory() as folder:
        shown, folded = (
            [picture(held[name], found, frame, Path(folder)) for name in names] for names in (wanted, others)
        )
    return Chapter(
        anchor=anchor_of(f"{first}-{second}"),
        name=f"{second} beside {first}",
        description=f"What changes from {first} to {second}: maps and numbers are those of {second} less "
        f"those of {first}, red where {second} has more and blue where it has less.{_alike(alike)}",
        runs=str(found.attrs["comment"]),
        maps=shown,
        others=folded,
        findings=[*_findings(table, first, second)],
        tables=[
            *([_receptors(table, first, second)] if len(table) else []),
            *([_sections(sections, first, second)] if len(sections) else []),
        ],
    )


def _is_nothing(layer: Layer) -> bool:
    """Whether nothing differs anywhere, whatever runs are missing."""
    return all(not bool((values.fillna(0) != 0).any()) for values in layer.values.values())


def _alike(titles: Sequence[str]) -> str:
    return f" Nowhere is there a {', a '.join(titles)}." if titles else ""


def _wanted(held: dict[str, Layer]) -> Iterator[str]:
    for quantity in QUANTITIES:
        yield from [name for name in held if name.startswith(f"{quantity}_above_")][:1]
    yield from [name for name in held if name.startswith("depth_quantile")][-1:]


def _findings(table: pd.DataFrame, first: str, second: str) -> Iterator[str]:
    """Say of each receptor how probability, depth and pressure change; of those where nothing does, so."""
    same = []
    for name, rows in table.groupby("receptor", sort=False) if len(table) else ():
        of = rows.set_index("quantity").to_dict("index")
        chance = of["probability"]
        if not (chance["first_upper"] > 0 or chance["second_upper"] > 0):
            same.append(str(name))
            continue
        text = (
            f"{name}: reached with a probability of {share_in_words(chance, 'second')} in {second}, "
            f"in place of {share_in_words(chance, 'first')} in {first}"
        )
        for quantity, (words, unit) in LARGEST.items():
            if quantity in of:
                before, after = (_at_least(of[quantity], end, unit) for end in ("first", "second"))
                text += f"; {words} {after} in place of {before}"
        yield f"{text}."
    if same:
        yield f"Not reached in either: {', '.join(same)}."


def _at_least(row: Mapping[Hashable, Any], end: str, unit: str) -> str:
    """Write a largest value with its bounds, whose upper one runs that are not known in full leave open."""
    value, lower, upper = (row[f"{end}{bound}"] for bound in ("", "_lower", "_upper"))
    if np.isnan(upper):
        return f"at least {short(lower)} {unit}" if lower > 0 else "an unknown one"
    return f"{between(*map(short, (value, lower, upper)))} {unit}"


def _receptors(table: pd.DataFrame, first: str, second: str) -> Table:
    """Table what reaches receptors, those left out that nothing reaches."""
    chances = table[table["quantity"] == "probability"].set_index("receptor")
    reached = ((chances["first_upper"] > 0) | (chances["second_upper"] > 0)).to_dict()
    rows = []
    for row in table.to_dict("records"):
        if reached[row["receptor"]]:
            rows.append([str(row["receptor"]), *_cells(row)])
    return Table("Receptors", ["receptor", "quantity", first, second, "difference"], rows, NOTE)


def _sections(table: pd.DataFrame, first: str, second: str) -> Table:
    """Table what passes sections."""
    rows = [[str(row["section"]), *_cells(row)] for row in table.to_dict("records")]
    return Table("Sections", ["section", "quantity", first, second, "difference"], rows, OF_SECTIONS)


def _cells(row: Mapping[Hashable, Any]) -> list[str]:
    """Give the quantity of a row with its units, and its numbers with their bounds."""
    unit = written(str(row["units"]).replace("year-1", "a year"))
    quantity = str(row["quantity"]).replace("_", " ")
    numbers = (_bounded([row[f"{end}{bound}"] for bound in ("", "_lower", "_upper")]) for end in ENDS)
    return [f"{quantity} ({unit})" if unit else quantity, *numbers]


def _bounded(numbers: Sequence[float]) -> str:
    return between(*(short(number) for number in numbers))
