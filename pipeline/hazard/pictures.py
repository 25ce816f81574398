"""Pictures of hazard maps, with scale, legend, contour lines and the number of runs behind them."""

from __future__ import annotations

import textwrap
from collections.abc import Sequence
from dataclasses import fields
from io import BytesIO
from pathlib import Path

import numpy as np
import xarray as xr
from dask.tokenize import tokenize
from matplotlib.axes import Axes
from matplotlib.patches import Patch

from pipeline.assess.georeference import Frame
from pipeline.assess.plots import CHARACTERS_PER_INCH
from pipeline.gis.layer import BANDS, ERROR, Layer
from pipeline.gis.map_names import keep_apart
from pipeline.gis.symbology import UNKNOWN_COLOUR, UNKNOWN_WORDS
from pipeline.hazard.discretisation import ENDING
from pipeline.hazard.map_colours import (
    UNKNOWN_HATCH,
    UNKNOWN_LINES,
    fill,
    fill_unknown,
    hatch,
    is_unknown,
    same_class,
)
from pipeline.hazard.map_panel import (
    BUILDING_COLOUR,
    arrange,
    draw_ground,
    frame_panel,
    has_relief,
    laid,
    mark_places,
    panels_of,
    renderer_of,
    scale_bar,
)

# of colours on a hillshade
OVER_RELIEF = 0.8
PANEL_TITLES = {
    "": "estimate",
    "_lower": "lower bound; strong where it differs",
    "_upper": "upper bound; strong where it differs",
    ERROR: "half width of its error",
}
# around a picture, inches
PADDING = 0.1
IN_DOUBT = "hatched where its error exceeds it"


# pictures that were drawn last in this process, by all that they show, and how many are kept: 0.3 MB each
drawn: dict[str, bytes] = {}
KEPT = 128


def draw(layer: Layer, found: xr.Dataset, frame: Frame | None, path: Path) -> Path:
    """Draw a map: on the ground where there is a frame, else along and across the bed.

    Where runs are missing, the bounds are drawn beside it. The page about a place shows the maps that were
    drawn before it, so that one of the same is written again and not drawn again.

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
    on = (repr(frame.georeference), frame.arc, frame.distance, frame.across) if frame else ()
    given = [getattr(layer, each.name) for each in fields(layer)]
    kind = path.suffix.removeprefix(".")
    key = str(tokenize(given, found[[]], on, kind))
    if key not in drawn:
        drawn[key] = _draw(layer, found, frame, kind)
        for oldest in list(drawn)[:-KEPT]:
            del drawn[oldest]
    path.write_bytes(drawn[key])
    return path


def _draw(layer: Layer, found: xr.Dataset, frame: Frame | None, kind: str) -> bytes:
    """Give the picture as a file of a kind, as ``png``."""
    shown = [""] if layer.is_certain else list(layer.values)
    east, north, corners = laid(found, frame)
    width, height = (float(np.ptp(side)) for side in corners)
    wide = height / width < 0.5
    figure, panels = panels_of(height / width, len(shown), wide)
    alpha = OVER_RELIEF if has_relief(found) else 1.0
    # nothing flows there: they are drawn as what they are
    built = found["building"].to_numpy() != 0 if "building" in found.coords else np.zeros(east.shape, bool)
    unknown = [is_unknown(layer, layer.values[bound].to_numpy()) & ~built for bound in shown]
    names = []
    for panel, bound, missing in zip(panels, shown, unknown, strict=True):
        values = layer.values[bound].to_numpy()
        same = same_class(layer, values) if bound not in ("", ERROR) else None
        fill(panel, east, north, values, layer, alpha, same)
        fill_unknown(panel, east, north, missing, alpha)
        if bound == "":
            hatch(panel, east, north, layer.in_doubt)
        draw_ground(panel, east, north, found)
        frame_panel(panel, frame, corners)
        names += mark_places(panel, frame, found, named=bound == "")
        if len(shown) > 1:
            note = f", {IN_DOUBT}" if bound == "" and ERROR in shown else ""
            # of differences no part is pale
            words = BANDS[bound] if layer.kind == "difference" else PANEL_TITLES[bound]
            panel.set_title(words + note, fontsize="medium", loc="left", pad=3)
    scale_bar(panels[0], frame, width)
    _explain(panels[0], layer, has_unknown=any(each.any() for each in unknown), has_built=bool(built.any()))
    for panel in panels if wide else panels[:2]:
        panel.set_ylabel("northing (m)" if frame else "across the bed (m)")
    # below each other one row of eastings is enough, and nothing stands between the panels but titles
    below = panels[-1:] if wide else panels[1:] if len(panels) > 2 else panels
    for panel in panels:
        panel.tick_params(labelbottom=panel in below)
    for panel in below:
        panel.set_xlabel("easting (m)" if frame else "along the bed (m)")
    characters = int(CHARACTERS_PER_INCH * (figure.get_figwidth() - 0.5))
    lines = [f"{found.attrs['title']}: {layer.title}", found.attrs["comment"], *_sources(layer, found)]
    if frame:
        lines[1] += f"; {frame.system}"
    if spacing := found.attrs.get(ENDING[1:]):
        lines.append(f"error of the spacing: {spacing}")
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
    arrange(figure, panels)
    title.set_in_layout(True)
    renderer = renderer_of(figure)
    keep_apart(renderer, panels[0], names)
    # with "tight" all would be drawn once more, only to be measured
    box = figure.get_tightbbox(renderer).padded(PADDING)
    held = BytesIO()
    figure.savefig(held, format=kind, bbox_inches=box)
    return held.getvalue()


def _explain(panel: Axes, layer: Layer, *, has_unknown: bool, has_built: bool) -> None:
    """Add the legend."""
    style = layer.style
    handles = [
        Patch(facecolor=each.colour, edgecolor="0.3", linewidth=0.4, label=each.label)
        for each in reversed(style.entries)
    ]
    if has_unknown:
        handles.append(
            Patch(
                facecolor=UNKNOWN_COLOUR,
                edgecolor=UNKNOWN_LINES,
                hatch=UNKNOWN_HATCH,
                linewidth=0,
                label=UNKNOWN_WORDS,
            )
        )
    if has_built:
        handles.append(Patch(facecolor=BUILDING_COLOUR, label="building"))
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
