"""Laws of basal friction: dry, turbulent, viscoplastic, and of grains that depend on speed and depth.

Each is a resistance ``R(s, h) = tau_b / (rho h)``, an acceleration against the motion, s the speed and h the
depth. N is the normal load per mass, ``g cos xi + kappa u^2`` and at least 0.
"""

from __future__ import annotations

from typing import ClassVar, Literal

import numpy as np

from solver.parameters import Alternative, Checked, Parameter, ParameterError, parameter, parametric, shared
from solver.physics.resistance import (
    BinghamProfile,
    DryTurbulent,
    Hysteretic,
    Inertial,
    Quadratic,
    Uniform,
    Viscoplastic,
)


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


DENSITY = Parameter(
    meaning="density of the flow",
    unit="kg m-3",
    above=0,
    usual=(1000, 3000),
    advice="About 1800 to 2200.",
)
"""The density of the flow, which laws of stress need."""

YIELD_STRESS = Parameter(
    meaning="yield stress tau_y",
    unit="Pa",
    at_least=0,
    usual=(5, 20_000),
    advice="About 100 to 3000 for mud and debris flows.",
)
VISCOSITY = Parameter(
    meaning="dynamic viscosity eta",
    unit="Pa s",
    above=0,
    usual=(1e-3, 10_000),
    advice="About 1 to 1000 for mud and debris flows.",
)
MANNING = Parameter(
    meaning="Manning's roughness n",
    unit="s m-1/3",
    above=0,
    usual=(0.008, 0.4),
    advice="About 0.03 to 0.06 for channels with stones, 0.1 and more for vegetation.",
)
BETA = Parameter(
    meaning="factor beta of the flow rule Fr = beta h/h_stop - gamma",
    above=0,
    advice="0.136 for glass beads.",
)
LENGTH = Parameter(
    meaning="depth over which friction changes, a few grains", unit="m", above=0, advice="1 to 3 grains."
)
GAMMA = Parameter(
    meaning="shift gamma of the flow rule Fr = beta h/h_stop - gamma",
    at_least=0,
    advice="0 for glass beads, about 0.77 for sand.",
)
DEFAULT_LAMINAR_RESISTANCE = 24.0


@parametric
class Friction(Checked):
    """Base of laws of basal friction.

    Attributes
    ----------
    comes_to_rest : bool
        Whether it stops what no gravity drives.
    """

    comes_to_rest: ClassVar[bool] = True

    def resistance(self, gravity: float) -> Uniform:
        """Give the law to the kernels; ``gravity`` in m s-2.

        Raises
        ------
        ParameterError
            If it needs a density and has none.
        """
        raise NotImplementedError

    @property
    def least_coefficient(self) -> float:
        """Least R(s, h)/N at any speed and depth, dimensionless."""
        return 0.0

    def film_speed(self, depth: float, driving: float) -> float:
        """Speed, m s-1, at which a film keeps on where none comes to rest; 0 where one may.

        Parameters
        ----------
        depth : float
            Of the film, m.
        driving : float
            Gravity along the bed less `least_coefficient` times the load, over g, dimensionless.
        """
        return 0.0

    @property
    def needs_density(self) -> bool:
        """Whether a parameter is a stress."""
        return False


@parametric
class Coulomb(Friction):
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

    @property
    def least_coefficient(self) -> float:
        """Friction coefficient mu, dimensionless."""
        return self.tangent

    def resistance(self, gravity: float) -> Uniform:
        """R = mu N."""
        return DryTurbulent(self.tangent, 0.0)

    def film_speed(self, depth: float, driving: float) -> float:
        """Nothing limits the speed."""
        return float("inf")


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
        "Voellmy's turbulent friction xi",
        "m s-2",
        above=0,
        usual=(20, 10_000),
        advice="Usually 100 to 1000 for debris flows.",
    )
    cohesion: float = parameter(
        "cohesion N_0, by which friction grows with the load up to (1 - mu) N_0",
        "Pa",
        default=0.0,
        at_least=0,
        usual=(5, 20_000),
        advice="0 to 300 for snow (RAMMS), more for cohesive debris.",
    )
    density: float | None = shared(DENSITY, default=None)

    @property
    def needs_density(self) -> bool:
        """Whether there is cohesion."""
        return self.cohesion > 0.0

    def resistance(self, gravity: float) -> Uniform:
        """R = mu N + (1 - mu) N_0/(rho h) (1 - exp(-rho h N/N_0)) + g s^2/(xi h)."""
        drag = gravity / self.turbulent_friction
        if self.cohesion == 0.0:
            return DryTurbulent(self.tangent, drag)
        return Quadratic(self.tangent, self.cohesion / _given(self.density), drag=drag)

    def film_speed(self, depth: float, driving: float) -> float:
        """Where drag balances gravity; a film with cohesion rests."""
        return 0.0 if self.cohesion else float(np.sqrt(self.turbulent_friction * depth * driving))


