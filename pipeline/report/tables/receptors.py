"""Tables of the report on receptors: how likely they are reached, by return period, and a sheet for each."""

from __future__ import annotations

import numpy as np
import xarray as xr

from pipeline.assess import tables
from pipeline.assess.ensemble import counts, weights
from pipeline.assess.probability import BOUNDS, Values
from pipeline.assess.receptors import reached
from pipeline.assess.tables import receptors as table_receptors
from pipeline.readable import number
from pipeline.report.tables.table import Table, between, share_in_words, short

MOST_RECEPTORS = 40
RECEPTOR_HEAD = (
    *("receptor", "probability", "median depth (m)", "largest depth (m)"),
    *("largest speed (m/s)", "largest pressure (kPa)", "first arrival (s)"),
)
# of what a closer spacing changes
CHANGED = {
    "probability_discretisation": "spacing: probability",
    "max_depth_discretisation": "spacing: depth (m)",
    "max_speed_discretisation": "spacing: speed (m/s)",
}
ON_CLOSER = (
    "Spacing is the discretisation error: the share of runs that reach it on one of two spacings alone, and "
    "the root mean square change of a run from the widest spacing to the closest."
)
SHARES = (0.05, 0.5, 0.95)
ASKED = {
    "max_depth": "largest depth (m)",
    "max_speed": "largest speed (m/s)",
    "max_pressure": "largest dynamic pressure (kPa)",
    "arrival_time": "arrival (s)",
    "erosion_depth": "depth of erosion (m)",
    "bed_change": "change of the ground's elevation (m)",
}


def receptors(store: xr.Dataset, fine: xr.Dataset | None = None) -> Table | None:
    """Table what reaches the receptors; with a finer level what changes on it."""
    try:
        rows = list(table_receptors(store, reached(store), fine))
    except ValueError as error:
        return Table("Receptors", ["none"], [], f"{error}.")
    if not rows:
        return None
    shown = ("median_max_depth", "largest_depth", "largest_speed", "largest_pressure", "first_arrival_time")
    changed = CHANGED if fine is not None else {}
    return Table(
        "Receptors",
        [*RECEPTOR_HEAD, *changed.values()],
        [
            [
                str(row["receptor"]),
                share_in_words(row, "probability"),
                *(short(row[name]) for name in (*shown, *changed)),
            ]
            for row in rows
        ],
        f"{counts(store)}. Probability of being reached, with its bounds; the rest is of the computed runs "
        "that reach it, until the end of each." + (f" {ON_CLOSER}" if changed else ""),
    )


def receptor_periods(store: xr.Dataset, fine: xr.Dataset | None = None) -> Table | None:
    """Table how likely receptors are reached by the events of each return period."""
    try:
        by_run = reached(store)
    except ValueError:
        return None
    rows: dict[str, list[str]] = {}
    head = ["receptor"]
    for row in tables.receptors_by_period(store, by_run, fine):
        first, last = row["shortest_return_period"], row["return_period"]
        period = f"{last:g} years" if first == last else f"{first:g} to {last:g} years"
        head = head if period in head else [*head, period]
        cell = share_in_words(row, "probability")
        if fine is not None:
            cell += f", spacing {short(row['probability_discretisation'])}"
        rows.setdefault(str(row["receptor"]), []).append(cell)
    if not rows:
        return None
    rates = {
        str(row["receptor"]): between(*(number(row[f"annual_rate{end}"]) for end in BOUNDS))
        for row in table_receptors(store, by_run)
    }
    note = "Probability of being reached by an event of each return period, and events a year that reach it."
    if fine is not None:
        note += f" {ON_CLOSER}"
    whole = [[name, *cells, rates[name]] for name, cells in rows.items()]
    return Table("Receptors by return period", [*head, "events a year"], whole, note)


def sheets(store: xr.Dataset) -> list[Table]:
    """Give a sheet for each receptor: what reaches it, in quantiles of the runs that do."""
    try:
        by_run = reached(store)
    except ValueError:
        return []
    weight = weights(store)
    made = []
    for name, rows in by_run.groupby("receptor", sort=False):
        there = np.flatnonzero(rows["reached"].to_numpy(np.float64, na_value=np.nan) == 1)
        if not there.size:
            continue
        known = np.zeros(there.size, bool)
        table = []
        for quantity, words in ASKED.items():
            if quantity not in rows:
                continue
            held = Values(rows[quantity].to_numpy(np.float64)[there], weight[there], known, known)
            numbers = held.quantile([*SHARES, 1.0]).estimate
            least = float(np.nanmin(held.value))
            table.append([words, short(least), *(short(float(each)) for each in numbers)])
        note = f"Of the {there.size} runs that reach it, by their weights."
        head = ["quantity", "least", *(f"{100 * share:g} % below" for share in SHARES), "largest"]
        made.append(Table(str(name), head, table, note))
        if len(made) == MOST_RECEPTORS:
            break
    return made
