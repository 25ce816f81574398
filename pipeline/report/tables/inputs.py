"""What a scenario says, and by which method it was computed, for people."""

from __future__ import annotations

import json
from collections.abc import Iterator
from typing import Any

import xarray as xr
from pydantic import BaseModel

from pipeline.readable import with_unit
from pipeline.report.tables.table import Table
from pipeline.scenario.scenario import Settings, stored
from pipeline.settings.section import declared
from pipeline.settings.surface import ElevationTerrain
from solver.scheme import Collocation

# said elsewhere on the page, or of no meaning for it
LEFT_OUT = {"name", "description", "receptors", "hazard", "report", "sample", "sweep", "weights"}
MOST_VALUES = 12
MODEL = (
    "The flow is a layer of one material, described by its depth and its velocity along the bed, averaged "
    "over the depth (the extended Savage-Hutter equations). They are solved by the local moving least "
    "squares (LMLS) method of Cigáň and Mužík"
)
CONSERVATIVE = f"{MODEL} in conservative form. Volume is kept to round-off, as the volume table shows."
COLLOCATION = f"{MODEL} in its collocation form, which keeps volume only nearly: see the volume table."
LIMITS = (
    "What the inputs do not name is not modelled. The maps say what the model gives for these inputs. They "
    "do not say how good the model is at this place. Friction decides the run-out, and its parameters cannot "
    "be measured in the ground: compare them with observed events nearby before the results are used.",
    "A share of runs is a probability only as far as the sampled parameters are what an event may have. The "
    "largest depth and the largest speed at a place need not be of one moment. Loads on a building depend on "
    "its shape, which is not part of the pressure given here. What is narrower than about four cells, as a "
    "small channel, is not resolved.",
)


def inputs(store: xr.Dataset) -> Table:
    """Table what the scenario gives, with units and meaning; what it leaves to defaults is left out."""
    settings = stored(store.attrs)
    rows = [row for row in _given(settings, ()) if row[0].split(".")[0] not in LEFT_OUT]
    rows += _found(settings, store)
    rows += _varied(settings)
    note = "Keys are those of the scenario file; what is not listed has its default."
    return Table("Inputs", ["key", "value", "what it is"], rows, note)


def _given(section: BaseModel, path: tuple[str, ...]) -> Iterator[list[str]]:
    """Go through the keys that were given, those of sections within after their own path."""
    for name in type(section).model_fields:
        value = getattr(section, name)
        if name not in section.model_fields_set or value is None:
            continue
        place = (*path, name)
        if isinstance(value, BaseModel):
            yield from _given(value, place)
        elif isinstance(value, tuple) and value and isinstance(value[0], BaseModel):
            for i, each in enumerate(value):
                yield from _given(each, (*place, str(i)))
        else:
            meaning = declared(section, name, "description").split(". Default:")[0].replace("`", "")
            # a file or a word may stand for a number
            unit = declared(section, name, "unit") if _has_numbers(value) else ""
            yield [".".join(place), with_unit(_shown(value), unit), meaning]


def _found(settings: Settings, store: xr.Dataset) -> Iterator[list[str]]:
    """Give what was left out on an elevation model and found for it: the domain and the reference system."""
    if not isinstance(settings.terrain, ElevationTerrain):
        return
    if settings.domain is None and "domain" in store.attrs:
        for axis, sides in json.loads(store.attrs["domain"]).items():
            yield [f"domain.{axis}", f"{_shown(sides)} m", "left out: found by where the flow goes"]
    if settings.terrain.crs is None and "crs" in store.attrs:
        yield ["terrain.crs", str(store.attrs["crs"]), "left out: that of the elevation model"]


def _has_numbers(value: Any) -> bool:
    if isinstance(value, dict):
        return any(map(_has_numbers, value.values()))
    if isinstance(value, tuple | list):
        return any(map(_has_numbers, value))
    return isinstance(value, int | float) and not isinstance(value, bool)


def _shown(value: Any) -> str:
    """Write what was given with all its digits, and corners as pairs."""
    if isinstance(value, dict):
        return "; ".join(f"{name}: {_shown(inner)}" for name, inner in value.items())
    if isinstance(value, tuple | list):
        more = f" and {len(value) - MOST_VALUES} more" if len(value) > MOST_VALUES else ""
        return ", ".join(map(_one_of, value[:MOST_VALUES])) + more
    return f"{value:,.12g}" if isinstance(value, float) else str(value)


def _one_of(value: Any) -> str:
    if isinstance(value, tuple | list):
        return f"({_shown(value)})"
    # a comma is between numbers
    return f"{value:.12g}" if isinstance(value, float) else _shown(value)


def _varied(settings: Settings) -> Iterator[list[str]]:
    """Say what differs between the runs."""
    for name, values in settings.sweep.items():
        yield [name, _shown(values), "each of these values (sweep)"]
    if settings.sample is None:
        return
    for name, law in settings.sample.values.items():
        given = law.model_dump(exclude={"distribution"}, exclude_none=True)
        words = ", ".join(f"{part} {_shown(value)}" for part, value in given.items())
        yield [name, f"{law.distribution}: {words}", "drawn at random (sample)"]
    sample = settings.sample
    yield ["sample", f"{sample.count} draws, {sample.design}, seed {sample.seed}", "how they are drawn"]
    for each in sample.correlations:
        yield ["correlation", f"{each.value:g}", f"between {' and '.join(each.between)}"]


def method(store: xr.Dataset) -> list[str]:
    """Say in sentences how the runs were computed and what that leaves out."""
    settings = stored(store.attrs)
    spacing = getattr(settings.points, "spacing", None)
    points = (
        f"{store.sizes['point']:,} points"
        if "point" in store.dims
        else (f"{store.sizes['x']:,} x {store.sizes['y']:,} points")
    )
    every = f" of {spacing:g} m spacing" if spacing is not None else ""
    bed = "an elevation model" if settings.on_surface else "a slope profile, the same across it"
    here = f"Here the bed is {bed}, with {points}{every}. {settings.run_count:,} runs were planned."
    sources = dict.fromkeys((settings.hazard.intensity.source, settings.hazard.levels.source))
    model = COLLOCATION if settings.scheme.source is Collocation else CONSERVATIVE
    return [model, here, *LIMITS, f"Classes of intensity and levels are after {'; '.join(sources)}."]
