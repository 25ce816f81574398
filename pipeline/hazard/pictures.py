"""Pictures of hazard maps, with scale, legend, contour lines and the number of runs behind them."""

from __future__ import annotations

import textwrap
from collections.abc import Sequence
from pathlib import Path
from typing import Literal

import numpy as np
import xarray as xr
from matplotlib.axes import Axes
from matplotlib.backend_bases import RendererBase
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.colors import BoundaryNorm, ListedColormap
from matplotlib.figure import Figure
from matplotlib.lines import Line2D
from matplotlib.patches import Patch
from numpy.typing import NDArray

from pipeline.assess.georeference import Frame
from pipeline.assess.plots import CHARACTERS_PER_INCH
from pipeline.assess.relief import draw_relief
from pipeline.gis.layer import ERROR, Layer
from pipeline.gis.symbology import UNKNOWN_COLOUR, UNKNOWN_WORDS, Style
from pipeline.gis.vectors import RELEASE_COLOUR
from pipeline.hazard import intensity
from pipeline.hazard.map_panel import (
    WIDTH,
    contour_bed,
    frame_panel,
    keep_apart,
    mark_places,
    scale_bar,
)

Array = NDArray[np.float64]
# of colours on a hillshade; of a bound where it is the estimate
OVER_RELIEF, ALIKE = 0.8, 0.25
REACHED_COLOUR = "#2171b5"
# above every value
HIGHEST = 1e30
BUILDING_COLOUR = "0.25"
PANEL_TITLES = {
    "": "estimate",
    "_lower": "lower bound; strong where it differs",
    "_upper": "upper bound; strong where it differs",
    ERROR: "half width of its error",
}
IN_DOUBT = "hatched where its error exceeds it"


def draw(layer: Layer, found: xr.Dataset, frame: Frame | None, path: Path) -> Path:
    """Draw a map: on the ground where there is a frame, else along and across the bed.

    Where runs are missing, the bounds are drawn beside it.

    Parameters
    ----------
    layer : Layer
        Over the points of ``found``.
    found : Dataset
        Hazard maps over a lattice.
    frame : Frame, optional
        Of this lattice.
    path : Path
        Picture to write; its suffix says of what kind.

    Raises
    ------
    OSError
        If the picture cannot be written.
    """
    shown = [""] if layer.is_certain else list(layer.values)
    east, north, corners = _laid(found, frame)
    width, height = (float(np.ptp(side)) for side in corners)
    wide = height / width < 0.5
    figure, panels = _panels(height / width, len(shown), wide)
    relief = _has_relief(found)
    names = []
    for panel, bound in zip(panels, shown, strict=True):
        values = layer.values[bound].to_numpy()
        same = _same_class(layer, values) if bound not in ("", ERROR) else None
        _fill(panel, east, north, values, layer, OVER_RELIEF if relief else 1.0, same)
        if bound == "":
            _hatch(panel, east, north, layer.in_doubt)
        _draw_ground(panel, east, north, found)
        frame_panel(panel, frame, corners)
        names += mark_places(panel, frame, found, named=bound == "")
        if len(shown) > 1:
            note = f", {IN_DOUBT}" if bound == "" and ERROR in shown else ""
            panel.set_title(PANEL_TITLES[bound] + note, fontsize="medium", loc="left", pad=3)
    scale_bar(panels[0], frame, width)
    _explain(panels[0], layer)
    for panel in panels if wide else panels[:2]:
        panel.set_ylabel("northing (m)" if frame else "across the bed (m)")
    for panel in panels[-1:] if wide else panels:
        panel.set_xlabel("easting (m)" if frame else "along the bed (m)")
    characters = int(CHARACTERS_PER_INCH * (figure.get_figwidth() - 0.5))
    lines = [f"{found.attrs['title']}: {layer.title}", found.attrs["comment"], *_sources(layer, found)]
    if frame:
        lines[1] += f"; {frame.system}"
    if "building" in found.coords:
        lines[1] += "; buildings are dark"
    text = "\n".join(textwrap.fill(line, characters) for line in lines)
    title = panels[0].annotate(
        text,
        (0, 1),
        (0, 18 if len(shown) > 1 else 6),
        xycoords="axes fraction",
        textcoords="offset points",
        verticalalignment="bottom",
        annotation_clip=False,
    )
    # a long title is to widen the picture and not the gaps between panels
    title.set_in_layout(False)
    layout = figure.get_layout_engine()
    assert layout is not None
    layout.execute(figure)
    figure.set_layout_engine("none")
    title.set_in_layout(True)
    keep_apart(_renderer(figure), panels[0], names)
    figure.savefig(path, bbox_inches="tight")
    return path


