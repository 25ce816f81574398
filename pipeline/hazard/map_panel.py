"""What stands on a map beside its colours: frame, receptors, releases, contour lines, north and scale."""

from __future__ import annotations

import json
import textwrap
from collections.abc import Sequence

import numpy as np
import xarray as xr
from matplotlib.axes import Axes
from matplotlib.backend_bases import RendererBase
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.colors import ListedColormap
from matplotlib.figure import Figure
from matplotlib.layout_engine import ConstrainedLayoutEngine
from matplotlib.ticker import MaxNLocator
from matplotlib.transforms import Bbox
from numpy.typing import NDArray

from pipeline.assess.georeference import Frame
from pipeline.assess.relief import draw_relief
from pipeline.gis.map_names import HALO, Name
from pipeline.gis.vectors import RELEASE_COLOUR

Array = NDArray[np.float64]
WIDTH = 8.0
# part of the height of a panel
TITLES = 0.06
BUILDING_COLOUR = "0.25"
# characters of a name in a line
LONGEST_LINE = 24


def laid(found: xr.Dataset, frame: Frame | None) -> tuple[Array, Array, tuple[Array, Array]]:
    """Lay the points of maps on the ground, where there is a frame; their coordinates and the corners."""
    x, y = np.meshgrid(found["x"].to_numpy(), found["y"].to_numpy())
    if frame:
        return *frame.on_map(x, y), frame.corners
    return x, y, (x[[0, -1], [0, -1]], y[[0, -1], [0, -1]])


def has_relief(found: xr.Dataset) -> bool:
    """Say whether the ground below maps is an elevation model, which is shaded."""
    return "elevation" in found.coords and found["elevation"].ndim == 2


def draw_ground(panel: Axes, east: Array, north: Array, found: xr.Dataset) -> None:
    """Draw the terrain, shaded on an elevation model, and the buildings."""
    if has_relief(found):
        draw_relief(panel, east[0], north[:, 0], found["elevation"].to_numpy())
    else:
        contour_bed(panel, east, north, found)
    fill_buildings(panel, east, north, found)


def renderer_of(figure: Figure) -> RendererBase:
    """Give what measures the texts of a figure."""
    assert isinstance(figure.canvas, FigureCanvasAgg)
    found: RendererBase = figure.canvas.get_renderer()  # type: ignore[no-untyped-call]
    return found


def panels_of(shape: float, count: int, wide: bool) -> tuple[Figure, list[Axes]]:
    """Make panels below each other where they are wide, else the bounds side by side below the estimate."""
    height = float(np.clip(WIDTH * shape, 1.2, 9.0))
    rows = count if wide else min(count, 1.5)
    size = (WIDTH + 1.2, (height + 0.3) * rows + 0.6)
    figure = Figure(figsize=size, layout="compressed", dpi=150)
    # labels of contour lines are measured on it, where else each would make a renderer of its own
    FigureCanvasAgg(figure)
    if wide:
        return figure, list(figure.subplots(count, 1, sharex=True, squeeze=False).flat)
    if count == 2:
        figure.set_size_inches(WIDTH + 1.2, 0.5 * height + 1.2)
        return figure, list(figure.subplots(1, 2, squeeze=False).flat)
    if count == 1:
        return figure, [figure.add_subplot()]
    layout = figure.get_layout_engine()
    assert isinstance(layout, ConstrainedLayoutEngine)
    # room for the titles of the panels below
    layout.set(hspace=TITLES)
    grid = figure.add_gridspec(2, 2, height_ratios=(2, 1))
    below = [figure.add_subplot(grid[1, i]) for i in range(count - 1)]
    return figure, [figure.add_subplot(grid[0, :]), *below]


# places of panels that were arranged, by all that they are arranged around
arranged: dict[tuple[object, ...], list[Bbox]] = {}


def arrange(figure: Figure, panels: Sequence[Axes]) -> None:
    """Place the panels of a figure, and do without its layout engine from then on.

    It takes a third of the time of a picture. Maps of one place differ in their colours alone, most of them:
    panels of one size with the same texts around them get the places that were found first.
    """
    edges = [
        (each.get_title("left"), each.get_xlabel(), each.get_ylabel(), each.get_xlim(), each.get_ylim())
        for each in panels
    ]
    # names, and labels of contour lines, which may stand out of a panel
    texts = [
        (each.get_text(), each.get_position(), getattr(each, "xy", ()))
        for panel in panels
        for each in panel.texts
        if each.get_in_layout()
    ]
    legend = panels[0].get_legend()
    told = [] if legend is None else [legend.get_title(), *legend.get_texts()]
    key = (*figure.get_size_inches(), *edges, *texts, *(each.get_text() for each in told))
    if key not in arranged:
        layout = figure.get_layout_engine()
        assert layout is not None
        layout.execute(figure)
        arranged[key] = [panel.get_position(original=True) for panel in panels]
    figure.set_layout_engine(None)
    for panel, place in zip(panels, arranged[key], strict=True):
        panel.set_position(place)


def fill_buildings(panel: Axes, x: Array, y: Array, found: xr.Dataset) -> None:
    """Fill the cells of buildings, where there are."""
    if "building" in found.coords:
        stands = np.ma.masked_equal(found["building"].to_numpy(), 0)
        panel.pcolormesh(x, y, stands, cmap=ListedColormap([BUILDING_COLOUR]), shading="nearest")


