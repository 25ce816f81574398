"""A small elevation model with polygons on it, as files of a scenario."""

import numpy as np
import pyogrio
import rasterio
import shapely
from rasterio.transform import from_origin

WEST, NORTH, SIDE = 2_600_000.0, 1_200_400.0, 5.0
ROWS, COLUMNS = 40, 60
DOMAIN = f"domain: {{x: [{WEST + 2.5}, {WEST + 297.5}], y: [{NORTH - 197.5}, {NORTH - 2.5}]}}"
TEXT = f"""\
name: small
terrain: {{elevation: dem.tif, curvature_length: 20}}
{DOMAIN}
points: {{spacing: 5}}
release: {{polygons: releases.gpkg, name: slide}}
material: {{bed_friction: 16, earth_pressure: isotropic}}
output: {{threshold: 0.05}}
time: {{end: 60}}
"""


def ground(rows=ROWS, columns=COLUMNS):
    """Elevations of a valley that falls to the east and flattens, rows from north to south, m."""
    x, y = SIDE * (np.arange(columns) + 0.5), SIDE * (np.arange(rows) + 0.5)
    return 1200 - 0.6 * 120 * (1 - np.exp(-x / 120)) + 0.002 * (y[:, None] - SIDE * rows / 2) ** 2


def write_raster(path, elevation, side=SIDE, crs="EPSG:2056"):
    with rasterio.open(
        path, "w", driver="GTiff", count=1, height=elevation.shape[0], width=elevation.shape[1],
        dtype="float64", nodata=-9999.0, crs=crs, transform=from_origin(WEST, NORTH, side, side),
    ) as target:  # fmt: skip
        target.write(elevation, 1)


def write_polygons(path, boxes, crs="EPSG:2056", depth=1.5):
    """Write boxes by name: west, south, east, north, from the north-west corner of the raster, m."""
    shapes = [shapely.box(WEST + w, NORTH + s, WEST + e, NORTH + n) for w, s, e, n in boxes.values()]
    fields = [np.array(list(boxes), dtype=object), np.full(len(boxes), depth)]
    pyogrio.raw.write(
        path, np.array(shapely.to_wkb(shapes), dtype=object), fields, ["name", "depth"], crs=crs,
        geometry_type="Polygon",
    )  # fmt: skip


def written(folder, text=TEXT, *changes):
    for old, new in changes:
        assert old in text
        text = text.replace(old, new)
    path = folder / "small.yaml"
    path.write_text(text)
    return path
