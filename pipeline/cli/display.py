"""What commands show on a terminal: the table of runs, and what a long command is doing."""

from __future__ import annotations

from collections.abc import Callable, Hashable, Iterator, Mapping, Sequence
from contextlib import contextmanager
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Any

import typer
from rich.box import SIMPLE_HEAD
from rich.console import Console
from rich.measure import measure_renderables
from rich.table import Table

from pipeline.readable import percent

if TYPE_CHECKING:
    import pandas as pd

    from pipeline.results import Results

# characters in a line where the output is no terminal
PLAIN_WIDTH = 160
ROWS = 40
# where there is not room for all, the last ones are left out first
SHOWN = (
    *("runout_distance", "peak_speed", "front_x", "reach_angle"),
    *("volume_released", "volume_error", "cpu_time"),
)
COUNTED = {"done": ("done", "done_but_overrun")}
STYLES = {"failed": "red", "pending": "yellow", "done": "green"}
OTHER_STYLE = "magenta"
LEAST_NAME = 12


def width() -> int:
    """Characters in a line of the terminal; enough for a whole table where the output is none."""
    console = Console()
    return console.width if console.is_terminal else PLAIN_WIDTH


def show_results(results: Results) -> None:
    """Print the table of a batch, the paths of what it wrote, and what to do next."""
    from pipeline.store.place import store_path, summary_path

    table = results.table
    show_table(table, width())
    place = results.place
    for path in [*(store_path(place, name) for name in results), summary_path(place)]:
        typer.echo(str(path))
    if table["status"].str.startswith("done").any():
        typer.echo(f"next: pipeline tables {place}, pipeline hazard {place}, pipeline report {place}")


def show_table(table: pd.DataFrame, width: int) -> None:
    """Print the table of runs."""
    console = Console(width=width)
    console.print(runs_table(table, width))


def runs_table(table: pd.DataFrame, width: int) -> Table:
    """Show the main summaries of every run, or of many runs their ranges by scenario.

    Parameters
    ----------
    table : DataFrame
        The table of a place, or rows of it.
    width : int
        Characters there is room for in a line.
    """
    return _rows(table, width) if len(table) <= ROWS else _ranges(table)


@dataclass(frozen=True)
class _Column:
    """A column as it is shown: its heading in lines, its cells, and how it is set."""

    heading: str
    cells: Sequence[str]
    options: Mapping[str, Any]


def _rows(table: pd.DataFrame, width: int) -> Table:
    """Give a row a run, with as many columns as there is room for."""
    from pipeline.store.run_table import ERROR, HEAD, text, units
    from pipeline.store.variables import PER_RUN, RETURN_PERIOD, WEIGHT

    known = units(table)
    known_names = {*HEAD, WEIGHT.name, RETURN_PERIOD.name, *(variable.name for variable in PER_RUN)}
    swept = [name for name in table.columns if name not in known_names]
    rows = table.to_dict("records")
    whole = {"no_wrap": True}
    name = {"overflow": "fold", "min_width": LEAST_NAME}
    columns = [
        _Column("scenario", [str(row["scenario"]) for row in rows], name),
        _Column("run", [str(row["run"]) for row in rows], whole),
        _Column("status", [_status(row) for row in rows], whole),
    ]
    values = [
        _Column(
            _heading(quantity, known),
            [text(row[quantity], error=quantity == ERROR) for row in rows],
            {"justify": "right", **whole},
        )
        for quantity in _shown(table)
    ]
    if swept:
        one_line, lines = (
            _Column("parameters", _parameters(rows, swept, between), whole) for between in (", ", "\n")
        )
        wide = _table([*columns, one_line, *values])
        if _fits(wide, width):
            return wide
        columns.append(lines)
    count = next((n for n in range(len(values), 1, -1) if _fits(_table([*columns, *values[:n]]), width)), 1)
    return _table([*columns, *values[:count]])


def _shown(table: pd.DataFrame) -> list[str]:
    """List the quantities to be shown: what came in where something did, without what was not released."""
    found = list(SHOWN)
    if (table["volume_in"] > 0).any():
        found.insert(found.index("volume_released") + 1, "volume_in")
        if not (table["volume_released"] > 0).any():
            found.remove("volume_released")
    return found