def contour_bed(panel: Axes, x: Array, y: Array, found: xr.Dataset) -> None:
    """Draw contour lines of the bed's elevation, the same across it; labels stand beside the flow."""
    if "elevation" not in found.coords:
        return
    along = found["elevation"].to_numpy()
    levels = MaxNLocator(8, steps=[1, 2, 5, 10]).tick_values(float(along.min()), float(along.max()))
    levels = levels[(levels > along.min()) & (levels < along.max())]
    if not levels.size:
        return
    elevation = np.broadcast_to(along, x.shape)
    lines = panel.contour(x, y, elevation, levels=levels, colors="0.45", linewidths=0.4, linestyles="solid")
    row = round(0.88 * (len(x) - 1))
    places = [(x[row, i], y[row, i]) for i in (int(np.abs(along - level).argmin()) for level in levels)]
    panel.clabel(lines, fontsize="xx-small", fmt="%g m", inline_spacing=1, manual=places)


def frame_panel(panel: Axes, frame: Frame | None, corners: tuple[Array, Array]) -> None:
    """Set the extent and the ticks of a panel; on the ground draw the domain and an arrow to the north."""
    panel.set_aspect("equal")
    width, height = (float(np.ptp(side)) for side in corners)
    margin = 0.03 * max(width, height) if frame else 0.0
    x, y = ((float(side.min()) - margin, float(side.max()) + margin) for side in corners)
    panel.set_xlim(*x)
    panel.set_ylim(*y)
    ticks = int(np.clip(height / width * WIDTH / 0.4, 2, 5))
    panel.yaxis.set_major_locator(MaxNLocator(ticks, min_n_ticks=1))
    panel.xaxis.set_major_locator(MaxNLocator(4, min_n_ticks=2))
    panel.ticklabel_format(useOffset=False, style="plain")
    if frame is None:
        return
    outline = np.stack(corners)
    panel.plot(*np.concatenate([outline, outline[:, :1]], axis=1), color="0.3", linewidth=0.6)
    at = 0.04 if leaves_upper_left(frame) else 0.96
    panel.annotate(
        "N",
        xy=(at, 0.97),
        xytext=(at, 0.83),
        xycoords="axes fraction",
        horizontalalignment="center",
        verticalalignment="top",
        arrowprops={"arrowstyle": "-|>", "color": "k", "linewidth": 0.8},
        fontsize="small",
        path_effects=HALO,
    )


def mark_places(panel: Axes, frame: Frame | None, found: xr.Dataset, *, named: bool = True) -> list[Name]:
    """Mark the receptors and releases that maps come with, in their attributes; gives the names."""
    for ring in json.loads(found.attrs.get("releases", "[]")):
        east, north = _placed(ring, frame)
        panel.plot(east, north, color=RELEASE_COLOUR, linewidth=1.1, linestyle=(0, (4, 2)), path_effects=HALO)
    names = []
    buildings = _buildings(found, frame)
    for receptor in json.loads(found.attrs.get("receptors", "[]")):
        shape = receptor["polygon"] or receptor["line"] or [receptor["point"]]
        east, north = _placed([*shape, *shape[:1]] if receptor["polygon"] else shape, frame)
        mark = "o" if len(shape) == 1 else ""
        panel.plot(east, north, color="k", marker=mark, markersize=3, linewidth=1.1, path_effects=HALO)
        if named:
            at = int(np.argmax(north))
            text = panel.annotate(
                textwrap.fill(receptor["name"], LONGEST_LINE),
                (east[at], north[at]),
                textcoords="offset points",
                xytext=(4, 3),
                fontsize="small",
                path_effects=HALO,
                annotation_clip=True,
            )
            names.append(Name(text, np.stack([east, north], axis=1), buildings))
    return names


def _buildings(found: xr.Dataset, frame: Frame | None) -> Array:
    """Places of the cells of buildings, (n, 2)."""
    if "building" not in found.coords:
        return np.empty((0, 2))
    east, north, _ = laid(found, frame)
    stands = found["building"].to_numpy() != 0
    return np.stack([east[stands], north[stands]], axis=1)


def _placed(places: list[list[float]], frame: Frame | None) -> tuple[Array, Array]:
    x, y = np.array(places, np.float64).T
    return frame.on_map(x, y) if frame else (x, y)


def leaves_upper_left(frame: Frame | None) -> bool:
    """Whether the slanted domain leaves free the upper left and lower right corners, not the other two."""
    return frame is None or frame.georeference.azimuth % 180 < 90


def scale_bar(panel: Axes, frame: Frame | None, width: float) -> None:
    """Draw a bar of a round length, about a fifth of the map's width, in a corner below."""
    length = round_below(width / 5)
    (left, right), (bottom, top) = panel.get_xlim(), panel.get_ylim()
    side = 0.05 * (right - left)
    x = right - side - length if leaves_upper_left(frame) else left + side
    y = bottom + 0.1 * (top - bottom)
    panel.plot([x, x + length], [y, y], color="k", linewidth=2.5, solid_capstyle="butt")
    panel.annotate(
        f"{length:g} m",
        (x + length / 2, y),
        xytext=(0, 3),
        textcoords="offset points",
        horizontalalignment="center",
        fontsize="small",
        bbox={"facecolor": "white", "edgecolor": "none", "alpha": 0.7, "pad": 0.5},
    )


def round_below(value: float) -> float:
    """Give the largest of 1, 2 or 5 times a power of ten that is not above a positive value."""
    power = 10.0 ** np.floor(np.log10(value))
    return float(max(step * power for step in (1, 2, 5) if step * power <= value * (1 + 1e-9)))
