"""What the schema allows but is hardly meant: values of another unit, reversed orders, outputs left out."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from itertools import pairwise
from math import hypot, prod
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from pipeline.scenario import solver_objects
from pipeline.scenario.design import share_within
from pipeline.scenario.strict_yaml import Path
from pipeline.settings.sample import power_of_two
from pipeline.settings.section import declared
from pipeline.settings.settings import MATERIAL_DENSITY, Settings
from pipeline.settings.surface import PolygonsRelease
from pipeline.store.variables import ERODED
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

FOR_RECEPTORS = ("max_depth", "max_speed", "arrival_time")
FOR_MAPS = frozenset(("max_depth", "max_speed", "max_momentum_flux"))
# of a distribution that bounds cut off
LEAST_SHARE = 1e-4
# of a level
FEW_POINTS = 50
# of a cell
SHORT = 0.5


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
    yield from _slopes(settings.terrain)
    yield from _angles(material, ("material",))
    if material.friction is not None:
        yield from _angles(material.friction, of_law)
    yield from _unusual(solver_objects.laws(settings)[0], of_law)
    bed = settings.erodible_bed
    laws = *material.zone_laws(), *(() if bed is None else bed.zone_laws(material.density))
    for (place, zone), law in zip(settings.all_zones, laws, strict=True):
        yield from _angles(zone, place)
        # what is not its own is told of the material
        told = _unusual(law, place)
        yield from ((path, why) for path, why in told if getattr(zone, str(path[-1]), None) is not None)
    if bed is not None:
        yield from _angles(bed.law, ("erodible_bed", "law"))
        yield from _unusual(bed.erosion_law(material.density), ("erodible_bed", "law"))
        if not isinstance(bed.depth, str):
            yield from _far(bed.depth, ERODIBLE, "m", ("erodible_bed", "depth"))
    for i, inflow in enumerate(settings.inflow):
        for name, (unit, usual) in INFLOW.items():
            yield from _far(getattr(inflow, name), usual, unit, ("inflow", i, name))
    for i, structure in enumerate(settings.structures):
        if structure.kind != "building":
            yield from _angles(structure, ("structures", i))
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
    for name, angles in _degrees(section):
        told = ", ".join(f"{angle:g}" for angle in angles)
        if name == "bed_friction" and 0 < max(angles) < LEAST_ANGLE:
            yield (
                (*place, name),
                f"{told} degrees are nearly none; mu = {told} is written as friction_coefficient",
            )
        elif name != "bed_friction" and 0 < max(angles) < RADIANS:
            yield (*place, name), f"{told} degrees are nearly none: write degrees, no radians"
    coefficient = getattr(section, "friction_coefficient", None)
    if coefficient is not None and coefficient > LARGEST_COEFFICIENT:
        told = f"{coefficient:g} is far from what is usual, up to {LARGEST_COEFFICIENT:g}"
        yield (*place, "friction_coefficient"), f"{told}: degrees are written as bed_friction"


def _degrees(section: Any) -> Iterator[tuple[str, tuple[float, ...]]]:
    """List the angles of a section, each with its key."""
    for name in type(section).model_fields:
        held = getattr(section, name)
        if held is not None and declared(section, name, "unit") == "degrees":
            yield name, held if isinstance(held, tuple) else (held,)


def _slopes(terrain: Any) -> Iterator[tuple[Path, str]]:
    """Say that the slopes of a profile are rather radians; one of several may well be nearly level."""
    held: list[tuple[Path, Any]] = [(("terrain",), terrain)]
    held += [(("terrain", "segments", i), each) for i, each in enumerate(getattr(terrain, "segments", ()))]
    found = [((*at, name), angles[0]) for at, section in held for name, angles in _degrees(section)]
    if found and 0 < max(angle for _, angle in found) < RADIANS:
        told = ", ".join(f"{angle:g}" for _, angle in found)
        yield found[0][0], f"{told} degrees are nearly level: write degrees, no radians"


def _unusual(held: Any, place: Path, source: type | None = None) -> Iterator[tuple[Path, str]]:
    """Look through the parameters of a law, or of a section of a ``source``."""
    for each, known in parameters(source or type(held)):
        if known.usual is not None:
            name = known.key or each.name
            path: Path = ("material", name) if name == "density" else (*place, name)
            yield from _far(getattr(held, each.name), known.usual, known.unit, path)


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


def doubtful(settings: Settings) -> list[tuple[Path, str]]:
    """List what holds for all runs and is hardly meant: outputs, densities, sections and designs."""
    return [
        *_left_out(settings),
        *_densities(settings),
        *_odd_sections(settings),
        *_far_out(settings),
        *_uneven(settings),
        *_weak_levels(settings),
        *reversed_periods(settings),
    ]


def _left_out(settings: Settings) -> list[tuple[Path, str]]:
    """Say what ``output.fields`` leaves out that receptors, maps or a calibration need."""
    kept, path = set(settings.output.fields), ("output", "fields")
    found: list[tuple[Path, str]] = []
    needed = [name for name in FOR_RECEPTORS if name not in kept]
    if settings.places and needed:
        found.append((path, f"leaves out {', '.join(needed)}, without which receptors have no results"))
    if settings.places and settings.erodible_bed is not None and not kept & {*ERODED}:
        told = f"leaves out {' and '.join(ERODED)}: receptors will not say what is eroded there"
        found.append((path, told))
    asked = settings.hazard.model_fields_set
    mapped = {"depth": "max_depth", "speed": "max_speed", "pressure": "max_speed"}
    mapped |= {"momentum_flux": "max_momentum_flux", "intensity": "max_depth"}
    if settings.erodible_bed is not None:
        mapped["erosion_depth"] = "erosion_depth"
    elif "erosion_depth" in asked and settings.hazard.erosion_depth:
        told = "nothing is eroded without an erodible_bed, so that there are no such maps"
        found.append((("hazard", "erosion_depth"), told))
    wanted = dict.fromkeys(mapped[name] for name in mapped if name in asked)
    needed = [name for name in wanted if name not in kept]
    if needed:
        found.append((path, f"leaves out {', '.join(needed)}, which the maps asked for under hazard need"))
    if "deposit_depth" not in kept:
        found.append((path, "leaves out deposit_depth, which a calibration needs"))
    if not kept & FOR_MAPS:
        found.append((path, "leaves out all maxima, so that there is nothing to map"))
    return found


def _odd_sections(settings: Settings) -> list[tuple[Path, str]]:
    """Say which sections or samples at them are hardly meant."""
    found: list[tuple[Path, str]] = []
    lines = [(("inflow", i, "section"), each.section) for i, each in enumerate(settings.inflow)]
    for i, (path, line) in enumerate(lines):
        for other, before in lines[:i]:
            if line in (before, before[::-1]):
                found.append((path, f"the line is that of inflow.{other[1]} too: both come in there"))
    lines += [(("sections", i, "line"), each.line) for i, each in enumerate(settings.sections)]
    spacing = getattr(settings.points, "spacing", None)
    for path, line in lines:
        length = sum(hypot(x1 - x0, y1 - y0) for (x0, y0), (x1, y1) in pairwise(line))
        if spacing is not None and length < spacing * SHORT:
            told = f"{length:.3g} m are less than {SHORT:g} of a cell, {spacing:g} m"
            found.append((path, f"{told}: the section is as wide as the cells that it parts"))
    every, end = settings.output.section_every, settings.time.end
    if every is not None and end is not None and every > end and settings.sections:
        found.append((("output", "section_every"), f"{every:g} s are longer than the run, {end:g} s"))
    return found


def _densities(settings: Settings) -> list[tuple[Path, str]]:
    """Say where pressures are of another density than the flow."""
    asked, own = settings.hazard.density, getattr(settings.material, "density")  # noqa: B009
    if asked is None:
        return []
    said = f"pressures are computed with {asked:g} kg m-3 in all runs"
    if MATERIAL_DENSITY in settings.varied:
        other = f"{MATERIAL_DENSITY} differs between the runs"
    elif own is not None and own != asked:
        other = f"{MATERIAL_DENSITY} is {own:g}"
    else:
        return []
    return [(("hazard", "density"), f"{said}, but {other}: leave it out for the density of each run")]


def _far_out(settings: Settings) -> list[tuple[Path, str]]:
    """Say which distributions are cut off so that next to nothing of them is left."""
    values = {} if settings.sample is None else settings.sample.values
    return [
        (
            ("sample", "values", key),
            f"its bounds hold {share:.2g} of the distribution: check mean, deviation and bounds",
        )
        for key, distribution in values.items()
        if (share := share_within(distribution)) < LEAST_SHARE
    ]


def _uneven(settings: Settings) -> list[tuple[Path, str]]:
    """Say where Sobol's sequence is broken off between two of its balanced counts."""
    sample = settings.sample
    if sample is None or sample.design != "sobol":
        return []
    at: list[tuple[Path, int]] = [(("sample", "count"), sample.count)]
    if sample.levels:
        # shares are of the widest spacing; closer ones are compared with it run by run
        at = [(("sample", "levels", 0, "count"), sample.levels[0].count)]
    # which levels do not take
    other = "" if sample.levels else ", or design: latin-hypercube"
    found = []
    for path, count in at:
        if not power_of_two(count):
            below = 1 << (count.bit_length() - 1)
            even = f"Sobol's sequence covers the space evenly at powers of 2: write {below} or {2 * below}"
            found.append((path, even + other))
    return found


def _weak_levels(settings: Settings) -> list[tuple[Path, str]]:
    """Say which levels are too few runs for `pipeline emulate`, or too few points for anything."""
    if settings.sample is None or not settings.sample.levels or settings.domain is None:
        return []
    # which imports SciPy
    from solver.emulator import support

    found: list[tuple[Path, str]] = []
    entries, inputs = prod(map(len, settings.sweep.values())), len(settings.varied)
    (x0, x1), (y0, y1) = settings.domain.x, settings.domain.y
    for i, level in enumerate(settings.sample.levels):
        path: Path = ("sample", "levels", i)
        few = (
            support.of_pairs(entries * level.count)[1]
            if i
            else support.of_runs(entries * level.count, inputs)
        )
        if few:
            found.append(((*path, "count"), f"`pipeline emulate` will say: {few}"))
        points = settings.points.model_copy(update={"spacing": level.spacing}).estimate(x1 - x0, y1 - y0)
        if points < FEW_POINTS:
            told = f"a spacing of {level.spacing:g} m gives about {points:.0f} points, which tell nothing"
            found.append(((*path, "spacing"), f"{told}: take a smaller one"))
    return found
