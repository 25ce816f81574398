"""What the size of an elevation model costs: ``python -m pipeline.studies.large_terrain``.

The same small slide on a large elevation model and on a part of it that is cut out around the slide.
"""

from __future__ import annotations

import os
import shutil
import subprocess
import sys
import tempfile
from pathlib import Path
from typing import Annotated

import numpy as np
import typer

from pipeline.studies.torrent_terrain import CRS, WEST

NORTH, SIDE = 1_220_000.0, 5.0
# cells of the part along a side
PART = 400
SCENARIO = """\
name: slide
terrain: {elevation: terrain.tif, curvature_length: 20}
points: {spacing: 5}
release: {polygons: releases.gpkg, depth: 1}
material: {bed_friction: 20, earth_pressure: isotropic}
output: {threshold: 0.05, fields: [max_depth, max_speed, deposit_depth]}
"""


def write(folder: Path, cells: int, part: int | None = None) -> None:
    """Write a scenario on a cone with dents, cells by cells large, or on a part of it with so many cells."""
    import pyogrio.raw
    import rasterio
    import shapely
    from rasterio.transform import from_origin

    folder.mkdir(parents=True)
    kept = slice(None) if part is None else slice(cells // 2, cells // 2 + part)
    first = 0 if part is None else cells // 2
    place = SIDE * (np.arange(cells)[kept] + 0.5)
    x, y, middle = place[None], place[:, None], SIDE * cells / 2
    z = 4500 - 0.2 * np.hypot(x - middle, y - middle) + 15 * np.sin(x / 300) * np.cos(y / 410)
    # below the slide the cone ends on a plane
    z = np.maximum(z, 4500 - 0.2 * 900.0)
    with rasterio.open(
        folder / "terrain.tif", "w", driver="GTiff", count=1, height=len(place), width=len(place),
        dtype="float32", crs=CRS, tiled=True, compress="deflate",
        transform=from_origin(WEST + SIDE * first, NORTH - SIDE * first, SIDE, SIDE),
    ) as target:  # fmt: skip
        target.write(z.astype(np.float32), 1)
    east, south = WEST + middle + 250, NORTH - middle - 350
    box = shapely.box(east, south, east + 80, south + 60)
    pyogrio.raw.write(
        folder / "releases.gpkg", np.array([shapely.to_wkb(box)], dtype=object),
        [np.array(["slide"], dtype=object)], ["name"], crs=CRS, geometry_type="Polygon",
    )  # fmt: skip
    (folder / "slide.yaml").write_text(SCENARIO)


def measured(folder: Path) -> tuple[float, float]:
    """Run a scenario by the command in a process of its own; give CPU seconds and peak memory, MB."""
    command = [sys.executable, "-m", "pipeline", "run", "slide.yaml", "--overwrite", "--quiet"]
    process = subprocess.Popen([*command, "--workers", "1"], cwd=folder)
    _, status, used = os.wait4(process.pid, 0)
    process.returncode = os.waitstatus_to_exitcode(status)
    if process.returncode:
        raise RuntimeError(f"the run in {folder} ended with exit code {process.returncode}")
    shutil.rmtree(folder / "results")
    return used.ru_utime + used.ru_stime, used.ru_maxrss / 1e3


def study(
    cells: Annotated[int, typer.Option(min=400, help="Cells of the large model along a side.")] = 4000,
    repeats: Annotated[int, typer.Option(min=1, help="Runs of each, one after the other.")] = 3,
) -> None:
    """Print CPU time and peak memory of ``pipeline run``, by size of the elevation model."""
    found: dict[str, list[tuple[float, float]]] = {}
    with tempfile.TemporaryDirectory() as held:
        folders = {f"{cells:,} by {cells:,}": Path(held, "whole"), f"{PART} by {PART}": Path(held, "part")}
        for folder, part in zip(folders.values(), (None, PART), strict=True):
            write(folder, cells, part)
        # the first may compile the solver
        measured(Path(held, "part"))
        for _ in range(repeats):
            for size, folder in folders.items():
                found.setdefault(size, []).append(measured(folder))
    typer.echo("| elevation model | CPU, s | peak memory, MB |\n|---|---|---|")
    for size, rows in found.items():
        spent, memory = np.median(rows, axis=0)
        typer.echo(f"| {size} | {spent:.2f} | {memory:.0f} |")


if __name__ == "__main__":
    typer.run(study)
