"""Sites with results of another code in a folder, and the scenarios that are compared with them."""

from __future__ import annotations

import json
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from pipeline.inputs import elevation_raster

Array = NDArray[np.float64]
# peak thickness above which a cell counts as reached, m
REACHED = 0.1
LAWS: dict[str, dict[str, float]] = {
    "coulomb24": {"bed_friction": 24.0},
    "voellmy": {"friction_coefficient": 0.25, "turbulent_friction": 1500.0},
}
# latest end of runs whose films creep, s
END = 400.0
# of files that have none
CRS = "EPSG:31287"
# a parabola that falls from a height along a length to a plane, m, in cells of a side, from an easting on
PARABOLA = "parabolaup"
HEIGHT, LENGTH, SIDE, START = 1000.0, 2250.0, 5.0, 1000.0


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
    try:
        model = elevation_raster.extent(file)
    except elevation_raster.ElevationRasterError:
        model = elevation_raster.extent(file, CRS)
    return {
        "name": f"{site}-{law}-{spacing or 0:g}-{curvature}",
        "terrain": {"elevation": str(file), "curvature_length": curvature, "crs": CRS},
        "points": {"spacing": model.spacing if spacing is None else spacing},
        "release": {"polygons": str(folder / f"{site}-release.gpkg"), "depth": 1.0},
        "material": {**LAWS[law], "earth_pressure": "isotropic"},
        "output": {"threshold": REACHED, "fields": ["max_depth", "max_speed", "deposit_depth"]},
        "time": {"end": END},
    }


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


def write_parabola(folder: Path, to: Path) -> Path:
    """Write the parabola of a folder with results on it, and the release that these name; give where.

    Its slope falls linearly from ``2 HEIGHT / LENGTH`` at `START` to 0 after `LENGTH`.
    """
    import pyogrio.raw
    import rasterio
    import shapely
    from rasterio.transform import from_origin

    to.mkdir(parents=True, exist_ok=True)
    (path,) = folder.glob(f"*-{PARABOLA}_coulomb24.npz")
    with np.load(path, allow_pickle=False) as held:
        release = shapely.from_geojson(str(held["polygon"]))
    _, south, _, north = release.bounds
    low, high = (SIDE * np.floor((bound + by) / SIDE) for bound, by in ((south, -600.0), (north, 600.0)))
    x = SIDE * np.arange(round(5000 / SIDE) + 1)
    fall = HEIGHT * (np.minimum(x / LENGTH, 1.0) - 1.0) ** 2
    z = np.repeat(fall[None], round((high - low) / SIDE) + 1, axis=0)
    with rasterio.open(
        to / f"{PARABOLA}.tif", "w", driver="GTiff", count=1, height=len(z), width=len(x), dtype="float64",
        crs=CRS, transform=from_origin(START - SIDE / 2, high + SIDE / 2, SIDE, SIDE),
    ) as target:  # fmt: skip
        target.write(z, 1)
    pyogrio.raw.write(
        to / f"{PARABOLA}-release.gpkg", np.array([shapely.to_wkb(release)], dtype=object),
        [np.array(["release"], dtype=object)], ["name"], crs=CRS, geometry_type="Polygon",
    )  # fmt: skip
    return to
