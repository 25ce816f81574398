"""Laws of the equations that a run of the conservative form keeps at every step, as numbers with limits.

No solution is needed for them, and none looks into a scheme: a scene and states suffice. Energies are those
of unit density, in m5 s-2; a potential is g times a height, m2 s-2.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from solver.arrays import Array
from solver.checks.heights import ground_of
from solver.checks.incoming import Coming, coming_in
from solver.checks.states import Check, State
from solver.checks.static_cells import RINGS, Neighbours, neighbours_of, surely_held
from solver.kernels.friction import resistance_at_rest
from solver.physics.earth_pressure import Isotropic
from solver.physics.friction import Edwards
from solver.physics.resistance import DryTurbulent
from solver.points.lattice import Lattice
from solver.run import sides_of
from solver.scene import Scene

# Error of the ledger relative to what was released and came in.
LEDGER = 1e-12
# Speeds stay below this multiple of what first speed, waves and falling add up to, in cells deeper than that
# multiple of the wet limit: what drains from a cell that is longer than its cliff falls there for ever.
SPEED, DEEP = 1.5, 10.0
# A step is at least this share of the one that this speed allows.
STEP = 0.25
# In a step energy may grow by this share of itself, times spacings per length of the release, and by this
# share of what the volume gains where it falls by a spacing.
GROWTH, FALL = 0.1, 0.1
# Everything is at rest after so many times the time that friction takes to stop the first speed limit.
PATIENCE = 10.0
ROUND_OFF = 1e-9


def pressed_against_walls(scene: Scene, along: Array) -> NDArray[np.bool_]:
    """Cells beside a wall at x_min or x_max that gravity along the bed, m s-2, presses them against."""
    points, sides = scene.points, scene.boundaries
    found = np.zeros(points.shape, dtype=bool)
    for side, (kind, sign) in enumerate(((sides.x_min, -1.0), (sides.x_max, 1.0))):
        if kind not in ("wall", "no-slip"):
            continue
        beside = np.zeros_like(found)
        if isinstance(points, Lattice):
            beside[:, -side] = True
        else:
            cells = points.control_volumes
            beside[cells.side_cell[cells.side == side]] = True
        found |= beside & (sign * along > 0.0)
    return found


class Laws:
    """The laws of one scene.

    Parameters
    ----------
    scene : Scene
        On a slope profile, or on a surface.
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
        ground, points, sides = ground_of(scene), scene.points, scene.boundaries
        self.scene = scene
        self.neighbours: Neighbours | None = None
        self.area = ground.area
        self.rates = np.broadcast_to(rates, points.shape)
        self.along, self.normal = ground.along, ground.normal
        # what friction holds at any speed and depth
        self.hold = scene.least_coefficient * self.normal
        self.law = scene.friction.resistance(scene.gravity)
        self.plane, self.potential, self.at_sides = ground.plane, ground.potential, ground.at_sides
        given = [
            0.0 if isinstance(s, str) else s for s in (sides.x_min, sides.x_max, sides.y_min, sides.y_max)
        ]
        self.coming = coming_in(scene) if coming is None else coming
        self.given = max(given) if self.coming is None else max(*given, self.coming.depth)
        self.pressure = scene.gravity * max(scene.earth_pressure.coefficients())
        coefficients, transition = scene.earth_pressure.coefficients(), scene.earth_pressure.transition()
        # waves of a pressure that follows the stretching, where the depth falls by a slope of one; a jump has
        # none but at the rate where it jumps
        spread = max(coefficients) - min(coefficients)
        self.following = spread * transition.steepness if transition.rest > 0.0 else 0.0
        self.deepest = max(float(start.h.max()), self.given)
        self.dry = scene.scheme.wet_limit * self.deepest
        wet = start.h > self.dry
        # a given depth comes in as fast as its waves
        self.first = max(
            float(np.hypot(start.u, start.v)[wet].max(initial=0.0)),
            float(np.sqrt(self.pressure * self.given)),
            0.0 if self.coming is None else self.coming.speed,
        )
        inward = sides_of(scene).excess[:2] * [given[0] > 0, -(given[1] > 0)]
        # beside y_min and y_max it is driven along the side
        beside = np.abs(self.along) - self.hold if max(given[2:]) > 0 else np.zeros(1)
        self.driven = float(max(inward.max(), beside.max(), 0.0))
        highest = ground.range if self.given else float(self.potential[wet].max(initial=0.0))
        self.fallen = float(np.sqrt(2 * (highest + ground.beyond(highest) + ground.unseen)))
        # what was released beside drains has left before the first step
        self.released = self.total(start.h) + float((start.ledger[:, 1] - start.ledger[:, 0]).sum())
        self.kinetic = self.kinetic_of(start)
        self.pressed = self.pressure * self.total(start.h**2) / 2
        self.height = self.total(start.h * self.potential)
        spacing = float(np.sqrt(self.area.max()))
        length = float(np.sqrt(self.area[wet].sum())) if wet.any() else spacing
        self.coarseness = spacing / length
        # a fall is resolved to a spacing
        self.unresolved = self.released * float(np.abs(self.along).max()) * spacing
        self.at_wall = pressed_against_walls(scene, self.along)

    def total(self, density: Array | float) -> float:
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

    def held_up(self, before: State, after: State) -> float:
        """Most that gravity gives in a step to what cannot fall, in the cells that it presses against walls.

        A wall takes what a cell has when a stage begins, and not what gravity gives it in that stage. What
        lies there gains a velocity of a dt at most, and loses it to the wall in the next step.
        """
        dt, a = after.time - before.time, np.abs(self.along)
        gained = a * dt * (np.hypot(before.u, before.v) + 0.5 * a * dt)
        return self.total(np.where(self.at_wall, np.maximum(before.h, after.h) * gained, 0.0))

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
        # a layer beyond a side of given depth is driven as long as the run
        first = self.first + self.driven * time
        return float(np.hypot(first + 2 * np.sqrt(self.pressure * self.deepest), self.fallen))

    def of_state(self, state: State) -> list[Check]:
        """Check a state."""
        if not all(np.isfinite(a).all() for a in state[:3]):
            return [Check("values are finite", np.inf, 0.0)]
        self.deepest = max(self.deepest, float(state.h.max()))
        came, left = state.ledger.sum(axis=0)
        came += state.entered
        volume = self.released + came + state.entrained
        error = abs(self.total(state.h) - volume + left) / max(volume, 1e-300)
        of_bed = abs(self.total(state.eroded) - state.entrained) / max(volume, 1e-300)
        wet = state.h > DEEP * self.dry
        speed = float(np.hypot(state.u[wet], state.v[wet]).max(initial=0.0))
        limit = self.speed_limit(state.time)
        through = float((state.ledger[:, 0] - state.ledger[:, 1]) @ self.at_sides)
        if self.coming is not None and state.entered > 0:
            through += state.entered * float(self.potential[self.coming.cells].max())
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
        fastest = self.speed_limit(before.time) + self.following * np.sqrt(self.scene.gravity * self.deepest)
        rate = float(self.rates[before.h > self.dry].max(initial=0.0) * fastest)
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
            slack += self.held_up(before, after)
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
        assert self.neighbours is not None
        # no law holds more where it is deeper
        deepest = self.neighbours.largest(state.h.ravel())
        found: Array = resistance_at_rest(self.law, np.maximum(deepest, 1e-300), self.normal.ravel())
        return found

    def held(self, state: State) -> NDArray[np.bool_]:
        """Cells that friction holds beyond doubt, away from sides of a given depth, of the points' shape."""
        points = self.scene.points
        still = (state.h > 0) & (state.u == 0) & (state.v == 0)
        if not still.any():
            return np.asarray(still)
        if self.neighbours is None:
            self.neighbours = neighbours_of(points)
        normal = float(self.normal.max()) / self.scene.gravity
        pull = self.along.ravel()
        found = surely_held(
            state, self.neighbours, self.pressure * normal, pull, self.held_at_rest(state)
        ).reshape(points.shape)
        if self.given:
            far = (RINGS + 1) * float(np.sqrt(self.area.max()))
            for place, (low, high) in zip(points.coordinates, points.extent, strict=True):
                found &= (place > low + far) & (place < high - far)
        if self.coming is not None:
            near = RINGS + 1
            for cell in zip(*self.coming.cells, strict=True):
                if len(cell) == 1:
                    x, y = points.coordinates
                    far = np.maximum(abs(x - x[cell]), abs(y - y[cell])) > near * np.sqrt(self.area.max())
                    found &= far
                else:
                    found[tuple(slice(max(0, k - near), k + near + 1) for k in cell)] = False
        return np.asarray(found)
