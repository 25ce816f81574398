"""One run on a lattice: its arrays, padded by ghost cells, and what the kernels do to them."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from solver.arrays import Array, with_beside
from solver.compiled import compile_for
from solver.inflow.placement import Placed
from solver.kernels import runge_kutta
from solver.kernels.earth_pressure import at_rest
from solver.kernels.erosion import erosion_of
from solver.kernels.record import Record
from solver.kernels.state import (
    AXIS,
    DEPTH,
    DRY,
    GHOSTS,
    LANES,
    OPEN,
    Bed,
    FaceValues,
    Fields,
    Fluxes,
    Grid,
    Sides,
    Status,
)
from solver.lattice.arrays import RING, Buffers, LatticeArrays
from solver.lattice.residual import stage, update_span
from solver.lattice.sections import Doors, Geometry, doors_of, inflows_of, sections_of
from solver.lattice.spans import Spans, copy_surroundings, moving_volume_exceeds, spread
from solver.lattice.status import classify
from solver.lattice.time_stepping import advance, advance_among_buildings, erode, record_maxima
from solver.lattice.walls import EAST, WEST, Walls, walls_of
from solver.lattice.window import Part, Window, around, needed
from solver.points.lattice import Lattice
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

# Rows or columns that a window grows by at least.
LEAST_GROWTH = 16


def roomy(size: int, values: Array | None = None) -> Array:
    """Flat array of zeros or of values, with room behind it that a whole vector may read and write."""
    array: Array = np.zeros(size + 2 * LANES)[:size]
    if values is not None:
        array[:] = values.ravel()
    return array


class LatticeRun(Run):
    """The arrays of one run, padded by ghost cells, on the part of the lattice that the flow has come near.

    Cells outside are dry, and nothing is computed there; a symmetric scene is computed in part. Results are
    the same to the last bit, but for the ledger of what passes the sides, whose sums have another order.

    Parameters
    ----------
    scene : Scene
        On a lattice.
    end : float
        Time that the run may go on to, s.
    arrival_depth : float
        Depth above which a cell counts as reached, m.
    whole : bool
        Whether to compute the whole lattice from the start.
    """

    # Stages of a step that have buffers of their own.
    stages_at_once = 1

    def __init__(self, scene: Scene, end: float, arrival_depth: float, whole: bool = False) -> None:
        lattice = scene.points
        if not isinstance(lattice, Lattice):
            raise TypeError(f"a lattice run needs a lattice, not a {type(lattice).__name__}")
        initial = state_of(scene)
        check_buildings(scene)
        super().__init__(scene, initial[0], end, arrival_depth, indices=2)
        self.lattice = lattice
        self.columns, self.erodible = self._columns(), erodible_depth(scene)
        dry = self.material.dry
        # what comes in through a side may come anywhere along it
        driven = (self.sides.kind == DEPTH) & (self.sides.depth > dry)
        self.zoned, bed = zoned_law(scene), scene.erodible_bed
        shown = (*initial, *(() if self.zoned is None else self.zoned.values))
        if bed is not None:
            shown += (self.erodible, *(() if bed.coefficients is None else bed.coefficients))
        # sections are of the whole lattice
        whole_part = whole or bool(self.entrances) or bool(self.gauges)
        self.part = Part(lattice.shape) if whole_part else self._needed(shown)
        room, filled = self.part.room, initial[0] > 0
        for each in self.entrances:
            filled[each.placed.downstream] = True
        self._make(room if whole or driven.any() else around(filled, room, LEAST_GROWTH))
        wet = initial[0][self.window.cut] > dry
        for k, (field, values) in enumerate(zip(self.now, initial, strict=True)):
            inside = values[self.window.cut]
            self._inner(field)[...] = np.where(wet | (k == 0), inside, 0.0)
        for j, row in enumerate(wet, GHOSTS):
            if row.any():
                self.spans.wet[:, j] = GHOSTS + np.argmax(row), GHOSTS + len(row) - np.argmax(row[::-1])
        to_come = sum(each.inflow.hydrograph.volume_until(end) for each in self.entrances)
        self.rest_volume = scene.scheme.rest_share * (self.volume + to_come) / self.part.rows
        record_maxima(self.now, self.spans.wet, self.grid, dry, arrival_depth, self.record, self.progress)

    def _columns(self) -> Bed:
        """Bed of the columns of the whole lattice."""
        x = self.lattice.x_points
        y = np.full_like(x, self.lattice.y_points.mean())
        along, normal = gravity_along_and_normal(self.scene, x, y)
        return Bed(
            along,
            normal,
            self.scene.profile.curvature(x, y),
            with_beside(falling_rate(self.scene, x, y, 1.0 / self.lattice.dx)),
            self.material.transition[1] / np.sqrt(normal),
        )

    def _needed(self, initial: tuple[Array, ...]) -> Part:
        """Part of the lattice that has to be computed: of a symmetric scene no more than it needs."""
        return needed(initial, self.sides) if self.scene.buildings is None else Part(self.lattice.shape)

    def _make(self, window: Window) -> None:
        """Make the arrays of a window, dry and at rest."""
        lattice, (ny, nx) = self.lattice, window.shape
        self.window = window
        room = self.part.room
        self.inner = np.not_equal(
            (window.west, window.east, window.south, window.north),
            (room.west, room.east, room.south, room.north),
        )
        self.window_sides = Sides(
            np.where(self.inner, OPEN, self.part.sides(self.sides.kind)),
            np.where(self.inner, 0.0, self.sides.depth),
            np.where(self.inner, 0.0, self.sides.excess),
            *self.sides[3:],
        )
        columns = np.arange(window.west - GHOSTS, window.east + GHOSTS).clip(window.west, window.east - 1)
        self.bed = Bed(*(values[columns] for values in self.columns))
        rows = np.arange(window.south - GHOSTS, window.north + GHOSTS).clip(window.south, window.north - 1)
        if self.zoned is not None:
            values = self.zoned.values[:, rows[:, None], columns].reshape(len(self.zoned.values), -1)
            # field by field: neighbours in memory are neighbours on the row
            law = self.zoned._replace(values=np.ascontiguousarray(values))
            self.material = self.material._replace(law=law)
        self.grid = Grid(ny + 2 * GHOSTS, nx + 2 * GHOSTS, lattice.dx, lattice.dy)
        size, stride = self.grid.rows * self.grid.stride, self.grid.stride
        self.now, *self.stages = (Fields(*(roomy(size) for _ in range(3))) for _ in range(3))
        load = np.tile(self.bed.normal, self.grid.rows)
        along_flow = self.scene.earth_pressure.along_flow
        k_x, k_y = at_rest(self.material)
        self.status = Status(
            roomy(size, load * k_x),
            roomy(size, load * (k_x if along_flow else k_y)),
            roomy(size, np.full(size, DRY)),
            roomy(size) if along_flow else None,
        )
        empty = np.zeros((2, self.grid.rows), dtype=np.int64)
        self.spans = Spans(empty, empty.copy(), empty.copy(), np.zeros(stride))
        self.walls = None if self.scene.buildings is None else self._walls(self.scene.buildings)
        n, at_once = stride + LANES, self.stages_at_once
        self.buffers = Buffers(
            FaceValues(*(roomy(n) for _ in range(7))),
            FaceValues(*(roomy(2 * at_once * n) for _ in range(7))),
            Fluxes(*(roomy(at_once * RING * n) for _ in range(4))),
            Fluxes(*(roomy(at_once * RING * n) for _ in range(4))),
            roomy(at_once * RING * n),
            np.zeros(at_once * RING * n, dtype=np.int64),
            Fields(*(roomy(n) for _ in range(3))),
        )
        bed, entrained = self.scene.erodible_bed, self.erosion.entrained
        if bed is not None:
            coefficients = bed.coefficients
            if coefficients is not None:
                coefficients = coefficients[:, rows[:, None], columns].reshape(len(coefficients), -1)
            self.erosion = erosion_of(bed, roomy(size), roomy(size), entrained, coefficients)
            self._inner(self.erosion.available)[...] = self.erodible[window.cut]
        depth, speed_squared, momentum_flux = np.zeros((3, ny * nx))
        self.record = Record(depth, speed_squared, momentum_flux, np.full(ny * nx, np.nan))
        self._make_sections()

    def _make_sections(self) -> None:
        """Give inflows and sections their places in the window."""
        if self.entrances:
            doors, entered = doors_of(self.entrances, self.window, self.grid.stride), self.inflows.entered
            self.inflows = inflows_of(self.entrances, doors, self.grid.rows, self._geometry(doors))
            self.inflows.entered[: len(entered)] = entered
        if self.gauges:
            times = np.asarray(self.scene.section_times, dtype=np.float64)
            gauges = [each for each in self.gauges if isinstance(each, Placed)]
            self.sections = sections_of(gauges, times, self.window, self._flux_sizes, self.sections)

    @property
    def _flux_sizes(self) -> tuple[float, float]:
        """What a flux of mass along x and along y is multiplied by for a discharge, m or 1."""
        return self.lattice.dy, self.lattice.dx

    def _geometry(self, doors: Doors) -> Geometry:
        """Give what fluxes and velocities are at the doors of inflows."""
        along_x, (x, y) = doors.along_x, doors.direction
        dx, dy = self.lattice.dx, self.lattice.dy
        unit = np.ones(len(doors.cell))
        return Geometry(
            along=np.where(along_x, x, y),
            across=np.where(along_x, y, x),
            own=np.stack([1.0 * along_x, 1.0 - along_x]),
            length=np.where(along_x, dy, dx),
            edge=unit,
            room=np.stack([np.where(along_x, dx, dy)] * 2),
            beta=self.bed.normal[doors.column],
            rate=np.stack([np.where(along_x, 1 / dx, 1 / dy), np.where(along_x, 1 / dy, 1 / dx)]),
            falling=self.bed.falling[doors.column],
        )

    def _walls(self, buildings: NDArray[np.bool_]) -> Walls:
        """Give the cells of the window that are beside buildings."""
        window = self.window
        rows = slice(window.south, window.north + 2 * GHOSTS)
        columns = slice(window.west, window.east + 2 * GHOSTS)
        walls = walls_of(np.pad(buildings, GHOSTS)[rows, columns])
        column = walls.cell % self.grid.stride
        along, tangent = self.bed.along[column], self.scene.least_coefficient
        lean = np.sign(along) * np.maximum(0.0, np.abs(along) - tangent * self.bed.normal[column])
        walls.lean[:, WEST], walls.lean[:, EAST] = -lean * self.grid.dx, lean * self.grid.dx
        return walls

    def _inner(self, padded: Array) -> Array:
        """View a flat padded array without its ghosts, of the shape of the window."""
        inner = slice(GHOSTS, -GHOSTS)
        return padded.reshape(self.grid.rows, self.grid.stride)[inner, inner]

    def _grow(self) -> None:
        """Give the flow more room on the sides that it has come to."""
        carried = [*self.now, *self._status]
        if self.scene.erodible_bed is not None:
            carried.append(self.erosion.eroded)
        before, views = self.window, [self._inner(a) for a in carried]
        spans, record = self.spans, self.record
        stepped = spans.stepped[0] < spans.stepped[1]
        rows = np.flatnonzero(stepped)
        near = (
            spans.stepped[0, stepped].min() <= GHOSTS,
            spans.stepped[1, stepped].max() >= self.grid.stride - GHOSTS,
            rows[0] <= GHOSTS,
            rows[-1] >= self.grid.rows - GHOSTS - 1,
        )
        ny, nx = before.shape
        west, east, south, north = (
            max(LEAST_GROWTH, size // 2) if at else 0 for at, size in zip(near, (nx, nx, ny, ny), strict=True)
        )
        self._make(before.grown((south, north, west, east), self.part.room))
        down, right = before.south - self.window.south, before.west - self.window.west
        place = slice(down, down + ny), slice(right, right + nx)
        for old, new in zip(views, (*self.now, *self._status, self.erosion.eroded), strict=False):
            self._inner(new)[place] = old
        # of ghosts only the status lasts from step to step
        image = GHOSTS + (1 if self.window_sides.kind[2] == AXIS else 0)
        for new in self._status:
            padded = new.reshape(self.grid.rows, self.grid.stride)
            padded[GHOSTS - 1], padded[-GHOSTS] = padded[image], padded[-GHOSTS - 1]
            padded[:, GHOSTS - 1], padded[:, -GHOSTS] = padded[:, GHOSTS], padded[:, -GHOSTS - 1]
        for old, new in zip(record, self.record, strict=True):
            new.reshape(self.window.shape)[place] = old.reshape(ny, nx)
        inside = spans.wet[:, GHOSTS:-GHOSTS]
        self.spans.wet[:, GHOSTS + down : GHOSTS + down + ny] = np.where(
            inside[0] < inside[1], inside + right, 0
        )

    @property
    def _status(self) -> list[Array]:
        """Arrays of the status."""
        return [values for values in self.status if values is not None]

    @property
    def arrays(self) -> LatticeArrays:
        """What the kernels read and write."""
        return LatticeArrays(
            now=self.now,
            first_stage=self.stages[0],
            second_stage=self.stages[1],
            status=self.status,
            bed=self.bed,
            material=self.material,
            sides=self.window_sides,
            grid=self.grid,
            spans=self.spans,
            inner=self.inner,
            walls=self.walls,
            buffers=self.buffers,
            record=self.record,
            erosion=self.erosion,
            inflows=self.inflows,
            sections=self.sections,
        )

    def _advance(self, target: float, max_steps: int) -> int:
        limits, outcome = self.limits(target, max_steps), runge_kutta.GROW
        while outcome == runge_kutta.GROW:
            outcome = self._step(limits)
            if outcome == runge_kutta.GROW:
                self._grow()
        return outcome

    def _step(self, limits: runge_kutta.Limits) -> int:
        """Step until a limit or a side of the window is come to."""
        step = advance if self.walls is None else advance_among_buildings
        return int(step(self.in_memory, limits, self.progress))

    def warm_up(self, piece: int) -> None:
        """Compile what goes on beside the stages, or a stage."""
        if piece == 0:
            grid, sides, spans = self.grid, self.window_sides, self.spans
            compile_for(classify, self.now, self.status, self.bed, self.material, sides, grid, spans)
            self.warm_up_sections()
            compile_for(erode, self.arrays, GHOSTS, GHOSTS, 0.0)
            compile_for(spread, spans, self.status.static, sides, grid)
            compile_for(moving_volume_exceeds, self.now, self.status.static, spans, sides, grid, 0.0, True)
            compile_for(copy_surroundings, self.now, self.now, spans.stepped, grid, GHOSTS, GHOSTS)
            return
        # first what the other piece does not take: ghosts are compiled there meanwhile
        now, out = self.now, self.stages[0]
        compile_for(update_span, self.arrays, now, out, GHOSTS, GHOSTS, GHOSTS, GHOSTS, GHOSTS, 1.0, 0.0)
        compile_for(stage, self.arrays, now, now, out, GHOSTS, GHOSTS, 1.0, 1.0, 0.0, self.progress.ledger)

    @property
    def carried(self) -> dict[str, NDArray[Any]]:
        """The same, and which part of the lattice they are of."""
        own = by_name(status=self.status, spans=self.spans)
        return super().carried | own | {"window": np.array(self.window)}

    def restore(self, carried: Carried) -> None:
        """Set a run made from the same scene to where these arrays were taken."""
        window, room = Window(*map(int, carried.get("window", ()))), self.part.room
        if window.grown((0, 0, 0, 0), room) != window:
            raise ValueError("the snapshot is of other points")
        self._make(window)
        super().restore(carried)

    @property
    def state(self) -> tuple[Array, Array, Array]:
        """Depth and velocity of the whole lattice, copies of shape (ny, nx)."""
        h, u, v = (
            self._expanded(field, image) for field, image in zip(self.now, (1.0, 1.0, -1.0), strict=True)
        )
        return h, u, v

    def _expanded(self, field: Array, image: float = 1.0) -> Array:
        return self.part.expanded(self._inner(field), self.window, 0.0, image)

    @property
    def maxima(self) -> Record:
        """Record of the whole lattice, copies of shape (ny, nx)."""
        depth, speed_squared, momentum_flux, arrival = (
            self.part.expanded(values, self.window, outside)
            for values, outside in zip(self.record, (0.0, 0.0, 0.0, np.nan), strict=True)
        )
        return Record(depth, speed_squared, momentum_flux, arrival)

    @property
    def eroded(self) -> Array:
        """Depth that has been eroded, a copy of shape (ny, nx), m."""
        if self.scene.erodible_bed is None:
            return super().eroded
        return self._expanded(self.erosion.eroded)

    @property
    def entrained(self) -> float:
        """Volume that the flow has taken up from the bed, m3."""
        return self.part.rows * super().entrained

    @property
    def ledger(self) -> Array:
        """Volumes that came in and left through each side of the lattice, shape (4, 2), m3."""
        return self.part.rows * super().ledger

    @property
    def volume(self) -> float:
        """Volume in the domain, m3."""
        return float(self._expanded(self.now.h).sum()) * self.lattice.cell_area

    @property
    def place(self) -> tuple[float, float]:
        """Where a value was not finite, x and y in m; NaN if none was."""
        j, i = self.progress.place
        if j < 0:
            return np.nan, np.nan
        x, y = self.lattice.x_points, self.lattice.y_points
        return float(x[self.window.west + i]), float(y[self.window.south + j])
