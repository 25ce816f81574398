"""Basal friction: dry (Coulomb) and with turbulent drag (Voellmy)."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np


@dataclass(frozen=True)
class Coulomb:
    """Dry friction: at most h tan(delta) (g cos xi + kappa u^2), against the motion (eqs. 4-5).

    Parameters
    ----------
    bed_friction : float
        Basal friction angle delta, degrees, 0 <= delta < 90.

    Raises
    ------
    ValueError
        If the angle is out of range.
    """

    bed_friction: float

    def __post_init__(self) -> None:
        if not 0 <= self.bed_friction < 90:
            raise ValueError("bed friction must be at least 0 and below 90 degrees")

    @property
    def tangent(self) -> float:
        """tan(delta), dimensionless."""
        return float(np.tan(np.radians(self.bed_friction)))


@dataclass(frozen=True)
class Voellmy(Coulomb):
    """Dry friction plus the turbulent drag g |u|^2 / turbulent_friction (Voellmy 1955).

    Parameters
    ----------
    turbulent_friction : float
        Voellmy's coefficient, m s-2, above 0.

    Raises
    ------
    ValueError
        If the coefficient is not above 0.
    """

    turbulent_friction: float

    def __post_init__(self) -> None:
        super().__post_init__()
        if not self.turbulent_friction > 0:
            raise ValueError("turbulent friction must be above 0")
