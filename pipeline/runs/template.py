"""The template of a scenario's store, from its first run and its design."""

from __future__ import annotations

from dataclasses import replace
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from pipeline.runs.runs import Runs, expand
from pipeline.runs.scene_of_run import Prepared, build_scene, section_times
from pipeline.runs.shared_points import SharedPoints
from pipeline.runs.stored_values import profile_values
from pipeline.scenario.design import ChosenRuns, return_periods, weights
from pipeline.scenario.scenario import UNSETTLED, said
from pipeline.scenario.sweep import meaning_of
from pipeline.settings.points import LatticePoints
from pipeline.store import provenance
from pipeline.store.layout import Template, group_size, run_bytes
from pipeline.store.variables import (
    BUILDING,
    CHOSEN_FOR,
    CHOSEN_FROM,
    GROUND,
    RETURN_PERIOD,
    SECTION_COORDINATES,
    SECTIONS,
    WEIGHT,
    Variable,
    coordinates,
    grid_mapping,
    kept,
)
from solver.physics.elevation import ElevationModel
from solver.points.lattice import Lattice

if TYPE_CHECKING:
    from pipeline.scenario.scenario import Scenario

CELL_STAGES_PER_SECOND = 4e7
STAGES = 3
# cells that are wet at a time over those of the release, and the least share of all that a release has
SPREAD = 8
LEAST_WET = 0.01


def variables(scenario: Scenario) -> tuple[Variable, ...]:
    """Variables on ``run`` of a scenario's store; the profile joins them where the terrain is swept."""
    settings = scenario.settings
    cloud, erodible = not isinstance(settings.points, LatticePoints), settings.erodible_bed is not None
    sections = SECTIONS if settings.sections else ()
    surface = scenario.ground is not None
    fields = kept(list(settings.output.fields), cloud, surface, erodible)
    return (*sections, *profile(scenario), *fields)


def profile(scenario: Scenario) -> tuple[Variable, ...]:
    """Profile variables that differ between runs, with ``run`` as their first dimension."""
    on_surface = scenario.ground is not None
    changing = ("structures", "terrain.elevation") if on_surface else ("terrain",)
    if not any(key.startswith(changing) for key in scenario.settings.varied):
        return ()
    cloud = not isinstance(scenario.settings.points, LatticePoints)
    return tuple(
        replace(v, dims=("run", *v.dims))
        for v in coordinates(cloud, on_surface)
        if v.name in (GROUND if on_surface else ("elevation", "horizontal_distance"))
    )


def template(scenario: Scenario, runs: Runs, shared: SharedPoints) -> Template:
    """Lay out the store of a scenario; the first run stands for the cost of all."""
    prepared = build_scene(runs[0], shared)
    points, times = shared.points, prepared.times
    held = variables(scenario)
    if isinstance(points, Lattice):
        known = {"x": points.x_points, "y": points.y_points}
        sizes = dict(zip(("y", "x"), points.shape, strict=True))
    else:
        x, y = points.coordinates
        # on an elevation model the area on the bed takes the place of the other one
        known = {"x": x, "y": y, "area": points.cell_area, "plan_area": points.cell_area}
        sizes = {"point": len(points)}
    known |= profile_values(prepared) | {"time": times}
    sections = section_coordinates(scenario)
    frames = len(times) if any("time" in v.dims for v in held) else 1
    return Template(
        variables=held,
        coordinates=(
            *(
                (v, known[v.name])
                for v in coordinates("point" in sizes, scenario.ground is not None)
                if v.name not in {h.name for h in held}
            ),
            *built(prepared),
            *mapping(scenario),
            *sections,
            (Variable("run", ("run",), "int64", "1", "position in the design", -1), np.arange(len(runs))),
            *shares(scenario),
            *parameters(runs),
        ),
        sizes={
            "run": len(runs),
            "time": len(times),
            **sizes,
            **{variable.name: len(values) for variable, values in sections},
        },
        group=group_size(len(runs), seconds(prepared), run_bytes((frames, *points.shape))),
        attributes={**attributes(scenario), "threshold": prepared.threshold},
    )


