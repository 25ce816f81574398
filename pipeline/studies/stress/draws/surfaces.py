"""Scenes on elevation models, drawn: rough ground, and all that may stand, come in or be taken up on it."""

from __future__ import annotations

import json
import math
from collections.abc import Callable

import numpy as np
from numpy.typing import NDArray

from pipeline.studies.stress.draws.basics import DENSITY, Data, Generator, chosen, log_uniform, rounded
from pipeline.studies.stress.draws.beds import draw_erosion
from pipeline.studies.stress.draws.materials import draw_law
from solver.physics.constants import GRAVITY

Files = dict[str, str]
Array = NDArray[np.float64]
# Corner and reference system of every raster, m; cells along its sides, and their size, m.
WEST, SOUTH, SYSTEM = 2_600_000.0, 1_200_000.0, "EPSG:2056"
FEWEST, MOST, SIDES = 16, 70, (0.1, 30.0)
NO_DATA = -9999.0
# Share of lattices among the scenes.
LATTICES = 0.6
# Elevation of the lowest cell, m; nothing is higher than rasters are believed to be.
LOWEST, HIGHEST = 100.0, 8000.0


def draw_ground(rng: Generator, rows: int, columns: int, side: float) -> tuple[Array, str]:
    """Draw elevations (rows, columns) from south to north, m, NaN where there is no data; name the ground."""
    x, y = np.meshgrid(side * np.arange(columns), side * np.arange(rows))
    length, width = side * columns, side * rows
    turn = rng.uniform(0, 2 * np.pi)
    along = (x - length / 2) * np.cos(turn) + (y - width / 2) * np.sin(turn)
    across = (y - width / 2) * np.cos(turn) - (x - length / 2) * np.sin(turn)
    steep, reach = math.tan(math.radians(rng.uniform(0, 45))), max(length, width) / 2
    runout = math.tan(math.radians(rng.uniform(-10, 15)))
    z = -np.where(along < 0, steep, runout) * along if rng.random() < 0.6 else -steep * along
    if rng.random() < 0.5:
        # a gully, or a ridge
        z += rng.uniform(-0.5, 1.0) * across**2 / reach
    kind = chosen(rng, {"smooth": 0.15, "noise": 0.25, "steps": 0.2, "pits": 0.2, "ridges": 0.2})
    size = side * log_uniform(rng, 0.02, 3.0)
    if kind == "noise":
        z += 0.3 * size * rng.normal(size=z.shape)
    elif kind == "steps":
        z += size * np.floor(along / (side * rng.uniform(3, 15)))
    elif kind == "pits":
        for _ in range(int(rng.integers(1, 12))):
            east, north, radius = rng.uniform(0, length), rng.uniform(0, width), side * rng.uniform(1, 6)
            z -= 2 * size * np.exp(-((x - east) ** 2 + (y - north) ** 2) / radius**2)
    elif kind == "ridges":
        waves = rng.uniform(0, 2 * np.pi), side * rng.uniform(3, 20)
        z += size * np.sin((x * np.cos(waves[0]) + y * np.sin(waves[0])) * 2 * np.pi / waves[1])
    z = LOWEST + (z - z.min()) * min(1.0, (HIGHEST - LOWEST) / max(float(np.ptp(z)), 1e-9))
    if rng.random() < 0.3:
        kind += ", with gaps"
        for _ in range(int(rng.integers(1, 5))):
            row, column = int(rng.integers(rows)), int(rng.integers(columns))
            z[row : row + int(rng.integers(1, 4)), column : column + int(rng.integers(1, 4))] = np.nan
    return z, kind


def raster_text(elevation: Array, side: float) -> str:
    """Write elevations from south to north as an ASCII grid."""
    rows, columns = elevation.shape
    head = {"ncols": columns, "nrows": rows, "xllcorner": WEST, "yllcorner": SOUTH, "cellsize": side}
    lines = [f"{key} {value}" for key, value in (head | {"NODATA_value": NO_DATA}).items()]
    held = np.where(np.isnan(elevation), NO_DATA, np.round(elevation, 4))[::-1]
    return "\n".join([*lines, *(" ".join(map(repr, row)) for row in held.tolist()), ""])


