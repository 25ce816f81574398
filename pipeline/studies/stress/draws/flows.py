"""Heaps and inflows, drawn."""

from __future__ import annotations

import math
from typing import Any

import numpy as np

from pipeline.studies.stress.draws.basics import Data, Generator, chosen, log_uniform, rounded

FILM_HEIGHT = 1e-3


def draw_height(rng: Generator, radius: float) -> tuple[float, str]:
    """Height of a heap, m: of a film of 1 mm to that of a tower twice as high as wide."""
    kind = chosen(rng, {"film": 0.15, "mound": 0.55, "tower": 0.3})
    if kind == "film":
        return FILM_HEIGHT, "film of 1 mm"
    if kind == "mound":
        return rounded(radius * log_uniform(rng, 0.02, 1.0)), "mound"
    return rounded(radius * log_uniform(rng, 1.0, 4.0)), "tower"


def draw_releases(
    rng: Generator, radius: float, height: float, gravity: float, length: float, width: float, narrow: bool
) -> tuple[list[Data], str]:
    """Draw the heaps; the first has the radius and the height asked for."""
    motion = chosen(rng, {"still": 0.5, "moving": 0.25, "colliding": 0.25})
    count = int(rng.integers(2, 5)) if motion == "colliding" or rng.random() < 0.2 else 1
    releases = []
    for k in range(count):
        size = 1.0 if k == 0 else log_uniform(rng, 0.3, 1.0)
        r, h = radius * size, height * (1.0 if k == 0 else log_uniform(rng, 0.2, 1.0))
        x = rng.uniform(min(1.3 * r, length / 2), max(length / 2, min(length - 1.3 * r, 8 * radius)))
        y = rng.uniform(-1, 1) * max(0.0, min(width / 2 - 1.3 * r, 3 * radius)) if rng.random() < 0.7 else 0.0
        releases.append(_heap(rng, r, h, x, y, width if narrow else None))
    for k, release in enumerate(releases):
        froude = rng.uniform(0, 6)
        speed = froude * math.sqrt(gravity * height)
        if motion == "still":
            way = np.zeros(2)
        elif motion == "moving":
            turn = rng.uniform(0, 2 * np.pi)
            way = np.array([np.cos(turn), np.sin(turn)])
        else:
            way = np.subtract(_centre(releases[(k + 1) % count]), _centre(release))
            way = way / max(np.hypot(*way), 1e-12 * radius)
        across = 0.0 if narrow else way[1]
        release["velocity"] = [rounded(speed * way[0]), rounded(speed * across)]
    return releases, motion


def _centre(release: Data) -> Any:
    return release.get("centre") or [np.mean(release["x"]), np.mean(release["y"])]


def _heap(rng: Generator, r: float, h: float, x: float, y: float, width: float | None) -> Data:
    if width is not None:
        # across the whole domain, and the half cells beyond its bounds
        return _box(x - r, x + r, -width, width, h)
    shape = chosen(rng, {"paraboloid": 0.4, "box": 0.25, "cylinder": 0.2, "cap": 0.15})
    if shape == "box":
        return _box(x - r, x + r, y - r, y + r, h)
    base: Data = {"shape": shape, "centre": [rounded(x), rounded(y)]}
    if shape == "paraboloid":
        return base | {"radii": [rounded(r), rounded(r * rng.uniform(0.5, 1.5))], "height": rounded(h)}
    if shape == "cap":
        return base | {"radius": rounded(r), "height": rounded(min(h, r))}
    return base | {"radius": rounded(r), "height": rounded(h)}


def _box(x0: float, x1: float, y0: float, y1: float, h: float) -> Data:
    bounds = {"x": [rounded(x0), rounded(x1)], "y": [rounded(y0), rounded(y1)]}
    return {"shape": "box", **bounds, "height": rounded(h)}


def draw_inflow(
    rng: Generator, terrain: Data, material: Data, domain: Data, spacing: float, end: float, gravity: float
) -> tuple[list[Data], str]:
    """Draw a hydrograph through a section on a side or inside, of any direction; none for most scenes."""
    kind = chosen(rng, {"none": 0.6, "at a side": 0.2, "inside": 0.2})
    if kind == "none":
        return [], "none"
    (x0, x1), (y0, y1) = domain["x"], domain["y"]
    if kind == "at a side":
        place = (x0, (y0 + y1) / 2) if rng.random() < 0.7 else ((x0 + x1) / 2, y0)
        turn = np.pi / 2 if place[0] == x0 else 0.0
    else:
        place = rng.uniform(x0 + 0.1 * (x1 - x0), x1 - 0.3 * (x1 - x0)), rng.uniform(y0, y1)
        turn = np.pi / 2 if rng.random() < 0.6 else rng.uniform(0, np.pi)
    half = 0.5 * spacing * log_uniform(rng, 1.0, 20.0)
    way = np.array([np.cos(turn), np.sin(turn)]) * half
    ends = [np.clip(np.add(place, sign * way), (x0, y0), (x1, y1)) for sign in (-1, 1)]
    width = max(float(np.hypot(*(ends[1] - ends[0]))), spacing)
    depth = spacing * log_uniform(rng, 0.02, 2.0)
    froude = log_uniform(rng, 0.2, 4.0)
    peak = rounded(froude * math.sqrt(gravity * depth) * depth * width)
    lasts = end * log_uniform(rng, 0.02, 1.5)
    graph = {
        "shape": "triangle",
        "volume": rounded(peak * lasts / 2),
        "peak_discharge": peak,
        "rise": rounded(rng.uniform(0.02, 0.98)),
        "start": rounded(end * rng.uniform(0, 0.3)) if rng.random() < 0.5 else 0.0,
    }
    section = [[rounded(float(a)) for a in each] for each in ends]
    if section[0] == section[1]:
        return [], "none"
    inflow: Data = {"name": "section", "section": section, "hydrograph": graph}
    given = chosen(rng, {"froude": 0.5, "speed": 0.2, "depth": 0.3})
    speed = rounded(froude * math.sqrt(gravity * depth))
    inflow[given] = {"froude": rounded(froude), "speed": speed, "depth": rounded(depth)}[given]
    return [inflow], kind
