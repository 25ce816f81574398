"""What a run gives: its frames, maxima, deposit, volume ledger and failure."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from solver.arrays import Array
from solver.kernels import runge_kutta

OUT_OF_TIME = "more time than allowed"
REASONS = {
    runge_kutta.OUT_OF_STEPS: "more steps than allowed",
    runge_kutta.OUT_OF_TIME: OUT_OF_TIME,
    runge_kutta.NOT_FINITE: "a value that is not finite",
    runge_kutta.COLLAPSED: "the time step collapsed",
}


@dataclass(frozen=True)
class Failure:
    """Why a run ended early, when and where.

    Parameters
    ----------
    reason : str
        In words.
    time : float
        In s.
    x, y : float
        Place of the value that is not finite, otherwise of the fastest waves for the size of the cell, which
        set the time step, m; NaN where nothing flows.
    """

    reason: str
    time: float
    x: float
    y: float


@dataclass(frozen=True)
class Ledger:
    """Ledger of volume, m3.

    Parameters
    ----------
    released : float
        In the domain at the start.
    inflow : float
        Came in through sides and with inflows.
    outflow : float
        Left through all sides.
    now : float
        In the domain.
    outflow_open : float
        Left through open sides.
    entrained, eroded : float
        Taken up by the flow, and lost by the bed: one volume, counted on either side.
    """

    released: float
    inflow: float
    outflow: float
    now: float
    outflow_open: float = 0.0
    entrained: float = 0.0
    eroded: float = 0.0

    @property
    def total(self) -> float:
        """All that has been in the flow: released, come in and entrained, m3."""
        return self.released + self.inflow + self.entrained

    @property
    def error(self) -> float:
        """(now - total + outflow) / total, dimensionless."""
        return (self.now - self.total + self.outflow) / self.total if self.total > 0 else 0.0

    @property
    def bed_error(self) -> float:
        """(eroded - entrained) / total, dimensionless."""
        return (self.eroded - self.entrained) / self.total if self.total > 0 else 0.0


@dataclass(frozen=True)
class SectionResult:
    """What passed the sections of a run, in the order of its scene.

    Parameters
    ----------
    times : (nt,) array
        Of the samples, s.
    volume : (n, nt) array
        Net volume that has passed by then, m3, NaN after a failure.
    arrival : (n,) array
        When one of the cells below a section was first deeper than the arrival depth, s, NaN where not.
    """

    times: Array
    volume: Array
    arrival: Array

    @property
    def discharge(self) -> Array:
        """Mean discharge since the sample before, shape (n, nt), m3 s-1; 0 at the first."""
        steps = np.diff(self.times, prepend=self.times[:1] - 1.0)
        return np.diff(self.volume, axis=1, prepend=self.volume[:, :1]) / steps

    @property
    def peak(self) -> tuple[Array, Array]:
        """Largest mean discharge between two samples, m3 s-1, and the end of that time, s, both (n,)."""
        found = np.nan_to_num(self.discharge, nan=-np.inf)
        at = found.argmax(axis=1)
        return found[np.arange(len(at)), at], self.times[at]


@dataclass(frozen=True)
class Result:
    """What a run gives; arrays are float64, a frame never computed is NaN.

    Parameters
    ----------
    times : (nt,) array
        Times of the frames asked for, s.
    depth, velocity_x, velocity_y : (nt, ny, nx) or (nt, n) array
        Frames, m and m s-1, on a lattice or a cloud.
    max_depth, max_speed, max_momentum_flux : (ny, nx) or (n,) array
        Largest depth (m), speed (m s-1) and h |u|^2 (m3 s-2) over all time steps.
    arrival_time : (ny, nx) or (n,) array
        When the flow was first deeper than the arrival depth, s; NaN where it never was.
    deposit_depth : (ny, nx) or (n,) array
        Depth of the last good state, m.
    ledger : Ledger
        Of volume.
    time, rest_time : float
        Of the last good state, and of coming to rest, s; NaN if still moving.
    steps, cell_stages : int
        Time steps taken to there, and cells updated, summed over stages.
    wall_time, cpu_time : float
        Of the time loop, s.
    failure : Failure, optional
        Why the run ended early.
    moving_volume : float
        Volume, m3, that is faster than a Froude number of `solver.simulation.MOVING` by the largest depth at
        the start, held at a side or given by an inflow, in the last good state.
    entrained : (nt,) array, optional
        Volume that the flow has taken up from the bed by the frames, m3. None without an erodible bed, as
        the next two.
    erosion_depth : (ny, nx) or (n,) array, optional
        Depth eroded normal to the bed, m.
    bed_change : (ny, nx) or (n,) array, optional
        Change of the elevation of the ground, the deposit less what was eroded, measured vertically, m.
    sections : SectionResult, optional
        What passed the scene's sections; None without.
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
    moving_volume: float = 0.0
    entrained: Array | None = None
    erosion_depth: Array | None = None
    bed_change: Array | None = None
    sections: SectionResult | None = None
