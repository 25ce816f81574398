"""The template of a scenario's store, from its first run and its sweep."""

from __future__ import annotations

import platform
from collections.abc import Sequence
from importlib.metadata import version
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray
from pydantic import BaseModel

from pipeline.layout import Template, group_size, run_bytes
from pipeline.runs import Prepared, Run, build_scene
from pipeline.variables import COORDINATES, Variable, kept

if TYPE_CHECKING:
    from pipeline.scenario import Scenario

CELL_STAGES_PER_SECOND = 4e7
STAGES = 3
PACKAGES = ("lmls", "numpy", "numba", "xarray", "zarr")


def variables(scenario: Scenario) -> tuple[Variable, ...]:
    """Variables on ``run`` of a scenario's store; the profile joins them where the terrain is swept."""
    return (*profile(scenario), *kept(list(scenario.settings.output.fields)))


def profile(scenario: Scenario) -> tuple[Variable, ...]:
    """Profile variables that differ between runs, with ``run`` as their first dimension."""
    if not any(key.split(".")[0] == "terrain" for key in scenario.settings.sweep):
        return ()
    return tuple(
        Variable(v.name, ("run", *v.dims), v.dtype, v.units, v.long_name, v.fill, v.attributes)
        for v in COORDINATES
        if v.name in ("elevation", "horizontal_distance")
    )


def template(scenario: Scenario, runs: Sequence[Run]) -> Template:
    """Lay out the store of a scenario; the first run stands for the lattice and the cost of all."""
    prepared = build_scene(runs[0])
    lattice, times = prepared.scene.points, prepared.times
    held = variables(scenario)
    known = profile_values(prepared) | {"time": times, "x": lattice.x_points, "y": lattice.y_points}
    ny, nx = lattice.shape
    frames = len(times) if any("time" in v.dims for v in held) else 1
    return Template(
        variables=held,
        coordinates=(
            *((v, known[v.name]) for v in COORDINATES if v.name not in {h.name for h in held}),
            (Variable("run", ("run",), "int64", "1", "position in the sweep", -1), np.arange(len(runs))),
            *parameters(scenario, runs),
        ),
        sizes={"run": len(runs), "time": len(times), "y": ny, "x": nx},
        group=group_size(len(runs), seconds(prepared), run_bytes((frames, ny, nx))),
        attributes=attributes(scenario),
    )


def profile_values(prepared: Prepared) -> dict[str, NDArray[np.float64]]:
    """Elevation and horizontal distance at the lattice's points along the bed, shape (nx,), m."""
    x = prepared.scene.points.x_points
    return {
        "elevation": prepared.terrain.elevation(x),
        "horizontal_distance": prepared.terrain.horizontal_distance(x),
    }


def seconds(prepared: Prepared) -> float:
    """Rough time of a run, s: only good to choose how many runs share a task."""
    scene = prepared.scene
    fall = float(np.ptp(profile_values(prepared)["elevation"])) + float(scene.depth.max())
    speed = float(np.sqrt(2 * scene.gravity * fall))
    steps = prepared.times[-1] * speed / (scene.scheme.cfl * min(scene.points.dx, scene.points.dy))
    return float(STAGES * steps * scene.depth.size / CELL_STAGES_PER_SECOND)


def parameters(scenario: Scenario, runs: Sequence[Run]) -> list[tuple[Variable, NDArray[Any]]]:
    """Swept parameters as coordinates on ``run``; those that are not all numbers as strings."""
    found: list[tuple[Variable, NDArray[Any]]] = []
    for key, name in zip(scenario.settings.sweep, runs[0].parameters, strict=True):
        values = [run.parameters[name] for run in runs]
        numeric = all(isinstance(v, int | float) and not isinstance(v, bool) for v in values)
        unit, description = _meaning(runs[0], key)
        array = np.array(values, np.float64) if numeric else np.array([str(v) for v in values], object)
        found.append(
            (
                Variable(
                    name,
                    ("run",),
                    "float64" if numeric else "string",
                    (unit or "1") if numeric else "",
                    description or key,
                    float("nan") if numeric else "",
                    {"key": key},
                ),
                array,
            )
        )
    return found


def _meaning(run: Run, key: str) -> tuple[str, str]:
    """Give unit and description of a key, from the declaration of the last field on its way."""
    at: Any = run.settings
    for part in key.split("."):
        if isinstance(at, BaseModel):
            info = type(at).model_fields[part]
            at = getattr(at, part)
        else:
            at = at[int(part)]
    extra = info.json_schema_extra if isinstance(info.json_schema_extra, dict) else {}
    return str(extra.get("unit", "")), info.description or ""


def attributes(scenario: Scenario) -> dict[str, str]:
    """Attributes of the store: what was asked for, and by what it was made."""
    return {
        "Conventions": "CF-1.12",
        "title": scenario.name,
        "comment": scenario.settings.description,
        "scenario": scenario.text,
        "scenario_content": scenario.content,
        "scenario_hash": scenario.digest,
        "python_version": platform.python_version(),
        **{f"{name}_version": version(name) for name in PACKAGES},
    }
