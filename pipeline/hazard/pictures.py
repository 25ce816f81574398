"""Pictures of hazard maps, with scale, legend, contour lines and the number of runs behind them."""

from __future__ import annotations

import json
import textwrap
from collections.abc import Sequence
from pathlib import Path

import numpy as np
import xarray as xr
from matplotlib import colormaps
from matplotlib.axes import Axes
from matplotlib.cm import ScalarMappable
from matplotlib.colors import BoundaryNorm, Colormap, ListedColormap
from matplotlib.figure import Figure
from matplotlib.patches import Patch
from matplotlib.patheffects import withStroke
from matplotlib.ticker import MaxNLocator
from numpy.typing import NDArray

from pipeline.assess.georeference import Frame
from pipeline.assess.plots import CHARACTERS_PER_INCH, COLOURS, LEVELS
from pipeline.assess.relief import draw_relief
from pipeline.hazard import intensity
from pipeline.hazard.layers import ERROR, Layer

Array = NDArray[np.float64]
WIDTH = 8.0
# what a few runs of a hundred do can be told from nothing
SHARES = (0.01, 0.05, 0.1, 0.25, 0.5, 0.75, 0.9, 1.0)
RATES = (0.001, 0.003, 0.01, 0.03, 0.1, 0.3, 1.0)
# those of the Swiss hazard maps
LEVEL_COLOURS = ("#fdf6c3", "#fee45c", "#4f8fcc", "#d7352b")
# red is more, blue is less
DIFFERENCES = "RdBu_r"
UNKNOWN_COLOUR = "0.8"
BUILDING_COLOUR = "0.25"
# of colours on a hillshade
OVER_RELIEF = 0.8
PANEL_TITLES = {
    "": "estimate",
    "_lower": "lower bound",
    "_upper": "upper bound",
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
    x, y = np.meshgrid(found["x"].to_numpy(), found["y"].to_numpy())
    shown = [""] if layer.is_certain else list(layer.values)
    corners = frame.corners if frame else (x[[0, -1], [0, -1]], y[[0, -1], [0, -1]])
    east, north = frame.on_map(x, y) if frame else (x, y)
    width, height = (float(np.ptp(side)) for side in corners)
    wide = height / width < 0.5
    figure, panels = _panels(height / width, len(shown), wide)
    relief = "elevation" in found.coords and found["elevation"].ndim == 2
    colours = _Colours(layer, over_relief=relief)
    for panel, bound in zip(panels, shown, strict=True):
        colours.fill(panel, east, north, layer.values[bound].to_numpy())
        if bound == "":
            _hatch(panel, east, north, layer.in_doubt)
        if relief:
            draw_relief(panel, east[0], north[:, 0], found["elevation"].to_numpy())
        else:
            _contour_bed(panel, east, north, found)
        _fill_buildings(panel, east, north, found)
        _frame_panel(panel, frame, corners)
        mark_receptors(panel, frame, found, named=bound == "")
        if len(shown) > 1:
            note = f", {IN_DOUBT}" if bound == "" and ERROR in shown else ""
            panel.set_title(PANEL_TITLES[bound] + note, fontsize="medium", loc="left", pad=3)
    _scale_bar(panels[0], frame, width)
    colours.explain(figure, panels)
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
    figure.savefig(path, bbox_inches="tight")
    return path


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


class _Colours:
    """How the values of a layer are coloured, and what the colours mean."""

    def __init__(self, layer: Layer, *, over_relief: bool = False) -> None:
        self.layer, self.over_relief = layer, over_relief
        self.alpha = OVER_RELIEF if over_relief else None
        if layer.kind == "class":
            level = layer.name == "hazard_level"
            self.words = intensity.LEVELS[1:] if level else intensity.CLASSES[1:]
            steps = np.linspace(0.3, 0.9, len(self.words))
            shades = LEVEL_COLOURS if level else [colormaps[COLOURS](step) for step in steps]
            self.map: Colormap = ListedColormap([UNKNOWN_COLOUR, "white", *shades])
            self.norm = BoundaryNorm(np.arange(-1.5, len(self.words) + 1), self.map.N)
            return
        self.map = colormaps[DIFFERENCES if layer.kind == "difference" else COLOURS]
        if layer.kind == "difference":
            self.levels = _either_side(layer)
        elif layer.kind in ("share", "rate"):
            self.levels = np.array(SHARES if layer.kind == "share" else RATES)
        else:
            largest = float(np.nanmax([layer.values[""].fillna(0).max(), 1e-6]))
            self.levels = np.asarray(MaxNLocator(LEVELS, min_n_ticks=5).tick_values(0, largest))
        # equal steps of colour, however unequal the steps of value
        self.norm = BoundaryNorm(self.levels, self.map.N)

    def fill(self, panel: Axes, x: Array, y: Array, values: Array) -> None:
        """Colour one panel."""
        if self.layer.kind == "class":
            if self.over_relief:
                values = np.ma.masked_equal(values, 0)
            panel.pcolormesh(
                x,
                y,
                values,
                cmap=self.map,
                norm=self.norm,
                shading="nearest",
                rasterized=True,
                alpha=self.alpha,
            )
            return
        given = np.ma.masked_invalid(values)
        if self.layer.kind == "difference":
            self._fill_differences(panel, x, y, given)
            return
        # thin films stay white, as where nothing flows
        first = self.levels[1] / 20 if self.layer.kind == "value" else self.levels[0]
        bounds = [first, *self.levels[1:]]
        bounds[-1] += 1e-6
        panel.contourf(x, y, given, levels=bounds, cmap=self.map, norm=self.norm, alpha=self.alpha)
        if given.count() and given.max() > first > given.min():
            panel.contour(x, y, given, levels=bounds[:-1], colors="k", linewidths=0.3)
        if self.layer.kind != "time" and np.ma.is_masked(given):
            panel.pcolormesh(
                x,
                y,
                np.ma.masked_where(~np.ma.getmaskarray(given), np.zeros_like(values)),
                cmap=ListedColormap([UNKNOWN_COLOUR]),
                shading="nearest",
            )

    def _fill_differences(self, panel: Axes, x: Array, y: Array, given: np.ma.MaskedArray) -> None:
        """Colour more and less; what differs by next to nothing stays as it is."""
        least = float(np.abs(self.levels).min())
        unknown = np.ma.masked_where(~np.ma.getmaskarray(given), np.zeros(given.shape))
        clipped = np.clip(np.ma.masked_inside(given, -least, least), self.levels[0], self.levels[-1])
        grey = ListedColormap([UNKNOWN_COLOUR])
        panel.pcolormesh(x, y, unknown, cmap=grey, shading="nearest", rasterized=True)
        panel.pcolormesh(
            x, y, clipped, cmap=self.map, norm=self.norm, shading="nearest", rasterized=True, alpha=self.alpha
        )

    def explain(self, figure: Figure, panels: Sequence[Axes]) -> None:
        """Add the legend."""
        if self.layer.kind != "class":
            share = self.layer.title.removeprefix("emulated ").split()[:3]
            names = {"share": " ".join(share), "rate": "events a year", "time": "time"}
            label = names.get(self.layer.kind, self.layer.quantity.replace("_", " "))
            label = f"difference ({label})" if self.layer.kind == "difference" else label
            units = f" ({self.layer.units})" if self.layer.units != "1" else ""
            bar = figure.colorbar(
                ScalarMappable(self.norm, self.map),
                ax=list(panels),
                label=label + units,
                aspect=30 if len(panels) == 1 else 45,
                pad=0.02,
                ticks=self.levels,
                spacing="uniform",
            )
            bar.ax.set_yticklabels([f"{level:g}" for level in self.levels])
            return
        handles = [
            Patch(facecolor=self.map(self.norm(i)), edgecolor="0.3", linewidth=0.4, label=word)
            for i, word in reversed(list(enumerate(self.words, 1)))
        ]
        if any((values == intensity.UNKNOWN).any() for values in self.layer.values.values()):
            handles.append(Patch(facecolor=UNKNOWN_COLOUR, label="not computed"))
        panels[0].legend(
            handles=handles, loc="upper left", bbox_to_anchor=(1.01, 1), frameon=False, borderaxespad=0
        )


def _hatch(panel: Axes, x: Array, y: Array, doubt: xr.DataArray | None) -> None:
    """Hatch where an error exceeds the number it is of."""
    if doubt is None or not doubt.any():
        return
    panel.contourf(x, y, doubt.to_numpy().astype(float), levels=[0.5, 1.5], colors="none", hatches=["/////"])


def _either_side(layer: Layer) -> Array:
    """Levels of a difference, as many above 0 as below it."""
    if layer.units == "1":
        above = np.array(SHARES[1:])
    else:
        largest = float(np.nanmax([abs(layer.values[""]).fillna(0).max(), 1e-6]))
        above = np.asarray(MaxNLocator(LEVELS, min_n_ticks=5).tick_values(0, largest))[1:]
    return np.concatenate([-above[::-1], above])


def _fill_buildings(panel: Axes, x: Array, y: Array, found: xr.Dataset) -> None:
    """Fill the cells of buildings, where there are."""
    if "building" in found.coords:
        stands = np.ma.masked_equal(found["building"].to_numpy(), 0)
        panel.pcolormesh(x, y, stands, cmap=ListedColormap([BUILDING_COLOUR]), shading="nearest")


def _contour_bed(panel: Axes, x: Array, y: Array, found: xr.Dataset) -> None:
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


def _frame_panel(panel: Axes, frame: Frame | None, corners: tuple[Array, Array]) -> None:
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
    at = 0.04 if _leaves_upper_left(frame) else 0.96
    panel.annotate(
        "N",
        xy=(at, 0.97),
        xytext=(at, 0.83),
        xycoords="axes fraction",
        horizontalalignment="center",
        verticalalignment="top",
        arrowprops={"arrowstyle": "-|>", "color": "k", "linewidth": 0.8},
        fontsize="small",
    )


def mark_receptors(panel: Axes, frame: Frame | None, found: xr.Dataset, *, named: bool = True) -> None:
    """Mark the receptors that hazard maps or a store's maps come with, in their attribute ``receptors``."""
    halo = [withStroke(linewidth=2.2, foreground="white")]
    for receptor in json.loads(found.attrs.get("receptors", "[]")):
        shape = receptor["polygon"] or receptor["line"] or [receptor["point"]]
        x, y = np.array([*shape, *shape[:1]] if receptor["polygon"] else shape, np.float64).T
        east, north = frame.on_map(x, y) if frame else (x, y)
        mark = "o" if len(shape) == 1 else ""
        panel.plot(east, north, color="k", marker=mark, markersize=3, linewidth=1.1, path_effects=halo)
        if named:
            at = int(np.argmax(north))
            panel.annotate(
                receptor["name"],
                (east[at], north[at]),
                (3, 3),
                textcoords="offset points",
                fontsize="small",
                path_effects=halo,
                annotation_clip=True,
            )


def _leaves_upper_left(frame: Frame | None) -> bool:
    """Whether the slanted domain leaves free the upper left and lower right corners, not the other two."""
    return frame is None or frame.georeference.azimuth % 180 < 90


def _scale_bar(panel: Axes, frame: Frame | None, width: float) -> None:
    """Draw a bar of a round length, about a fifth of the map's width, in a corner below."""
    length = round_below(width / 5)
    (left, right), (bottom, top) = panel.get_xlim(), panel.get_ylim()
    side = 0.03 * (right - left)
    x = right - side - length if _leaves_upper_left(frame) else left + side
    y = bottom + 0.06 * (top - bottom)
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


def _sources(layer: Layer, found: xr.Dataset) -> list[str]:
    """Say where classes are from."""
    if layer.kind != "class":
        return []
    share = f"reached by {found.attrs['intensity_share']:.3g} of the runs or more"
    names = ["intensity", "level"] if layer.name == "hazard_level" else ["intensity"]
    sources = dict.fromkeys(found.attrs[f"{name}_source"] for name in names)
    return [f"{share}; after {'; '.join(sources)}"]
