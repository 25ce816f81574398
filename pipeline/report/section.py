"""The longitudinal section of the flow: the bed, how deep the flow is along it, and its energy."""

from __future__ import annotations

from dataclasses import dataclass
from io import BytesIO

import numpy as np
import xarray as xr
from matplotlib.figure import Figure
from numpy.typing import NDArray

from pipeline.assess.ensemble import computed
from pipeline.assess.frames import on_surface
from pipeline.gis.symbology import SCALES
from pipeline.settings.hazard import Hazard
from solver.physics.constants import GRAVITY

Array = NDArray[np.float64]
WIDTH = 8.0
# places along a flow on an elevation model, and cells to each side that the flow is looked for in
PLACES, BESIDE = 60, 3
EXAGGERATIONS = (1, 2, 5, 10, 20, 50)


@dataclass(frozen=True)
class Line:
    """The line of a section.

    distance : horizontal, m. bed : elevation, m. rows, columns : of the cells on it, (n,); for a profile no
    rows, as all that lie across it count.
    """

    distance: Array
    bed: Array
    columns: NDArray[np.intp]
    rows: NDArray[np.intp] | None = None

    def largest(self, field: xr.DataArray) -> Array:
        """Give the largest value of a field across the line, (n,)."""
        held = field.transpose("y", "x").to_numpy().astype(np.float64)
        if self.rows is None:
            return np.asarray(np.nanmax(np.nan_to_num(held), axis=0)[self.columns])
        found = np.zeros(len(self.columns))
        for i, (row, column) in enumerate(zip(self.rows, self.columns, strict=True)):
            part = held[
                max(row - BESIDE, 0) : row + BESIDE + 1, max(column - BESIDE, 0) : column + BESIDE + 1
            ]
            found[i] = np.nan_to_num(part).max()
        return found


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
    flows = depths[high] > SCALES["depth"].edges[0]
    if not flows.any():
        return None
    figure = Figure(figsize=(WIDTH, 4.2), layout="compressed", dpi=150)
    axes = figure.subplots()
    rise = float(np.ptp(line.bed)) or 1.0
    times = max(each for each in EXAGGERATIONS if each == 1 or each * depths[high].max() < 0.12 * rise)
    colours = ("#9ecae1", "#4292c6")
    for (level, depth), colour in zip(sorted(depths.items(), reverse=True), colours, strict=False):
        words = f"largest depth that {level:g} keep to" + (f", {times} times its height" if times > 1 else "")
        axes.fill_between(
            line.distance, line.bed, line.bed + times * depth, color=colour, linewidth=0, label=words
        )
    axes.plot(line.distance, line.bed, color="k", linewidth=1.2, label="bed")
    head = np.where(flows, line.bed + depths[high] + speed**2 / (2 * GRAVITY), np.nan)
    axes.plot(
        line.distance,
        head,
        color="#cb181d",
        linewidth=1.2,
        label=f"energy height at the depth and speed that {high:g} keep to",
    )
    _energy_line(axes, store, line, flows)
    axes.set_xlabel("horizontal distance (m)")
    axes.set_ylabel("elevation (m)")
    axes.grid(alpha=0.3)
    axes.legend(frameon=False, fontsize="small", loc="upper right")
    held = BytesIO()
    figure.savefig(held, format="png", bbox_inches="tight")
    return held.getvalue()


def _energy_line(axes: object, store: xr.Dataset, line: Line, flows: NDArray[np.bool_]) -> None:
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
    shown = (fall >= 0) & (straight >= line.bed.min())
    axes.plot(  # type: ignore[attr-defined]
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
    distance, bed = (
        found[name].to_numpy().astype(np.float64) for name in ("horizontal_distance", "elevation")
    )
    return Line(distance, bed, np.arange(len(bed)))


def _along_surface(found: xr.Dataset) -> Line | None:
    """Follow the flow by its time of arrival: the mean place of what is reached in each part of it."""
    if "earliest_arrival_time" not in found:
        return None
    arrival = found["earliest_arrival_time"].transpose("y", "x").to_numpy()
    depth = found["depth_quantile"].isel(quantile=-1).transpose("y", "x").to_numpy().astype(np.float64)
    row, column = np.nonzero(np.isfinite(arrival) & (depth > SCALES["depth"].edges[0]))
    if len(row) < 4:
        return None
    order = np.argsort(arrival[row, column], kind="stable")
    weight = depth[row, column] ** 2
    places = [
        (np.average(row[part], weights=weight[part]), np.average(column[part], weights=weight[part]))
        for part in np.array_split(order, min(PLACES, len(order) // 2))
    ]
    rows, columns = np.rint(np.array(places)).astype(np.intp).T
    kept = np.append(True, (np.diff(rows) != 0) | (np.diff(columns) != 0))
    rows, columns = rows[kept], columns[kept]
    x, y = (found[axis].to_numpy()[at] for axis, at in (("x", columns), ("y", rows)))
    distance = np.append(0.0, np.cumsum(np.hypot(np.diff(x), np.diff(y))))
    bed = found["elevation"].transpose("y", "x").to_numpy()[rows, columns].astype(np.float64)
    return Line(distance, bed, columns, rows)
