"""What the kernels of a run on a surface read and write."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from solver.arrays import Array
from solver.kernels.erosion import Erosion
from solver.kernels.record import Record
from solver.kernels.sections.inflow import Inflows
from solver.kernels.sections.measured import Sections
from solver.kernels.state import Fields, Grid, Material, Sides
from solver.lattice.arrays import Buffers
from solver.lattice.spans import Spans
from solver.lattice.walls import Walls
from solver.referenced import by_reference
from solver.surface.metric import Metric
from solver.surface.pressure import Pressure
from solver.surface.reconstruction import Levels


@by_reference
class SurfaceArrays(NamedTuple):
    """The arrays of a run; velocities are in the frames of the cells.

    Attributes
    ----------
    now, first_stage, second_stage
        States at the start of the step and after its stages.
    static
        DRY or BELOW_YIELD where a cell is so, else 0; flat array of the padded lattice.
    pressure
        Where the axes of the pressure are those of the flow; None where it is isotropic.
    inner
        (4,), whether a side is inside the lattice: what comes to it stops the run before the step.
    walls
        Cells beside buildings; None where the scene has none.
    """

    now: Fields
    first_stage: Fields
    second_stage: Fields
    static: Array
    pressure: Pressure | None
    metric: Metric
    material: Material
    sides: Sides
    grid: Grid
    spans: Spans
    inner: NDArray[np.bool_]
    walls: Walls | None
    buffers: Buffers
    levels: Levels
    record: Record
    erosion: Erosion
    inflows: Inflows
    sections: Sections
