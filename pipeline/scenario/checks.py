"""What a scenario file must be beyond its schema: releases inside the domain, tables and sweeps that hold."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field, replace
from functools import lru_cache
from pathlib import Path as FilePath
from typing import Any, TypeVar

from pipeline.mistakes import BadInput, Mistake
from pipeline.scenario import elevation_table, point_file, solver_objects
from pipeline.scenario.elevation_table import ElevationTable
from pipeline.scenario.point_file import PointFile
from pipeline.scenario.schema_errors import Problem, check
from pipeline.scenario.strict_yaml import Document, Path
from pipeline.scenario.sweep_checks import check_design
from pipeline.settings.generated import Generated
from pipeline.settings.points import FilePoints
from pipeline.settings.section import Pair
from pipeline.settings.settings import Settings
from solver.release.shapes import Release

T = TypeVar("T")
# angles of friction, and what is rather a coefficient than an angle, degrees
FRICTION_ANGLES = ("bed_friction", "internal_friction")
LEAST_ANGLE = 1.0


@dataclass
class Checked:
    """What came of checking one file; ``settings`` is None where there is a mistake."""

    settings: Settings | None = None
    tables: dict[str, ElevationTable] = field(default_factory=dict)
    points: PointFile | None = None
    mistakes: list[Mistake] = field(default_factory=list)
    warnings: tuple[str, ...] = ()


def check_document(document: Document, folder: FilePath) -> Checked:
    """Check one file and every run of its design; tables are looked for relative to ``folder``."""
    if document.mistakes and not document.data:
        return Checked()
    judge = _Judge(folder)
    problems = check(document.data)
    settings = None if isinstance(problems, list) else problems
    sample = None if settings is None else settings.sample
    problems = problems if isinstance(problems, list) else judge.problems(problems)
    judge.lost.clear()
    judge.flat.clear()
    problems += check_design(document.data, sample, problems, judge.check)
    told = {(mistake.line, mistake.column) for mistake in document.mistakes}
    mistakes = [document.mistake(p.path, p.message, at_key=p.at_key) for p in problems]
    mistakes = [mistake for mistake in mistakes if (mistake.line, mistake.column) not in told]
    mistakes += judge.mistakes
    if mistakes:
        return Checked(mistakes=mistakes)
    warnings = (document.mistake(path, message) for path, message in judge.warnings())
    return Checked(settings, judge.tables, judge.points, [], tuple(map(str, warnings)))


class _Judge:
    """Judges settings that keep to the schema, and remembers what to warn of."""

    def __init__(self, folder: FilePath) -> None:
        self.folder = folder
        self.tables: dict[str, ElevationTable] = {}
        self.mistakes: list[Mistake] = []
        self.lost: dict[Path, tuple[float, float]] = {}
        self.short: dict[Path, float] = {}
        self.flat: dict[Path, float] = {}
        self.points: PointFile | None = None
        self.files: dict[str, Any] = {}

    def check(self, data: Mapping[str, Any]) -> list[Problem]:
        """List all that is wrong with the data of one run."""
        settings = check(data)
        return settings if isinstance(settings, list) else self.problems(settings)

    def problems(self, settings: Settings) -> list[Problem]:
        """List what is wrong with settings that keep to the schema."""
        problems = self._table(settings) + self._points(settings)
        for name in FRICTION_ANGLES:
            angle = getattr(settings.material, name)
            if angle is not None and 0 < angle < LEAST_ANGLE:
                self.flat["material", name] = angle
        if settings.domain is None:
            return problems
        extent = solver_objects.extent(settings)
        for i, release in enumerate(solver_objects.releases(settings)):
            path: Path = ("release", i) if isinstance(settings.release, tuple) else ("release",)
            whole, part = _lost(replace(release, volume=None, velocity=(0.0, 0.0)), extent)
            if part >= 1:
                (x0, x1), (y0, y1) = settings.domain.x, settings.domain.y
                found = (
                    f"expected a release inside the domain, x [{x0:g}, {x1:g}] and y [{y0:g}, {y1:g}], "
                    "found one wholly outside it"
                )
                problems.append(Problem(path, found, related=(path, ("domain",))))
            elif part > 0:
                volume = part * (whole if release.volume is None else release.volume)
                self.lost[path] = max(self.lost.get(path, (0.0, 0.0)), (volume, part))
        return problems

    def warnings(self) -> list[tuple[Path, str]]:
        """List what to warn of, each with its path."""
        lost = [
            (path, f"{volume:.3g} m3 ({100 * part:.2g} %) lie outside the domain and are lost")
            for path, (volume, part) in self.lost.items()
        ]
        short = [
            (path, f"the table covers x from 0 to {length:.6g} m; beyond, its end slopes go on")
            for path, length in self.short.items()
        ]
        flat = [
            (path, f"{angle:g} degrees are nearly none; mu = {angle:g} is written as friction_coefficient")
            for path, angle in self.flat.items()
        ]
        return lost + short + flat

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

    def _table(self, settings: Settings) -> list[Problem]:
        """Read the table of a ``table`` profile, once, and list what is wrong with it."""
        if (name := settings.table_file) is None:
            return []
        path: Path = ("terrain", "file")
        table = self._read(name, path, elevation_table.read)
        if isinstance(table, list):
            return table
        self.tables[name] = table
        length = _length(settings.terrain, table)
        if settings.domain is not None and (settings.domain.x[0] < 0 or settings.domain.x[1] > length):
            self.short[path] = length
        return []

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


@lru_cache(maxsize=1024)
def _lost(shape: Release, extent: tuple[Pair, Pair]) -> tuple[float, float]:
    """Volume of a release, m3, and the part of it outside the domain, 1 where nothing is inside."""
    return shape.shape_volume, shape.volume_outside(*extent) / shape.shape_volume


@lru_cache(maxsize=1024)
def _length(terrain: Generated, table: ElevationTable) -> float:
    """Arc length that a table covers, m."""
    slope = solver_objects.slope(terrain, table)
    return float(getattr(slope, "length", float("inf")))
