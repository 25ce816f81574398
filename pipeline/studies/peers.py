"""Runs on elevation models beside those of another code: ``python -m pipeline.studies.peers FOLDER``.

The folder holds elevation models ``<site>.tif``, releases ``<site>-release.gpkg`` and results
``<code>-<site>_<law>.npz`` of the other code, with the arrays ``pft`` (peak thickness, m, rows from south to
north) and ``release``, the corner ``x0``, ``y0`` and the side ``cell`` of its cells, m, and a ``summary`` in
JSON with its processor time ``loop_cpu``, s, and ``end``, s. A name that goes on after the law is a variant.
"""

from __future__ import annotations

import json
import tempfile
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Annotated, Any

import numpy as np
import pandas as pd
import typer
import xarray as xr
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from numpy.typing import NDArray

import pipeline
from pipeline.assess.relief import draw_relief
from pipeline.inputs import elevation_raster
from pipeline.store.run_table import markdown

Array = NDArray[np.float64]
# peak thickness above which a cell counts as reached, m
REACHED = 0.1
LAWS: dict[str, dict[str, float]] = {
    "coulomb24": {"bed_friction": 24.0},
    "voellmy": {"friction_coefficient": 0.25, "turbulent_friction": 1500.0},
}
# latest end of runs whose films creep, s
END = 400.0
LENGTHS: tuple[float | str, ...] = (0.0, 5.0, 10.0, 20.0, 40.0, "none")
SPACINGS = (10.0, 5.0, 2.5)
# of these the tables of curvature and spacing are
STUDIED = ("kot", "gar")


@dataclass(frozen=True)
class Peer:
    """Results of another code: its name, site, law and variant, and peak thickness (m) at places (m)."""

    code: str
    site: str
    law: str
    variant: str
    x: Array
    y: Array
    peak: Array
    summary: dict[str, Any]


def peers(folder: Path) -> Iterator[Peer]:
    """Read the results of other codes in a folder."""
    for path in sorted(folder.glob("*-*_*.npz")):
        code, _, rest = path.stem.partition("-")
        site, _, rest = rest.partition("_")
        law, _, variant = rest.partition("_")
        if law not in LAWS:
            continue
        with np.load(path, allow_pickle=False) as held:
            ny, nx = held["pft"].shape
            cell = float(held["cell"])
            yield Peer(
                code, site, law, variant,
                float(held["x0"]) + cell * (np.arange(nx) + 0.5),
                float(held["y0"]) + cell * (np.arange(ny) + 0.5),
                held["pft"].astype(np.float64), json.loads(str(held["summary"])),
            )  # fmt: skip


def scenario(
    folder: Path, site: str, law: str, spacing: float | None, curvature: float | str
) -> dict[str, Any]:
    """Give the scenario of a site: one metre normal to the bed, isotropic, to rest or to `END`.

    spacing : m; that of the elevation model where there is none.
    """
    file = folder / f"{site}.tif"
    crs = "EPSG:31287"
    try:
        model = elevation_raster.extent(file)
    except elevation_raster.ElevationRasterError:
        model = elevation_raster.extent(file, crs)
    return {
        "name": f"{site}-{law}-{spacing or 0:g}-{curvature}",
        "terrain": {"elevation": str(file), "curvature_length": curvature, "crs": crs},
        "points": {"spacing": model.spacing if spacing is None else spacing},
        "release": {"polygons": str(folder / f"{site}-release.gpkg"), "depth": 1.0},
        "material": {**LAWS[law], "earth_pressure": "isotropic"},
        "output": {"threshold": REACHED, "fields": ["max_depth", "max_speed", "deposit_depth"]},
        "time": {"end": END},
    }


def done(content: dict[str, Any], place: Path) -> tuple[pd.Series, xr.Dataset]:
    """Run a scenario in this process; give its row of the table and its store."""
    results = pipeline.run(content, place / content["name"], workers=1, quiet=True, warn=lambda line: None)
    return results.table.iloc[0], results[content["name"]].isel(run=0).load()


def overlap(one: Array, other: Array) -> float:
    """Area that both reached over that which either did, of peak thickness on the same cells."""
    both, either = (one > REACHED) & (other > REACHED), (one > REACHED) | (other > REACHED)
    return float(both.sum() / either.sum())


def on_cells(peak: Array, x: Array, y: Array, to_x: Array, to_y: Array) -> Array:
    """Give a field on the cells of another lattice: that of the nearest cell, 0 beyond its own; (m, n)."""
    columns = np.rint((to_x - x[0]) / (x[1] - x[0])).astype(int)
    rows = np.rint((to_y - y[0]) / (y[1] - y[0])).astype(int)
    inside = ((rows >= 0) & (rows < len(y)))[:, None] & ((columns >= 0) & (columns < len(x)))
    found = peak[np.ix_(rows.clip(0, len(y) - 1), columns.clip(0, len(x) - 1))]
    return np.where(inside, found, 0.0)


