"""Tables of numbers in text files: the kind of file, headings with their units, and cells by line."""

from __future__ import annotations

import csv
import re
from collections.abc import Collection, Iterator, Mapping, Sequence
from dataclasses import dataclass
from math import isfinite
from pathlib import Path

from pipeline.mistakes import BadInput, Mistake

# what more cells than headings are likely of
POINTS = "decimals take a point, not a comma"
# mistakes of one file that are told one by one
MOST_TOLD = 10
SAMPLED = 4096
# first bytes of files that are taken for tables, and what to do with them
_KINDS: tuple[tuple[bytes, str, str], ...] = (
    (b"II*\0", "a TIFF raster", "raster"),
    (b"MM\0*", "a TIFF raster", "raster"),
    (b"II+\0", "a TIFF raster", "raster"),
    (b"MM\0+", "a TIFF raster", "raster"),
    (b"\x89HDF", "an HDF5 or NetCDF file", "raster"),
    (b"CDF", "a NetCDF file", "raster"),
    (b"DSAA", "a Surfer grid", "raster"),
    (b"DSBB", "a Surfer grid", "raster"),
    (b"PK\3\4", "a spreadsheet or another zipped file", "sheet"),
    (b"\xd0\xcf\x11\xe0", "a spreadsheet (xls)", "sheet"),
    (b"SQLite format 3", "a GeoPackage or another database", "layer"),
    (b"\0\0\x27\x0a", "a shapefile", "layer"),
    (b"LASF", "a point cloud (LAS)", "layer"),
    (b"%PDF", "a PDF", "other"),
    (b"\x89PNG", "a picture", "other"),
    (b"\xff\xd8\xff", "a picture", "other"),
    (b"\xff\xfe", "text in UTF-16", "text"),
    (b"\xfe\xff", "text in UTF-16", "text"),
)
_FIXES = {
    "raster": "sample it along the profile and save distance and elevation as CSV",
    "sheet": "save the sheet as CSV, separated by commas",
    "layer": "export its table as CSV, separated by commas",
    "text": "save it in UTF-8",
    "other": "",
}
_GRID = re.compile(r"\s*(ncols|nrows|xllcorner|xllcenter|north:)\s", re.IGNORECASE)
METRES: Mapping[str, float] = {
    **dict.fromkeys(("", "m", "metre", "metres", "meter", "meters"), 1.0),
    **dict.fromkeys(("km", "kilometre", "kilometres", "kilometer", "kilometers"), 1000.0),
    **dict.fromkeys(("cm", "centimetre", "centimetres"), 0.01),
    **dict.fromkeys(("mm", "millimetre", "millimetres"), 0.001),
    **dict.fromkeys(("ft", "foot", "feet", "ift"), 0.3048),
    **dict.fromkeys(("ftus", "us ft", "usft", "us-ft", "survey feet"), 1200 / 3937),
}
# a name, and its unit in brackets or behind a slash, an underscore or a space
_HEADING = re.compile(r"(?P<name>.*?)\s*(?:[(\[](?P<bracket>[^)\]]*)[)\]]|/\s*(?P<slash>[\w ]+))?\s*")
_DECIMAL_COMMA = re.compile(r"[-+]?\d+,\d+([eE][-+]?\d+)?")
_THOUSANDS = re.compile(r"[-+]?\d{1,3}([,' \u2019\u00a0]\d{3})+(\.\d+)?")


@dataclass(frozen=True)
class Heading:
    """A heading as it stands, its name in small letters without the unit, and the unit, empty for none."""

    text: str
    name: str
    unit: str


@dataclass(frozen=True)
class Row:
    """The cells of a line; ``columns`` is where each begins. Lines and columns count from 1."""

    line: int
    cells: tuple[str, ...]
    columns: tuple[int, ...]


def read_text(path: Path, wanted: str) -> str:
    """Read the text of a table, or refuse what is none.

    Parameters
    ----------
    path : Path
        The file.
    wanted : str
        What it should be, for the message.

    Raises
    ------
    BadInput
        If the file is a raster, a spreadsheet or anything else that is not text.
    OSError
        If it cannot be read.
    """
    data = path.read_bytes()
    found = kind(data[:SAMPLED])
    if found is not None:
        raise BadInput([Mistake(str(path), 1, 1, "", f"expected {wanted}, found {found}")])
    return data.decode("utf-8-sig", errors="replace")


def kind(head: bytes) -> str | None:
    """Say what a file is by its first bytes and what to do with it; None where it may be a table."""
    for magic, name, use in _KINDS:
        if head.startswith(magic):
            return "; ".join(filter(None, (name, _FIXES[use])))
    if b"\0" in head:
        return "a binary file"
    text = head.decode("utf-8-sig", errors="replace").lstrip()
    if _GRID.match(text):
        return f"a grid of elevations; {_FIXES['raster']}"
    if text.startswith(("{", "<")):
        return f"a file of {'JSON' if text[0] == '{' else 'XML'}; {_FIXES['layer']}"
    return None


def obstacle(path: Path) -> str | None:
    """Say what a file is and what to do with it, if it is no table with commas between its columns.

    Raises
    ------
    OSError
        If it cannot be read.
    """
    with path.open("rb") as file:
        head = file.read(SAMPLED)
    lines = head.decode("utf-8-sig", errors="replace").splitlines() or [""]
    other = separators(lines[0])
    return kind(head) or (None if other is None else _separated(other, lines[1:]))


