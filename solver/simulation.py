"""The public face of the solver: a scene in, a result out."""

from __future__ import annotations

from collections.abc import Collection, Sequence
from dataclasses import dataclass
from typing import get_args

import numpy as np

from solver.arrays import Array
from solver.checkpoint import Keeper, Watch
from solver.cloud.run import CloudRun
from solver.cloud.time_stepping import advance_cloud
from solver.collocation.run import CollocationRun
from solver.collocation.time_stepping import advance_collocation
from solver.compiled import is_compiled
from solver.forms import Kind, kind_of
from solver.kernels import runge_kutta
from solver.kernels.state import OPEN
from solver.lattice.run import LatticeRun
from solver.lattice.time_stepping import advance
from solver.physics.friction import Coulomb
from solver.physics.terrain import Plane
from solver.points.cloud import random_points
from solver.points.lattice import Lattice
from solver.run import Run
from solver.scene import Boundaries, Collocation, Scene, WeightedResidual

__all__ = [
    "Boundaries",
    "Collocation",
    "Failure",
    "Ledger",
    "Result",
    "Scene",
    "WeightedResidual",
    "begin",
    "compile_kernels",
    "simulate",
]

KINDS: tuple[Kind, ...] = get_args(Kind)
FRAMES = ("depth", "velocity_x", "velocity_y")
OUT_OF_TIME = "more time than allowed"
# Froude number above which material moves, as opposed to a film or a deposit that creeps
MOVING = 0.1
REASONS = {
    runge_kutta.OUT_OF_STEPS: "more steps than allowed",
    runge_kutta.OUT_OF_TIME: OUT_OF_TIME,
    runge_kutta.NOT_FINITE: "a value that is not finite",
    runge_kutta.COLLAPSED: "the time step collapsed",
}


@dataclass(frozen=True)
class Failure:
    """Why a run ended early: reason, time (s) and place (x, y in m).

    The place is that of the value that is not finite, otherwise that of the fastest waves for the size of the
    cell, which set the time step; NaN where nothing flows.
    """

    reason: str
    time: float
    x: float
    y: float


@dataclass(frozen=True)
class Ledger:
    """Volumes in m3: released, in and out through all sides, now in the domain, out through open sides."""

    released: float
    inflow: float
    outflow: float
    now: float
    outflow_open: float = 0.0

    @property
    def error(self) -> float:
        """(now - released - inflow + outflow) / (released + inflow), dimensionless."""
        total = self.released + self.inflow
        return (self.now - total + self.outflow) / total if total > 0 else 0.0


