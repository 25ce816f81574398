"""What the kernels of a cloud run read and write."""

from __future__ import annotations

from typing import NamedTuple

from solver.arrays import Array
from solver.cloud.blocks import Activity, Blocks
from solver.cloud.faces import Faces
from solver.cloud.flow_axes import Ways
from solver.cloud.fluxes import CloudBuffers
from solver.cloud.reconstruction import Gradient, Strain
from solver.cloud.sections import Doors
from solver.kernels.erosion import Erosion
from solver.kernels.record import Record
from solver.kernels.sections.inflow import Inflows
from solver.kernels.sections.measured import Sections
from solver.kernels.state import CloudBed, Fields, Material, Sides, Status
from solver.referenced import by_reference


@by_reference
class CloudArrays(NamedTuple):
    """The arrays of a run.

    Attributes
    ----------
    now, first_stage, second_stage
        States at the start of the step and after its stages; between steps they are equal, so that a stage
        finds in its own what it reads beside the cells it steps.
    area
        (cells,), of the control volumes, m2.
    widths
        (5, cells), from `solver.cloud.status.widths_of`.
    ways
        To the neighbours, where the axes of the pressure are those of the flow; None elsewhere.
    """

    now: Fields
    first_stage: Fields
    second_stage: Fields
    status: Status
    bed: CloudBed
    material: Material
    sides: Sides
    area: Array
    widths: Array
    faces: Faces
    gradient: Gradient
    strain: Strain
    ways: Ways | None
    blocks: Blocks
    activity: Activity
    buffers: CloudBuffers
    record: Record
    erosion: Erosion
    inflows: Inflows
    doors: Doors
    sections: Sections
