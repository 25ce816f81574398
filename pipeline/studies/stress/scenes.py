"""Random scenes as scenario files: drawn from a seed, from plain ones to what no survey would give."""

from __future__ import annotations

import math
from collections.abc import Collection, Mapping
from dataclasses import dataclass, field
from itertools import count, islice
from pathlib import Path
from tempfile import TemporaryDirectory

import numpy as np
import yaml
from numpy.typing import NDArray

from pipeline.inputs import elevation_table
from pipeline.inputs.point_file import PointFile
from pipeline.mistakes import BadInput
from pipeline.runs.run import Run
from pipeline.runs.runs import expand, share
from pipeline.runs.scene_of_run import Prepared, build_scene
from pipeline.runs.shared_points import made
from pipeline.scenario.scenario import load
from pipeline.scenario.schema_errors import check
from pipeline.scenario.strict_yaml import parse
from pipeline.studies.stress.draws import basics as draws
from pipeline.studies.stress.draws.beds import draw_erosion, draw_extent, draw_terrain
from pipeline.studies.stress.draws.domains import draw_points, draw_sides
from pipeline.studies.stress.draws.flows import draw_height, draw_inflow, draw_releases
from pipeline.studies.stress.draws.materials import draw_law, draw_material, friction_class
from pipeline.studies.stress.draws.surfaces import draw_surface_scene
from pipeline.studies.stress.draws.wide import widened
from solver.physics.constants import GRAVITY

Data = draws.Data

# Layouts and their shares of the scenes; file layouts hold what no generator of ours would place.
LAYOUTS = {
    "lattice": 0.5,
    "even cloud": 0.1,
    "graded cloud": 0.1,
    "shaken lattice": 0.07,
    "stretched cloud": 0.05,
    "thrown points": 0.06,
    "nearly coincident": 0.05,
    "collocation, lattice": 0.04,
    "collocation, cloud": 0.03,
}
# Most points, and most cells across the first heap, of the kinds of runs.
MOST_POINTS = {"lattice": 250_000, "cloud": 6_000, "collocation": 2_500}
MOST_ACROSS = {"lattice": 400, "cloud": 50, "collocation": 20}
LEAST_ACROSS = {"lattice": 4, "cloud": 4, "collocation": 8}
LONGEST_TIME = 40.0
# steps, roughly, beyond which no end time lies: a step would be next to nothing of it.
MOST_STEPS = 1e6
STOPPING_TIMES = 40.0
# Share of the scenes with another law of friction than Coulomb's or Voellmy's.
OTHER_LAWS = 0.3
# Of those with the axes of a profile, scenes that have the axes of the flow.
ALONG_FLOW = 0.4
# Share of the scenes of the conservative form on a bed that erodes; drawn apart, so that all else of a scene
# is as it would be without.
ERODING, OF_EROSION = 0.25, 19
# What inflows are drawn by, beside seed and number of a scene; on clouds they were drawn later, for half of
# the scenes.
INFLOW, INFLOW_ON_CLOUD, DRAWN_ON_CLOUD = 20, 31, 0.5
# Share of the scenes of the conservative form that are drawn wider, apart too.
WIDER, OF_WIDER = 0.15, 23
# Share of the scenes that are on elevation models, in place of those that they would be.
ON_SURFACES, OF_SURFACES = 0.1, 29
# What a scenario file may name beside its points, by section and key.
NAMED = (("terrain", "file"), ("terrain", "elevation"), ("release", "polygons"))


@dataclass(frozen=True)
class Drawn:
    """One scene.

    Parameters
    ----------
    name : str
        Of the scenario.
    data : dict
        Content of its scenario file.
    labels : mapping
        What it is of.
    points : array, optional
        Of a ``file`` layout, (n, 2), m.
    files : mapping
        Text of other files by name.
    """

    name: str
    data: Data
    labels: Mapping[str, str] = field(default_factory=dict)
    points: NDArray[np.float64] | None = None
    files: Mapping[str, str] = field(default_factory=dict)

    @property
    def text(self) -> str:
        """The scenario file."""
        return yaml.safe_dump(self.data, sort_keys=False, default_flow_style=None, width=105)

    def write(self, folder: Path) -> Path:
        """Write the scenario file, and beside it that of its points."""
        folder.mkdir(parents=True, exist_ok=True)
        if self.points is not None:
            lines = ["x,y", *(f"{x!r},{y!r}" for x, y in self.points.tolist())]
            (folder / str(self.data["points"]["path"])).write_text("\n".join(lines) + "\n", encoding="utf-8")
        for name, text in self.files.items():
            (folder / name).write_text(text, encoding="utf-8")
        path = folder / f"{self.name}.yaml"
        path.write_text(self.text, encoding="utf-8")
        return path


