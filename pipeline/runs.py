"""Runs: a scenario's sweep expanded, and each run's settings turned into a scene for the solver."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from pipeline.scenario import Scenario
from pipeline.settings import Settings

if TYPE_CHECKING:
    from pipeline.elevation_table import ElevationTable
    from solver.simulation import Scene
    from solver.terrain import SlopeProfile

Value = float | int | str | bool


@dataclass(frozen=True)
class Run:
    """One run of a scenario; small, and pickles.

    index : position along the store's ``run`` dimension, from 0.
    parameters : swept values by coordinate name, in the order of the sweep; empty without a sweep.
    settings : complete settings of this run, its ``sweep`` empty.
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
    volume_asked, volume_laid, volume_lost : m3; the release as written, as laid on the lattice, and the
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


def expand(scenario: Scenario) -> list[Run]:
    """List the runs of a scenario: the product of its sweep's lists, the last varying fastest."""
    raise NotImplementedError


def output_times(settings: Settings) -> NDArray[np.float64]:
    """Give the output times 0, every, 2 every, ... and always the end, shape (nt,), s."""
    raise NotImplementedError


def build_scene(run: Run) -> Prepared:
    """Lay the release, build terrain and laws, and give the solver's scene of a run."""
    raise NotImplementedError
