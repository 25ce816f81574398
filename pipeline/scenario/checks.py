"""What a scenario file must be beyond its schema: releases inside the domain, tables and sweeps that hold."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field, replace
from functools import lru_cache
from itertools import pairwise
from math import hypot, isfinite, prod
from pathlib import Path as FilePath
from typing import Any, TypeVar

import numpy as np

from pipeline.inputs import elevation_table, hydrograph_table, point_file, reference_system
from pipeline.inputs.elevation_table import ElevationTable
from pipeline.inputs.ground import Ground
from pipeline.inputs.hydrograph_table import HydrographTable
from pipeline.inputs.point_file import PointFile
from pipeline.inputs.polygons import crossing, reaches
from pipeline.mistakes import BadInput, Mistake, Problem
from pipeline.readable import percent
from pipeline.scenario import endless, solver_objects, structures
from pipeline.scenario.design import share_within
from pipeline.scenario.ground import OUTSIDE, GroundCheck
from pipeline.scenario.places import on_bed, on_no_data, part_inside, receptors_on_bed
from pipeline.scenario.plausibility import of_depths, of_hydrograph, reversed_periods, unusual
from pipeline.scenario.schema_errors import check
from pipeline.scenario.strict_yaml import Document, Path
from pipeline.scenario.sweep_checks import check_design, periods_of_polygons, twice_named
from pipeline.settings.hazard import Georeference
from pipeline.settings.physics import AnyTerrain
from pipeline.settings.points import FilePoints
from pipeline.settings.sample import power_of_two
from pipeline.settings.section import Pair
from pipeline.settings.settings import (
    MATERIAL_DENSITY,
    MOST_FRAMES,
    MOST_SAMPLES,
    OF_POLYGONS,
    Settings,
)
from pipeline.settings.structures import PLACE, place_of
from pipeline.store.variables import ERODED
from solver.physics.elevation import ElevationModel
from solver.physics.terrain import SlopeProfile
from solver.release.shapes import Release

T = TypeVar("T")
# of the length of a table
LARGE_SMOOTHING = 0.25
SIMPLE = "expected corners of a simple polygon"

FOR_RECEPTORS = ("max_depth", "max_speed", "arrival_time")
FOR_MAPS = frozenset(("max_depth", "max_speed", "max_momentum_flux"))
# of a volume
ROUND_OFF = 1e-9
# of a distribution that bounds cut off
LEAST_SHARE = 1e-4
# of a level
FEW_POINTS = 50
# of a cell
SHORT = 0.5


@dataclass
class Checked:
    """What came of checking one file; ``settings`` is None where there is a mistake."""

    settings: Settings | None = None
    tables: dict[str, ElevationTable] = field(default_factory=dict)
    points: PointFile | None = None
    ground: Ground | None = None
    hydrographs: dict[str, HydrographTable] = field(default_factory=dict)
    mistakes: list[Mistake] = field(default_factory=list)
    warnings: tuple[str, ...] = ()


def check_document(document: Document, folder: FilePath) -> Checked:
    """Check one file and every run of its design; tables are looked for relative to ``folder``."""
    if document.mistakes and not document.data:
        return Checked()
    judge = _Judge(folder, isinstance(document.data.get("inflow"), Mapping))
    problems = check(document.data)
    settings = None if isinstance(problems, list) else problems
    sample = None if settings is None else settings.sample
    if not isinstance(problems, list):
        problems = judge.problems(problems)
        if settings is not None and not problems and not judge.mistakes:
            settings = judge.placed(settings)
            problems = judge.for_all_runs(settings)
    judge.lost.clear()
    judge.unusual.clear()
    problems += check_design(document.data, sample, problems, judge.check)
    told = {(mistake.line, mistake.column) for mistake in document.mistakes}
    mistakes = [document.mistake(p.path, p.message, at_key=p.at_key) for p in problems]
    mistakes = [mistake for mistake in mistakes if (mistake.line, mistake.column) not in told]
    mistakes += judge.mistakes
    if settings is not None and not mistakes and settings.on_surface:
        held = {} if judge.map_files.held is None else judge.map_files.held.outlines
        wrong = twice_named(settings, document.data, held)
        mistakes += [document.mistake(p.path, p.message, at_key=p.at_key) for p in wrong]
    if settings is not None and not mistakes and settings.return_periods == OF_POLYGONS:
        ground = judge.map_files.held
        found = periods_of_polygons(settings, document.data, {} if ground is None else ground.outlines)
        if isinstance(found, Problem):
            mistakes.append(document.mistake(found.path, found.message))
        else:
            settings = settings.model_copy(update={"return_periods": found})
    if mistakes or settings is None:
        return Checked(mistakes=mistakes)
    settings = settings.fed_until(judge.last_inflow)
    warnings = (document.mistake(path, message) for path, message in judge.warnings(settings))
    ground = judge.map_files.held
    files = judge.tables, judge.points, ground, judge.hydrographs
    return Checked(settings, *files, [], tuple(map(str, warnings)))


class _Judge:
    """Judges settings that keep to the schema, and remembers what to warn of."""

    def __init__(self, folder: FilePath, single: bool = False) -> None:
        self.folder = folder
        # whether the one inflow is written without a list
        self.single = single
        self.tables: dict[str, ElevationTable] = {}
        self.hydrographs: dict[str, HydrographTable] = {}
        self.mistakes: list[Mistake] = []
        self.lost: dict[Path, tuple[float, float]] = {}
        self.short: dict[Path, float] = {}
        self.unusual: dict[Path, str] = {}
        self.late: dict[Path, float] = {}
        self.last_inflow = 0.0
        self.cut: dict[Path, str] = {}
        self.ground: Georeference | None = None
        self.points: PointFile | None = None
        self.files: dict[str, Any] = {}
        self.map_files = GroundCheck(folder)

    def check(self, data: Mapping[str, Any]) -> list[Problem]:
        """List all that is wrong with the data of one run."""
        settings = check(data)
        if isinstance(settings, list):
            return settings
        return self.problems(settings.model_copy(update={"georeference": self.ground}))

    def problems(self, settings: Settings) -> list[Problem]:
        """List what is wrong with the settings of one run, which keep to the schema."""
        return [
            replace(each, path=self._written(each.path), related=tuple(map(self._written, each.related)))
            for each in self._problems(settings)
        ]

    def _written(self, path: Path) -> Path:
        """Give a path as the file has it."""
        return (*path[:1], *path[2:]) if self.single and path[:2] == ("inflow", 0) else path

    def _problems(self, settings: Settings) -> list[Problem]:
        problems = self._table(settings) + self._points(settings) + self._hydrographs(settings)
        problems += _zones(settings) + _crossing_structures(settings)
        self.unusual |= unusual(settings)
        self.ground = settings.georeference
        if any(name not in self.hydrographs for name in settings.hydrograph_files):
            return problems
        if settings.on_surface:
            return problems + self._on_surface(settings)[1]
        if settings.table_file is not None and settings.table_file not in self.tables:
            return problems
        try:
            # what is too large or too small to be computed is told by its exception
            with np.errstate(all="ignore"):
                return problems or self._flow(self.placed(settings))
        except (ArithmeticError, ValueError) as error:
            found = f"expected sizes that can be computed with, found some that cannot ({error})"
            return [Problem(("release",), found, related=(("release",), ("terrain",), ("domain",)))]

    def placed(self, settings: Settings) -> Settings:
        """Give settings with releases and receptors in coordinates of the bed, and with their domain."""
        if settings.on_surface:
            found, _ = self._on_surface(settings)
            # one that is not given is still to be found
            found = found if settings.domain is not None else found.model_copy(update={"domain": None})
            receptors = self.map_files.receptors(found)
            # what is wrong with them is listed for all runs
            return (
                found if isinstance(receptors, Problem) else found.model_copy(update={"receptors": receptors})
            )
        ground = settings.georeference
        if ground is None or "map" not in (ground.receptors, ground.releases):
            return settings
        slope = self._slope(settings)
        changed: dict[str, Any] = {"receptors": receptors_on_bed(settings, slope)}
        if ground.releases == "map":
            releases = tuple(
                release.model_copy(update={"centre": on_bed(ground, slope, [centre])[0]})
                if (centre := getattr(release, "centre", None)) is not None
                else release
                for release in settings.releases
            )
            changed["release"] = releases if isinstance(settings.release, tuple) else releases[0]
        return settings.model_copy(update=changed)

    def _on_surface(self, settings: Settings) -> tuple[Settings, list[Problem]]:
        """Give settings on an elevation model with their domain, and what is wrong with their files."""
        try:
            found, problems = self.map_files.judge(settings)
            if not problems and (settings.inflow or settings.sections):
                assert self.map_files.held is not None
                held = self.map_files.held
                model = structures.ground(found, held.rasters, held.outlines)
                assert model is not None
                problems = self._sections(found, model)
            return found, problems
        except (ArithmeticError, ValueError) as error:
            message = f"expected an elevation model that can be computed on, found one that cannot ({error})"
            return settings, [Problem(("terrain",), message, related=(("terrain",), ("release",)))]

    def _sections(self, settings: Settings, terrain: SlopeProfile | ElevationModel) -> list[Problem]:
        """List what is wrong with where inflows and sections are."""
        built, outlines = None, None if self.map_files.held is None else self.map_files.held.outlines
        if any(each.kind == "building" for each in settings.structures):
            built = structures.buildings(settings, solver_objects.points(settings), outlines)
        return [
            Problem(
                (name, i, "section" if name == "inflow" else "line"),
                message,
                related=((name, i), ("material",), ("terrain",), ("domain",), ("structures",)),
            )
            for name, i, message in solver_objects.misplaced(
                settings, terrain, self.hydrographs, built, outlines
            )
        ]

    def _slope(self, settings: Settings) -> SlopeProfile:
        name = settings.table_file
        return _slope(settings.terrain, None if name is None else self.tables[name])

    def _flow(self, settings: Settings) -> list[Problem]:
        """List what is wrong with where the flow begins, and where it ends if no domain is given."""
        if settings.domain is None:
            distance = endless.reach(settings, self._slope(settings))
            if distance is None:
                return []
            far = f"goes on for {distance / 1000:.3g} km or more" if isfinite(distance) else "never rests"
            found = f"expected a domain, as the bed is steeper than friction everywhere and the flow {far}"
            related: tuple[Path, ...] = (("domain",), ("material",), ("terrain",), ("time",), ("release",))
            return [Problem(("domain",), found, related=related)]
        extent = solver_objects.extent(settings)
        problems = self._structures(settings) + _erodible(settings, extent)
        for i, release in enumerate(solver_objects.releases(settings)):
            path: Path = ("release", i) if isinstance(settings.release, tuple) else ("release",)
            whole, part = _lost(replace(release, volume=None, velocity=(0.0, 0.0)), extent)
            if part >= 1:
                (x0, x1), (y0, y1) = settings.domain.x, settings.domain.y
                found = (
                    f"expected a release inside the domain, x [{x0:.12g}, {x1:.12g}] and y [{y0:.12g}, "
                    f"{y1:.12g}], found one wholly outside it"
                )
                problems.append(Problem(path, found, related=(path, ("domain",))))
            elif part > 0:
                volume = part * (whole if release.volume is None else release.volume)
                self.lost[path] = max(self.lost.get(path, (0.0, 0.0)), (volume, part))
        if settings.inflow or settings.sections:
            problems += self._sections(settings, self._slope(settings))
        return problems

    def _structures(self, settings: Settings) -> list[Problem]:
        """List what is wrong with the buildings of a run on a profile."""
        if not settings.structures:
            return []
        judged = structures.judge(settings, None, None)
        self.map_files.doubts |= {(path, ""): line for path, line in judged.doubts.items()}
        if judged.problems or judged.buildings is None:
            return list(judged.problems)
        return structures.overlapping_shapes(settings, judged.buildings)

    def for_all_runs(self, settings: Settings) -> list[Problem]:
        """List what is wrong with what is said of all runs; receptors are in coordinates of the bed."""
        problems = [] if settings.georeference is None else self._on_map(settings, settings.georeference)
        if settings.on_surface and "terrain.crs" in settings.varied:
            name = "terrain.crs"
            kind = "sweep" if name in settings.sweep else "sample"
            at: Path = (kind, name) if kind == "sweep" else ("sample", "values", name)
            found = "expected one reference system for all runs, found several; write a scenario for each"
            problems.append(Problem(at, found))
        for name in settings.varied:
            if name.startswith("structures.") and name.rpartition(".")[2] in PLACE:
                kind = "sweep" if name in settings.sweep else "sample"
                at = (kind, name) if kind == "sweep" else ("sample", "values", name)
                found = "expected one place for all runs, found several; write a scenario for each to compare"
                problems.append(Problem(at, found))
        domain = settings.domain
        if not isinstance(settings.receptors, tuple):
            receptors = self.map_files.receptors(settings)
            problems += [receptors] if isinstance(receptors, Problem) else []
        for i, receptor in enumerate(() if self.map_files.from_file else settings.places):
            if receptor.polygon is not None and (why := crossing(receptor.polygon)):
                problems.append(Problem(("receptors", i, "polygon"), f"{SIMPLE}, found {why}"))
        listed = settings.places if domain is not None and not self.map_files.from_file else ()
        for i, receptor in enumerate(listed):
            assert domain is not None
            part = part_inside(receptor, domain)
            path: Path = ("receptors", i)
            bounds = "x [{:.12g}, {:.12g}] and y [{:.12g}, {:.12g}]".format(*domain.x, *domain.y)
            if part == 0:
                x, y = receptor.corners[0]
                found = f"expected places in the domain, {bounds}, found [{x:.12g}, {y:.12g}]"
                if settings.on_surface and domain.holds(y, x):
                    found += "; exchange them: eastings come first"
                problems.append(Problem(path, found))
            elif part < 1:
                self.cut[path] = f"sticks out of the domain, {bounds}; the part inside counts"
        if domain is not None and self.map_files.held is not None:
            raster = next(iter(self.map_files.held.rasters.values()))
            for line in on_no_data(settings.places, raster):
                self.cut["receptors",] = line
        return problems

    def _on_map(self, settings: Settings, ground: Georeference) -> list[Problem]:
        """List what is wrong with a georeference and what is given in its coordinates."""
        problems = []
        doubt = reference_system.doubt(ground)
        if doubt is not None:
            name, found = doubt
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

    def warnings(self, settings: Settings) -> list[tuple[Path, str]]:
        """List what to warn of, each with its path."""
        lost = [
            (path, f"{volume:.3g} m3 ({percent(part)}) lie outside the domain and are lost")
            for path, (volume, part) in self.lost.items()
        ]
        short = [
            (path, f"the table covers x from 0 to {length:.6g} m; beyond, its end slopes go on")
            for path, length in self.short.items()
        ]
        files: list[tuple[Path, str]] = [
            (("terrain", "file"), f"{name}: {doubt}")
            for name, table in self.tables.items()
            for doubt in table.doubts
        ]
        files += [(path, line) for (path, _), line in self.map_files.doubts.items()]
        ground = settings.georeference
        if ground is not None and (strange := reference_system.elsewhere(ground.crs, *ground.origin)):
            files.append((("georeference", "origin"), f"it lies {strange}"))
        late = [
            (path, f"{percent(share)} of the volume come in after the end of the run, and are left out")
            for path, share in self.late.items()
        ]
        drawn = [
            *_far_out(settings),
            *_uneven(settings),
            *_weak_levels(settings),
            *reversed_periods(settings),
        ]
        depths = {} if self.map_files.held is None else self.map_files.held.depths
        raster = [told for each in depths.values() for told in of_depths(each.elevation)]
        odd = [*self.unusual.items(), *raster]
        kept = [*_left_out(settings), *_densities(settings), *_odd_sections(settings)]
        found = [*files, *lost, *short, *odd, *late, *self.cut.items(), *kept, *drawn]
        return [(self._written(path), told) for path, told in found]

    def _points(self, settings: Settings) -> list[Problem]:
        """Read the file of a ``file`` layout, once, and list what is wrong with its points."""
        if not isinstance(settings.points, FilePoints) or self.points is not None:
            return []
        path: Path = ("points", "path")
        file = self._read(settings.points.path, path, point_file.read)
        if isinstance(file, list):
            return file
        self.points = file
        try:
            solver_objects.points(settings, file)
        except ValueError as error:
            return [Problem(path, f"expected points that fit, found {error}", related=(path, ("domain",)))]
        return []

    def _hydrographs(self, settings: Settings) -> list[Problem]:
        """Read the files of hydrographs, each once, and list what is wrong with hydrographs."""
        problems: list[Problem] = []
        for i, inflow in enumerate(settings.inflow):
            if inflow.file is None:
                continue
            table = self._read(inflow.file, ("inflow", i, "hydrograph", "file"), hydrograph_table.read)
            if isinstance(table, list):
                problems += table
            else:
                self.hydrographs[inflow.file] = table
        if any(name not in self.hydrographs for name in settings.hydrograph_files):
            return problems
        graphs = solver_objects.graphs(settings, self.hydrographs)
        for i, graph in enumerate(graphs):
            self.unusual |= of_hydrograph(float(graph.discharges.max()), ("inflow", i, "hydrograph"))
        if settings.time.end is None:
            last = max((each.last for each in graphs), default=0.0)
            self.last_inflow = max(self.last_inflow, last)
            return problems if settings.domain is None else problems + _too_many(settings.fed_until(last))
        end = settings.time.end
        for i, graph in enumerate(graphs):
            path: Path = ("inflow", i, "hydrograph")
            whole, start = float(graph.volumes[-1]), float(graph.times[0])
            late = 1.0 - graph.volume_until(end) / whole
            if late >= 1.0:
                found = f"expected a hydrograph that begins before the end of the run, {end:g} s"
                problems.append(Problem(path, f"{found}, found one from {start:g} s on"))
            elif late > ROUND_OFF:
                self.late[path] = max(self.late.get(path, 0.0), late)
        return problems

    def _table(self, settings: Settings) -> list[Problem]:
        """Read the table of a ``table`` profile, once, and list what is wrong with it."""
        if (name := settings.table_file) is None:
            return []
        path: Path = ("terrain", "file")
        table = self._read(name, path, elevation_table.read)
        if isinstance(table, list):
            return table
        self.tables[name] = table
        self._note_smoothing(settings, table)
        length = _length(settings.terrain, table)
        if settings.domain is not None and (settings.domain.x[0] < 0 or settings.domain.x[1] > length):
            self.short[path] = length
        return []

    def _note_smoothing(self, settings: Settings, table: ElevationTable) -> None:
        """Remember a smoothing that leaves little of the shape of a table."""
        smoothing = float(getattr(settings.terrain, "smoothing"))  # noqa: B009
        covered = float(table.distances[-1] - table.distances[0])
        if smoothing > LARGE_SMOOTHING * covered:
            self.unusual["terrain", "smoothing"] = (
                f"{smoothing:g} m round off the shape of a table of {covered:g} m; a few distances between "
                f"its points, {np.diff(table.distances).mean():.3g} m in the mean, are usual"
            )

    def _read(self, name: str, path: Path, read: Callable[[FilePath], T]) -> T | list[Problem]:
        """Read a file, once, or list what keeps it from being read; mistakes in it are noted once."""
        if name not in self.files:
            try:
                self.files[name] = read(self.folder / name)
            except OSError as error:
                found = f"expected a readable file, found {error.strerror}: {self.folder / name}"
                self.files[name] = [Problem(path, found)]
            except BadInput as error:
                self.mistakes += error.mistakes
                self.files[name] = []
        found_before: T | list[Problem] = self.files[name]
        return found_before


def _too_many(settings: Settings) -> list[Problem]:
    """List frames and samples that are too many until after the last of what comes in."""
    end, found = settings.latest_end, []
    for path, every, most, what in (
        (("time", "output_every"), settings.time.output_every, MOST_FRAMES, "frames"),
        (("output", "section_every"), settings.output.section_every, MOST_SAMPLES, "samples"),
    ):
        if every is not None and end / every > most:
            said = f"expected at most {most:,} {what} until {end:g} s, found {end / every:.3g}"
            related: tuple[Path, ...] = (path, ("time", "end"), ("inflow",))
            found.append(Problem(path, f"{said}; write {end / most:.3g} or more", related=related))
    return found


def _erodible(settings: Settings, extent: tuple[Pair, Pair]) -> list[Problem]:
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
def _lost(shape: Release, extent: tuple[Pair, Pair]) -> tuple[float, float]:
    """Volume of a release, m3, and the part of it outside the domain, 1 where nothing is inside."""
    whole, outside = shape.shape_volume, shape.volume_outside(*extent)
    if not (isfinite(whole) and isfinite(outside)):
        raise OverflowError("a volume that is no finite number")
    return whole, outside / whole


def _zones(settings: Settings) -> list[Problem]:
    """List what is wrong with the corners of zones."""
    found, domain = [], settings.domain
    for i, zone in enumerate(settings.zones):
        path: Path = ("material", "zones", i, "polygon")
        if not isinstance(zone.polygon, tuple):
            continue
        if why := crossing(zone.polygon):
            found.append(Problem(path, f"{SIMPLE}, found {why}"))
        elif domain is not None and not reaches(
            [[solver_objects.counter_clockwise(np.array(zone.polygon))]], domain.x, domain.y
        ):
            found.append(Problem(path, OUTSIDE, related=(path, ("domain",))))
    return found


def _crossing_structures(settings: Settings) -> list[Problem]:
    """List the basins and buildings whose corners are no simple polygon."""
    found = []
    for i, structure in enumerate(settings.structures):
        name, place = place_of(structure)
        if name == "polygon" and not isinstance(place, str) and (why := crossing(place)):
            found.append(Problem(("structures", i, name), f"{SIMPLE}, found {why}"))
    return found


@lru_cache(maxsize=1024)
def _slope(terrain: AnyTerrain, table: ElevationTable | None) -> SlopeProfile:
    return solver_objects.slope(terrain, table)


def _length(terrain: AnyTerrain, table: ElevationTable) -> float:
    """Arc length that a table covers, m."""
    return float(getattr(_slope(terrain, table), "length", float("inf")))


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
        at = [(("sample", "levels", i, "count"), each.count) for i, each in enumerate(sample.levels)]
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
