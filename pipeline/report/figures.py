"""Pictures of the report that are no maps: the run-out curve, and a run in motion."""

from __future__ import annotations

from collections.abc import Sequence
from io import BytesIO
from typing import Any

import numpy as np
import xarray as xr
from matplotlib import colormaps
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.colors import BoundaryNorm, ListedColormap
from matplotlib.figure import Figure
from matplotlib.patches import Patch
from matplotlib.ticker import MaxNLocator
from PIL import Image

from pipeline.assess.ensemble import computed, counts, events_per_year
from pipeline.assess.frames import mean_spacing
from pipeline.assess.georeference import Frame
from pipeline.assess.gridding import gridded
from pipeline.assess.plots import COLOURS, title_of
from pipeline.assess.relief import draw_relief
from pipeline.assess.tables import values
from pipeline.gis.map_names import keep_apart
from pipeline.gis.symbology import of_values
from pipeline.hazard.map_panel import mark_places, scale_bar
from pipeline.report.palette import with_palette

CURVE_POINTS = 400
# runs that are drawn one by one; and the part of the largest discharge after which nothing flows any more
FEW_RUNS, FLOWS = 12, 1e-2
FRAMES = 40
GIF_COLOURS = 128
# above every depth
HIGHEST = 1e30
WIDTH = 8.0
SHOWN_MILLISECONDS, LAST_MILLISECONDS = 150, 1500


def runout_curve(store: xr.Dataset) -> bytes | None:
    """Draw the share of runs that run out farther than a distance, with its bounds, as PNG.

    Parameters
    ----------
    store : Dataset
        A scenario's store.

    Returns
    -------
    bytes or None
        None where no run has a run-out.
    """
    reach = values(store, "runout_distance")
    finite = reach.value[np.isfinite(reach.value)]
    if not finite.size:
        return None
    low, high = float(finite.min()), float(finite.max())
    margin = 0.05 * (high - low) or 0.05 * abs(high) or 1.0
    distance = np.linspace(low - margin, high + margin, CURVE_POINTS)
    shares = reach.exceedance(distance)
    figure = Figure(figsize=(WIDTH, 4), layout="compressed", dpi=150)
    axes = figure.subplots()
    if not np.allclose(shares.lower, shares.upper):
        axes.fill_between(
            distance,
            shares.lower,
            shares.upper,
            color=colormaps[COLOURS](0.35),
            linewidth=0,
            label="bounds for runs that are failed, pending, overrun or cut off",
        )
    axes.plot(distance, shares.estimate, color=colormaps[COLOURS](0.9), linewidth=1.6, label="computed runs")
    axes.set_xlabel("run-out: horizontal distance from the crown of the release to the deposit's toe (m)")
    counted = "runs" if events_per_year(store) is None else "events"
    axes.set_ylabel(f"share of {counted} that go farther")
    axes.set_xlim(distance[0], distance[-1])
    axes.set_ylim(0, 1.02)
    axes.grid(alpha=0.3)
    axes.legend(frameon=False, loc="upper right")
    axes.set_title(f"{store.attrs['title']}\n{counts(store)}", fontsize="medium", loc="left")
    held = BytesIO()
    figure.savefig(held, format="png", bbox_inches="tight")
    return held.getvalue()


def hydrographs(store: xr.Dataset) -> bytes | None:
    """Draw the discharge of every run at each section over time, as PNG; None where there is none.

    Many runs are drawn as the median and the ranges that hold half and nine tenths of them.

    Parameters
    ----------
    store : Dataset
        A scenario's store.
    """
    if "section_discharge" not in store:
        return None
    found = store["section_discharge"].isel(run=np.flatnonzero(computed(store)))
    if not found.size or not np.nanmax(found.to_numpy()) > 0:
        return None
    names, time = found["section"].to_numpy(), found["section_time"].to_numpy()
    moving = (np.abs(found.to_numpy()) > FLOWS * np.nanmax(found.to_numpy())).any(axis=(0, 1))
    last = min(int(np.flatnonzero(moving)[-1]) + 2, len(time))
    figure = Figure(figsize=(WIDTH, 1.0 + 2.2 * len(names)), layout="compressed", dpi=150)
    panels = figure.subplots(len(names), sharex=True, squeeze=False)[:, 0]
    for axes, name in zip(panels, names, strict=True):
        lines = found.sel(section=name).to_numpy()[:, :last]
        if len(lines) <= FEW_RUNS:
            for line in lines:
                axes.plot(time[:last], line, color=colormaps[COLOURS](0.8), linewidth=1.2)
        else:
            low, lower, middle, upper, high = np.quantile(lines, (0.05, 0.25, 0.5, 0.75, 0.95), axis=0)
            axes.fill_between(
                time[:last],
                low,
                high,
                color=colormaps[COLOURS](0.25),
                linewidth=0,
                label="nine tenths of the runs",
            )
            axes.fill_between(
                time[:last], lower, upper, color=colormaps[COLOURS](0.5), linewidth=0, label="half of them"
            )
            axes.plot(time[:last], middle, color=colormaps[COLOURS](0.95), linewidth=1.4, label="median")
            axes.legend(frameon=False, loc="upper right", fontsize="small")
        axes.set_title(str(name), fontsize="medium", loc="left")
        axes.set_ylabel("discharge (m³/s)")
        axes.set_xlim(0, time[last - 1])
        axes.grid(alpha=0.3)
    panels[-1].set_xlabel("time (s)")
    figure.suptitle(str(counts(store)), fontsize="medium", horizontalalignment="left", x=0.01)
    held = BytesIO()
    figure.savefig(held, format="png", bbox_inches="tight")
    return held.getvalue()


