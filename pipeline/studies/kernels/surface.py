"""What a stage costs on an elevation model, side by side with one on a slope profile."""

from __future__ import annotations

from statistics import median
from time import thread_time
from typing import NamedTuple

import numpy as np

from solver.forms import begin
from solver.physics.elevation import ElevationModel, Surface
from solver.physics.friction import Coulomb
from solver.physics.terrain import Plane, Terrain
from solver.points.lattice import Lattice
from solver.scene import Scene

# Cells along a side, all of them wet and moving, with the time steps that are timed at once; and how often.
SIDES, REPEATS = {200: 160, 400: 40}, 9
ANGLE, FRICTION, SPEED = 20.0, 15.0, 5.0
# Roughness of the elevations, m, and the length that they are averaged over for curvature, in cells.
ROUGH, LENGTH, SEED = 0.05, 5.0, 1


class Cost(NamedTuple):
    """Cost of a stage on a bed.

    Parameters
    ----------
    bed : str
        What the flow lies on.
    cells : int
        Of the lattice.
    time : float
        In ns a cell-stage, the median of repeats.
    share : float
        Cell-stages a second as a part of those on the profile, the median of repeats side by side.
    """

    bed: str
    cells: int
    time: float
    share: float


def surface_costs() -> list[Cost]:
    """Time whole steps on a profile and on elevation models of the same slope, in turn."""
    return [cost for side, steps in SIDES.items() for cost in _costs(side, steps)]


def _costs(side: int, steps: int) -> list[Cost]:
    lattice = Lattice((0.0, side - 1.0), (0.0, side - 1.0), 1.0)
    x = np.arange(-8.0, side + 8.0)
    fall = np.broadcast_to(-np.tan(np.radians(ANGLE)) * x, (len(x), len(x)))
    noise = np.random.default_rng(SEED).normal(0.0, ROUGH, fall.shape)
    beds: dict[str, Terrain | Surface] = {
        "slope profile": Plane(ANGLE),
        "elevation model, plane": ElevationModel(x, x, fall.copy(), LENGTH),
        "elevation model, rough": ElevationModel(x, x, fall + noise, LENGTH),
    }
    taken: dict[str, list[float]] = {name: [] for name in beds}
    for _ in range(1 + REPEATS):
        for name, bed in beds.items():
            taken[name].append(_pass(bed, lattice, steps))
    # what was first may have been compiled meanwhile
    times = {name: each[1:] for name, each in taken.items()}
    known = times["slope profile"]
    return [
        Cost(
            name,
            side * side,
            median(each),
            median(first / time for first, time in zip(known, each, strict=True)),
        )
        for name, each in times.items()
    ]


def _pass(bed: Terrain | Surface, lattice: Lattice, steps: int) -> float:
    """Time of some steps of a flow on a bed, ns a cell-stage."""
    x, y = lattice.coordinates
    depth = 1.0 + 0.1 * np.sin(x / 8.0) * np.cos(y / 8.0)
    scene = Scene(lattice, bed, depth, np.full_like(x, SPEED), 0.1 * np.sin(y / 5.0), Coulomb(FRICTION))
    run = begin(scene, 1e3, 0.0, False)
    # makes the windows, off the clock
    run.advance(1e3, 2)
    before, began = int(run.progress.cell_stages[0]), thread_time()
    run.advance(1e3, 2 + steps)
    return 1e9 * (thread_time() - began) / (int(run.progress.cell_stages[0]) - before)
