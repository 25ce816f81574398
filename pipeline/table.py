"""The table over all scenarios of a place: one row a run."""

from __future__ import annotations

from io import BytesIO
from pathlib import Path

import pandas as pd

from pipeline import elsewhere
from pipeline.place import store_paths
from pipeline.store import open_store
from pipeline.variables import PER_RUN, STATUS, Status

HEAD = ("scenario", "run", "status")


def read(out: Path) -> pd.DataFrame:
    """Read the table of a place from its stores.

    Parameters
    ----------
    out : Path
        The place.

    Returns
    -------
    DataFrame
        One row a run, failed and pending ones included: scenario, run, status in words, the swept
        parameters of all scenarios, then every variable per run. What is not known is missing.

    Raises
    ------
    FileNotFoundError
        If the place holds no store.
    """
    tables = [_rows(path) for path in store_paths(out)]
    swept = dict.fromkeys(name for table, names in tables for name in names)
    measured = [v.name for v in PER_RUN]
    whole = pd.concat([table for table, _ in tables], ignore_index=True)
    return whole[[*HEAD, *(n for n in swept if n not in measured), *measured]]


def _rows(path: Path) -> tuple[pd.DataFrame, list[str]]:
    """Rows of one store, and the names of its swept parameters."""
    with open_store(path) as store:
        swept = [str(name) for name, c in store.coords.items() if c.dims == ("run",) and name != "run"]
        names = [*swept, *(v.name for v in PER_RUN)]
        table = pd.DataFrame({name: store[name].to_numpy() for name in names})
        table["steps"] = table["steps"].astype("Int64")
        table.insert(0, "status", [Status(s).words for s in store[STATUS.name].to_numpy()])
        table.insert(0, "run", store["run"].to_numpy())
        table.insert(0, "scenario", str(store.attrs["title"]))
    return table, swept


def write(table: pd.DataFrame, path: Path) -> None:
    """Write the table as Parquet where the path ends so, else as CSV; a file that was there is replaced.

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
    else:
        table.to_csv(held, index=False)
    elsewhere.put(path, held.getvalue())