def draw(seed: int, number: int) -> Drawn:
    """Draw a scene; the same seed and number give the same one everywhere."""
    ground = np.random.default_rng([seed, number, OF_SURFACES])
    if ground.random() < ON_SURFACES:
        return _on_surface(f"stress-{seed}-{number}", ground)
    rng = np.random.default_rng([seed, number])
    layout = draws.chosen(rng, LAYOUTS)
    kind = "collocation" if "collocation" in layout else "lattice" if layout == "lattice" else "cloud"
    gravity = draws.rounded(GRAVITY if rng.random() < 0.4 else draws.log_uniform(rng, 1e-3, 30.0))
    radius = draws.rounded(draws.log_uniform(rng, 1e-2, 1e3))
    height, relief = draw_height(rng, radius)
    across = draws.log_uniform(rng, LEAST_ACROSS[kind], MOST_ACROSS[kind])
    spacing = draws.rounded(2 * radius / across)
    narrow = kind == "lattice" and rng.random() < 0.15
    length, width = draw_extent(rng, radius, spacing, narrow, MOST_POINTS[kind])
    terrain, profile = draw_terrain(rng, length, spacing)
    material, pressure = draw_material(rng, gravity, terrain)
    # from a generator of its own, so that scenes of the other laws stay the ones they are
    other = np.random.default_rng([seed, number, 1])
    if kind != "collocation" and other.random() < OTHER_LAWS:
        material, pressure = draw_law(other, gravity, height, terrain), "isotropic"
    elif kind != "collocation" and pressure == "mohr-coulomb" and other.random() < ALONG_FLOW:
        pressure = "mohr-coulomb-flow"
        material = {**material, "earth_pressure": pressure}
    releases, motion = draw_releases(rng, radius, height, gravity, length, width, narrow)
    sides, boundary = draw_sides(rng, height, narrow, kind, terrain, material)
    points, places = draw_points(rng, layout, spacing, length, width, radius)
    name = f"stress-{seed}-{number}"
    if places is not None:
        points["path"] = f"{name}.csv"
    waves = math.sqrt(gravity * height) + max(math.hypot(*r["velocity"]) for r in releases)
    falling = math.sqrt(2 * gravity * length * math.sin(math.radians(draws.steepest(terrain))))
    # what comes to rest is given the time for it
    spare = draws.spare_friction(terrain, material, gravity)
    stopping = 0.0 if spare <= 0 else STOPPING_TIMES * (waves + falling) / spare
    crossing = LONGEST_TIME * (length + width) / (waves + falling)
    data: Data = {
        "name": name,
        "gravity": gravity,
        "terrain": terrain,
        "domain": {"x": [0.0, length], "y": [-width / 2, width / 2]},
        "points": points,
        "release": releases,
        "material": material,
        "boundaries": sides,
        "time": {
            "end": draws.rounded(min(max(crossing, stopping), MOST_STEPS * spacing / (waves + falling)))
        },
    }
    comes_in = "none"
    # drawn apart, so that scenes without are those that they were
    own = np.random.default_rng([seed, number, INFLOW if kind == "lattice" else INFLOW_ON_CLOUD])
    if kind == "lattice" or (kind == "cloud" and own.random() < DRAWN_ON_CLOUD):
        about = terrain, material, data["domain"], spacing, data["time"]["end"], gravity
        inflow, comes_in = draw_inflow(own, *about)
        if inflow:
            data["inflow"] = inflow
            if kind == "cloud":
                # rounded ends may be outside, where a lattice has half a cell more
                ends = np.clip(
                    inflow[0]["section"], *np.transpose([data["domain"]["x"], data["domain"]["y"]])
                )
                inflow[0]["section"] = ends.tolist()
            if own.random() < 0.3:
                del data["release"]
    if kind == "collocation":
        data["scheme"] = {"form": "collocation"}
    eroding = np.random.default_rng([seed, number, OF_EROSION])
    erosion = "none"
    if kind != "collocation" and eroding.random() < ERODING:
        data["material"] = {**material, "density": draws.DENSITY}
        data["erodible_bed"], erosion = draw_erosion(eroding, gravity, height, radius, length)
    wider = np.random.default_rng([seed, number, OF_WIDER])
    part = "none"
    files: dict[str, str] = {}
    if kind != "collocation" and wider.random() < WIDER:
        data, files, part = widened(wider, data, height, spacing)
    # one frame, at the end: output times would change the steps
    data["time"]["output_every"] = data["time"]["end"]
    data["output"] = {"fields": ["depth", "deposit_depth", "max_depth", "max_speed"]}
    labels = {
        "points": layout,
        "profile": profile,
        "release": relief,
        "heaps": "several, colliding"
        if motion == "colliding"
        else "one"
        if len(releases) == 1
        else "several",
        "initial speed": {"still": "none", "moving": "some", "colliding": "some"}[motion],
        "earth pressure": pressure,
        "friction": friction_class(data["material"]),
        "erosion": erosion,
        "sides": boundary,
        "inflow": comes_in if "release" in data else f"{comes_in}, no release",
        "gravity": "below 0.1" if gravity < 0.1 else "0.1 to 5" if gravity < 5 else "above 5",
        "size of the heap": draws.size_class(radius),
        "cells across": draws.across_class(across),
        "domain": draws.domain_class(length * width / radius**2),
        "drawn wider": part,
    }
    return Drawn(name, data, labels, places, files)


