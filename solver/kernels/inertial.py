"""Friction of grains that depends on speed and depth: Pouliquen's mu(I), and with hysteresis.

With ``w = sqrt(N h)`` the speed of waves, the dynamic coefficient is

    mu_d(s) = mu_1 + (mu_2 - mu_1) (s + gamma w) / (s + gamma w + beta h w / length),

and with hysteresis, below a Froude number ``Fr = s/w = beta_star`` at which mu_d is mu_star,

    mu = mu_start - (Fr/beta_star)^kappa (mu_start - mu_star),
    mu_start = mu_3 + (mu_2 - mu_1) / (1 + h/length).
"""

from __future__ import annotations

import math

from solver.compiled import kernel
from solver.kernels.resistance import raised_rate, resistance, rest_stress, share_left
from solver.physics.resistance import Hysteretic, Inertial

MOST_ITERATIONS = 100
CONVERGED = 1e-14
# What is shallower than so many times the wet limit does not shorten the step.
FILM = 100.0


@kernel(inline=True)
def dynamic_friction(law: Inertial | Hysteretic, speed: float, h: float, wave: float) -> float:
    """Friction coefficient mu_d of a flow, dimensionless; ``wave`` is sqrt(N h), m s-1."""
    fast, slow = speed + law.gamma * wave, law.beta * h * wave / law.length
    # without a normal load nothing slows a flow down, whatever the coefficient
    return float(law.mu_1 + (law.mu_2 - law.mu_1) * fast / (fast + slow + 1e-300))


@rest_stress.of(Inertial)
def _(law: Inertial, h: float, load: float, pressure: float) -> float:
    return float(dynamic_friction(law, 0.0, h, math.sqrt(pressure * h)) * pressure * load)


@resistance.of(Inertial)
def _(law: Inertial, speed: float, h: float, pressure: float) -> float:
    return float(pressure * dynamic_friction(law, speed, h, math.sqrt(pressure * h)))


@share_left.of(Inertial)
def _(law: Inertial, speed: float, h: float, load: float, pressure: float, time: float) -> float:
    wave, braking = math.sqrt(pressure * h), time * pressure * load / h
    start = dynamic_friction(law, 0.0, h, wave)
    share = dynamic_speed(law, speed + braking * start, h, wave, braking) / speed
    return share if share > 0.0 else 0.0


@kernel(inline=True)
def friction_at_rest(law: Hysteretic, h: float) -> float:
    """Friction coefficient that what is at rest has to exceed, dimensionless."""
    return law.mu_3 + (law.mu_2 - law.mu_1) / (1.0 + h / law.length)


@rest_stress.of(Hysteretic)
def _(law: Hysteretic, h: float, load: float, pressure: float) -> float:
    return float(friction_at_rest(law, h) * pressure * load)


@resistance.of(Hysteretic)
def _(law: Hysteretic, speed: float, h: float, pressure: float) -> float:
    wave = math.sqrt(pressure * h)
    turn = law.beta_star * wave
    if speed >= turn:
        return float(pressure * dynamic_friction(law, speed, h, wave))
    start = friction_at_rest(law, h)
    drop = start - dynamic_friction(law, turn, h, wave)
    return float(pressure * (start - math.pow(speed / turn, law.kappa) * drop))


@share_left.of(Hysteretic)
def _(law: Hysteretic, speed: float, h: float, load: float, pressure: float, time: float) -> float:
    wave, braking = math.sqrt(pressure * h), time * pressure * load / h
    start, turn = friction_at_rest(law, h), law.beta_star * wave
    left = dynamic_speed(law, speed + braking * start, h, wave, braking)
    if left < turn:
        drop = braking * (start - dynamic_friction(law, turn, h, wave))
        left = weakening_speed(law, speed, turn, drop)
    share = left / speed
    # where friction weakens with speed more is left than resistance at rest leaves
    return share if share > 0.0 else 0.0


@kernel(inline=True)
def dynamic_speed(law: Inertial | Hysteretic, speed: float, h: float, wave: float, braking: float) -> float:
    """Solve ``s + braking mu_d(s) = speed`` for s, m s-1; below 0 where there is no such speed."""
    shift, slow = law.gamma * wave, law.beta * h * wave / law.length
    x = speed + shift
    b, c = slow + braking * law.mu_2 - x, slow * (braking * law.mu_1 - x)
    root = math.sqrt(max(b * b - 4.0 * c, 0.0))
    # the positive root, without cancellation
    found = 0.5 * (root - b) if b <= 0.0 else -2.0 * c / (root + b)
    return found - shift


@kernel(inline=True)
def weakening_speed(law: Hysteretic, speed: float, turn: float, drop: float) -> float:
    """Solve ``s - drop (s/turn)^kappa = speed`` for s up to ``turn``, m s-1.

    Newton's method from below: the left side is concave, so that it does not overshoot.
    """
    if law.kappa == 1.0:
        return speed / (1.0 - drop / turn)
    s = speed
    for _ in range(MOST_ITERATIONS):
        part = drop * math.pow(s / turn, law.kappa)
        step = (speed + part - s) / (1.0 - law.kappa * part / s)
        s += step
        if abs(step) <= CONVERGED * s:
            break
    return s


@raised_rate.of(Hysteretic)
def _(law: Hysteretic, rate: float, h: float, normal: float, dry: float) -> float:
    # two speeds would solve a step longer than one over the weakening of friction with speed, s-1
    if h <= FILM * dry:
        return rate
    wave = math.sqrt(normal * h)
    turn = law.beta_star * wave
    drop = friction_at_rest(law, h) - dynamic_friction(law, turn, h, wave)
    weakening = 2.0 * law.kappa * normal * drop / turn
    return weakening if weakening > rate else rate
