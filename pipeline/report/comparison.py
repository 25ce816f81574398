"""Figures and a table that compare the runs of a place: those of the paper, from stores alone."""

from __future__ import annotations

import logging
from collections.abc import Iterator
from pathlib import Path

import numpy as np
import pandas as pd
import xarray as xr
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from pipeline.assess.frames import bed, follow, mean_spacing, on_surface
from pipeline.assess.gridding import gridded
from pipeline.assess.plots import depth_panels, name_of, title_of
from pipeline.assess.relief import draw_relief
from pipeline.store.place import store_paths
from pipeline.store.run_table import markdown
from pipeline.store.storage import Location
from pipeline.store.variables import Status
from pipeline.store.zarr_store import open_store

_log = logging.getLogger(__name__)

PANELS = 8
# round-off of a sum over single-precision frames
LEAST_ERROR = 1e-8
COLUMNS = ("deepest", "volume_error", "body_speed", "film_speed")
EXTENT = ("front_x", "tail_x", "half_width")
EXTENT_ON_SURFACE = ("lowest_elevation", "body_area")


def draw(out: Location, to: Path) -> list[Path]:
    """Draw the bed, points, depth contours and volume errors of all stores of a place, and table their runs.

    The bed is that of the first store: a profile, or on an elevation model a map with the release.

    Parameters
    ----------
    out : Location
        The place.
    to : Path
        Folder for the pictures (PNG) and the table (CSV and Markdown); made where it is missing.

    Returns
    -------
    list of Path
        What was written.

    Raises
    ------
    FileNotFoundError
        If there is no store with frames of depth and velocity in the place.
    OSError
        If something cannot be written.
    """
    stores = {path.stem: open_store(path) for path in store_paths(out)}
    stores = {name: s for name, s in stores.items() if {"depth", "velocity_x", "velocity_y"} <= set(s)}
    if not stores:
        raise FileNotFoundError(f"{out} holds no store with frames of depth and velocity")
    to.mkdir(parents=True, exist_ok=True)
    first = next(iter(stores.values()))
    on_profiles = {name: store for name, store in stores.items() if not on_surface(store)}
    written = [_map(first, to / "terrain.png") if on_surface(first) else _profile(first, to / "profile.png")]
    if on_profiles:
        written.append(_points(on_profiles, to / "points.png"))
    courses: list[tuple[str, xr.Dataset]] = []
    rows: list[dict[str, object]] = []
    for name, store in stores.items():
        for run in range(store.sizes["run"]):
            one = store.isel(run=slice(run, run + 1))
            state = Status(int(one["status"][0]))
            if state is Status.PENDING:
                continue
            _log.info("%s: run %d of %d", name, run + 1, store.sizes["run"])
            courses.append((title_of(store, run), follow(one).isel(run=0).load()))
            rows.append(_row(name_of(store, run), state, courses[-1][1]))
            if (courses[-1][1].time.where(courses[-1][1]["volume"].notnull()) > 0).any():
                written.append(to / f"depth-{name}-{run}.png")
                depth_panels(store, run, written[-1], PANELS)
    if not courses:
        raise FileNotFoundError(f"{out} holds no run that was computed")
    written.append(_volume_errors(courses, to / "volume-error.png"))
    table = pd.DataFrame(rows)
    for path, text in (
        (to / "comparison.csv", table.to_csv(index=False)),
        (to / "comparison.md", markdown(table)),
    ):
        path.write_text(text)
        written.append(path)
    for store in stores.values():
        store.close()
    return written


def _row(name: str, state: Status, course: xr.Dataset) -> dict[str, object]:
    """Give the last frame that was computed, in numbers; speeds are the largest of all frames."""
    known = course.dropna("time", how="all", subset=["volume"])
    last = known.isel(time=-1)
    row: dict[str, object] = {"run": name, "status": state.plain_words, "time": float(last["time"])}
    for quantity in (*(EXTENT if "front_x" in course else EXTENT_ON_SURFACE), *COLUMNS):
        row[quantity] = float(known[quantity].max() if quantity.endswith("speed") else last[quantity])
    return row


