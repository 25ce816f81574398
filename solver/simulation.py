"""A scene in, a result out: the loop over the output times of a run."""

from __future__ import annotations

from collections.abc import Collection, Sequence

import numpy as np

from solver.arrays import Array
from solver.checkpoint import Keeper, Watch
from solver.forms import begin
from solver.kernels import runge_kutta
from solver.kernels.state import OPEN
from solver.result import REASONS, Failure, Ledger, Result, SectionResult
from solver.run import Run
from solver.scene import Scene

FRAMES = ("depth", "velocity_x", "velocity_y")
# Froude number above which material moves, as opposed to a film or a deposit that creeps
MOVING = 0.1


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

    Returns
    -------
    Result
        Frames, maxima, deposit and ledger.

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
    erodes = scene.erodible_bed is not None
    # its frames are kept with the others over a restart
    entrained = np.full(len(moments) if erodes else 0, np.nan)
    rest_time, failure = np.nan, None
    # what is released where nothing is known of a surface has left by now
    released = run.volume + float(run.ledger[:, 1].sum())
    run.advance(0.0, max_steps)  # compiles or loads the kernels, off the clock
    watch = Watch(run, [*kept, entrained] if erodes else kept, max_steps, max_wall, keeper)
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
        if erodes:
            entrained[k] = run.entrained
        if frames:
            for field, values in zip(kept, shown(run), strict=True):
                if len(field):
                    field[k] = values
    wall, cpu = watch.wall, watch.cpu
    came, left = run.ledger.T
    through_open = left[run.sides.kind[: len(left)] == OPEN].sum()
    record, deposit, eroded = run.maxima, run.state[0], run.eroded
    return Result(
        moments,
        depth,
        velocity_x,
        velocity_y,
        record.depth,
        np.sqrt(record.speed_squared),
        record.momentum_flux,
        record.arrival,
        deposit,
        Ledger(
            released,
            float(came.sum()) + run.come_in,
            float(left.sum()),
            run.volume,
            float(through_open),
            run.entrained,
            float((eroded * run.cell_area).sum()),
        ),
        run.time,
        rest_time,
        int(run.progress.steps[0]),
        int(run.progress.cell_stages[0]),
        wall,
        cpu,
        failure,
        moving_volume(run),
        entrained if erodes else None,
        eroded if erodes else None,
        run.steepness * (deposit - eroded) if erodes else None,
        measured(run, failure is not None),
    )


def shown(run: Run) -> tuple[Array, Array, Array]:
    """Depth (m) and velocity (m s-1) of a frame: what is dry moves beside a flow, but is shown at rest."""
    h, u, v = run.state
    dry = np.abs(h) <= run.material.dry
    return h, np.where(dry, 0.0, u), np.where(dry, 0.0, v)


def measured(run: Run, failed: bool) -> SectionResult | None:
    """Give what passed the sections of a run; None where it has none. Nothing passes once a run rests."""
    if not run.gauges:
        return None
    record, times = run.sections, np.asarray(run.scene.section_times, np.float64)
    volume, taken = record.series.T.copy(), int(record.taken[0])
    if not failed:
        volume[:, taken:] = record.volume[:, None]
    arrival = run.maxima.arrival
    reached = []
    for gauge in run.gauges:
        found = gauge.below(arrival)
        reached.append(float(np.nanmin(found)) if np.isfinite(found).any() else np.nan)
    return SectionResult(times, volume, np.array(reached))


def moving_volume(run: Run) -> float:
    """Volume, m3, faster than ``MOVING sqrt(g h)``, h the largest depth at the start, a side or an inflow."""
    h, u, v = run.state
    fast = np.hypot(u, v) > MOVING * np.sqrt(run.scene.gravity * run.deepest)
    return float((np.maximum(h, 0.0) * run.cell_area)[fast].sum())


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
