"""Open what runs have left: stores and the table of runs."""

from __future__ import annotations

from os import PathLike
from pathlib import Path
from typing import TYPE_CHECKING

from pipeline.api.options import extra
from pipeline.api.places import find_place, find_store, located_anywhere, place_of, writable
from pipeline.errors import OptionError

if TYPE_CHECKING:
    import pandas as pd
    import xarray as xr

    from pipeline.api.places import Anywhere, Place
    from pipeline.results import Results

TABLE_FILES = (".csv", ".parquet", ".md")


def open(path: str | PathLike[str]) -> xr.Dataset | Results:
    """Open a store, or all stores of a place.

    Parameters
    ----------
    path : path or str
        Store of a scenario, ``<out>/<name>.zarr``, or the place ``<out>``; a folder or a URL.

    Returns
    -------
    Dataset or Results
        The store as an `xarray.Dataset`, its values read when they are used; of a place the datasets by name
        of scenario, with the table of runs.

    Raises
    ------
    FileNotFoundError
        If there is neither.
    """
    from pipeline.results import Results, open_lazily

    found = located_anywhere(path)
    return open_lazily(find_store(found)) if found.suffix == ".zarr" else Results(find_place(found))


def to_lattice(store: xr.Dataset, spacing: float | None = None) -> xr.Dataset:
    """Evaluate the fields of a cloud's store at the points of a lattice, by LMLS, with the volume kept.

    Parameters
    ----------
    store : Dataset
        Store of a scenario on a cloud of points; that of a lattice is given back as it is.
    spacing : float, optional
        Of the lattice, m; by default the mean spacing of the cloud.

    Returns
    -------
    Dataset
        With the dimensions ``y`` and ``x`` in place of ``point``.
    """
    from pipeline.assess.frames import mean_spacing
    from pipeline.assess.gridding import gridded

    if "point" not in store.dims and spacing is None:
        return store
    return gridded(store, mean_spacing(store) if spacing is None else spacing)


def run_table(out: Place, *, to: Anywhere | None = None) -> pd.DataFrame:
    """Read the table of a place: a row per run.

    Parameters
    ----------
    out : path, str or Results
        The place.
    to : path, optional
        File that it is written to, ``.csv``, ``.parquet`` or ``.md``; by default nothing is written.

    Returns
    -------
    DataFrame
        Scenario, run, status, the varied parameters and every summary; failed and pending runs included.

    Raises
    ------
    FileNotFoundError
        If the place holds no store.
    OptionError
        If the file ends otherwise.
    """
    from pipeline.store import run_table as table

    if to is not None and Path(str(to)).suffix not in TABLE_FILES:
        raise OptionError("to", f"expected a file ending in {', '.join(TABLE_FILES)}, found '{to}'")
    found = table.read(place_of(out))
    if to is not None:
        with extra("parquet"):
            table.write(found, writable(to))
    return found
