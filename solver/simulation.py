"""The public face of the solver: a scene in, a result out."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field
from time import perf_counter, thread_time
from typing import Literal

import numpy as np
from numpy.typing import NDArray

from solver import time_stepping
from solver.activity import Bed, Material, Spans, Status
from solver.boundary import DEPTH, GHOSTS, LANES, NO_SLIP, OPEN, WALL, Fields, Grid, Sides
from solver.lattice import Lattice
from solver.reconstruction import FaceValues
from solver.rheology import Coulomb, EarthPressure, Isotropic, Voellmy
from solver.riemann import Fluxes
from solver.terrain import Plane, Terrain
from solver.time_stepping import Progress, Record, record_maxima
from solver.weighted_residual import RING, Buffers

Array = NDArray[np.float64]
Side = Literal["open", "wall", "no-slip"] | float


@dataclass(frozen=True)
class Boundaries:
    """What stands at each side of the domain: a kind, or a given depth in m."""

    x_min: Side = "open"
    x_max: Side = "open"
    y_min: Side = "open"
    y_max: Side = "open"


@dataclass(frozen=True)
class Scheme:
    """Numerical choices of the weighted-residual form.

    cfl : Courant number of the unsplit step, ``dt max((|u| + c_x)/dx + (|v| + c_y)/dy)``.
    wet_limit : depth up to which a cell counts as dry and does not move, part of the largest initial depth.
    rest_share : share of the released volume that may still move in a run that counts as at rest.
    """

    cfl: float = 0.9
    wet_limit: float = 1e-4
    rest_share: float = 1e-4


@dataclass(frozen=True)
class Scene:
    """One run: where, what, and by which laws.

    depth, velocity_x, velocity_y : initial state, shape (ny, nx), m and m s-1.
    """

    lattice: Lattice
    terrain: Terrain
    depth: Array
    velocity_x: Array
    velocity_y: Array
    friction: Coulomb | Voellmy
    earth_pressure: EarthPressure = field(default_factory=Isotropic)
    gravity: float = 9.81
    boundaries: Boundaries = field(default_factory=Boundaries)
    scheme: Scheme = field(default_factory=Scheme)


@dataclass(frozen=True)
class Failure:
    """Why a run ended early: reason, time (s) and place (x, y in m; NaN where it has none)."""

    reason: str
    time: float
    x: float
    y: float


@dataclass(frozen=True)
class Ledger:
    """Volumes in m3: released, in and out through boundaries, and now in the domain."""

    released: float
    inflow: float
    outflow: float
    now: float

    @property
    def error(self) -> float:
        """(now - released - inflow + outflow) / (released + inflow), dimensionless."""
        total = self.released + self.inflow
        return (self.now - total + self.outflow) / total if total > 0 else 0.0


@dataclass(frozen=True)
class Result:
    """What a run gives; arrays are float64, a frame never computed is NaN.

    times : (nt,) the frames asked for, s. depth (m), velocity_x, velocity_y (m s-1) : (nt, ny, nx).
    max_depth (m), max_speed (m s-1), max_momentum_flux (h |u|^2, m3 s-2), arrival_time (s, NaN where not
    reached) : (ny, nx), over all time steps. deposit_depth : (ny, nx), the last state computed, m.
    time : reached, s. rest_time : s, NaN if still moving. steps : time steps taken.
    cell_stages : cells updated, summed over stages. wall_time, cpu_time : s, of the time loop.
    """

    times: Array
    depth: Array
    velocity_x: Array
    velocity_y: Array
    max_depth: Array
    max_speed: Array
    max_momentum_flux: Array
    arrival_time: Array
    deposit_depth: Array
    ledger: Ledger
    time: float
    rest_time: float
    steps: int
    cell_stages: int
    wall_time: float
    cpu_time: float
    failure: Failure | None


def simulate(
    scene: Scene,
    times: Sequence[float] | Array,
    *,
    arrival_depth: float = 0.0,
    stop_at_rest: bool = True,
    max_steps: int | None = None,
) -> Result:
    """Run a scene to the last of ``times``, with frames at each of them.

    Once a run is at rest its later frames hold the deposit. A run that fails returns its good frames
    and a Failure; it does not raise.

    Parameters
    ----------
    scene : Scene
        What to run.
    times : (nt,) sequence
        Times of the frames, s, increasing, the first at least 0.
    arrival_depth : float
        Depth above which a cell counts as reached, m.
    stop_at_rest : bool
        Let ``time`` end where all is at rest; otherwise it goes on to the last frame. Frames are the same.
    max_steps : int, optional
        Steps after which the run fails.

    Raises
    ------
    ValueError
        If times do not increase, an array has a wrong shape, a negative depth or a value not finite, or a
        side is neither a kind nor a depth.
    """
    frames = np.asarray(times, dtype=np.float64)
    increasing = frames.ndim == 1 and len(frames) and frames[0] >= 0 and (np.diff(frames) > 0).all()
    if not increasing or not np.isfinite(frames).all():
        raise ValueError("times must be one or more increasing finite numbers, the first at least 0")
    run = _Run(scene, frames[-1], arrival_depth)
    shape = (len(frames), *scene.lattice.shape)
    depth, velocity_x, velocity_y = np.full((3, *shape), np.nan)
    rest_time, failure = np.nan, None
    released = run.volume
    run.advance(0.0, max_steps)  # compiles or loads the kernels, off the clock
    wall, cpu = perf_counter(), thread_time()
    outcome = time_stepping.REACHED
    for k, time in enumerate(frames):
        if outcome != time_stepping.AT_REST:
            outcome = run.advance(time, max_steps)
        if outcome == time_stepping.AT_REST and np.isnan(rest_time):
            rest_time = run.time
            run.settle()
        if outcome == time_stepping.AT_REST and not stop_at_rest:
            run.progress.time[0] = time
        if outcome not in (time_stepping.REACHED, time_stepping.AT_REST):
            failure = run.failure(outcome)
            break
        depth[k], velocity_x[k], velocity_y[k] = run.state
    wall, cpu = perf_counter() - wall, thread_time() - cpu
    inflow, outflow = run.progress.ledger
    record = Record(*(a.reshape(shape[1:]) for a in run.record))
    return Result(
        frames,
        depth,
        velocity_x,
        velocity_y,
        record.depth,
        np.sqrt(record.speed_squared),
        record.momentum_flux,
        record.arrival,
        run.state[0],
        Ledger(released, float(inflow), float(outflow), run.volume),
        run.time,
        rest_time,
        int(run.progress.steps[0]),
        int(run.progress.cell_stages[0]),
        wall,
        cpu,
        failure,
    )


def compile_kernels() -> None:
    """Compile the kernels, or load them where they are compiled; takes half a minute once, then a second."""
    flat = np.zeros((2, 2))
    simulate(Scene(Lattice((0, 1), (0, 1), 1.0), Plane(0.0), flat, flat, flat, Coulomb(0.0)), [0.0])


REASONS = {
    time_stepping.OUT_OF_STEPS: "more steps than allowed",
    time_stepping.NOT_FINITE: "a value that is not finite",
    time_stepping.COLLAPSED: "the time step collapsed",
}


def roomy(size: int, values: Array | None = None) -> Array:
    """Flat array of zeros or of values, with room behind it that a whole vector may read and write."""
    array: Array = np.zeros(size + 2 * LANES)[:size]
    if values is not None:
        array[:] = values.ravel()
    return array


class _Run:
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
            np.zeros(1), np.zeros(1, np.int64), np.zeros(1, np.int64), np.zeros(2), np.full(2, -1, np.int64)
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

    def failure(self, outcome: int) -> Failure:
        """Put an outcome into words, with time and place."""
        j, i = self.progress.place
        lattice = self.scene.lattice
        x, y = (lattice.x_points[i], lattice.y_points[j]) if j >= 0 else (np.nan, np.nan)
        return Failure(REASONS[outcome], self.time, float(x), float(y))
