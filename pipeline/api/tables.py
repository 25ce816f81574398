"""Table runs, quantiles, receptors and sensitivity."""

from __future__ import annotations

from collections.abc import Sequence
from os import PathLike
from pathlib import Path
from typing import TYPE_CHECKING

from pipeline.api.emulation import emulated
from pipeline.api.options import Tell, extra, silent, warn_user
from pipeline.api.places import place_of, writable

if TYPE_CHECKING:
    import pandas as pd

    from pipeline.api.places import Anywhere, Place


def assessment_tables(
    out: Place,
    *,
    to: str | PathLike[str] | None = None,
    kinds: Sequence[str] = ("csv", "md"),
    emulate: bool = False,
    tell: Tell = silent,
    warn: Tell = warn_user,
) -> dict[str, pd.DataFrame]:
    """Table runs, quantiles by scenario, the run-out curve and receptors, with bounds.

    Parameters
    ----------
    out : path, str or Results
        The place.
    to : path, optional
        Folder that the tables are written to; by default nothing is written.
    kinds : sequence of str
        How they are written: ``csv``, ``parquet``, ``md``.
    emulate : bool
        Whether to add the tables of `emulate`.
    tell, warn : callable
        Told the path of each file, and what cannot be emulated.

    Returns
    -------
    dict of str to DataFrame
        ``runs``, ``scenarios``, ``runout-exceedance``, ``receptors`` and ``receptor-runs``, emulated ones
        where they are asked for; those that have no row are left out.

    Raises
    ------
    FileNotFoundError
        If the place holds no store.
    ValueError
        If a store lacks a field that its receptors need.
    ImportError
        If Parquet is asked for without pyarrow.
    """
    from pipeline.assess.tables import assess, write

    made = assess(place_of(out))
    if emulate:
        from pipeline.emulation.emulate import TABLES, table_of

        found = [each for _, each in emulated(out, {}, warn)]
        added = {name: table_of(found, name) for name in TABLES}
        made |= {name: table for name, table in added.items() if len(table)}
    if to is not None:
        with extra("parquet"):
            for path in write(made, Path(to), list(kinds)):
                tell(str(path))
    return made


def sensitivity_indices(out: Place, *, to: Anywhere | None = None, warn: Tell = warn_user) -> pd.DataFrame:
    """Table which varied parameter drives run-out, deposit and what reaches receptors.

    Parameters
    ----------
    out : path, str or Results
        The place.
    to : path, optional
        Table that is written, ``.csv``, ``.parquet`` or ``.md``; by default nothing is written.
    warn : callable
        Told which scenario or quantity has no indices, and why.

    Returns
    -------
    DataFrame
        A row per scenario, quantity, parameter and index: PAWN's, and Sobol's for the design ``saltelli``.

    Raises
    ------
    FileNotFoundError
        If the place holds no store.
    ImportError
        If SALib is not installed, or Parquet is asked for without pyarrow.
    """
    from pipeline.assess.sensitivity import sensitivity_indices as indices
    from pipeline.store import run_table as table

    with extra("sensitivity"):
        found = indices(place_of(out), warn)
    if to is not None and len(found):
        with extra("parquet"):
            table.write(found, writable(to))
    return found
