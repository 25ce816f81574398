"""One run on a surface: the lattice's windows, with the metric of the surface under each."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from solver.arrays import Array
from solver.kernels.runge_kutta import Limits
from solver.kernels.state import GHOSTS, Bed
from solver.lattice.run import LatticeRun
from solver.lattice.window import Part, Window
from solver.physics.earth_pressure import Isotropic
from solver.physics.elevation import Surface, edges_of, lifted_area
from solver.points.lattice import Lattice
from solver.scene import Scene
from solver.surface.arrays import SurfaceArrays
from solver.surface.metric import metric_of
from solver.surface.residual import stage
from solver.surface.status import classify_surface
from solver.surface.time_stepping import advance_among_buildings, advance_surface, empty_drains
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
        If cells are not square in plan, earth pressure is not isotropic, or a side is not open.
    """

    def __init__(self, scene: Scene, end: float, arrival_depth: float, whole: bool = False) -> None:
        surface, lattice = scene.terrain, scene.points
        if not isinstance(surface, Surface) or not isinstance(lattice, Lattice):
            raise TypeError("a run on a surface needs a surface and a lattice")
        if abs(lattice.dx - lattice.dy) > 1e-9 * lattice.dx:
            raise ValueError("cells on a surface must be square in plan")
        if not isinstance(scene.earth_pressure, Isotropic):
            raise ValueError("earth pressure on a surface must be isotropic")
        self.surface = surface
        corners = surface.corners(*(edges_of(a, lattice.dx) for a in (lattice.x_points, lattice.y_points)))
        self._area = lifted_area(corners, lattice.dx)
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
        super()._make(window)
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
            x,
            y,
            d,
            drains(self.surface.gaps(x, y), rows, columns, lattice.shape),
            scene.gravity,
            scene.least_coefficient,
            scene.scheme.cfl,
        )
        if self.walls is not None:
            set_walls(self.walls, self.metric, self.grid.stride, d, scene.least_coefficient)

    @property
    def arrays(self) -> SurfaceArrays:  # type: ignore[override]
        """What the kernels read and write."""
        return SurfaceArrays(
            now=self.now,
            first_stage=self.stages[0],
            second_stage=self.stages[1],
            static=self.status.static,
            metric=self.metric,
            material=self.material,
            sides=self.window_sides,
            grid=self.grid,
            spans=self.spans,
            inner=self.inner,
            walls=self.walls,
            buffers=self.buffers,
            record=self.record,
            erosion=self.erosion,
        )

    def _step(self, limits: Limits) -> int:
        step = advance_surface if self.walls is None else advance_among_buildings
        return int(step(self.arrays, limits, self.progress))

    def warm_up(self, piece: int) -> None:
        """Classify the cells, or take a stage of no length."""
        if piece == 0:
            about = self.metric, self.material, self.grid
            classify_surface(self.now, self.status.static, *about, self.spans)
            return
        stage(self.arrays, self.now, self.now, self.stages[0], GHOSTS, GHOSTS, 1.0, 0.0)

    @property
    def volume(self) -> float:
        """Volume in the domain, m3."""
        return float((self._expanded(self.now.h) * self._area).sum())


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
