"""Elevation models and release polygons of a scenario: read, checked, and the domain that they leave."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from pathlib import Path as FilePath
from typing import Any

import numpy as np
from numpy.typing import NDArray

from pipeline.hints import of_place
from pipeline.inputs.elevation_raster import ElevationRaster, RasterExtent
from pipeline.inputs.ground import SLIVER, Ground, around, beyond, doubtful, fitted
from pipeline.inputs.map_files import MapFiles
from pipeline.inputs.outlines import Outline
from pipeline.inputs.polygons import overlaps, reaches, width
from pipeline.inputs.reference_system import called, elsewhere, same, stretched
from pipeline.mistakes import Problem
from pipeline.readable import percent
from pipeline.scenario import solver_objects, structures
from pipeline.scenario.places import (
    OUTSIDE,
    follows_receptors,
    listed,
    near,
    off_the_model,
    part_inside,
    refined_at,
)
from pipeline.scenario.plausibility import DEEP, too_deep
from pipeline.scenario.solver_objects import Outlines
from pipeline.scenario.strict_yaml import Path
from pipeline.settings.receptor import Receptor, source_of
from pipeline.settings.section import Pair
from pipeline.settings.settings import Domain, Settings
from pipeline.settings.structures import place_of
from pipeline.settings.surface import ElevationTerrain, PolygonsRelease
from solver.physics.elevation import SAME, ElevationModel
from solver.points.lattice import Lattice
from solver.release.polygons import PolygonRelease, polygon_shares, ring_area

# Spacings that are finer than the elevation model by more than this show nothing more of the ground.
FINER = 4.0
LONGEST_NAME = 100


class GroundCheck:
    """Reads and judges the files of scenarios on elevation models, each file once.

    Where a scenario gives no domain, what is near its releases is judged, and the rest once the domain is
    found.

    Parameters
    ----------
    folder : Path
        That names of files are relative to.
    """

    def __init__(self, folder: FilePath) -> None:
        self.folder = folder
        self._files = MapFiles(folder)
        self.doubts = self._files.doubts
        self._judged: dict[Any, structures.Judged] = {}
        self._inside: dict[Any, float] = {}
        self._noted: set[str] = set()
        self._overlaps: dict[Any, list[tuple[float, int, int]]] = {}
        self._reach = 0.0
        self._extent: RasterExtent | None = None
        self.held: Ground | None = None
        self.from_file = False

    def judge(self, settings: Settings) -> tuple[Settings, list[Problem]]:
        """Give settings with their domain, and list what is wrong with their files.

        Of settings without one the domain is what is around their places. The files are then in ``held``,
        those of all runs that were judged.
        """
        terrain = settings.terrain
        assert isinstance(terrain, ElevationTerrain)
        swept = settings.sweep.get("terrain.curvature_length", ())
        lengths = [terrain.length, *(each for each in swept if not isinstance(each, str))]
        spacing = float(getattr(settings.points, "spacing"))  # noqa: B009
        closest = float(getattr(settings.points, "closest", spacing))
        # elevations are averaged from as far away
        self._reach = max(self._reach, 2 * max(spacing, *(float(each or 0.0) for each in lengths)))
        at: Path = ("terrain", "elevation")
        extent = self._files.extent(terrain.elevation, terrain.crs, at)
        if isinstance(extent, Problem):
            return settings, [extent]
        if terrain.crs is not None and not same(terrain.crs, extent.crs):
            wanted = (
                f"expected {called(extent.crs)}, the reference system of the file itself, found {terrain.crs}"
            )
            return settings, [Problem(("terrain", "crs"), f"{wanted}; leave it out ({terrain.elevation})")]
        first = self._extent = extent if self.held is None else self.held.extent
        if extent.crs != first.crs:
            wanted = f"expected elevation models in one reference system, {called(first.crs)}"
            return settings, [Problem(at, f"{wanted}, found {called(extent.crs)} ({terrain.elevation})")]
        read, problems = self._outlines(settings, extent.crs)
        asked = settings.domain
        if asked is None:
            if problems:
                return settings, problems
            try:
                if problems := off_the_model(settings, read, first):
                    return settings, problems
                asked = near(settings, read, first)
            except ValueError as error:
                files = ", ".join(dict.fromkeys(name for _, name, _, _ in _wanted(settings)))
                return settings, [Problem(("release",), f"{error} ({files})")]
        domain = fitted(asked, first, spacing)
        if isinstance(domain, Problem):
            return settings, [domain]
        if (uncovered := beyond(domain, extent)) is not None:
            return settings, [uncovered]
        (x0, x1), (y0, y1) = domain.x, domain.y
        count, most = settings.points.estimate(x1 - x0, y1 - y0), settings.points.most
        if count > most:
            found = f"expected at most {most:,} points, found {count:.3g}; give a domain or a larger spacing"
            return settings, [Problem(("points", "spacing"), found)]
        bounds = around(asked, self._reach)
        raster = self._files.raster(terrain.elevation, terrain.crs, bounds, at)
        if isinstance(raster, Problem):
            return settings, [raster]
        whole = None if settings.domain is not None else Domain(x=first.x, y=first.y)
        settings = settings.model_copy(update={"domain": domain})
        if follows_receptors(settings):
            receptors = self._receptors(settings, first.crs, first)
            settings = settings if isinstance(receptors, Problem) else refined_at(receptors, settings)
        model = solver_objects.surface(terrain, raster)
        self._note(terrain.elevation, raster, extent, closest, domain, known=whole is None)
        depths = dict(self.held.depths if self.held else {})
        problems += self._releases(settings, read, model, known=whole is None)
        problems += self._zones(settings, read, whole or domain)
        problems += self._erodible(settings, raster, read, depths, whole)
        problems += self._structures(settings, read, model, problems, searched=whole is not None)
        before: Mapping[str, ElevationRaster] = {} if self.held is None else self.held.rasters
        held = {} if self.held is None else self.held.outlines
        self.held = Ground(
            rasters={**before, terrain.elevation: raster},
            extent=first,
            folder=self.folder,
            given_crs=terrain.crs,
            reach=self._reach,
            outlines={**held, **read},
            depths=depths,
        )
        return settings, problems

    def _outlines(
        self, settings: Settings, crs: str
    ) -> tuple[dict[tuple[str, str | None], tuple[Outline, ...]], list[Problem]]:
        """Read the polygons and lines of settings, and list what is wrong with their files."""
        read: dict[tuple[str, str | None], tuple[Outline, ...]] = {}
        problems: list[Problem] = []
        for path, name, layer, kind in _wanted(settings):
            held = self._files.outlines(name, layer, crs, path, kind)
            if isinstance(held, Problem):
                problems.append(held)
            else:
                read[name, layer] = held
        return read, problems

    def _releases(
        self, settings: Settings, read: Outlines, model: ElevationModel, *, known: bool
    ) -> list[Problem]:
        problems, laid = [], []
        for i, release in enumerate(settings.releases):
            assert isinstance(release, PolygonsRelease)
            path: Path = ("release", i) if isinstance(settings.release, tuple) else ("release",)
            held = read.get((release.polygons, release.layer))
            if held is not None:
                wrong = self._laid(release, held, path, model, settings, known=known)
                problems += wrong
                if wrong:
                    continue
                named = [each for each in held if release.name in (None, each.name)]
                made = solver_objects.polygon_releases(release, held)
                # polygons of one volume have one depth
                depths = {id(ring): _depth(each) for each in made for ring in each.rings}
                laid += [(release.polygons, each, depths[id(each.rings[0])]) for each in named]
                if release.name is not None and len(named) > 1:
                    twice = f"{len(named)} polygons of {release.polygons} are called '{release.name}'"
                    self.doubts[path, "name"] = f"{twice}, and all of them are released"
        if not problems:
            self._add_up(laid, settings)
        return problems

    def _add_up(self, laid: list[tuple[str, Outline, float]], settings: Settings) -> None:
        """Remember that polygons of a run overlap, where what they release adds up.

        laid : file, polygon and depth, m, of each.
        """
        key = tuple(id(outline) for _, outline, _ in laid)
        if key not in self._overlaps:
            self._overlaps[key] = overlaps([outline.rings for _, outline, _ in laid])
        cell = float(getattr(settings.points, "closest", getattr(settings.points, "spacing"))) ** 2  # noqa: B009
        found = [each for each in self._overlaps[key] if each[0] >= cell]
        if not found:
            return
        area, *pair = found[0]
        sizes = [sum(map(ring_area, laid[i][1].rings)) for i in pair]
        one, other = (f"'{laid[i][1].name}' of {laid[i][0]}" for i in pair)
        more = f", and {len(found) - 1} more pairs do" if len(found) > 1 else ""
        told = f"{one} and {other} overlap by {area:.4g} m2, {100 * area / min(sizes):.3g} % of the smaller"
        fix = "sweep `release.name` for events of their own, or cut one out of the other"
        if area > (1 - SLIVER) * max(sizes):
            told, fix = f"{one} and {other} are the same polygon", "leave one out"
        one, other = (f"{laid[i][2]:.3g}" for i in pair)
        self.doubts[("release",), "overlap"] = f"{told}{more}; {one} and {other} m add up there: {fix}"

    def _zones(self, settings: Settings, read: Outlines, domain: Domain) -> list[Problem]:
        problems = []
        for of_zone, zone in settings.all_zones:
            path: Path = (*of_zone, "polygon" if zone.raster is None else "raster")
            held = None if zone.file is None else read.get((zone.file, zone.layer))
            if held is None:
                continue
            try:
                rings = [outline.rings for outline in solver_objects.chosen(zone.picked, held)]
            except ValueError as error:
                problems.append(Problem(path, f"{error} ({zone.file})", related=(path,)))
                continue
            if not reaches(rings, domain.x, domain.y):
                problems.append(Problem(path, f"{OUTSIDE} ({zone.file})", related=(path, ("domain",))))
        return problems

    def _structures(
        self,
        settings: Settings,
        read: Outlines,
        model: ElevationModel,
        before: list[Problem],
        *,
        searched: bool,
    ) -> list[Problem]:
        """List what is wrong with structures whose files were read."""
        unread = any((name, layer) not in read for _, name, layer in structures.files(settings))
        if unread or not settings.structures:
            return []
        key = settings.structures, settings.domain, id(model)
        if key not in self._judged:
            self._judged[key] = structures.judge(settings, model, read, searched=searched)
        judged = self._judged[key]
        self.doubts |= {(path, ""): line for path, line in judged.doubts.items()}
        if judged.problems or before or judged.buildings is None:
            return list(judged.problems)
        return structures.overlapping(settings, read, judged)

    def receptors(self, settings: Settings) -> tuple[Receptor, ...] | Problem:
        """Give the receptors of settings; those of a file that are outside the domain are left out."""
        return (
            settings.places
            if self.held is None
            else self._receptors(settings, self.held.crs, self.held.extent)
        )

    def _receptors(
        self, settings: Settings, crs: str, extent: RasterExtent
    ) -> tuple[Receptor, ...] | Problem:
        source = source_of(settings.receptors)
        if source is None:
            return settings.places
        name, layer = source
        self.from_file = True
        path = ("receptors",)
        held = self._files.places(name, layer, crs, path)
        if isinstance(held, Problem):
            return held
        made = [
            Receptor.model_validate(
                {"name": each.name[:LONGEST_NAME]}
                | {each.kind: each.corners[0] if each.kind == "point" else each.corners}
            )
            for each in held
        ]
        bounds = settings.domain or Domain(x=extent.x, y=extent.y)
        parts = [part_inside(each, bounds) for each in made]
        inside = [each for each, part in zip(made, parts, strict=True) if part > 0]
        where = "on the elevation model" if settings.domain is None else "in the domain"
        if not inside:
            corners = np.concatenate([each.corners for each in made])
            found = f"{len(made)} {self._outside(corners, bounds, name)}"
            return Problem(path, f"expected places {where}, found {found} ({name})")
        said = {
            "lie outside the domain and are left out": 0.0,
            "stick out of it; the part inside counts": 0.5,
        }
        if settings.domain is None:
            # of the domain it is told once that is found
            said = {"lie outside the elevation model and are left out": 0.0}
        told = [
            f"{len(names)} {words}: {listed(names)}"
            for words, part in said.items()
            if (names := [each.name for each, found in zip(made, parts, strict=True) if found == part])
        ]
        if told:
            self.doubts[path, ""] = f"of {len(made)} places of {name} {', '.join(told)}"
        return tuple(inside)

    def _erodible(
        self,
        settings: Settings,
        raster: ElevationRaster,
        read: Outlines,
        depths: dict[str, ElevationRaster],
        whole: Domain | None,
    ) -> list[Problem]:
        """Read the raster of an erodible bed, and list what is wrong with its files.

        whole : the elevation model, in place of a domain that is not known.
        """
        bed, domain = settings.erodible_bed, settings.bounds
        if bed is None:
            return []
        path: Path = ("erodible_bed",)
        if bed.raster is not None:
            at = (*path, "depth")
            found = self._files.raster(bed.raster, raster.crs, around(domain, self._reach), at)
            if isinstance(found, Problem):
                return [found]
            if found.crs != raster.crs:
                expected = "expected a raster in the reference system of the elevation model, "
                told = f"{called(raster.crs)}, found {called(found.crs)} ({bed.raster})"
                return [Problem(at, expected + told)]
            if (low := float(np.nanmin(found.elevation))) < 0:
                return [Problem(at, f"expected depths of at least 0, found {low:g} ({bed.raster})")]
            depths[bed.raster] = found
        if bed.polygons is not None:
            held = read.get((bed.polygons, bed.layer))
            if held is None:
                return []
            try:
                solver_objects.erodible_polygons(bed, held)
            except ValueError as error:
                return [Problem((*path, "polygons"), f"{error} ({bed.polygons})")]
            if whole is not None:
                domain = whole
                rings = [outline.rings for outline in solver_objects.chosen(bed.name, held)]
                if reaches(rings, domain.x, domain.y):
                    return []
            lattice = Lattice(domain.x, domain.y, float(getattr(settings.points, "spacing")))  # noqa: B009
            if not any(
                polygon_shares(outline.rings, lattice).any()
                for outline in solver_objects.chosen(bed.name, held)
            ):
                bounds = "x [{:.12g}, {:.12g}] and y [{:.12g}, {:.12g}]".format(*domain.x, *domain.y)
                wanted = f"expected an erodible bed in the domain, {bounds}"
                outlines = solver_objects.chosen(bed.name, held)
                corners = np.concatenate([ring for outline in outlines for ring in outline.rings])
                where = f"polygons {self._outside(corners, domain, bed.polygons)}"
                return [Problem((*path, "polygons"), f"{wanted}, found {where} ({bed.polygons})")]
        return []

    def _note(
        self,
        name: str,
        raster: ElevationRaster,
        extent: RasterExtent,
        spacing: float,
        domain: Domain,
        *,
        known: bool,
    ) -> None:
        """Remember what is doubtful of an elevation model, by name of file, and a spacing."""
        terrain: Path = ("terrain", "elevation")
        if raster.spacing > FINER * spacing * (1 + SAME):
            self.doubts[("points", "spacing"), ""] = (
                f"{spacing:g} m is more than {FINER:g} times finer than the elevation model of "
                f"{raster.spacing:g} m, which shows nothing more of the ground"
            )
        if name in self._noted:
            return
        self._noted.add(name)
        # of a domain that is still to be found it is told then
        said = doubtful(raster, domain) if known else []
        middle = sum(extent.x) / 2, sum(extent.y) / 2
        if (strange := elsewhere(extent.crs, *middle)) is not None:
            said.append(f"its middle lies {strange}")
        elif (strange := stretched(extent.crs, *middle)) is not None:
            said.append(strange)
        if said:
            self.doubts[terrain, name] = f"{name}: {'; '.join(said)}"

    def _laid(
        self,
        release: PolygonsRelease,
        held: tuple[Outline, ...],
        path: Path,
        model: ElevationModel,
        settings: Settings,
        *,
        known: bool,
    ) -> list[Problem]:
        """List what is wrong with the polygons of a release on the lattice.

        known : whether the domain is that of the run.
        """
        try:
            made = solver_objects.polygon_releases(release, held)
        except ValueError as error:
            return [Problem(path, f"{error} ({release.polygons})", related=(path,))]
        for each in made:
            if (depth := _depth(each)) > DEEP:
                self.doubts[path, "depth"] = f"{release.polygons}: {too_deep(depth)}"
        domain, spacing = settings.bounds, float(getattr(settings.points, "spacing"))  # noqa: B009
        closest = float(getattr(settings.points, "closest", spacing))
        lattice = Lattice(domain.x, domain.y, spacing)
        problems = []
        for outline in solver_objects.chosen(release.name, held):
            where = f"'{outline.name}' of {release.polygons}"
            size = sum(map(ring_area, outline.rings))
            if size < closest**2:
                wanted = f"expected polygons of a cell, {closest**2:g} m2, or more"
                problems.append(Problem(path, f"{wanted}, found {where} of {size:.3g} m2"))
                continue
            key = id(outline), id(model), lattice
            if key not in self._inside:
                held_data = ~model.gaps(lattice.x_points, lattice.y_points)
                self._inside[key] = float((polygon_shares(outline.rings, lattice) * held_data).sum())
            inside = self._inside[key] * spacing**2 / size
            if inside <= SLIVER:
                bounds = "x [{:.12g}, {:.12g}] and y [{:.12g}, {:.12g}]".format(*domain.x, *domain.y)
                place = f"in the domain, {bounds}" if known else "on the elevation model"
                wanted = f"expected a release {place}, where there is data"
                place = self._outside(np.concatenate(outline.rings), domain, release.polygons)
                problems.append(
                    Problem(path, f"{wanted}, found {where} {place}", related=(path, ("domain",)))
                )
            elif inside < 1 - SLIVER:
                ends = "the domain" if known else "the elevation model"
                lost = f"{percent(1 - inside)} of {where} lie outside {ends} or on no data"
                self.doubts[path, where] = f"{lost} and are lost"
            if (wide := width(outline.rings)) < closest * (1 - SLIVER):
                narrow = f"{where} is about {wide:.2g} m wide, narrower than a cell of {closest:g} m"
                self.doubts[path, f"{where}, width"] = f"{narrow}, which its depth is spread over"
        return problems

    def _outside(self, corners: NDArray[np.float64], domain: Domain, file: str) -> str:
        """Say where corners lie that have no part in a domain, or on data, and what may be wrong."""
        low, high = corners.min(axis=0), corners.max(axis=0)

        def apart(x: Pair, y: Pair) -> bool:
            return bool((high < (x[0], y[0])).any() or (low > (x[1], y[1])).any())

        if not apart(domain.x, domain.y):
            return "outside or on no data"
        assert self._extent is not None
        # what lies beside the domain on the elevation model is in the right reference system
        crs = called(self._extent.crs) if apart(*self._extent.edges) else ""
        return f"outside{of_place(corners, domain.x, domain.y, file, crs)}"


def _depth(release: PolygonRelease) -> float:
    """Mean depth of a release on its polygons, m."""
    return release.depth or (release.volume or 0.0) / sum(map(ring_area, release.rings))


def _wanted(settings: Settings) -> Iterator[tuple[Path, str, str | None, Any]]:
    """List files of outlines: the key that names each, its name, its layer, and what it holds."""
    for i, release in enumerate(settings.releases):
        assert isinstance(release, PolygonsRelease)
        path: Path = ("release", i) if isinstance(settings.release, tuple) else ("release",)
        yield (*path, "polygons"), release.polygons, release.layer, "polygons"
    for of_zone, zone in settings.all_zones:
        if zone.file is not None:
            kind, key = ("polygons", "polygon") if zone.raster is None else ("classes", "raster")
            yield (*of_zone, key), zone.file, zone.layer, kind
    bed = settings.erodible_bed
    if bed is not None and bed.polygons is not None:
        yield ("erodible_bed", "polygons"), bed.polygons, bed.layer, "polygons"
    for i, name, layer in structures.files(settings):
        structure = settings.structures[i]
        kind = "lines" if structure.kind == "dam" else "polygons"
        yield ("structures", i, place_of(structure)[0]), name, layer, kind


def of_run(settings: Settings, outlines: Outlines) -> Outlines:
    """Pick what releases, zones, erodible bed and structures of a run are made of, by file and layer."""
    return {(name, layer): outlines[name, layer] for _, name, layer, _ in _wanted(settings)}
