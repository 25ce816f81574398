"""The public face of the solver: a scene in, a result out."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field
from typing import Literal

import numpy as np
from numpy.typing import NDArray

from solver.lattice import Lattice
from solver.rheology import Coulomb, EarthPressure, Isotropic, Voellmy
from solver.terrain import Terrain

Array = NDArray[np.float64]
Side = Literal["open", "wall", "no-slip"] | float


@dataclass(frozen=True)
class Boundaries:
    """What stands at each side of the domain: a kind, or a given depth in m."""

    x_min: Side = "open"
    x_max: Side = "open"
    y_min: Side = "open"
    y_max: Side = "open"


@dataclass(frozen=True)
class Scheme:
    """Numerical choices of the weighted-residual form.

    cfl : Courant number of the unsplit step.
    film_depth : depth below which velocity is desingularised, relative to the largest initial depth.
    """

    cfl: float = 0.9
    film_depth: float = 1e-4


@dataclass(frozen=True)
class Scene:
    """One run: where, what, and by which laws.

    depth, velocity_x, velocity_y : initial state, shape (ny, nx), m and m s-1.
    """

    lattice: Lattice
    terrain: Terrain
    depth: Array
    velocity_x: Array
    velocity_y: Array
    friction: Coulomb | Voellmy
    earth_pressure: EarthPressure = field(default_factory=Isotropic)
    gravity: float = 9.81
    boundaries: Boundaries = field(default_factory=Boundaries)
    scheme: Scheme = field(default_factory=Scheme)


@dataclass(frozen=True)
class Failure:
    """Why a run ended early: reason, time (s) and place (x, y in m; NaN where it has none)."""

    reason: str
    time: float
    x: float
    y: float


@dataclass(frozen=True)
class Ledger:
    """Volumes in m3: released, in and out through boundaries, and now in the domain."""

    released: float
    inflow: float
    outflow: float
    now: float

    @property
    def error(self) -> float:
        """(now - released - inflow + outflow) / (released + inflow)."""
        ...


@dataclass(frozen=True)
class Result:
    """What a run gives; arrays are float64, a frame never computed is NaN.

    times : (nt,) the frames asked for. depth, velocity_x, velocity_y : (nt, ny, nx).
    max_depth, max_speed, max_momentum_flux (h |u|^2, m3 s-2), arrival_time (NaN where not reached) :
    (ny, nx), over all time steps. deposit_depth : (ny, nx), the last state computed.
    time : reached, s. rest_time : s, NaN if still moving. steps : time steps taken.
    cell_stages : cells updated, summed over stages. wall_time, cpu_time : s, of the time loop.
    """

    times: Array
    depth: Array
    velocity_x: Array
    velocity_y: Array
    max_depth: Array
    max_speed: Array
    max_momentum_flux: Array
    arrival_time: Array
    deposit_depth: Array
    ledger: Ledger
    time: float
    rest_time: float
    steps: int
    cell_stages: int
    wall_time: float
    cpu_time: float
    failure: Failure | None


def simulate(scene: Scene, times: Sequence[float] | Array, *, arrival_depth: float = 0.0,
             stop_at_rest: bool = True, max_steps: int | None = None) -> Result:
    """Run a scene to the last of ``times`` (increasing, first >= 0), with frames at each of them.

    Once a run is at rest its later frames hold the deposit. A run that fails returns its good frames
    and a Failure; it does not raise. arrival_depth : depth above which a cell counts as reached, m.
    """
    ...
