"""One run of the collocation form, on a lattice or a cloud: its arrays, and what the kernels do to them."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from solver.arrays import Array
from solver.collocation.arrays import CollocationArrays, Images, Momenta, Open, Relaxation, Scratch
from solver.collocation.operators import CollocationOperators, prepare_collocation
from solver.collocation.time_stepping import advance_collocation
from solver.kernels.earth_pressure import at_rest
from solver.kernels.record import Record, record_cells
from solver.kernels.state import DEPTH, NO_SLIP, OPEN, CloudBed, Fields, Sides
from solver.physics.friction import Coulomb
from solver.points.lattice import Lattice
from solver.points.voronoi import SIDE_NORMALS
from solver.run import Run, by_name, falling_rate, gravity_along_and_normal, state_of
from solver.scene import Collocation, Scene

# Points, the one itself among them, whose mean velocity a film takes: those that touch it on a lattice.
AROUND = 9


def operators_of(scene: Scene, scheme: Collocation) -> CollocationOperators:
    """Give the operators of a scene, made now if it has none.

    Raises
    ------
    ValueError
        If those given are not of the scene's points and scheme, or a support cannot carry the basis.
    """
    given = scene.operators
    wanted = scheme.support, scheme.degree, scheme.weight_shape, scheme.derivative
    if given is None:
        return prepare_collocation(scene.points, *wanted)
    if not isinstance(given, CollocationOperators) or not given.belong_to(scene.points):
        raise ValueError("the operators given are not those of the collocation form on these points")
    found = given.support, given.degree, given.weight_shape, given.derivative
    if found != wanted:
        raise ValueError(f"the operators given have the choices {found}, the scheme {wanted}")
    return given


def images_of(operators: CollocationOperators, sides: Sides) -> Images:
    """Say how images mirror velocities: inward ones turn outward beyond an open side, so that nothing enters.

    Raises
    ------
    ValueError
        If a side has a given depth, or a wall stands across a slope steeper than friction.
    """
    if (sides.kind == DEPTH).any():
        raise ValueError("the collocation form knows no given depth at a side")
    if (sides.excess[sides.kind != OPEN] != 0).any():
        raise ValueError("the collocation form knows no walls across a slope steeper than friction")
    sign, outward = np.ones(operators.beyond.shape), np.zeros(operators.beyond.shape, dtype=np.int64)
    for axis in (0, 1):
        for k, end in enumerate((-1, 1)):
            there, kind = operators.beyond[:, axis] == end, sides.kind[2 * axis + k]
            if kind == OPEN:
                outward[there, axis] = 1
                sign[there, axis] *= end
            else:
                sign[there, axis] *= -1
                if kind == NO_SLIP:
                    sign[there, 1 - axis] *= -1
    owner = np.concatenate([np.arange(operators.count), operators.source])
    return Images(owner, sign, outward)


def open_sides(operators: CollocationOperators, sides: Sides) -> Open:
    """List the pairs of point and image by which what leaves through open sides is measured, side by side.

    On a lattice, where derivatives are odd, all pairs that one of them connects: their sum is then exactly
    what the volume is short of; an image in a corner belongs to the side in x if that is open. On a cloud,
    the points beside the side and their own images, by the length of the side that they own.
    """
    n, stencils = operators.count, operators.stencils
    side = np.full(len(operators.area), -1)
    for axis in (1, 0):
        for k, end in enumerate((-1, 1)):
            if sides.kind[2 * axis + k] == OPEN:
                side[n:][operators.beyond[:, axis] == end] = 2 * axis + k
    if isinstance(operators.points, Lattice):
        point, s = np.nonzero(side[stencils.neighbours] >= 0)
        image = stencils.neighbours[point, s].astype(np.int64)
        weight = operators.area[point, None] * stencils.gradient[0, s]
    else:
        cells = operators.points.control_volumes
        beside = np.flatnonzero(sides.kind[cells.side] == OPEN)
        point, across = cells.side_cell[beside], cells.side[beside]
        own = {
            (int(i), int(side[n + k])): n + k
            for k, i in enumerate(operators.source)
            if np.abs(operators.beyond[k]).sum() == 1
        }
        image = np.array([own[i, k] for i, k in zip(point.tolist(), across.tolist(), strict=True)], np.int64)
        weight = 0.5 * cells.side_length[beside, None] * SIDE_NORMALS[across]
    order = np.argsort(side[image], kind="stable")
    return Open(point[order], image[order], side[image][order], weight[order])


class CollocationRun(Run):
    """The arrays of one run; points are followed by their images."""

    def __init__(self, scene: Scene, end: float, arrival_depth: float) -> None:
        scheme = scene.scheme
        if scene.erodible_bed is not None:
            raise ValueError("the collocation form knows no erodible bed, as it does not conserve volume")
        if not isinstance(scheme, Collocation):
            raise TypeError(f"a collocation run needs its scheme, not a {type(scheme).__name__}")
        if not isinstance(scene.friction, Coulomb):
            raise ValueError("the collocation form knows coulomb and voellmy friction alone")
        if scene.earth_pressure.along_flow:
            raise ValueError("the collocation form knows no earth pressure with the axes of the flow")
        if scene.zones:
            raise ValueError("the collocation form knows no zones of friction")
        self.operators = operators = operators_of(scene, scheme)
        initial = state_of(scene)
        super().__init__(scene, initial[0], end, arrival_depth, indices=1)
        self.images = images_of(operators, self.sides)
        self.open = open_sides(operators, self.sides)
        n, size = operators.count, len(operators.area)
        wet = initial[0] > self.material.dry
        h, u, v = (
            np.pad(np.where(wet | (k == 0), a, 0.0).ravel(), (0, size - n)) for k, a in enumerate(initial)
        )
        self.now = Fields(h, u, v)
        x, y = (a.ravel() for a in scene.points.coordinates)
        along, normal, curvature, falling = (
            np.concatenate([a, a[operators.source]])
            for a in (
                *gravity_along_and_normal(scene, x, y),
                scene.profile.curvature(x, y),
                falling_rate(scene, x, y, operators.stencils.reach[:, 0]),
            )
        )
        # what is beside a dry point may come to it within the step, and falls there
        falling[:n] = falling[operators.stencils.neighbours].max(1)
        self.bed = CloudBed(along, normal, curvature, falling)
        deepest = float(initial[0].max())
        self.relaxation = Relaxation(
            scheme.relaxation,
            scheme.threshold,
            scheme.floor * deepest,
            int(scheme.smoothing == "pairs"),
            int(scheme.smoothed == "all"),
            int(scheme.clip),
        )
        self.film = scheme.film * deepest
        self.scratch = Scratch(
            Fields(*np.zeros((3, size))),
            Momenta(h.copy(), h * u, h * v),
            Momenta(*np.zeros((3, size))),
            np.zeros((n, 5)),
            self.bed.normal[:n, None] * np.array(at_rest(self.material)),
            *np.zeros((3, n), np.int64),
        )
        self.record = Record(np.zeros(n), np.zeros(n), np.zeros(n), np.full(n, np.nan))
        self.rest_volume = scheme.rest_share * self.volume
        record_cells(self.now, 0, n, self.material.dry, arrival_depth, self.record, self.progress)

    @property
    def arrays(self) -> CollocationArrays:
        """What the kernels read and write."""
        operators = self.operators
        return CollocationArrays(
            now=self.now,
            coordinates=operators.coordinates,
            area=operators.area,
            stencils=operators.stencils,
            images=self.images,
            open=self.open,
            bed=self.bed,
            material=self.material,
            relaxation=self.relaxation,
            film=self.film,
            around=min(AROUND, operators.stencils.neighbours.shape[1]),
            scratch=self.scratch,
            record=self.record,
        )

    def _advance(self, target: float, max_steps: int) -> int:
        return int(advance_collocation(self.arrays, self.limits(target, max_steps), self.progress))

    def warm_up(self, piece: int) -> None:
        """Do nothing: no kernel takes long."""

    @property
    def carried(self) -> dict[str, NDArray[Any]]:
        """The same, and the scratch arrays."""
        return super().carried | by_name(scratch=self.scratch)

    @property
    def state(self) -> tuple[Array, Array, Array]:
        """Depth (m) and velocity (m s-1) of the points, copies of their shape."""
        n, shape = self.operators.count, self.scene.points.shape
        h, u, v = (a[:n].reshape(shape).copy() for a in self.now)
        return h, u, v

    @property
    def volume(self) -> float:
        """Volume in the domain, m3: the sum of depth times area, negative depths included."""
        n = self.operators.count
        return float(self.now.h[:n] @ self.operators.area[:n])

    @property
    def maxima(self) -> Record:
        """Maxima over the steps, copies of the shape of the points."""
        depth, speed_squared, momentum_flux, arrival = (
            values.reshape(self.scene.points.shape).copy() for values in self.record
        )
        return Record(depth, speed_squared, momentum_flux, arrival)

    @property
    def place(self) -> tuple[float, float]:
        """Where a value was not finite, x and y in m; NaN if none was."""
        i = self.progress.place[0]
        x, y = self.operators.coordinates[i]
        return (float(x), float(y)) if i >= 0 else (np.nan, np.nan)