def _parameters(rows: Sequence[Mapping[Hashable, Any]], swept: Sequence[str], between: str) -> list[str]:
    from pipeline.store.run_table import missing, text

    return [
        between.join(f"{name}={text(row[name])}" for name in swept if not missing(row[name])) for row in rows
    ]


def _fits(table: Table, width: int) -> bool:
    """Whether a table has room for all it holds, without a cell being cut or folded."""
    console = Console(width=10_000)
    return measure_renderables(console, console.options, [table]).maximum <= width


def _table(columns: Sequence[_Column]) -> Table:
    table = Table(box=SIMPLE_HEAD, padding=(0, 1, 0, 0), pad_edge=False)
    for column in columns:
        table.add_column(column.heading, **column.options)
    for cells in zip(*(column.cells for column in columns), strict=True):
        table.add_row(*cells)
    return table


def _heading(name: str, units: Mapping[str, str]) -> str:
    """Give the words of a name one below the other, the unit last."""
    unit = units.get(name, "")
    return "\n".join([*name.split("_"), *([f"({unit})"] if unit else [])])


def _status(row: Mapping[Hashable, Any]) -> str:
    """Status in words; of a run that was overrun, how much of the volume left too."""
    from pipeline.runs.summary import overrun

    status = str(row["status"])
    words = [f"overrun {percent(overrun(row))}"] if "overrun" in status else []
    shown = ", ".join([*words, *(["cut off"] if "cut_off" in status else [])]) or status
    return f"[{STYLES.get(status, OTHER_STYLE)}]{shown}[/]"


def _ranges(table: pd.DataFrame) -> Table:
    """Give a row a scenario: how many runs are in which state, and the range of run-out and speed.

    All runs count equally here; tables of `pipeline hazard` weigh them by probability.
    """
    states = list(dict.fromkeys(table["status"]))
    shown = Table(
        "scenario",
        "runs",
        *(state.removeprefix("done_but_").replace("_", " ") for state in states),
        "run-out (m)\nleast, median, largest run",
        "peak speed (m s-1)\nleast, median, largest run",
        box=SIMPLE_HEAD,
        padding=(0, 1, 0, 0),
        pad_edge=False,
    )
    for scenario, rows in table.groupby("scenario", sort=False):
        counts = rows["status"].value_counts()
        shown.add_row(
            str(scenario),
            str(len(rows)),
            # as in tables and maps what was overrun is done too
            *(str(sum(counts.get(each, 0) for each in COUNTED.get(state, (state,)))) for state in states),
            _range(rows, "runout_distance"),
            _range(rows, "peak_speed"),
        )
    return shown


def _range(rows: pd.DataFrame, name: str) -> str:
    """Give the range of a quantity; where runs are not simply done, the largest is the least it can be."""
    from pipeline.store.run_table import text

    known = rows.dropna(subset=[name])
    if known.empty:
        return "-"
    cut = "≥ " if (known["status"] != "done").any() else ""
    values = known[name]
    return f"{text(values.min())}, {text(values.median())}, {cut}{text(values.max())}"


@dataclass
class Told:
    """Takes what a long command tells while a line shows that it works."""

    stage: Callable[[str], None] = lambda words: None
    held: list[tuple[str, bool]] = field(default_factory=list)
    at_once: bool = True

    def line(self, text: str) -> None:
        """Print a line, or keep it until the line that moves is gone."""
        self._take(text, False)

    def warning(self, text: str) -> None:
        """Print a warning, likewise."""
        self._take(text, True)

    def _take(self, text: str, err: bool) -> None:
        if self.at_once:
            typer.echo(text, err=err)
        else:
            self.held.append((text, err))


@contextmanager
def working(what: str) -> Iterator[Told]:
    """Show on a terminal that a command works, at what, and since when; elsewhere show nothing.

    Parameters
    ----------
    what : str
        Name of the command.
    """
    from pipeline.batch.progress import stages

    console = Console(stderr=True)
    told = Told(at_once=not console.is_terminal)
    try:
        with stages(console, what) as told.stage:
            yield told
    finally:
        # what moves is gone
        for text, err in told.held:
            typer.echo(text, err=err)
