"""Files of points: CSV with the columns x and y, or NetCDF with variables of these names."""

from __future__ import annotations

import hashlib
import re
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from pipeline.inputs import text_table
from pipeline.inputs.text_table import METRES
from pipeline.mistakes import BadInput, Mistake

COLUMNS = ("x", "y")
WANTED = "a CSV file with the columns x and y"
NETCDF = (".nc", ".nc4", ".cdf")
# what pandas says of a line with more cells than the first
_UNEVEN = re.compile(r"Expected (\d+) fields in line (\d+), saw (\d+)")


@dataclass(frozen=True, eq=False)
class PointFile:
    """Coordinates of points, shape (n, 2), m, and the SHA-256 of them."""

    points: NDArray[np.float64]
    digest: str


def read(path: Path) -> PointFile:
    """Read the points of a file, by its suffix.

    Raises
    ------
    BadInput
        If a column is missing, or a line of a CSV is not numbers.
    OSError
        If the file cannot be read.
    """
    points = _read_netcdf(path) if path.suffix in NETCDF else _read_csv(path)
    return PointFile(points, hashlib.sha256(points.tobytes()).hexdigest())


def _read_csv(path: Path) -> NDArray[np.float64]:
    # pandas takes longer to import than a scenario to check
    import pandas as pd

    found = text_table.obstacle(path)
    if found is not None:
        raise BadInput([Mistake(str(path), 1, 1, "", f"expected {WANTED}, found {found}")])
    try:
        frame = pd.read_csv(
            path, skipinitialspace=True, encoding="utf-8-sig", dtype=str, keep_default_na=False
        )
    except (pd.errors.ParserError, pd.errors.EmptyDataError, UnicodeDecodeError) as error:
        if uneven := _UNEVEN.search(str(error)):
            wanted, line, found = uneven.groups()
            raise BadInput([_more(path, int(wanted), int(line), found)]) from None
        found = f"expected a CSV file, found {str(error).rpartition('error: ')[2].strip()}"
        raise BadInput([Mistake(str(path), 1, 1, "", found)]) from None
    if not isinstance(frame.index, pd.RangeIndex):
        # pandas takes what stands before the first heading for names of rows
        raise BadInput([_more(path, len(frame.columns), 2, "more")])
    headings = [text_table.heading(str(name)) for name in frame]
    at = [text_table.column(headings, (name,)) for name in COLUMNS]
    if [len(each) for each in at] != [1, 1]:
        raise _missing(path, list(map(str, frame)))
    for (i,) in at:
        if headings[i].unit not in METRES:
            found = f"expected m, km or ft as the unit of a heading, found {headings[i].text}"
            raise BadInput([Mistake(str(path), 1, 1, "", found)])
    cells = frame.iloc[:, [i for (i,) in at]]
    numbers: NDArray[np.float64] = cells.apply(pd.to_numeric, errors="coerce").to_numpy(np.float64)
    wrong = np.argwhere(~np.isfinite(numbers))
    if len(wrong):
        raise text_table.told(
            [
                Mistake(
                    str(path),
                    int(row) + 2,
                    1,
                    COLUMNS[column],
                    text_table.wrong_number(str(cells.iloc[row, column])),
                )
                for row, column in wrong
            ]
        )
    return numbers * [METRES[headings[i].unit] for (i,) in at]


def _read_netcdf(path: Path) -> NDArray[np.float64]:
    import netCDF4

    with netCDF4.Dataset(path) as data:
        if any(name not in data.variables for name in COLUMNS):
            raise _missing(path, list(data.variables))
        columns = [np.ma.filled(data[name][...].astype(np.float64), np.nan).ravel() for name in COLUMNS]
    if len(columns[0]) != len(columns[1]):
        found = f"expected as many x as y, found {len(columns[0])} and {len(columns[1])}"
        raise BadInput([Mistake(str(path), 1, 1, "", found)])
    points = np.stack(columns, axis=1)
    wrong = np.flatnonzero(~np.isfinite(points).all(axis=1))
    if len(wrong):
        found = (
            f"expected finite numbers, found other ones at {len(wrong)} points, the first number {wrong[0]}"
        )
        raise BadInput([Mistake(str(path), 1, 1, "", found)])
    return points


def _more(path: Path, wanted: int, line: int, found: str) -> Mistake:
    said = f"expected {wanted} values a line, one a heading, found {found}; {text_table.POINTS}"
    return Mistake(str(path), line, 1, "", said)


def _missing(path: Path, names: list[str]) -> BadInput:
    found = f"expected the columns x and y, found {', '.join(names)}"
    return BadInput([Mistake(str(path), 1, 1, "", found)])
