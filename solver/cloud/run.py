"""One run of the weighted-residual form on a cloud: its arrays, and what the kernels do to them."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from solver.arrays import Array
from solver.cloud.arrays import CloudArrays
from solver.cloud.blocks import activity_of, spread_blocks
from solver.cloud.faces import Faces, aligned, all_aligned
from solver.cloud.flow_axes import Ways, ways_of
from solver.cloud.fluxes import cloud_buffers
from solver.cloud.operators import CloudOperators, prepare
from solver.cloud.residual import cloud_stage
from solver.cloud.sections import doors_of, no_doors, sections_of
from solver.cloud.status import classify_cloud
from solver.cloud.time_stepping import advance_cloud, erode
from solver.compiled import compile_for
from solver.inflow.clouds import PlacedOnCloud
from solver.kernels.earth_pressure import at_rest
from solver.kernels.erosion import erosion_of
from solver.kernels.record import Record, record_cells
from solver.kernels.runge_kutta import Limits
from solver.kernels.state import DRY, LANES, WALL, CloudBed, Fields, Sides, Status
from solver.points.cloud import PointCloud
from solver.points.voronoi import BUILDING, ControlVolumes
from solver.run import (
    Carried,
    Run,
    by_name,
    check_buildings,
    erodible_depth,
    falling_rate,
    gravity_along_and_normal,
    state_of,
    zoned_law,
)
from solver.scene import Scene


def operators_of(scene: Scene) -> CloudOperators:
    """Give the operators of a scene on a cloud, made now if it has none.

    Raises
    ------
    ValueError
        If those given are not of the scene's cloud and scheme, or a support cannot carry the basis.
    """
    cloud, scheme, given = scene.points, scene.scheme, scene.operators
    if not isinstance(cloud, PointCloud):
        raise TypeError(f"a cloud run needs a cloud, not a {type(cloud).__name__}")
    wanted = scheme.support, scheme.degree, scheme.weight_shape
    if given is None:
        return prepare(cloud, *wanted, scene.buildings)
    if not isinstance(given, CloudOperators) or not given.cloud.same_as(cloud):
        raise ValueError("the operators given are those of another cloud")
    one, other = (np.zeros(len(cloud), bool) if b is None else b for b in (given.buildings, scene.buildings))
    if not np.array_equal(one, other):
        raise ValueError("the operators given are those of other buildings")
    found = given.support, given.degree, given.weight_shape
    if found != wanted:
        raise ValueError(
            f"the operators given have support, degree and weight shape {found}, the scheme {wanted}"
        )
    return given


def _with_beside(values: Array, volumes: ControlVolumes) -> Array:
    """Do for cells and those that they have faces with what `solver.arrays.with_beside` does."""
    found = values.copy()
    np.maximum.at(found, volumes.left, values[volumes.right])
    np.maximum.at(found, volumes.right, values[volumes.left])
    return found


class CloudRun(Run):
    """The arrays of one run on a cloud; cells are followed by a ghost for every boundary face."""

    def __init__(self, scene: Scene, end: float, arrival_depth: float) -> None:
        check_buildings(scene)
        operators = operators_of(scene)
        volumes, faces = operators.volumes, operators.tables.faces
        self.operators, self.centroid, self.faces = operators, volumes.centroid, faces
        self.tables, self.plan_area = operators.tables, volumes.area
        initial = state_of(scene)
        super().__init__(scene, initial[0], end, arrival_depth, indices=1)
        self.count, spare = len(volumes.area), faces.cells - len(volumes.area)
        room = spare + len(faces.side) + LANES
        wet = initial[0] > self.material.dry
        padded = [np.pad(np.where(wet | (k == 0), a, 0.0), (0, room)) for k, a in enumerate(initial)]
        self.now, *self.stages = (Fields(*(aligned(a) for a in padded)) for _ in range(3))
        zoned = zoned_law(scene)
        if zoned is not None:
            values = np.pad(zoned.values, ((0, 0), (0, room)), mode="edge")
            self.material = self.material._replace(law=zoned._replace(values=values))
        # walls of buildings are a fifth side
        self.sides = Sides(*(np.append(a, 0) for a in self.sides))
        self.sides.kind[BUILDING] = WALL
        area, bed = self._lay()
        bed = bed._replace(falling=_with_beside(bed.falling, volumes))
        self.area, self.bed = aligned(np.pad(area, (0, spare), mode="edge")), all_aligned(bed)
        faces = self.tables.faces
        self.tables = self.tables._replace(faces=faces._replace(lean=aligned(self._leans(faces))))
        load = np.concatenate([self.bed.normal, self.bed.normal[volumes.side_cell], np.ones(LANES)])
        k_x, k_y = at_rest(self.material)
        along_flow = scene.earth_pressure.along_flow
        dry, shear = np.full(len(load), DRY), np.zeros(len(load))
        k_y = k_x if along_flow else k_y
        status = Status(load * k_x, load * k_y, dry, shear if along_flow else None)
        self.ways = all_aligned(self._ways()) if along_flow else None
        self.status = all_aligned(status)
        self.activity, self.buffers = activity_of(faces), cloud_buffers(faces)
        self.record = all_aligned(Record(*(np.full(faces.cells, a) for a in (0.0, 0.0, 0.0, np.nan))))
        if scene.erodible_bed is not None:
            available = np.pad(erodible_depth(scene), (0, spare))
            coefficients = scene.erodible_bed.coefficients
            if coefficients is not None:
                coefficients = np.pad(coefficients, ((0, 0), (0, spare)), mode="edge")
            own = available, np.zeros_like(available), self.erosion.entrained, coefficients
            self.erosion = erosion_of(scene.erodible_bed, *own)
        to_come = sum(each.inflow.hydrograph.volume_until(end) for each in self.entrances)
        self.rest_volume = scene.scheme.rest_share * (self.volume + to_come)
        self.doors = no_doors()
        if self.entrances:
            tables = self.tables
            about = tables.faces, tables.gradient, operators.cloud.points, self.bed, self.area, tables.widths
            self.inflows, self.doors = doors_of(self.entrances, *about, operators.number)
        gauges = [each for each in self.gauges if isinstance(each, PlacedOnCloud)]
        if gauges:
            times = np.asarray(scene.section_times, dtype=np.float64)
            self.sections = sections_of(gauges, times, faces, operators.number)
        record_cells(self.now, 0, self.count, self.material.dry, arrival_depth, self.record, self.progress)

    def _lay(self) -> tuple[Array, CloudBed]:
        """Give areas of the cells, (n,), m2, and their bed, for whole blocks of cells."""
        scene = self.scene
        spare = self.faces.cells - self.count
        x, y = (np.pad(a, (0, spare), mode="edge") for a in self.centroid.T)
        falling = falling_rate(scene, x, y, self.tables.widths[0])
        along, normal = gravity_along_and_normal(scene, x, y)
        return self.plan_area, CloudBed(along, normal, scene.profile.curvature(x, y), falling)

    def _leans(self, faces: Faces) -> Array:
        """Give ``lean`` of `Faces`, by the pull at a side of the domain or in a cell beside a building."""
        ghosts, lift = len(faces.side), self.bed.lift
        f = faces.outer + np.arange(ghosts)
        (n_x, n_y, d_x, d_y), cell = faces.geometry[:4, f], faces.left[f].astype(np.int64)
        at_sides = d_x * self.sides.excess[faces.side]
        pull = n_x * self.bed.along[cell]
        if lift is not None:
            pull = pull + n_y * lift.across[cell]
            d_y = d_y / lift.q[cell]
            d_x = (d_x - lift.r[cell] * d_y) / lift.p[cell]
        held = self.scene.least_coefficient * self.bed.normal[cell]
        over = np.sign(pull) * np.maximum(0.0, np.abs(pull) - held)
        return np.asarray(np.where(faces.side == BUILDING, over * (n_x * d_x + n_y * d_y), at_sides))

    def _ways(self) -> Ways:
        """Give the ways to the neighbours that the axes of the flow are seen by."""
        return ways_of(self.operators.volumes, self.tables.gradient)

    @property
    def arrays(self) -> CloudArrays:
        """What the kernels read and write."""
        tables = self.tables
        return CloudArrays(
            now=self.now,
            first_stage=self.stages[0],
            second_stage=self.stages[1],
            status=self.status,
            bed=self.bed,
            material=self.material,
            sides=self.sides,
            area=self.area,
            widths=tables.widths,
            faces=tables.faces,
            gradient=tables.gradient,
            strain=tables.strain,
            ways=self.ways,
            blocks=tables.blocks,
            activity=self.activity,
            buffers=self.buffers,
            record=self.record,
            erosion=self.erosion,
            inflows=self.inflows,
            doors=self.doors,
            sections=self.sections,
        )

    def _advance(self, target: float, max_steps: int) -> int:
        for stage in self.stages:
            for field, values in zip(stage, self.now, strict=True):
                field[:] = values
        return self._step(self.limits(target, max_steps))

    def _step(self, limits: Limits) -> int:
        return int(advance_cloud(self.in_memory, limits, self.progress))

    def warm_up(self, piece: int) -> None:
        """Compile what goes on beside the stages, or a stage."""
        arrays = self.arrays
        if piece == 0:
            compile_for(classify_cloud, arrays)
            compile_for(spread_blocks, self.status.static, self.faces, arrays.blocks, self.activity)
            self.warm_up_sections()
            compile_for(erode, arrays, self.now, 0.0)
            return
        states = self.now, self.stages[0]
        compile_for(cloud_stage, arrays, *states, 1.0, 1.0, 0.0, self.progress.ledger, True)

    @property
    def carried(self) -> dict[str, NDArray[Any]]:
        """The same, and the status of the cells; ghosts are filled anew before they are looked at."""
        own = super().carried | by_name(status=self.status)
        return own | by_name(now=Fields(*(a[: self.faces.cells] for a in self.now)))

    def restore(self, carried: Carried) -> None:
        """Set a run made from the same scene to where these arrays were taken."""
        super().restore(carried)
        # what is looked at anew comes out as it was
        self.activity = activity_of(self.faces)

    @property
    def state(self) -> tuple[Array, Array, Array]:
        """Depth (m) and velocity (m s-1) of the cells, copies of shape (n,)."""
        h, u, v = (a[: self.count].copy() for a in self.now)
        return h, u, v

    @property
    def volume(self) -> float:
        """Volume in the domain, m3."""
        return float(self.state[0] @ self.area[: self.count])

    @property
    def eroded(self) -> Array:
        """Depth that has been eroded, a copy of shape (n,), m."""
        return super().eroded if self.scene.erodible_bed is None else self.erosion.eroded[: self.count].copy()

    @property
    def maxima(self) -> Record:
        """Maxima over the steps, arrays of shape (n,)."""
        return Record(*(a[: self.count] for a in self.record))

    @property
    def place(self) -> tuple[float, float]:
        """Where a value was not finite, x and y in m; NaN if none was."""
        i = self.progress.place[0]
        return (float(self.centroid[i, 0]), float(self.centroid[i, 1])) if i >= 0 else (np.nan, np.nan)
