"""The parts of a random scene: bed, material, heaps, sides and points, as sections of a scenario file."""

from __future__ import annotations

import math
from collections.abc import Mapping
from typing import Any

import numpy as np
from numpy.typing import NDArray

from solver.physics.friction import friction_coefficient

Data = dict[str, Any]
Generator = np.random.Generator

DIGITS = 4
DENSITY = 2000.0
EROSION = ("growth-rate", "shear-stress", "shear-work", "egashira", "jump-condition")
FILM_HEIGHT = 1e-3


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


def draw_height(rng: Generator, radius: float) -> tuple[float, str]:
    """Height of a heap, m: of a film of 1 mm to that of a tower twice as high as wide."""
    kind = chosen(rng, {"film": 0.15, "mound": 0.55, "tower": 0.3})
    if kind == "film":
        return FILM_HEIGHT, "film of 1 mm"
    if kind == "mound":
        return rounded(radius * log_uniform(rng, 0.02, 1.0)), "mound"
    return rounded(radius * log_uniform(rng, 1.0, 4.0)), "tower"


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


def draw_material(rng: Generator, gravity: float, terrain: Data) -> tuple[Data, str]:
    """Draw friction and earth pressure; a quarter of the materials rest on their bed."""
    steep = steepest(terrain)
    delta = 0.0 if rng.random() < 0.12 else rng.uniform(1, 50)
    if rng.random() < 0.25 and steep < 46:
        # what comes to rest everywhere
        delta = rng.uniform(steep + 1, 50)
    material: Data = {"bed_friction": rounded(delta)}
    if rng.random() < 0.55:
        phi = material["bed_friction"] if rng.random() < 0.15 else rounded(rng.uniform(delta, 60))
        material["internal_friction"] = max(phi, material["bed_friction"])
        pressure = "mohr-coulomb"
    else:
        material["earth_pressure"] = pressure = "isotropic"
    if rng.random() < 0.12:
        material["turbulent_friction"] = rounded(gravity * log_uniform(rng, 2.0, 300.0))
    return material, pressure


def draw_law(rng: Generator, gravity: float, height: float, terrain: Data) -> Data:
    """Draw another law of friction than Coulomb's or Voellmy's, for heaps of a height, m."""
    weight, waves = DENSITY * gravity * height, math.sqrt(gravity * height)
    # stresses, viscous resistance and drag as parts of the weight, at the speed of waves
    stress, drag = weight * log_uniform(rng, 0.01, 1.0), log_uniform(rng, 0.003, 0.3)
    viscosity = DENSITY * waves * height * log_uniform(rng, 1e-3, 0.3)
    roughness = math.sqrt(drag * height ** (1 / 3) / gravity)
    slow = rng.uniform(5, 30)
    if rng.random() < 0.25 and (steep := steepest(terrain)) < 40:
        # what comes to rest everywhere
        slow = rng.uniform(steep + 1, 42)
    fast = rng.uniform(slow + 2, 50)
    grains = {"beta": rng.uniform(0.1, 0.7), "length": height * log_uniform(rng, 0.01, 1.0)}
    grains["gamma"] = rng.uniform(0, 1) if rng.random() < 0.5 else 0.0
    laws: dict[str, Data] = {
        "voellmy": {"bed_friction": slow, "turbulent_friction": gravity / drag, "cohesion": stress},
        "chezy": {"chezy_coefficient": math.sqrt(gravity / drag)},
        "manning": {"manning_n": roughness},
        "obrien": {"yield_stress": stress, "viscosity": viscosity, "manning_n": roughness},
        "bingham": {"yield_stress": stress, "viscosity": viscosity},
        "herschel-bulkley": {
            "yield_stress": stress,
            "consistency": stress * (height / waves) ** (index := rounded(rng.uniform(0.2, 1.2))),
            "flow_index": index,
        },
        "pouliquen": {"angles": [slow, fast], **grains},
        "edwards": {
            "angles": [slow, fast, rng.uniform(slow + 0.2, fast - 0.2)],
            **grains,
            "beta_star": rng.uniform(0.05, 0.5),
        },
    }
    name = str(rng.choice(list(laws)))
    law: Data = {
        key: [rounded(v) for v in value] if isinstance(value, list) else rounded(value)
        for key, value in laws[name].items()
    }
    if name == "bingham":
        law["form"] = chosen(rng, {"exact": 0.6, "linear": 0.4})
    return {"density": DENSITY, "earth_pressure": "isotropic", "friction": {"law": name, **law}}


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


def friction_class(material: Data) -> str:
    """Name the law of friction."""
    if "friction" in material:
        law = str(material["friction"]["law"])
        return "Voellmy with cohesion" if law == "voellmy" else law
    if material["bed_friction"] == 0:
        return "none"
    return "Voellmy" if "turbulent_friction" in material else "Coulomb"


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


def size_class(radius: float) -> str:
    """Name a range of radii, m."""
    return "1 to 10 cm" if radius < 0.1 else "0.1 to 10 m" if radius < 10 else "10 m to 1 km"


def across_class(across: float) -> str:
    """Name a range of cells across a heap."""
    return "4 to 12" if across < 12 else "12 to 50" if across < 50 else "50 to 400"


def domain_class(area: float) -> str:
    """Name a range of areas of the domain, in radii squared."""
    return "tiny" if area < 25 else "huge" if area > 400 else "middling"
