"""Earth pressure (eqs. 8-11): how much of the overburden acts along the bed."""

from __future__ import annotations

from dataclasses import dataclass
from typing import NamedTuple

import numpy as np


class PressureCoefficients(NamedTuple):
    """Earth-pressure coefficients, dimensionless.

    ``x_active`` and ``x_passive`` act along the bed (eq. 8). The four across it (eq. 9) are named by the
    state along the bed, then the state across it.
    """

    x_active: float
    x_passive: float
    y_active_active: float
    y_active_passive: float
    y_passive_active: float
    y_passive_passive: float


@dataclass(frozen=True)
class Isotropic:
    """Hydrostatic earth pressure, K = 1 in every state."""

    def coefficients(self) -> PressureCoefficients:
        """All coefficients are 1."""
        return PressureCoefficients(1.0, 1.0, 1.0, 1.0, 1.0, 1.0)


@dataclass(frozen=True)
class MohrCoulomb:
    """Mohr-Coulomb earth pressure.

    Parameters
    ----------
    internal_friction, bed_friction : float
        Friction angles phi and delta, degrees, 0 <= delta <= phi < 90.

    Raises
    ------
    ValueError
        If the angles are out of range or delta exceeds phi, where eq. 8 has no real root.
    """

    internal_friction: float
    bed_friction: float

    def __post_init__(self) -> None:
        if not 0 <= self.bed_friction <= self.internal_friction < 90:
            raise ValueError("Mohr-Coulomb needs 0 <= bed friction <= internal friction < 90 degrees")

    def coefficients(self) -> PressureCoefficients:
        """Evaluate eqs. 8 and 9, the root of eq. 8 read as sqrt(1 - cos^2 phi / cos^2 delta)."""
        phi, delta = np.radians([self.internal_friction, self.bed_friction])
        root = np.sqrt(max(0.0, 1 - (np.cos(phi) / np.cos(delta)) ** 2))

        def along(sign: float) -> float:
            return float(2 / np.cos(phi) ** 2 * (1 + sign * root) - 1)

        def across(k_x: float, sign: float) -> float:
            return float((k_x + 1 + sign * np.sqrt((k_x - 1) ** 2 + 4 * np.tan(delta) ** 2)) / 2)

        active, passive = along(-1), along(+1)
        return PressureCoefficients(
            active, passive, across(active, -1), across(active, +1), across(passive, -1), across(passive, +1)
        )


EarthPressure = Isotropic | MohrCoulomb
