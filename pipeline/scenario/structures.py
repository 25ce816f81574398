"""Structures of a scenario as the solver takes them, and what is wrong or doubtful about them."""

from __future__ import annotations

from collections.abc import Hashable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from functools import lru_cache
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from pipeline.hints import of_place
from pipeline.inputs.outlines import Outline
from pipeline.mistakes import Problem
from pipeline.readable import percent
from pipeline.scenario import solver_objects
from pipeline.scenario.solver_objects import Outlines
from pipeline.settings.points import FilePoints, LatticePoints
from pipeline.settings.structures import place_of
from solver.physics.earthworks import Basin, Dam, crest_left, reshaped
from solver.physics.elevation import ElevationModel, edges_of
from solver.points.lattice import Lattice
from solver.release.polygons import in_polygon, ring_area
from solver.structures import building_cells

if TYPE_CHECKING:
    from pipeline.inputs.elevation_raster import ElevationRaster
    from pipeline.inputs.point_file import PointFile
    from pipeline.scenario.strict_yaml import Path
    from pipeline.settings.settings import Settings
    from solver.points.cloud import PointCloud

# A dam narrower than so many cells, or of which less is left, has gaps that nothing tells.
LEAST_CELLS, LEAST_LEFT = 2.0, 0.75
# a building this part of a cell wide has no gaps where cells end at it
FITTED = 0.5
# names that a warning lists
MOST_NAMES = 5
# the cloud placed last among buildings, which take long to place, by what it was placed by
_PLACED: dict[Hashable, Lattice | PointCloud] = {}


def parts(structure: Any, outlines: Outlines | None) -> list[Outline]:
    """Give the lines or polygons of a structure, each with its name.

    Raises
    ------
    ValueError
        If none has the name asked for.
    """
    _, place = place_of(structure)
    if isinstance(place, str):
        held = (outlines or {})[place, structure.layer]
        found = [each for each in held if structure.name in (None, each.name)]
        if not found:
            known = ", ".join(each.name for each in held)
            raise ValueError(f"expected one of {known}, found '{structure.name}'")
        return found
    corners = np.array(place, np.float64)
    if structure.kind != "dam" and ring_area(corners) < 0:
        corners = corners[::-1]
    return [Outline(structure.kind, (corners,))]


def files(settings: Settings) -> Iterator[tuple[int, str, str | None]]:
    """List the files of structures: number of the structure, file and layer."""
    for i, structure in enumerate(settings.structures):
        _, place = place_of(structure)
        if isinstance(place, str):
            yield i, place, structure.layer


def earthworks(settings: Settings, outlines: Outlines | None) -> list[Dam | Basin]:
    """Make the dams and basins."""
    made: list[Dam | Basin] = []
    for structure in settings.structures:
        if structure.kind == "building":
            continue
        shapes = tuple(ring for each in parts(structure, outlines) for ring in each.rings)
        made.append(structure.make(**{"lines" if structure.kind == "dam" else "rings": shapes}))
    return made


def ground(
    settings: Settings, rasters: Mapping[str, ElevationRaster], outlines: Outlines | None
) -> ElevationModel | None:
    """Make the surface of a run with its dams and basins; None on a profile.

    rasters : elevation models by file.

    Raises
    ------
    ValueError
        If the ground is about as steep as the sides of a dam.
    """
    raster = rasters.get(getattr(settings.terrain, "elevation", ""))
    if raster is None:
        return None
    natural = solver_objects.surface(settings.terrain, raster)
    return reshaped(natural, earthworks(settings, outlines))


def _built_of(settings: Settings, outlines: Outlines | None) -> list[Outline]:
    """Give the outlines of all buildings."""
    return [
        each
        for structure in settings.structures
        if structure.kind == "building"
        for each in parts(structure, outlines)
    ]


def points(settings: Settings, file: PointFile | None, outlines: Outlines | None) -> Lattice | PointCloud:
    """Make points as `pipeline.scenario.solver_objects.points` does; clouds that are placed end at buildings.

    Parameters
    ----------
    outlines : mapping, optional
        What the files of structures hold.

    Raises
    ------
    ValueError
        As there, or if none has the name asked for.
    """
    if isinstance(settings.points, LatticePoints | FilePoints):
        return solver_objects.points(settings, file)
    rings = tuple(ring.tobytes() for each in _built_of(settings, outlines) for ring in each.rings)
    if not rings:
        return solver_objects.points(settings)
    key = settings.points, settings.bounds, rings
    if key not in _PLACED:
        _PLACED.clear()
        _PLACED[key] = solver_objects.points(settings, None, [np.frombuffer(r).reshape(-1, 2) for r in rings])
    return _PLACED[key]


