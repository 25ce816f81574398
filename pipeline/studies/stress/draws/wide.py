"""Scenes drawn wider: noisy tables, earth pressure of wide range, depths that change the regime, cliffs.

They are profile scenes of which one part, or several, is drawn anew, so that all else has been seen before.
"""

from __future__ import annotations

from itertools import pairwise
from typing import Any

import numpy as np
from numpy.typing import NDArray

from pipeline.studies.stress.draws.basics import Data, Generator, chosen, log_uniform, rounded

Files = dict[str, str]
# Points of a table, and what is left between its end and that of the domain, as a share of its length.
FEWEST_POINTS, MOST_POINTS, SPARE = 8, 60, 0.3


def table_text(distances: NDArray[np.float64], elevations: NDArray[np.float64]) -> str:
    """Write a table of elevations as CSV, with all digits."""
    pairs = zip(distances.tolist(), elevations.tolist(), strict=True)
    return "\n".join(["distance,elevation", *(f"{d!r},{z!r}" for d, z in pairs), ""])


def draw_table(rng: Generator, length: float, spacing: float, name: str) -> tuple[Data, Files]:
    """Draw a surveyed slope, m: uneven distances, a slope that changes, steps, and noise."""
    count = int(rng.integers(FEWEST_POINTS, MOST_POINTS))
    gaps = rng.exponential(1.0, count) + 0.05
    distances = np.concatenate([[0.0], np.cumsum(gaps)]) * (1 + SPARE) * length / gaps.sum()
    slopes = np.tan(np.radians(np.interp(distances, *_bends(rng, distances[-1]))))
    middle = (slopes[1:] + slopes[:-1]) / 2
    elevations = -np.concatenate([[0.0], np.cumsum(middle * np.diff(distances))])
    closest = float(np.diff(distances).min())
    elevations += log_uniform(rng, 1e-3, 0.5) * float(np.diff(distances).mean()) * rng.normal(size=count + 1)
    if rng.random() < 0.3:
        # a step of a survey in two parts
        elevations[int(rng.integers(1, count)) :] += rng.uniform(-2, 2) * float(np.diff(distances).mean())
    distances, elevations = (
        np.array([rounded(v) for v in a]) for a in (distances, elevations - elevations.min())
    )
    distances = np.maximum.accumulate(distances) + 1e-4 * closest * np.arange(count + 1)
    smoothing = rounded(max(float(np.diff(distances).mean()) * log_uniform(rng, 0.5, 6.0), 0.5 * spacing))
    file = f"{name}-profile.csv"
    terrain = {
        "profile": "table",
        "file": file,
        "smoothing": smoothing,
        "curvature": bool(rng.random() < 0.8),
    }
    return terrain, {file: table_text(distances, elevations)}


def _bends(rng: Generator, end: float) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Draw inclinations, degrees, at places along a slope, m."""
    count = int(rng.integers(2, 6))
    return np.sort(rng.uniform(0, end, count)), rng.uniform(-10, 60, count)


def draw_pressure(rng: Generator) -> Data:
    """Draw materials of the widest range of K: phi next to delta, and far above it."""
    near = rng.random() < 0.4
    delta = rng.uniform(2, 45) if near else rng.uniform(0, 12)
    phi = delta + (log_uniform(rng, 1e-3, 1.0) if near else rng.uniform(30, 48))
    width = 0.0 if rng.random() < 0.2 else rounded(log_uniform(rng, 0.02, 5.0))
    material: Data = {"bed_friction": rounded(delta), "internal_friction": rounded(phi)}
    material["internal_friction"] = max(material["internal_friction"], material["bed_friction"])
    return material | {"pressure_transition": width}


def draw_given_depths(rng: Generator, height: float, sides: Data) -> Data:
    """Draw given depths that drown a flow, or let it shoot out: a hundredth to ten times its height."""
    found = dict(sides)
    for side in sorted(rng.choice(list(sides), int(rng.integers(1, 4)), replace=False)):
        if found[side] != "wall":
            found[str(side)] = {"depth": rounded(height * log_uniform(rng, 0.01, 10.0))}
    return found


def draw_cliff(rng: Generator, length: float, spacing: float, sides: Data) -> tuple[Data, Data]:
    """Draw a cliff or several, with walls above, below or across it."""
    count = int(rng.integers(1, 4))
    tops = np.sort(rng.uniform(0.1, 0.8, count)) * length
    segments = [{"start": 0.0, "angle": rounded(rng.uniform(0, 40))}]
    for top in tops:
        foot = top + log_uniform(rng, 0.5 * spacing, max(spacing, 0.1 * length))
        segments += [
            {"start": rounded(top), "angle": rounded(rng.uniform(70, 86))},
            {"start": rounded(foot), "angle": rounded(rng.uniform(-15, 40))},
        ]
    least = min(b["start"] - a["start"] for a, b in pairwise(segments))
    walls = {
        side: chosen(rng, {"wall": 0.5, "no-slip": 0.25, "open": 0.25}) if what != "wall" else what
        for side, what in sides.items()
    }
    if least <= 0:
        segments = segments[:2]
        least = segments[1]["start"]
    joint = rounded(max(0.9 * min(least, 4 * spacing), 1e-3 * spacing))
    return {
        "profile": "segments",
        "segments": segments,
        "joint": joint,
        "curvature": bool(rng.random() < 0.8),
    }, walls


def widened(rng: Generator, data: Data, height: float, spacing: float) -> tuple[Data, Files, str]:
    """Draw a part of a scene anew, and say which.

    Parameters
    ----------
    data : dict
        Its scenario file.
    height, spacing : float
        Of its first heap and of its points, m.
    """
    length, name = data["domain"]["x"][1], data["name"]
    shares = {"table": 0.3, "cliffs and walls": 0.3}
    if "friction" not in data["material"]:
        shares["earth pressure"] = 0.25
    shares["given depths"] = 0.15
    part = chosen(rng, shares)
    changed: dict[str, Any] = dict(data)
    files: Files = {}
    if part == "table":
        changed["terrain"], files = draw_table(rng, length, spacing, name)
    elif part == "cliffs and walls":
        changed["terrain"], changed["boundaries"] = draw_cliff(rng, length, spacing, data["boundaries"])
    elif part == "earth pressure":
        kept = {k: v for k, v in data["material"].items() if k in ("density", "turbulent_friction")}
        changed["material"] = kept | draw_pressure(rng)
    else:
        changed["boundaries"] = draw_given_depths(rng, height, data["boundaries"])
    return changed, files, part
