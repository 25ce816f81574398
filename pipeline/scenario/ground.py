"""Elevation models and release polygons of a scenario: read, checked, and the domain that they leave."""

from __future__ import annotations

import hashlib
from collections.abc import Mapping
from dataclasses import dataclass, field
from pathlib import Path as FilePath
from typing import Any

import numpy as np

from pipeline.inputs import elevation_raster, outlines
from pipeline.inputs.elevation_raster import ElevationRaster, ElevationRasterError
from pipeline.inputs.outlines import Outline, OutlineError
from pipeline.inputs.polygons import reaches
from pipeline.mistakes import Problem
from pipeline.scenario import solver_objects, structures
from pipeline.scenario.places import part_inside
from pipeline.scenario.solver_objects import Outlines
from pipeline.scenario.strict_yaml import Path
from pipeline.settings.receptor import Receptor
from pipeline.settings.section import Pair
from pipeline.settings.settings import Domain, Settings
from pipeline.settings.structures import place_of
from pipeline.settings.surface import ElevationTerrain, PolygonsRelease
from solver.physics.elevation import SAME, ElevationModel
from solver.points.lattice import Lattice
from solver.release.polygons import polygon_shares, ring_area

# Spacings that are finer than the elevation model by more than this show nothing more of the ground.
FINER = 4.0
# no bed of loose material is steeper, degrees
STEEP = 60.0
LONGEST_NAME = 100
# of a polygon, or of a domain
SLIVER = 1e-9
OUTSIDE = "expected a zone in the domain, found one outside, which changes nothing"


@dataclass(frozen=True, eq=False)
class Ground:
    """What the files of a scenario on an elevation model hold.

    Parameters
    ----------
    raster : ElevationRaster
        The elevation model, around the domain.
    outlines : Outlines
        Polygons, and lines of dams, by file and layer.
    depths : mapping of str to ElevationRaster
        Rasters of erodible depth by file.
    """

    raster: ElevationRaster
    outlines: Outlines = field(default_factory=dict)
    depths: Mapping[str, ElevationRaster] = field(default_factory=dict)

    @property
    def digests(self) -> dict[str, Any]:
        """Hashes of all of it that decides a run, by name of file."""
        found = {
            " ".join(filter(None, name)): _digest(held)
            for name, held in sorted(self.outlines.items(), key=str)
        }
        depths = {name: raster.digest for name, raster in sorted(self.depths.items())}
        erodible = {"erodible_depth": depths} if depths else {}
        return {"elevation": self.raster.digest, "polygons": found, **erodible}


def _digest(held: tuple[Outline, ...]) -> str:
    text = "".join(f"{each.name}|{each.attributes.get('depth')}|{each.digest}\n" for each in held)
    return hashlib.sha256(text.encode()).hexdigest()


