"""A failing scene made smaller, as long as it breaks the same law."""

from __future__ import annotations

import copy
from collections.abc import Callable, Iterator
from dataclasses import replace
from time import perf_counter

import numpy as np

from pipeline.studies.stress.scenes import Data, Drawn
from solver.physics.constants import GRAVITY

MOST_SECONDS = 60.0
PLAIN: Data = {"gravity": GRAVITY}
# Cells across a domain at least: in one cell everything is beyond what the laws can say.
FEWEST_ACROSS = 8


def shrink(drawn: Drawn, fails: Callable[[Drawn], bool], seconds: float = MOST_SECONDS) -> Drawn:
    """Give the smallest scene found in some time, s, that still fails."""
    began, smaller = perf_counter(), True
    while smaller:
        smaller = False
        for candidate in _simpler(drawn):
            if perf_counter() - began > seconds:
                return drawn
            if candidate.data != drawn.data and _fails(candidate, fails):
                drawn, smaller = candidate, True
                break
    return drawn


def _fails(candidate: Drawn, fails: Callable[[Drawn], bool]) -> bool:
    try:
        return fails(candidate)
    except ValueError:
        # what is no scene any more does not fail as one
        return False


def _simpler(drawn: Drawn) -> Iterator[Drawn]:
    """Go through scenes a little simpler, the greatest gains first."""

    def changed(**sections: object) -> Drawn:
        return replace(drawn, data={**copy.deepcopy(drawn.data), **copy.deepcopy(sections)})

    data = drawn.data
    if "elevation" in data["terrain"]:
        yield from _simpler_on_surface(drawn)
        return
    releases = data.get("release", [])
    if data.get("inflow") and releases:
        yield replace(drawn, data={name: value for name, value in data.items() if name != "inflow"})
        yield replace(drawn, data={name: value for name, value in data.items() if name != "release"})
    for k in range(len(releases)):
        if len(releases) > 1:
            yield changed(release=[r for i, r in enumerate(releases) if i != k])
    if "erodible_bed" in data:
        yield replace(drawn, data={name: part for name, part in data.items() if name != "erodible_bed"})
        bed = data["erodible_bed"]
        for name in ("region", "minimum_depth"):
            if name in bed:
                yield changed(erodible_bed={k: v for k, v in bed.items() if k != name})
    for side, kind in data.get("boundaries", {}).items():
        if kind != "open":
            yield changed(boundaries={**data["boundaries"], side: "open"})
    if data["terrain"]["profile"] == "segments" and len(data["terrain"]["segments"]) > 1:
        for k in range(len(data["terrain"]["segments"])):
            segments = [s for i, s in enumerate(data["terrain"]["segments"]) if i != k]
            yield changed(terrain={**data["terrain"], "segments": segments})
    if data["terrain"]["profile"] != "plane":
        steep = data["terrain"].get("angle", data["terrain"].get("segments", [{}])[0].get("angle", 30.0))
        yield changed(terrain={"profile": "plane", "angle": steep})
    if "turbulent_friction" in data["material"]:
        yield changed(material={k: v for k, v in data["material"].items() if k != "turbulent_friction"})
    if data["material"].get("earth_pressure") != "isotropic":
        plain = {k: v for k, v in data["material"].items() if k in ("bed_friction", "density")}
        yield changed(material={**plain, "earth_pressure": "isotropic"})
    if "friction" in data["material"]:
        plain = {k: v for k, v in data["material"].items() if k == "density"}
        yield changed(material={**plain, "bed_friction": 20.0, "earth_pressure": "isotropic"})
    if any(any(release["velocity"]) for release in releases):
        yield changed(release=[{**release, "velocity": [0.0, 0.0]} for release in releases])
    yield from _fewer_points(drawn, changed)
    if drawn.data["gravity"] != PLAIN["gravity"]:
        yield changed(**PLAIN)


def _simpler_on_surface(drawn: Drawn) -> Iterator[Drawn]:
    """Go through scenes with less on the same ground, and on wider spacing."""
    data = drawn.data
    for section in ("inflow", "erodible_bed", "structures"):
        if section in data and (section != "inflow" or "release" in data):
            yield replace(drawn, data={name: part for name, part in data.items() if name != section})
    for k in range(len(data.get("structures", ()))):
        fewer = [each for i, each in enumerate(data["structures"]) if i != k]
        if fewer:
            yield replace(drawn, data={**data, "structures": fewer})
    plain = {
        name: part for name, part in data["material"].items() if name not in ("zones", "turbulent_friction")
    }
    yield replace(drawn, data={**data, "material": plain})
    wider = {**data["points"], "spacing": float(f"{1.5 * data['points']['spacing']:.4g}")}
    yield replace(drawn, data={**data, "points": wider})


def _fewer_points(drawn: Drawn, changed: Callable[..., Drawn]) -> Iterator[Drawn]:
    """Go through scenes with fewer points: coarser ones, and those of half the domain."""
    data = drawn.data
    sides = [high - low for low, high in (data["domain"][key] for key in "xy")]
    cells = 1 if drawn.points is None else len(drawn.points)
    spacing = data["points"].get("spacing", float(np.sqrt(np.prod(sides) / cells)))
    for key in ("x", "y"):
        low, high = data["domain"][key]
        if high - low < 2 * FEWEST_ACROSS * spacing:
            continue
        for part in ((low, (low + high) / 2), ((low + high) / 2, high)):
            domain = {**data["domain"], key: [float(f"{p:.4g}") for p in part]}
            smaller = changed(domain=domain)
            if drawn.points is not None:
                k = "xy".index(key)
                inside = (drawn.points[:, k] >= domain[key][0]) & (drawn.points[:, k] <= domain[key][1])
                smaller = replace(smaller, points=np.asarray(drawn.points[inside]))
            yield smaller
    points = data["points"]
    if "spacing" in points and points.get("layout", "lattice") != "graded":
        yield changed(points={**points, "spacing": float(f"{1.5 * points['spacing']:.4g}")})
    if points.get("layout") == "graded":
        plain = {"layout": "poisson-disc", "spacing": points["spacing"], "seed": points["seed"]}
        yield changed(points=plain)
