"""Which cells of a cloud take part in a step, as `solver.lattice.status` finds them on a lattice.

Cells are taken by blocks of LANES neighbours in the order of the cloud. What a step reads and writes are runs
of such blocks: those that are stepped, those whose faces carry fluxes, those whose slopes these need. Nothing
else is looked at: away from what was stepped last nothing has changed, neither state nor status.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from solver.arrays import Array, Indices
from solver.cloud.faces import Faces
from solver.cloud.reconstruction import Gradient
from solver.compiled import kernel
from solver.kernels.state import LANES

Flags = NDArray[np.uint8]


class Blocks(NamedTuple):
    """The blocks near each block, itself included: ``near[first[b]:first[b + 1]]``.

    Near are those that share a face with it, or a support.
    """

    first: Indices
    near: Indices


class Activity(NamedTuple):
    """Flags of blocks, each (blocks,), and runs of them, each (blocks + 1, 2), first and last of a run.

    Attributes
    ----------
    moving
        Blocks with cells that are not static.
    stepped
        Blocks with cells that can change in the step.
    fluxed
        Blocks left of faces of those.
    sloped
        Blocks near those.
    counts
        (3,), number of runs of the last three.
    top
        (blocks,), largest wave rate of each, s-1.
    """

    moving: Flags
    stepped: Flags
    fluxed: Flags
    sloped: Flags
    stepped_runs: Indices
    fluxed_runs: Indices
    sloped_runs: Indices
    counts: Indices
    top: Array


def blocks_near(faces: Faces, gradient: Gradient) -> Blocks:
    """Find which blocks are near each other."""
    inner = slice(0, faces.first[-1])
    cell = np.tile(np.arange(faces.cells), len(gradient.neighbours))
    one = np.concatenate([faces.left[inner], cell]).astype(np.int64) // LANES
    two = np.concatenate([faces.right[inner], gradient.neighbours.ravel()]).astype(np.int64) // LANES
    count = faces.cells // LANES
    pairs = np.unique(np.concatenate([one * count + two, two * count + one]))
    return Blocks(np.searchsorted(pairs, count * np.arange(count + 1)), pairs % count)


def activity_of(faces: Faces) -> Activity:
    """Make the flags and runs of a run; at first all is to be looked at."""
    count = faces.cells // LANES
    one, two, three, near = (np.full(count, flag, np.uint8) for flag in (0, 0, 0, 1))
    runs, others, everything = (np.zeros((count + 1, 2), np.int64) for _ in range(3))
    everything[0] = 0, faces.cells
    return Activity(one, two, three, near, runs, others, everything, np.array([0, 0, 1]), np.zeros(count))


@kernel()
def collect(flags: Flags, runs: Indices) -> int:
    """Fill runs (blocks + 1, 2) with the cells, half-open, of each run of flagged blocks; count the runs."""
    count, inside = 0, False
    for b in range(len(flags)):
        if flags[b] and not inside:
            runs[count, 0] = b * LANES
        if inside and not flags[b]:
            runs[count, 1] = b * LANES
            count += 1
        inside = flags[b] != 0
    if inside:
        runs[count, 1] = len(flags) * LANES
        count += 1
    return count


@kernel()
def reach(b: int, first: Indices, near: Indices, fluxed: Flags, sloped: Flags) -> None:
    """Flag the blocks near block b as sloped, and those before it as fluxed."""
    for k in range(first[b], first[b + 1]):
        sloped[near[k]] = 1
        if near[k] < b:
            fluxed[near[k]] = 1


@kernel()
def spread_blocks(static: Array, faces: Faces, blocks: Blocks, activity: Activity) -> int:
    """Find the blocks that take part in the step, and their runs; return the number of cells stepped."""
    moving, stepped, fluxed, sloped = activity.moving, activity.stepped, activity.fluxed, activity.sloped
    left, right, first, near = faces.left, faces.right, blocks.first, blocks.near
    for b in range(len(moving)):
        stepped[b] = fluxed[b] = sloped[b] = moving[b]
    for b in range(len(moving)):
        if moving[b]:
            reach(b, first, near, fluxed, sloped)
    for b in range(len(moving)):
        for s in range(faces.first_side[b], faces.first_side[b + 1]):
            if static[faces.cells + s] == 0.0:
                stepped[b] = 1
        inside = moving[b]
        for k in range(first[b], first[b + 1] if sloped[b] else first[b]):
            inside &= moving[near[k]]
        if inside or not sloped[b]:
            continue
        # at the edge of what moves it is seen face by face
        for f in range(faces.first[b], faces.first[b + 1]):
            there = int(right[f]) // LANES
            known = stepped[b] and stepped[there]
            if not known and (static[left[f]] == 0.0 or static[right[f]] == 0.0):
                stepped[b] = stepped[there] = 1
    cells = 0
    for b in range(len(stepped)):
        if stepped[b]:
            cells += LANES
            fluxed[b] = sloped[b] = 1
            if not moving[b]:
                reach(b, first, near, fluxed, sloped)
    activity.counts[0] = collect(stepped, activity.stepped_runs)
    activity.counts[1] = collect(fluxed, activity.fluxed_runs)
    activity.counts[2] = collect(sloped, activity.sloped_runs)
    return cells