def draw_location(found: xr.Dataset, frame: Frame | None, path: Path) -> Path:
    """Draw where releases, receptors and the domain lie, and what any run reaches; no values.

    Parameters
    ----------
    found : Dataset
        Hazard maps over a lattice.
    frame : Frame, optional
        Of this lattice.
    path : Path
        Picture to write; its suffix says of what kind.

    Raises
    ------
    OSError
        If the picture cannot be written.
    """
    east, north, corners = _laid(found, frame)
    width, height = (float(np.ptp(side)) for side in corners)
    figure, (panel,) = _panels(height / width, 1, height / width < 0.5)
    if "arrival_share" in found:
        reached = found["arrival_share"].fillna(0).to_numpy() > 0
        if reached.any() and not reached.all():
            panel.contour(east, north, reached, levels=[0.5], colors=REACHED_COLOUR, linewidths=1.4)
    _draw_ground(panel, east, north, found)
    frame_panel(panel, frame, corners)
    names = mark_places(panel, frame, found)
    scale_bar(panel, frame, width)
    panel.set_ylabel("northing (m)" if frame else "across the bed (m)")
    panel.set_xlabel("easting (m)" if frame else "along the bed (m)")
    panel.legend(
        handles=[
            Line2D([], [], color=RELEASE_COLOUR, linestyle=(0, (4, 2)), label="release"),
            Line2D([], [], color=REACHED_COLOUR, label="reached by any run"),
            Line2D([], [], color="k", marker="o", markersize=3, linewidth=1.1, label="receptors"),
        ],
        loc="upper left",
        bbox_to_anchor=(1.01, 1),
        frameon=False,
        borderaxespad=0,
        fontsize="small",
    )
    figure.draw_without_rendering()
    keep_apart(_renderer(figure), panel, names)
    figure.savefig(path, bbox_inches="tight")
    return path


def _laid(found: xr.Dataset, frame: Frame | None) -> tuple[Array, Array, tuple[Array, Array]]:
    """Lay the points of maps on the ground, where there is a frame; their coordinates and the corners."""
    x, y = np.meshgrid(found["x"].to_numpy(), found["y"].to_numpy())
    if frame:
        return *frame.on_map(x, y), frame.corners
    return x, y, (x[[0, -1], [0, -1]], y[[0, -1], [0, -1]])


def _has_relief(found: xr.Dataset) -> bool:
    return "elevation" in found.coords and found["elevation"].ndim == 2


def _draw_ground(panel: Axes, east: Array, north: Array, found: xr.Dataset) -> None:
    """Draw the terrain, shaded on an elevation model, and the buildings."""
    if _has_relief(found):
        draw_relief(panel, east[0], north[:, 0], found["elevation"].to_numpy())
    else:
        contour_bed(panel, east, north, found)
    _fill_buildings(panel, east, north, found)


def _renderer(figure: Figure) -> RendererBase:
    found: RendererBase = FigureCanvasAgg(figure).get_renderer()  # type: ignore[no-untyped-call]
    return found


def _panels(shape: float, count: int, wide: bool) -> tuple[Figure, list[Axes]]:
    """Make panels below each other where they are wide, else the bounds side by side below the estimate."""
    height = float(np.clip(WIDTH * shape, 1.2, 9.0))
    rows = count if wide else min(count, 1.5)
    size = (WIDTH + 1.2, (height + 0.3) * rows + 0.6)
    figure = Figure(figsize=size, layout="compressed", dpi=150)
    if wide:
        return figure, list(figure.subplots(count, 1, sharex=True, squeeze=False).flat)
    if count == 2:
        figure.set_size_inches(WIDTH + 1.2, 0.5 * height + 1.2)
        return figure, list(figure.subplots(1, 2, squeeze=False).flat)
    grid = figure.add_gridspec(2, 2, height_ratios=(2, 1)) if count > 1 else figure.add_gridspec(1, 1)
    below = [figure.add_subplot(grid[1, i]) for i in range(count - 1)]
    return figure, [figure.add_subplot(grid[0, :]), *below]


def _hatch(panel: Axes, x: Array, y: Array, doubt: xr.DataArray | None) -> None:
    """Hatch where an error exceeds the number it is of."""
    if doubt is None or not doubt.any():
        return
    panel.contourf(x, y, doubt.to_numpy().astype(float), levels=[0.5, 1.5], colors="none", hatches=["/////"])


def _fill_buildings(panel: Axes, x: Array, y: Array, found: xr.Dataset) -> None:
    """Fill the cells of buildings, where there are."""
    if "building" in found.coords:
        stands = np.ma.masked_equal(found["building"].to_numpy(), 0)
        panel.pcolormesh(x, y, stands, cmap=ListedColormap([BUILDING_COLOUR]), shading="nearest")


def _same_class(layer: Layer, values: Array) -> NDArray[np.bool_]:
    """Say where a bound is of the class that the estimate is of."""
    both = (layer.values[""].to_numpy(), values)
    edges = [each.lower for each in layer.style.entries]
    at: Literal["left", "right"] = "right" if layer.style.discrete else "left"
    one, other = (np.searchsorted(edges, np.nan_to_num(each, nan=-1), side=at) for each in both)
    known = [np.isfinite(each) & ((each != intensity.UNKNOWN) | (not layer.style.discrete)) for each in both]
    return np.asarray((one == other) & (known[0] == known[1]))


