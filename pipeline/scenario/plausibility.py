"""Values that the schema allows but that are hardly meant: of another unit, or in reversed order."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from itertools import pairwise
from typing import Any

from pipeline.scenario import solver_objects
from pipeline.scenario.strict_yaml import Path
from pipeline.settings.settings import Settings
from solver.parameters import parameters

# keys of which a larger value is a larger event
SIZES = ("volume", "depth", "height", "radius", "peak_discharge")


def unusual(settings: Settings) -> Iterator[tuple[Path, str]]:
    """List parameters of friction and erosion that are far from what is known of them, each with its path."""
    material = settings.material
    friction = getattr(material, "friction")  # noqa: B009
    of_law: Path = ("material",) if friction is None else ("material", "friction")
    yield from _unusual(solver_objects.laws(settings)[0], of_law)
    if settings.erodible_bed is not None:
        density = getattr(material, "density")  # noqa: B009
        yield from _unusual(settings.erodible_bed.erosion_law(density), ("erodible_bed", "law"))


def _unusual(law: Any, place: Path) -> Iterator[tuple[Path, str]]:
    for each, declared in parameters(type(law)):
        value = getattr(law, each.name)
        if declared.usual is None or not value or declared.usual[0] <= value <= declared.usual[1]:
            continue
        name = declared.key or each.name
        path: Path = ("material", name) if name == "density" else (*place, name)
        low, high = (f"{bound:g}" for bound in declared.usual)
        unit = f" {declared.unit}" if declared.unit else ""
        yield path, f"{value:g}{unit} is far from what is usual, {low} to {high}{unit}: check the unit"


def reversed_periods(settings: Settings) -> Iterator[tuple[Path, str]]:
    """List swept sizes of events of which the larger ones are said to come more often."""
    periods, sweep = settings.return_periods, settings.sweep or {}
    if not isinstance(periods, Mapping):
        return
    for key, years in periods.items():
        values = [float(value) for value in sweep.get(key, ()) if isinstance(value, int | float)]
        if key.rpartition(".")[2] not in SIZES or len(values) != len(years):
            continue
        ordered = sorted(zip(values, years, strict=True))
        for (small, often), (large, seldom) in pairwise(ordered):
            if small < large and often > seldom:
                told = f"the larger event, {large:g}, has the shorter return period, {seldom:g} years"
                yield ("return_periods", key), f"{told} in place of more than {often:g}: check their order"
                break
