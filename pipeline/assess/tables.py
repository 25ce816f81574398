"""Tables for an assessment: what scenarios come down to, and what reaches their receptors."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd
import xarray as xr
from numpy.typing import NDArray

from pipeline.assess.ensemble import counts, weights
from pipeline.assess.receptors import reached
from pipeline.assess.statistics import Bounded, Values
from pipeline.store import run_table
from pipeline.store.place import store_paths
from pipeline.store.storage import Location
from pipeline.store.variables import COMPUTED, STATUS, Status
from pipeline.store.zarr_store import open_store

QUANTITIES = (
    *("runout_distance", "drop_height", "reach_angle", "deposit_length", "deposit_width", "deposit_area"),
    *("deposit_volume", "deposit_max_depth", "peak_depth", "peak_speed", "rest_time"),
)
# a run that lost material through the boundary says of these the most alone, of the others the least
AT_MOST = ("reach_angle",)
AT_RECEPTORS = ("max_depth", "max_speed", "max_pressure", "arrival_time")
SHARES = (0.05, 0.5, 0.95)
DISTANCES = 41


def assess(out: Location) -> dict[str, pd.DataFrame]:
    """Make the tables of a place.

    Parameters
    ----------
    out : Location
        The place.

    Returns
    -------
    dict of str to DataFrame
        ``runs``, a row a run; ``scenarios``, quantiles of each quantity; ``runout-exceedance``, the
        probability that the run-out is longer than a distance; ``receptors``, a row a receptor;
        ``receptor-runs``, a row a receptor and run. Numbers over runs have bounds and the runs behind them.

    Raises
    ------
    FileNotFoundError
        If the place holds no store.
    ValueError
        If a store lacks a field that its receptors need.
    """
    stores = [open_store(path) for path in store_paths(out)]
    try:
        by_run = [reached(store) for store in stores]
        found = {
            "runs": run_table.read(out),
            "scenarios": pd.DataFrame(row for store in stores for row in quantiles(store)),
            "runout-exceedance": pd.DataFrame(row for store in stores for row in runout_exceedance(store)),
            "receptors": pd.DataFrame(
                row for store, rows in zip(stores, by_run, strict=True) for row in receptors(store, rows)
            ),
            "receptor-runs": pd.concat(by_run, ignore_index=True),
        }
    finally:
        for store in stores:
            store.close()
    return {name: rows for name, rows in found.items() if len(rows)}


def values(store: xr.Dataset, name: str) -> Values:
    """Give a quantity of every run of a store with its weight; that of runs not computed is not known."""
    most = name in AT_MOST
    return _values(store, store[name].to_numpy(), at_least=not most, at_most=most)


def _values(store: xr.Dataset, held: NDArray[Any], *, at_least: bool, at_most: bool = False) -> Values:
    states = store[STATUS.name].to_numpy()
    known = np.where(np.isin(states, COMPUTED), held, np.nan).astype(np.float64)
    overrun = states == Status.OVERRUN
    return Values(known, weights(store), overrun & at_least, overrun & at_most)


def behind(store: xr.Dataset) -> dict[str, object]:
    """Say how many runs are behind the numbers of a scenario."""
    found = counts(store)
    return {
        "scenario": str(store.attrs["title"]),
        "runs_planned": found.planned,
        "runs_done": found.done + found.overrun,
        "runs_overrun": found.overrun,
        "runs_failed": found.failed,
    }


def quantiles(store: xr.Dataset) -> Iterator[dict[str, object]]:
    """Table quantiles of each quantity, a row each."""
    for name in QUANTITIES:
        found = values(store, name).quantile(SHARES)
        yield {
            **behind(store),
            "quantity": name,
            "units": str(store[name].attrs.get("units", "")),
            **_columns(found, [f"q{100 * share:02.0f}" for share in SHARES]),
        }


def runout_exceedance(store: xr.Dataset) -> Iterator[dict[str, object]]:
    """Table the probability that the run-out is longer than each of a row of distances."""
    runout = values(store, "runout_distance")
    if not runout.known.any():
        return
    distances = np.linspace(0, np.nanmax(runout.value), DISTANCES)
    found = runout.exceedance(distances)
    for i, distance in enumerate(distances):
        one = Bounded(*(getattr(found, end)[i] for end in ("lower", "estimate", "upper")))
        yield {**behind(store), "runout_distance": distance, **_columns(one, ["probability"])}


def receptors(store: xr.Dataset, by_run: pd.DataFrame) -> Iterator[dict[str, object]]:
    """Table how likely each receptor is reached, and quantiles of what reaches it where it is.

    A run that lost material may have had more of it arrive.
    """
    for name, rows in by_run.groupby("receptor", sort=False):
        reached_ = rows["reached"].to_numpy(np.float64, na_value=np.nan)
        share = _values(store, reached_, at_least=True).exceedance(0.5)
        row = {**behind(store), "receptor": name, **_columns(share, ["probability"])}
        for quantity in AT_RECEPTORS:
            there = np.where(reached_ == 1, rows[quantity], np.nan)
            # the median, and the most severe of all
            last = 0.0 if quantity == "arrival_time" else 1.0
            middle, worst = _values(store, there, at_least=False).quantile([0.5, last]).estimate
            name_of_worst = f"{'largest' if last else 'first'}_{quantity.removeprefix('max_')}"
            row |= {f"median_{quantity}": middle, name_of_worst: worst}
        yield row


def _columns(found: Bounded, names: Sequence[str]) -> dict[str, float]:
    """Columns of numbers with their bounds."""
    columns = {}
    for i, name in enumerate(names):
        for ending, part in (("", found.estimate), ("_lower", found.lower), ("_upper", found.upper)):
            columns[name + ending] = float(np.atleast_1d(part)[i])
    return columns


def write(tables: dict[str, pd.DataFrame], to: Path, kinds: Sequence[str]) -> list[Path]:
    """Write tables to a folder, each in every kind asked for: ``csv``, ``parquet``, ``md``.

    Raises
    ------
    OSError
        If one cannot be written.
    ImportError
        If Parquet is asked for without pyarrow.
    """
    to.mkdir(parents=True, exist_ok=True)
    paths = [to / f"{name}.{kind}" for name in tables for kind in kinds]
    for path in paths:
        run_table.write(tables[path.stem], path)
    return paths
