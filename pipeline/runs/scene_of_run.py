"""The scene of a run, and its computation by the solver.

What this module imports decides the values of a run, and is what `pipeline.store.provenance` hashes. Modules
that do not decide them stay out: settings, for instance, are imported for type checking only, as their values
are part of the hash of the scenario.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from pipeline.runs.run import Run
from pipeline.runs.shared_points import SharedPoints
from pipeline.scenario import solver_objects, structures
from solver.inflow.entrance import depth_at_start

if TYPE_CHECKING:
    from pipeline.settings.settings import GivenDepth, KindOfSide, Settings
    from solver.checkpoint import Keeper
    from solver.physics.elevation import ElevationModel
    from solver.physics.terrain import SlopeProfile
    from solver.result import Result
    from solver.scene import Scene

DEFAULT_FRAMES = 10
# time between frames where no end is given, as a share of the latest end
EARLY = 0.01
DEFAULT_THRESHOLD = 0.01
_ROUND_OFF = 1e-9
SAMPLES_PER_FRAME = 10


@dataclass(frozen=True)
class Prepared:
    """What ``solver.simulation.simulate`` needs, and what is to be reported of the release.

    Parameters
    ----------
    scene : Scene
        The solver's scene; ``terrain`` is ``scene.terrain``, a profile with elevation and horizontal
        distance, or an elevation model.
    times : (nt,) array
        Output times, s.
    threshold : float
        Depth above which a cell counts as reached or covered, m.
    stop_at_rest : bool
        Argument of ``simulate``.
    volume_asked, volume_laid, volume_lost : float
        M3; the release as written, as laid on the points, and the part of it that lies outside the
        domain.
    origin : array
        Depth of the release, and of what comes in at its section, where the flow is counted from, m.
    """

    scene: Scene
    terrain: SlopeProfile | ElevationModel
    times: NDArray[np.float64]
    threshold: float
    stop_at_rest: bool
    volume_asked: float
    volume_laid: float
    volume_lost: float
    origin: NDArray[np.float64]


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


def section_times(settings: Settings) -> NDArray[np.float64]:
    """Give the times of samples at sections 0, every, 2 every, ... and the end, shape (n,), s."""
    end, frames = settings.latest_end, output_times(settings)
    every = settings.output.section_every or float(frames[1] - frames[0]) / SAMPLES_PER_FRAME
    whole = int(np.ceil(end / every * (1 - _ROUND_OFF)))
    return np.array([*(every * np.arange(whole)), end])


def build_scene(run: Run, shared: SharedPoints) -> Prepared:
    """Lay the release, build terrain and laws, and give the solver's scene of a run on the shared points."""
    # the solver's kernels take longer to import than a scenario to check
    from solver.forms import key
    from solver.scene import Boundaries, Scene

    settings = run.settings
    points, scheme = shared.points, solver_objects.scheme(settings)
    terrain: SlopeProfile | ElevationModel
    ground = structures.ground(settings, shared.rasters, run.outlines)
    terrain = solver_objects.slope(settings.terrain, run.table) if ground is None else ground
    laid = solver_objects.laid(settings, points, run.outlines, ground)
    friction, earth_pressure = solver_objects.laws(settings)
    sides = settings.boundaries
    scene = Scene(
        points=points,
        terrain=terrain,
        depth=laid.depth,
        velocity_x=laid.velocity_x,
        velocity_y=laid.velocity_y,
        friction=friction,
        earth_pressure=earth_pressure,
        gravity=settings.gravity,
        boundaries=Boundaries(_held(sides.x_min), _held(sides.x_max), _held(sides.y_min), _held(sides.y_max)),
        scheme=scheme,
        operators=shared.operators.get(key(points, scheme)),
        zones=solver_objects.zones(settings, points, run.outlines),
        erodible_bed=solver_objects.erodible_bed(settings, points, terrain, run.outlines, shared.depths),
        buildings=structures.buildings(settings, points, run.outlines),
        inflows=solver_objects.inflows(settings, run.hydrographs, run.outlines),
        sections=solver_objects.sections(settings),
        section_times=section_times(settings) if settings.sections else (),
    )
    origin = laid.depth
    if scene.inflows:
        origin = depth_at_start(
            laid.depth, scene.inflows, points, terrain, friction, settings.gravity, settings.latest_end
        )
    return Prepared(
        scene=scene,
        terrain=terrain,
        times=output_times(settings),
        threshold=settings.output.threshold or shared.threshold or DEFAULT_THRESHOLD * float(origin.max()),
        stop_at_rest=settings.time.stop_at_rest,
        volume_asked=laid.volume_asked,
        volume_laid=laid.volume,
        volume_lost=laid.volume_lost,
        origin=origin,
    )


def _held(side: KindOfSide | GivenDepth) -> KindOfSide | float:
    """Give the kind of a side, or the depth that is held there, m."""
    return side if isinstance(side, str) else side.depth


def compute(
    run: Run,
    shared: SharedPoints,
    *,
    keeper: Keeper | None = None,
    solve: Callable[..., Result] | None = None,
) -> tuple[Prepared, Result]:
    """Compute a run on the shared points.

    Parameters
    ----------
    run : Run
        The run.
    shared : SharedPoints
        Points and operators of the scenario.
    keeper : Keeper, optional
        Keeps checkpoints of the run.
    solve : callable, optional
        The solver, called as ``solver.simulation.simulate``, which is the default.

    Returns
    -------
    Prepared, Result
        What the solver was given, and what it gave.
    """
    from solver.simulation import simulate

    settings, prepared = run.settings, build_scene(run, shared)
    result = (solve or simulate)(
        prepared.scene,
        prepared.times,
        arrival_depth=prepared.threshold,
        stop_at_rest=prepared.stop_at_rest,
        frames=settings.output.fields,
        max_steps=settings.time.max_steps,
        max_wall=settings.time.max_wall,
        keeper=keeper,
    )
    return prepared, result
