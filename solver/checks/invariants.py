"""Laws of the equations that a run of the conservative form keeps at every step, as numbers with limits.

No solution is needed for them, and none looks into a scheme: a scene and states suffice. Energies are those
of unit density, in m5 s-2; a potential is g times a height, m2 s-2.
"""

from __future__ import annotations

from functools import lru_cache
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from solver.arrays import Array, Indices
from solver.kernels.friction import resistance_at_rest
from solver.physics.earth_pressure import Isotropic
from solver.physics.friction import Edwards
from solver.physics.resistance import DryTurbulent
from solver.physics.terrain import SlopeProfile
from solver.points.cloud import PointCloud
from solver.points.lattice import Lattice
from solver.run import Run, entrances_of
from solver.scene import Scene

# Error of the ledger relative to what was released and came in.
LEDGER = 1e-12
# Speeds stay below this multiple of what first speed, waves and falling add up to.
SPEED = 1.5
# A step is at least this share of the one that this speed allows.
STEP = 0.25
# In a step energy may grow by this share of itself, times spacings per length of the release, and by this
# share of what the volume gains where it falls by a spacing.
GROWTH, FALL = 0.1, 0.1
# What friction holds beyond doubt: slopes so many times as steep would stay below this share of its limit.
STEEPER, SURELY = 3.0, 0.95
# Rings of neighbours that have to be held too: what a reconstruction and its slopes may see.
RINGS = 3
# Everything is at rest after so many times the time that friction takes to stop the first speed limit.
PATIENCE = 10.0
ROUND_OFF = 1e-9


class State(NamedTuple):
    """A state of a run.

    Parameters
    ----------
    h, u, v : array
        Depth (m) and velocity (m s-1), of the shape of the points.
    time : float
        In s.
    ledger : array
        Volumes that came in and left through each side so far, (4, 2), m3.
    eroded : array or float
        Depth that the bed has lost, of the shape of the points or 0, m.
    entrained : float
        Volume that the flow has taken up, m3.
    entered : float
        Volume of inflows so far, m3.
    """

    h: Array
    u: Array
    v: Array
    time: float
    ledger: Array
    eroded: Array | float = 0.0
    entrained: float = 0.0
    entered: float = 0.0


def state_of_run(run: Run) -> State:
    """Copy the state of a run."""
    return State(*run.state, run.time, run.ledger.copy(), run.eroded, run.entrained, run.come_in)


class Coming(NamedTuple):
    """What comes in through sections at most.

    Parameters
    ----------
    depth, speed : float
        In m and m s-1; critical speed at least.
    rows, columns : array
        Of the cells it comes to, (n,).
    starts : array
        Times at which an inflow begins, s.
    """

    depth: float
    speed: float
    rows: Indices
    columns: Indices
    starts: Array


def coming_in(scene: Scene) -> Coming | None:
    """Find what comes in through sections of a scene; None where nothing does."""
    found = entrances_of(scene)
    if not found:
        return None
    peaks = [float(each.inflow.hydrograph.discharges.max()) for each in found]
    deepest = max(float(each.depths(q).max()) for each, q in zip(found, peaks, strict=True))
    speeds = [each.speeds(q) for each, q in zip(found, peaks, strict=True)]
    units = [each.depths(q) * v for each, q, v in zip(found, peaks, speeds, strict=True)]
    critical = (scene.gravity * max(scene.earth_pressure.coefficients()) * np.concatenate(units)) ** (1 / 3)
    rows, columns = (np.concatenate(each) for each in zip(*(e.placed.downstream for e in found), strict=True))
    graphs = [each.inflow.hydrograph for each in found]
    starts = [graph.times[max(0, int(np.flatnonzero(graph.discharges)[0]) - 1)] for graph in graphs]
    fastest = max(float(np.concatenate(speeds).max()), float(critical.max()))
    return Coming(deepest, fastest, rows, columns, np.array(starts))


class Check(NamedTuple):
    """A law at one moment; it is kept where the value is at most the limit."""

    law: str
    value: float
    limit: float

    @property
    def kept(self) -> bool:
        """Whether the law is kept; what is not a number does not keep it."""
        return bool(self.value <= self.limit)


class Edges(NamedTuple):
    """Pairs of neighbours: their numbers, and their distance, m, each of shape (e,)."""

    left: Indices
    right: Indices
    distance: Array


def edges_of(points: Lattice | PointCloud) -> Edges:
    """List the pairs of neighbours of a lattice, numbered row after row, or of a cloud."""
    if isinstance(points, PointCloud):
        cells = points.control_volumes
        way = cells.centroid[cells.right] - cells.centroid[cells.left]
        return Edges(cells.left, cells.right, np.hypot(*way.T))
    number = np.arange(points.shape[0] * points.shape[1]).reshape(points.shape)
    left = np.concatenate([number[:, :-1].ravel(), number[:-1].ravel()])
    right = np.concatenate([number[:, 1:].ravel(), number[1:].ravel()])
    return Edges(left, right, np.repeat([points.dx, points.dy], [number[:, 1:].size, number[1:].size]))


