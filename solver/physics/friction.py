"""Basal friction: dry (Coulomb) and with turbulent drag (Voellmy)."""

from __future__ import annotations

from typing import ClassVar

import numpy as np

from solver.parameters import Alternative, Checked, Parameter, parameter, parametric, shared


def friction_coefficient(angle: float) -> float:
    """Give mu = tan(delta), dimensionless, of a friction angle delta, degrees."""
    return float(np.tan(np.radians(angle)))


def friction_angle(coefficient: float) -> float:
    """Give the friction angle delta, degrees, of a coefficient mu = tan(delta)."""
    return float(np.degrees(np.arctan(coefficient)))


BED_FRICTION = Parameter(
    meaning="bed friction angle delta; or `friction_coefficient`",
    unit="degrees",
    at_least=0,
    below=90,
    advice="About 20 to 35 for dry granular flow; with turbulent friction about 3 to 17, mu 0.05 to 0.3.",
    alternative=Alternative(
        "friction_coefficient",
        Parameter(meaning="friction coefficient mu = tan(delta), in place of `bed_friction`", at_least=0),
        friction_angle,
    ),
)
"""The bed friction angle, which laws of friction and of earth pressure have in common."""


@parametric
class Coulomb(Checked):
    """Dry friction: at most h tan(delta) (g cos xi + kappa u^2), against the motion (eqs. 4-5).

    Raises
    ------
    ParameterError
        If the angle is out of range.
    """

    advice: ClassVar[str] = "dry granular flow and laboratory chutes"

    bed_friction: float = shared(BED_FRICTION)

    @property
    def tangent(self) -> float:
        """Friction coefficient mu = tan(delta), dimensionless."""
        return friction_coefficient(self.bed_friction)

    def drag(self, gravity: float) -> float:
        """Drag per unit of mass over |u|^2 / h, dimensionless: none; ``gravity`` in m s-2."""
        return 0.0


@parametric
class Voellmy(Coulomb):
    """Dry friction plus the turbulent drag g (u^2 + v^2) / turbulent_friction (Voellmy 1955).

    Raises
    ------
    ParameterError
        If the angle is out of range or the coefficient is not above 0.
    """

    advice: ClassVar[str] = "debris flows in practice, with values calibrated by observed events"

    turbulent_friction: float = parameter(
        "Voellmy's turbulent friction xi", "m s-2", above=0, advice="Usually 100 to 1000 for debris flows."
    )

    def drag(self, gravity: float) -> float:
        """Drag per unit of mass over |u|^2 / h, dimensionless: g / turbulent_friction."""
        return gravity / self.turbulent_friction


LAWS: tuple[type[Coulomb], ...] = (Coulomb, Voellmy)
"""All laws of basal friction. A law that is named here can be chosen in a scenario file."""
