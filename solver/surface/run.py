"""One run on a surface: the lattice's windows, with the metric of the surface under each."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from solver.arrays import Array, Indices
from solver.compiled import compile_for
from solver.kernels.earth_pressure import at_rest
from solver.kernels.runge_kutta import SSP_RK3, Limits
from solver.kernels.sections.inflow import HIGH_X, LOW_X, LOW_Y
from solver.kernels.state import GHOSTS, Bed
from solver.lattice.run import LatticeRun
from solver.lattice.sections import Doors, Geometry
from solver.lattice.spans import copy_surroundings
from solver.lattice.window import Part, Window
from solver.physics.earth_pressure import Isotropic
from solver.physics.elevation import Surface, edges_of, frames_of, lifted_area, plan_slopes
from solver.points.lattice import Lattice
from solver.run import by_name
from solver.scene import Scene
from solver.surface.arrays import SurfaceArrays
from solver.surface.metric import Metric, metric_of
from solver.surface.pressure import pressure_of
from solver.surface.reconstruction import TOGETHER, Levels
from solver.surface.residual import take_stages
from solver.surface.time_stepping import (
    advance_among_buildings,
    advance_surface,
    begin_step,
    empty_drains,
    erode,
)
from solver.surface.walls import set_walls


class SurfaceRun(LatticeRun):
    """The arrays of one run on a surface; velocities are in the frames of the cells.

    Cells where nothing is known of the surface, and the outermost ones, are drains: dry at the start of a
    step, and emptied into the ledger at its end.

    Parameters
    ----------
    scene : Scene
        On a lattice of square cells, with a `Surface` for terrain; depth is normal to the bed.
    end : float
        Time that the run may go on to, s.
    arrival_depth : float
        Depth above which a cell counts as reached, m.
    whole : bool
        Whether to compute the whole lattice from the start.

    Raises
    ------
    ValueError
        If cells are not square in plan, earth pressure has the axes of a profile, or a side is not open.
    """

    stages_at_once = len(SSP_RK3)

    def __init__(self, scene: Scene, end: float, arrival_depth: float, whole: bool = False) -> None:
        surface, lattice = scene.terrain, scene.points
        if not isinstance(surface, Surface) or not isinstance(lattice, Lattice):
            raise TypeError("a run on a surface needs a surface and a lattice")
        if abs(lattice.dx - lattice.dy) > 1e-9 * lattice.dx:
            raise ValueError("cells on a surface must be square in plan")
        pressure = scene.earth_pressure
        if not (isinstance(pressure, Isotropic) or pressure.along_flow):
            raise ValueError("earth pressure on a surface must be isotropic or have the axes of the flow")
        self.surface = surface
        edges = (edges_of(a, lattice.dx) for a in (lattice.x_points, lattice.y_points))
        self._corners = surface.corners(*edges)
        self._area = lifted_area(self._corners, lattice.dx)
        super().__init__(scene, end, arrival_depth, whole)
        # what is released in a drain has left
        empty_drains(self.now, self.metric, self.spans.wet, self.grid, self.progress.ledger)

    @property
    def cell_area(self) -> Array:
        """Areas of the cells on the bed, shape (ny, nx), m2."""
        return self._area

    @property
    def steepness(self) -> Array:
        """Vertical over normal depth on the bed, shape (ny, nx), dimensionless."""
        return self._area / self.scene.points.cell_area

    def _columns(self) -> Bed:
        nothing = np.zeros_like(self.lattice.x_points)
        return Bed(nothing, nothing, nothing, nothing, nothing)

    def _needed(self, initial: tuple[Array, ...]) -> Part:
        return Part(self.lattice.shape)

    def _make(self, window: Window) -> None:
        lattice, scene = self.lattice, self.scene
        (ny, nx), d = lattice.shape, lattice.dx
        columns = np.arange(window.west - GHOSTS, window.east + GHOSTS)
        rows = np.arange(window.south - GHOSTS, window.north + GHOSTS)
        x, y = lattice.x_points[0] + d * columns, lattice.y_points[0] + d * rows
        # evenly weighted from both ends, as the points are, so that mirror images agree to the last bit
        inside_x, inside_y = (columns >= 0) & (columns < nx), (rows >= 0) & (rows < ny)
        x[inside_x], y[inside_y] = lattice.x_points[columns[inside_x]], lattice.y_points[rows[inside_y]]
        self.metric = metric_of(
            self.surface,
            self._corners_of(x, y, rows, columns),
            x,
            y,
            d,
            drains(self.surface.gaps(x, y), rows, columns, lattice.shape),
            scene.gravity,
            scene.least_coefficient,
            scene.scheme.cfl,
        )
        self.pressure = None
        if scene.earth_pressure.along_flow:
            self.pressure = pressure_of(self.metric, at_rest(self.material)[0])
        super()._make(window)
        if self.walls is not None:
            set_walls(self.walls, self.metric, self.pressure, self.grid.stride, d, scene.least_coefficient)

    def _corners_of(self, x: Array, y: Array, rows: Indices, columns: Indices) -> Array:
        """Elevation of the corners of a window, m: on the lattice that which volumes are counted by."""
        d, (ny, nx) = self.lattice.dx, self._corners.shape
        corners = self.surface.corners(edges_of(x, d), edges_of(y, d))
        at_y, at_x = np.append(rows, rows[-1] + 1), np.append(columns, columns[-1] + 1)
        inside_y, inside_x = (at_y >= 0) & (at_y < ny), (at_x >= 0) & (at_x < nx)
        corners[np.ix_(inside_y, inside_x)] = self._corners[np.ix_(at_y[inside_y], at_x[inside_x])]
        return corners

    @property
    def _flux_sizes(self) -> tuple[float, float]:
        return 1.0, 1.0

    def _geometry(self, doors: Doors) -> Geometry:
        c, s, length = frame_at(self.metric, doors, self.grid.stride)
        rows, columns = (
            at - GHOSTS + start
            for at, start in ((doors.row, self.window.south), (doors.column, self.window.west))
        )
        e_1, e_2 = (frame[:, rows, columns] for frame in frames_of(self._corners, self.lattice.dx))
        slopes = plan_slopes(self._corners, self.lattice.dx)
        x, y = doors.direction
        flow = np.stack([x, y, slopes[0][rows, columns] * x + slopes[1][rows, columns] * y])
        flow /= np.sqrt((flow * flow).sum(0))
        u, v = (flow * e_1).sum(0), (flow * e_2).sum(0)
        per_area, metric = self.metric.per_area[doors.cell], self.metric
        rates = [edges.length[doors.cell] * per_area for edges in (metric.x_edges, metric.y_edges)]
        away = np.where(doors.along_x, 1, self.grid.stride) * doors.sign.astype(np.int64)
        around = np.stack([doors.cell - away, doors.cell])
        return Geometry(
            along=c * u + s * v,
            across=c * v - s * u,
            own=np.stack([c, s]),
            length=np.ones(len(c)),
            edge=length,
            room=1.0 / (metric.per_area[around] * length),
            beta=metric.g_n[doors.cell],
            rate=np.stack([np.where(doors.along_x, *rates), np.where(doors.along_x, *reversed(rates))]),
            falling=metric.falling[doors.cell],
        )

    @property
    def _status(self) -> list[Array]:
        """Arrays of the status, and of the earth pressure."""
        return [*super()._status, *(self.pressure or ())]

    @property
    def carried(self) -> dict[str, NDArray[Any]]:
        """The same, and the earth pressure."""
        return super().carried | ({} if self.pressure is None else by_name(pressure=self.pressure))

    @property
    def arrays(self) -> SurfaceArrays:  # type: ignore[override]
        """What the kernels read and write."""
        return SurfaceArrays(
            now=self.now,
            first_stage=self.stages[0],
            second_stage=self.stages[1],
            static=self.status.static,
            pressure=self.pressure,
            metric=self.metric,
            material=self.material,
            sides=self.window_sides,
            grid=self.grid,
            spans=self.spans,
            inner=self.inner,
            walls=self.walls,
            buffers=self.buffers,
            levels=Levels(*(np.zeros(TOGETHER) for _ in Levels._fields)),
            record=self.record,
            erosion=self.erosion,
            inflows=self.inflows,
            sections=self.sections,
        )

    def _step(self, limits: Limits) -> int:
        step = advance_surface if self.walls is None else advance_among_buildings
        return int(step(self.in_memory, limits, self.progress))

    def warm_up(self, piece: int) -> None:
        """Compile what goes on beside the stages, or a stage."""
        if piece == 0:
            compile_for(begin_step, self.arrays, self.limits(0.0, 0), self.progress)
            self.warm_up_sections()
            compile_for(erode, self.arrays, GHOSTS, GHOSTS, 0.0)
            compile_for(copy_surroundings, self.now, self.now, self.spans.stepped, self.grid, GHOSTS, GHOSTS)
            return
        compile_for(take_stages, self.arrays, GHOSTS, GHOSTS, 0.0)

    @property
    def volume(self) -> float:
        """Volume in the domain, m3."""
        return float((self._expanded(self.now.h) * self._area).sum())


def frame_at(metric: Metric, doors: Doors, stride: int) -> tuple[Array, Array, Array]:
    """Components of the normals of doors in the frames of their cells, and lengths (m), three of shape (n,).

    Parameters
    ----------
    stride : int
        Length of a padded row.
    """
    low = (doors.side == LOW_X) | (doors.side == LOW_Y)
    behind = np.where(doors.side <= HIGH_X, 1, stride)
    edge = doors.cell - low * behind
    found = [
        np.stack(
            [
                np.where(low, e.c_high[edge], e.c_low[edge]),
                np.where(low, e.s_high[edge], e.s_low[edge]),
                e.length[edge],
            ]
        )
        for e in (metric.x_edges, metric.y_edges)
    ]
    c, s, length = np.where(doors.along_x, *found)
    return c, s, length


def drains(
    gaps: NDArray[np.bool_], rows: NDArray[np.int64], columns: NDArray[np.int64], shape: tuple[int, int]
) -> NDArray[np.int8]:
    """Give the numbers, from 1, of the sides that take what reaches gaps and the outermost cells.

    Each goes to the side that is nearest.

    Parameters
    ----------
    gaps : (m, n) array
        Whether nothing is known of the surface.
    rows, columns : array
        Numbers of the rows (m,) and columns (n,) in the whole lattice.
    shape : tuple of int
        Of the whole lattice.
    """
    j, i = np.meshgrid(rows, columns, indexing="ij")
    distances = np.stack([i, shape[1] - 1 - i, j, shape[0] - 1 - j])
    return np.where(gaps | (distances.min(axis=0) <= 0), distances.argmin(axis=0) + 1, 0).astype(np.int8)