def _fill(
    panel: Axes,
    x: Array,
    y: Array,
    values: Array,
    layer: Layer,
    alpha: float,
    same: NDArray[np.bool_] | None = None,
) -> None:
    """Colour one panel; what is the ``same`` as on another one is pale."""
    style = layer.style
    if layer.kind == "difference":
        _differences(panel, x, y, values, style, alpha)
        return
    if style.discrete or same is not None:
        parts = [(np.ones(values.shape, bool), alpha)]
        if same is not None:
            parts = [(same, ALIKE * alpha), (~same, alpha)]
        for part, opacity in parts:
            _cells(panel, x, y, np.where(part, values, 0), style, opacity)
        return
    given = np.ma.masked_invalid(values)
    edges = [*style.edges[:-1], min(style.edges[-1], HIGHEST) * (1 + 1e-6)]
    # nothing is not the first class
    edges[0] = edges[0] or 1e-6 * edges[1]
    colours = [each.colour for each in style.entries]
    panel.contourf(x, y, given, levels=edges, colors=colours, alpha=alpha)
    if given.count() and given.max() > edges[0] > given.min():
        panel.contour(x, y, given, levels=edges[:-1], colors="k", linewidths=0.3)
    if layer.kind != "time" and np.ma.is_masked(given):
        _unknown(panel, x, y, np.ma.getmaskarray(given), alpha)


def _differences(panel: Axes, x: Array, y: Array, values: Array, style: Style, alpha: float) -> None:
    """Colour more and less cell by cell; what differs by less than the least class stays free."""
    edges = np.array(style.edges)
    least = float(np.abs(edges[edges != 0]).min())
    # of an odd number of classes the middle one is of no difference
    free = np.abs(values) <= (least if len(style.entries) % 2 else 1e-3 * least)
    colours = ListedColormap([each.colour for each in style.entries])
    panel.pcolormesh(
        x,
        y,
        np.ma.masked_where(free | np.isnan(values), np.clip(values, edges[0], edges[-1])),
        cmap=colours,
        norm=BoundaryNorm(edges, colours.N),
        shading="nearest",
        rasterized=True,
        alpha=alpha,
    )
    if np.isnan(values).any():
        _unknown(panel, x, y, np.isnan(values), alpha)


def _cells(panel: Axes, x: Array, y: Array, values: Array, style: Style, alpha: float) -> None:
    """Colour cell by cell; nothing is left free."""
    if style.discrete:
        numbers = [each.lower for each in style.entries]
        edges, free = [*(number - 0.5 for number in numbers), numbers[-1] + 0.5], values < 0.5
        unknown = values == intensity.UNKNOWN
    else:
        edges, free = [*style.edges[:-1], min(style.edges[-1], HIGHEST)], ~(values > style.edges[0])
        unknown = np.isnan(values)
    colours = ListedColormap([each.colour for each in style.entries])
    panel.pcolormesh(
        x,
        y,
        np.ma.masked_where(free, values),
        cmap=colours,
        norm=BoundaryNorm(edges, colours.N),
        shading="nearest",
        rasterized=True,
        alpha=alpha,
    )
    if unknown.any():
        _unknown(panel, x, y, unknown, alpha)


def _unknown(panel: Axes, x: Array, y: Array, unknown: NDArray[np.bool_], alpha: float) -> None:
    grey = ListedColormap([UNKNOWN_COLOUR])
    mesh = np.ma.masked_where(~unknown, np.zeros(unknown.shape))
    panel.pcolormesh(x, y, mesh, cmap=grey, shading="nearest", alpha=alpha)


def _explain(panel: Axes, layer: Layer) -> None:
    """Add the legend."""
    style = layer.style
    handles = [
        Patch(facecolor=each.colour, edgecolor="0.3", linewidth=0.4, label=each.label)
        for each in reversed(style.entries)
    ]
    unknown = [
        values == intensity.UNKNOWN if style.discrete else values.isnull() & (layer.kind != "time")
        for values in layer.values.values()
    ]
    if any(bool(each.any()) for each in unknown):
        handles.append(Patch(facecolor=UNKNOWN_COLOUR, label=UNKNOWN_WORDS))
    panel.legend(
        handles=handles,
        title=textwrap.fill(style.caption, 18),
        loc="upper left",
        bbox_to_anchor=(1.01, 1),
        frameon=False,
        borderaxespad=0,
        alignment="left",
        fontsize="small",
        title_fontsize="small",
    )


def _sources(layer: Layer, found: xr.Dataset) -> Sequence[str]:
    """Say where classes are from."""
    if layer.kind != "class":
        return []
    share = f"reached by {found.attrs['intensity_share']:.3g} of the runs or more"
    names = ["intensity", "level"] if layer.quantity == "hazard_level" else ["intensity"]
    sources = dict.fromkeys(found.attrs[f"{name}_source"] for name in names)
    return [f"{share}; after {'; '.join(sources)}"]
