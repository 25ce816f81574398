"""The solver's own objects, made from settings."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from functools import lru_cache
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from pipeline.hints import alike, of_exchanged
from pipeline.mistakes import describe
from pipeline.settings import points as points_settings
from pipeline.settings.erodible_bed import ErodibleBed as ErodibleSettings
from pipeline.settings.generated import Generated
from pipeline.settings.inflow import HydrographFile, HydrographList
from pipeline.settings.physics import MaterialLaws
from pipeline.settings.surface import ElevationTerrain, PolygonsRelease
from pipeline.settings.zones import ZoneKeys
from solver.inflow.clouds import frame_of_bounds
from solver.inflow.conditions import Inflow, Line, Section
from solver.inflow.entrance import check_on_cloud, entrance, largest_depth, placed_on
from solver.inflow.hydrograph import Hydrograph, Triangle
from solver.inflow.placement import outside
from solver.physics.earth_pressure import EarthPressure
from solver.physics.elevation import ElevationModel, Surface
from solver.physics.erosion import ErodibleBed, ErosionZone
from solver.physics.friction import Friction
from solver.physics.terrain import SlopeProfile, Terrain
from solver.physics.terrain_table import Table
from solver.points.lattice import Lattice
from solver.release.erodible import Rings, erodible_on_profile, erodible_on_surface
from solver.release.initial_state import Laid, initial_state
from solver.release.polygons import PolygonRelease, ring_area, surface_state
from solver.release.shapes import Release
from solver.scheme import Scheme

if TYPE_CHECKING:
    from pipeline.inputs.elevation_raster import ElevationRaster
    from pipeline.inputs.elevation_table import ElevationTable
    from pipeline.inputs.hydrograph_table import HydrographTable
    from pipeline.inputs.outlines import Outline
    from pipeline.inputs.point_file import PointFile
    from pipeline.settings.settings import Settings

    # compiled code takes longer to import than a scenario to check
    from solver.points.cloud import PointCloud
    from solver.scene import Zone

# hydrographs by file
Hydrographs = Mapping[str, "HydrographTable"]
# of a section that are looked at for the zones it crosses
PLACES_ALONG = 1000
# polygons that a message lists
MOST_NAMED = 20
# polygons by file and layer
Outlines = Mapping["tuple[str, str | None]", "tuple[Outline, ...]"]


def points(
    settings: Settings, file: PointFile | None = None, outlines: Sequence[NDArray[np.float64]] = ()
) -> Lattice | PointCloud:
    """Make the points of a scenario.

    Parameters
    ----------
    settings : Settings
        With a domain.
    file : PointFile, optional
        What the file of a ``file`` layout holds.
    outlines : sequence of array
        At which the cells of a cloud end that is placed, as `solver.points.fitted.fitted` takes them.

    Raises
    ------
    ValueError
        If points coincide, lie outside the domain or on one line, or their number cannot be met.
    """
    x, y = settings.bounds.x, settings.bounds.y
    if isinstance(settings.points, points_settings.LatticePoints):
        return Lattice(x, y, settings.points.spacing)
    from solver.points import cloud
    from solver.points.spacing import Corridor, Refinement

    match settings.points:
        case points_settings.PoissonDiscPoints(spacing=None, count=count, seed=seed):
            assert count is not None
            return cloud.random_points(x, y, count, seed, outlines)
        case points_settings.PoissonDiscPoints(spacing=spacing, seed=seed):
            assert spacing is not None
            return cloud.graded_points(x, y, spacing, seed=seed, outlines=outlines)
        case points_settings.GradedPoints() as graded:
            regions = [
                Refinement(r.region.x, r.region.y, r.spacing)
                if r.region is not None
                else Corridor(r.line or (), r.spacing, r.margin)
                for r in graded.refine
                # one that is not there is told by the checks
                if r.receptor is None
            ]
            return cloud.graded_points(x, y, graded.spacing, regions, graded.growth, graded.seed, outlines)
        case points_settings.FilePoints():
            if file is None:
                raise ValueError("a file layout needs its file")
            return cloud.given_points(file.points, x, y)


def extent(settings: Settings) -> tuple[tuple[float, float], tuple[float, float]]:
    """Bounds along and across the bed of what the cells cover, m."""
    if isinstance(settings.points, points_settings.LatticePoints):
        return Lattice(settings.bounds.x, settings.bounds.y, settings.points.spacing).extent
    return settings.bounds.x, settings.bounds.y


def scheme(settings: Settings) -> Scheme:
    """Make the scheme."""
    made: Scheme = settings.scheme.make()
    return made


def laws(settings: Settings) -> tuple[Friction, EarthPressure]:
    """Make the laws of basal friction and of earth pressure."""
    material: MaterialLaws = settings.material
    return material.laws()


def releases(settings: Settings) -> list[Release]:
    """Make the releases, with their volumes and velocities."""
    return [release.make() for release in settings.releases if not isinstance(release, PolygonsRelease)]


def chosen(name: str | None, outlines: Sequence[Outline]) -> list[Outline]:
    """Pick the polygons of a layer that have a name, or all.

    Raises
    ------
    ValueError
        If none has the name.
    """
    found = [each for each in outlines if name in (None, each.name)]
    if not found:
        known = list(dict.fromkeys(each.name for each in outlines))
        told = f"{', '.join(known[:MOST_NAMED])}{' and others' * (len(known) > MOST_NAMED)}"
        raise ValueError(f"expected one of the polygons {told}, found '{name}'{alike(str(name), known)}")
    return found


def with_attributes(outline: Outline, *names: str) -> str:
    """Say what a polygon has as some attributes, or which others it has where it has none of these."""
    given = [(name, outline.attributes[name]) for name in names if outline.attributes.get(name) is not None]
    held = [f"{name} {describe(value)}" + ", which is text" * isinstance(value, str) for name, value in given]
    if empty := [name for name in names if name in outline.attributes and not given]:
        return f"'{outline.name}' whose attribute {' and '.join(empty)} is empty"
    known = f"the attributes {', '.join(outline.attributes)}" if outline.attributes else "no attributes"
    return f"'{outline.name}' with {' and '.join(held) or known}"


def polygon_releases(release: PolygonsRelease, outlines: Sequence[Outline]) -> list[PolygonRelease]:
    """Make the releases of polygons of a layer.

    Raises
    ------
    ValueError
        If none has the name asked for, one has no depth, or what single ones have of their own is not that
        of one polygon.
    """
    held, measured = chosen(release.name, outlines), release.measured
    for name in release.each:
        if (count := len(chosen(name, held))) > 1:
            wanted = f"expected one polygon called '{name}', found {count}"
            raise ValueError(f"{wanted}; give each of them a name of its own")
    made = []
    if release.volume is not None:
        rings = [ring for outline in held if outline.name not in release.each for ring in outline.rings]
        made += [PolygonRelease(rings, volume=release.volume, measured=measured)] if rings else []
        held = [outline for outline in held if outline.name in release.each]
    for outline in held:
        depth, volume = outline.attributes.get("depth"), outline.attributes.get("volume")
        if (own := release.each.get(outline.name)) is not None:
            depth, volume = own.depth, own.volume
        elif release.depth is not None:
            depth = release.depth
        if depth is None and isinstance(volume, int | float) and volume > 0:
            made.append(PolygonRelease(outline.rings, volume=float(volume), measured=measured))
            continue
        if isinstance(depth, bool) or not isinstance(depth, int | float) or not depth > 0:
            wanted = "expected depth, volume, or an attribute depth or volume of each polygon above 0"
            raise ValueError(f"{wanted}, found {with_attributes(outline, 'depth', 'volume')}")
        made.append(PolygonRelease(outline.rings, depth=float(depth), measured=measured))
    return made


def outlined(settings: Settings, outlines: Outlines | None) -> list[PolygonRelease]:
    """Make the releases of a run that are polygons; none on a slope profile."""
    return [
        each
        for release in settings.releases
        if isinstance(release, PolygonsRelease)
        for each in polygon_releases(release, (outlines or {})[release.polygons, release.layer])
    ]


def zones(
    settings: Settings, points: Lattice | PointCloud, outlines: Outlines | None = None
) -> tuple[Zone, ...]:
    """Make the zones of friction: the share of each cell that is in none of those that come later.

    Raises
    ------
    ValueError
        If a layer has no polygon of the name asked for.
    """
    if not settings.zones:
        return ()
    from solver.scene import Zone

    laws = settings.material.zone_laws()
    return tuple(map(Zone, laws, _shares_of_zones(settings.zones, points, outlines)))


def _shares_of_zones(
    zones: Sequence[ZoneKeys], points: Lattice | PointCloud, outlines: Outlines | None
) -> list[NDArray[np.float64]]:
    """Give the share of each cell that is in a zone and in none of those that come later."""
    from pipeline.inputs.polygons import uncovered
    from solver.release.shares import shares

    return [shares(rings, points) for rings in uncovered(_outlines_of_zones(zones, outlines))]


def _outlines_of_zones(
    zones: Sequence[ZoneKeys], outlines: Outlines | None
) -> list[list[tuple[NDArray[np.float64], ...]]]:
    """Give the polygons of each zone, each with its rings (n, 2), m."""
    layers: list[list[tuple[NDArray[np.float64], ...]]] = []
    for zone in zones:
        if zone.file is None:
            layers.append([(counter_clockwise(np.array(zone.polygon)),)])
        else:
            held = chosen(zone.picked, (outlines or {})[zone.file, zone.layer])
            layers.append([outline.rings for outline in held])
    return layers


def _zones_along(
    line: Line, settings: Settings, outlines: Outlines | None
) -> tuple[tuple[Friction, float], ...]:
    """Give the laws of the zones that a line crosses, each with its share of the length."""
    import shapely

    from pipeline.inputs.polygons import inside

    shares = (np.arange(PLACES_ALONG) + 0.5) / PLACES_ALONG
    at = shapely.get_coordinates(
        shapely.line_interpolate_point(shapely.LineString(line), shares, normalized=True)
    )
    zone_at = np.full(PLACES_ALONG, -1)
    for i, polygons in enumerate(_outlines_of_zones(settings.zones, outlines)):
        for rings in polygons:
            zone_at[inside(rings, at)] = i
    laws: MaterialLaws = settings.material
    found = ((law, float(np.mean(zone_at == i))) for i, law in enumerate(laws.zone_laws()))
    return tuple((law, share) for law, share in found if share > 0)


def counter_clockwise(ring: NDArray[np.float64]) -> NDArray[np.float64]:
    """Turn an outline (n, 2) so that it runs counter-clockwise."""
    return ring if ring_area(ring) > 0 else ring[::-1]


def graphs(settings: Settings, hydrographs: Hydrographs) -> tuple[Hydrograph, ...]:
    """Give the hydrograph of each inflow; ``hydrographs`` are those of files."""
    found: list[Hydrograph] = []
    for each in settings.inflow:
        if isinstance(each.hydrograph, HydrographFile):
            found.append(hydrographs[each.hydrograph.file].hydrograph)
        elif isinstance(each.hydrograph, HydrographList):
            held = np.array(each.hydrograph.times), np.array(each.hydrograph.discharges)
            found.append(Hydrograph(*held))
        else:
            triangle: Triangle = each.hydrograph.make()
            found.append(triangle.hydrograph())
    return tuple(found)


def inflows(
    settings: Settings, hydrographs: Hydrographs, outlines: Outlines | None = None
) -> tuple[Inflow, ...]:
    """Make the inflows; ``hydrographs`` are those of files, ``outlines`` the polygons of zones."""
    made = []
    for each, graph in zip(settings.inflow, graphs(settings, hydrographs), strict=True):
        depth = "normal" if each.depth is None and each.froude is None and each.speed is None else each.depth
        normal = depth == "normal" and settings.zones
        crossed = _zones_along(each.section, settings, outlines) if normal else ()
        made.append(Inflow(each.name, each.section, graph, depth, each.froude, each.speed, crossed))
    return tuple(made)


def sections(settings: Settings) -> tuple[Section, ...]:
    """Make the sections that discharge is measured at."""
    return tuple(Section(each.name, each.line) for each in settings.sections)


def misplaced(
    settings: Settings,
    terrain: Terrain | Surface,
    hydrographs: Hydrographs,
    among: tuple[Lattice | PointCloud, NDArray[np.bool_]] | None = None,
    outlines: Outlines | None = None,
) -> Iterator[tuple[str, int, str]]:
    """Say which inflows and sections cannot be placed: inflow or sections, its number, and why.

    among : points, and which of their cells are buildings.
    """
    friction, _ = laws(settings)
    # the points of a cloud take long to place, and a line within its bounds always parts some of them
    given, bounds = settings.points, extent(settings)
    lattice = points(settings) if isinstance(given, points_settings.LatticePoints) else None
    slack = 1e-6 * (lattice.spacing if isinstance(lattice, Lattice) else min(map(np.ptp, bounds)))
    reach = 0.5 * (lattice.spacing if isinstance(lattice, Lattice) else _mean_spacing(settings)) + slack
    for i, each in enumerate(inflows(settings, hydrographs, outlines)):
        off = _off(each.line, bounds, slack, settings) or _crosses_itself(each.line)
        if off := off or _on_given_depth(each.line, settings, reach):
            yield "inflow", i, off
            continue
        try:
            if lattice is None:
                frame = frame_of_bounds(*bounds, _mean_spacing(settings), _closest_spacing(settings))
                check_on_cloud(each, frame, terrain, friction, settings.gravity)
            on = lattice if among is None else among[0]
            if on is None:
                continue
            found = entrance(each, on, terrain, friction, settings.gravity)
        except ValueError as error:
            yield "inflow", i, str(error)
            continue
        if among is not None and found.placed.meets(among[1]):
            yield "inflow", i, "expected a section clear of buildings, found one that meets a building"
    for i, section in enumerate(sections(settings)):
        if off := _off(section.line, bounds, slack, settings) or _crosses_itself(section.line):
            yield "sections", i, off
            continue
        try:
            if lattice is not None:
                placed_on(section.line, lattice, terrain, settings.gravity)
        except ValueError as error:
            yield "sections", i, str(error)


def _mean_spacing(settings: Settings) -> float:
    """Mean spacing of a cloud by its settings, m; 0 where its points are in a file."""
    if isinstance(settings.points, points_settings.FilePoints):
        return 0.0
    if (spacing := settings.points.spacing) is not None:
        return spacing
    (x0, x1), (y0, y1) = extent(settings)
    count = getattr(settings.points, "count", None)
    return float(np.sqrt((x1 - x0) * (y1 - y0) / count)) if count else 0.0


def _closest_spacing(settings: Settings) -> float:
    """Spacing of a cloud where its points are refined, as they are at most sections, m."""
    given = settings.points
    return given.closest if isinstance(given, points_settings.GradedPoints) else _mean_spacing(settings)


def _off(
    line: Line, extent: tuple[tuple[float, float], tuple[float, float]], slack: float, settings: Settings
) -> str:
    """Say which corner of a line lies outside, with all its digits; "" for none."""
    if (corner := outside(line, extent, slack)) is None:
        return ""
    bounds = "x [{:.12g}, {:.12g}] and y [{:.12g}, {:.12g}]".format(*extent[0], *extent[1])
    x, y = corner
    hint = of_exchanged((x, x), (y, y), *extent) if settings.on_surface else ""
    return f"expected a section inside the domain, {bounds}, found [{x:.12g}, {y:.12g}]{hint}"


def _crosses_itself(line: Line) -> str:
    """Say that a line meets itself; "" where it does not."""
    import shapely

    if shapely.LineString(line).is_simple:
        return ""
    return "expected a line that does not cross itself, found one that does"


def _on_given_depth(line: Line, settings: Settings, reach: float) -> str:
    """Say that a line lies along a side that holds a depth; "" where it does not."""
    for axis, name in enumerate(("x", "y")):
        for side, bound in zip(("min", "max"), getattr(settings.bounds, name), strict=True):
            held = not isinstance(getattr(settings.boundaries, f"{name}_{side}"), str)
            if held and all(abs(corner[axis] - bound) <= reach for corner in line):
                wanted = f"expected a section off {name}_{side}, which holds a depth, found one on it"
                return f"{wanted}; write open or wall for the side, or move the section inward"
    return ""


def deepest_inflow(
    settings: Settings,
    points: Lattice | PointCloud,
    terrain: Terrain | Surface,
    hydrographs: Hydrographs,
    outlines: Outlines | None = None,
) -> float:
    """Largest depth that flow comes in with on points until the latest end, m; 0 without inflows."""
    if not settings.inflow:
        return 0.0
    friction, _ = laws(settings)
    made = inflows(settings, hydrographs, outlines)
    return largest_depth(made, points, terrain, friction, settings.gravity, settings.latest_end)


@lru_cache(maxsize=8)
def surface(terrain: ElevationTerrain, raster: ElevationRaster) -> ElevationModel:
    """Make the surface of an elevation model, once for all runs on it."""
    return ElevationModel(raster.x, raster.y, raster.elevation, terrain.length)


def laid(
    settings: Settings,
    points: Lattice | PointCloud,
    outlines: Outlines | None = None,
    ground: ElevationModel | None = None,
) -> Laid:
    """Lay the releases of a run on its points; on an elevation model they are outlined.

    Raises
    ------
    ValueError
        If a release lies wholly outside, or polygons lack what they need.
    """
    if not settings.releases:
        depth, velocity_x, velocity_y = np.zeros((3, *points.shape))
        return Laid(depth, velocity_x, velocity_y, 0.0, 0.0, 0.0)
    if ground is None:
        return initial_state(releases(settings), points)
    return surface_state(outlined(settings, outlines), points, ground)


def erodible_polygons(bed: ErodibleSettings, outlines: Sequence[Outline]) -> list[tuple[Rings, float]]:
    """Give the polygons of an erodible bed, each with its depth, m; 1 where the bed has one of its own.

    Raises
    ------
    ValueError
        If none has the name asked for, or one has no depth and the bed has none.
    """
    found: list[tuple[Rings, float]] = []
    for outline in chosen(bed.name, outlines):
        depth = outline.attributes.get("depth") if bed.depth is None else 1.0
        if isinstance(depth, bool) or not isinstance(depth, int | float) or not depth >= 0:
            wanted = "expected depth, or an attribute depth of each polygon of at least 0"
            raise ValueError(f"{wanted}, found {with_attributes(outline, 'depth')}")
        found.append((outline.rings, float(depth)))
    return found


def erodible_bed(
    settings: Settings,
    points: Lattice | PointCloud,
    terrain: SlopeProfile | ElevationModel,
    outlines: Outlines | None = None,
    depths: Mapping[str, ElevationRaster] | None = None,
) -> ErodibleBed | None:
    """Lay the erodible bed of a run on its points, if it has one.

    Parameters
    ----------
    outlines : mapping, optional
        Polygons by file and layer.
    depths : mapping, optional
        Rasters of depth by file.

    Raises
    ------
    ValueError
        If polygons lack what they need.
    """
    bed = settings.erodible_bed
    if bed is None:
        return None
    density = getattr(settings.material, "density")  # noqa: B009
    vertical, law = bed.measured == "vertical", bed.erosion_law(density)
    zones: tuple[ErosionZone, ...] = ()
    if bed.zones:
        zones = tuple(map(ErosionZone, bed.zone_laws(density), _shares_of_zones(bed.zones, points, outlines)))
    if isinstance(terrain, SlopeProfile):
        assert isinstance(bed.depth, float | int)
        region = None if bed.region is None else (bed.region.x, bed.region.y)
        depth = erodible_on_profile(bed.depth, points, terrain, region, vertical=vertical)
        return ErodibleBed(depth, law, bed.limits, zones)
    given: float | ElevationModel | None = None
    if bed.raster is not None:
        raster = (depths or {})[bed.raster]
        given = ElevationModel(raster.x, raster.y, raster.elevation, None)
    elif bed.depth is not None:
        assert not isinstance(bed.depth, str)
        given = bed.depth
    polygons = None
    if bed.polygons is not None:
        polygons = erodible_polygons(bed, (outlines or {})[bed.polygons, bed.layer])
    depth = erodible_on_surface(given, points, terrain, polygons, vertical=vertical)
    return ErodibleBed(depth, law, bed.limits, zones)


def slope(terrain: Generated | ElevationTerrain, table: ElevationTable | None = None) -> SlopeProfile:
    """Make the slope profile; ``table`` is what the file of a ``table`` profile holds.

    Raises
    ------
    ValueError
        If the profile is a table and none was given, or the terrain is an elevation model.
    """
    if isinstance(terrain, ElevationTerrain):
        raise ValueError("an elevation model is no slope profile")
    points = {}
    if terrain.source is Table:
        if table is None:
            raise ValueError("a table profile needs its table")
        points = {"distances": table.distances, "elevations": table.elevations}
    made: SlopeProfile = terrain.make(**points)
    return made
