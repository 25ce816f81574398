"""The map of where releases, receptors and the domain lie."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import xarray as xr
from matplotlib.lines import Line2D

from pipeline.assess.georeference import Frame
from pipeline.gis.map_names import keep_apart
from pipeline.gis.vectors import RELEASE_COLOUR
from pipeline.hazard.map_panel import (
    draw_ground,
    frame_panel,
    laid,
    mark_places,
    panels_of,
    renderer_of,
    scale_bar,
)

REACHED_COLOUR = "#2171b5"


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
    east, north, corners = laid(found, frame)
    width, height = (float(np.ptp(side)) for side in corners)
    figure, (panel,) = panels_of(height / width, 1, height / width < 0.5)
    if "arrival_share" in found:
        reached = found["arrival_share"].fillna(0).to_numpy() > 0
        if reached.any() and not reached.all():
            panel.contour(east, north, reached, levels=[0.5], colors=REACHED_COLOUR, linewidths=1.4)
    draw_ground(panel, east, north, found)
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
    # names stand where they are found to have room
    figure.set_layout_engine("none")
    keep_apart(renderer_of(figure), panel, names)
    figure.savefig(path, bbox_inches="tight")
    return path