def separators(line: str) -> str | None:
    """Say what separates the columns of a line of headings if it is not commas; None where it is."""
    if "," in line:
        return None
    for mark, name in ((";", "semicolons"), ("\t", "tabs"), ("|", "bars")):
        if mark in line:
            return name
    return None


def _separated(by: str, lines: Sequence[str]) -> str:
    """Say what separates columns, and whether commas stand in numbers."""
    commas = " and decimal commas" if any(map(_DECIMAL_COMMA.search, lines[:20])) else ""
    return f"{by}{commas}; save it as CSV with commas between columns and points in numbers"


def split(path: Path, text: str) -> tuple[list[Heading], list[Row]]:
    """Split a table into its headings and rows; empty lines and lines of comment (``#``) are left out.

    Where numbers come next, the last comment before them holds the headings.

    Raises
    ------
    BadInput
        If there is no line of headings, or columns are not separated by commas.
    """
    whole = [(at, line) for at, line in enumerate(text.splitlines(), 1) if line.strip(' ,"\t')]
    lines = [(at, line) for at, line in whole if not line.lstrip().startswith("#")]
    before = [each for each in whole if not lines or each[0] < lines[0][0]]
    if before and (not lines or any(number(cell) is not None for cell in _cells(lines[0][1]))):
        lines = [before[-1], *lines]
    if not lines:
        raise BadInput([Mistake(str(path), 1, 1, "", "expected a line of headings, found an empty file")])
    (first, head), *rest = lines
    other = separators(head)
    if other is not None:
        found = _separated(other, [line for _, line in rest])
        message = f"expected columns separated by commas, found {found}"
        raise BadInput([Mistake(str(path), first, 1, "", message)])
    names = _cells(head.lstrip("# "))
    if all(number(cell) is not None for cell in names):
        found = f"expected a line of headings, found '{head}'"
        raise BadInput([Mistake(str(path), first, 1, "", found)])
    rows = []
    for at, line in rest:
        cells = _cells(line)
        rows.append(Row(at, tuple(cells), tuple(_places(line, cells))))
    return [heading(name) for name in names], rows


def heading(text: str) -> Heading:
    """Take a heading apart: ``Distance (ft)`` and ``distance_ft`` are ``distance`` in ``ft``."""
    found = _HEADING.fullmatch(text.strip())
    assert found is not None
    name, unit = found["name"].strip(), found["bracket"] or found["slash"] or ""
    name = re.sub(r"[\s_.\-]+", "_", name.casefold()).strip("_")
    unit = " ".join(unit.casefold().replace(".", "").split())
    if not unit and "_" in name and name.rpartition("_")[2] in METRES:
        name, _, unit = name.rpartition("_")
    return Heading(text.strip(), name, unit)


def column(headings: Sequence[Heading], names: Collection[str]) -> list[int]:
    """Find the columns whose heading is one of some names."""
    return [i for i, each in enumerate(headings) if each.name in names]


def uneven(path: Path, headings: Sequence[Heading], row: Row) -> Mistake | None:
    """Say that a row has more or fewer cells than there are headings; None where it has as many."""
    wanted, found = len(headings), len(row.cells)
    if found == wanted:
        return None
    expected = f"expected {wanted} values, {', '.join(each.text for each in headings)}, found {found}"
    if found < wanted:
        return Mistake(str(path), row.line, row.columns[-1], "", expected)
    return Mistake(str(path), row.line, row.columns[wanted], "", f"{expected}; {POINTS}")


def number(text: str) -> float | None:
    """Give the finite number that a cell holds, or None."""
    try:
        # Python's own underscores are no part of a number elsewhere
        value = float(text) if "_" not in text else float("nan")
    except ValueError:
        return None
    return value if isfinite(value) else None


def wrong_number(text: str) -> str:
    """Say what is expected of a cell that holds no finite number, and what was found."""
    text = text.strip()
    if _THOUSANDS.fullmatch(text):
        return f"expected a number without separators in it, found '{text}'"
    if _DECIMAL_COMMA.fullmatch(text):
        return f"expected a number with a decimal point, found '{text}'"
    return f"expected a finite number, found '{text}'"


def told(mistakes: Sequence[Mistake]) -> BadInput:
    """Make the error of a file's mistakes; of many the first ones, and how many more there are."""
    if len(mistakes) <= MOST_TOLD:
        return BadInput(mistakes)
    last = sorted(mistakes)[MOST_TOLD]
    more = f"and {len(mistakes) - MOST_TOLD:,} more mistakes from here on"
    return BadInput([*sorted(mistakes)[:MOST_TOLD], Mistake(last.file, last.line, last.column, "", more)])


def _cells(line: str) -> list[str]:
    return [cell.strip() for cell in next(csv.reader([line], skipinitialspace=True))]


def _places(line: str, cells: Sequence[str]) -> Iterator[int]:
    """Columns at which cells begin, quotes included, counted from 1."""
    at = 0
    for cell in cells:
        yield at + 1
        # within quotes there may be commas
        at = line.find(",", max(at, line.find(cell, at) + len(cell))) + 1