@parametric
class Chezy(Friction):
    """Turbulent resistance g s^2 / (C^2 h) of a stream (Chezy).

    Raises
    ------
    ParameterError
        If the coefficient is not above 0.
    """

    advice: ClassVar[str] = "floods; it never stops"
    comes_to_rest: ClassVar[bool] = False

    chezy_coefficient: float = parameter(
        "Chezy's coefficient C",
        "m1/2 s-1",
        above=0,
        usual=(2, 100),
        advice="About 10 to 30 for steep streams.",
    )

    def resistance(self, gravity: float) -> Uniform:
        """R = g s^2/(C^2 h)."""
        return Quadratic(drag=float(gravity / np.square(self.chezy_coefficient)))

    def film_speed(self, depth: float, driving: float) -> float:
        """Where drag balances gravity."""
        return float(self.chezy_coefficient * np.sqrt(depth * driving))


@parametric
class Manning(Friction):
    """Turbulent resistance g n^2 s^2 / h^(4/3) of a stream (Manning).

    Raises
    ------
    ParameterError
        If the roughness is not above 0.
    """

    advice: ClassVar[str] = "floods and watery debris floods; it never stops"
    comes_to_rest: ClassVar[bool] = False

    manning_n: float = shared(MANNING)

    def resistance(self, gravity: float) -> Uniform:
        """R = g n^2 s^2/h^(4/3)."""
        return Quadratic(rough=float(gravity * np.square(self.manning_n)))

    def film_speed(self, depth: float, driving: float) -> float:
        """Where drag balances gravity."""
        return float(depth ** (2 / 3) * np.sqrt(driving) / self.manning_n)


@parametric
class OBrien(Friction):
    """Yield stress, viscous and turbulent resistance together (O'Brien et al. 1993).

    Raises
    ------
    ParameterError
        If a parameter is out of range.
    """

    advice: ClassVar[str] = "mud flows and mud floods"

    yield_stress: float = shared(YIELD_STRESS)
    viscosity: float = shared(VISCOSITY)
    manning_n: float = shared(MANNING)
    laminar_resistance: float = parameter(
        "laminar resistance K_l of the bed",
        default=DEFAULT_LAMINAR_RESISTANCE,
        at_least=0,
        advice="24 for smooth and wide beds, about 2285 is used for rough ones.",
    )
    density: float | None = shared(DENSITY, default=None)

    @property
    def needs_density(self) -> bool:
        """Always."""
        return True

    def resistance(self, gravity: float) -> Uniform:
        """R = tau_y/(rho h) + K_l eta s/(8 rho h^2) + g n^2 s^2/h^(4/3)."""
        density = _given(self.density)
        return Quadratic(
            yield_stress=self.yield_stress / density,
            viscous=self.laminar_resistance * self.viscosity / (8.0 * density),
            rough=float(gravity * np.square(self.manning_n)),
        )


@parametric
class Bingham(Friction):
    """Yield stress and viscosity of a Bingham fluid, from the profile of its steady flow.

    Raises
    ------
    ParameterError
        If a parameter is out of range.
    """

    advice: ClassVar[str] = "muddy debris flows and mud flows"

    yield_stress: float = shared(YIELD_STRESS)
    viscosity: float = shared(VISCOSITY)
    form: Literal["exact", "linear"] = parameter(
        "how the basal stress T follows from the speed",
        default="exact",
        choices={
            "exact": "2 T^3 - 3 (tau_y + 2 eta s/h) T^2 + tau_y^3 = 0, of the steady profile",
            "linear": "T = factor tau_y + 3 eta s/h",
        },
    )
    factor: float = parameter(
        "of the yield stress in the linear form",
        default=1.0,
        at_least=1.0,
        at_most=1.5,
        advice="1.5 is right for fast flows, 1 for what comes to rest.",
    )
    density: float | None = shared(DENSITY, default=None)

    @property
    def needs_density(self) -> bool:
        """Always."""
        return True

    def resistance(self, gravity: float) -> Uniform:
        """R = T/(rho h)."""
        density = _given(self.density)
        stress, viscosity = self.yield_stress / density, self.viscosity / density
        if self.form == "exact":
            return BinghamProfile(stress, viscosity)
        return Quadratic(yield_stress=self.factor * stress, viscous=3.0 * viscosity)


