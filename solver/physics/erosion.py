"""Erosion of the bed: laws of what a flow takes up, and how much there is.

What is taken up was at rest: it brings no momentum, and the flow is slowed (E1). The bed keeps its shape
for the flow (docs/method.md).
"""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import ClassVar, Literal

import numpy as np

from solver.arrays import Array
from solver.parameters import Checked, Parameter, ParameterError, parameter, parametric, shared
from solver.physics.friction import DENSITY, friction_coefficient
from solver.physics.resistance import area_means, shares_of_zones

# How the kernels tell the laws apart.
GROWTH_RATE, SHEAR_STRESS, SHEAR_WORK, EGASHIRA, JUMP_CONDITION = range(5)

MINIMUM_DEPTH = Parameter(
    meaning="depth of flow up to which nothing is eroded",
    unit="m",
    at_least=0,
    advice="0.1 for debris flows; leave it out on the scale of a laboratory.",
)
MINIMUM_SPEED = Parameter(
    meaning="speed up to which nothing is eroded",
    unit="m s-1",
    at_least=0,
    advice="0.1 for debris flows; the jump condition needs it.",
)

Coefficients = tuple[float, float, float]


def _given(density: float | None) -> float:
    """Give a density that a law needs, kg m-3."""
    if density is None:
        raise ParameterError("expected a density with a law of erosion by stress, found none", "density")
    return density


class ErosionLaw(Checked):
    """Base of the laws of erosion.

    Attributes
    ----------
    number : int
        One of the constants of this module.
    """

    number: ClassVar[int]

    def coefficients(self) -> Coefficients:
        """Give the kernels what they need of the parameters, per unit of density (E2 to E6).

        Raises
        ------
        ParameterError
            If the law needs a density and has none.
        """
        raise NotImplementedError

    @property
    def needs_density(self) -> bool:
        """Whether a parameter is a stress."""
        return False


@parametric
class GrowthRate(ErosionLaw):
    """The flow grows by a share of itself on each metre of its way (McDougall & Hungr 2005).

    Raises
    ------
    ParameterError
        If the growth is negative.
    """

    advice: ClassVar[str] = "back-calculated events: growth is ln(final volume / first volume) / length"
    number: ClassVar[int] = GROWTH_RATE

    growth: float = parameter(
        "growth G of the flow's volume on its way",
        "m-1",
        at_least=0,
        usual=(1e-5, 0.2),
        advice="ln(V_f/V_0)/S of a flow that grows from V_0 to V_f on a way of S.",
    )

    def coefficients(self) -> Coefficients:
        """G (m-1)."""
        return self.growth, 0.0, 0.0


@parametric
class ShearStress(ErosionLaw):
    """A depth that grows with the shear stress, reached at a given rate (Frank et al. 2015).

    Raises
    ------
    ParameterError
        If a parameter is out of its bounds.
    """

    advice: ClassVar[str] = "debris flows in channels of loose sediment"
    number: ClassVar[int] = SHEAR_STRESS

    rate: float = parameter("rate of erosion", "m s-1", above=0, default=0.025)
    depth_per_stress: float = parameter(
        "depth of erosion per stress above the critical one",
        "m Pa-1",
        above=0,
        default=1e-4,
        usual=(1e-6, 1e-2),
        advice="1e-5 to 1e-4.",
    )
    critical_stress: float = parameter(
        "stress below which nothing is eroded", "Pa", at_least=0, default=1e3, usual=(5, 100_000)
    )
    stress: Literal["depth-slope", "friction"] = parameter(
        "the shear stress",
        default="depth-slope",
        choices={
            "depth-slope": "rho g h sin(theta), theta the inclination of the bed in the direction of motion",
            "friction": "that of the law of friction",
        },
    )
    density: float | None = shared(DENSITY, default=None)

    def coefficients(self) -> Coefficients:
        """Rate (m s-1), depth per stress times density (s2 m-1), critical stress over density (m2 s-2)."""
        density = _given(self.density)
        return self.rate, self.depth_per_stress * density, self.critical_stress / density

    @property
    def needs_density(self) -> bool:
        """Whether a parameter is a stress."""
        return True


@parametric
class ShearWork(ErosionLaw):
    """The work of basal friction over the energy that it takes to loosen the bed.

    Raises
    ------
    ParameterError
        If a parameter is out of its bounds.
    """

    advice: ClassVar[str] = "loose layers whose resistance is known as an energy"
    number: ClassVar[int] = SHEAR_WORK

    erosion_energy: float = parameter(
        "energy that loosens a mass of the bed", "J kg-1", above=0, default=5000.0
    )

    def coefficients(self) -> Coefficients:
        """One over the energy (s2 m-2)."""
        return 1.0 / self.erosion_energy, 0.0, 0.0


