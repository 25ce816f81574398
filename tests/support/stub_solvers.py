"""Solvers that do next to nothing, or harm; importable by worker processes."""

import errno
import os
import resource
import signal
import time
from dataclasses import replace
from pathlib import Path

import numpy as np
from zarr.storage import FsspecStore, LocalStore

from solver.result import Failure, Ledger, Result
from solver.simulation import simulate

SET = LocalStore.set, FsspecStore.set
RAISES, KILLS, FAILS, OVERRUNS, HANGS, SWELLS = 11.0, 12.0, 13.0, 14.0, 15.0, 16.0


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


def by_friction(scene, times, *, log, harm=True, **options):
    """Note the run in a file, then raise, die, fail, ... where the bed friction angle says so."""
    angle = scene.friction.bed_friction
    with Path(log).open("a") as file:
        file.write(f"{angle:g}\n")
    if not harm:
        return still(scene, times, **options)
    if angle == RAISES:
        raise ValueError("this run raises")
    if angle == KILLS:
        os.kill(os.getpid(), signal.SIGKILL)
    if angle == HANGS:
        time.sleep(60)
    if angle == SWELLS:
        np.ones(50_000_000)
    if angle == FAILS:
        return still(scene, times, failure=Failure("not finite", 0.5, 1.0, 2.0), **options)
    return still(scene, times, outflow=0.125 if angle == OVERRUNS else 0.0, **options)


def slow(scene, times, *, log, seconds=0.5, **options):
    """Take a while."""
    result = by_friction(scene, times, log=log, **options)
    time.sleep(seconds)
    return result


def gated(scene, times, *, log, free, **options):
    """Wait, from a bed friction on, until the file of the gate is there."""
    result = by_friction(scene, times, log=log, **options)
    while scene.friction.bed_friction >= free and not Path(log).with_suffix(".gate").exists():
        time.sleep(0.01)
    return result


def full_from(scene, times, *, at, **options):
    """Leave a disk without room for more than a few bytes a file where the bed friction is ``at``."""
    # the log has no room either then, but for a part of a line
    result = by_friction(scene, times, **options)
    if scene.friction.bed_friction == at:
        resource.setrlimit(resource.RLIMIT_FSIZE, (20, resource.RLIM_INFINITY))
    return result


async def _refuse(self, key, value, byte_range=None):
    raise OSError(errno.EROFS, os.strerror(errno.EROFS), key)


def read_only_from(scene, times, *, at, **options):
    """Leave a store that can only be read where the bed friction is ``at``."""
    if scene.friction.bed_friction == at:
        LocalStore.set = FsspecStore.set = _refuse
    return by_friction(scene, times, **options)


def heal():
    """Undo what stores were made to refuse."""
    resource.setrlimit(resource.RLIMIT_FSIZE, (resource.RLIM_INFINITY, resource.RLIM_INFINITY))
    LocalStore.set, FsspecStore.set = SET


def dying_after(scene, times, *, log, saves, keeper, **options):
    """Run the solver, noting the time it begins at; once, die after so many checkpoints."""
    load, save = keeper.load, keeper.save
    flag, count = Path(log).with_suffix(".died"), 0

    def noted():
        snapshot = load()
        with Path(log).open("a") as file:
            file.write(f"{0 if snapshot is None else snapshot.passed} ")
        return snapshot

    def counted(snapshot):
        nonlocal count
        save(snapshot)
        count += 1
        if count == saves and not flag.exists():
            flag.touch()
            os.kill(os.getpid(), signal.SIGKILL)

    keeper.load, keeper.save = noted, counted
    return simulate(scene, times, keeper=keeper, **options)


def breaking(scene, times, *, store, **options):
    """Leave a store that refuses to be written: a file where the folder of depth's chunks belongs."""
    Path(store, "depth", "c").write_text("in the way")
    return still(scene, times, **options)


def lasting(kinds, piece):
    """In place of compiling: outlasts its test."""
    time.sleep(60)


def gliding(scene, times, *, log, **options):
    """Have depths that fall smoothly along x, the less the smaller the bed friction."""
    result = by_friction(scene, times, log=log, harm=False, **options)
    x, _ = scene.points.coordinates
    depth = np.maximum(0.0, 2.0 - 0.04 * scene.friction.bed_friction - 0.1 * x * np.ones(scene.points.shape))
    return replace(result, max_depth=depth, max_speed=5 * depth)
