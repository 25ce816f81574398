"""The table over all scenarios of a place: one row a run."""

from __future__ import annotations

from io import BytesIO

import numpy as np
import pandas as pd

from pipeline.store.place import store_paths, with_levels
from pipeline.store.storage import Location, put
from pipeline.store.variables import FIELDS, PER_RUN, RETURN_PERIOD, STATUS, WEIGHT, Status
from pipeline.store.zarr_store import values_of_runs

HEAD = ("scenario", "run", "status")
SHARES = (WEIGHT.name, RETURN_PERIOD.name)
# relative error of volume; a sum of doubles has none that is smaller
ERROR = "volume_error"
ROUND_OFF = 1e-15
UNITS = {variable.name: variable.units for variable in (WEIGHT, RETURN_PERIOD, *FIELDS, *PER_RUN)} | {
    **{"time": "s", "arrival": "s", "depth": "m", "speed": "m s-1", "pressure": "kPa"},
    **{"volume": "m3", "peak_discharge": "m3 s-1", "peak_time": "s", "arrival_time": "s"},
    **{"half_width": "m", "deepest": "m", "body_speed": "m s-1", "film_speed": "m s-1"},
    **{"runout_misfit": "m", "depth_rmse": "m"},
}


def read(out: Location) -> pd.DataFrame:
    """Read the table of a place from its stores.

    Parameters
    ----------
    out : Location
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
    tables = [_rows(path) for path in with_levels(store_paths(out))]
    names = dict.fromkeys(name for table in tables for name in table.columns)
    known = [*HEAD, *SHARES, *(v.name for v in PER_RUN)]
    whole = pd.concat(tables, ignore_index=True)
    varied = [name for name in names if name not in known]
    whole = whole[[*HEAD, *varied, *(name for name in known[len(HEAD) :] if name in names)]]
    whole.attrs["units"] = {name: unit for table in tables for name, unit in table.attrs["units"].items()}
    return whole


def _rows(path: Location) -> pd.DataFrame:
    """Rows of one store."""
    values, attributes = values_of_runs(path)
    given = str(attributes[""].get("coordinates", "")).split()
    parameters = [name for name in values if name in given and name not in SHARES]
    shares = [name for name in SHARES if name in values]
    names = [*parameters, *shares, *(v.name for v in PER_RUN)]
    # words stay Python's own
    table = pd.DataFrame({name: pd.Series(v, dtype=v.dtype) for name, v in values.items() if name in names})
    table = table.reindex(columns=names)
    for variable in PER_RUN:
        # variables that are younger than the store are missing in every run
        if variable.dtype == "int64":
            whole = table[variable.name].astype("Int64")
            table[variable.name] = whole.mask(whole == variable.fill)
        elif variable.name not in values:
            table[variable.name] = "" if variable.dtype == "string" else np.nan
    table.insert(0, "status", [Status(s).words for s in values[STATUS.name]])
    table.insert(0, "run", values["run"])
    table.insert(0, "scenario", str(attributes[""]["title"]))
    younger = {variable.name: variable.cf_attributes for variable in PER_RUN} | attributes
    table.attrs["units"] = {name: str(younger[name].get("units", "")) for name in names}
    return table


def write(table: pd.DataFrame, path: Location) -> None:
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
    put(path, held.getvalue())


def markdown(table: pd.DataFrame) -> str:
    """Give a table in Markdown: units in the headings, numbers to four digits."""
    known = units(table)
    heads = [f"{name} ({known[name]})" if known.get(name) else name for name in map(str, table.columns)]
    lines = [" | ".join(map(_cell, heads)), " | ".join("---" for _ in heads)]
    for row in table.itertuples(index=False):
        cells = (text(value, error=name == ERROR) for name, value in zip(table.columns, row, strict=True))
        lines.append(" | ".join(map(_cell, cells)))
    return "".join(f"| {line} |\n" for line in lines)


def _cell(words: str) -> str:
    """Write words so that no mark or end of a line in them ends their cell."""
    return " ".join(words.replace("\\", "\\\\").replace("|", "\\|").split())


def units(table: pd.DataFrame) -> dict[str, str]:
    """Units of the columns of a table that have one, by name; pure numbers and words have none.

    Those of varied parameters come with the table that `read` gives.
    """
    given = dict(table.attrs.get("units", {}))
    found = {str(name): given.get(name) or _unit(str(name)) for name in table.columns}
    return {name: unit for name, unit in found.items() if unit not in ("", "1")}


def _unit(column: str) -> str:
    """Find the unit of a column by its name, or by that of the quantity it is a statistic of."""
    if unit := UNITS.get(column):
        return unit
    for prefix in ("median_", "largest_", "lowest_", "first_", "max_"):
        if column.startswith(prefix):
            return _unit(column.removeprefix(prefix))
    return ""


def missing(value: object) -> bool:
    """Whether a cell of a table is empty."""
    return value is None or value is pd.NA or value != value


def text(value: object, *, error: bool = False) -> str:
    """Write a value for people, a number to four digits; a missing one as a dash.

    With ``error`` a number is a relative error: what is below round-off is said to be so.
    """
    if missing(value):
        return "-"
    if not isinstance(value, float):
        return str(value)
    if error:
        return f"{value:.2g}" if value == 0 or abs(value) >= ROUND_OFF else f"<{ROUND_OFF:.0e}"
    short = float(f"{value:.4g}")
    # no powers of ten where people write none
    return f"{short:,.0f}" if 1e4 <= abs(short) < 1e9 else f"{short:.4g}"
