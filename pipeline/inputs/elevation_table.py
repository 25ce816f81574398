"""Elevation tables: CSV files of horizontal distance and elevation along a profile."""

from __future__ import annotations

import hashlib
import re
from collections.abc import Sequence
from dataclasses import dataclass
from itertools import pairwise
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from pipeline.inputs import text_table
from pipeline.inputs.text_table import METRES, Heading, Row
from pipeline.mistakes import BadInput, Mistake

WANTED = "a CSV of distance and elevation along the profile"
# headings that are understood, in small letters, without their unit
DISTANCE = frozenset(
    (
        "distance",
        "distances",
        "dist",
        "d",
        "x",
        "station",
        "chainage",
        "stationing",
        "horizontal_distance",
        "horizontal_dist",
        "distance_horizontal",
        "profile_distance",
        "distance_along_profile",
        "cumulative_distance",
        "cum_dist",
        "distanz",
        "abstand",
        "entfernung",
        "horizontaldistanz",
    )
)
ELEVATION = frozenset(
    (
        "elevation",
        "elevations",
        "elev",
        "z",
        "h",
        "height",
        "altitude",
        "alt",
        "elevation_asl",
        "bed_elevation",
        "ground_elevation",
        "höhe",
        "hoehe",
        "kote",
    )
)
# headings of places on the map, whose x is no distance along a profile
_ON_MAP = frozenset(
    (
        "y",
        "e",
        "n",
        "east",
        "north",
        "easting",
        "northing",
        "lat",
        "lon",
        "latitude",
        "longitude",
        "ost",
        "nord",
    )
)
# what rasters hold where they hold nothing
NO_DATA = frozenset((-9999.0, -99999.0, -999999.0, -32768.0, -32767.0, 9999.0, 99999.0, 999999.0))
LARGEST = 1e6
# what elevations are counted from, behind their unit: "m a.s.l.", "m ü. M.", "m NHN"
_ABOVE_SEA = re.compile(
    r"\s*(a ?s ?l|a ?m ?s ?l|above (mean )?sea level|ü ?m|ü ?nn|(ü ?)?nhn|nn|s ?n ?m|s ?l ?m)$"
)
# no bed of loose material is steeper, degrees
STEEP = 60.0


@dataclass(frozen=True, eq=False)
class ElevationTable:
    """Horizontal distances, increasing, and elevations, shape (n,), m, and the SHA-256 of both.

    Parameters
    ----------
    doubts : tuple of str
        What to warn of, a line each.
    """

    distances: NDArray[np.float64]
    elevations: NDArray[np.float64]
    digest: str
    doubts: tuple[str, ...] = ()


def read(path: Path) -> ElevationTable:
    """Read a CSV with the columns distance and elevation, found by their headings.

    Units in headings, as in ``distance (ft)``, are brought to m; without one it is m. Other columns are left
    out.

    Raises
    ------
    BadInput
        If it is no such table, with every line that is not finite numbers, where distance does not increase,
        and where an elevation is what rasters hold where they have no data.
    OSError
        If the file cannot be read.
    """
    headings, rows = text_table.split(path, text_table.read_text(path, WANTED))
    at = _columns(path, headings)
    factors = [METRES[_unit(headings[i])] for i in at]
    numbers: list[tuple[float, float]] = []
    mistakes: list[Mistake] = []
    for row in rows:
        found = _numbers(path, headings, row, at, mistakes)
        if found is not None:
            numbers.append((found[0] * factors[0], found[1] * factors[1]))
    mistakes += _order(path, [row.line for row in rows], numbers) if not mistakes else []
    if not mistakes and len(numbers) < 2:
        found_few = f"expected a line of headings and two or more of numbers, found {len(numbers)} of numbers"
        mistakes.append(Mistake(str(path), 1, 1, "", found_few))
    if mistakes:
        raise text_table.told(mistakes)
    held = np.array(numbers)
    digest = hashlib.sha256(held.tobytes()).hexdigest()
    return ElevationTable(held[:, 0].copy(), held[:, 1].copy(), digest, tuple(_doubts(held)))


