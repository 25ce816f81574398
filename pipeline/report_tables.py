"""Tables of the report, from stores."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
import xarray as xr

from pipeline.provenance import BINDING, PACKAGES, differences
from pipeline.variables import PER_RUN, VOLUMES, Status

MOST_ROWS = 40
COLUMNS = {variable.name: variable for variable in PER_RUN}


@dataclass(frozen=True)
class Table:
    """A table with a title; a note stands below it."""

    title: str
    head: Sequence[str]
    rows: Sequence[Sequence[str]]
    note: str = ""


def volume_ledger(store: xr.Dataset) -> Table | None:
    """Table what became of the volume: run by run, or of many runs the least, the median and the largest."""
    computed = store.isel(run=np.flatnonzero(store["status"].isin([1, 2, 3]).to_numpy()))
    names = [variable.name for variable in VOLUMES]
    head = [f"{name.removeprefix('volume_')} ({COLUMNS[name].units})" for name in names]
    head[-1] = "error"
    values = np.stack([computed[name].to_numpy() for name in names], axis=1)
    if not len(values) or np.isnan(values).all():
        return None
    if len(values) <= MOST_ROWS:
        rows = [
            [str(run), Status(int(status)).words.replace("_", " "), *map(number, row)]
            for run, status, row in zip(
                computed["run"].to_numpy(), computed["status"].to_numpy(), values, strict=True
            )
        ]
        return Table("Volume", ["run", "status", *head], rows, LEDGER)
    known = values[~np.isnan(values).any(axis=1)]
    if not len(known):
        return None
    kinds: dict[str, Callable[..., Any]] = {"least": np.min, "median": np.median, "largest": np.max}
    rows = [[kind, *map(number, take(known, axis=0))] for kind, take in kinds.items()]
    largest = int(np.abs(known[:, -1]).argmax())
    note = f"{LEDGER} Over {len(known)} runs; largest error {number(known[largest, -1])}."
    return Table("Volume", ["over runs", *head], rows, note)


LEDGER = (
    "Lost is what of the release lies outside the domain; in and out is what passed the boundaries; the "
    "error is that of the ledger, relative to what was released and came in."
)


def failures(store: xr.Dataset) -> Table | None:
    """Table the runs that failed, with their parameters, reason and place."""
    failed = store.isel(run=np.flatnonzero((store["status"] == Status.FAILED).to_numpy()))
    if not failed.sizes["run"]:
        return None
    swept = [str(name) for name, c in store.coords.items() if c.dims == ("run",) and name != "run"]
    rows = [
        [
            str(one["run"].item()),
            *(number(one[name].item()) for name in swept),
            str(one["failure_reason"].item()),
            *(number(one[f"failure_{name}"].item()) for name in ("time", "x", "y")),
        ]
        for one in (failed.isel(run=i) for i in range(min(failed.sizes["run"], MOST_ROWS)))
    ]
    more = failed.sizes["run"] - len(rows)
    head = ["run", *(name.replace("_", " ") for name in swept), "reason", "time (s)", "x (m)", "y (m)"]
    return Table("Failed runs", head, rows, f"And {more} more." if more else "")


def origin(store: xr.Dataset) -> Table:
    """Table what made the store: hashes and versions."""
    held = store.attrs
    changed = differences(held)
    rows = [["scenario", str(held["scenario_hash"])], [BINDING["solver_hash"], str(held["solver_hash"])]]
    rows += [
        [name, str(held[f"{name}_version"])] for name in (*PACKAGES, "python") if f"{name}_version" in held
    ]
    note = f"Another one is installed here: {', '.join(changed)}." if changed else ""
    return Table("Versions and hashes", ["what", "SHA-256 or version"], rows, note)


# in the order they are shown; one that has nothing to tell gives None
TABLES: tuple[Callable[[xr.Dataset], Table | None], ...] = (volume_ledger, failures, origin)


def number(value: object) -> str:
    """Write a number for people; missing ones as a dash."""
    if isinstance(value, float | np.floating):
        return "–" if np.isnan(value) else f"{value:.4g}"
    return str(value)
