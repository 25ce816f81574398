"""Runs: a scenario's design expanded, and each run's settings turned into a scene for the solver."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, overload

import numpy as np
from numpy.typing import NDArray

from pipeline.runs.shared_points import SharedPoints
from pipeline.scenario import solver_objects
from pipeline.scenario.design import design
from pipeline.scenario.elevation_table import ElevationTable
from pipeline.scenario.scenario import Scenario
from pipeline.scenario.sweep import Value, assign, coordinate_names, path_of
from pipeline.settings.settings import OF_ALL_RUNS, GivenDepth, KindOfSide, Settings
from solver.physics.terrain import SlopeProfile
from solver.release.initial_state import lay

if TYPE_CHECKING:
    from solver.simulation import Scene

DEFAULT_FRAMES = 10
# time between frames where no end is given, as a share of the latest end
EARLY = 0.01
DEFAULT_THRESHOLD = 0.01
_ROUND_OFF = 1e-9


@dataclass(frozen=True)
class Run:
    """One run of a scenario; small, and pickles.

    index : position along the store's ``run`` dimension, from 0.
    parameters : varied values by coordinate name, in the order of the design; empty for a single run.
    settings : complete settings of this run, without what is said of all runs.
    table : the elevation table of a ``table`` terrain, else None.
    """

    index: int
    parameters: dict[str, Value]
    settings: Settings
    table: ElevationTable | None = None


@dataclass(frozen=True)
class Prepared:
    """What ``solver.simulation.simulate`` needs, and what is to be reported of the release.

    scene : the solver's scene; ``terrain`` is ``scene.terrain`` with elevation and horizontal distance.
    times : (nt,) output times, s. threshold : depth above which a cell counts as reached or covered, m.
    stop_at_rest : argument of ``simulate``.
    volume_asked, volume_laid, volume_lost : m3; the release as written, as laid on the points, and the
    part of it that lies outside the domain.
    """

    scene: Scene
    terrain: SlopeProfile
    times: NDArray[np.float64]
    threshold: float
    stop_at_rest: bool
    volume_asked: float
    volume_laid: float
    volume_lost: float


class Runs(Sequence[Run]):
    """The runs of a scenario in the order of its design.

    Each is made when it is asked for: a list of them would grow the process that holds it.
    """

    def __init__(self, scenario: Scenario) -> None:
        self.tables = scenario.tables
        self.design = design(scenario.settings)
        self._data = scenario.settings.model_dump(exclude_unset=True, exclude=OF_ALL_RUNS)
        self._names = tuple(coordinate_names(self.design.keys).values())
        self.paths = [path for key in self.design.keys if (path := path_of(key, self._data)) is not None]

    def __len__(self) -> int:
        return len(self.design)

    @overload
    def __getitem__(self, index: int) -> Run: ...

    @overload
    def __getitem__(self, index: slice) -> Sequence[Run]: ...

    def __getitem__(self, index: int | slice) -> Run | Sequence[Run]:
        if isinstance(index, slice):
            return [self[i] for i in range(len(self))[index]]
        index = range(len(self))[index]
        changed = self._data
        for path, value in zip(self.paths, self.design[index], strict=True):
            changed = assign(changed, path, value)
        settings = Settings.model_validate(changed)
        table = self.tables.get(getattr(settings.terrain, "file", ""))
        return Run(index, self.parameters(index), settings, table)

    def parameters(self, index: int) -> dict[str, Value]:
        """Varied values of a run by coordinate name."""
        return dict(zip(self._names, self.design[index], strict=True))


def expand(scenario: Scenario) -> Runs:
    """List the runs of a scenario."""
    return Runs(scenario)


def output_times(settings: Settings) -> NDArray[np.float64]:
    """Give the output times 0, every, 2 every, ... and always the end, shape (nt,), s.

    Without an end most of them are early, as runs are at rest long before the latest one.
    """
    end = settings.latest_end
    if settings.time.end is None and settings.time.output_every is None:
        return np.array([*(EARLY * end * np.arange(DEFAULT_FRAMES + 1)), end])
    every = settings.time.output_every or end / DEFAULT_FRAMES
    # a multiple that misses the end by round-off is the end
    whole = int(np.ceil(end / every * (1 - _ROUND_OFF)))
    return np.array([*(every * np.arange(whole)), end])


def build_scene(run: Run, shared: SharedPoints) -> Prepared:
    """Lay the release, build terrain and laws, and give the solver's scene of a run on the shared points."""
    # the solver's kernels take longer to import than a scenario to check
    from solver.forms import key
    from solver.simulation import Boundaries, Scene

    settings = run.settings
    points, scheme = shared.points, solver_objects.scheme(settings.scheme)
    laid = lay([solver_objects.shape(release) for release in settings.releases], points)
    terrain = solver_objects.slope(settings.terrain, run.table)
    sides = settings.boundaries
    scene = Scene(
        points=points,
        terrain=terrain,
        depth=laid.depth,
        velocity_x=laid.velocity_x,
        velocity_y=laid.velocity_y,
        friction=solver_objects.friction(settings.material),
        earth_pressure=solver_objects.earth_pressure(settings.material),
        gravity=settings.gravity,
        boundaries=Boundaries(_held(sides.x_min), _held(sides.x_max), _held(sides.y_min), _held(sides.y_max)),
        scheme=scheme,
        operators=shared.operators.get(key(points, scheme)),
    )
    return Prepared(
        scene=scene,
        terrain=terrain,
        times=output_times(settings),
        threshold=settings.output.threshold
        or shared.threshold
        or DEFAULT_THRESHOLD * float(laid.depth.max()),
        stop_at_rest=settings.time.stop_at_rest,
        volume_asked=laid.volume_asked,
        volume_laid=laid.volume,
        volume_lost=laid.volume_lost,
    )


def _held(side: KindOfSide | GivenDepth) -> KindOfSide | float:
    """Give the kind of a side, or the depth that is held there, m."""
    return side.depth if isinstance(side, GivenDepth) else side