@dataclass(frozen=True)
class Result:
    """What a run gives; arrays are float64, a frame never computed is NaN.

    times : (nt,) the frames asked for, s. depth (m), velocity_x, velocity_y (m s-1) : (nt, ny, nx) on a
    lattice, (nt, n) on a cloud. max_depth (m), max_speed (m s-1), max_momentum_flux (h |u|^2, m3 s-2),
    arrival_time (s, NaN where not reached) : (ny, nx) or (n,), over all time steps. deposit_depth : of the
    same shape, the last good state, m.
    time : of the last good state, s. rest_time : s, NaN if still moving. steps : time steps taken to
    there. cell_stages : cells updated, summed over stages. wall_time, cpu_time : s, of the time loop.
    moving_volume : m3 that is faster than a Froude number of `MOVING` by the largest depth at the start, or
    held at a side, in the last good state.
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
    moving_volume: float = 0.0


def simulate(
    scene: Scene,
    times: Sequence[float] | Array,
    *,
    arrival_depth: float = 0.0,
    stop_at_rest: bool = True,
    max_steps: int | None = None,
    frames: Collection[str] = FRAMES,
    skip: bool = True,
    max_wall: float | None = None,
    keeper: Keeper | None = None,
) -> Result:
    """Run a scene to the last of ``times``, with frames at each of them.

    Once a run is at rest its later frames hold the deposit. A run that fails returns its good frames, its
    last good state and a Failure; it does not raise.

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
    frames : collection of str
        Of depth, velocity_x and velocity_y those to keep at the times; the others have no frames, (0, ...).
    skip : bool
        Leave out what the scene does not need. The result is the same to the last bit, but for times and
        ``cell_stages``.
    max_wall : float, optional
        Elapsed time of the time loop after which the run fails, s; looked at a few times a second.
    keeper : Keeper, optional
        Keeps snapshots; the run goes on from the one it has, and ends as if it had not stopped.

    Raises
    ------
    ValueError
        If times do not increase, an array has a wrong shape, a negative depth or a value not finite, a
        side is neither a kind nor a depth, operators are those of another cloud or scheme, or a snapshot is
        of another kind of run.
    """
    moments = np.asarray(times, dtype=np.float64)
    increasing = moments.ndim == 1 and len(moments) and moments[0] >= 0 and (np.diff(moments) > 0).all()
    if not increasing or not np.isfinite(moments).all():
        raise ValueError("times must be one or more increasing finite numbers, the first at least 0")
    run = begin(scene, float(moments[-1]), arrival_depth, skip)
    depth, velocity_x, velocity_y = kept = [
        np.full((len(moments) if name in frames else 0, *scene.points.shape), np.nan) for name in FRAMES
    ]
    rest_time, failure = np.nan, None
    released = run.volume
    run.advance(0.0, max_steps)  # compiles or loads the kernels, off the clock
    watch = Watch(run, kept, max_steps, max_wall, keeper)
    outcome = runge_kutta.REACHED
    for k, time in enumerate(moments[watch.passed :], watch.passed):
        if outcome != runge_kutta.AT_REST:
            outcome = watch.advance(time, k)
        if outcome == runge_kutta.AT_REST and np.isnan(rest_time):
            rest_time = run.time
            run.settle()
        if outcome == runge_kutta.AT_REST and not stop_at_rest:
            run.progress.time[0] = time
        if outcome not in (runge_kutta.REACHED, runge_kutta.AT_REST):
            bad = outcome == runge_kutta.NOT_FINITE
            failure = Failure(REASONS[outcome], run.time, *(run.place if bad else fastest(run)))
            if bad:
                run = watch.rewind(begin(scene, run.end, arrival_depth, skip), moments)
            break
        if frames:
            for field, values in zip(kept, run.state, strict=True):
                if len(field):
                    field[k] = values
    wall, cpu = watch.wall, watch.cpu
    came, left = run.ledger.T
    through_open = left[run.sides.kind == OPEN].sum()
    record = run.maxima
    return Result(
        moments,
        depth,
        velocity_x,
        velocity_y,
        record.depth,
        np.sqrt(record.speed_squared),
        record.momentum_flux,
        record.arrival,
        run.state[0],
        Ledger(released, float(came.sum()), float(left.sum()), run.volume, float(through_open)),
        run.time,
        rest_time,
        int(run.progress.steps[0]),
        int(run.progress.cell_stages[0]),
        wall,
        cpu,
        failure,
        moving_volume(run),
    )


def begin(scene: Scene, end: float, arrival_depth: float, skip: bool) -> Run:
    """Make the run that a scene's points and scheme ask for."""
    match kind_of(scene.points, scene.scheme):
        case "lattice":
            return LatticeRun(scene, end, arrival_depth, whole=not skip)
        case "cloud":
            return CloudRun(scene, end, arrival_depth)
        case "collocation":
            return CollocationRun(scene, end, arrival_depth)


def moving_volume(run: Run) -> float:
    """Volume, m3, that is faster than ``MOVING sqrt(g h)``, h the largest depth at the start or at a side."""
    h, u, v = run.state
    deepest = max(float(np.max(run.scene.depth)), float(run.sides.depth.max()))
    fast = np.hypot(u, v) > MOVING * np.sqrt(run.scene.gravity * deepest)
    return float((np.maximum(h, 0.0) * run.scene.points.cell_area)[fast].sum())


def fastest(run: Run) -> tuple[float, float]:
    """Place, x and y in m, of the fastest waves for the size of the cell; NaN where nothing is wet."""
    points, (h, u, v) = run.scene.points, run.state
    wet = h > run.material.dry
    if not wet.any():
        return np.nan, np.nan
    waves = np.sqrt(max(run.material.pressure) * run.scene.gravity * np.maximum(h, 0.0))
    rate = np.where(wet, (np.hypot(u, v) + waves) / np.sqrt(points.cell_area), 0.0)
    x, y = (np.ravel(place)[np.argmax(rate)] for place in points.coordinates)
    return float(x), float(y)


def not_compiled(kinds: Collection[Kind] = KINDS) -> list[Kind]:
    """List those kinds of runs whose kernels are not on disk yet."""
    last = {"lattice": advance, "cloud": advance_cloud, "collocation": advance_collocation}
    return [kind for kind in kinds if not is_compiled(last[kind])]


def compile_kernels(kinds: Collection[Kind] = KINDS, piece: int | None = None) -> None:
    """Compile the kernels of some kinds of runs, or load them: half a minute a kind once, then a second.

    Parameters
    ----------
    kinds : collection of Kind
        Of lattice, cloud and collocation.
    piece : int, optional
        One of `solver.run.PIECES` that different processes may compile at the same time.
    """
    for kind in kinds:
        points = random_points((0, 1), (0, 1), 60) if kind == "cloud" else Lattice((0, 1), (0, 1), 0.2)
        flat = np.zeros(points.shape)
        scheme = Collocation(support=9, degree=1) if kind == "collocation" else WeightedResidual()
        scene = Scene(points, Plane(0.0), flat, flat, flat, Coulomb(0.0), scheme=scheme)
        if piece is None:
            simulate(scene, [0.0])
        else:
            begin(scene, 0.0, 0.0, True).rehearse(piece)
