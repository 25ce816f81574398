"""Hydrographs: discharge over time, and empirical peak discharges of debris flows."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from typing import Literal, get_args

import numpy as np

from solver.arrays import Array
from solver.parameters import Checked, ParameterError, parameter, parametric

PeakLaw = Literal["rickenmann-1999", "mizuyama-1992-granular", "mizuyama-1992-muddy"]

# Peak discharge Q = a V^b, m3 s-1, of a volume V, m3: a and b. Rickenmann (1999), Natural Hazards 19, 47-77;
# Mizuyama, Kobashi & Ou (1992), Interpraevent, Bern, vol. 2, 99-108.
PEAK_LAWS: dict[PeakLaw, tuple[float, float]] = {
    "rickenmann-1999": (0.1, 0.833),
    "mizuyama-1992-granular": (0.135, 0.78),
    "mizuyama-1992-muddy": (0.0188, 0.79),
}
assert tuple(PEAK_LAWS) == get_args(PeakLaw)


def peak_discharge(volume: float, law: PeakLaw) -> float:
    """Give the peak discharge, m3 s-1, of a debris flow of a volume, m3, by an empirical law."""
    factor, exponent = PEAK_LAWS[law]
    return float(factor * volume**exponent)


@dataclass(frozen=True, eq=False)
class Hydrograph:
    """Discharge over time: linear between its times, zero outside.

    Parameters
    ----------
    times : (n,) array
        Increasing, s, two or more.
    discharges : (n,) array
        m3 s-1, none negative.

    Raises
    ------
    ValueError
        If they are not.
    """

    times: Array
    discharges: Array

    def __post_init__(self) -> None:
        times, discharges = self.times, self.discharges
        if times.shape != discharges.shape or times.ndim != 1 or len(times) < 2:
            raise ValueError("a hydrograph needs two or more times with a discharge each")
        if not (np.isfinite(times).all() and np.isfinite(discharges).all()):
            raise ValueError("times and discharges must be finite")
        if not (np.diff(times) > 0).all() or times[0] < 0:
            raise ValueError("times of a hydrograph must increase from 0 or later")
        if (discharges < 0).any():
            raise ValueError("discharges must not be negative")

    @cached_property
    def volumes(self) -> Array:
        """Volume that has come in by each of the times, shape (n,), m3."""
        pieces = np.diff(self.times) * (self.discharges[1:] + self.discharges[:-1]) / 2
        return np.concatenate(([0.0], np.cumsum(pieces)))

    def volume_until(self, time: float) -> float:
        """Volume that has come in by a time, m3; the time in s."""
        t = min(max(time, float(self.times[0])), float(self.times[-1]))
        i = min(int(np.searchsorted(self.times, t, side="right")) - 1, len(self.times) - 2)
        share = (t - self.times[i]) / (self.times[i + 1] - self.times[i])
        now = self.discharges[i] + share * (self.discharges[i + 1] - self.discharges[i])
        return float(self.volumes[i] + (t - self.times[i]) * (self.discharges[i] + now) / 2)

    def peak_until(self, time: float) -> float:
        """Largest discharge up to a time, m3 s-1; the time in s."""
        if time < self.times[0]:
            return 0.0
        known = self.discharges[self.times <= time]
        last = np.interp(time, self.times, self.discharges) if time < self.times[-1] else 0.0
        return float(max(known.max(), last))

    @property
    def last(self) -> float:
        """Time after which nothing comes in, s; minus infinity if nothing ever does."""
        flows = np.flatnonzero(self.discharges)
        if not len(flows):
            return -np.inf
        return float(self.times[min(int(flows[-1]) + 1, len(self.times) - 1)])


@parametric
class Triangle(Checked):
    """Hydrograph that rises and falls in a line each, of a volume and a peak discharge.

    It lasts twice the volume over the peak discharge.

    Raises
    ------
    ParameterError
        If a number is out of its bounds.
    """

    volume: float = parameter("volume that comes in", "m3", above=0)
    peak_discharge: float | PeakLaw = parameter(
        "peak discharge, or the empirical law that gives it by the volume",
        "m3 s-1",
        above=0,
        choices=None,
        advice="A law is the mean of widely scattered events: sample the discharge, or try several.",
    )
    rise: float = parameter(
        "time from the start to the peak, as part of the whole",
        default=0.25,
        at_least=0.01,
        at_most=0.99,
    )
    start: float = parameter("time at which it starts", "s", default=0.0, at_least=0)

    def __post_init__(self) -> None:
        super().__post_init__()
        if isinstance(self.peak_discharge, str) and self.peak_discharge not in PEAK_LAWS:
            expected = ", ".join(PEAK_LAWS)
            message = f"expected a number or one of {expected}, found {self.peak_discharge!r}"
            raise ParameterError(message, "peak_discharge")

    def hydrograph(self) -> Hydrograph:
        """Make the hydrograph."""
        asked = self.peak_discharge
        peak = peak_discharge(self.volume, asked) if isinstance(asked, str) else float(asked)
        lasts = 2.0 * self.volume / peak
        times = self.start + lasts * np.array([0.0, self.rise, 1.0])
        return Hydrograph(times, np.array([0.0, peak, 0.0]))
