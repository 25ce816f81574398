"""What every run is made of, whatever its points and its form: state, sides and material, checked."""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Mapping
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from solver.arrays import Array
from solver.compiled import compile_for
from solver.inflow.clouds import PlacedOnCloud
from solver.inflow.entrance import Entrance, entrance, placed_on
from solver.inflow.placement import Placed
from solver.kernels.erosion import Erosion, no_erosion
from solver.kernels.record import Record
from solver.kernels.runge_kutta import AT_REST, OUT_OF_STEPS, Limits, Progress
from solver.kernels.sections.inflow import Inflows, await_inflow, begin_inflow, no_inflows
from solver.kernels.sections.measured import Sections, no_sections, sample
from solver.kernels.state import DEPTH, NO_SLIP, OPEN, WALL, Fields, Material, Sides
from solver.physics.earth_pressure import MohrCoulomb
from solver.physics.elevation import Surface
from solver.physics.friction import Coulomb
from solver.physics.resistance import Zoned, area_weighted, shares_of_zones
from solver.points.lattice import Lattice
from solver.referenced import Referenced
from solver.scene import Collocation, Scene

Carried = Mapping[str, NDArray[Any]]
# A step is collapsed that is this much shorter than the run, or than ten times a free fall along the domain:
# a run may be given any end, and stop at rest.
SHORTEST_STEP, FALLS = 1e-7, 10
# What so many steps do not change, relative to what there is, does not move.
LULL_STEPS, LULL = 1000, 1e-12
# What the compiler takes about equally long for: all that goes on beside the stages of a step, and a stage.
PIECES = 2
# what sections carry on from step to step
_MEASURED = ("volume", "series", "last", "taken")
KINDS = {"open": OPEN, "wall": WALL, "no-slip": NO_SLIP}


class Lull(NamedTuple):
    """What a run was like when it was last looked at.

    Parameters
    ----------
    steps : (1,) array
        Its time steps.
    moments : (3,) array
        Integrals over the domain of ``h^2`` and of h times the distance from the first corner along x and
        y, m4.
    ledger : (4, 2) array
        Of `Run.ledger`, m3.
    """

    steps: NDArray[np.int64]
    moments: Array
    ledger: Array


