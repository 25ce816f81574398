"""The colours of a map: by classes of its legend, pale where a bound is the estimate, hatched if unknown."""

from __future__ import annotations

from typing import Literal

import numpy as np
import xarray as xr
from matplotlib.axes import Axes
from matplotlib.colors import BoundaryNorm, ListedColormap
from numpy.typing import NDArray

from pipeline.gis.layer import Layer
from pipeline.gis.symbology import UNKNOWN_COLOUR, Style
from pipeline.hazard import intensity

Array = NDArray[np.float64]
# of a bound where it is the estimate
ALIKE = 0.25
# of what is not known, over its colour
UNKNOWN_HATCH, UNKNOWN_LINES = "--", "#8a4f9e"
# above every value
HIGHEST = 1e30


def hatch(panel: Axes, x: Array, y: Array, doubt: xr.DataArray | None) -> None:
    """Hatch where an error exceeds the number it is of."""
    if doubt is None or not doubt.any():
        return
    panel.contourf(x, y, doubt.to_numpy().astype(float), levels=[0.5, 1.5], colors="none", hatches=["/////"])


def same_class(layer: Layer, values: Array) -> NDArray[np.bool_]:
    """Say where a bound is of the class that the estimate is of."""
    both = (layer.values[""].to_numpy(), values)
    edges = [each.lower for each in layer.style.entries]
    at: Literal["left", "right"] = "right" if layer.style.discrete else "left"
    one, other = (np.searchsorted(edges, np.nan_to_num(each, nan=-1), side=at) for each in both)
    known = [np.isfinite(each) & ((each != intensity.UNKNOWN) | (not layer.style.discrete)) for each in both]
    return np.asarray((one == other) & (known[0] == known[1]))


def is_unknown(layer: Layer, values: Array) -> NDArray[np.bool_]:
    """Say where nothing was computed; a time is missing where nothing arrives, which is known."""
    if layer.style.discrete:
        return np.asarray(values == intensity.UNKNOWN)
    return np.isnan(values) & (not layer.is_of_time)


def fill(
    panel: Axes,
    x: Array,
    y: Array,
    values: Array,
    layer: Layer,
    alpha: float,
    same: NDArray[np.bool_] | None = None,
) -> None:
    """Colour one panel where something is known; what is the ``same`` as on another one is pale."""
    style = layer.style
    if layer.kind == "difference":
        _differences(panel, x, y, values, layer, alpha)
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


def _differences(panel: Axes, x: Array, y: Array, values: Array, layer: Layer, alpha: float) -> None:
    """Colour more and less cell by cell; what differs by less than the least class stays free."""
    style = layer.style
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


def _cells(panel: Axes, x: Array, y: Array, values: Array, style: Style, alpha: float) -> None:
    """Colour cell by cell; nothing is left free."""
    if style.discrete:
        numbers = [each.lower for each in style.entries]
        edges, free = [*(number - 0.5 for number in numbers), numbers[-1] + 0.5], values < 0.5
    else:
        edges, free = [*style.edges[:-1], min(style.edges[-1], HIGHEST)], ~(values > style.edges[0])
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


def fill_unknown(panel: Axes, x: Array, y: Array, unknown: NDArray[np.bool_], alpha: float) -> None:
    """Colour and hatch where nothing is known."""
    if not unknown.any():
        return
    colour = ListedColormap([UNKNOWN_COLOUR])
    mesh = np.ma.masked_where(~unknown, np.zeros(unknown.shape))
    panel.pcolormesh(x, y, mesh, cmap=colour, shading="nearest", alpha=alpha)
    part = panel.contourf(
        x, y, unknown.astype(float), levels=[0.5, 1.5], colors="none", hatches=[UNKNOWN_HATCH]
    )
    part.set(edgecolor=UNKNOWN_LINES, linewidth=0)
