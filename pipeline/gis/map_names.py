"""Names of places on maps: each beside its own mark, or with a line that leads to it."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from itertools import pairwise

import numpy as np
from matplotlib.axes import Axes
from matplotlib.backend_bases import RendererBase
from matplotlib.path import Path as Outline
from matplotlib.patheffects import withStroke
from matplotlib.text import Annotation
from matplotlib.transforms import Bbox
from numpy.typing import NDArray

Array = NDArray[np.float64]
HALO = (withStroke(linewidth=2.2, foreground="white"),)
# where a name may stand beside a mark, in points from it, with the part of its size that lies before that
BESIDE = (
    *((4, 3, 0, 0), (4, -3, 0, 1), (-4, 3, 1, 0), (-4, -3, 1, 1)),
    *((0, 5, 0.5, 0), (0, -5, 0.5, 1), (6, 0, 0, 0.5), (-6, 0, 1, 0.5)),
)
NOTHING = np.empty((0, 2))
# a name is so much nearer to its own mark than to any other one
NEARER = 0.7
# and where it is not, so far from its mark at the end of a line, in points, in so many directions
AWAY, DIRECTIONS = (10, 16, 24, 36, 54, 80, 110), 16
# between the places of a mark that names keep clear of, pixels, and how many there are at most of a side
STEP, MOST = 3.0, 500
# beside names and marks, points
CLEAR = 1.5
# what makes a place at the end of a line worse, as points farther away: a name that is covered, a mark below
# it, one beside it, a road below it, and a mark or a name that its line goes through
COVERS, ON_MARK, AT_MARK, ON_LINE, CROSSES = 5000.0, 300.0, 120.0, 40.0, 80.0
# points from a name to a mark that it may be taken for that of
MISTAKEN = 15.0


@dataclass(frozen=True, eq=False)
class Name:
    """The name of a mark.

    Parameters
    ----------
    text : Annotation
        The name, wherever it stands.
    mark : (n, 2) array
        Corners of the mark in coordinates of the panel, the first one again at the end of an area.
    buildings : (m, 2) array
        Places of what looks like a mark, of which those at this one are its own.
    """

    text: Annotation
    mark: Array
    buildings: Array


def keep_apart(renderer: RendererBase, panel: Axes, names: Sequence[Name]) -> None:
    """Put names where each is nearest to its own mark, on no mark and no other name, within the panel.

    A name for which there is no such place stands farther away, at the end of a line that leads to its mark.
    A mark that is out of view has no name.
    """
    view = panel.get_window_extent(renderer)
    points = float(np.asarray(renderer.points_to_pixels(1.0), np.float64))
    own_texts = [name.text for name in names]
    taken = [
        each.get_window_extent(renderer)
        for each in panel.texts
        if isinstance(each, Annotation) and each not in own_texts
    ]
    marks = [_seen(_along(panel.transData.transform(name.mark)), view) for name in names]
    for i, name in enumerate(names):
        if not len(marks[i]):
            name.text.set_visible(False)
            continue
        others = [k for k in range(len(names)) if k != i]
        solid = [marks[k] for k in others if not _is_line(names[k].mark)]
        lines = [marks[k] for k in others if _is_line(names[k].mark)]
        solid.append(_others(name, panel, view))
        corners = np.array([each.extents for each in taken]).reshape(-1, 4)
        around = Around(np.concatenate(solid), np.concatenate([NOTHING, *lines]), corners, view)
        box, is_led = _placed(marks[i], around, _size(name.text, renderer), points)
        taken.append(box)
        at = _nearest(marks[i], box)
        name.text.xy = tuple(panel.transData.inverted().transform(at))
        name.text.set_position(((box.x0 - at[0]) / points, (box.y0 - at[1]) / points))
        if is_led:
            ends = panel.transData.inverted().transform([at, np.clip(at, box.min, box.max)])
            panel.plot(*ends.T, color="k", linewidth=0.7, path_effects=HALO)


def _along(corners: Array) -> Array:
    """Places along a line, (n, 2), pixels, so close that nothing stands between them."""
    if len(corners) == 1:
        return corners
    pieces = []
    for start, end in pairwise(corners):
        count = int(min(MOST, np.hypot(*(end - start)) / STEP)) + 2
        pieces.append(np.linspace(start, end, count))
    return np.concatenate(pieces)


def _seen(places: Array, view: Bbox) -> Array:
    return places[((places >= view.min) & (places <= view.max)).all(axis=1)]


def _others(name: Name, panel: Axes, view: Bbox) -> Array:
    """Places of buildings that are not those of a mark, (n, 2), pixels."""
    buildings, corners = (panel.transData.transform(each) for each in (name.buildings, name.mark))
    buildings = _seen(buildings, view)
    away = np.array([np.hypot(*(corners - each).T).min() for each in buildings])
    inside = Outline(corners).contains_points(buildings, radius=STEP) if len(corners) > 2 else away < 0
    return buildings[~inside & (away > 2 * STEP)]


def _is_line(corners: Array) -> bool:
    return len(corners) > 1 and bool((corners[0] != corners[-1]).any())


@dataclass(frozen=True, eq=False)
class Around:
    """What a name stands clear of, in pixels.

    Parameters
    ----------
    solid, lines : (n, 2) array
        Places of other marks: of all but lines, and of lines, on which a name may stand if need be.
    taken : (k, 4) array
        Boxes of other texts: left, bottom, right and top.
    view : Bbox
        What a name does not leave.
    """

    solid: Array
    lines: Array
    taken: Array
    view: Bbox

    def covered(self, box: Bbox, clear: float) -> float:
        """Part of a box that is on other texts or out of view, and more where it is on both."""
        low, high = (
            np.maximum(self.taken[:, :2], np.asarray(box.min) - clear),
            np.minimum(self.taken[:, 2:], np.asarray(box.max) + clear),
        )
        shared = float(np.clip(high - low, 0, None).prod(axis=1).sum())
        return (shared + _area(box) - _area(Bbox.intersection(box, self.view))) / _area(box)


def _size(text: Annotation, renderer: RendererBase) -> Array:
    """Give width and height of a name, pixels, which from now on is placed by its lower left corner."""
    text.set_horizontalalignment("left")
    text.set_verticalalignment("bottom")
    text.set_annotation_clip(False)
    extent = text.get_window_extent(renderer)
    return np.array([extent.width, extent.height])


def _placed(mark: Array, around: Around, size: Array, points: float) -> tuple[Bbox, bool]:
    """Choose where a name of a size stands, in pixels, and say whether a line leads to its mark."""
    clear = CLEAR * points
    for box in _beside(mark, size, points):
        own, other = _distance(mark, box), min(_distance(each, box) for each in (around.solid, around.lines))
        if around.covered(box, clear) <= 0 and other > clear and 0 < own < NEARER * other:
            return box, False

    def cost(tried: tuple[Bbox, float]) -> float:
        box, away = tried
        line = _line(mark, box)
        inside = (line[:, None] > around.taken[:, :2] - clear) & (line[:, None] < around.taken[:, 2:] + clear)
        through = bool(inside.all(axis=2).any())
        return (
            away
            + COVERS * around.covered(box, clear)
            + ON_MARK * (min(_distance(around.solid, box), _distance(mark, box)) <= clear)
            + AT_MARK * max(0.0, 1 - _distance(around.solid, box) / (MISTAKEN * points))
            + ON_LINE * (_distance(around.lines, box) <= clear)
            + CROSSES * (_distance(around.solid, line) <= 2 * clear)
            + CROSSES * through
        )

    least, best = np.inf, None
    for tried in _away(mark, size, points, around.view):
        # none that is farther away is better
        if best is not None and tried[1] >= least:
            break
        now = cost(tried)
        if now < least:
            least, best = now, tried[0]
    assert best is not None
    return best, True


def _beside(mark: Array, size: Array, points: float) -> Iterator[Bbox]:
    """Give places for a name of a size beside a mark: at its ends, of a long one at any part of it."""
    x, y = mark.T
    ends = [mark[each] for each in (y.argmax(), x.argmax(), y.argmin(), x.argmin())]
    for at in (*ends, *mark[:: max(1, len(mark) // 8)]):
        for dx, dy, left, below in BESIDE:
            corner = at + points * np.array([dx, dy]) - size * [left, below]
            yield Bbox([corner, corner + size])


def _away(mark: Array, size: Array, points: float, view: Bbox) -> Iterator[tuple[Bbox, float]]:
    """Give places in view for a name of a size around a mark, each with how far it is away, in points."""
    low, high = view.min + size / 2, view.max - size / 2
    for away in AWAY:
        for angle in 2 * np.pi * np.arange(DIRECTIONS) / DIRECTIONS:
            way = np.array([np.cos(angle), np.sin(angle)])
            centre = mark[(mark @ way).argmax()] + way * (away * points + size / 2)
            centre = np.maximum(low, np.minimum(centre, high))
            yield Bbox([centre - size / 2, centre + size / 2]), away


def _distance(places: Array, box: Bbox | Array) -> float:
    """Give the distance of the nearest of some places from a box or from places, infinite of none, pixels."""
    if not len(places):
        return np.inf
    if isinstance(box, Bbox):
        return float(np.hypot(*(places - np.clip(places, box.min, box.max)).T).min())
    return min(float(np.hypot(*(places - each).T).min()) for each in box)


def _nearest(mark: Array, box: Bbox) -> Array:
    """Give the place of a mark that is nearest to a box."""
    found: Array = mark[int(np.hypot(*(mark - np.clip(mark, box.min, box.max)).T).argmin())]
    return found


def _line(mark: Array, box: Bbox) -> Array:
    """Places along the line that leads from a box to its mark, the mark itself left out."""
    at = _nearest(mark, box)
    return np.linspace(at, np.clip(at, box.min, box.max), 8, dtype=np.float64)[2:]


def _area(box: Bbox | None) -> float:
    return 0.0 if box is None else float(box.width * box.height)