class Run(ABC):
    """One run, on whatever points and in whatever form, as `solver.simulation` steps it.

    Parameters
    ----------
    scene : Scene
        What to run.
    depth : array
        Initial depth, as `state_of` gives it, m.
    end : float
        Time that the run may go on to, s.
    arrival_depth : float
        Depth above which a cell counts as reached, m.
    indices : int
        Numbers that say which cell it is.
    """

    now: Fields
    record: Record
    erosion: Erosion
    rest_volume: float
    inflows: Inflows
    sections: Sections

    def __init__(self, scene: Scene, depth: Array, end: float, arrival_depth: float, indices: int) -> None:
        self.scene, self.end, self.arrival_depth = scene, end, arrival_depth
        fall = np.sqrt(max(np.ptp(side) for side in scene.points.extent) / scene.gravity)
        self.shortest_step = SHORTEST_STEP * min(end, FALLS * float(fall))
        self.sides = sides_of(scene)
        self.entrances, self.gauges = entrances_of(scene), gauges_of(scene)
        self.inflows, self.sections = no_inflows(), no_sections()
        deepest = max((each.largest_depth(end) for each in self.entrances), default=0.0)
        self.deepest = max(float(depth.max()), float(self.sides.depth.max()), deepest)
        self.material = material_of(scene, self.deepest)
        self.progress = Progress(
            np.zeros(1),
            np.zeros(1, np.int64),
            np.zeros(1, np.int64),
            np.zeros((2, 4, 2)),
            np.full(indices, -1, np.int64),
        )
        self.erosion = no_erosion()
        self._in_memory: Referenced | None = None
        self.lull = Lull(np.zeros(1, np.int64), np.full(3, np.nan), np.zeros((4, 2)))

    def advance(self, target: float, max_steps: int | None) -> int:
        """Step to ``target``, s; say why it stopped, by the constants of `solver.lattice.time_stepping`.

        A run that has taken ``max_steps`` stops before it touches anything, and can be advanced further as
        if it had not stopped.
        """
        most, steps = np.iinfo(np.int64).max if max_steps is None else max_steps, self.progress.steps
        while True:
            # what velocities there are may be balanced at walls and move nothing, for ever
            look = steps[0] % LULL_STEPS == 0 and steps[0] > self.lull.steps[0]
            if look and self.time >= self.inflows.until[0] and self._lulled():
                return AT_REST
            outcome = self._advance(target, min(most, (int(steps[0]) // LULL_STEPS + 1) * LULL_STEPS))
            if outcome != OUT_OF_STEPS or steps[0] >= most:
                return outcome

    def _lulled(self) -> bool:
        """Whether nothing has changed since the run was last looked at; otherwise remember how it is."""
        points = self.scene.points
        h = self.state[0]
        volumes = self.cell_area * h
        (x, y), ((x_min, _), (y_min, _)) = points.coordinates, points.extent
        moments = np.array([float((volumes * q).sum()) for q in (h, x - x_min, y - y_min)])
        small = LULL * (self.volume + self.ledger.sum())
        same = bool((np.abs(moments - self.lull.moments) <= LULL * moments).all())
        same &= bool((np.abs(self.ledger - self.lull.ledger) <= small).all())
        if not same:
            self.lull.steps[0] = self.progress.steps[0]
            self.lull.moments[:], self.lull.ledger[:] = moments, self.ledger
        return same

    @property
    def cell_area(self) -> Array | float:
        """Areas of the cells, of the shape of the points or one number, m2."""
        return self.scene.points.cell_area

    def limits(self, target: float, max_steps: int) -> Limits:
        """Give the kernels until when to go on."""
        cfl = self.scene.scheme.cfl
        return Limits(target, max_steps, self.shortest_step, cfl, self.rest_volume, self.arrival_depth)

    @property
    @abstractmethod
    def arrays(self) -> Any:
        """What the kernels read and write, a named tuple."""

    @property
    def in_memory(self) -> Referenced:
        """The same, where kernels find it; what is as it was is not looked up again."""
        self._in_memory = Referenced(self.arrays, self._in_memory)
        return self._in_memory

    @abstractmethod
    def _advance(self, target: float, max_steps: int) -> int: ...

    @abstractmethod
    def warm_up(self, piece: int) -> None:
        """Compile one of the `PIECES` of what a step calls, and do nothing else."""

    def warm_up_sections(self) -> None:
        """Compile what a step calls for inflows and sections, but for its stages."""
        compile_for(await_inflow, self.inflows, 0.0, self.limits(0.0, 0), 0.0)
        compile_for(begin_inflow, self.inflows, 0.0, 0.0)
        compile_for(sample, self.sections, 0.0)

    def settle(self) -> None:
        """Stop what little still moves in a run at rest."""
        self.now.u[:] = self.now.v[:] = 0.0

    @property
    def time(self) -> float:
        """Time reached, s."""
        return float(self.progress.time[0])

    @property
    def ledger(self) -> Array:
        """Volumes that came in and left through each side of the domain, shape (4, 2), m3."""
        return np.asarray(self.progress.ledger.sum(axis=0))

    @property
    def come_in(self) -> float:
        """Volume that has come in through sections, m3."""
        return float(self.inflows.entered.sum())

    @property
    def carried(self) -> dict[str, NDArray[Any]]:
        """The arrays themselves, by name, that a step takes over from the one before."""
        own = by_name(now=self.now, record=self.record, progress=self.progress, lull=self.lull)
        if self.scene.erodible_bed is not None:
            own |= {"erosion.eroded": self.erosion.eroded, "erosion.entrained": self.erosion.entrained}
        if self.entrances:
            own["inflows.entered"] = self.inflows.entered
        if self.gauges:
            own |= {f"sections.{name}": getattr(self.sections, name) for name in _MEASURED}
        return own

    def restore(self, carried: Carried) -> None:
        """Set a run made from the same scene to where these arrays were taken.

        Raises
        ------
        ValueError
            If they are of another kind of run, or of other points.
        """
        put_back(self.carried, carried)

    @property
    @abstractmethod
    def state(self) -> tuple[Array, Array, Array]:
        """Depth (m) and velocity (m s-1), copies of the shape of the points."""

    @property
    @abstractmethod
    def volume(self) -> float:
        """Volume in the domain, m3."""

    @property
    def eroded(self) -> Array:
        """Depth that has been eroded normal to the bed, of the shape of the points, m."""
        return np.zeros(self.scene.points.shape)

    @property
    def entrained(self) -> float:
        """Volume that the flow has taken up from the bed, m3."""
        return float(self.erosion.entrained.sum())

    @property
    def steepness(self) -> Array:
        """Vertical over normal depth on the bed, of the shape of the points, dimensionless."""
        return np.asarray(1.0 / np.cos(self.scene.profile.inclination(*self.scene.points.coordinates)))

    @property
    @abstractmethod
    def maxima(self) -> Record:
        """Maxima over the steps, of the shape of the points."""

    @property
    @abstractmethod
    def place(self) -> tuple[float, float]:
        """Where a value was not finite, x and y in m; NaN if none was."""


def by_name(**groups: Any) -> dict[str, NDArray[Any]]:
    """Give the arrays of named tuples, and of named tuples within them, by ``group.field``."""
    found: dict[str, NDArray[Any]] = {}
    for name, group in groups.items():
        for key, value in group._asdict().items():
            if value is None:
                continue
            found |= (
                by_name(**{f"{name}.{key}": value}) if isinstance(value, tuple) else {f"{name}.{key}": value}
            )
    return found


def put_back(own: Carried, carried: Carried) -> None:
    """Copy carried arrays into a run's own.

    Raises
    ------
    ValueError
        If they are of another kind of run, or of other points.
    """
    if own.keys() != carried.keys() or any(own[name].shape != carried[name].shape for name in own):
        raise ValueError("the snapshot is of another kind of run or of other points")
    for name, array in own.items():
        array[...] = carried[name]


def state_of(scene: Scene) -> tuple[Array, Array, Array]:
    """Give initial depth (m) and velocity (m s-1), double precision arrays of the shape of the points.

    Raises
    ------
    ValueError
        If an array has another shape, a value is not finite or a depth negative.
    """
    h, u, v = (np.asarray(a, dtype=np.float64) for a in (scene.depth, scene.velocity_x, scene.velocity_y))
    for array in (h, u, v):
        if array.shape != scene.points.shape:
            raise ValueError(
                f"initial arrays must have the points' shape {scene.points.shape}, not {array.shape}"
            )
        if not np.isfinite(array).all():
            raise ValueError("initial arrays must be finite")
    if (h < 0).any():
        raise ValueError("initial depth must not be negative")
    return h, u, v


def erodible_depth(scene: Scene) -> Array:
    """Give the depth that may be eroded, of the shape of the points, m; an empty array without such a bed.

    Raises
    ------
    ValueError
        If it has another shape.
    """
    if scene.erodible_bed is None:
        return np.zeros(0)
    depth = np.asarray(scene.erodible_bed.depth, dtype=np.float64)
    if depth.shape != scene.points.shape:
        raise ValueError(f"the erodible depth must have the points' shape {scene.points.shape}")
    return depth


def check_buildings(scene: Scene) -> None:
    """Refuse buildings where a run cannot have them.

    Raises
    ------
    ValueError
        If they are not one value a cell, material lies in one, or one stands at a side of given depth.
    """
    buildings = scene.buildings
    if buildings is None:
        return
    if buildings.shape != scene.points.shape or buildings.dtype != np.bool_:
        raise ValueError(f"buildings must be true or false, of the points' shape {scene.points.shape}")
    if np.asarray(scene.depth)[buildings].any():
        raise ValueError("no material can lie in a building")
    bounds, points = scene.boundaries, scene.points
    if isinstance(points, Lattice):
        ends = [buildings[:, 0], buildings[:, -1], buildings[0], buildings[-1]]
    else:
        cells = points.control_volumes
        ends = [buildings[cells.side_cell[cells.side == side]] for side in range(4)]
    sides = bounds.x_min, bounds.x_max, bounds.y_min, bounds.y_max
    if any(not isinstance(side, str) and cells.any() for side, cells in zip(sides, ends, strict=True)):
        raise ValueError("no building can stand at a side of given depth")


def sides_of(scene: Scene) -> Sides:
    """Give the sides of a scene to the kernels.

    Raises
    ------
    ValueError
        If a side is neither a kind nor a depth.
    """
    bounds = scene.boundaries
    given = (bounds.x_min, bounds.x_max, bounds.y_min, bounds.y_max)
    if isinstance(scene.terrain, Surface):
        if given != ("open",) * 4:
            raise ValueError("on a surface all sides are open")
        return Sides(np.full(4, OPEN), *np.zeros((6, 4)))
    for side in given:
        if side not in KINDS and (isinstance(side, str) or not 0 <= side < np.inf):
            raise ValueError(f"a side must be one of {', '.join(KINDS)} or a depth, not {side!r}")
    along, normal = gravity_along_and_normal(scene, np.array(scene.points.x), np.full(2, scene.points.y[0]))
    lean = np.sign(along) * np.maximum(0.0, np.abs(along) - scene.least_coefficient * normal)
    x = scene.points.x_points if isinstance(scene.points, Lattice) else scene.points.coordinates[0]
    along, normal = gravity_along_and_normal(scene, x, np.full(x.shape, scene.points.y[0]))
    held = scene.least_coefficient * normal
    driving = (max(0.0, float((way * along - held).max())) for way in (1.0, -1.0))
    h, *velocity = state_of(scene)
    u, v = (np.where(h > 0, q, 0.0) for q in velocity)
    first = np.array([float(np.max(each, initial=0.0)) for each in (u, -u, v, -v)])
    return Sides(
        np.array([KINDS[s] if isinstance(s, str) else DEPTH for s in given]),
        np.array([0.0 if isinstance(s, str) else float(s) for s in given]),
        np.array([*lean, 0.0, 0.0]),
        first,
        first.copy(),
        np.array([*driving, 0.0, 0.0]),
        first.copy(),
    )


def gravity_along_and_normal(scene: Scene, x: Array, y: Array) -> tuple[Array, Array]:
    """Give g sin xi and g cos xi, m s-2, at places x, y of one shape, m.

    Raises
    ------
    ValueError
        If the bed has a lateral slope.
    """
    if np.any(scene.profile.lateral_slope(x, y)):
        raise ValueError("the solver needs a bed without lateral slope")
    xi = scene.profile.inclination(x, y)
    return scene.gravity * np.sin(xi), scene.gravity * np.cos(xi)


def falling_rate(scene: Scene, x: Array, y: Array, widths: Array | float) -> Array:
    """Rate, s-1, whose step lets gravity alone, friction taken off, move nothing farther than waves may go.

    The wave rate of a film at rest is next to nothing, and its first step would be as long as the slope.

    Parameters
    ----------
    x, y : array
        Places, m.
    widths : array or float
        Rate along x of a speed of 1 m s-1 in the cells there, m-1.
    """
    along, normal = gravity_along_and_normal(scene, x, y)
    free = np.maximum(0.0, np.abs(along) - scene.least_coefficient * normal)
    return np.asarray(np.sqrt(scene.scheme.cfl * free * widths))


def zoned_law(scene: Scene) -> Zoned | None:
    """Give friction with its parameters at each cell, (fields, *shape of the points); None without zones.

    Raises
    ------
    ValueError
        If zones overlap, are of another law, or have shares of another shape.
    """
    if not scene.zones:
        return None
    laws = [(zone.friction, zone.share) for zone in scene.zones]
    shares = shares_of_zones(laws, scene.friction, scene.points.shape, "friction")
    parts = [(law.resistance(scene.gravity), share) for (law, _), share in zip(laws, shares, strict=True)]
    return area_weighted(scene.friction.resistance(scene.gravity), parts)


def entrances_of(scene: Scene) -> tuple[Entrance, ...]:
    """Place the inflows of a scene.

    Raises
    ------
    ValueError
        If one cannot be placed or a building stands there, or the scene is of the collocation form.
    """
    if not scene.inflows:
        return ()
    _check_form(scene)
    about = scene.points, scene.terrain, scene.friction, scene.gravity
    found = tuple(entrance(each, *about) for each in scene.inflows)
    if scene.buildings is not None and any(each.placed.meets(scene.buildings) for each in found):
        raise ValueError("no building can stand at the section of an inflow")
    return found


def gauges_of(scene: Scene) -> tuple[Placed | PlacedOnCloud, ...]:
    """Place the sections of a scene that discharge is measured at.

    Raises
    ------
    ValueError
        If one lies outside the domain, or the scene is of the collocation form.
    """
    if not scene.sections:
        return ()
    _check_form(scene)
    return tuple(placed_on(each.line, scene.points, scene.terrain, scene.gravity) for each in scene.sections)


def _check_form(scene: Scene) -> None:
    if isinstance(scene.scheme, Collocation):
        raise ValueError("inflow and sections take the weighted-residual form")


def material_of(scene: Scene, deepest: float) -> Material:
    """Give friction, earth pressure and wet limit to the kernels.

    Parameters
    ----------
    deepest : float
        Largest depth at the start, at a side, or that comes in, m.

    Raises
    ------
    ValueError
        If the law of friction has no density and needs one, or does not go with the earth pressure.
    """
    if isinstance(scene.earth_pressure, MohrCoulomb) and not isinstance(scene.friction, Coulomb):
        raise ValueError("mohr-coulomb earth pressure goes with coulomb and voellmy friction alone")
    if isinstance(scene.earth_pressure, MohrCoulomb) and scene.zones:
        raise ValueError("mohr-coulomb earth pressure takes one friction angle, and no zones")
    dry = scene.scheme.wet_limit * deepest
    pressure = scene.earth_pressure
    return Material(
        scene.friction.resistance(scene.gravity),
        pressure.coefficients(),
        pressure.transition(),
        float(dry),
    )
