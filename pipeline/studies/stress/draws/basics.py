"""What all draws share: numbers drawn, rounded, and named by ranges."""

from __future__ import annotations

import math
from collections.abc import Mapping
from typing import Any

import numpy as np

from solver.physics.friction import friction_coefficient

Data = dict[str, Any]
Generator = np.random.Generator

DIGITS = 4
DENSITY = 2000.0


def rounded(value: float) -> float:
    """Round to a few significant digits, so that files are short."""
    return float(f"{float(value):.{DIGITS}g}")


def log_uniform(rng: Generator, low: float, high: float) -> float:
    """Draw a number whose logarithm is uniform."""
    return float(np.exp(rng.uniform(np.log(low), np.log(high))))


def chosen(rng: Generator, shares: Mapping[str, float]) -> str:
    """Draw one of several by their shares."""
    names, weights = list(shares), np.array(list(shares.values()))
    return str(names[int(rng.choice(len(names), p=weights / weights.sum()))])


def steepest(terrain: Data) -> float:
    """Largest inclination of a profile, up or down, degrees."""
    if terrain["profile"] == "segments":
        return float(max(abs(s["angle"]) for s in terrain["segments"]))
    return float(max(abs(terrain["angle"]), abs(terrain.get("runout_angle", 0.0))))


def spare_friction(terrain: Data, material: Data, gravity: float) -> float:
    """Least by which friction exceeds gravity along the bed, m s-2; below 0 where it does not."""
    steep = math.radians(steepest(terrain))
    law = material.get("friction", {})
    angle = material.get("bed_friction", law.get("bed_friction", law.get("angles", [0.0])[0]))
    hold = friction_coefficient(angle) * math.cos(steep)
    return gravity * (hold - math.sin(steep))


def size_class(radius: float) -> str:
    """Name a range of radii, m."""
    return "1 to 10 cm" if radius < 0.1 else "0.1 to 10 m" if radius < 10 else "10 m to 1 km"


def across_class(across: float) -> str:
    """Name a range of cells across a heap."""
    return "4 to 12" if across < 12 else "12 to 50" if across < 50 else "50 to 400"


def domain_class(area: float) -> str:
    """Name a range of areas of the domain, in radii squared."""
    return "tiny" if area < 25 else "huge" if area > 400 else "middling"
