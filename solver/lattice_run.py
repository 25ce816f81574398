"""One run on a lattice: its arrays, padded by ghost cells, and what the kernels do to them."""

from __future__ import annotations

import numpy as np

from solver import time_stepping
from solver.activity import Bed, Spans, Status
from solver.boundary import GHOSTS, LANES, Fields, Grid
from solver.compiled import Array
from solver.lattice import Lattice
from solver.reconstruction import FaceValues
from solver.rheology import PressureCoefficients
from solver.riemann import Fluxes
from solver.run_setup import gravity_along_and_normal, material_of, sides_of, state_of
from solver.scene import Scene
from solver.time_stepping import Progress, Record, record_maxima
from solver.weighted_residual import RING, Buffers


def roomy(size: int, values: Array | None = None) -> Array:
    """Flat array of zeros or of values, with room behind it that a whole vector may read and write."""
    array: Array = np.zeros(size + 2 * LANES)[:size]
    if values is not None:
        array[:] = values.ravel()
    return array


class LatticeRun:
    """The arrays of one run, padded by ghost cells."""

    def __init__(self, scene: Scene, end: float, arrival_depth: float) -> None:
        lattice = scene.points
        if not isinstance(lattice, Lattice):
            raise TypeError(f"a lattice run needs a lattice, not a {type(lattice).__name__}")
        self.scene, self.lattice, self.end, self.arrival_depth = scene, lattice, end, arrival_depth
        initial = state_of(scene)
        self.sides = sides_of(scene)
        self.material = material_of(scene, initial[0], self.sides)
        dry, coefficients = self.material.dry, PressureCoefficients(*self.material.pressure)
        self.bed = self._bed()
        wet = initial[0] > self.material.dry
        padded = [np.pad(np.where(wet | (k == 0), a, 0.0), GHOSTS) for k, a in enumerate(initial)]
        self.now, *self.stages = (Fields(*(roomy(a.size, a) for a in padded)) for _ in range(3))
        ny, nx = lattice.shape
        self.grid = Grid(ny + 2 * GHOSTS, nx + 2 * GHOSTS, lattice.dx, lattice.dy)
        load = np.tile(self.bed.normal, self.grid.rows)
        self.status = Status(
            *(
                roomy(load.size, a)
                for a in (load * coefficients.x_active, load * coefficients.y_active_active, 0 * load + 1)
            )
        )
        n = self.grid.stride + LANES
        empty = np.zeros((2, self.grid.rows), dtype=np.int64)
        self.spans = Spans(empty, empty.copy(), empty.copy(), np.zeros(self.grid.stride))
        for j, row in enumerate(wet, GHOSTS):
            if row.any():
                self.spans.wet[:, j] = GHOSTS + np.argmax(row), GHOSTS + nx - np.argmax(row[::-1])
        self.buffers = Buffers(
            FaceValues(*(roomy(n) for _ in range(7))),
            FaceValues(*(roomy(2 * n) for _ in range(7))),
            Fluxes(*(roomy(RING * n) for _ in range(4))),
            Fluxes(*(roomy(RING * n) for _ in range(4))),
            np.ones(RING * n),
        )
        self.record = Record(
            np.zeros(ny * nx), np.zeros(ny * nx), np.zeros(ny * nx), np.full(ny * nx, np.nan)
        )
        self.progress = Progress(
            np.zeros(1),
            np.zeros(1, np.int64),
            np.zeros(1, np.int64),
            np.zeros((4, 2)),
            np.full(2, -1, np.int64),
        )
        self.rest_volume = scene.scheme.rest_share * self.volume
        record_maxima(self.now, self.spans.wet, self.grid, dry, arrival_depth, self.record, self.progress)

    def _bed(self) -> Bed:
        x = np.pad(self.lattice.x_points, GHOSTS, mode="edge")
        y = np.full_like(x, self.lattice.y_points.mean())
        return Bed(*gravity_along_and_normal(self.scene, x, y), self.scene.terrain.curvature(x, y))

    def advance(self, target: float, max_steps: int | None) -> int:
        """Step to ``target``, s; say why it stopped."""
        scheme = self.scene.scheme
        return int(
            time_stepping.advance(
                self.now,
                *self.stages,
                self.status,
                self.bed,
                self.material,
                self.sides,
                self.grid,
                self.spans,
                self.buffers,
                time_stepping.SSP_RK3,
                scheme.cfl,
                target,
                self.end,
                np.iinfo(np.int64).max if max_steps is None else max_steps,
                self.rest_volume,
                self.arrival_depth,
                self.record,
                self.progress,
            )
        )

    def settle(self) -> None:
        """Stop what little still moves."""
        self.now.u[:] = self.now.v[:] = 0.0

    @property
    def time(self) -> float:
        """Time reached, s."""
        return float(self.progress.time[0])

    @property
    def state(self) -> tuple[Array, Array, Array]:
        """Depth and velocity without ghosts, copies of shape (ny, nx)."""
        padded, inner = (self.grid.rows, self.grid.stride), slice(GHOSTS, -GHOSTS)
        h, u, v = (a.reshape(padded)[inner, inner].copy() for a in self.now)
        return h, u, v

    @property
    def volume(self) -> float:
        """Volume in the domain, m3."""
        return float(self.state[0].sum()) * self.lattice.cell_area

    @property
    def place(self) -> tuple[float, float]:
        """Where a value was not finite, x and y in m; NaN if none was."""
        j, i = self.progress.place
        lattice = self.lattice
        return (float(lattice.x_points[i]), float(lattice.y_points[j])) if j >= 0 else (np.nan, np.nan)
