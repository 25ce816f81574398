"""The same scene again: restarted, mirrored, under another gravity, on another scale."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import replace
from typing import Any, TypeVar

import numpy as np

from pipeline.runs.scene_of_run import Prepared
from pipeline.studies.stress.scenes import Drawn, prepared
from solver.checks.states import Check
from solver.forms import begin
from solver.inflow.conditions import Inflow
from solver.inflow.hydrograph import Hydrograph
from solver.physics.elevation import Surface
from solver.points.cloud import PointCloud
from solver.points.lattice import Lattice
from solver.run import Run
from solver.scene import Boundaries, Scene

T = TypeVar("T")
# Steps that are repeated; what mirrors to round-off only is compared after fewer.
STEPS, FEW_STEPS, FIRST_STEPS = 60, 10, 3
# Largest difference of depth of what mirrors to round-off, as part of the largest depth.
ROUND_OFF = 1e-9
# What ten steps make of a relative error of the geometry of a cell.
STEPS_OF_ROUND_OFF = 1000.0
# roots of what is next to nothing make this of a last bit
ROOT_OF_ROUND_OFF = 1.5e-8
# Gravity and lengths are scaled by a power of 4, whose root is exact.
FACTOR = 4.0
# Keys of lengths, wherever they stand.
LENGTHS = {"x", "y", "spacing", "centre", "radius", "radii", "height", "start", "end", "joint", "depth"}
LENGTHS |= {"section", "smoothing"}
# Powers of length that keys of inflows, and velocities, grow with.
POWERS = {"velocity": 0.5, "speed": 0.5, "volume": 3.0, "peak_discharge": 2.5, "start_time": 0.5}
# Powers of gravity and of length that parameters of friction grow with.
OF_FRICTION = {
    "turbulent_friction": (1.0, 0.0),
    "chezy_coefficient": (0.5, 0.0),
    "cohesion": (1.0, 1.0),
    "yield_stress": (1.0, 1.0),
    "viscosity": (0.5, 1.5),
    "length": (0.0, 1.0),
}
# The same of an erodible bed and its law.
OF_EROSION = {
    "growth": (0.0, -1.0),
    "rate": (0.5, 0.5),
    "depth_per_stress": (-1.0, 0.0),
    "critical_stress": (1.0, 1.0),
    "erosion_energy": (1.0, 1.0),
    "bed_cohesion": (1.0, 1.0),
    "minimum_depth": (0.0, 1.0),
    "minimum_speed": (0.5, 0.5),
}
# Parameters that roots of depth or speed go with, which do not scale to the last bit.
ROOTS = {"manning_n", "consistency"}


def steps_within(work: float, watched_steps: int, watched_work: int) -> int:
    """Give the number of steps to repeat of a scene: fewer where they take more than some work, cell-stages.

    Parameters
    ----------
    work : float
        Of a repetition, roughly, at most.
    watched_steps, watched_work : int
        Of the scene itself: how many steps it took, and what they cost.
    """
    return int(np.clip(work * watched_steps / max(watched_work, 1), FEW_STEPS, STEPS))


def repeat(drawn: Drawn, ready: Prepared | None = None, most: int = STEPS) -> list[Check]:
    """Repeat the first steps of a scene in all ways, and compare.

    Parameters
    ----------
    ready : Prepared, optional
        The solver's scene, where it is made already.
    most : int
        Steps, at least `FEW_STEPS`.
    """
    ready = prepared(drawn) if ready is None else ready
    scene, end = ready.scene, float(ready.times[-1])
    whole = _stepped(scene, end, most)
    checks = [Check("a restart changes nothing", _unequal(_restarted(scene, end, most), whole), 0.0)]
    if isinstance(scene.terrain, Surface):
        return [*checks, *_scaled_on_surface(scene, end, whole, most)]
    exact = isinstance(scene.points, Lattice)
    steps = most if exact else FEW_STEPS
    here = whole if exact else _stepped(scene, end, steps)
    there = _stepped(mirrored(scene), end, steps)
    if exact:
        pairs = zip(here.state, there.state, (1, 1, -1), strict=True)
        differ = float(sum((a != sign * b[::-1]).sum() for a, b, sign in pairs))
        checks.append(Check("mirrors to the last bit", differ, 0.0))
    else:
        gap = float(np.abs(here.state[0] - there.state[0]).max(initial=0.0))
        deepest = here.deepest if scene.inflows else float(scene.depth.max())
        checks.append(Check("mirrors to round-off", gap / max(deepest, 1e-300), _mirrored_within(scene)))
    if ROOTS & set(vars(scene.friction)):
        return checks
    if scene.inflows:
        # depths of discharges are found by logarithms, which no unit leaves as they are
        return [*checks, *_scaled_inflow(drawn, scene, end)]
    strong = _stepped(stronger(scene), end / np.sqrt(FACTOR), most)
    checks.append(Check("gravity scales time", _scaled(strong, whole, 1.0, np.sqrt(FACTOR)), 0.0))
    if exact:
        large = prepared(larger(drawn))
        run = _stepped(large.scene, float(large.times[-1]), most)
        checks.append(Check("length scales", _scaled(run, whole, FACTOR, np.sqrt(FACTOR)), 0.0))
    return checks


def _mirrored_within(scene: Scene) -> float:
    """Give the relative difference that mirror images on a cloud may have.

    Corners of cells are known to round-off of the domain's size, so that cells of points which nearly
    coincide are known the less the closer these are.
    """
    assert isinstance(scene.points, PointCloud)
    places = scene.points.points
    least = float(np.hypot(*(places[scene.points.nearest(2)[:, 1]] - places).T).min())
    eps = float(np.finfo(float).eps)
    return max(ROUND_OFF, STEPS_OF_ROUND_OFF * eps * float(np.ptp(places, axis=0).max()) / least)


def _scaled_on_surface(scene: Scene, end: float, whole: Run, most: int) -> list[Check]:
    """Compare a scene on a surface with itself under a stronger gravity; the raster stays."""
    if scene.inflows or scene.zones or ROOTS & set(vars(scene.friction)):
        return []
    strong = _stepped(stronger(scene), end / np.sqrt(FACTOR), most)
    return [Check("gravity scales time", _scaled(strong, whole, 1.0, np.sqrt(FACTOR)), 0.0)]


def _scaled_inflow(drawn: Drawn, scene: Scene, end: float) -> Iterator[Check]:
    """Compare a scene with an inflow under a stronger gravity and on a larger scale, to round-off.

    Points of a cloud are placed anew on a larger scale, and not all at the same places.
    """
    few = _stepped(scene, end, FIRST_STEPS)
    others = {"gravity scales time, with inflow": (_stepped(stronger(scene), end / 2.0, FIRST_STEPS), 1.0)}
    if isinstance(scene.points, Lattice):
        large = prepared(larger(drawn))
        run = _stepped(large.scene, float(large.times[-1]), FIRST_STEPS)
        others["length scales, with inflow"] = run, FACTOR
    for law, (run, length) in others.items():
        gap = float(np.abs(run.state[0] - length * few.state[0]).max(initial=0.0))
        yield Check(law, gap / max(length * few.deepest, 1e-300), ROOT_OF_ROUND_OFF)


def _stepped(scene: Scene, end: float, steps: int) -> Run:
    run = begin(scene, end, 0.0, True)
    run.advance(end, steps)
    return run


def _restarted(scene: Scene, end: float, steps: int) -> Run:
    """Step half of the way, and the rest by another run that is given what the first carried."""
    first, second = _stepped(scene, end, steps // 2), begin(scene, end, 0.0, True)
    second.restore({name: array.copy() for name, array in first.carried.items()})
    second.advance(end, steps)
    return second


def _unequal(run: Run, other: Run) -> float:
    """Count the values carried that differ; zeros have no sign in the kernels."""
    pairs = zip(run.carried.values(), other.carried.values(), strict=True)
    return float(sum(int(((a != b) & ((a == a) | (b == b))).sum()) for a, b in pairs))


def _scaled(run: Run, other: Run, length: float, speed: float) -> float:
    """Count the values of a state that are not those of another one, scaled."""
    factors = length, speed, speed
    pairs = [(a, f * b) for a, b, f in zip(run.state, other.state, factors, strict=True)]
    return float(sum((a != b).sum() for a, b in pairs))


def mirrored(scene: Scene) -> Scene:
    """Mirror a scene across the bed."""
    sides, points = scene.boundaries, scene.points
    low, high = points.y
    state = scene.depth, scene.velocity_x, -scene.velocity_y
    if isinstance(points, Lattice):
        image: Lattice | PointCloud = Lattice(points.x, (-high, -low), points.spacing)
        state = tuple(a[::-1].copy() for a in state)  # type: ignore[assignment]
    else:
        image = PointCloud(points.points * [1, -1], points.x, (-high, -low))
    depth, velocity_x, velocity_y = state
    bed = scene.erodible_bed
    if bed is not None and isinstance(points, Lattice):
        bed = replace(bed, depth=np.asarray(bed.depth)[::-1].copy())
    return replace(
        scene,
        points=image,
        depth=depth,
        velocity_x=velocity_x,
        velocity_y=velocity_y,
        boundaries=Boundaries(sides.x_min, sides.x_max, sides.y_max, sides.y_min),
        operators=None,
        erodible_bed=bed,
        # from the other end, so that the right hand of who walks along is mirrored too
        inflows=tuple(
            replace(each, line=tuple((x, -y) for x, y in reversed(each.line))) for each in scene.inflows
        ),
    )


def stronger(scene: Scene) -> Scene:
    """Put a scene under a stronger gravity, at the speeds that belong to it."""
    speed, bed = np.sqrt(FACTOR), scene.erodible_bed
    if bed is not None:
        bed = replace(bed, law=_grown(bed.law, OF_EROSION), limits=_grown(bed.limits, OF_EROSION))
    return replace(
        scene,
        gravity=FACTOR * scene.gravity,
        velocity_x=speed * scene.velocity_x,
        velocity_y=speed * scene.velocity_y,
        friction=_grown(scene.friction, OF_FRICTION),
        erodible_bed=bed,
        inflows=tuple(_faster(each, float(speed)) for each in scene.inflows),
    )


def _faster(inflow: Inflow, factor: float) -> Inflow:
    """Make an inflow faster by a factor, and as much shorter."""
    graph = inflow.hydrograph
    return replace(
        inflow,
        hydrograph=Hydrograph(graph.times / factor, graph.discharges * factor),
        speed=None if inflow.speed is None else inflow.speed * factor,
    )


def _grown(of: T, powers: Mapping[str, tuple[float, float]]) -> T:
    """Give parameters, a dataclass, under a stronger gravity."""
    grown = {
        key: float(FACTOR**power) * getattr(of, key) for key, (power, _) in powers.items() if hasattr(of, key)
    }
    return replace(of, **grown)  # type: ignore[type-var]


def larger(drawn: Drawn) -> Drawn:
    """Put a scene on a larger scale, at the speeds that belong to it."""
    data = _lengths(drawn.data)
    bed = data.get("erodible_bed", {})
    sections = (data["material"].get("friction", {}), OF_FRICTION), (bed, OF_EROSION)
    for section, powers in (*sections, (bed.get("law", {}), OF_EROSION)):
        for key in powers.keys() & section.keys():
            section[key] = float(FACTOR ** powers[key][1]) * section[key]
    for key in ("end", "output_every"):
        data["time"][key] = float(np.sqrt(FACTOR) * drawn.data["time"][key])
    points = None if drawn.points is None else FACTOR * drawn.points
    files = {name: _larger_table(text) for name, text in drawn.files.items()}
    return replace(drawn, data=data, points=points, files=files)


def _larger_table(text: str) -> str:
    """Scale all numbers of a table, below its headings."""
    headings, *lines = text.splitlines()
    scaled = (",".join(repr(FACTOR * float(value)) for value in line.split(",")) for line in lines)
    return "\n".join([headings, *scaled, ""])


def _lengths(value: Any, key: Any = "") -> Any:
    """Scale all lengths and velocities in a part of a scenario file."""
    if isinstance(value, dict):
        # the start of a hydrograph is a time
        times = {"start": "start_time"} if "peak_discharge" in value else {}
        return {name: _lengths(inner, times.get(name, name)) for name, inner in value.items()}
    if isinstance(value, list | tuple):
        return [_lengths(inner, key) for inner in value]
    if isinstance(value, bool | str):
        return value
    factor = FACTOR if key in LENGTHS else FACTOR ** POWERS.get(key, 0.0)
    return factor * value if factor != 1.0 else value
