"""Earth pressure (eqs. 8-11): how much of the overburden acts along the bed."""

from __future__ import annotations

from typing import ClassVar, NamedTuple

import numpy as np

from solver.parameters import Checked, ParameterError, parameter, parametric, shared
from solver.physics.friction import BED_FRICTION, friction_coefficient

# Decrease of the share of the passive state that stands for a jump.
JUMP = 1e200
# Rate of stretching, times sqrt(h / (g cos xi)), from which a state is the limiting one.
WIDTH = 0.5
# Slope of the depth up to which the equations are hyperbolic whatever the width of the transition, and up to
# which the waves of the state count for the step: what is steeper is a front or a shock, one cell wide.
STEEPEST = 1.0


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


class Transition(NamedTuple):
    """How the share of the passive state goes from 0 to 1, dimensionless.

    ``rest`` is the share at rest, ``steepness`` its decrease with the rate of stretching times
    ``sqrt(h / (g cos xi))``, 0 where no coefficient depends on a rate. ``coupling`` is the steepness of what
    stretching along the bed makes of the coefficient across it, part of ``steepness``.
    """

    rest: float
    steepness: float
    coupling: float


class EarthPressure(Checked):
    """Base of laws of earth pressure."""

    along_flow: ClassVar[bool] = False
    """Whether the axes are those of basal traction; those of the profile otherwise."""

    def coefficients(self) -> PressureCoefficients:
        """Give the coefficients of every state."""
        raise NotImplementedError

    def transition(self) -> Transition:
        """Say how a state goes over into another one."""
        raise NotImplementedError


@parametric
class Isotropic(EarthPressure):
    """Hydrostatic earth pressure, K = 1 in every state."""

    advice: ClassVar[str] = "wet debris flows, and values calibrated with Voellmy friction"

    def coefficients(self) -> PressureCoefficients:
        """All coefficients are 1."""
        return PressureCoefficients(1.0, 1.0, 1.0, 1.0, 1.0, 1.0)

    def transition(self) -> Transition:
        """Nothing depends on the rate of stretching."""
        return Transition(0.0, 0.0, 1.0)


@parametric
class MohrCoulomb(EarthPressure):
    """Earth pressure of Mohr and Coulomb along and across the profile, active where the flow stretches.

    It is passive where the flow is compressed.

    Raises
    ------
    ParameterError
        If an angle is out of range, delta exceeds phi, where eq. 8 has no real root, or the transition is
        negative or not finite.
    """

    advice: ClassVar[str] = "dry granular flow on a slope profile"

    internal_friction: float = parameter(
        "internal friction angle phi, at least `bed_friction`; needed with Mohr-Coulomb earth pressure",
        "degrees",
        at_least=0,
        below=90,
        advice="About 30 to 40 for gravel and sand.",
    )
    bed_friction: float = shared(BED_FRICTION)
    pressure_transition: float = parameter(
        "rate of stretching, times sqrt(h / (g cos xi)), at which the active state is reached, and with the "
        "opposite sign the passive one; K is linear in between",
        default=WIDTH,
        at_least=0,
        advice="0 is the bare sign of the paper, whose solutions do not converge under refinement.",
    )

    def __post_init__(self) -> None:
        super().__post_init__()
        if self.internal_friction < self.bed_friction:
            law = "mohr-coulomb-flow" if self.along_flow else "mohr-coulomb"
            found = (
                f"expected at most internal_friction ({self.internal_friction:g}) with earth_pressure "
                f"{law}, found {self.bed_friction:g}"
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

    def transition(self) -> Transition:
        """Make the transition of the given width, wider for what stretching along makes of K across.

        With ``d`` the difference that the state along makes to a coefficient ``K_y`` the equations stay
        hyperbolic up to a slope S of the depth if ``S d / (2 width) <= sqrt(K_y)``: stretching along must not
        push across faster than waves travel there.
        """
        if self.pressure_transition == 0.0:
            return Transition(0.0, JUMP, 1.0)
        _, _, *across = self.coefficients()
        least = max((across[2 + k] - across[k]) / np.sqrt(across[k]) for k in range(2)) * STEEPEST / 2
        wide = max(self.pressure_transition, float(least))
        return Transition(0.5, 0.5 / self.pressure_transition, self.pressure_transition / wide)


@parametric
class MohrCoulombFlow(MohrCoulomb):
    """Earth pressure of Mohr and Coulomb along and across the flow, whatever way it goes.

    At rest the axes are those of what drives it. Where it moves along the profile it is `MohrCoulomb`.
    """

    advice: ClassVar[str] = "dry granular flow on an elevation model"
    along_flow: ClassVar[bool] = True


LAWS: tuple[type[EarthPressure], ...] = (MohrCoulomb, Isotropic, MohrCoulombFlow)
"""All laws of earth pressure. A law that is named here can be chosen in a scenario file."""
