"""What the loops of a stage on a cloud cost a cell, what they move and look up, and what bounds them."""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from pipeline.studies.kernels.lattice import timed
from solver.arrays import Array, Numbers
from solver.cloud.fluxes import fluxes_through
from solver.cloud.reconstruction import slopes_at
from solver.cloud.residual import add_up, cloud_stage, update_run
from solver.cloud.run import CloudRun
from solver.compiled import kernel
from solver.physics.earth_pressure import MohrCoulomb
from solver.physics.friction import Coulomb
from solver.physics.terrain import Plane
from solver.points.cloud import random_points
from solver.scene import Scene

# About the points of the chute's cloud; passes timed at once; values that are copied, more than caches hold.
POINTS, PASSES, LARGE = 15_700, 40, 2**23
X, Y = (0.0, 30.0), (-7.0, 7.0)
DT = 1e-6
# Of a face, for either side: depth, velocity, six slopes, two pressure factors and the status.
SHOWN = 2 * (3 + 6 + 3)


class Cost(NamedTuple):
    """Cost of one loop.

    Parameters
    ----------
    name : str
        Of its kernel.
    time : float
        In ns a cell-stage.
    moved : float
        Bytes a cell-stage read and written in order.
    looked_up : float
        Values a cell-stage that are found by the number of a cell or of half a face.
    """

    name: str
    time: float
    moved: float
    looked_up: float


@kernel(cached=False)
def look_up(values: Array, numbers: Numbers, out: Array) -> None:
    """Find values by their numbers: what that costs where nothing else is done."""
    for k in range(len(numbers)):
        i = np.uint64(k)
        out[i] = values[np.uint64(numbers[i])]


@kernel(cached=False)
def copy(values: Array, out: Array) -> None:
    """Copy values."""
    for i in range(len(values)):
        out[i] = values[i]


def cloud_costs() -> tuple[list[Cost], float, float]:
    """Time the loops of a stage on a cloud that is wet and moves throughout, each alone, and the stage.

    Returns
    -------
    list of Cost
        Of the kernels, by their order in a stage, and last of the stage itself.
    looking_up : float
        ns that a value takes which is found by a neighbour's number, alone.
    moving : float
        ns that a byte takes which is read from or written to memory, alone.
    """
    cloud = random_points(X, Y, POINTS, 1)
    depth = 1.0 + 0.1 * np.sin(cloud.control_volumes.centroid[:, 0])
    scene = Scene(cloud, Plane(35), depth, depth, 0.0 * depth, Coulomb(30), MohrCoulomb(38, 30))
    run = CloudRun(scene, 1.0, 0.0)
    # leaves status and activity as they are within a run
    run.advance(1.0, 2)
    faces, gradient, buffers = run.faces, run.operators.tables.gradient, run.buffers
    cells, inner, dry = faces.cells, int(faces.first[-1]), run.material.dry
    now, out, about = run.now, run.stages[0], (run.status, run.bed, run.material)
    parts = [
        (
            slopes_at,
            (now, gradient, 0, cells, dry, buffers.slopes),
            _bytes(gradient[:3], now, buffers.slopes[:6]),
            3 * gradient.neighbours.size,
        ),
        (
            fluxes_through,
            (now, run.status, faces, run.sides, dry, buffers, 0, inner),
            _bytes(faces.left, faces.right, faces.geometry, buffers.halves, buffers.pressed),
            SHOWN * inner,
        ),
        (
            add_up,
            (buffers.halves, faces, 0, cells, buffers.gain),
            _bytes(faces.around, buffers.gain),
            3 * faces.around.size,
        ),
        (
            update_run,
            (now, now, out, *about, run.area, buffers.gain, 0, cells, 0.5, DT),
            _bytes(now, out, buffers.gain[:3], run.area, run.status.static, run.bed[:3]),
            0,
        ),
        (
            cloud_stage,
            (run.arrays, now, out, 0.5, 0.5, DT, run.progress.ledger, False),
            0,
            0,
        ),
    ]
    costs = [
        Cost(loop.__name__, timed(loop, given, PASSES) / run.count, moved / run.count, looked_up / run.count)
        for loop, given, moved, looked_up in parts
    ]
    near = np.ascontiguousarray(gradient.neighbours[0])
    values, large = now.h.copy(), np.zeros(LARGE)
    looking_up = timed(look_up, (values, near, values.copy()), 100 * PASSES) / near.size
    moving = timed(copy, (large, large.copy()), 2) / (2 * large.nbytes)
    return costs, looking_up, moving


def _bytes(*arrays: NDArray[Any] | tuple[NDArray[Any], ...]) -> int:
    """Bytes of arrays, and of those in tuples."""
    return sum(_bytes(*a) if isinstance(a, tuple) else a.nbytes for a in arrays)
