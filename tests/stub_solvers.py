"""Solvers that do next to nothing, or harm; importable by worker processes."""

import os
import signal
import time
from pathlib import Path

import numpy as np

from solver.simulation import Failure, Ledger, Result

RAISES, KILLS, FAILS, OVERRUNS = 11.0, 12.0, 13.0, 14.0


def still(scene, times, *, arrival_depth, stop_at_rest, failure=None, outflow=0.0, **limits):
    """Leave the release where it is."""
    frames = np.repeat(scene.depth[None], len(times), axis=0)
    volume = float(scene.depth.sum()) * scene.points.cell_area
    return Result(
        times=np.asarray(times),
        depth=frames,
        velocity_x=np.zeros_like(frames),
        velocity_y=np.zeros_like(frames),
        max_depth=scene.depth,
        max_speed=np.zeros_like(scene.depth),
        max_momentum_flux=np.zeros_like(scene.depth),
        arrival_time=np.where(scene.depth > arrival_depth, 0.0, np.nan),
        deposit_depth=scene.depth,
        ledger=Ledger(volume, 0.0, outflow, volume - outflow, outflow),
        time=float(times[-1]),
        rest_time=0.0,
        steps=1,
        cell_stages=3,
        wall_time=0.0,
        cpu_time=0.0,
        failure=failure,
    )


def by_friction(scene, times, *, log, **options):
    """Note the run in a file, then raise, die, fail or overrun where the bed friction angle says so."""
    angle = scene.friction.bed_friction
    with Path(log).open("a") as file:
        file.write(f"{angle:g}\n")
    if angle == RAISES:
        raise ValueError("this run raises")
    if angle == KILLS:
        os.kill(os.getpid(), signal.SIGKILL)
    if angle == FAILS:
        return still(scene, times, failure=Failure("not finite", 0.5, 1.0, 2.0), **options)
    return still(scene, times, outflow=0.125 if angle == OVERRUNS else 0.0, **options)


def slow(scene, times, *, log, seconds=0.5, **options):
    """Take a while."""
    result = by_friction(scene, times, log=log, **options)
    time.sleep(seconds)
    return result


def breaking(scene, times, *, store, **options):
    """Leave a store that refuses to be written: a file where the folder of depth's chunks belongs."""
    Path(store, "depth", "c").write_text("in the way")
    return still(scene, times, **options)