def buildings(
    settings: Settings, points: Lattice | PointCloud, outlines: Outlines | None
) -> NDArray[np.bool_] | None:
    """Say which cells are buildings, of the shape of the points; None where the scenario has no building."""
    found = None
    for each in _built_of(settings, outlines):
        cells = _cells(each, points)
        found = cells if found is None else found | cells
    return found


def _cells(outline: Outline, points: Lattice | PointCloud) -> NDArray[np.bool_]:
    """Say which cells a building takes; those of a cloud, which take long to find, are found once."""
    if isinstance(points, Lattice):
        return building_cells(outline.rings, points)
    return _cells_of_cloud(tuple(ring.tobytes() for ring in outline.rings), points)


@lru_cache(maxsize=1024)
def _cells_of_cloud(rings: tuple[bytes, ...], cloud: PointCloud) -> NDArray[np.bool_]:
    return building_cells([np.frombuffer(ring).reshape(-1, 2) for ring in rings], cloud)


@dataclass(frozen=True)
class Judged:
    """What came of looking at structures.

    Parameters
    ----------
    points : Lattice or PointCloud, optional
        Those of the scenario; None where there is no building.
    buildings : array, optional
        Whether a cell is one, of the shape of the points, or None.
    problems : list[Problem]
        Mistakes.
    doubts : dict[Path, str]
        Warnings by path.
    """

    points: Lattice | PointCloud | None
    buildings: NDArray[np.bool_] | None
    problems: list[Problem]
    doubts: dict[Path, str]


def judge(
    settings: Settings,
    natural: ElevationModel | None,
    outlines: Outlines | None,
    file: PointFile | None = None,
    *,
    searched: bool = False,
) -> Judged:
    """Say what is wrong with structures whose files were read, and what to warn of.

    Parameters
    ----------
    settings : Settings
        With a domain.
    natural : ElevationModel or None
        The ground without them; None on a profile.
    outlines : mapping
        What the files hold.
    file : PointFile, optional
        What the file of a ``file`` layout holds.
    searched : bool
        Whether the domain is still to be found; what is outside of it may be inside then.
    """
    problems: list[Problem] = []
    among: Lattice | PointCloud | None = None
    doubts: dict[Path, str] = {}
    for i, structure in enumerate(settings.structures):
        name, _ = place_of(structure)
        path: Path = ("structures", i, name)
        try:
            held = parts(structure, outlines)
        except ValueError as error:
            problems.append(Problem(("structures", i, "name"), str(error), related=(path,)))
            continue
        outside = [each.name for each in held if not _comes_in(each, settings)]
        if searched and outside:
            held, outside = [each for each in held if each.name not in outside], []
            if not held:
                continue
        if len(outside) == len(held):
            bounds = "x [{:.12g}, {:.12g}] and y [{:.12g}, {:.12g}]".format(
                *settings.bounds.x, *settings.bounds.y
            )
            wanted = f"expected a {structure.kind} in the domain, {bounds}"
            where = ""
            if settings.on_surface:
                corners = [corner for each in held for ring in each.rings for corner in ring]
                where = of_place(corners, settings.bounds.x, settings.bounds.y)
            problems.append(Problem(path, f"{wanted}, found one outside{where}", related=(path, ("domain",))))
            continue
        said = [f"{_named(outside)} outside the domain, without effect"] if outside else []
        if structure.kind == "building":
            among = points(settings, file, outlines) if among is None else among
            given = isinstance(settings.points, LatticePoints | FilePoints)
            said += _narrow(
                [each for each in held if each.name not in outside], among, 1.0 if given else FITTED
            )
        if said:
            doubts[path] = "; ".join(said)
    if problems:
        return Judged(None, None, problems, doubts)
    if natural is not None:
        lattice = Lattice(settings.bounds.x, settings.bounds.y, float(getattr(settings.points, "spacing")))  # noqa: B009
        problems += _built(settings, natural, outlines, lattice, doubts)
    built = None if among is None else buildings(settings, among, outlines)
    return Judged(among, built, problems, doubts)


