"""The surface of the shipped torrent scenarios, with releases, houses, loose bed and a dam, made from a seed.

``python -m pipeline.studies.torrent_terrain scenarios/torrent`` writes them: a catchment that a gully drains,
a channel below it, and a fan with houses. No real place has this shape.
"""

from __future__ import annotations

import sys
from collections.abc import Sequence
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]

SEED = 20261
CRS = "EPSG:2056"
WEST, SOUTH = 2_600_000.0, 1_199_800.0
LENGTH, WIDTH, SPACING = 1600.0, 720.0, 4.0
APEX = 950.0
# name, what it is, corners from the south-west corner of the raster, m
HOUSES = (
    ("school", (1290, 408), (26, 18)),
    ("farm", (1180, 330), (22, 14)),
    ("mill", (1075, 395), (16, 12)),
    ("inn", (1385, 352), (18, 16)),
    ("chapel", (1460, 455), (10, 16)),
    ("barn", (1240, 240), (24, 12)),
)
RELEASES = (
    ("slide", 1.2, ((120, 395), (185, 428), (232, 420), (238, 382), (190, 360), (132, 366))),
    ("niche", 0.8, ((95, 300), (150, 318), (172, 296), (150, 268), (104, 272))),
)
# reaches of loose bed in the gully: name, depth, from and to, half of their breadth, m
REACHES = (("upper", 1.5, 260.0, 620.0, 7.0), ("lower", 0.8, 620.0, 880.0, 6.0))

# crest of a dam along the northern side of the channel below the apex, from the south-west corner, m
DAM = ((958, 404), (1130, 392))


def channel(x: Array) -> Array:
    """Northing of the channel's middle at eastings x from the south-west corner, m."""
    return np.asarray(
        370 + 26 * np.sin(x / 118) * np.exp(-(((x - 480) / 420) ** 2)) - 0.03 * (x - APEX).clip(0)
    )


def elevation(x: Array, y: Array, seed: int = SEED) -> Array:
    """Elevation at eastings x (n,) by northings y (m,) from the south-west corner, (m, n), m."""
    from scipy.ndimage import gaussian_filter

    along, across = x[None, :], y[:, None] - channel(x)[None, :]
    # steep in the catchment, gentle on the fan
    slope = np.radians(5.0 + 29.0 / (1 + np.exp((along - 640) / 150)))
    fall = np.cumsum(np.tan(slope) * SPACING, axis=1)
    catchment = 1 / (1 + np.exp((along - APEX + 120) / 60))
    hillside = 0.62 * (np.sqrt(across**2 + 24.0**2) - 24.0)
    fan = -(across**2) / 2600.0 / (1 + (along - APEX).clip(0) / 500)
    depth = 9.0 * catchment + 2.6 * (1 - catchment) * np.exp(-(along - APEX).clip(0) / 420)
    gully = -depth * np.exp(-((across / (9.0 + 4.0 * (1 - catchment))) ** 2))
    noise = np.random.default_rng(seed).normal(size=(len(y), len(x)))
    rough = sum(
        size * gaussian_filter(noise, width) * 2 * width * np.sqrt(np.pi)
        for size, width in ((0.10, 1.0), (0.35, 5.0), (1.2, 18.0))
    )
    return np.asarray(1960.0 - fall + catchment * hillside + (1 - catchment) * fan + gully + rough)


def write(folder: Path, seed: int = SEED) -> list[Path]:
    """Write the elevation model, and outlines of releases, buildings, loose bed and dam; give their paths."""
    import rasterio
    from rasterio.transform import from_origin

    x, y = np.arange(SPACING / 2, LENGTH, SPACING), np.arange(SPACING / 2, WIDTH, SPACING)
    folder.mkdir(parents=True, exist_ok=True)
    z = np.round(elevation(x, y, seed), 2).astype(np.float32)[::-1]
    names = ("terrain.tif", "releases.gpkg", "buildings.gpkg", "bed.gpkg", "dam.gpkg")
    paths = [folder / name for name in names]
    about = {"count": 1, "height": len(y), "width": len(x), "dtype": "float32", "nodata": -9999.0, "crs": CRS}
    place = from_origin(WEST, SOUTH + WIDTH, SPACING, SPACING)
    packed = {"compress": "deflate", "predictor": 3, "zlevel": 9}
    with rasterio.open(paths[0], "w", driver="GTiff", transform=place, **about, **packed) as target:
        target.write(z, 1)
    outlines = [np.array(corners, dtype=float) for _, _, corners in RELEASES]
    _shapes(paths[1], "releases", outlines, [name for name, _, _ in RELEASES], [d for _, d, _ in RELEASES])
    boxes = [
        np.array([(a, b), (a + w, b), (a + w, b + d), (a, b + d)], dtype=float)
        for _, (a, b), (w, d) in HOUSES
    ]
    _shapes(paths[2], "buildings", boxes, [name for name, _, _ in HOUSES])
    reaches = [_along(start, stop, half) for _, _, start, stop, half in REACHES]
    _shapes(paths[3], "bed", reaches, [name for name, *_ in REACHES], [depth for _, depth, *_ in REACHES])
    _shapes(paths[4], "dam", [np.array(DAM, dtype=float)], ["dam"], kind="LineString")
    return paths


def _along(start: float, stop: float, half: float) -> Array:
    """Outline of the channel's bed between two eastings, (n, 2), m; ``half`` of its breadth."""
    x = np.linspace(start, stop, 1 + round((stop - start) / 20))
    y = channel(x)
    return np.concatenate([np.stack([x, y - half], 1), np.stack([x, y + half], 1)[::-1]])


def _shapes(
    path: Path,
    layer: str,
    corners: Sequence[Array],
    names: Sequence[str],
    depths: Sequence[float] | None = None,
    kind: str = "Polygon",
) -> None:
    """Write polygons or lines with their names, and depths if there are."""
    import pyogrio
    import shapely

    shapes = shapely.to_wkb([getattr(shapely, kind)(each + np.array([WEST, SOUTH])) for each in corners])
    fields = [np.array(names, dtype=object)] + ([] if depths is None else [np.array(depths)])
    path.unlink(missing_ok=True)
    pyogrio.raw.write(
        path,
        np.array(shapes, dtype=object),
        fields,
        ["name", "depth"][: len(fields)],
        layer=layer,
        crs=CRS,
        geometry_type=kind,
    )


if __name__ == "__main__":
    for made in write(Path(sys.argv[1])):
        print(made)
