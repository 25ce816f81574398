import re

import numpy as np
import pandas as pd
import pytest
from rich.console import Console

from pipeline.cli.display import runs_table
from pipeline.store.run_table import markdown, text, units

SUMMARIES = {
    "volume_released": 1e4,
    "volume_error": -2.7e-16,
    "volume_out": 0.0,
    "volume_in": 0.0,
    "front_x": 812.25,
    "runout_distance": 12345.6,
    "reach_angle": 21.5,
    "peak_speed": 17.351,
    "cpu_time": 0.25,
}
NAME = "debris-flow-of-the-upper-gully"


def table(runs: int, **changed: object) -> pd.DataFrame:
    head = {"scenario": NAME, "run": range(runs), "status": "done", "bed_friction": np.linspace(20, 25, runs)}
    found = pd.DataFrame({**head, **SUMMARIES, **changed})
    found.attrs["units"] = {"bed_friction": "degrees"}
    return found


def shown(rows: pd.DataFrame, width: int) -> str:
    console = Console(width=width, no_color=True)
    with console.capture() as capture:
        console.print(runs_table(rows, width))
    return capture.get()


@pytest.mark.parametrize("width", [80, 100, *range(110, 140, 4), 160, 240])
def test_names_and_numbers_are_whole_at_every_width(width):
    printed = shown(table(3), width)
    assert printed.count(NAME) == 3
    assert printed.count("12,350") == 3
    assert "e+" not in printed
    assert "…" not in printed
    assert max(map(len, printed.splitlines())) <= width


def test_there_are_more_columns_where_there_is_room():
    assert "0.25" in shown(table(2), 160)
    assert "0.25" not in shown(table(2), 80)


def test_a_name_longer_than_the_terminal_is_folded():
    printed = shown(table(1, scenario="x" * 70), 60)
    assert printed.count("x") >= 70


def test_units_stand_in_the_headings():
    printed = shown(table(2), 160)
    for unit in ("(m)", "(m s-1)", "(degree)", "(m3)", "(s)"):
        assert unit in printed
    lines = markdown(table(1)).splitlines()
    assert "| bed_friction (degrees) | volume_released (m3) | volume_error |" in lines[0]
    assert "<1e-15" in lines[2]


@pytest.mark.parametrize(
    ("column", "unit"),
    [
        ("median_max_depth", "m"),
        ("largest_speed", "m s-1"),
        ("first_arrival_time", "s"),
        ("probability", None),
    ],
)
def test_statistics_have_the_unit_of_their_quantity(column, unit):
    assert units(pd.DataFrame({column: [1.0]})).get(column) == unit


@pytest.mark.parametrize(
    ("value", "error", "words"),
    [
        (1e4, False, "10,000"),
        (123456.0, False, "123,500"),
        (0.00001234, False, "1.234e-05"),
        (812.25, False, "812.2"),
        (float("nan"), False, "-"),
        (pd.NA, False, "-"),
        (7, False, "7"),
        (0.0, True, "0"),
        (-2.7e-16, True, "<1e-15"),
        (-0.00063, True, "-0.00063"),
    ],
)
def test_numbers_are_written_for_people(value, error, words):
    assert text(value, error=error) == words


def test_many_runs_are_shown_by_their_ranges():
    runout = np.linspace(100, 500, 101)
    printed = shown(table(101, runout_distance=runout), 120)
    assert re.search(rf"{NAME} +101 +101 +100, 300, 500 +17.35, 17.35, 17.35", printed)
    assert "run-out (m)" in printed
    # what lost material or was cut off may have gone farther
    states = ["done"] * 100 + ["done_but_overrun"]
    printed = shown(table(101, runout_distance=runout, status=states), 120)
    # as in tables and maps, runs that were overrun are done
    assert re.search(rf"{NAME} +101 +101 +1 +100, 300, ≥ 500", printed)


def test_a_status_that_is_new_is_shown_in_its_words():
    printed = shown(table(1, status="done_but_cut_off"), 160)
    assert " cut off " in printed
    assert "overrun 1 %" in shown(table(1, status="done_but_overrun", volume_out=100.0), 160)