def _built(
    settings: Settings,
    natural: ElevationModel,
    outlines: Outlines | None,
    lattice: Lattice,
    doubts: dict[Path, str],
) -> list[Problem]:
    """List dams whose sides do not meet the ground, and warn of those that cells do not show."""
    corners = [edges_of(a, lattice.dx) for a in (lattice.x_points, lattice.y_points)]
    numbers = [i for i, each in enumerate(settings.structures) if each.kind != "building"]
    works, under = earthworks(settings, outlines), natural
    for n, (i, work) in enumerate(zip(numbers, works, strict=True)):
        try:
            built = reshaped(natural, works[: n + 1])
            built.corners(*corners)
        except ValueError as error:
            found = f"{error}; give a steeper side_slope or another line"
            related: tuple[Path, ...] = (("structures", i), ("terrain",))
            return [Problem(("structures", i), found, related=related)]
        if isinstance(work, Dam) and work.height > 0:
            said = []
            if work.base_width < LEAST_CELLS * lattice.dx:
                said.append(
                    f"{work.base_width:.3g} m wide at its foot, less than two cells of {lattice.dx:g} m: "
                    "it has gaps"
                )
            left = crest_left(work, built, under, *corners)
            if left < LEAST_LEFT:
                said.append(
                    f"its crest is {left * work.height:.2g} m high in the mean on cells of {lattice.dx:g} m, "
                    f"of {work.height:g} m; a smaller spacing or a crest_width shows more of it"
                )
            if said:
                doubts["structures", i, "height"] = "; ".join(said)
        under = built
    return []


def overlapping(settings: Settings, outlines: Outlines, judged: Judged) -> list[Problem]:
    """List polygon releases that lie in buildings."""
    problems: list[Problem] = []
    if judged.points is None:
        return problems
    for i, release in enumerate(settings.releases):
        path: Path = ("release", i) if isinstance(settings.release, tuple) else ("release",)
        for outline in solver_objects.chosen(release.name, outlines[release.polygons, release.layer]):  # type: ignore[union-attr]
            part = _part_in(judged, in_polygon(outline.rings, judged.points))
            if part > 0:
                found = f"found {percent(part)} of '{outline.name}' in cells of buildings"
                problems.append(_in_building(path, found))
    return problems


def overlapping_shapes(settings: Settings, judged: Judged) -> list[Problem]:
    """List releases on a profile that lie in buildings; a release that lies nowhere is told elsewhere."""
    if judged.points is None:
        return []
    try:
        part = _part_in(judged, solver_objects.laid(settings, judged.points).depth)
    except ValueError:
        return []
    return [_in_building(("release",), f"found {percent(part)} of it in their cells")] if part > 0 else []


def _part_in(judged: Judged, depth: NDArray[np.float64]) -> float:
    """Part of a volume that lies in cells of buildings, by its depth."""
    assert judged.points is not None
    volume = depth if isinstance(judged.points, Lattice) else depth * judged.points.cell_area
    return float(volume[judged.buildings].sum() / max(volume.sum(), 1e-300))


def _in_building(path: Path, found: str) -> Problem:
    wanted = "expected a release beside the buildings, as nothing can lie in one"
    return Problem(path, f"{wanted}, {found}", related=(path, ("structures",)))


def _comes_in(outline: Outline, settings: Settings) -> bool:
    """Whether a rectangle around a line or polygon has a part on the cells."""
    corners = np.concatenate(outline.rings)
    (low_x, low_y), (high_x, high_y) = corners.min(axis=0), corners.max(axis=0)
    (x_0, x_1), (y_0, y_1) = solver_objects.extent(settings)
    return bool(low_x <= x_1 and high_x >= x_0 and low_y <= y_1 and high_y >= y_0)


def _narrow(held: Sequence[Outline], points: Lattice | PointCloud, least: float) -> list[str]:
    """Say which buildings cover no cell, or are narrower than a part of one."""
    import shapely

    none, narrow = [], []
    for each in held:
        cells = _cells(each, points)
        if not cells.any():
            none.append(each.name)
            continue
        size = (
            points.dx if isinstance(points, Lattice) else float(np.sqrt(np.median(points.cell_area[cells])))
        )
        box = shapely.MultiPoint(each.rings[0]).minimum_rotated_rectangle
        sides = np.asarray(shapely.get_coordinates(box))
        if len(sides) < 4 or np.hypot(*np.diff(sides[:3], axis=0).T).min() < least * size:
            narrow.append(each.name)
    said, cell = [], f"cell of {points.dx:g} m" if isinstance(points, Lattice) else "cell"
    if none:
        said.append(f"{_named(none)} half of no {cell} covered: the flow passes through")
    if narrow:
        said.append(f"{_named(narrow)} narrower than a {cell}: the flow may find gaps")
    return said


def _named(names: Sequence[str]) -> str:
    """Name things in a warning: ``2 ('a', 'b')``."""
    first = ", ".join(f"'{name}'" for name in names[:MOST_NAMES])
    return f"{len(names)} ({first}{', ...' if len(names) > MOST_NAMES else ''})"
