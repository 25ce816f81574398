"""Places on the map and on the bed: receptors and releases, and what a domain has to hold."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from functools import lru_cache
from itertools import pairwise
from math import isfinite

import numpy as np
from numpy.typing import NDArray

from pipeline.hints import of_exchanged, of_place
from pipeline.inputs.elevation_raster import ElevationRaster, RasterExtent
from pipeline.inputs.ground import clipped
from pipeline.inputs.polygons import crossing, reaches
from pipeline.inputs.reference_system import called, doubt
from pipeline.mistakes import Problem
from pipeline.scenario import solver_objects, structures
from pipeline.scenario.solver_objects import Outlines
from pipeline.scenario.strict_yaml import Path
from pipeline.settings.hazard import Georeference
from pipeline.settings.points import GradedPoints, Refine, Region
from pipeline.settings.receptor import Receptor
from pipeline.settings.section import Pair
from pipeline.settings.settings import Domain, Settings
from pipeline.settings.structures import PLACE, place_of
from pipeline.settings.surface import PolygonsRelease
from solver.physics.terrain import SlopeProfile
from solver.release.shapes import Release

Array = NDArray[np.float64]

SIMPLE = "expected corners of a simple polygon"
OUTSIDE = "expected a zone in the domain, found one outside, which changes nothing"

# cells around what a scenario has to hold that are looked at as long as its domain is not known
CELLS_AROUND = 10
# that one line lists
MOST_NAMES = 5
# halvings of an interval that leave nothing but round-off
_HALVINGS = 100
# digits of places on the bed, m: the same scenario on another machine has the same ones
_DIGITS = 6


def on_bed(georeference: Georeference, slope: SlopeProfile, places: Sequence[Pair]) -> tuple[Pair, ...]:
    """Give x (arc length) and y of places on the map, m.

    Parameters
    ----------
    georeference : Georeference
        Where the profile lies on the map.
    slope : SlopeProfile
        The profile.
    places : sequence of (easting, northing)
        m.
    """
    azimuth = np.radians(georeference.azimuth)
    along = np.array([np.sin(azimuth), np.cos(azimuth)])
    offsets = np.array(places, np.float64).reshape(-1, 2) - georeference.origin
    x = arc_length(slope, offsets @ along)
    y = offsets @ np.array([-along[1], along[0]])
    return tuple((round(float(a), _DIGITS), round(float(b), _DIGITS)) for a, b in zip(x, y, strict=True))


def arc_length(slope: SlopeProfile, distance: Array) -> Array:
    """Give the arc length at which a profile has horizontal distances, same shape, m."""
    low, high = np.full(distance.shape, -1.0), np.full(distance.shape, 1.0)
    while (short := slope.horizontal_distance(low) > distance).any():
        low[short] *= 2
    while (short := slope.horizontal_distance(high) < distance).any():
        high[short] *= 2
    for _ in range(_HALVINGS):
        middle = (low + high) / 2
        before = slope.horizontal_distance(middle) < distance
        low, high = np.where(before, middle, low), np.where(before, high, middle)
    return np.asarray((low + high) / 2)


def receptors_on_bed(settings: Settings, slope: SlopeProfile) -> tuple[Receptor, ...]:
    """Give the receptors of a scenario in coordinates of the bed, in whichever they were written."""
    ground = settings.georeference
    if ground is None or ground.receptors == "bed":
        return settings.places
    found = []
    for each in settings.places:
        places = on_bed(ground, slope, each.corners)
        if each.point is not None:
            found.append(each.model_copy(update={"point": places[0]}))
        else:
            kind = "line" if each.line is not None else "polygon"
            found.append(each.model_copy(update={kind: places}))
    return tuple(found)


def follows_receptors(settings: Settings) -> bool:
    """Whether points are to stand closer around receptors that are named."""
    points = settings.points
    return isinstance(points, GradedPoints) and any(each.receptor is not None for each in points.refine)


def refined_at(receptors: Sequence[Receptor], settings: Settings) -> Settings:
    """Give settings whose points stand closer in regions and along lines where those name receptors."""
    if not isinstance(settings.points, GradedPoints):
        return settings
    known = {each.name: each for each in receptors}
    refine = tuple(
        _around(known[each.receptor], each) if each.receptor in known else each
        for each in settings.points.refine
    )
    if refine == settings.points.refine:
        return settings
    return settings.model_copy(update={"points": settings.points.model_copy(update={"refine": refine})})


def _around(receptor: Receptor, refine: Refine) -> Refine:
    """Give the line or the rectangle around the receptor that a refinement names."""
    if receptor.line is not None:
        return Refine(line=receptor.line, margin=refine.margin, spacing=refine.spacing)
    # bounds increase, also around a point without a margin
    reach = max(refine.margin, refine.spacing / 2)
    x, y = ((min(each) - reach, max(each) + reach) for each in zip(*receptor.corners, strict=True))
    return Refine(region=Region(x=x, y=y), spacing=refine.spacing)


def unknown_receptors(settings: Settings) -> list[Problem]:
    """List receptors that points are to stand closer around, and that are not there."""
    if not isinstance(settings.points, GradedPoints):
        return []
    there = listed([each.name for each in settings.places]) or "there are none"
    return [
        Problem(
            ("points", "refine", i, "receptor"),
            f"expected the name of a receptor in the domain ({there}), found '{each.receptor}'",
        )
        for i, each in enumerate(settings.points.refine)
        if each.receptor is not None
    ]


def corners_to_hold(settings: Settings, outlines: Outlines) -> NDArray[np.float64]:
    """Corners of what a domain has to hold, (n, 2), m: releases, inflows, sections, dams and basins.

    Raises
    ------
    ValueError
        If a layer has no polygon of the name asked for.
    """
    corners = [
        ring
        for release in settings.releases
        if isinstance(release, PolygonsRelease)
        for outline in solver_objects.chosen(release.name, outlines[release.polygons, release.layer])
        for ring in outline.rings
    ]
    corners += [np.array(each.section) for each in settings.inflow]
    corners += [np.array(each.line) for each in settings.sections]
    for structure in settings.structures:
        if structure.kind != "building":
            corners += [ring for each in structures.parts(structure, outlines) for ring in each.rings]
    return np.concatenate(corners)


def off_the_model(settings: Settings, outlines: Outlines, extent: RasterExtent) -> list[Problem]:
    """List what lies wholly outside an elevation model: releases, inflows, sections, receptors, structures.

    Raises
    ------
    ValueError
        If a layer has no polygon of the name asked for.
    """
    problems = []
    covered = "x from {:.12g} to {:.12g} and y from {:.12g} to {:.12g} m".format(*sum(extent.edges, ()))
    for path, kind, name, file, corners in _places_of(settings, outlines):
        (x0, y0), (x1, y1) = corners.min(axis=0), corners.max(axis=0)
        if _meets((x0, x1), (y0, y1), extent):
            continue
        where = of_place(corners, *extent.edges, file, called(extent.crs) if file else "")
        message = (
            f"expected {kind} on the elevation model, which covers {covered}, found {name} outside{where}"
        )
        problems.append(Problem(path, message, related=(path,)))
    return problems


def _meets(x: Pair, y: Pair, extent: RasterExtent) -> bool:
    return all(
        low <= last and high >= first for (low, high), (first, last) in zip((x, y), extent.edges, strict=True)
    )


def _places_of(settings: Settings, outlines: Outlines) -> Iterator[tuple[Path, str, str, str, Array]]:
    """List places on an elevation model: path, kind, name, file or "", and all corners, (n, 2), m."""
    for i, release in enumerate(settings.releases):
        path: Path = ("release", i) if isinstance(settings.release, tuple) else ("release",)
        assert isinstance(release, PolygonsRelease)
        held = solver_objects.chosen(release.name, outlines[release.polygons, release.layer])
        rings = [ring for outline in held for ring in outline.rings]
        name = f"'{release.name or held[0].name}' of {release.polygons}"
        yield path, "a release", name, release.polygons, np.concatenate(rings)
    for i, inflow in enumerate(settings.inflow):
        yield ("inflow", i, "section"), "a section", "one", "", np.array(inflow.section, np.float64)
    for i, section in enumerate(settings.sections):
        yield ("sections", i, "line"), "a section", "one", "", np.array(section.line, np.float64)
    for i, receptor in enumerate(settings.places):
        name = f"'{receptor.name}'"
        yield ("receptors", i), "a receptor", name, "", np.array(receptor.corners, np.float64)
    for i, structure in enumerate(settings.structures):
        key, place = place_of(structure)
        rings = [ring for each in structures.parts(structure, outlines) for ring in each.rings]
        file = place if isinstance(place, str) else ""
        yield ("structures", i, key), f"a {structure.kind}", "one", file, np.concatenate(rings)


def near(settings: Settings, outlines: Outlines, extent: RasterExtent) -> Domain:
    """Give a domain around the places of settings that has none, on the elevation model.

    Raises
    ------
    ValueError
        If a layer has no polygon of the name asked for.
    """
    corners = corners_to_hold(settings, outlines)
    (x0, y0), (x1, y1) = corners.min(axis=0), corners.max(axis=0)
    spacing = max(extent.spacing, float(getattr(settings.points, "spacing")))  # noqa: B009
    margin = max(CELLS_AROUND * spacing, 0.5 * float(max(x1 - x0, y1 - y0)))
    return clipped(
        Domain(x=(float(x0 - margin), float(x1 + margin)), y=(float(y0 - margin), float(y1 + margin))), extent
    )


def part_inside(receptor: Receptor, domain: Domain) -> float:
    """Say how a receptor lies to a domain: 1 wholly inside, 0 wholly outside, 0.5 if it sticks out."""
    corners = receptor.corners
    inside = [domain.holds(x, y) for x, y in corners]
    if all(inside):
        return 1.0
    if any(inside):
        return 0.5
    around = corners if receptor.polygon is None else (*corners, corners[0])
    if any(_crosses(start, end, domain) for start, end in pairwise(around)):
        return 0.5
    middle = (sum(domain.x) / 2, sum(domain.y) / 2)
    return 0.5 if receptor.polygon is not None and _holds(corners, middle) else 0.0


def on_no_data(receptors: Sequence[Receptor], raster: ElevationRaster) -> list[str]:
    """Say which receptors have all their corners where an elevation model has no data, if there are."""
    found = []
    for each in receptors:
        x, y = np.array(each.corners).T
        rows = np.rint((y - raster.y[0]) / raster.spacing).astype(int).clip(0, len(raster.y) - 1)
        columns = np.rint((x - raster.x[0]) / raster.spacing).astype(int).clip(0, len(raster.x) - 1)
        if np.isnan(raster.elevation[rows, columns]).all():
            found.append(each.name)
    told = f"the elevation model has no data at {listed(found)}, which nothing reaches"
    return [f"{told}: fill it (gdal_fillnodata.py), or take another one"] if found else []


def listed(names: Sequence[str]) -> str:
    """List names, of many the first ones and how many more there are."""
    more = f" and {len(names) - MOST_NAMES} more" if len(names) > MOST_NAMES else ""
    return ", ".join(f"'{name}'" for name in names[:MOST_NAMES]) + more


def _crosses(start: Pair, end: Pair, domain: Domain) -> bool:
    """Whether a piece of a line has a part within a rectangle."""
    first, last = 0.0, 1.0
    for a, b, (low, high) in zip(start, end, (domain.x, domain.y), strict=True):
        if a == b:
            if not low <= a <= high:
                return False
            continue
        enter, leave = sorted(((low - a) / (b - a), (high - a) / (b - a)))
        first, last = max(first, enter), min(last, leave)
    return first <= last


def _holds(corners: Sequence[Pair], place: Pair) -> bool:
    """Whether a polygon holds a place: a ray from it crosses an odd number of sides."""
    (x, y), odd = place, False
    for (x0, y0), (x1, y1) in pairwise((*corners, corners[0])):
        if (y0 > y) != (y1 > y) and x < x0 + (y - y0) * (x1 - x0) / (y1 - y0):
            odd = not odd
    return odd


def wrong_zones(settings: Settings) -> list[Problem]:
    """List what is wrong with the corners of zones."""
    found, domain = [], settings.domain
    for of_zone, zone in settings.all_zones:
        path: Path = (*of_zone, "polygon")
        if not isinstance(zone.polygon, tuple):
            continue
        if why := crossing(zone.polygon):
            found.append(Problem(path, f"{SIMPLE}, found {why}"))
        elif domain is not None and not reaches(
            [[solver_objects.counter_clockwise(np.array(zone.polygon))]], domain.x, domain.y
        ):
            found.append(Problem(path, OUTSIDE, related=(path, ("domain",))))
    return found


def crossing_structures(settings: Settings) -> list[Problem]:
    """List the basins and buildings whose corners are no simple polygon."""
    found = []
    for i, structure in enumerate(settings.structures):
        name, place = place_of(structure)
        if name == "polygon" and not isinstance(place, str) and (why := crossing(place)):
            found.append(Problem(("structures", i, name), f"{SIMPLE}, found {why}"))
    return found


def erodible_outside(settings: Settings, extent: tuple[Pair, Pair]) -> list[Problem]:
    """List what is wrong with where the bed of a slope profile is erodible."""
    bed = settings.erodible_bed
    if bed is None or bed.region is None:
        return []
    sides = zip((bed.region.x, bed.region.y), extent, strict=True)
    if all(low < end and start < high for (low, high), (start, end) in sides):
        return []
    (x0, x1), (y0, y1) = settings.bounds.x, settings.bounds.y
    found = (
        f"expected an erodible bed inside the domain, x [{x0:.12g}, {x1:.12g}] and y [{y0:.12g}, {y1:.12g}], "
        "found a region outside it"
    )
    path: Path = ("erodible_bed", "region")
    return [Problem(path, found, related=(path, ("domain",)))]


@lru_cache(maxsize=1024)
def lost(shape: Release, extent: tuple[Pair, Pair]) -> tuple[float, float]:
    """Volume of a release, m3, and the part of it outside the domain, 1 where nothing is inside."""
    whole, outside = shape.shape_volume, shape.volume_outside(*extent)
    if not (isfinite(whole) and isfinite(outside)):
        raise OverflowError("a volume that is no finite number")
    return whole, outside / whole


def wrongly_on_map(settings: Settings, ground: Georeference) -> list[Problem]:
    """List what is wrong with a georeference and what is given in its coordinates."""
    problems = []
    if (doubted := doubt(ground)) is not None:
        name, found = doubted
        problems.append(Problem(("georeference", name), found))
    varied = [key.split(".") for key in settings.varied]
    for kind in ("receptors", "releases"):
        path: Path = ("georeference", kind)
        if getattr(ground, kind) != "map":
            continue
        if any(first == "terrain" for first, *_ in varied):
            problems.append(Problem(path, "expected bed, as the terrain is varied, found map"))
        elif kind == "releases" and any("centre" in parts for parts in varied):
            problems.append(Problem(path, "expected bed, as a centre is varied, found map"))
    if ground.releases == "map" and any(not hasattr(each, "centre") for each in settings.releases):
        found = "expected bed, as a box has no centre and lies along the bed, found map"
        problems.append(Problem(("georeference", "releases"), found))
    return problems


def receptors_outside(settings: Settings) -> tuple[list[Problem], dict[Path, str]]:
    """List what is wrong with receptors of the file, and which stick out of the domain."""
    problems, cut, domain = [], {}, settings.domain
    for i, receptor in enumerate(settings.places):
        if receptor.polygon is not None and (why := crossing(receptor.polygon)):
            problems.append(Problem(("receptors", i, "polygon"), f"{SIMPLE}, found {why}"))
    for i, receptor in enumerate(() if domain is None else settings.places):
        assert domain is not None
        part = part_inside(receptor, domain)
        path: Path = ("receptors", i)
        bounds = "x [{:.12g}, {:.12g}] and y [{:.12g}, {:.12g}]".format(*domain.x, *domain.y)
        if part == 0:
            x, y = receptor.corners[0]
            found = f"expected places in the domain, {bounds}, found [{x:.12g}, {y:.12g}]"
            if settings.on_surface:
                found += of_exchanged((x, x), (y, y), domain.x, domain.y)
            problems.append(Problem(path, found))
        elif part < 1:
            cut[path] = f"sticks out of the domain, {bounds}; the part inside counts"
    return problems, cut


def varied_places(settings: Settings) -> list[Problem]:
    """List varied keys that give runs places of their own, which one store cannot hold."""
    problems = []
    for name in settings.varied:
        what = ""
        if name == "terrain.crs" and settings.on_surface:
            what = "expected one reference system for all runs, found several; write a scenario for each"
        elif name.startswith("structures.") and name.rpartition(".")[2] in PLACE:
            what = "expected one place for all runs, found several; write a scenario for each to compare"
        if what:
            at: Path = ("sweep", name) if name in settings.sweep else ("sample", "values", name)
            problems.append(Problem(at, what))
    return problems