def together(store: xr.Dataset, peer: Peer) -> tuple[Array, Array, Array, Array]:
    """Peak thickness of both on cells that hold both: x, y, ours and theirs."""
    x, y = store["x"].to_numpy(), store["y"].to_numpy()
    d = float(x[1] - x[0])
    ends = [(min(own[0], other[0]), max(own[-1], other[-1])) for own, other in ((x, peer.x), (y, peer.y))]
    to_x, to_y = (
        own[0] + d * np.arange(np.floor((low - own[0]) / d), np.ceil((high - own[0]) / d) + 1)
        for own, (low, high) in zip((x, y), ends, strict=True)
    )
    ours = on_cells(store["max_depth"].to_numpy().astype(np.float64), x, y, to_x, to_y)
    return to_x, to_y, ours, on_cells(peer.peak, peer.x, peer.y, to_x, to_y)


def lowest(store: xr.Dataset, peak: Array, x: Array, y: Array) -> float:
    """Lowest elevation of the store's ground where a peak thickness was above the limit, m."""
    mine_x, mine_y = store["x"].to_numpy(), store["y"].to_numpy()
    there = on_cells(peak, x, y, mine_x, mine_y) > REACHED
    return float(np.nanmin(np.where(there, store["elevation"].to_numpy(), np.nan)))


def compared(folder: Path, place: Path, pictures: Path | None) -> pd.DataFrame:
    """Table each case beside the other code, and draw both where a folder for pictures is given."""
    rows = []
    for peer in peers(folder):
        if peer.variant or not (folder / f"{peer.site}.tif").exists():
            continue
        row, store = done(scenario(folder, peer.site, peer.law, None, 0.0), place)
        x, y, ours, theirs = together(store, peer)
        rows.append(
            {
                "site": peer.site,
                "law": peer.law,
                "overlap": round(overlap(ours, theirs), 3),
                "area over theirs": round(float((ours > REACHED).sum() / (theirs > REACHED).sum()), 3),
                "peak, m": round(float(ours.max()), 2),
                "their peak, m": round(float(theirs.max()), 2),
                "lowest, m": round(float(row["lowest_elevation"]), 1),
                "their lowest, m": round(lowest(store, peer.peak, peer.x, peer.y), 1),
                "lifted": round(float(row["lifted_share"]), 3),
                "status": row["status"],
                "end, s": round(float(row["last_time"]), 1),
                "their end, s": peer.summary["end"],
                "CPU, s": round(float(row["cpu_time"]), 2),
                "their CPU, s": peer.summary["loop_cpu"],
                "CPU ratio": round(peer.summary["loop_cpu"] / float(row["cpu_time"]), 1),
            }
        )
        if pictures is not None:
            picture(store, peer, (x, y, ours, theirs), pictures / f"{peer.site}-{peer.law}.png")
    return pd.DataFrame(rows)


def picture(store: xr.Dataset, peer: Peer, fields: tuple[Array, Array, Array, Array], path: Path) -> None:
    """Draw peak thickness of both side by side, and where they differ."""
    x, y, ours, theirs = fields
    elevation = on_cells(
        np.nan_to_num(store["elevation"].to_numpy()), store["x"].to_numpy(), store["y"].to_numpy(), x, y
    )
    ground = np.where(elevation == 0, np.nan, elevation)
    wet = (ours > REACHED) | (theirs > REACHED)
    rows, columns = np.flatnonzero(wet.any(1)), np.flatnonzero(wet.any(0))
    view = (slice(max(rows[0] - 6, 0), rows[-1] + 7), slice(max(columns[0] - 6, 0), columns[-1] + 7))
    x, y, ours, theirs, ground = x[view[1]], y[view[0]], ours[view], theirs[view], ground[view]
    shape = len(y) / len(x)
    figure = Figure(figsize=(12, 4 * shape + 1), layout="compressed", dpi=110)
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
    classes = np.ma.masked_equal(mine + 2 * other, 0)
    panels[2].pcolormesh(x, y, classes, cmap=_three(), vmin=0.5, vmax=3.5, shading="nearest", alpha=0.8)
    for colour, name in (("tab:orange", "LMLS alone"), ("tab:blue", f"{peer.code} alone"), ("0.35", "both")):
        panels[2].plot([], [], "s", color=colour, label=name)
    panels[2].legend(fontsize="x-small", loc="best")
    figure.suptitle(f"{peer.site}, {peer.law}, peak thickness above {REACHED:g} m", fontsize="medium")
    path.parent.mkdir(parents=True, exist_ok=True)
    figure.savefig(path)