def polygons_text(outlines: list[tuple[list[list[float]], float]]) -> str:
    """Write polygons, each with a depth, m, as GeoJSON in the system of the raster."""
    system = {"type": "name", "properties": {"name": f"urn:ogc:def:crs:{SYSTEM.replace(':', '::')}"}}
    features = [
        {
            "type": "Feature",
            "properties": {"name": f"release {k}", "depth": depth},
            "geometry": {"type": "Polygon", "coordinates": [[*corners, corners[0]]]},
        }
        for k, (corners, depth) in enumerate(outlines)
    ]
    return json.dumps({"type": "FeatureCollection", "crs": system, "features": features})


def ring(rng: Generator, east: float, north: float, radius: float) -> list[list[float]]:
    """Draw the corners of a polygon around a place, counter-clockwise, m."""
    count = int(rng.integers(4, 10))
    turns = (np.arange(count) + rng.uniform(0.1, 0.9, count)) * 2 * np.pi / count
    return [
        [round(float(east + radius * np.cos(t)), 3), round(float(north + radius * np.sin(t)), 3)]
        for t in turns
    ]


def draw_surface_scene(rng: Generator, name: str) -> tuple[Data, Files, dict[str, str]]:
    """Draw a scene on an elevation model: its scenario file, the files that it names, and its labels."""
    side = rounded(log_uniform(rng, *SIDES))
    rows, columns = (int(n) for n in rng.integers(FEWEST, MOST, 2))
    elevation, ground = draw_ground(rng, rows, columns, side)
    gravity = rounded(GRAVITY if rng.random() < 0.7 else log_uniform(rng, 1e-2, 30.0))
    length, width = side * columns, side * rows
    radius = rng.uniform(2, 0.25 * min(rows, columns)) * side
    height = rounded(1e-3 if rng.random() < 0.15 else radius * log_uniform(rng, 0.01, 1.0))

    def place() -> tuple[float, float]:
        return WEST + rng.uniform(0.15, 0.85) * length, SOUTH + rng.uniform(0.15, 0.85) * width

    spacing = rounded(side * float(rng.choice([1.0, 1.0, 0.7, 1.6])))
    raster, polygons = f"{name}.asc", f"{name}.geojson"
    curvature = [20.0, 0.0, rounded(4 * side), "none"][int(rng.integers(4))]
    data: Data = {
        "name": name,
        "gravity": gravity,
        "terrain": {"elevation": raster, "crs": SYSTEM, "curvature_length": curvature},
        "domain": {"x": _bounds(WEST, length, side, spacing), "y": _bounds(SOUTH, width, side, spacing)},
        "points": {"spacing": spacing},
    }
    files = {raster: raster_text(elevation, side)}
    delta = 0.0 if rng.random() < 0.1 else rng.uniform(1, 45)
    material: Data = {"density": DENSITY, "bed_friction": rounded(delta), "earth_pressure": "isotropic"}
    law, zoned = "Coulomb", False
    if rng.random() < 0.3:
        material["turbulent_friction"], law = rounded(gravity * log_uniform(rng, 2.0, 300.0)), "Voellmy"
    if rng.random() < 0.25:
        # all that it takes of a terrain is how steep it is
        slope = {"profile": "plane", "angle": 30.0}
        material = draw_law(rng, gravity, height, slope)
        law = str(material["friction"]["law"])
    elif zoned := bool(rng.random() < 0.3):
        zone = {"polygon": ring(rng, *place(), rng.uniform(0.1, 0.5) * length)}
        material["zones"] = [zone | {"bed_friction": rounded(rng.uniform(0, 50))}]
    data["material"] = material
    inflow = "none"
    if rng.random() < 0.4:
        inflow = "beside a release" if rng.random() < 0.6 else "alone"
        data["inflow"] = [_inflow(rng, place(), spacing, gravity)]
    if inflow != "alone":
        outlines = [(ring(rng, *place(), radius), height)]
        if rng.random() < 0.3:
            outlines.append(
                (ring(rng, *place(), radius * rng.uniform(0.3, 1)), rounded(height * rng.uniform(0.1, 1)))
            )
        data["release"] = {"polygons": polygons}
        files[polygons] = polygons_text(outlines)
    structures = _structures(rng, place, side) if rng.random() < 0.35 else []
    if structures:
        data["structures"] = structures
    erosion = "none"
    if rng.random() < 0.4:
        data["erodible_bed"], erosion = draw_erosion(rng, gravity, height, radius, length)
        data["erodible_bed"].pop("region", None)
    fall = math.sqrt(2 * gravity * max(float(np.nanmax(elevation) - np.nanmin(elevation)), side))
    end = rounded(10 * (length + width) / (fall + math.sqrt(gravity * height)))
    if "inflow" in data:
        graph = data["inflow"][0]["hydrograph"]
        lasts = end * log_uniform(rng, 0.02, 1.0)
        graph["volume"] = rounded(graph["peak_discharge"] * lasts / 2)
        graph["start"] = rounded(end * rng.uniform(0, 0.3)) if rng.random() < 0.5 else 0.0
    data["time"] = {"end": end, "output_every": end}
    data["output"] = {"fields": ["depth", "deposit_depth", "max_depth", "max_speed"]}
    # drawn last: all else of the scene is what it would be on a lattice
    layout = _layout(rng, data, spacing)
    if layout != "surface" and "inflow" in data:
        # cells of a lattice lie half out of its domain, which is moved on to those of the raster
        low, high = np.transpose([data["domain"]["x"], data["domain"]["y"]])
        ends = np.clip(data["inflow"][0]["section"], low + 0.5 * spacing, high - 0.5 * spacing)
        data["inflow"][0]["section"] = ends.tolist()
    labels = {
        "points": layout,
        "profile": f"surface: {ground}",
        "release": "film of 1 mm" if height == 1e-3 else "polygons",
        "friction": f"{law}, zones" if zoned else law,
        "erosion": erosion,
        "inflow": "none" if inflow == "none" else f"surface, {inflow}",
        "structures": ", ".join(sorted({each["kind"] for each in structures})) or "none",
        "gravity": "below 0.1" if gravity < 0.1 else "0.1 to 5" if gravity < 5 else "above 5",
    }
    return data, files, labels


