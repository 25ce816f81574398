"""Pictures from a store."""

from __future__ import annotations

import math
from pathlib import Path

import numpy as np
import xarray as xr
from matplotlib import colormaps
from matplotlib.axes import Axes
from matplotlib.colors import BoundaryNorm
from matplotlib.figure import Figure
from matplotlib.ticker import MaxNLocator

PANEL_WIDTH = 4.6
LEVELS = 10


def depth_panels(store: xr.Dataset, run: int, path: Path) -> None:
    """Draw the depth of a run at its output times after the start, one panel a time, on one scale.

    Parameters
    ----------
    store : Dataset
        A scenario's store.
    run : int
        Position of the run.
    path : Path
        Picture to write; its suffix says of what kind.

    Raises
    ------
    ValueError
        If there is no such run, it was not done, or its depth was not kept.
    OSError
        If the picture cannot be written.
    """
    if not 0 <= run < store.sizes["run"]:
        raise ValueError(f"there is no run {run}: the store holds {store.sizes['run']}, counted from 0")
    if "depth" not in store:
        raise ValueError("the store keeps no depth")
    depth = store["depth"].isel(run=run)
    depth = depth.isel(time=depth["time"].to_numpy() > 0).dropna("time", how="all").load()
    if not depth.sizes["time"]:
        raise ValueError(f"run {run} has no frames: it was not done, or failed at once")
    x, y = depth["x"].to_numpy(), depth["y"].to_numpy()
    shape = (y[-1] - y[0]) / (x[-1] - x[0])
    columns = _columns(depth.sizes["time"], shape)
    rows = math.ceil(depth.sizes["time"] / columns)
    height = float(np.clip(PANEL_WIDTH * shape, 0.7, 9.0))
    figure = Figure(figsize=(PANEL_WIDTH * columns + 0.9, (height + 0.35) * rows + 0.9), layout="constrained")
    axes = figure.subplots(rows, columns, sharex=True, sharey=True, squeeze=False)
    levels = MaxNLocator(LEVELS, min_n_ticks=5).tick_values(0, max(float(depth.max()), 1e-6))
    norm = BoundaryNorm(levels, colormaps["viridis"].N)
    threshold = levels[1] / 10
    for panel, frame in zip(axes.flat, depth, strict=False):
        wet = frame.where(frame > threshold).to_numpy()
        mesh = panel.pcolormesh(x, y, wet, cmap="viridis", norm=norm, shading="nearest", rasterized=True)
        panel.contour(x, y, frame.to_numpy(), levels=levels[1:-1], colors="k", linewidths=0.3)
        _label(panel, float(frame["time"]))
    for panel in list(axes.flat)[depth.sizes["time"] :]:
        panel.set_visible(False)
    figure.colorbar(
        mesh, ax=axes, label="depth (m)", shrink=min(1.0, 3.5 / (height * rows)) if rows > 1 else 1.0
    )
    figure.supxlabel("arc length along the bed (m)", fontsize="medium")
    figure.supylabel("across the bed (m)", fontsize="medium")
    figure.suptitle(_title(store, run))
    figure.savefig(path, dpi=150)


def _columns(frames: int, shape: float) -> int:
    """Columns of panels that make a picture about as wide as high."""
    best = range(1, frames + 1)
    return min(best, key=lambda n: abs(math.log(math.ceil(frames / n) * (shape + 0.08) / n / 0.8)))


def _label(panel: Axes, time: float) -> None:
    panel.set_aspect("equal")
    panel.set_title(f"t = {time:g} s", fontsize="medium", loc="left", pad=3)


def _title(store: xr.Dataset, run: int) -> str:
    """Name of the scenario, and the run's parameters where it has some."""
    swept = [c.isel(run=run) for name, c in store.coords.items() if c.dims == ("run",) and name != "run"]
    given = ", ".join(
        f"{str(c.name).replace('_', ' ')} {c.item():g} {c.attrs['units']}"
        if c.dtype.kind == "f"
        else f"{str(c.name).replace('_', ' ')} {c.item()}"
        for c in swept
    )
    return f"{store.attrs['title']}{': ' if given else ''}{given}"