def surely_held(state: State, edges: Edges, pressure: float, pull: Array, hold: Array) -> NDArray[np.bool_]:
    """Find the wet cells at rest that friction holds beyond doubt, and all around them, shape (n,).

    Parameters
    ----------
    pressure : float
        Largest earth-pressure coefficient times g, m s-2.
    pull, hold : (n,) arrays
        Pull of gravity along the bed and what friction can hold, m s-2.
    """
    h = state.h.ravel()
    slope = np.abs(h[edges.right] - h[edges.left]) / edges.distance
    steepest = np.zeros(h.size)
    np.maximum.at(steepest, edges.left, slope)
    np.maximum.at(steepest, edges.right, slope)
    holds = (state.u.ravel() == 0) & (state.v.ravel() == 0)
    holds &= (STEEPER * pressure * steepest + np.abs(pull) <= SURELY * hold) | (h == 0)
    for _ in range(RINGS):
        loose = ~holds
        holds &= np.bincount(edges.left, loose[edges.right], h.size) == 0
        holds &= np.bincount(edges.right, loose[edges.left], h.size) == 0
    return np.asarray(holds & (h > 0))


@lru_cache(maxsize=8)
def elevations(terrain: SlopeProfile, points: Lattice | PointCloud) -> tuple[Array, Array]:
    """Give the elevations of a bed at 501 places along the domain and at points, of their shape, m.

    The runs of a sweep share them.
    """
    return terrain.elevation(np.linspace(*points.extent[0], 501)), terrain.elevation(points.coordinates[0])


def slope_of(scene: Scene) -> SlopeProfile:
    """Give the slope profile of a scene."""
    if not isinstance(scene.terrain, SlopeProfile):
        raise TypeError("the laws need a slope profile")
    return scene.terrain


def half_lengths(points: Lattice | PointCloud) -> tuple[Array, Array]:
    """Give the places of cells along the slope, and half of their lengths, m."""
    if isinstance(points, PointCloud):
        cells = points.control_volumes
        return cells.centroid[:, 0], np.sqrt(3.0 * cells.second_moment[:, 0])
    x = points.x_points
    return x, np.full(x.shape, points.dx / 2)


def beyond(scene: Scene, lowest: float, level: float) -> float:
    """Height above a level of the cells beside those that lie up to it, as a potential, m2 s-2.

    What comes into the first cell of a rising bed counts with the height of its middle.

    Parameters
    ----------
    scene : Scene
        Of a slope profile.
    lowest, level : float
        Potential that is zero, and the level above it.
    """
    terrain, (x, half) = slope_of(scene), half_lengths(scene.points)
    up_to = scene.gravity * terrain.elevation(x) - lowest <= level
    beside = np.maximum(terrain.elevation(x - 2.0 * half), terrain.elevation(x + 2.0 * half))
    return float(np.max(scene.gravity * beside[up_to] - lowest - level, initial=0.0))


def unseen(scene: Scene) -> float:
    """Largest fall of a cell beyond that of the bed below it, as a potential, m2 s-2.

    A cell knows the inclination at its middle alone: on a cliff that is lower than the cell is long it falls
    by its own length.
    """
    terrain, (x, half) = slope_of(scene), half_lengths(scene.points)
    fall = 2.0 * half * np.abs(np.sin(terrain.inclination(x)))
    bed = np.abs(terrain.elevation(x - half) - terrain.elevation(x + half))
    return scene.gravity * float(np.max(fall - bed, initial=0.0))


