"""What the kernels of a lattice run read and write."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from solver.arrays import Array, Indices
from solver.kernels.erosion import Erosion
from solver.kernels.record import Record
from solver.kernels.sections.inflow import Inflows
from solver.kernels.sections.measured import Sections
from solver.kernels.state import Bed, FaceValues, Fields, Fluxes, Grid, Material, Sides, Status
from solver.lattice.spans import Spans
from solver.lattice.walls import Walls
from solver.referenced import by_reference

# Rows held in the ring of fluxes.
RING = 4


class Buffers(NamedTuple):
    """Scratch rows, reused by every stage.

    Attributes
    ----------
    along, across
        Face values of one row along x, and of two rows along y.
    x_fluxes, y_fluxes
        Ring of rows; the face with the index of a cell is the one before it along x, and the one after it
        along y.
    lost
        Ring of rows of the depth that a cell would lose in a stage, m; of those that run dry the share of
        their depth.
    emptied
        Ring of rows: how many cells run dry, and their columns.
    before
        One row of the state at the start of the step, where a stage takes its place.
    """

    along: FaceValues
    across: FaceValues
    x_fluxes: Fluxes
    y_fluxes: Fluxes
    lost: Array
    emptied: Indices
    before: Fields


@by_reference
class LatticeArrays(NamedTuple):
    """The arrays of a run.

    Attributes
    ----------
    now, first_stage, second_stage
        States at the start of the step and after its stages.
    inner
        (4,), whether a side is inside the lattice: what comes to it stops the run before the step.
    walls
        Cells beside buildings; None where the scene has none.
    """

    now: Fields
    first_stage: Fields
    second_stage: Fields
    status: Status
    bed: Bed
    material: Material
    sides: Sides
    grid: Grid
    spans: Spans
    inner: NDArray[np.bool_]
    walls: Walls | None
    buffers: Buffers
    record: Record
    erosion: Erosion
    inflows: Inflows
    sections: Sections