@parametric
class Egashira(ErosionLaw):
    """The bed tends to the slope at which the flow would neither erode nor deposit (Egashira et al.).

    Raises
    ------
    ParameterError
        If a parameter is out of its bounds.
    """

    advice: ClassVar[str] = "steep channels of loose sediment, where grain properties are known"
    number: ClassVar[int] = EGASHIRA

    concentration: float = parameter(
        "volume concentration of grains in the flow", above=0, below=1, default=0.4
    )
    bed_angle: float = parameter(
        "angle of internal friction of the bed", "degrees", above=0, below=90, default=38.0
    )
    density_ratio: float = parameter("density of grains over that of the fluid", above=1, default=2.65)

    @property
    def equilibrium_slope(self) -> float:
        """Tangent of the slope at which nothing is eroded, dimensionless (E5)."""
        excess = (self.density_ratio - 1.0) * self.concentration
        return excess / (excess + 1.0) * friction_coefficient(self.bed_angle)

    def coefficients(self) -> Coefficients:
        """Tangent of the equilibrium slope."""
        return self.equilibrium_slope, 0.0, 0.0


@parametric
class JumpCondition(ErosionLaw):
    """The excess of the flow's shear stress over the bed's strength sets bed in motion (Iverson 2012).

    Raises
    ------
    ParameterError
        If a parameter is out of its bounds.
    """

    advice: ClassVar[str] = "studies; calibrated friction resists the flow and erodes at once"
    number: ClassVar[int] = JUMP_CONDITION

    strength_coefficient: float = parameter(
        "shear strength of the bed over the normal stress on it, tan(phi) (1 - pore pressure ratio)",
        at_least=0,
        advice="0 for a bed that liquefies.",
    )
    bed_cohesion: float = parameter("cohesion of the bed", "Pa", at_least=0, default=0.0)
    slip: float = parameter(
        "speed of the flow at the bed over its mean",
        above=0,
        at_most=1,
        default=1.0,
        advice="0.5 for a linear profile.",
    )
    density: float | None = shared(DENSITY, default=None)

    def coefficients(self) -> Coefficients:
        """Strength coefficient, cohesion over density (m2 s-2), slip."""
        cohesion = self.bed_cohesion / _given(self.density) if self.needs_density else 0.0
        return self.strength_coefficient, cohesion, self.slip

    @property
    def needs_density(self) -> bool:
        """Whether a parameter is a stress."""
        return self.bed_cohesion > 0


LAWS: tuple[type[ErosionLaw], ...] = (GrowthRate, ShearStress, ShearWork, Egashira, JumpCondition)
"""All laws of erosion. A law that is named here can be chosen in a scenario file."""


@parametric
class ErosionLimits(Checked):
    """From when on a flow erodes, whatever the law."""

    minimum_depth: float = shared(MINIMUM_DEPTH, default=0.0)
    minimum_speed: float = shared(MINIMUM_SPEED, default=0.0)


@dataclass(frozen=True, eq=False)
class ErosionZone:
    """A part of the bed whose law has other parameters.

    Parameters
    ----------
    law : ErosionLaw
        Of the class of that of the bed.
    share : array
        Of the area of each cell that is in the zone, 0 to 1, of the shape of the points.
    """

    law: ErosionLaw
    share: Array


@dataclass(frozen=True, eq=False)
class ErodibleBed:
    """What a flow may take up.

    Parameters
    ----------
    depth : array
        Erodible depth normal to the bed, of the shape of the points, m.
    law : ErosionLaw
        How fast it is taken up.
    limits : ErosionLimits
        From when on.
    zones : tuple of ErosionZone
        With parameters of their own, which do not overlap.

    Attributes
    ----------
    coefficients : array or None
        Coefficients of the law at each cell, means over its area, (3, *shape); None without zones.

    Raises
    ------
    ParameterError
        If a depth is negative or not finite, or the law needs a least speed and none is given.
    ValueError
        If zones overlap, are of another law, or have shares of another shape.
    """

    depth: Array
    law: ErosionLaw
    limits: ErosionLimits = field(default_factory=ErosionLimits)
    zones: tuple[ErosionZone, ...] = ()
    coefficients: Array | None = field(init=False, default=None)

    def __post_init__(self) -> None:
        depth = np.asarray(self.depth, dtype=np.float64)
        if not (np.isfinite(depth).all() and (depth >= 0).all()):
            raise ParameterError("expected finite depths of at least 0", "depth")
        check_together(self.law, self.limits)
        laws = [(zone.law, zone.share) for zone in self.zones]
        shares = shares_of_zones(laws, self.law, depth.shape, "erosion")
        if self.zones:
            parts = [(law.coefficients(), share) for (law, _), share in zip(laws, shares, strict=True)]
            object.__setattr__(self, "coefficients", area_means(self.law.coefficients(), parts))


def check_together(law: ErosionLaw, limits: ErosionLimits) -> None:
    """Refuse the jump condition without a least speed, as its rate has no bound where a flow starts.

    Raises
    ------
    ParameterError
        If it has none.
    """
    if law.number == JUMP_CONDITION and not limits.minimum_speed > 0:
        raise ParameterError(
            "expected a speed above 0, as the jump condition has no bound at rest, found 0", "minimum_speed"
        )