def seconds(prepared: Prepared) -> float:
    """Rough time of a run, s: only good to choose how many runs share a task."""
    scene = prepared.scene
    elevation = profile_values(prepared)["elevation"]
    fall = float(np.nanmax(elevation) - np.nanmin(elevation)) + float(prepared.origin.max())
    speed = float(np.sqrt(2 * scene.gravity * fall))
    steps = prepared.times[-1] * speed / (scene.scheme.cfl * float(np.sqrt(np.min(scene.points.cell_area))))
    return float(STAGES * steps * scene.depth.size / CELL_STAGES_PER_SECOND)


def likely_seconds(prepared: Prepared) -> float:
    """Rough processor time of a run, s, that spreads over some times as many cells as it begins in.

    Runs that come to rest before their end take a tenth of it or less, those on clouds several times as much.
    """
    depth = prepared.scene.depth
    share = SPREAD * max(float((depth > 0).mean()), LEAST_WET)
    return seconds(prepared) * min(share, 1.0)


def mapping(scenario: Scenario) -> list[tuple[Variable, NDArray[Any]]]:
    """Give the reference system of a scenario on an elevation model, as the CF conventions say it."""
    if scenario.ground is None:
        return []
    from pipeline.inputs.reference_system import cf_attributes

    return [(grid_mapping(cf_attributes(scenario.ground.crs)), np.array(0))]


def built(prepared: Prepared) -> list[tuple[Variable, NDArray[Any]]]:
    """Give the cells of buildings, where there are."""
    buildings, on_surface = prepared.scene.buildings, isinstance(prepared.terrain, ElevationModel)
    if buildings is None:
        return []
    variable = BUILDING.on_surface() if on_surface else BUILDING
    if not isinstance(prepared.scene.points, Lattice):
        variable = variable.on_cloud()
    return [(variable, buildings.astype(np.int8))]


def section_coordinates(scenario: Scenario) -> list[tuple[Variable, NDArray[Any]]]:
    """Give the names of a scenario's sections and the times of samples at them; nothing without any."""
    settings = scenario.settings
    if not settings.sections:
        return []
    names = np.array([each.name for each in settings.sections], object)
    return list(zip(SECTION_COORDINATES, (names, section_times(settings)), strict=True))


def shares(scenario: Scenario) -> list[tuple[Variable, NDArray[Any]]]:
    """Give weights and return periods as coordinates on ``run``, which may change without its values."""
    if scenario.chosen is not None:
        # which count in no share
        return [(WEIGHT, np.zeros(len(expand(scenario))))]
    periods = return_periods(scenario.settings)
    return [
        (WEIGHT, weights(scenario.settings)),
        *([] if periods is None else [(RETURN_PERIOD, periods)]),
    ]


def parameters(runs: Runs) -> list[tuple[Variable, NDArray[Any]]]:
    """Varied parameters as coordinates on ``run``; those that are not all numbers as strings."""
    found: list[tuple[Variable, NDArray[Any]]] = []
    first, swept = runs[0], [runs.parameters(i) for i in range(len(runs))]
    for key, name in zip(runs.design.keys, first.parameters, strict=True):
        values = [each[name] for each in swept]
        numeric = all(isinstance(v, int | float) and not isinstance(v, bool) for v in values)
        unit, description = meaning_of(key, first.settings)
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


def chosen_attributes(chosen: ChosenRuns) -> dict[str, str]:
    """Attributes of a store of chosen runs: what they were chosen for, and from what."""
    return {CHOSEN_FOR: chosen.target, CHOSEN_FROM: chosen.origin}


def attributes(scenario: Scenario) -> dict[str, str]:
    """Attributes of the store: what was asked for, and by what it was made."""
    return {
        "Conventions": "CF-1.12",
        "title": scenario.name,
        **said(scenario),
        "scenario_content": scenario.content,
        "scenario_hash": scenario.digest,
        "domain": scenario.settings.bounds.model_dump_json(),
        **({UNSETTLED: str(scenario.unsettled)} if scenario.unsettled else {}),
        **({} if scenario.chosen is None else chosen_attributes(scenario.chosen)),
        **({} if scenario.ground is None else {"crs": scenario.ground.crs}),
        **provenance.made_by(),
    }
