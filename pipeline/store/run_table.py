"""The table over all scenarios of a place: one row a run."""

from __future__ import annotations

from io import BytesIO
from pathlib import Path

import pandas as pd

from pipeline.store import storage
from pipeline.store.place import store_paths
from pipeline.store.variables import PER_RUN, RETURN_PERIOD, STATUS, WEIGHT, Status
from pipeline.store.zarr_store import open_store

HEAD = ("scenario", "run", "status")
SHARES = (WEIGHT.name, RETURN_PERIOD.name)


def read(out: Path) -> pd.DataFrame:
    """Read the table of a place from its stores.

    Parameters
    ----------
    out : Path
        The place.

    Returns
    -------
    DataFrame
        One row a run, failed and pending ones included: scenario, run, status in words, the varied
        parameters of all scenarios, weight and return period, then every variable per run. What is not
        known is missing.

    Raises
    ------
    FileNotFoundError
        If the place holds no store.
    """
    tables = [_rows(path) for path in store_paths(out)]
    names = dict.fromkeys(name for table in tables for name in table.columns)
    known = [*HEAD, *SHARES, *(v.name for v in PER_RUN)]
    whole = pd.concat(tables, ignore_index=True)
    varied = [name for name in names if name not in known]
    return whole[[*HEAD, *varied, *(name for name in known[len(HEAD) :] if name in names)]]


def _rows(path: Path) -> pd.DataFrame:
    """Rows of one store."""
    with open_store(path) as store:
        given = [str(name) for name, c in store.coords.items() if c.dims == ("run",) and name != "run"]
        names = [*sorted(given, key=SHARES.__contains__), *(v.name for v in PER_RUN)]
        table = pd.DataFrame({name: store[name].to_numpy() for name in names})
        counts = [v.name for v in PER_RUN if v.dtype == "int64"]
        table[counts] = table[counts].astype("Int64")
        table.insert(0, "status", [Status(s).words for s in store[STATUS.name].to_numpy()])
        table.insert(0, "run", store["run"].to_numpy())
        table.insert(0, "scenario", str(store.attrs["title"]))
    return table


def write(table: pd.DataFrame, path: Path) -> None:
    """Write the table as the ending of the path says, a file that was there is replaced.

    ``.parquet`` and ``.md`` are Parquet and Markdown, all else is CSV.

    Raises
    ------
    OSError
        If it cannot be written.
    ImportError
        If Parquet is asked for without pyarrow.
    """
    held = BytesIO()
    if path.suffix == ".parquet":
        table.to_parquet(held, index=False)
    elif path.suffix == ".md":
        held.write(markdown(table).encode())
    else:
        table.to_csv(held, index=False)
    storage.put(path, held.getvalue())


def markdown(table: pd.DataFrame) -> str:
    """Give a table in Markdown, numbers to four digits."""
    lines = [" | ".join(map(_cell, table.columns)), " | ".join("---" for _ in table.columns)]
    for row in table.itertuples(index=False):
        lines.append(" | ".join(map(_cell, row)))
    return "".join(f"| {line} |\n" for line in lines)


def _cell(value: object) -> str:
    """Write a value so that no mark or end of a line in it ends its cell."""
    return " ".join(text(value).replace("\\", "\\\\").replace("|", "\\|").split())


def text(value: object) -> str:
    """Write a value for people, a number to four digits; a missing one as a dash."""
    if value is pd.NA or value != value:
        return "-"
    return f"{value:.4g}" if isinstance(value, float) else str(value)
