"""The table of runs as it is shown on a terminal."""

from __future__ import annotations

import math

import pandas as pd
from rich.table import Table

from pipeline.table import HEAD
from pipeline.variables import PER_RUN

SHOWN = (
    "volume_released",
    "volume_error",
    "front_x",
    "runout_distance",
    "reach_angle",
    "peak_speed",
    "cpu_time",
)
UNITS = {v.name: v.units for v in PER_RUN}
ROWS = 40
STYLES = {"failed": "red", "pending": "yellow", "done_but_overrun": "magenta"}


def runs_table(whole: pd.DataFrame) -> Table:
    """Show the main summaries of every run, or counts by scenario where the runs are many."""
    return _rows(whole) if len(whole) <= ROWS else _counts(whole)


def _rows(whole: pd.DataFrame) -> Table:
    swept = [name for name in whole.columns if name not in HEAD and name not in UNITS]
    table = Table("scenario", "run", "status", *(["parameters"] if swept else []))
    for name in SHOWN:
        unit = UNITS[name]
        table.add_column(
            name.replace("_", " ") + ("" if unit == "1" else f"\n({unit})"), justify="right", no_wrap=True
        )
    for row in whole.to_dict("records"):
        status = str(row["status"])
        given = ", ".join(f"{name}={_text(row[name])}" for name in swept if not pd.isna(row[name]))
        table.add_row(
            str(row["scenario"]),
            str(row["run"]),
            f"[{STYLES.get(status, 'green')}]{status.replace('_', ' ')}[/]",
            *([given] if swept else []),
            *(_text(row[name]) for name in SHOWN),
        )
    return table


def _counts(whole: pd.DataFrame) -> Table:
    counts = whole.groupby("scenario", sort=False)["status"].value_counts().unstack(fill_value=0)
    states = [str(state) for state in counts.columns]
    table = Table("scenario", *(state.replace("_", " ") for state in states))
    for scenario, row in counts.iterrows():
        table.add_row(str(scenario), *(str(row[state]) for state in states))
    return table


def _text(value: object) -> str:
    if not isinstance(value, float):
        return str(value)
    return "-" if math.isnan(value) else f"{value:.4g}"
