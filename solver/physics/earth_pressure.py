"""Earth pressure (eqs. 8-11): how much of the overburden acts along the bed."""

from __future__ import annotations

from typing import ClassVar, NamedTuple

import numpy as np

from solver.parameters import Checked, ParameterError, parameter, parametric, shared
from solver.physics.friction import BED_FRICTION, friction_coefficient


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


class EarthPressure(Checked):
    """Base of laws of earth pressure."""

    def coefficients(self) -> PressureCoefficients:
        """Give the coefficients of every state."""
        raise NotImplementedError


@parametric
class Isotropic(EarthPressure):
    """Hydrostatic earth pressure, K = 1 in every state."""

    advice: ClassVar[str] = "wet debris flows, and values calibrated with Voellmy friction"

    def coefficients(self) -> PressureCoefficients:
        """All coefficients are 1."""
        return PressureCoefficients(1.0, 1.0, 1.0, 1.0, 1.0, 1.0)


@parametric
class MohrCoulomb(EarthPressure):
    """Mohr-Coulomb earth pressure, active where the flow stretches and passive where it is compressed.

    Raises
    ------
    ParameterError
        If an angle is out of range or delta exceeds phi, where eq. 8 has no real root.
    """

    advice: ClassVar[str] = "dry granular flow"

    internal_friction: float = parameter(
        "internal friction angle phi, at least `bed_friction`; needed with mohr-coulomb",
        "degrees",
        at_least=0,
        below=90,
        advice="About 30 to 40 for gravel and sand.",
    )
    bed_friction: float = shared(BED_FRICTION)

    def __post_init__(self) -> None:
        super().__post_init__()
        if self.internal_friction < self.bed_friction:
            found = (
                f"expected at most internal_friction ({self.internal_friction:g}) with earth_pressure "
                f"mohr-coulomb, found {self.bed_friction:g}"
            )
            raise ParameterError(found, "bed_friction", "internal_friction")

    def coefficients(self) -> PressureCoefficients:
        """Evaluate eqs. 8 and 9, the root of eq. 8 read as sqrt(1 - cos^2 phi / cos^2 delta)."""
        phi, delta = np.radians([self.internal_friction, self.bed_friction])
        mu = friction_coefficient(self.bed_friction)
        root = np.sqrt(max(0.0, 1 - (np.cos(phi) / np.cos(delta)) ** 2))

        def along(sign: float) -> float:
            return float(2 / np.cos(phi) ** 2 * (1 + sign * root) - 1)

        def across(k_x: float, sign: float) -> float:
            return float((k_x + 1 + sign * np.sqrt((k_x - 1) ** 2 + 4 * mu**2)) / 2)

        active, passive = along(-1), along(+1)
        return PressureCoefficients(
            active, passive, across(active, -1), across(active, +1), across(passive, -1), across(passive, +1)
        )


LAWS: tuple[type[EarthPressure], ...] = (MohrCoulomb, Isotropic)
"""All laws of earth pressure. A law that is named here can be chosen in a scenario file."""
