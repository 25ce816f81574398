"""One run of the weighted-residual form on a cloud: its arrays, and what the kernels do to them."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from solver.activity import Status
from solver.boundary import Fields
from solver.cloud_activity import CloudBed, Gradient
from solver.cloud_operators import CloudOperators, prepare
from solver.cloud_residual import cloud_buffers
from solver.cloud_stepping import advance_cloud, record_cells
from solver.compiled import Array
from solver.point_cloud import PointCloud
from solver.run_setup import (
    Carried,
    by_name,
    gravity_along_and_normal,
    material_of,
    put_back,
    sides_of,
    state_of,
)
from solver.scene import Scene
from solver.time_stepping import SSP_RK3, Progress, Record


def operators_of(scene: Scene) -> CloudOperators:
    """Give the operators of a scene on a cloud, made now if it has none.

    Raises
    ------
    ValueError
        If those given are not of the scene's cloud and scheme, or a support cannot carry the basis.
    """
    cloud, scheme, given = scene.points, scene.scheme, scene.operators
    if not isinstance(cloud, PointCloud):
        raise TypeError(f"a cloud run needs a cloud, not a {type(cloud).__name__}")
    wanted = scheme.support, scheme.degree, scheme.weight_shape
    if given is None:
        return prepare(cloud, *wanted)
    if not isinstance(given, CloudOperators) or not given.belong_to(cloud):
        raise ValueError("the operators given are those of another cloud")
    found = given.support, given.degree, given.weight_shape
    if found != wanted:
        raise ValueError(
            f"the operators given have support, degree and weight shape {found}, the scheme {wanted}"
        )
    return given


class CloudRun:
    """The arrays of one run on a cloud; cells are followed by a ghost for every boundary face."""

    def __init__(self, scene: Scene, end: float, arrival_depth: float) -> None:
        operators = operators_of(scene)
        cells = operators.cloud.control_volumes
        self.scene, self.end, self.arrival_depth = scene, end, arrival_depth
        self.centroid, self.area, self.faces = cells.centroid, cells.area, operators.faces
        n, f = len(self.area), len(self.faces.left)
        ghosts = f - self.faces.inner
        initial = state_of(scene)
        self.sides = sides_of(scene)
        self.material = material_of(scene, initial[0], self.sides)
        wet = initial[0] > self.material.dry
        h, u, v = (np.pad(np.where(wet | (k == 0), a, 0.0), (0, ghosts)) for k, a in enumerate(initial))
        self.now = Fields(h, u, v)
        self.stages = [Fields(h.copy(), u.copy(), v.copy()) for _ in range(2)]
        x, y = np.ascontiguousarray(self.centroid.T)
        self.bed = CloudBed(*gravity_along_and_normal(scene, x, y), scene.terrain.curvature(x, y))
        slope = operators.slope
        self.gradient = Gradient(slope.neighbours, slope.along, slope.across)
        load = np.concatenate([self.bed.normal, self.bed.normal[self.faces.left[self.faces.inner :]]])
        x_active, _, y_active, *_ = self.material.pressure
        self.status = Status(load * x_active, load * y_active, np.ones(n + ghosts))
        self.buffers = cloud_buffers(n, ghosts, f)
        self.ring, self.lists = np.zeros(n + ghosts, np.int64), np.zeros((3, n + f), np.int64)
        self.record = Record(np.zeros(n), np.zeros(n), np.zeros(n), np.full(n, np.nan))
        self.progress = Progress(
            np.zeros(1), np.zeros(1, np.int64), np.zeros(1, np.int64), np.zeros((4, 2)), np.full(1, -1)
        )
        self.rest_volume = scene.scheme.rest_share * self.volume
        record_cells(self.now, n, self.material.dry, arrival_depth, self.record, self.progress)

    def advance(self, target: float, max_steps: int | None) -> int:
        """Step to ``target``, s; say why it stopped."""
        return int(
            advance_cloud(
                self.now,
                *self.stages,
                self.status,
                self.bed,
                self.material,
                self.sides,
                self.area,
                self.faces,
                self.gradient,
                self.buffers,
                self.ring,
                self.lists,
                SSP_RK3,
                self.scene.scheme.cfl,
                target,
                self.end,
                np.iinfo(np.int64).max if max_steps is None else max_steps,
                self.rest_volume,
                self.arrival_depth,
                self.record,
                self.progress,
            )
        )

    def settle(self) -> None:
        """Stop what little still moves."""
        self.now.u[:] = self.now.v[:] = 0.0

    @property
    def carried(self) -> dict[str, NDArray[Any]]:
        """The arrays themselves, by name, that a step takes over from the one before."""
        return by_name(now=self.now, status=self.status, record=self.record, progress=self.progress)

    def restore(self, carried: Carried) -> None:
        """Set a run made from the same scene to where these arrays were taken."""
        put_back(self.carried, carried)

    @property
    def time(self) -> float:
        """Time reached, s."""
        return float(self.progress.time[0])

    @property
    def state(self) -> tuple[Array, Array, Array]:
        """Depth (m) and velocity (m s-1) of the cells, copies of shape (n,)."""
        h, u, v = (a[: len(self.area)].copy() for a in self.now)
        return h, u, v

    @property
    def volume(self) -> float:
        """Volume in the domain, m3."""
        return float(self.state[0] @ self.area)

    @property
    def ledger(self) -> Array:
        """Volumes that came in and left through each side, shape (4, 2), m3."""
        return self.progress.ledger

    @property
    def maxima(self) -> Record:
        """Maxima over the steps, arrays of shape (n,)."""
        return self.record

    @property
    def place(self) -> tuple[float, float]:
        """Where a value was not finite, x and y in m; NaN if none was."""
        i = self.progress.place[0]
        return (float(self.centroid[i, 0]), float(self.centroid[i, 1])) if i >= 0 else (np.nan, np.nan)
