"""Friction and earth pressure, drawn."""

from __future__ import annotations

import math

from pipeline.studies.stress.draws.basics import (
    DENSITY,
    Data,
    Generator,
    chosen,
    log_uniform,
    rounded,
    steepest,
)


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


def friction_class(material: Data) -> str:
    """Name the law of friction."""
    if "friction" in material:
        law = str(material["friction"]["law"])
        return "Voellmy with cohesion" if law == "voellmy" else law
    if material["bed_friction"] == 0:
        return "none"
    return "Voellmy" if "turbulent_friction" in material else "Coulomb"
