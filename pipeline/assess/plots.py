"""Pictures from a store."""

from __future__ import annotations

import json
import math
import textwrap
from collections.abc import Sequence
from pathlib import Path

import numpy as np
import xarray as xr
from matplotlib import colormaps
from matplotlib.axes import Axes
from matplotlib.cm import ScalarMappable
from matplotlib.colors import BoundaryNorm
from matplotlib.figure import Figure
from matplotlib.ticker import MaxNLocator
from numpy.typing import NDArray

from pipeline.assess.frames import mean_spacing, on_surface
from pipeline.assess.gridding import gridded
from pipeline.assess.relief import draw_relief
from pipeline.readable import number, with_unit
from pipeline.store.variables import STATUS, Status

PANEL_WIDTH = 4.6
LEVELS = 10
MOST_PANELS = 12
# thin films stay pale, so that the eye goes to the bulk
COLOURS = "YlGnBu"
CHARACTERS_PER_INCH = 13


def depth_panels(
    store: xr.Dataset,
    run: int,
    path: Path,
    most: int = MOST_PANELS,
    times: Sequence[float] | None = None,
) -> None:
    """Draw the depth of a run at its output times, one panel a time, on one scale.

    A cloud is drawn on a lattice of its mean spacing.

    Parameters
    ----------
    store : Dataset
        A scenario's store.
    run : int
        Position of the run.
    path : Path
        Picture to write; its suffix says of what kind.
    most : int
        Panels at most, evenly spread over the output times after the start, the last among them.
    times : sequence of float, optional
        Times that are drawn instead, s; the nearest output time stands for each.

    Raises
    ------
    ValueError
        If there is no such run, it was not done, its depth was not kept, or a time lies outside the run.
    OSError
        If the picture cannot be written.
    """
    if not 0 <= run < store.sizes["run"]:
        raise ValueError(f"there is no run {run}: the store holds {store.sizes['run']}, counted from 0")
    if "depth" not in store:
        raise ValueError("the store keeps no depth")
    frames = store[["depth", *(["elevation"] if on_surface(store) else [])]].isel(run=run)
    frames = frames.isel(time=_chosen(frames["depth"], run, most, times))
    if "point" in frames.dims:
        frames = gridded(frames, mean_spacing(frames))
    depth = frames["depth"].load()
    x, y = depth["x"].to_numpy(), depth["y"].to_numpy()
    shape = (y[-1] - y[0]) / (x[-1] - x[0])
    columns = _columns(depth.sizes["time"], shape)
    rows = math.ceil(depth.sizes["time"] / columns)
    height = float(np.clip(PANEL_WIDTH * shape, 0.7, 9.0))
    figure = Figure(
        figsize=(PANEL_WIDTH * columns + 1.1, (height + 0.3) * rows + 0.9), layout="compressed", dpi=150
    )
    axes = figure.subplots(rows, columns, sharex=True, sharey=True, squeeze=False)
    levels = MaxNLocator(LEVELS, min_n_ticks=5).tick_values(0, max(float(depth.max()), 1e-6))
    filled = [levels[1] / 20, *levels[1:]]
    norm = BoundaryNorm(levels, colormaps[COLOURS].N)
    ground = frames["elevation"].to_numpy() if on_surface(store) else None
    for panel, frame in zip(axes.flat, depth, strict=False):
        values = frame.to_numpy()
        if ground is not None:
            draw_relief(panel, x, y, ground, named=False)
            panel.xaxis.set_major_locator(MaxNLocator(3))
        panel.contourf(x, y, values, levels=filled, cmap=COLOURS, norm=norm)
        panel.contour(x, y, values, levels=filled, colors="k", linewidths=0.3)
        _draw_bend(panel, _bend(store, run))
        _label(panel, float(frame["time"]), ticks=int(np.clip(PANEL_WIDTH * shape / 0.3, 1, 5)))
    for panel in list(axes.flat)[depth.sizes["time"] :]:
        panel.set_visible(False)
    figure.colorbar(ScalarMappable(norm, COLOURS), ax=axes, label="depth (m)", aspect=30, pad=0.02)
    for panel in axes[-1]:
        panel.set_xlabel("easting (m)" if on_surface(store) else "along the bed (m)")
        panel.ticklabel_format(useOffset=False, style="plain")
    figure.supylabel("northing (m)" if on_surface(store) else "across the bed (m)", fontsize="medium")
    description = textwrap.fill(store.attrs["comment"], int(CHARACTERS_PER_INCH * figure.get_figwidth()))
    figure.suptitle(f"{title_of(store, run)}\n{description}".strip(), fontsize="medium")
    figure.savefig(path, bbox_inches="tight")