class GroundCheck:
    """Reads and judges the files of scenarios on elevation models, each file once.

    Parameters
    ----------
    folder : Path
        That names of files are relative to.
    """

    def __init__(self, folder: FilePath) -> None:
        self.folder = folder
        self.doubts: dict[Path, str] = {}
        self._rasters: dict[Any, ElevationRaster | Problem] = {}
        self._outlines: dict[tuple[str, str | None, str, bool], tuple[Outline, ...] | Problem] = {}
        self._judged: dict[Any, structures.Judged] = {}
        self._inside: dict[Any, float] = {}
        self._reach = 0.0
        self.held: Ground | None = None
        self.from_file = False

    def judge(self, settings: Settings) -> tuple[Settings, list[Problem]]:
        """Give settings with their domain, and list what is wrong with their files.

        The files are then in ``held``, those of all runs that were judged.
        """
        terrain = settings.terrain
        assert isinstance(terrain, ElevationTerrain)
        swept = settings.sweep.get("terrain.curvature_length", ())
        lengths = [terrain.length, *(each for each in swept if not isinstance(each, str))]
        spacing = float(getattr(settings.points, "spacing"))  # noqa: B009
        # elevations are averaged from as far away
        self._reach = max(self._reach, 2 * max(spacing, *(float(each or 0.0) for each in lengths)))
        raster = self._raster(terrain, settings.domain)
        if isinstance(raster, Problem):
            return settings, [raster]
        domain = self._domain(settings, raster, spacing)
        if isinstance(domain, Problem):
            return settings, [domain]
        settings = settings.model_copy(update={"domain": domain})
        (x0, x1), (y0, y1) = domain.x, domain.y
        count, most = settings.points.estimate(x1 - x0, y1 - y0), settings.points.most
        if count > most:
            found = f"expected at most {most:,} points, found {count:.3g}; give a domain or a larger spacing"
            return settings, [Problem(("points", "spacing"), found)]
        model = solver_objects.surface(terrain, raster)
        self._note(raster, model, spacing, domain)
        problems, read = [], dict(self.held.outlines if self.held else {})
        depths = dict(self.held.depths if self.held else {})
        for i, release in enumerate(settings.releases):
            assert isinstance(release, PolygonsRelease)
            path: Path = ("release", i) if isinstance(settings.release, tuple) else ("release",)
            held = self._polygons(release.polygons, release.layer, raster.crs, (*path, "polygons"))
            if isinstance(held, Problem):
                problems.append(held)
                continue
            read[release.polygons, release.layer] = held
            problems += self._laid(release, held, path, model, settings)
        for i, zone in enumerate(settings.zones):
            path = ("material", "zones", i, "polygon" if zone.raster is None else "raster")
            if zone.file is None:
                continue
            classes = zone.raster is not None
            held = self._polygons(zone.file, zone.layer, raster.crs, path, of_raster=classes)
            if isinstance(held, Problem):
                problems.append(held)
                continue
            read[zone.file, zone.layer] = held
            try:
                rings = [outline.rings for outline in solver_objects.chosen(zone.picked, held)]
            except ValueError as error:
                problems.append(Problem(path, f"{error} ({zone.file})", related=(path,)))
                continue
            if not reaches(rings, domain.x, domain.y):
                problems.append(Problem(path, f"{OUTSIDE} ({zone.file})", related=(path, ("domain",))))
        problems += self._erodible(settings, raster, read, depths)
        problems += self._structures(settings, raster, read, model, problems)
        self.held = Ground(raster, read, depths)
        return settings, problems

    def _structures(
        self,
        settings: Settings,
        raster: ElevationRaster,
        read: dict[tuple[str, str | None], tuple[Outline, ...]],
        model: ElevationModel,
        before: list[Problem],
    ) -> list[Problem]:
        """Read the files of structures into ``read``, and list what is wrong with structures."""
        problems = []
        for i, name, layer in structures.files(settings):
            structure = settings.structures[i]
            path: Path = ("structures", i, place_of(structure)[0])
            held = self._polygons(name, layer, raster.crs, path, lines=structure.kind == "dam")
            if isinstance(held, Problem):
                problems.append(held)
            else:
                read[name, layer] = held
        if problems or not settings.structures:
            return problems
        key = settings.structures, settings.domain, id(model)
        if key not in self._judged:
            self._judged[key] = structures.judge(settings, model, read)
        judged = self._judged[key]
        self.doubts |= judged.doubts
        if judged.problems or before or judged.buildings is None:
            return list(judged.problems)
        return structures.overlapping(settings, read, judged.buildings)

    def receptors(self, settings: Settings) -> tuple[Receptor, ...] | Problem:
        """Give the receptors of settings; those of a file that are outside the domain are left out."""
        name = settings.receptors
        if not isinstance(name, str) or self.held is None:
            return settings.places
        self.from_file = True
        file, path = self.folder / name, ("receptors",)
        if not file.exists():
            return Problem(path, f"expected a readable file, found none: {file}")
        try:
            held = outlines.read_places(file, self.held.raster.crs)
        except OutlineError as error:
            return Problem(path, f"{error} ({name})")
        made = [
            Receptor.model_validate(
                {"name": each.name[:LONGEST_NAME]}
                | {each.kind: each.corners[0] if each.kind == "point" else each.corners}
            )
            for each in held
        ]
        parts = [part_inside(each, settings.bounds) for each in made]
        inside = [each for each, part in zip(made, parts, strict=True) if part > 0]
        if not inside:
            return Problem(path, f"expected places in the domain, found {len(made)} outside ({name})")
        said = {
            "lie outside the domain and are left out": 0.0,
            "stick out of it; the part inside counts": 0.5,
        }
        told = [f"{parts.count(part)} {words}" for words, part in said.items() if part in parts]
        if told:
            self.doubts[path] = f"of {len(made)} places of {name} {', '.join(told)}"
        return tuple(inside)

    def _raster(self, terrain: ElevationTerrain, domain: Domain | None) -> ElevationRaster | Problem:
        return self._read(terrain.elevation, terrain.crs, domain, ("terrain", "elevation"))

    def _read(
        self, name: str, crs: str | None, domain: Domain | None, path: Path
    ) -> ElevationRaster | Problem:
        bounds: tuple[Pair, Pair] | tuple[None, None] = (None, None)
        if domain is not None:
            bounds = tuple((low - self._reach, high + self._reach) for low, high in (domain.x, domain.y))  # type: ignore[assignment]
        key = name, crs, bounds, path
        if key not in self._rasters:
            file = self.folder / name
            if not file.exists():
                self._rasters[key] = Problem(path, f"expected a readable file, found none: {file}")
            else:
                try:
                    self._rasters[key] = elevation_raster.read(file, crs, *bounds)
                except ElevationRasterError as error:
                    self._rasters[key] = Problem(path, f"{error} ({name})")
        return self._rasters[key]

    def _erodible(
        self,
        settings: Settings,
        raster: ElevationRaster,
        read: dict[tuple[str, str | None], tuple[Outline, ...]],
        depths: dict[str, ElevationRaster],
    ) -> list[Problem]:
        """Read the files of an erodible bed, and list what is wrong with them."""
        bed, domain = settings.erodible_bed, settings.bounds
        if bed is None:
            return []
        path: Path = ("erodible_bed",)
        if bed.raster is not None:
            at = (*path, "depth")
            found = self._read(bed.raster, raster.crs, domain, at)
            if isinstance(found, Problem):
                return [found]
            if found.crs != raster.crs:
                expected = f"expected a raster in the reference system of the elevation model, {raster.crs}"
                return [Problem(at, f"{expected}, found {found.crs} ({bed.raster})")]
            if (low := float(np.nanmin(found.elevation))) < 0:
                return [Problem(at, f"expected depths of at least 0, found {low:g} ({bed.raster})")]
            depths[bed.raster] = found
        if bed.polygons is not None:
            held = self._polygons(bed.polygons, bed.layer, raster.crs, (*path, "polygons"))
            if isinstance(held, Problem):
                return [held]
            read[bed.polygons, bed.layer] = held
            try:
                solver_objects.erodible_polygons(bed, held)
            except ValueError as error:
                return [Problem((*path, "polygons"), f"{error} ({bed.polygons})")]
            lattice = Lattice(domain.x, domain.y, float(getattr(settings.points, "spacing")))  # noqa: B009
            if not any(
                polygon_shares(outline.rings, lattice).any()
                for outline in solver_objects.chosen(bed.name, held)
            ):
                bounds = "x [{:.12g}, {:.12g}] and y [{:.12g}, {:.12g}]".format(*domain.x, *domain.y)
                wanted = f"expected an erodible bed in the domain, {bounds}"
                return [Problem((*path, "polygons"), f"{wanted}, found polygons outside ({bed.polygons})")]
        return []

    def _domain(self, settings: Settings, raster: ElevationRaster, spacing: float) -> Domain | Problem:
        """Give the domain asked for, or all of the elevation model, in whole cells.

        Where spacings agree its points are the centres of the elevation model's cells.
        """
        asked, half, found = settings.domain, raster.spacing / 2, {}
        alike = abs(spacing - raster.spacing) < SAME * raster.spacing
        for axis, centres in (("x", raster.x), ("y", raster.y)):
            first, last = float(centres[0]), float(centres[-1])
            low, high = (first, last) if asked is None else getattr(asked, axis)
            if low < first - half - SLIVER * raster.spacing or high > last + half + SLIVER * raster.spacing:
                covered = f"{axis} from {first - half:.12g} to {last + half:.12g}"
                wanted = f"expected a domain on the elevation model, which covers {covered} m"
                return Problem(("domain", axis), f"{wanted}, found [{low:.12g}, {high:.12g}]")
            if alike:
                # to the centres within
                start, stop = (
                    int(np.ceil((low - first) / spacing - SAME)),
                    int(np.floor((high - first) / spacing + SAME)),
                )
                start, stop = max(start, 0), min(stop, len(centres) - 1)
                low, high = float(centres[start]), float(centres[max(stop, start)])
            else:
                high = low + spacing * np.floor((high - low) / spacing + SAME)
            if high - low < 3.5 * spacing:
                message = f"expected 4 cells or more along {axis}, found {high - low:g} m at {spacing:g} m"
                return Problem(("domain", axis) if asked else ("points", "spacing"), message)
            found[axis] = float(f"{low:.12g}"), float(f"{high:.12g}")
        return Domain(**found)

    def _note(self, raster: ElevationRaster, model: ElevationModel, spacing: float, domain: Domain) -> None:
        """Remember what is doubtful of an elevation model and a spacing."""
        terrain: Path = ("terrain", "elevation")
        if raster.spacing > FINER * spacing * (1 + SAME):
            self.doubts["points", "spacing"] = (
                f"{spacing:g} m is more than {FINER:g} times finer than the elevation model of "
                f"{raster.spacing:g} m, which shows nothing more of the ground"
            )
        if terrain in self.doubts:
            return
        lattice = Lattice(domain.x, domain.y, spacing)
        said = []
        gaps = float(model.gaps(lattice.x_points, lattice.y_points).mean())
        if gaps > 0:
            said.append(f"{100 * gaps:.2g} % of the domain have no data; what flows there has left")
        with np.errstate(invalid="ignore"):
            slope = np.degrees(np.arctan(np.hypot(*np.gradient(raster.elevation, raster.spacing))))
            steep = float((slope > STEEP).mean())
        if steep > 0:
            said.append(f"{100 * steep:.2g} % of the cells are steeper than {STEEP:g} degrees")
        if said:
            self.doubts[terrain] = "; ".join(said)

    def _polygons(
        self,
        name: str,
        layer: str | None,
        crs: str,
        path: Path,
        *,
        of_raster: bool = False,
        lines: bool = False,
    ) -> tuple[Outline, ...] | Problem:
        """Read the polygons of a file, those of the classes of a raster, or its lines."""
        key = name, layer, crs, lines
        if key not in self._outlines:
            file = self.folder / name
            if not file.exists():
                self._outlines[key] = Problem(path, f"expected a readable file, found none: {file}")
            else:
                try:
                    if of_raster:
                        self._outlines[key] = outlines.read_classes(file, crs)
                    else:
                        read = outlines.read_lines if lines else outlines.read
                        self._outlines[key] = read(file, crs, layer)
                except OutlineError as error:
                    self._outlines[key] = Problem(path, f"{error} ({name})")
        return self._outlines[key]

    def _laid(
        self,
        release: PolygonsRelease,
        held: tuple[Outline, ...],
        path: Path,
        model: ElevationModel,
        settings: Settings,
    ) -> list[Problem]:
        """List what is wrong with the polygons of a release on the lattice."""
        try:
            solver_objects.polygon_releases(release, held)
        except ValueError as error:
            return [Problem(path, f"{error} ({release.polygons})", related=(path,))]
        domain, spacing = settings.bounds, float(getattr(settings.points, "spacing"))  # noqa: B009
        lattice = Lattice(domain.x, domain.y, spacing)
        problems = []
        for outline in solver_objects.chosen(release.name, held):
            where = f"'{outline.name}' of {release.polygons}"
            size = sum(map(ring_area, outline.rings))
            if size < spacing**2:
                wanted = f"expected polygons of a cell, {spacing**2:g} m2, or more"
                problems.append(Problem(path, f"{wanted}, found {where} of {size:.3g} m2"))
                continue
            key = id(outline), id(model), lattice
            if key not in self._inside:
                known = ~model.gaps(lattice.x_points, lattice.y_points)
                self._inside[key] = float((polygon_shares(outline.rings, lattice) * known).sum())
            inside = self._inside[key] * spacing**2 / size
            if inside <= SLIVER:
                bounds = "x [{:.12g}, {:.12g}] and y [{:.12g}, {:.12g}]".format(*domain.x, *domain.y)
                wanted = f"expected a release in the domain, {bounds}, where there is data"
                problems.append(
                    Problem(path, f"{wanted}, found {where} outside", related=(path, ("domain",)))
                )
            elif inside < 1 - SLIVER:
                lost = f"{100 * (1 - inside):.2g} % of {where} lie outside the domain or on no data"
                self.doubts[path] = f"{lost} and are lost"
        return problems


def of_run(settings: Settings, outlines: Mapping[tuple[str, str | None], tuple[Outline, ...]]) -> Outlines:
    """Pick what releases, zones, erodible bed and structures of a run are made of, by file and layer."""
    wanted = [(each.polygons, each.layer) for each in settings.releases if isinstance(each, PolygonsRelease)]
    wanted += [(zone.file, zone.layer) for zone in settings.zones if zone.file is not None]
    bed = settings.erodible_bed
    if bed is not None and bed.polygons is not None:
        wanted.append((bed.polygons, bed.layer))
    wanted += [(name, layer) for _, name, layer in structures.files(settings)]
    return {key: outlines[key] for key in dict.fromkeys(wanted)}
