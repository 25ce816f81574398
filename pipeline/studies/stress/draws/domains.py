"""Sides and points of a domain, drawn."""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from pipeline.studies.stress.draws.basics import Data, Generator, chosen, log_uniform, rounded, steepest


def draw_sides(
    rng: Generator, height: float, narrow: bool, kind: str, terrain: Data, material: Data
) -> tuple[Data, str]:
    """Draw what stands at the sides, and say what of it is of most interest."""
    shares = {"open": 0.55, "wall": 0.25, "no-slip": 0.12, "depth": 0.08}
    if kind == "collocation":
        del shares["depth"]
        # that form refuses walls across a slope steeper than friction
        if steepest(terrain) > material["bed_friction"]:
            shares = {"open": 1.0}
    found: Data = {}
    for side in ("x_min", "x_max", "y_min", "y_max"):
        what = "wall" if narrow and side[0] == "y" else chosen(rng, shares)
        found[side] = {"depth": rounded(height * log_uniform(rng, 0.1, 2.0))} if what == "depth" else what
    kinds = {"depth" if isinstance(side, dict) else side for side in found.values()}
    for name in ("depth", "no-slip", "wall"):
        if name in kinds:
            return found, {"depth": "some of given depth", "no-slip": "some no-slip", "wall": "some walls"}[
                name
            ]
    return found, "all open"


def draw_points(
    rng: Generator, layout: str, spacing: float, length: float, width: float, radius: float
) -> tuple[Data, NDArray[np.float64] | None]:
    """Draw the settings of the points, and the points themselves where a file has to hold them."""
    seed = int(rng.integers(0, 1000))
    if layout in ("lattice", "collocation, lattice"):
        return {"spacing": spacing}, None
    if layout in ("even cloud", "collocation, cloud"):
        return {"layout": "poisson-disc", "spacing": spacing, "seed": seed}, None
    if layout == "graded cloud":
        region = {"x": [0.0, rounded(length / 3)], "y": [-rounded(width / 4), rounded(width / 4)]}
        fine = rounded(spacing / rng.uniform(1.5, 3.0))
        coarse = rounded(2 * spacing)
        refine = [{"region": region, "spacing": fine}]
        growth = rounded(rng.uniform(0.05, 0.4))
        return {"layout": "graded", "spacing": coarse, "refine": refine, "growth": growth, "seed": seed}, None
    low, high = np.array([0.0, -width / 2]), np.array([length, width / 2])
    count = max(40, round(length * width / spacing**2))
    if layout == "thrown points":
        places = rng.uniform(low, high, (count, 2))
    else:
        # a stretched one is up to eight times closer along x than across
        ratio = math.sqrt(log_uniform(rng, 2.0, 8.0)) if layout == "stretched cloud" else 1.0
        nx, ny = (max(4, round(n)) for n in (length / spacing * ratio, width / spacing / ratio))
        grid = np.meshgrid((np.arange(nx) + 0.5) / nx, (np.arange(ny) + 0.5) / ny)
        places = np.stack(grid, axis=-1).reshape(-1, 2)
        shake = rng.uniform(0.05, 0.45) if layout != "nearly coincident" else 0.3
        places = places + shake * rng.uniform(-1, 1, places.shape) / [nx, ny]
        places = low + places * (high - low)
        if layout == "nearly coincident":
            twins = rng.choice(len(places), max(2, len(places) // 20), replace=False)
            turn = rng.uniform(0, 2 * np.pi, len(twins))
            gap = spacing * np.exp(rng.uniform(np.log(1e-4), np.log(0.1), len(twins)))
            beside = places[twins] + (gap * np.stack([np.cos(turn), np.sin(turn)])).T
            places = np.concatenate([places, np.clip(beside, low, high)])
    return {"layout": "file", "path": ""}, places
