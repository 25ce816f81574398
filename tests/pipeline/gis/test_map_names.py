"""Where names of marks stand on a map, by the distances between their boxes and all marks."""

import json
from itertools import pairwise

import numpy as np
import pytest
import xarray as xr
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.figure import Figure

from pipeline.gis.map_names import keep_apart
from pipeline.hazard.map_panel import mark_places

WIDTH, HEIGHT = 1250.0, 300.0


def house(name, x, y):
    corners = [[x, y], [x + 20, y], [x + 20, y + 15], [x, y + 15]]
    return {"name": name, "point": None, "line": None, "polygon": corners}


ROAD = {"name": "road", "point": None, "line": [[1000, -110], [1010, 140], [1000, 440]], "polygon": None}
FAR = {"name": "far away", "point": [1300, 700], "line": None, "polygon": None}
# a row that leaves no room for names of this length
ROW = [house(f"a house of number {i}", 900 + 40 * i, 150) for i in range(6)]
TWO = [house("house A", 1060, 130), house("Müller & Söhne <Werk>", 1200, 120)]


def drawn(receptors, buildings=()):
    """Give names on a map, the boxes where they stand, the panel and its view, in pixels."""
    x, y = np.arange(2.5, WIDTH, 5), np.arange(2.5, HEIGHT, 5)
    building = np.zeros((len(y), len(x)), np.int8)
    for east, north in buildings:
        building[np.ix_(abs(y - north) < 8, abs(x - east) < 8)] = 1
    found = xr.Dataset(coords={"x": x, "y": y, "building": (("y", "x"), building)})
    figure = Figure(figsize=(8, 3), dpi=150)
    renderer = FigureCanvasAgg(figure).get_renderer()
    panel = figure.subplots()
    panel.set_aspect("equal")
    panel.set_xlim(-30, WIDTH + 30)
    panel.set_ylim(-30, HEIGHT + 30)
    names = mark_places(panel, None, found.assign_attrs(receptors=json.dumps(receptors)))
    figure.draw_without_rendering()
    lines = len(panel.lines)
    keep_apart(renderer, panel, names)
    boxes = {name.text.get_text(): name.text.get_window_extent(renderer) for name in names}
    seen = [name.text.get_text() for name in names if name.text.get_visible()]
    return seen, boxes, panel, panel.get_window_extent(renderer), len(panel.lines) - lines


def distance(panel, box, corners):
    """Give the distance of a box from a closed or open line, pixels."""
    places = np.concatenate(
        [np.linspace(*ends, 200) for ends in pairwise(corners)] if len(corners) > 1 else [corners]
    )
    places = panel.transData.transform(places)
    return np.hypot(*(places - np.clip(places, box.min, box.max)).T).min()


def closed(receptor):
    shape = receptor["polygon"] or receptor["line"] or [receptor["point"]]
    return [*shape, shape[0]] if receptor["polygon"] else shape


def apart(one, other):
    return one.x1 <= other.x0 or other.x1 <= one.x0 or one.y1 <= other.y0 or other.y1 <= one.y0


@pytest.mark.parametrize("receptors", [TWO, [*TWO, ROAD], [*ROW, ROAD]], ids=["two", "with a road", "a row"])
def test_names_are_nearest_to_their_own_marks_or_have_a_line_and_lie_on_no_other(receptors):
    seen, boxes, panel, view, leaders = drawn(receptors)
    assert len(seen) == len(receptors)
    without = 0
    for receptor, (name, box) in zip(receptors, boxes.items(), strict=True):
        own = distance(panel, box, closed(receptor))
        others = [distance(panel, box, closed(each)) for each in receptors if each is not receptor]
        without += own < min(others)
        assert view.x0 - 1 <= box.x0 < box.x1 <= view.x1 + 1, name
        assert view.y0 - 1 <= box.y0 < box.y1 <= view.y1 + 1, name
    assert without + leaders >= len(receptors)
    held = list(boxes.values())
    assert all(apart(one, other) for i, one in enumerate(held) for other in held[:i])


def test_what_is_out_of_view_has_no_name_and_a_road_that_leaves_it_has_one():
    seen, boxes, panel, view, _ = drawn([FAR, ROAD])
    assert seen == ["road"]
    assert view.y0 < boxes["road"].y0 < boxes["road"].y1 < view.y1
    assert distance(panel, boxes["road"], ROAD["line"]) < 20


def test_a_name_does_not_stand_at_a_building_that_is_not_its_own():
    (one,) = receptors = [house("house A", 1060, 130)]
    # all around but the one that is named
    beside = [(1070 + east, 137 + north) for east in (-60, 0, 60) for north in (-45, 0, 45)]
    beside.remove((1070, 137))
    _, boxes, panel, _, leaders = drawn(receptors, [*beside, (1070, 137)])
    box = boxes["house A"]
    own = distance(panel, box, closed(one))
    other = min(distance(panel, box, [place]) for place in beside)
    assert leaders == 1 or own < other
    assert other > 12
