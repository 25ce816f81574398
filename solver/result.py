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
    """Why a run ended early: reason, time (s) and place (x, y in m).

    The place is that of the value that is not finite, otherwise that of the fastest waves for the size of the
    cell, which set the time step; NaN where nothing flows.
    """

    reason: str
    time: float
    x: float
    y: float


@dataclass(frozen=True)
class Ledger:
    """Volumes in m3.

    released, in and out, now in the domain, out through open sides; entrained by the flow, and eroded from
    the bed, which are one volume counted on either side. In is what came through sides and with inflows, out
    what left through all sides.
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

    times : (nt,) of the samples, s. volume : (n, nt), net volume that has passed by then, m3, NaN after a
    failure. arrival : (n,), when one of the cells below a section was first deeper than the arrival depth, s,
    NaN where not.
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

    times : (nt,) the frames asked for, s. depth (m), velocity_x, velocity_y (m s-1) : (nt, ny, nx) on a
    lattice, (nt, n) on a cloud. max_depth (m), max_speed (m s-1), max_momentum_flux (h |u|^2, m3 s-2),
    arrival_time (s, NaN where not reached) : (ny, nx) or (n,), over all time steps. deposit_depth : of the
    same shape, the last good state, m.
    time : of the last good state, s. rest_time : s, NaN if still moving. steps : time steps taken to
    there. cell_stages : cells updated, summed over stages. wall_time, cpu_time : s, of the time loop.
    moving_volume : m3 that is faster than a Froude number of `solver.simulation.MOVING` by the largest depth
    at the start, held at a side or given by an inflow, in the last good state.
    entrained : (nt,) volume that the flow has taken up from the bed by the frames, m3. erosion_depth : depth
    that was eroded normal to the bed, of the shape of the points, m. bed_change : change of the elevation of
    the ground, the deposit less what was eroded, measured vertically, m. None without an erodible bed.
    sections : what passed the scene's sections, None without.
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
