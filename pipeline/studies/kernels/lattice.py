"""What the loops of a stage on a lattice cost a cell, what they are made of, and what bounds them."""

from __future__ import annotations

import math
import re
from statistics import median
from time import thread_time
from typing import Any, NamedTuple

import numpy as np

from solver.arrays import Array
from solver.compiled import kernel
from solver.kernels.riemann import hll
from solver.kernels.runge_kutta import SSP_RK3
from solver.kernels.state import GHOSTS, Fields, Status
from solver.lattice.outflow import outflow_exceeds
from solver.lattice.reconstruction import face_values
from solver.lattice.residual import update_row
from solver.lattice.run import LatticeRun
from solver.lattice.status import classify_run
from solver.physics.earth_pressure import MohrCoulomb
from solver.physics.friction import Coulomb
from solver.physics.terrain import Plane
from solver.points.lattice import Lattice
from solver.scene import Scene

# Cells of the row, as long as those of fine runs; and passes over it that are timed at once, and how often.
CELLS, PASSES, REPEATS = 1024, 2000, 7
DRY, DT = 1e-9, 1e-6


class Cost(NamedTuple):
    """Cost of one loop.

    Parameters
    ----------
    name : str
        Of its kernel.
    passes : float
        Over a cell in a stage.
    time : float
        In ns a cell and pass.
    instructions, divisions, roots : int
        Vector instructions of the compiled loop, for as many cells as a vector holds.
    """

    name: str
    passes: float
    time: float
    instructions: int
    divisions: int
    roots: int


@kernel(cached=False)
def repeat(n: int, loop: Any, given: tuple[Any, ...]) -> None:
    """Call a loop n times."""
    for _ in range(n):
        loop(*given)


@kernel(cached=False)
def divide(a: Array, b: Array, out: Array) -> None:
    """Divide a row: what a division costs where nothing else is done."""
    for i in range(len(a)):
        out[i] = a[i] / b[i]


@kernel(cached=False)
def root(a: Array, out: Array) -> None:
    """Take the square root of a row."""
    for i in range(len(a)):
        out[i] = math.sqrt(a[i])


def kernel_costs() -> tuple[list[Cost], float, float]:
    """Time the loops of a stage on one row that is wet and moves throughout.

    Returns
    -------
    list of Cost
        Of the kernels, by their order in a stage.
    division, root : float
        ns that a division and a square root take a cell, alone.
    """
    lattice = Lattice((0.0, CELLS - 1.0), (0.0, 4.0), 1.0)
    wet = np.ones(lattice.shape)
    scene = Scene(lattice, Plane(20), wet, wet, wet, Coulomb(15), MohrCoulomb(30, 15))
    run = LatticeRun(scene, 1.0, 0.0, whole=True)
    shape = run.now.h.shape
    wave = np.sin(np.arange(shape[0]) / 50.0)
    now = Fields(1.0 + 0.1 * wave, 1.0 + 0.2 * wave, 0.3 * wave)
    out = Fields(*(a.copy() for a in now))
    status = Status(*(np.full(shape, q) for q in (9.0, 9.0, 0.0)))
    g, count = GHOSTS, CELLS
    cell, flux, grid = g * run.grid.stride + g, run.buffers.x_fluxes, run.grid
    along, bed, material = run.buffers.along, run.bed, run.material
    # every kernel with whether it is told that its arrays do not overlap, and what it is given
    loops: list[tuple[Any, bool, float, tuple[Any, ...]]] = [
        (face_values, True, 2, (*now, status.beta_x, cell, 1, count, DRY, along, g)),
        (hll, True, 2, (along, g, along, g + 1, status.static, cell, 1, count, DRY, flux, g)),
        (
            outflow_exceeds,
            True,
            1,
            (now.h, None, cell, count, flux.mass, g, flux.mass, g, g, DT, grid, run.buffers.lost, g),
        ),
        (
            update_row,
            True,
            1,
            (now, now, out, status, bed, material, cell, g, count, flux, g, flux, g, g, 0.5, DT, grid),
        ),
        (
            classify_run,
            True,
            1 / len(SSP_RK3),
            (now, status, bed, material, grid, run.spans.rate, cell, g, count),
        ),
    ]
    costs = []
    for loop, unaliased, passes, given in loops:
        # what comes from the disk cannot be looked into
        fresh = kernel(unaliased=unaliased, cached=False)(loop.py_func)
        costs.append(Cost(loop.__name__, passes, timed(fresh, given) / count, *_instructions(fresh)))
    row = np.linspace(1.0, 2.0, CELLS)
    alone = timed(divide, (row, row, row.copy())), timed(root, (row, row.copy()))
    return costs, alone[0] / CELLS, alone[1] / CELLS


def timed(loop: Any, given: tuple[Any, ...], passes: int = PASSES) -> float:
    """Time of a pass, ns, the median of repeats; compiled before."""
    repeat(1, loop, given)
    taken = []
    for _ in range(REPEATS):
        began = thread_time()
        repeat(passes, loop, given)
        taken.append(thread_time() - began)
    return 1e9 * median(taken) / passes


def _instructions(loop: Any) -> tuple[int, int, int]:
    """Count the instructions on the widest vectors in the code of a kernel, its divisions and its roots."""
    code = "\n".join(loop.inspect_asm().values())
    widest = next((name for name in ("zmm", "ymm", "xmm") if f"%{name}" in code), "xmm")
    lines = [line.split()[0] for line in code.splitlines() if re.search(rf"%{widest}\d", line)]
    return len(lines), sum("divp" in op for op in lines), sum("sqrtp" in op for op in lines)