def _three() -> Any:
    from matplotlib.colors import ListedColormap

    return ListedColormap(["tab:orange", "tab:blue", "0.35"])


def _shade(panel: Axes, x: Array, y: Array, ground: Array, title: str) -> None:
    draw_relief(panel, x, y, ground, named=False)
    panel.set_aspect("equal")
    panel.set_title(title, fontsize="small", loc="left")
    panel.tick_params(labelbottom=False, labelleft=False)


def against_itself(folder: Path) -> pd.DataFrame:
    """Table how far variants of the other code differ from its own defaults."""
    held = {(each.code, each.site, each.law, each.variant): each for each in peers(folder)}
    rows = []
    for (code, site, law, variant), other in held.items():
        first = held.get((code, site, law, ""))
        if variant and first is not None:
            x = np.arange(min(first.x[0], other.x[0]), max(first.x[-1], other.x[-1]) + 1, 5.0)
            y = np.arange(min(first.y[0], other.y[0]), max(first.y[-1], other.y[-1]) + 1, 5.0)
            found = overlap(*(on_cells(each.peak, each.x, each.y, x, y) for each in (first, other)))
            rows.append({"site": site, "law": law, "variant": variant, "overlap": round(found, 3)})
    return pd.DataFrame(rows)


def curvature(folder: Path, place: Path) -> pd.DataFrame:
    """Table what the length over which curvature is averaged does."""
    rows = []
    for site in STUDIED:
        for length in LENGTHS:
            row, store = done(scenario(folder, site, "coulomb24", None, length), place)
            rows.append(
                {
                    "site": site,
                    "curvature_length, m": length,
                    "run-out, m": round(float(row["flow_runout_distance"])),
                    "lowest, m": round(float(row["lowest_elevation"]), 1),
                    "reach angle, degrees": round(float(row["reach_angle"]), 1),
                    "reached, ha": round(_area(store), 1),
                    "lifted": round(float(row["lifted_share"]), 3),
                    "status": row["status"],
                }
            )
    return pd.DataFrame(rows)


def _area(store: xr.Dataset) -> float:
    """Area in plan that was reached, ha."""
    return float((store["max_depth"] > REACHED).sum()) * float(np.diff(store["x"]).mean()) ** 2 / 1e4


def spacings(folder: Path, place: Path) -> pd.DataFrame:
    """Table footprint and run-out by spacing, with the curvature length of the default."""
    rows = []
    for site in STUDIED:
        found = {d: done(scenario(folder, site, "coulomb24", d, 20.0), place) for d in SPACINGS}
        finest = found[SPACINGS[-1]][1]
        x, y = finest["x"].to_numpy(), finest["y"].to_numpy()
        fine = finest["max_depth"].to_numpy().astype(np.float64)
        for d, (row, store) in found.items():
            at = store["x"].to_numpy(), store["y"].to_numpy()
            peak = on_cells(store["max_depth"].to_numpy().astype(np.float64), *at, x, y)
            rows.append(
                {
                    "site": site,
                    "spacing, m": d,
                    "overlap with the finest": round(overlap(peak, fine), 3),
                    "reached, ha": round(_area(store), 2),
                    "run-out, m": round(float(row["flow_runout_distance"])),
                    "lowest, m": round(float(row["lowest_elevation"]), 1),
                    "peak, m": round(float(row["peak_depth"]), 2),
                    "CPU, s": round(float(row["cpu_time"]), 2),
                    "status": row["status"],
                }
            )
    return pd.DataFrame(rows)


def study(
    folder: Annotated[Path, typer.Argument(help="Elevation models, releases and results of another code.")],
    to: Annotated[Path, typer.Option(help="Folder for tables and pictures.")] = Path("docs/comparison"),
    tables: Annotated[str, typer.Option(help="Which: peers, itself, curvature, spacings.")] = (
        "peers,itself,curvature,spacings"
    ),
) -> None:
    """Run the sites of a folder, and write tables and maps beside those of the other code."""
    with tempfile.TemporaryDirectory() as held:
        place = Path(held)
        ways = {
            "peers": lambda: compared(folder, place, to),
            "itself": lambda: against_itself(folder),
            "curvature": lambda: curvature(folder, place),
            "spacings": lambda: spacings(folder, place),
        }
        to.mkdir(parents=True, exist_ok=True)
        for name in tables.split(","):
            table = ways[name]()
            (to / f"{name}.md").write_text(markdown(table), encoding="utf-8")
            typer.echo(f"{name}\n{table.to_string()}")


if __name__ == "__main__":
    typer.run(study)
