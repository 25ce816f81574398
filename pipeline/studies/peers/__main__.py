"""Runs on elevation models beside those of another code: ``python -m pipeline.studies.peers FOLDER``.

The folder holds elevation models ``<site>.tif``, releases ``<site>-release.gpkg`` and results
``<code>-<site>_<law>.npz`` of the other code, with the arrays ``pft`` (peak thickness, m, rows from south to
north) and ``release``, the corner ``x0``, ``y0`` and the side ``cell`` of its cells, m, and a ``summary`` in
JSON with its processor time ``loop_cpu``, s, and ``end``, s. A name that goes on after the law is a variant.
"""

from __future__ import annotations

import re
import tempfile
from pathlib import Path
from typing import Annotated, Any

import numpy as np
import pandas as pd
import typer
import xarray as xr
from numpy.typing import NDArray

import pipeline
from pipeline.store.run_table import markdown
from pipeline.studies.peers.maps import picture
from pipeline.studies.peers.sites import (
    PARABOLA,
    REACHED,
    Peer,
    on_cells,
    overlap,
    peers,
    scenario,
    write_parabola,
)

Array = NDArray[np.float64]
LENGTHS: tuple[float | str, ...] = (0.0, 5.0, 10.0, 20.0, 40.0, "none")
SPACINGS = (10.0, 5.0, 2.5)
# of these the tables of curvature and spacing are
STUDIED = ("kot", "gar")


def done(content: dict[str, Any], place: Path) -> tuple[pd.Series, xr.Dataset]:
    """Run a scenario in this process; give its row of the table and its store."""
    results = pipeline.run(content, place / content["name"], workers=1, quiet=True, warn=lambda line: None)
    return results.table.iloc[0], results[content["name"]].isel(run=0).load()


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
        at = folder
        if peer.site == PARABOLA:
            at = write_parabola(folder, place / PARABOLA)
        if peer.variant or not (at / f"{peer.site}.tif").exists():
            continue
        row, store = done(scenario(at, peer.site, peer.law, None, 0.0), place)
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


def with_table(text: str, name: str, table: pd.DataFrame) -> str:
    """Put a table into a page, between ``<!-- peers: name -->`` and ``<!-- end -->``.

    Raises
    ------
    ValueError
        If the page has no such place.
    """
    place = re.compile(rf"(<!-- peers: {name} -->\n).*?(<!-- end -->)", re.DOTALL)
    if not place.search(text):
        raise ValueError(f"the page has no place for the table {name}")
    return place.sub(lambda found: f"{found[1]}{markdown(table).rstrip()}\n{found[2]}", text)


def study(
    folder: Annotated[Path, typer.Argument(help="Elevation models, releases and results of another code.")],
    to: Annotated[Path, typer.Option(help="Folder for the pictures.")] = Path("docs/comparison"),
    page: Annotated[Path | None, typer.Option(help="Page whose tables are replaced.")] = None,
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
            typer.echo(f"{name}\n{table.to_string()}")
            if page is not None:
                page.write_text(with_table(page.read_text(encoding="utf-8"), name, table), encoding="utf-8")


if __name__ == "__main__":
    typer.run(study)
