"""Runs of the weighted-residual form on a cloud."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from solver.activity import Material, Status
from solver.boundary import Fields, Sides
from solver.cloud_activity import CloudBed, Gradient, Stepped, classify_cloud
from solver.cloud_faces import Faces, connect
from solver.cloud_residual import cloud_buffers, cloud_stage
from solver.compiled import Array
from solver.moving_least_squares import Approximation, approximation
from solver.point_cloud import PointCloud
from solver.time_stepping import SSP_RK3


@dataclass(frozen=True, eq=False)
class CloudOperators:
    """What all runs on a cloud share: its faces, and the LMLS slopes of cell means."""

    cloud: PointCloud
    faces: Faces
    slope: Approximation


def prepare(
    cloud: PointCloud, support: int = 9, degree: int = 1, weight_shape: float = 4.0
) -> CloudOperators:
    """Make the operators of a cloud, once for all runs.

    Parameters
    ----------
    support : int
        Cells that a slope is taken from.
    degree : int
        Degree of the LMLS basis.
    weight_shape : float
        c of eq. 18.

    Raises
    ------
    ValueError
        If a support cannot carry the basis; the message names the points.
    """
    cells = cloud.control_volumes
    # the support of a cell is that of its point, so that the cell itself comes first
    slope = approximation(
        cells.centroid,
        cells.centroid,
        cloud.nearest(support),
        degree,
        weight_shape,
        second_moment=cells.second_moment,
    )
    return CloudOperators(cloud, connect(cells), slope)


class CloudRun:
    """The arrays of one run on a cloud.

    Parameters
    ----------
    operators : CloudOperators
        From `prepare`.
    bed : tuple of three (n,) arrays
        At the centroids: g sin xi, g cos xi, m s-2, and the curvature kappa, m-1.
    material : Material
        Friction and its limits.
    sides : Sides
        Kind and depth of the four sides; no lean, which ghosts of a cloud do not take part in yet.
    state : tuple of three (n,) arrays
        Depth (m) and velocity (m s-1), means over the cells.
    cfl : float
        Courant number of the unsplit step.

    Raises
    ------
    ValueError
        If a side leans.
    """

    def __init__(
        self,
        operators: CloudOperators,
        bed: tuple[Array, Array, Array],
        material: Material,
        sides: Sides,
        state: tuple[Array, Array, Array],
        cfl: float = 0.9,
    ) -> None:
        if sides.lean.any():
            raise ValueError("walls across a slope steeper than friction need a lattice")
        self.area, self.faces = operators.cloud.control_volumes.area, operators.faces
        n, f = len(self.area), len(self.faces.left)
        ghosts = f - self.faces.inner
        self.material, self.sides, self.cfl = material, sides, cfl
        wet = state[0] > material.dry
        h, u, v = (np.pad(np.where(wet | (k == 0), a, 0.0), (0, ghosts)) for k, a in enumerate(state))
        self.now = Fields(h, u, v)
        self.stages = [Fields(h.copy(), u.copy(), v.copy()) for _ in range(2)]
        self.bed = CloudBed(*(np.ascontiguousarray(a, dtype=np.float64) for a in bed))
        slope = operators.slope
        self.gradient = Gradient(slope.neighbours, slope.along, slope.across)
        self.status = Status(*np.ones((3, n + ghosts)))
        self.buffers = cloud_buffers(n, ghosts, f)
        self.ring, self.lists = np.zeros(n + ghosts, np.int64), np.zeros((3, n + f), np.int64)
        self.ledger = np.zeros(2)
        self.time, self.steps, self.cell_stages = 0.0, 0, 0

    @property
    def state(self) -> tuple[Array, Array, Array]:
        """Depth (m) and velocity (m s-1) of the cells, copies of shape (n,)."""
        h, u, v = (a[: len(self.area)].copy() for a in self.now)
        return h, u, v

    @property
    def volume(self) -> float:
        """Volume in the domain, m3."""
        return float(self.state[0] @ self.area)

    def step(self, longest: float) -> float:
        """Take one time step of at most ``longest``, s; return its length, 0 where all is at rest."""
        geometry = self.sides, self.area, self.faces, self.gradient
        rate, *counts = classify_cloud(
            self.now,
            self.status,
            self.bed,
            self.material,
            *geometry,
            self.buffers.slopes,
            self.ring,
            self.lists,
        )
        if not counts[0]:
            return 0.0
        stepped = Stepped(*(row[:count] for row, count in zip(self.lists, counts, strict=True)))
        dt = min(self.cfl / rate, longest) if rate > 0 else longest
        if dt < longest < 2 * dt:
            dt = longest / 2
        for stage in self.stages:
            for target, source in zip(stage, self.now, strict=True):
                target[:] = source
        state = self.now
        for k, part in enumerate(SSP_RK3):
            out = self.stages[k] if k < len(SSP_RK3) - 1 else self.now
            cloud_stage(
                self.now,
                state,
                out,
                self.status,
                self.bed,
                self.material,
                *geometry,
                stepped,
                part,
                float(np.prod(SSP_RK3[k:])),
                dt,
                self.buffers,
                self.ledger,
                k == 0,
            )
            state = out
        self.steps += 1
        self.cell_stages += len(SSP_RK3) * counts[0]
        return float(dt)

    def advance(self, target: float) -> bool:
        """Step to ``target``, s; False where all came to rest before."""
        while self.time < target:
            remaining = target - self.time
            dt = self.step(remaining)
            if dt == 0.0:
                return False
            self.time = target if dt == remaining else self.time + dt
        return True
