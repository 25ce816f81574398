"""Values that the schema allows but that are hardly meant: of another unit, or in reversed order."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from itertools import pairwise
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from pipeline.scenario import solver_objects
from pipeline.scenario.strict_yaml import Path
from pipeline.settings.settings import Settings
from pipeline.settings.surface import PolygonsRelease
from solver.parameters import parameters

# keys of which a larger value is a larger event
SIZES = ("volume", "depth", "height", "radius", "peak_discharge")
# angles below which a coefficient or radians are meant, degrees, and what is rather an angle
LEAST_ANGLE, RADIANS, LARGEST_COEFFICIENT = 1.0, 1.6, 1.5
# depths, m, and discharges, m3 s-1, of nature and laboratories
ERODIBLE, PEAK = (1e-3, 20.0), (1e-6, 2e5)
INFLOW = {"froude": ("", (0.1, 10.0)), "speed": ("m s-1", (0.01, 50.0)), "depth": ("m", (1e-4, 50.0))}

# no release is deeper, m
DEEP = 100.0


def unusual(settings: Settings) -> Iterator[tuple[Path, str]]:
    """List values that are far from what is known of them, or of another unit, each with its path."""
    for i, release in enumerate(settings.releases):
        if not isinstance(release, PolygonsRelease):
            made = release.make()
            scale = 1.0 if made.volume is None else made.volume / made.shape_volume
            if made.height * scale > DEEP:
                yield (
                    ("release", i) if isinstance(settings.release, tuple) else ("release",),
                    too_deep(made.height * scale),
                )
    material: Any = settings.material
    of_law: Path = ("material",) if material.friction is None else ("material", "friction")
    yield from _angles(material, ("material",))
    if material.friction is not None:
        yield from _angles(material.friction, of_law)
    yield from _unusual(solver_objects.laws(settings)[0], of_law)
    for i, (zone, law) in enumerate(zip(settings.zones, material.zone_laws(), strict=True)):
        place: Path = ("material", "zones", i)
        yield from _angles(zone, place)
        # what is not its own is told of the material
        told = _unusual(law, place)
        yield from ((path, why) for path, why in told if getattr(zone, str(path[-1]), None) is not None)
    bed = settings.erodible_bed
    if bed is not None:
        yield from _unusual(bed.erosion_law(material.density), ("erodible_bed", "law"))
        if not isinstance(bed.depth, str):
            yield from _far(bed.depth, ERODIBLE, "m", ("erodible_bed", "depth"))
    for i, inflow in enumerate(settings.inflow):
        for name, (unit, usual) in INFLOW.items():
            yield from _far(getattr(inflow, name), usual, unit, ("inflow", i, name))
    for i, structure in enumerate(settings.structures):
        if structure.kind != "building":
            yield from _unusual(structure, ("structures", i), structure.source)


def too_deep(depth: float) -> str:
    """Say that a depth of a release, m, is far from what is usual."""
    return f"a depth of {depth:.3g} m is far from what is usual, {DEEP:g} m at most: check the unit"


def of_hydrograph(peak: float, path: Path) -> Iterator[tuple[Path, str]]:
    """Say of the peak of a hydrograph, m3 s-1, that it is of another unit."""
    yield from _far(peak, PEAK, "m3 s-1", path)


def of_depths(depths: ArrayLike) -> Iterator[tuple[Path, str]]:
    """Say of a raster of erodible depths, m, that it holds elevations or another unit."""
    held = np.asarray(depths, np.float64)
    found = held[np.isfinite(held) & (held > 0)]
    middle = float(np.median(found)) if found.size else 0.0
    if middle > ERODIBLE[1]:
        told = f"half of the depths are above {middle:.4g} m, where up to {ERODIBLE[1]:g} m are usual"
        yield ("erodible_bed", "depth"), f"{told}: depths below the bed are meant, no elevations"


def _angles(section: Any, place: Path) -> Iterator[tuple[Path, str]]:
    """Say which angles are rather coefficients or radians, and which coefficients are rather angles."""
    for name in ("bed_friction", "internal_friction"):
        angle = getattr(section, name, None)
        if angle is not None and 0 < angle < LEAST_ANGLE:
            told = f"{angle:g} degrees are nearly none; mu = {angle:g} is written as friction_coefficient"
            yield (*place, name), told
    several = getattr(section, "angles", None)
    if several is not None and max(several) < RADIANS:
        told = ", ".join(f"{angle:g}" for angle in several)
        yield (*place, "angles"), f"{told} degrees are nearly none: write degrees, no radians"
    coefficient = getattr(section, "friction_coefficient", None)
    if coefficient is not None and coefficient > LARGEST_COEFFICIENT:
        told = f"{coefficient:g} is far from what is usual, up to {LARGEST_COEFFICIENT:g}"
        yield (*place, "friction_coefficient"), f"{told}: degrees are written as bed_friction"


def _unusual(held: Any, place: Path, source: type | None = None) -> Iterator[tuple[Path, str]]:
    """Look through the parameters of a law, or of a section of a ``source``."""
    for each, declared in parameters(source or type(held)):
        if declared.usual is not None:
            name = declared.key or each.name
            path: Path = ("material", name) if name == "density" else (*place, name)
            yield from _far(getattr(held, each.name), declared.usual, declared.unit, path)


def _far(value: Any, usual: tuple[float, float], unit: str, path: Path) -> Iterator[tuple[Path, str]]:
    """Say that a number is far from what is usual; words and what is 0 or left out are not."""
    if not value or isinstance(value, str) or usual[0] <= value <= usual[1]:
        return
    low, high = (f"{bound:g}" for bound in usual)
    unit = f" {unit}" if unit else ""
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
