"""Earth pressure (eqs. 7 to 11): how the coefficients follow from the rate at which the flow is strained."""

from __future__ import annotations

import math

from solver.compiled import kernel
from solver.kernels.state import Material
from solver.physics.earth_pressure import STEEPEST

# Slope of the depth from which the deeper side alone decides how a cell is stretched.
LEVEL = 0.05


@kernel(inline=True)
def lean_of(rise: float) -> float:
    """How much more the side ahead counts than the one behind, from -1 to 1, by the slope of the depth."""
    lean = rise * (1.0 / LEVEL)
    lean = lean if lean < 1.0 else 1.0
    return lean if lean > -1.0 else -1.0


@kernel(inline=True)
def stretching(mean: float, half: float, rise: float) -> float:
    """Rate of stretching that the state of a cell is chosen by, s-1.

    With K chosen by the rate of stretching p a component of the momentum equation is
    ``v_t + g h_y K(p) = ...``, a Hamilton-Jacobi equation whose waves run toward the shallower side, since K
    falls with p. What arrives comes from the deeper side. Where the depth is level to within `LEVEL` both
    sides count, so that round-off does not choose between them.

    Parameters
    ----------
    mean, half : float
        Mean of the derivatives of the velocity on both sides, s-1, and half of the one ahead less the other.
    rise : float
        Derivative of the depth, dimensionless.
    """
    lean: float = lean_of(rise)
    return mean + lean * half


@kernel(inline=True)
def mobilised(rate: float, decrease: float, rest: float) -> tuple[float, float]:
    """Share of the passive state, from 0 (active) to 1, and its decrease with the rate of stretching, s.

    Parameters
    ----------
    rate : float
        Rate of stretching, s-1.
    decrease, rest : float
        Decrease of the share between the limiting states, s, and the share at rest.
    """
    wanted = rest - decrease * rate
    share = wanted if wanted < 1.0 else 1.0
    share = share if share > 0.0 else 0.0
    return share, decrease if (wanted > 0.0) & (wanted < 1.0) else 0.0


@kernel(inline=True)
def earth_pressure(
    along: float,
    across: float,
    decrease: float,
    normal: float,
    rise_along: float,
    rise_across: float,
    material: Material,
) -> tuple[float, float, float, float]:
    """Give ``g cos xi K`` along the axis of the bed and across it, and half the speed of their waves.

    Waves of the state alone move at ``s = g cos xi h_y dK/dp`` in the frame of the flow; with those of depth
    at ``s/2 -/+ sqrt(s^2/4 + beta h)``.

    Parameters
    ----------
    along, across : float
        Rates of stretching along the axis and across it, s-1.
    decrease : float
        Of the share of the passive state with the rate: the transition's steepness times
        ``sqrt(h / (g cos xi))``, s; 0 for what is dry.
    normal : float
        g cos(xi), m s-2.
    rise_along, rise_across : float
        Sizes of the derivatives of depth, dimensionless.
    material : Material
        Coefficients and the transition between them.

    Returns
    -------
    beta_along, beta_across : float
        g cos(xi) K, m s-2.
    wave_along, wave_across : float
        ``|s|/2``, m s-1, of slopes up to `STEEPEST`.
    """
    x_a, x_p, y_aa, y_ap, y_pa, y_pp = material.pressure
    rest, _, coupling = material.transition
    s, falls_along = mobilised(along, decrease, rest)
    t, falls_across = mobilised(across, decrease, rest)
    felt, _ = mobilised(along, coupling * decrease, rest)
    active, passive = y_aa + felt * (y_pa - y_aa), y_ap + felt * (y_pp - y_ap)
    rise_along = rise_along if rise_along < STEEPEST else STEEPEST
    rise_across = rise_across if rise_across < STEEPEST else STEEPEST
    wave_along = 0.5 * normal * rise_along * ((x_p - x_a) * falls_along)
    wave_across = 0.5 * normal * rise_across * ((passive - active) * falls_across)
    beta_along, beta_across = normal * (x_a + s * (x_p - x_a)), normal * (active + t * (passive - active))
    return beta_along, beta_across, wave_along, wave_across


@kernel(inline=True)
def wave_speed(wave: float, beta: float, h: float) -> float:
    """Largest speed of waves in the frame of the flow, m s-1; ``wave`` is half that of those of the state."""
    return wave + math.sqrt(wave * wave + beta * h)


@kernel(from_python=True)
def at_rest(material: Material) -> tuple[float, float]:
    """Earth-pressure coefficients along the axis of the bed and across it of what is not strained."""
    along, across, _, _ = earth_pressure(0.0, 0.0, 0.0, 1.0, 0.0, 0.0, material)
    return along, across