@parametric
class HerschelBulkley(Friction):
    """Yield stress and a power of the shear rate, from the profile of a steady flow (Herschel-Bulkley).

    Raises
    ------
    ParameterError
        If a parameter is out of range.
    """

    advice: ClassVar[str] = "muddy debris flows whose viscosity falls with the rate of shear"

    yield_stress: float = shared(YIELD_STRESS)
    consistency: float = parameter(
        "consistency K",
        "Pa s^n",
        above=0,
        usual=(0.1, 10_000),
        advice="About 10 to 1000 for mud and debris flows.",
    )
    flow_index: float = parameter(
        "flow index n", at_least=0.1, at_most=2, advice="About 1/3 for mud; 1 is a Bingham fluid."
    )
    density: float | None = shared(DENSITY, default=None)

    @property
    def needs_density(self) -> bool:
        """Always."""
        return True

    def resistance(self, gravity: float) -> Uniform:
        """R = T/(rho h), T the basal stress of a steady flow of the same speed."""
        density = _given(self.density)
        return Viscoplastic(self.yield_stress / density, self.consistency / density, self.flow_index)


@parametric
class Pouliquen(Friction):
    """Friction of grains that grows with speed and falls with depth, mu(I) (Pouliquen & Forterre 2002).

    Raises
    ------
    ParameterError
        If a parameter is out of range, or angles do not increase.
    """

    advice: ClassVar[str] = "dry grains on rough beds, from experiments"

    angles: tuple[float, float] = parameter(
        "friction angles of a slow and of a fast flow",
        "degrees",
        at_least=0,
        below=90,
        ordered=True,
        advice="[21, 30.7] for glass beads.",
    )
    beta: float = shared(BETA)
    length: float = shared(LENGTH)
    gamma: float = shared(GAMMA, default=0.0)

    @property
    def least_coefficient(self) -> float:
        """Coefficient of the first angle, dimensionless."""
        return friction_coefficient(self.angles[0])

    def resistance(self, gravity: float) -> Uniform:
        """R = mu N, mu by `solver.kernels.inertial`."""
        slow, fast = map(friction_coefficient, self.angles)
        return Inertial(slow, fast, self.length, self.beta, self.gamma)


@parametric
class Edwards(Friction):
    """Friction of grains that hold more at rest than in motion, with hysteresis (Edwards et al. 2019).

    Raises
    ------
    ParameterError
        If a parameter is out of range, or the third angle is not between the others.
    """

    advice: ClassVar[str] = "dry grains that start and stop, as deposits and levees"

    angles: tuple[float, float, float] = parameter(
        "friction angles of a slow flow, of a fast one, and of the start of a deep layer, which lies between",
        "degrees",
        at_least=0,
        below=90,
    )
    beta: float = shared(BETA)
    length: float = shared(LENGTH)
    beta_star: float = parameter("Froude number below which friction weakens with speed", above=0)
    gamma: float = shared(GAMMA, default=0.0)
    kappa: float = parameter(
        "exponent of the transition from static to dynamic friction", default=1.0, at_least=1, at_most=10
    )

    def __post_init__(self) -> None:
        super().__post_init__()
        slow, fast, start = self.angles
        if not slow < start < fast:
            found = f"expected the third angle between the first and the second, found {start:g}"
            raise ParameterError(found, "angles.2")

    @property
    def least_coefficient(self) -> float:
        """Coefficient of the first angle, dimensionless."""
        return friction_coefficient(self.angles[0])

    def resistance(self, gravity: float) -> Uniform:
        """R = mu N, mu by `solver.kernels.inertial`."""
        slow, fast, start = map(friction_coefficient, self.angles)
        return Hysteretic(slow, fast, start, self.length, self.beta, self.gamma, self.beta_star, self.kappa)


def _given(density: float | None) -> float:
    """Give a density that a law needs, kg m-3."""
    if density is None:
        raise ParameterError("expected a density, found none", "density")
    return density


LAWS: tuple[type[Friction], ...] = (
    Coulomb,
    Voellmy,
    Chezy,
    Manning,
    OBrien,
    Bingham,
    HerschelBulkley,
    Pouliquen,
    Edwards,
)
"""All laws of basal friction. A law that is named here can be chosen in a scenario file."""