def first_numbers(seed: int, many: int, sections: Collection[str] = ()) -> list[int]:
    """Give the numbers of the first scenes of a seed that have all of some sections in their files.

    Parameters
    ----------
    many : int
        How many.
    sections : collection of str
        Such as ``inflow``; scenes that have all of them must be drawn.
    """
    if not sections:
        return list(range(many))
    wanted = set(sections)
    return list(islice((k for k in count() if wanted <= draw(seed, k).data.keys()), many))


def _on_surface(name: str, rng: draws.Generator) -> Drawn:
    data, files, labels = draw_surface_scene(rng, name)
    return Drawn(name, data, labels, files=files)


def read(path: Path) -> Drawn:
    """Read a scenario file as it was written by `Drawn.write`, or by hand.

    Raises
    ------
    BadInput
        If it holds mistakes.
    """
    (scenario,) = load([path])
    data = scenario.settings.model_dump(mode="json", exclude_unset=True)
    sections = ((data.get(section), key) for section, key in NAMED)
    named = (section.get(key) for section, key in sections if isinstance(section, dict))
    files = {name: (path.parent / name).read_text(encoding="utf-8") for name in named if name}
    return Drawn(scenario.name, data, {}, None if scenario.points is None else scenario.points.points, files)


def can_be_run(drawn: Drawn) -> bool:
    """Whether `pipeline run` takes the scenario file of a scene."""
    with TemporaryDirectory() as folder:
        try:
            read(drawn.write(Path(folder)))
        except BadInput:
            return False
    return True


def prepared(drawn: Drawn) -> Prepared:
    """Make the solver's scene.

    Raises
    ------
    ValueError
        If its points or supports are not fit; the message says why.
    """
    if "elevation" in drawn.data["terrain"]:
        return _prepared_on_surface(drawn)
    settings = check(parse(drawn.text, drawn.name).data)
    if isinstance(settings, list):
        raise ValueError("; ".join(f"{'.'.join(map(str, p.path))}: {p.message}" for p in settings))
    file = None if drawn.points is None else PointFile(drawn.points, "")
    table = None
    if drawn.data["terrain"].get("profile") == "table":
        with TemporaryDirectory() as folder:
            path = Path(folder) / drawn.data["terrain"]["file"]
            path.write_text(drawn.files[path.name], encoding="utf-8")
            table = elevation_table.read(path)
    run = Run(0, {}, settings, table)
    return build_scene(run, made(settings, file, [run]))


def _prepared_on_surface(drawn: Drawn) -> Prepared:
    with TemporaryDirectory() as folder:
        try:
            (scenario,) = load([drawn.write(Path(folder))])
            runs = expand(scenario)
            return build_scene(runs[0], share(scenario, runs))
        except BadInput as error:
            raise ValueError(str(error)) from None
