"""The longitudinal section of the flow: the bed, how deep the flow is along it, and its energy."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from io import BytesIO

import numpy as np
import xarray as xr
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from numpy.typing import NDArray

from pipeline.assess.ensemble import computed, events_per_year
from pipeline.assess.frames import on_surface
from pipeline.gis.symbology import SCALES
from pipeline.settings.hazard import Hazard
from solver.physics.constants import GRAVITY

Array = NDArray[np.float64]
Cells = NDArray[np.intp]
WIDTH = 8.0
# along a flow on an elevation model
MOST_PLACES = 60


@dataclass(frozen=True)
class Line:
    """The line of a section.

    Parameters
    ----------
    distance : array
        Horizontal, m.
    bed : array
        Elevation, m.
    across : Sequence[tuple[Cells, Cells]]
        The cells at each place of it and to both sides, rows and columns.
    """

    distance: Array
    bed: Array
    across: Sequence[tuple[Cells, Cells]]

    def largest(self, field: xr.DataArray) -> Array:
        """Give the largest value of a field across the line, (n,)."""
        held = np.nan_to_num(field.transpose("y", "x").to_numpy().astype(np.float64))
        return np.array([held[rows, columns].max() for rows, columns in self.across])


def section(store: xr.Dataset, found: xr.Dataset, settings: Hazard) -> bytes | None:
    """Draw the section as PNG; None where there is nothing to draw it from.

    Parameters
    ----------
    store : Dataset
        A scenario's store.
    found : Dataset
        Its hazard maps, with quantiles of depth and speed.
    settings : Hazard
        For the quantiles.
    """
    if not {"depth_quantile", "speed_quantile"} <= set(found) or "elevation" not in found.coords:
        return None
    line = _along_surface(found) if on_surface(store) else _along_profile(found)
    if line is None:
        return None
    middle, high = min(settings.quantiles), max(settings.quantiles)
    depths = {
        level: line.largest(found["depth_quantile"].sel(quantile=level))
        for level in dict.fromkeys((middle, high))
    }
    speed = line.largest(found["speed_quantile"].sel(quantile=high))
    counted = "runs" if events_per_year(store) is None else "events"
    flows = depths[high] > SCALES["depth"].edges[0]
    if not flows.any():
        return None
    figure = Figure(figsize=(WIDTH, 5.2), layout="compressed", dpi=150)
    above, below = figure.subplots(2, 1, sharex=True, height_ratios=(5, 2))
    above.plot(line.distance, line.bed, color="k", linewidth=1.2, label="bed")
    head = np.where(flows, line.bed + depths[high] + speed**2 / (2 * GRAVITY), np.nan)
    words = f"energy height at the depth and speed that {high:g} of the {counted} keep to"
    above.plot(line.distance, head, color="#cb181d", linewidth=1.2, label=words)
    _energy_line(above, store, line, flows)
    colours = ("#9ecae1", "#4292c6")
    for (level, depth), colour in zip(sorted(depths.items(), reverse=True), colours, strict=False):
        below.fill_between(line.distance, depth, color=colour, linewidth=0, label=f"{level:g} keep to")
    above.set_ylabel("elevation (m)")
    below.set_ylabel("largest depth (m)")
    below.set_xlabel("horizontal distance (m)")
    below.set_ylim(0, None)
    for axes in (above, below):
        axes.grid(alpha=0.3)
        axes.legend(frameon=False, fontsize="small", loc="upper right")
    held = BytesIO()
    figure.savefig(held, format="png", bbox_inches="tight")
    return held.getvalue()


def _energy_line(axes: Axes, store: xr.Dataset, line: Line, flows: NDArray[np.bool_]) -> None:
    """Draw the straight line from the crown at the median reach angle of the computed runs."""
    angles = store["reach_angle"].to_numpy()[computed(store).to_numpy()]
    angles = angles[np.isfinite(angles)]
    if not angles.size:
        return
    angle = float(np.median(angles))
    start = int(np.flatnonzero(flows)[0])
    away = np.sign(line.distance[-1] - line.distance[start]) or 1.0
    fall = np.tan(np.radians(angle)) * (line.distance - line.distance[start]) * away
    straight = line.bed[start] - fall
    over = np.flatnonzero((fall >= 0) & (straight >= line.bed))
    shown = np.arange(over.min(), over.max() + 1)
    axes.plot(
        line.distance[shown],
        straight[shown],
        color="#6a51a3",
        linestyle=(0, (5, 3)),
        linewidth=1.1,
        label=f"energy line at the median reach angle, {angle:.3g}°",
    )


def _along_profile(found: xr.Dataset) -> Line | None:
    if "horizontal_distance" not in found.coords or found["elevation"].dims != ("x",):
        return None
    places = ("horizontal_distance", "elevation")
    distance, bed = (found[name].to_numpy().astype(np.float64) for name in places)
    rows = np.arange(found.sizes["y"])
    return Line(distance, bed, [(rows, np.full_like(rows, column)) for column in range(len(bed))])


def _along_surface(found: xr.Dataset) -> Line | None:
    """Follow the flow downhill: the mean place of what it covers in each band of elevation."""
    bed = found["elevation"].transpose("y", "x").to_numpy().astype(np.float64)
    depth = found["depth_quantile"].isel(quantile=-1).transpose("y", "x").to_numpy().astype(np.float64)
    rows, columns = np.nonzero(np.isfinite(bed) & (depth > SCALES["depth"].edges[0]))
    if len(rows) < MOST_PLACES:
        return None
    order = np.argsort(-bed[rows, columns], kind="stable")
    across = [(rows[part], columns[part]) for part in np.array_split(order, MOST_PLACES)]
    # where it is deep the flow is, and not at its edges
    weights = [depth[each] ** 2 for each in across]
    x, y = found["x"].to_numpy(), found["y"].to_numpy()
    places = [
        (
            np.average(x[column], weights=w),
            np.average(y[row], weights=w),
            np.average(bed[row, column], weights=w),
        )
        for (row, column), w in zip(across, weights, strict=True)
    ]
    east, north, height = np.array(places).T
    distance = np.append(0.0, np.cumsum(np.hypot(np.diff(east), np.diff(north))))
    return Line(distance, height, across)
