"""What a scenario file must be beyond its schema: releases inside the domain, tables and sweeps that hold."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field, replace
from functools import lru_cache
from math import isfinite
from pathlib import Path as FilePath
from typing import Any, TypeVar

import numpy as np

from pipeline.inputs import elevation_table, hydrograph_table, point_file, reference_system
from pipeline.inputs.elevation_table import ElevationTable
from pipeline.inputs.ground import Ground
from pipeline.inputs.hydrograph_table import HydrographTable
from pipeline.inputs.missing_files import missing_files, not_found
from pipeline.inputs.point_file import PointFile
from pipeline.mistakes import BadInput, Mistake, Problem
from pipeline.readable import percent
from pipeline.scenario import endless, solver_objects, structures
from pipeline.scenario.ground import GroundCheck
from pipeline.scenario.places import (
    crossing_structures,
    erodible_outside,
    lost,
    on_bed,
    on_no_data,
    receptors_on_bed,
    receptors_outside,
    refined_at,
    unknown_receptors,
    varied_places,
    wrong_zones,
    wrongly_on_map,
)
from pipeline.scenario.plausibility import doubtful, of_depths, of_hydrograph, unusual
from pipeline.scenario.schema_errors import check
from pipeline.scenario.strict_yaml import Document, Path
from pipeline.scenario.sweep_checks import check_design, periods_of_polygons, twice_named
from pipeline.settings.hazard import Georeference
from pipeline.settings.physics import AnyTerrain
from pipeline.settings.points import FilePoints
from pipeline.settings.settings import (
    MOST_FRAMES,
    MOST_SAMPLES,
    OF_POLYGONS,
    Settings,
)
from solver.physics.elevation import ElevationModel
from solver.physics.terrain import SlopeProfile

T = TypeVar("T")
# of the length of a table
LARGE_SMOOTHING = 0.25
# of a volume
ROUND_OFF = 1e-9


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
    known = {problem.path for problem in problems}
    problems += [each for each in missing_files(document.data, folder) if each.path not in known]
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
        problems += wrong_zones(settings) + crossing_structures(settings)
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
        """Give settings with releases, receptors and points around them on the bed, and with their domain."""
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
            return refined_at(settings.places, settings)
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
        return refined_at(changed["receptors"], settings.model_copy(update=changed))

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
        among, outlines = None, None if self.map_files.held is None else self.map_files.held.outlines
        if any(each.kind == "building" for each in settings.structures):
            points = structures.points(settings, self.points, outlines)
            built = structures.buildings(settings, points, outlines)
            among = None if built is None else (points, built)
        return [
            Problem(
                (name, i, "section" if name == "inflow" else "line"),
                message,
                related=((name, i), ("material",), ("terrain",), ("domain",), ("structures",)),
            )
            for name, i, message in solver_objects.misplaced(
                settings, terrain, self.hydrographs, among, outlines
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
        problems = self._structures(settings) + erodible_outside(settings, extent)
        for i, release in enumerate(solver_objects.releases(settings)):
            path: Path = ("release", i) if isinstance(settings.release, tuple) else ("release",)
            whole, part = lost(replace(release, volume=None, velocity=(0.0, 0.0)), extent)
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
        judged = structures.judge(settings, None, None, self.points)
        self.map_files.doubts |= {(path, ""): line for path, line in judged.doubts.items()}
        if judged.problems or judged.buildings is None:
            return list(judged.problems)
        return structures.overlapping_shapes(settings, judged)

    def for_all_runs(self, settings: Settings) -> list[Problem]:
        """List what is wrong with what is said of all runs; receptors are in coordinates of the bed."""
        problems = [] if settings.georeference is None else wrongly_on_map(settings, settings.georeference)
        problems += varied_places(settings) + unknown_receptors(settings)
        domain = settings.domain
        if not isinstance(settings.receptors, tuple):
            receptors = self.map_files.receptors(settings)
            problems += [receptors] if isinstance(receptors, Problem) else []
        if not self.map_files.from_file:
            wrong, cut = receptors_outside(settings)
            problems += wrong
            self.cut |= cut
        if domain is not None and self.map_files.held is not None:
            raster = next(iter(self.map_files.held.rasters.values()))
            for line in on_no_data(settings.places, raster):
                self.cut["receptors",] = line
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
        depths = {} if self.map_files.held is None else self.map_files.held.depths
        raster = [told for each in depths.values() for told in of_depths(each.elevation)]
        odd = [*self.unusual.items(), *raster]
        found = [*files, *lost, *short, *odd, *late, *self.cut.items(), *doubtful(settings)]
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
            except FileNotFoundError:
                self.files[name] = [Problem(path, not_found(self.folder / name))]
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


@lru_cache(maxsize=1024)
def _slope(terrain: AnyTerrain, table: ElevationTable | None) -> SlopeProfile:
    return solver_objects.slope(terrain, table)


def _length(terrain: AnyTerrain, table: ElevationTable) -> float:
    """Arc length that a table covers, m."""
    return float(getattr(_slope(terrain, table), "length", float("inf")))