def animation(
    store: xr.Dataset, run: int, frame: Frame | None, marks: xr.Dataset | None = None
) -> bytes | None:
    """Draw the depth of a run at its output times, as WebP; None where its frames were not kept.

    Parameters are those of `film`.
    """
    pictures = film(store, run, frame, marks)
    return None if pictures is None else encoded(pictures, "webp")


def encoded(pictures: Sequence[Image.Image], kind: str) -> bytes:
    """Give a film as GIF or WebP, which is shown again and again."""
    held = BytesIO()
    times = [SHOWN_MILLISECONDS] * (len(pictures) - 1) + [LAST_MILLISECONDS]
    if kind == "gif":
        # one for all, and no dots: a third of the bytes
        pictures = with_palette(pictures, GIF_COLOURS)
    more: dict[str, Any] = {"append_images": pictures[1:], "duration": times, "loop": 0}
    more |= {"lossless": True, "method": 1} if kind == "webp" else {"disposal": 1}
    pictures[0].save(held, kind.upper(), save_all=True, **more)
    return held.getvalue()


def film(
    store: xr.Dataset, run: int, frame: Frame | None, marks: xr.Dataset | None = None
) -> list[Image.Image] | None:
    """Draw the depth of a run at its output times; None where its frames were not kept.

    Parameters
    ----------
    store : Dataset
        A scenario's store.
    run : int
        Position of the run.
    frame : Frame, optional
        Of the lattice the store is on, or of that a cloud is brought to.
    marks : Dataset, optional
        Hazard maps, for the receptors and releases that are marked.
    """
    if "depth" not in store:
        return None
    on_map = frame is not None and frame.is_map
    frames = store[["depth", *(["elevation"] if on_map else [])]].isel(run=run)
    if "point" in frames.dims:
        frames = gridded(frames.load(), mean_spacing(frames))
    depth = frames["depth"].dropna("time", how="all").load()
    if depth.sizes["time"] < 2:
        return None
    depth = depth.isel(time=np.unique(np.linspace(0, depth.sizes["time"] - 1, FRAMES).astype(int)))
    x, y = np.meshgrid(depth["x"].to_numpy(), depth["y"].to_numpy())
    east, north = frame.on_map(x, y) if frame else (x, y)
    style = of_values("depth", "m", float(depth.max()))
    edges = [*style.edges[:-1], min(style.edges[-1], HIGHEST)]
    colours = ListedColormap([each.colour for each in style.entries])
    shape = float(np.ptp(north) / np.ptp(east))
    height = float(np.clip((WIDTH - 1.8) * shape, 1.2, 8))
    figure = Figure(figsize=(WIDTH, height + 1.1), layout="compressed", dpi=100)
    canvas = FigureCanvasAgg(figure)
    axes = figure.subplots()
    axes.set_aspect("equal")
    axes.ticklabel_format(useOffset=False, style="plain")
    axes.xaxis.set_major_locator(MaxNLocator(4))
    axes.yaxis.set_major_locator(MaxNLocator(5))
    axes.set_xlabel("easting (m)" if frame else "along the bed (m)")
    axes.set_ylabel("northing (m)" if frame else "across the bed (m)")
    films = np.ma.masked_less_equal(depth.to_numpy(), edges[0])
    norm = BoundaryNorm(edges, colours.N)
    mesh = axes.pcolormesh(east, north, films[0], cmap=colours, norm=norm, shading="nearest")
    axes.legend(
        handles=[Patch(facecolor=each.colour, label=each.label) for each in reversed(style.entries)],
        title=style.caption,
        loc="upper left",
        bbox_to_anchor=(1.01, 1),
        frameon=False,
        borderaxespad=0,
        fontsize="x-small",
        title_fontsize="x-small",
    )
    if on_map:
        draw_relief(axes, east[0], north[:, 0], frames["elevation"].to_numpy())
    if frame:
        corners = np.stack(frame.corners)
        axes.plot(*np.concatenate([corners, corners[:, :1]], axis=1), color="0.3", linewidth=0.6)
    names = [] if marks is None else mark_places(axes, frame, marks)
    # receptors may lie far beyond what is shown
    margin = 0.03 * float(max(np.ptp(east), np.ptp(north)))
    axes.set_xlim(float(east.min()) - margin, float(east.max()) + margin)
    axes.set_ylim(float(north.min()) - margin, float(north.max()) + margin)
    scale_bar(axes, frame, float(np.ptp(east)))
    title = axes.set_title("", fontsize="medium", loc="left")
    pictures = []
    # all but these two is drawn once
    moving = (mesh, title)
    title.set_text(f"{title_of(store, run)}\nt = 0 s")
    canvas.draw()  # type: ignore[no-untyped-call]
    figure.set_layout_engine("none")
    keep_apart(canvas.get_renderer(), axes, names)  # type: ignore[no-untyped-call]
    for artist in moving:
        artist.set_animated(True)
    canvas.draw()  # type: ignore[no-untyped-call]
    still = canvas.copy_from_bbox(figure.bbox)  # type: ignore[no-untyped-call]
    for film, time in zip(films, depth["time"].to_numpy(), strict=True):
        mesh.set_array(film)
        title.set_text(f"{title_of(store, run)}\nt = {time:g} s")
        canvas.restore_region(still)  # type: ignore[no-untyped-call]
        for artist in moving:
            axes.draw_artist(artist)
        drawn = np.asarray(canvas.buffer_rgba())  # type: ignore[no-untyped-call]
        pictures.append(Image.fromarray(drawn[..., :3].copy()))
    return pictures
