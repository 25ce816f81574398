"""One run on a cloud over a surface: the cloud's arrays, lifted on to the bed."""

from __future__ import annotations

import numpy as np

from solver.arrays import Array
from solver.cloud.faces import all_aligned
from solver.cloud.flow_axes import Ways
from solver.cloud.lift import along_axes, lifted
from solver.cloud.on_surface import empty
from solver.cloud.run import CloudRun
from solver.cloud.time_stepping import advance_cloud_on_surface
from solver.kernels.runge_kutta import Limits
from solver.kernels.state import CloudBed
from solver.physics.earth_pressure import Isotropic
from solver.physics.elevation import Surface
from solver.points.cloud import PointCloud
from solver.scene import Scene


class SurfaceCloudRun(CloudRun):
    """The arrays of one run; velocities are in the frames of the cells, as on the lattice of a surface.

    Cells where nothing is known of the surface are drains: dry at the start of a step, and emptied into the
    ledger at its end. Sides are open.

    Parameters
    ----------
    scene : Scene
        On a cloud, with a `Surface` for terrain; depth is normal to the bed.
    end : float
        Time that the run may go on to, s.
    arrival_depth : float
        Depth above which a cell counts as reached, m.

    Raises
    ------
    ValueError
        If earth pressure has the axes of a profile, or a side is not open.
    """

    def __init__(self, scene: Scene, end: float, arrival_depth: float) -> None:
        pressure = scene.earth_pressure
        if not isinstance(scene.terrain, Surface) or not isinstance(scene.points, PointCloud):
            raise TypeError("a run on a cloud over a surface needs a surface and a cloud")
        if not (isinstance(pressure, Isotropic) or pressure.along_flow):
            raise ValueError("earth pressure on a surface must be isotropic or have the axes of the flow")
        self.surface, self.cloud = scene.terrain, scene.points
        super().__init__(scene, end, arrival_depth)
        # what is released in a drain has left
        assert self.bed.lift is not None
        drain, states = self.bed.lift.drain, (self.now, *self.stages)
        empty(drain, states, self.area, 0, self.count, self.progress.ledger)

    def _lay(self) -> tuple[Array, CloudBed]:
        scene, tables = self.scene, self.tables
        own = lifted(
            self.surface,
            self.cloud,
            self.operators.volumes,
            tables.faces,
            tables.gradient,
            scene.gravity,
            scene.least_coefficient,
            scene.scheme.cfl,
        )
        self.tables = all_aligned(tables._replace(faces=own.faces, gradient=own.gradient, widths=own.widths))
        return own.area, own.bed

    def _ways(self) -> Ways:
        strain, ways = along_axes(self.tables.strain, super()._ways(), self.bed)
        self.tables = self.tables._replace(strain=all_aligned(strain))
        return ways

    def _step(self, limits: Limits) -> int:
        return int(advance_cloud_on_surface(self.in_memory, limits, self.progress))

    @property
    def cell_area(self) -> Array:
        """Areas of the cells on the bed, shape (n,), m2."""
        return self.area[: self.count]

    @property
    def steepness(self) -> Array:
        """Vertical over normal depth on the bed, shape (n,), dimensionless."""
        return np.asarray(self.cell_area / self.plan_area)