def _columns(path: Path, headings: Sequence[Heading]) -> tuple[int, int]:
    """Find the columns of distance and elevation by their headings."""
    shown = ", ".join(each.text for each in headings)
    found = [text_table.column(headings, names) for names in (DISTANCE, ELEVATION)]
    names = {each.name for each in headings}
    if found[0] and all(headings[i].name == "x" for i in found[0]) and names & _ON_MAP:
        message = (
            f"expected the headings distance and elevation, found places on the map ({shown}); "
            "distance is counted along the profile"
        )
        raise BadInput([Mistake(str(path), 1, 1, "", message)])
    if [len(each) for each in found] != [1, 1]:
        again = " more than once" if max(map(len, found)) > 1 and min(map(len, found)) > 0 else ""
        message = f"expected the headings distance and elevation, found {shown}{again}"
        raise BadInput([Mistake(str(path), 1, 1, "", message)])
    for (i,) in found:
        if _unit(headings[i]) not in METRES:
            message = f"expected m, km or ft as the unit of a heading, found {headings[i].text}"
            raise BadInput([Mistake(str(path), 1, 1, "", message)])
    return found[0][0], found[1][0]


def _unit(heading: Heading) -> str:
    """Give the unit of a heading without what elevations are counted from."""
    return _ABOVE_SEA.sub("", heading.unit)


def _numbers(
    path: Path, headings: Sequence[Heading], row: Row, at: tuple[int, int], mistakes: list[Mistake]
) -> tuple[float, float] | None:
    """Distance and elevation of a row, or None with what is wrong with it."""
    if (uneven := text_table.uneven(path, headings, row)) is not None:
        mistakes.append(uneven)
        return None
    values: list[float] = []
    for name, i in zip(("distance", "elevation"), at, strict=True):
        value, message = text_table.number(row.cells[i]), ""
        if value is None:
            message = text_table.wrong_number(row.cells[i])
        elif name == "elevation" and (value in NO_DATA or abs(value) > LARGEST):
            message = f"expected an elevation, found {value:.15g}, which means no data; leave the row out"
        if message:
            mistakes.append(Mistake(str(path), row.line, row.columns[i], name, message))
        elif value is not None:
            values.append(value)
    return (values[0], values[1]) if len(values) == 2 else None


def _order(path: Path, lines: Sequence[int], numbers: Sequence[tuple[float, float]]) -> list[Mistake]:
    """List where distances do not increase; once, where all of them decrease."""
    distances = [distance for distance, _ in numbers]
    if len(distances) > 2 and all(after < before for before, after in pairwise(distances)):
        message = "expected increasing distances, found decreasing ones; sort the rows by distance"
        if all(before[1] < after[1] for before, after in pairwise(numbers)):
            message += ", or exchange the headings if they stand over the wrong columns"
        return [Mistake(str(path), lines[0], 1, "distance", message)]
    return [
        Mistake(
            str(path),
            line,
            1,
            "distance",
            f"expected a number above {before:.15g}, the one before, found {after:.15g}",
        )
        for line, (before, after) in zip(lines[1:], pairwise(distances), strict=True)
        if after <= before
    ]


def _doubts(table: NDArray[np.float64]) -> list[str]:
    """Say what is unlikely of a profile that can be read."""
    distances, elevations = table.T
    found = []
    if distances[0] != 0:
        found.append(
            f"distances begin at {distances[0]:.6g} m: x is counted from there, horizontal distance and the "
            "origin of a georeference from the table's own 0"
        )
    if elevations[-1] > elevations[0]:
        found.append(
            f"elevation rises from {elevations[0]:.6g} to {elevations[-1]:.6g} m along the profile: what is "
            "released flows toward smaller x"
        )
    slopes = np.degrees(np.arctan(np.diff(elevations) / np.diff(distances)))
    steep = np.flatnonzero(np.abs(slopes) > STEEP)
    if len(steep):
        first = steep[np.abs(slopes[steep]).argmax()]
        found.append(
            f"{len(steep)} piece{'s' * (len(steep) > 1)} of the profile steeper than {STEEP:g} degrees, the "
            f"steepest {abs(slopes[first]):.3g} degrees from distance {distances[first]:.6g} to "
            f"{distances[first + 1]:.6g} m: check columns, units and rows"
        )
    return found
