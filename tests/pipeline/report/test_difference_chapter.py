"""The chapter of two scenarios beside each other, against the table it is made from."""

import copy

import numpy as np
import pytest
from commands import pipeline as command
from heaps import HEAP

import pipeline
from pipeline.report.difference_chapter import of_difference
from pipeline.report.tables.table import between, short

pytestmark = pytest.mark.usefixtures("few_pictures")


@pytest.fixture(scope="module")
def place(tmp_path_factory):
    """The heap, and the same on rougher ground, which does not reach as far."""
    out = tmp_path_factory.mktemp("beside") / "results"
    rough = copy.deepcopy(HEAP)
    rough["name"] = "rough"
    rough["sweep"] = {"material.bed_friction": [30, 32, 34, 36]}
    rough["return_periods"] = {"material.bed_friction": [300, 100, 100, 30]}
    for scene in (heap := copy.deepcopy(HEAP), rough):
        scene["receptors"].append({"name": "never", "point": [156, 20]})
    pipeline.run([heap, rough], out, workers=1, quiet=True)
    return out


@pytest.fixture(scope="module")
def compared(place):
    found = pipeline.compare(place, ("heap", "rough"))
    table = found.receptors
    # a run of the rough heap creeps on, and may do anything: here it does not reach the last receptor
    nothing = table["receptor"] == "never"
    ends = [name for name in table.columns if name.startswith(("first", "second", "difference"))]
    table.loc[nothing, [name for name in ends if not name.endswith("scenario")]] = 0.0
    return found


def test_findings_say_how_what_reaches_receptors_changes(compared):
    chapter = of_difference(compared)
    rows = compared.receptors.set_index(["receptor", "quantity"])
    chance, depth = rows.loc[("Häusli", "probability")], rows.loc[("Häusli", "largest_depth")]
    assert chance["second"] < chance["first"]
    (said,) = [each for each in chapter.findings if each.startswith("Häusli")]
    second, first = (
        between(*(f"{chance[f'{end}{bound}']:.2f}" for bound in ("", "_lower", "_upper")))
        for end in ("second", "first")
    )
    assert f"{second} in rough, in place of {first} in heap" in said
    # of the rough heap a run creeps on, and may still come
    assert np.isnan(depth["second_upper"])
    assert f"largest depth an unknown one in place of {short(depth['first'])} m" in said
    assert chapter.findings[-1] == "Not reached in either: never."


def test_what_one_of_them_leaves_open_is_told_as_not_known(compared):
    table = compared.receptors.copy()
    of_road = table["receptor"] == "road"
    chance, depth, pressure = (
        of_road & (table["quantity"] == each) for each in ("probability", "largest_depth", "largest_pressure")
    )
    # as of runs that were cut off before they arrive, or before they are deepest
    table.loc[chance, ["first", "first_lower", "first_upper"]] = 0.0, 0.0, 1.0
    table.loc[depth, ["first", "first_lower", "first_upper"]] = 0.0, 0.0, np.nan
    table.loc[pressure, ["first", "first_lower", "first_upper"]] = 3.0, 3.0, np.nan
    (said,) = [
        each for each in of_difference(compared._replace(receptors=table)).findings if each.startswith("road")
    ]
    assert "in rough, in place of unknown (0.00 to 1.00) in heap" in said
    assert "m in place of an unknown one; largest dynamic pressure" in said
    assert said.endswith("kPa in place of at least 3 kPa.")


def test_the_table_has_the_differences_with_their_bounds(compared):
    (table,) = of_difference(compared).tables
    assert table.head == ["receptor", "quantity", "heap", "rough", "difference"]
    # what nothing reaches is left out
    reached = compared.receptors[compared.receptors["receptor"] != "never"]
    assert len(reached) == len(compared.receptors) * 2 // 3
    for row, known in zip(table.rows, reached.to_dict("records"), strict=True):
        number = float(row[4].split()[0].replace(",", ""))
        assert number == pytest.approx(known["difference"], rel=0.06, abs=1e-3)


def test_maps_where_nothing_differs_are_named_and_not_drawn(compared):
    maps = compared.maps
    chapter = of_difference(compared)
    same = maps.copy()
    for bound in ("", "_lower", "_upper"):
        name = f"speed_exceedance_difference{bound}"
        same[name] = maps[name] * 0
        same[name].attrs = maps[name].attrs
    fewer = of_difference(compared._replace(maps=same))
    assert len(fewer.maps) + len(fewer.others) == len(chapter.maps) + len(chapter.others) - 1
    assert "Nowhere is there a difference of the share of events with a largest speed" in fewer.description


def test_the_command_puts_the_chapter_first(place, tmp_path):
    to = tmp_path / "page.html"
    shown = command("report", place, "--to", to, "--compare", "heap", "rough")
    assert shown.exit_code == 0, shown.output
    page = to.read_text(encoding="utf-8")
    assert page.index('<section id="scenario-heap-rough">') < page.index('<section id="scenario-heap">')
    assert "rough beside heap" in page


def test_a_scenario_that_is_not_there_is_told(place):
    shown = command("report", place, "--compare", "heap", "smooth")
    assert shown.exit_code == 2
    assert "smooth.zarr" in shown.stderr