def _profile(store: xr.Dataset, path: Path) -> Path:
    """Draw the bed along y = 0 with the initial heap, at true scale."""
    one = store.isel(run=0, time=0)
    if "point" in store.dims:
        near = one.isel(point=np.flatnonzero(np.abs(one["y"]) < mean_spacing(store))).sortby("x")
    else:
        near = one.sel(y=0, method="nearest")
    distance, elevation = near["horizontal_distance"].to_numpy(), near["elevation"].to_numpy()
    depth = near["depth"].to_numpy()
    slope = np.gradient(elevation, distance)
    normal = np.stack([-slope, np.ones_like(slope)]) / np.hypot(slope, 1)
    figure = Figure(figsize=(9, 4.5), layout="compressed", dpi=150)
    axes: Axes = figure.subplots()
    axes.plot(distance, elevation, "k", linewidth=1)
    heap = depth > 0
    surface = np.stack([distance, elevation]) + normal * depth
    axes.fill(
        np.append(distance[heap], surface[0][heap][::-1]),
        np.append(elevation[heap], surface[1][heap][::-1]),
        color="tab:brown",
        alpha=0.6,
        label="release",
    )
    axes.set_aspect("equal")
    axes.set_xlabel("horizontal distance (m)")
    axes.set_ylabel("elevation (m)")
    axes.legend(frameon=False)
    figure.savefig(path)
    return path


def _map(store: xr.Dataset, path: Path) -> Path:
    """Draw the ground with the release of the first run."""
    if "point" in store.dims:
        store = gridded(store[["depth", "elevation"]].isel(run=[0], time=[0]), mean_spacing(store))
    depth = store["depth"].isel(run=0, time=0).to_numpy()
    x, y = store["x"].to_numpy(), store["y"].to_numpy()
    figure = Figure(figsize=(9, 9 * (y[-1] - y[0]) / (x[-1] - x[0]) + 0.6), layout="compressed", dpi=150)
    axes: Axes = figure.subplots()
    draw_relief(axes, x, y, bed(store, 0))
    if depth.max() > 0:
        axes.contourf(x, y, depth, levels=[1e-3 * depth.max(), depth.max()], colors="tab:brown", alpha=0.6)
    axes.set_aspect("equal")
    axes.ticklabel_format(useOffset=False, style="plain")
    axes.set_xlabel("easting (m)")
    axes.set_ylabel("northing (m)")
    figure.savefig(path)
    return path


def _points(stores: dict[str, xr.Dataset], path: Path) -> Path:
    """Draw each distribution of points once, with the outline of the release."""
    distributions: dict[tuple[int, ...], xr.Dataset] = {}
    for store in stores.values():
        distributions.setdefault(store["depth"].shape[2:], store)
    figure = Figure(figsize=(10, 5.2 * len(distributions)), layout="compressed", dpi=150)
    panels = np.atleast_1d(figure.subplots(len(distributions), 1))
    for axes, store in zip(panels, distributions.values(), strict=True):
        places = xr.broadcast(store["x"], store["y"], store["depth"].isel(run=0, time=0, drop=True))
        x, y, depth = (a.to_numpy().ravel() for a in places)
        released = depth > 0
        axes.plot(x, y, "k.", markersize=0.6)
        axes.plot(x[released], y[released], ".", color="tab:brown", markersize=1.6)
        axes.set_aspect("equal")
        axes.set_title(f"{len(x):,} points", fontsize="medium", loc="left")
        axes.set_xlabel("along the bed (m)")
        axes.set_ylabel("across the bed (m)")
    figure.savefig(path)
    return path


def _volume_errors(courses: list[tuple[str, xr.Dataset]], path: Path) -> Path:
    """Draw the relative error of volume over time (eq. 27)."""
    figure = Figure(figsize=(9, 5.5), layout="compressed", dpi=150)
    axes: Axes = figure.subplots()
    for (title, course), style in zip(courses, _styles(), strict=False):
        error = np.maximum(np.abs(course["volume_error"]), LEAST_ERROR)
        axes.semilogy(course["time"], error, style, linewidth=1.2, markersize=3, label=title)
    axes.set_xlabel("time (s)")
    axes.set_ylabel("relative error of volume")
    axes.grid(alpha=0.3)
    axes.legend(frameon=False, fontsize="x-small", loc="upper left", bbox_to_anchor=(1, 1))
    figure.savefig(path)
    return path


def _styles() -> Iterator[str]:
    for dash in ("-", "--", "-.", ":"):
        for mark in ("o", "s", "^", "v", "x", "+"):
            yield mark + dash
