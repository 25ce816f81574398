"""One run on a lattice: its arrays, padded by ghost cells, and what the kernels do to them."""

from __future__ import annotations

import numpy as np

from solver import time_stepping
from solver.activity import Bed, Material, Spans, Status
from solver.boundary import DEPTH, GHOSTS, LANES, NO_SLIP, OPEN, WALL, Fields, Grid, Sides
from solver.compiled import Array
from solver.reconstruction import FaceValues
from solver.rheology import Voellmy
from solver.riemann import Fluxes
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
        lattice, sides = scene.lattice, scene.boundaries
        self.scene, self.end, self.arrival_depth = scene, end, arrival_depth
        given = [getattr(sides, side) for side in ("x_min", "x_max", "y_min", "y_max")]
        kinds = {"open": OPEN, "wall": WALL, "no-slip": NO_SLIP}
        for side in given:
            if side not in kinds and (isinstance(side, str) or not 0 <= side < np.inf):
                raise ValueError(f"a side must be one of {', '.join(kinds)} or a depth, not {side!r}")
        depths = np.array([0.0 if isinstance(s, str) else float(s) for s in given])
        initial = [np.asarray(a, dtype=np.float64) for a in (scene.depth, scene.velocity_x, scene.velocity_y)]
        for array in initial:
            if array.shape != lattice.shape:
                raise ValueError(
                    f"initial arrays must have the lattice's shape {lattice.shape}, not {array.shape}"
                )
            if not np.isfinite(array).all():
                raise ValueError("initial arrays must be finite")
        if (initial[0] < 0).any():
            raise ValueError("initial depth must not be negative")
        deepest = max(initial[0].max(), depths.max())
        dry = scene.scheme.wet_limit * deepest
        friction = scene.friction
        drag = scene.gravity / friction.turbulent_friction if isinstance(friction, Voellmy) else 0.0
        coefficients = scene.earth_pressure.coefficients()
        self.material = Material(friction.tangent, drag, coefficients, dry)
        self.bed = self._bed()
        pull = self.bed.along[[0, -1]]
        lean = np.sign(pull) * np.maximum(0.0, np.abs(pull) - friction.tangent * self.bed.normal[[0, -1]])
        self.sides = Sides(
            np.array([kinds[s] if isinstance(s, str) else DEPTH for s in given]),
            depths,
            np.array([*lean, 0.0, 0.0]),
        )
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
        lattice, g = self.scene.lattice, self.scene.gravity
        x = np.pad(lattice.x_points, GHOSTS, mode="edge")
        y = np.full_like(x, lattice.y_points.mean())
        if np.any(self.scene.terrain.lateral_slope(x, y)):
            raise ValueError("the lattice form needs a bed without lateral slope")
        xi = self.scene.terrain.inclination(x, y)
        return Bed(g * np.sin(xi), g * np.cos(xi), self.scene.terrain.curvature(x, y))

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
        return float(self.state[0].sum()) * self.scene.lattice.cell_area

    @property
    def place(self) -> tuple[float, float]:
        """Where a value was not finite, x and y in m; NaN if none was."""
        j, i = self.progress.place
        lattice = self.scene.lattice
        return (float(lattice.x_points[i]), float(lattice.y_points[j])) if j >= 0 else (np.nan, np.nan)
