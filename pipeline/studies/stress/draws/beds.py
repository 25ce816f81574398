"""Beds drawn: extent and profile of a domain, and what of it erodes."""

from __future__ import annotations

import math

import numpy as np

from pipeline.studies.stress.draws.basics import DENSITY, Data, Generator, chosen, log_uniform, rounded

EROSION = ("growth-rate", "shear-stress", "shear-work", "egashira", "jump-condition")


def draw_extent(
    rng: Generator, radius: float, spacing: float, narrow: bool, most: int
) -> tuple[float, float]:
    """Length and width of the domain, m, with at most so many points."""
    length = radius * log_uniform(rng, 3.0, 80.0)
    width = 3 * spacing if narrow else radius * log_uniform(rng, 2.6, 30.0)
    many = (length / spacing + 1) * (width / spacing + 1) / most
    if many > 1 and not narrow:
        length, width = (
            max(length / math.sqrt(many), 2.6 * radius),
            max(width / math.sqrt(many), 2.6 * radius),
        )
    return rounded(max(length, 4 * spacing)), rounded(width)


def draw_terrain(rng: Generator, length: float, spacing: float) -> tuple[Data, str]:
    """Draw the bed, and say of which class it is."""
    kind = chosen(rng, {"plane": 0.4, "bend": 0.25, "kinks": 0.2, "cliff": 0.15})
    curvature = bool(rng.random() < 0.8)
    steep = rounded(rng.uniform(0, 70))
    if kind == "plane":
        angle = 0.0 if rng.random() < 0.2 else -steep / 2 if rng.random() < 0.1 else steep
        return {"profile": "plane", "angle": rounded(angle)}, "plane"
    if kind == "bend":
        start = rng.uniform(0.1, 0.7) * length
        bend = {
            "angle": steep,
            "start": rounded(start),
            "end": rounded(start + rng.uniform(0.02, 0.3) * length),
        }
        after = 0.0 if rng.random() < 0.5 else rounded(rng.uniform(-30, 30))
        return {"profile": "bend", **bend, "runout_angle": after, "curvature": curvature}, "bend"
    joint = rounded(min(spacing * log_uniform(rng, 0.5, 8.0), length / 20))
    if kind == "cliff":
        top = rng.uniform(0.25, 0.6) * length
        foot = top + rng.uniform(0.06, 0.2) * length
        starts, angles = [0.0, top, foot], [rng.uniform(5, 30), rng.uniform(70, 85), rng.uniform(-10, 20)]
        name = "cliff"
    else:
        count = int(rng.integers(2, 6))
        gaps = rng.uniform(0.06, 0.25, count)
        starts = list(np.cumsum(gaps) * length)
        angles = list(rng.uniform(0, 70, count))
        name = "kinks"
    segments = [{"start": rounded(s), "angle": rounded(a)} for s, a in zip(starts, angles, strict=True)]
    return {"profile": "segments", "segments": segments, "joint": joint, "curvature": curvature}, name


def draw_erosion(
    rng: Generator, gravity: float, height: float, radius: float, length: float
) -> tuple[Data, str]:
    """Draw an erodible bed on the scale of a flow, and name its law."""
    waves, stress = math.sqrt(gravity * height), DENSITY * gravity * height
    model = chosen(rng, dict.fromkeys(EROSION, 1.0))
    law: Data = {"model": model}
    if model == "growth-rate":
        law["growth"] = rounded(log_uniform(rng, 0.01, 1.0) / radius)
    elif model == "shear-stress":
        law["rate"] = rounded(waves * log_uniform(rng, 1e-3, 1.0))
        law["critical_stress"] = rounded(stress * rng.uniform(0.0, 0.5))
        law["depth_per_stress"] = rounded(height / stress * log_uniform(rng, 0.05, 2.0))
        law["stress"] = "friction" if rng.random() < 0.5 else "depth-slope"
    elif model == "shear-work":
        law["erosion_energy"] = rounded(gravity * height * log_uniform(rng, 0.5, 50.0))
    elif model == "egashira":
        law["concentration"], law["bed_angle"] = rounded(rng.uniform(0.1, 0.6)), rounded(rng.uniform(20, 45))
    else:
        law["strength_coefficient"] = rounded(rng.uniform(0.0, 0.5))
        law["bed_cohesion"] = rounded(stress * rng.uniform(0.0, 0.1))
    bed: Data = {"depth": rounded(height * log_uniform(rng, 0.02, 3.0)), "law": law}
    if rng.random() < 0.5:
        start = rng.uniform(0.0, 0.5) * length
        far = rounded(1e3 * length)
        bed["region"] = {
            "x": [rounded(start), rounded(start + rng.uniform(0.1, 1.0) * length)],
            "y": [-far, far],
        }
    if rng.random() < 0.5 or model == "jump-condition":
        bed["minimum_depth"] = rounded(height * rng.uniform(0.0, 0.2))
        bed["minimum_speed"] = rounded(waves * rng.uniform(0.01, 0.5))
    return bed, model