def _layout(rng: Generator, data: Data, spacing: float) -> str:
    """Draw the points of a scene; give their label."""
    if rng.random() < LATTICES:
        return "surface"
    layout = "poisson-disc" if rng.random() < 0.6 else "graded"
    data["points"] = {"layout": layout, "spacing": spacing, "seed": int(rng.integers(1000))}
    if layout == "graded":
        (west, east), (south, north) = data["domain"]["x"], data["domain"]["y"]
        line = [[west, rounded(rng.uniform(south, north))], [east, rounded(rng.uniform(south, north))]]
        data["points"]["refine"] = [{"line": line, "spacing": rounded(spacing * rng.uniform(0.4, 0.8))}]
    return f"surface, {layout}"


def _bounds(start: float, length: float, side: float, spacing: float) -> list[float]:
    """Bounds within a raster that whole spacings lie between, m."""
    low = start + side
    return [low, low + spacing * math.floor((length - 2 * side) / spacing)]


def _inflow(rng: Generator, middle: tuple[float, float], spacing: float, gravity: float) -> Data:
    turn, half = rng.uniform(0, np.pi), 0.5 * spacing * log_uniform(rng, 1.0, 12.0)
    way = half * np.array([np.cos(turn), np.sin(turn)])
    ends = [[round(float(a), 3) for a in np.add(middle, sign * way)] for sign in (-1, 1)]
    depth, froude = spacing * log_uniform(rng, 0.02, 1.0), log_uniform(rng, 0.3, 4.0)
    peak = rounded(froude * math.sqrt(gravity * depth) * depth * max(2 * half, spacing))
    graph = {
        "shape": "triangle",
        "volume": 0.0,
        "peak_discharge": peak,
        "rise": rounded(rng.uniform(0.05, 0.95)),
    }
    return {"name": "section", "section": ends, "hydrograph": graph, "froude": rounded(froude)}


def _structures(rng: Generator, place: Callable[[], tuple[float, float]], side: float) -> list[Data]:
    found: list[Data] = []
    for _ in range(int(rng.integers(1, 4))):
        kind = chosen(rng, {"building": 0.6, "dam": 0.25, "basin": 0.15})
        if kind == "building":
            found.append({"kind": kind, "polygon": ring(rng, *place(), side * rng.uniform(1, 6))})
        elif kind == "basin":
            corners = ring(rng, *place(), side * rng.uniform(3, 10))
            found.append({"kind": kind, "polygon": corners, "depth": rounded(side * rng.uniform(0.1, 2))})
        else:
            line = [[round(a, 3) for a in place()] for _ in range(2)]
            tall = {
                "height": rounded(side * log_uniform(rng, 0.1, 3.0)),
                "side_slope": rounded(rng.uniform(20, 70)),
            }
            found.append({"kind": kind, "line": line, **tall, "crest_width": rounded(2 * side)})
    return found
