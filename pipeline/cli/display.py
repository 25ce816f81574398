"""The table of runs as it is shown on a terminal."""

from __future__ import annotations

from collections.abc import Hashable, Mapping
from typing import Any

import pandas as pd
from rich.box import SIMPLE_HEAD
from rich.table import Table

from pipeline.runs.summary import overrun
from pipeline.store.run_table import HEAD, text
from pipeline.store.variables import PER_RUN, RETURN_PERIOD, WEIGHT

SHOWN = ("front_x", "runout_distance", "reach_angle", "peak_speed")
SHOWN_WHERE_WIDE = ("volume_released", "volume_error", *SHOWN, "cpu_time")
WIDE = 110
UNITS = {v.name: v.units for v in (WEIGHT, RETURN_PERIOD, *PER_RUN)}
ROWS = 40
STYLES = {"failed": "red", "pending": "yellow", "done": "green"}


def runs_table(whole: pd.DataFrame, width: int) -> Table:
    """Show the main summaries of every run, or counts by scenario where the runs are many.

    Parameters
    ----------
    whole : DataFrame
        The table of a place, or rows of it.
    width : int
        Characters there is room for in a line.
    """
    return _rows(whole, width >= WIDE) if len(whole) <= ROWS else _counts(whole)


def _rows(whole: pd.DataFrame, wide: bool) -> Table:
    swept = [name for name in whole.columns if name not in HEAD and name not in UNITS]
    shown = SHOWN_WHERE_WIDE if wide else SHOWN
    table = Table(box=SIMPLE_HEAD, padding=(0, 1 if wide else 0), pad_edge=wide)
    for name in (*HEAD, *(["parameters"] if swept else [])):
        table.add_column(name, no_wrap=name != "scenario", overflow="fold")
    for name in shown:
        unit = "" if UNITS[name] == "1" else f" {UNITS[name]}"
        table.add_column((name + unit).replace("_", "\n").replace(" ", "\n"), justify="right", no_wrap=True)
    for row in whole.to_dict("records"):
        status = str(row["status"])
        given = [f"{name}={text(row[name])}" for name in swept if not pd.isna(row[name])]
        table.add_row(
            str(row["scenario"]),
            str(row["run"]),
            f"[{STYLES.get(status, 'magenta')}]{_status(row)}[/]",
            *([(", " if wide else "\n").join(given)] if swept else []),
            *(text(row[name]) for name in shown),
        )
    return table


def _status(row: Mapping[Hashable, Any]) -> str:
    """Status in a word or two; of a run that was overrun, how much of the volume left too."""
    status = str(row["status"])
    words = [f"overrun {100 * overrun(row):.2g} %"] if "overrun" in status else []
    return ", ".join([*words, *(["cut off"] if "cut_off" in status else [])]) or status


def _counts(whole: pd.DataFrame) -> Table:
    counts = whole.groupby("scenario", sort=False)["status"].value_counts().unstack(fill_value=0)
    states = [str(state) for state in counts.columns]
    table = Table("scenario", *(state.replace("_", " ") for state in states), box=SIMPLE_HEAD)
    for scenario, row in counts.iterrows():
        table.add_row(str(scenario), *(str(row[state]) for state in states))
    return table
