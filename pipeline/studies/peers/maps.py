"""Maps of two codes side by side, and which of them reached what."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import xarray as xr
from matplotlib.axes import Axes
from matplotlib.colors import ListedColormap
from matplotlib.figure import Figure
from matplotlib.ticker import MultipleLocator
from numpy.typing import NDArray

from pipeline.assess.relief import draw_relief
from pipeline.studies.peers.sites import REACHED, Peer, on_cells

Array = NDArray[np.float64]
# distance of the ticks, m
TICKS = 250.0


def picture(store: xr.Dataset, peer: Peer, fields: tuple[Array, Array, Array, Array], path: Path) -> None:
    """Draw peak thickness of both side by side, and where they differ."""
    x, y, ours, theirs = fields
    elevation = on_cells(
        np.nan_to_num(store["elevation"].to_numpy()), store["x"].to_numpy(), store["y"].to_numpy(), x, y
    )
    held = np.isfinite(store["elevation"].to_numpy()).astype(np.float64)
    known = on_cells(held, store["x"].to_numpy(), store["y"].to_numpy(), x, y) > 0
    ground = np.where(known, elevation, np.nan)
    wet = (ours > REACHED) | (theirs > REACHED)
    rows, columns = np.flatnonzero(wet.any(1)), np.flatnonzero(wet.any(0))
    view = (slice(max(rows[0] - 6, 0), rows[-1] + 7), slice(max(columns[0] - 6, 0), columns[-1] + 7))
    x, y, ours, theirs, ground = x[view[1]], y[view[0]], ours[view], theirs[view], ground[view]
    shape = len(y) / len(x)
    figure = Figure(figsize=(12, 3.7 * shape + 0.8), layout="compressed", dpi=90)
    panels: NDArray[Any] = figure.subplots(1, 3, sharex=True, sharey=True)
    top = float(max(ours.max(), theirs.max()))
    for panel, peak, title in zip(panels, (ours, theirs), ("LMLS", peer.code), strict=False):
        _shade(panel, x, y, ground, title)
        drawn = panel.pcolormesh(
            x, y, np.ma.masked_less(peak, REACHED), cmap="YlGnBu", vmin=0, vmax=0.6 * top, shading="nearest"
        )
    figure.colorbar(drawn, ax=list(panels[:2]), label="peak thickness (m)", shrink=0.8)
    _shade(panels[2], x, y, ground, "which reached")
    mine, other = ours > REACHED, theirs > REACHED
    which = ListedColormap(["tab:orange", "tab:blue", "0.35"])
    classes = np.ma.masked_equal(mine + 2 * other, 0)
    panels[2].pcolormesh(
        x,
        y,
        classes,
        cmap=which,
        vmin=0.5,
        vmax=3.5,
        shading="nearest",
        alpha=0.8,
    )
    for colour, name in (("tab:orange", "LMLS alone"), ("tab:blue", f"{peer.code} alone"), ("0.35", "both")):
        panels[2].plot([], [], "s", color=colour, label=name)
    panels[2].legend(fontsize="x-small", loc="best")
    about = f"peak thickness above {REACHED:g} m; ticks every {TICKS:g} m"
    figure.suptitle(f"{peer.site}, {peer.law}: {about}", fontsize="medium")
    path.parent.mkdir(parents=True, exist_ok=True)
    figure.savefig(path, bbox_inches="tight")


def _shade(panel: Axes, x: Array, y: Array, ground: Array, title: str) -> None:
    draw_relief(panel, x, y, ground, named=False)
    panel.set_aspect("equal")
    panel.set_title(title, fontsize="small", loc="left")
    for axis in (panel.xaxis, panel.yaxis):
        axis.set_major_locator(MultipleLocator(TICKS))
    panel.tick_params(labelbottom=False, labelleft=False)