def _chosen(depth: xr.DataArray, run: int, most: int, times: Sequence[float] | None) -> NDArray[np.int64]:
    """Choose the frames of a run that are drawn, by their positions."""
    # a frame is there as a whole or not at all
    known = depth.isel({name: 0 for name in depth.dims if name != "time"}).notnull().to_numpy()
    at = depth["time"].to_numpy()
    there = np.flatnonzero(known)
    if not (at[there] > 0).any():
        raise ValueError(f"run {run} has no frames: it was not done, or failed at once")
    if times is None:
        there = there[at[there] > 0]
        every = -(-len(there) // most)
        return there[(len(there) - 1) % every :: every]
    last = float(at[there[-1]])
    for time in times:
        if not 0 <= time <= last:
            raise ValueError(f"expected times from 0 to {last:g} s, the end of run {run}, found {time:g}")
    return np.unique([there[np.argmin(np.abs(at[there] - time))] for time in times])


def _columns(frames: int, shape: float) -> int:
    """Columns of panels that make a picture about as wide as high."""
    best = range(1, frames + 1)
    return min(best, key=lambda n: abs(math.log(math.ceil(frames / n) * (shape + 0.08) / n / 0.8)))


def _label(panel: Axes, time: float, ticks: int) -> None:
    panel.set_aspect("equal")
    panel.yaxis.set_major_locator(MaxNLocator(ticks, integer=True, min_n_ticks=1))
    panel.set_title(f"t = {time:g} s", fontsize="medium", loc="left", pad=3)


def _draw_bend(panel: Axes, bounds: list[float]) -> None:
    for bound in bounds:
        panel.axvline(bound, color="0.5", linestyle=(0, (4, 3)), linewidth=0.7, zorder=0)
    if bounds:
        panel.text(
            sum(bounds) / 2,
            0.97,
            "bend",
            transform=panel.get_xaxis_transform(),
            horizontalalignment="center",
            verticalalignment="top",
            fontsize="x-small",
            color="0.4",
        )


def _bend(store: xr.Dataset, run: int) -> list[float]:
    """Where the bend of the bed begins and ends, m; empty for other profiles."""
    terrain = json.loads(store.attrs["scenario_content"]).get("terrain", {})
    if terrain.get("profile") != "bend":
        return []
    swept = {c.attrs.get("key"): c[run].item() for c in store.coords.values() if c.dims == ("run",)}
    return [float(swept.get(f"terrain.{end}", terrain[end])) for end in ("start", "end")]


def title_of(store: xr.Dataset, run: int) -> str:
    """Name of the scenario, the run's parameters where it has some, and its status where it is not done."""
    state = Status(int(store[STATUS.name][run]))
    return f"{name_of(store, run)}{'' if state is Status.DONE else f' ({state.plain_words})'}"


def name_of(store: xr.Dataset, run: int) -> str:
    """Name of the scenario, and the run's parameters where it has some."""
    varied = [c.isel(run=run) for c in store.coords.values() if c.dims == ("run",) and "key" in c.attrs]
    given = ", ".join(
        f"{str(c.name).replace('_', ' ')} {with_unit(number(c.item()), str(c.attrs.get('units', '')))}"
        for c in varied
    )
    return f"{store.attrs['title']}{': ' if given else ''}{given}"