class Laws:
    """The laws of one scene.

    Parameters
    ----------
    scene : Scene
        Its terrain is a slope profile.
    start : State
        Where its run begins.
    rates : array or float
        Rate in every cell of waves of a speed of 1 m s-1, by which a form finds its step, m-1.
    coming : Coming, optional
        What comes in through sections, by default those of the scene.
    """

    def __init__(
        self, scene: Scene, start: State, rates: Array | float, coming: Coming | None = None
    ) -> None:
        if not isinstance(scene.terrain, SlopeProfile):
            raise TypeError("the laws need a slope profile")
        points, sides = scene.points, scene.boundaries
        self.scene = scene
        self.edges: Edges | None = None
        self.area = np.broadcast_to(points.cell_area, points.shape)
        self.rates = np.broadcast_to(rates, points.shape)
        x = points.coordinates[0]
        xi = scene.profile.inclination(x)
        self.along, self.normal = scene.gravity * np.sin(xi), scene.gravity * np.cos(xi)
        # what friction holds at any speed and depth
        self.hold = scene.least_coefficient * self.normal
        self.law = scene.friction.resistance(scene.gravity)
        self.plane = not scene.profile.curvature(x).any() and float(np.ptp(xi)) == 0.0
        heights, beds = (scene.gravity * z for z in elevations(scene.terrain, points))
        self.potential = beds - heights.min()
        # what leaves through a side in y leaves from no less than the lowest place
        self.at_sides = np.array([heights[0] - heights.min(), heights[-1] - heights.min(), 0.0, 0.0])
        given = [
            0.0 if isinstance(s, str) else s for s in (sides.x_min, sides.x_max, sides.y_min, sides.y_max)
        ]
        self.coming = coming_in(scene) if coming is None else coming
        self.given = max(given) if self.coming is None else max(*given, self.coming.depth)
        self.pressure = scene.gravity * max(scene.earth_pressure.coefficients())
        self.deepest = max(float(start.h.max()), self.given)
        self.dry = scene.scheme.wet_limit * self.deepest
        wet = start.h > self.dry
        # a given depth comes in as fast as its waves
        self.first = max(
            float(np.hypot(start.u, start.v)[wet].max(initial=0.0)),
            float(np.sqrt(self.pressure * self.given)),
            0.0 if self.coming is None else self.coming.speed,
        )
        highest = float(np.ptp(heights)) if self.given else float(self.potential[wet].max(initial=0.0))
        climbed = beyond(scene, float(heights.min()), highest)
        self.fallen = float(np.sqrt(2 * (highest + climbed + unseen(scene))))
        self.released = self.total(start.h)
        self.kinetic = self.kinetic_of(start)
        self.pressed = self.pressure * self.total(start.h**2) / 2
        self.height = self.total(start.h * self.potential)
        spacing = float(np.sqrt(self.area.max()))
        length = float(np.sqrt(self.area[wet].sum())) if wet.any() else spacing
        self.coarseness = spacing / length
        # a fall is resolved to a spacing
        self.unresolved = self.released * float(np.abs(self.along).max()) * spacing

    def total(self, density: Array) -> float:
        """Integrate over the points."""
        return float((self.area * density).sum())

    def kinetic_of(self, state: State) -> float:
        """Kinetic energy."""
        return self.total(state.h * (state.u**2 + state.v**2)) / 2

    def lift(self, state: State) -> float:
        """Most that lifting the flow by what it has taken up can have added to its energy."""
        return self.pressure * self.deepest * state.entrained

    def unresolved_of(self, state: State) -> float:
        """Work of gravity over a spacing, on all that is in the flow."""
        share = state.entrained / self.released if self.released > 0 else 0.0
        return self.unresolved * (1.0 + share)

    def overtaken(self, state: State) -> float:
        """Depth that is eroded beyond what there is, or less than none, m."""
        bed = self.scene.erodible_bed
        most: Array | float = 0.0 if bed is None else bed.depth
        return float(np.max(np.maximum(state.eroded - most, -np.asarray(state.eroded))))

    @property
    def has_potential(self) -> bool:
        """Whether pressure and gravity have a potential: on a plane, K = 1, and nothing coming in."""
        return self.plane and isinstance(self.scene.earth_pressure, Isotropic) and not self.given

    @property
    def comes_to_rest(self) -> bool:
        """Whether friction is steeper than the slope everywhere, and nothing comes in."""
        return bool((np.abs(self.along) < 0.99 * self.hold).all()) and not self.given

    @property
    def rest_time(self) -> float:
        """Time by which everything is at rest where friction is steeper than the slope, s."""
        least = float((self.hold - np.abs(self.along)).min())
        return PATIENCE * self.speed_limit(0.0) / least if least > 0 else float("inf")

    def speed_limit(self, time: float) -> float:
        """Speed that first speed, waves of the deepest state so far and falling add up to, m s-1."""
        # what comes in may have fallen from far above
        fallen = self.fallen + (time * float(np.abs(self.along).max()) if self.given else 0.0)
        return float(np.hypot(self.first + 2 * np.sqrt(self.pressure * self.deepest), fallen))

    def of_state(self, state: State) -> list[Check]:
        """Check a state."""
        if not all(np.isfinite(a).all() for a in state[:3]):
            return [Check("values are finite", np.inf, 0.0)]
        self.deepest = max(self.deepest, float(state.h.max()))
        came, left = state.ledger.sum(axis=0)
        came += state.entered
        volume = self.released + came + state.entrained
        error = abs(self.total(state.h) - volume + left) / max(volume, 1e-300)
        of_bed = abs(self.total(state.eroded + 0.0 * self.area) - state.entrained) / max(volume, 1e-300)
        speed = float(np.hypot(state.u, state.v)[state.h > self.dry].max(initial=0.0))
        limit = self.speed_limit(state.time)
        through = float((state.ledger[:, 0] - state.ledger[:, 1]) @ self.at_sides)
        if self.coming is not None and state.entered > 0:
            through += state.entered * float(self.potential[self.coming.rows, self.coming.columns].max())
        drop = self.height + through - self.total((state.h - state.eroded) * self.potential)
        inflow = came * (limit**2 / 2 + self.pressure * self.given)
        allowed = self.kinetic + self.pressed + inflow + drop + self.unresolved_of(state) + self.lift(state)
        excess = self.kinetic_of(state) / allowed if allowed > 0 else self.kinetic_of(state)
        return [
            Check("values are finite", 0.0, 0.0),
            Check("depth is not negative", -float(state.h.min()), 0.0),
            Check("ledger of volume", error, LEDGER),
            Check("the bed loses what the flow takes up", of_bed, LEDGER),
            Check("no more is taken up than there is", self.overtaken(state), 0.0),
            Check("kinetic energy has a source", excess, 1.0 + ROUND_OFF),
            Check("speed has a source", speed / limit if limit > 0 else speed, SPEED),
        ]

    def of_step(self, before: State, after: State, cut: bool) -> list[Check]:
        """Check a step; ``cut`` says whether it was cut to meet an output time."""
        checks = []
        dt, cfl = after.time - before.time, self.scene.scheme.cfl
        rate = float(self.rates[before.h > self.dry].max(initial=0.0)) * self.speed_limit(before.time)
        if self.coming is not None:
            # a step ends where an inflow begins
            cut |= bool((np.abs(self.coming.starts - after.time) <= ROUND_OFF * max(after.time, dt)).any())
        # friction with hysteresis has a time of its own
        if rate > 0 and not cut and not isinstance(self.scene.friction, Edwards):
            checks.append(Check("no film sets the step", STEP * cfl / (rate * dt), 1.0))
        if self.has_potential:
            energy, grown = self.energy(before), self.energy(after)
            flow = (before.h - after.h) - (before.eroded - after.eroded)
            # what is taken up lifts what lies above it, as the bed keeps its shape
            height = self.total(flow * self.potential) + self.lift(after) - self.lift(before)
            own = self.kinetic + self.pressed + self.kinetic_of(before)
            slack = GROWTH * self.coarseness * own + FALL * self.unresolved_of(before)
            checks.append(Check("energy grows by gravity's work", (grown - energy - height) / slack, 1.0))
        if self.scene.friction.comes_to_rest:
            held = self.held(before)
            if held.any():
                moved = (after.h != before.h) | (after.u != 0) | (after.v != 0)
                checks.append(Check("what friction holds stays", float((moved & held).sum()), 0.0))
        return checks

    def of_end(self, time: float, at_rest: bool) -> list[Check]:
        """Check that a run that went on to a time, s, has come to rest where it has to."""
        if not self.comes_to_rest or (not at_rest and time < self.rest_time):
            return []
        return [Check("comes to rest", 0.0 if at_rest else 1.0, 0.0)]

    def energy(self, state: State) -> float:
        """Kinetic energy and that of pressure, K = 1."""
        return self.kinetic_of(state) + self.total(state.h**2 * self.normal) / 2

    def held_at_rest(self, state: State) -> Array:
        """Resistance at rest of what is as deep as the deepest beside it, (n,), m s-2."""
        if isinstance(self.law, DryTurbulent) or self.scene.zones:
            return self.hold.ravel()
        assert self.edges is not None
        # no law holds more where it is deeper
        h, deepest = state.h.ravel(), state.h.ravel().copy()
        np.maximum.at(deepest, self.edges.left, h[self.edges.right])
        np.maximum.at(deepest, self.edges.right, h[self.edges.left])
        found: Array = resistance_at_rest(self.law, np.maximum(deepest, 1e-300), self.normal.ravel())
        return found

    def held(self, state: State) -> NDArray[np.bool_]:
        """Cells that friction holds beyond doubt, away from sides of a given depth, of the points' shape."""
        points = self.scene.points
        if self.edges is None:
            self.edges = edges_of(points)
        normal = float(np.cos(self.scene.profile.inclination(points.coordinates[0])).max())
        pull = self.along.ravel()
        found = surely_held(
            state, self.edges, self.pressure * normal, pull, self.held_at_rest(state)
        ).reshape(points.shape)
        if self.given:
            far = (RINGS + 1) * float(np.sqrt(self.area.max()))
            for place, (low, high) in zip(points.coordinates, points.extent, strict=True):
                found &= (place > low + far) & (place < high - far)
        if self.coming is not None:
            near = RINGS + 1
            for row, column in zip(self.coming.rows, self.coming.columns, strict=True):
                rows, columns = (slice(max(0, k - near), k + near + 1) for k in (row, column))
                found[rows, columns] = False
        return np.asarray(found)
