"""The friction kernel: the answers of each form of resistance to what `solver.kernels.resistance` asks."""

from __future__ import annotations

import math

import numpy as np

from solver.arrays import Array
from solver.compiled import kernel
from solver.elementary import exponential_less_1, inverse_cube_root
from solver.kernels import inertial, viscoplastic, zones
from solver.kernels.resistance import (
    below_yield,
    faces_below_yield,
    held_momentum,
    law_at,
    loaded,
    mean_drive,
    raised_rate,
    resistance,
    rest_stress,
    share_left,
    slowed,
)
from solver.kernels.state import YIELD_TOLERANCE
from solver.physics.resistance import (
    BinghamProfile,
    DryTurbulent,
    Hysteretic,
    Inertial,
    Quadratic,
    Uniform,
    Viscoplastic,
)

__all__ = [
    "below_yield",
    "faces_below_yield",
    "held_momentum",
    "inertial",
    "law_at",
    "mean_drive",
    "raised_rate",
    "resistance",
    "resistance_at_rest",
    "rest_stress",
    "share_left",
    "slowed",
    "viscoplastic",
    "zones",
]

# Dry friction with turbulent drag: in the order of operations that vectorises and has no rounding of its own.


@rest_stress.of(DryTurbulent)
def _(law: DryTurbulent, h: float, load: float, pressure: float) -> float:
    return law.tangent * pressure * load


@resistance.of(DryTurbulent)
def _(law: DryTurbulent, speed: float, h: float, pressure: float) -> float:
    return law.tangent * pressure + law.drag * (speed * speed) / h


@held_momentum.of(DryTurbulent)
def _(law: DryTurbulent, h: float, load: float, pressure: float, time: float) -> float:
    return time * law.tangent * pressure * load


@slowed.of(DryTurbulent)
def _(
    law: DryTurbulent, u: float, v: float, h: float, load: float, pressure: float, time: float
) -> tuple[float, float]:
    if law.drag > 0.0:
        share = drag_factor(math.sqrt(u * u + v * v), h, time * law.drag)
        u, v = u * share, v * share
    return u, v


@kernel(inline=True)
def drag_factor(speed: float, h: float, drag: float) -> float:
    """Share of a speed (m s-1) that implicit turbulent drag leaves at depth h (m).

    Parameters
    ----------
    drag
        Coefficient of turbulent drag, g / turbulent friction, times the time that it acts, s.
    """
    resistance = 4.0 * drag * speed / (h if h > 0.0 else 1.0)
    return 2.0 / (1.0 + math.sqrt(1.0 + resistance))


@below_yield.of(DryTurbulent)
def _(law: DryTurbulent, drive_x: float, drive_y: float, h: float, normal: float) -> bool:
    most = normal * (law.tangent * YIELD_TOLERANCE)
    return drive_x * drive_x + drive_y * drive_y <= most * most


@mean_drive.of(DryTurbulent, Inertial, Hysteretic)
def _(law: Uniform, back: float, forth: float, h_back: float, h_forth: float, h: float) -> float:
    return 0.5 * (back + forth)


@faces_below_yield.of(DryTurbulent)
def _(
    law: DryTurbulent,
    back: tuple[float, float],
    forth: tuple[float, float],
    h: float,
    behind: tuple[float, float],
    ahead: tuple[float, float],
    normal: float,
) -> bool:
    back_x, back_y = back
    forth_x, forth_y = forth
    mean_x, mean_y = 0.5 * (back_x + forth_x), 0.5 * (back_y + forth_y)
    # what holds is the same at all faces, so that the steeper of two decides
    steep_x = back_x if abs(back_x) > abs(forth_x) else forth_x
    steep_y = back_y if abs(back_y) > abs(forth_y) else forth_y
    rests = below_yield(law, steep_x, mean_y, h, normal)
    rests &= below_yield(law, mean_x, steep_y, h, normal)
    return rests


@raised_rate.of(DryTurbulent, Quadratic, BinghamProfile, Viscoplastic, Inertial)
def _(law: Uniform, rate: float, h: float, normal: float, dry: float) -> float:
    return rate


# Every other law.


@held_momentum.of(Quadratic, BinghamProfile, Viscoplastic, Inertial, Hysteretic)
def _(law: Uniform, h: float, load: float, pressure: float, time: float) -> float:
    return time * rest_stress(law, h, load, pressure)


@slowed.of(Quadratic, BinghamProfile, Viscoplastic, Inertial)
def _(
    law: Uniform, u: float, v: float, h: float, load: float, pressure: float, time: float
) -> tuple[float, float]:
    # without a branch; what has stopped, and may be dry, has no share, and is given a speed and a depth
    speed, depth = math.sqrt(u * u + v * v), h if h > 0.0 else 1.0
    moves = speed > 0.0
    share = share_left(law, speed if moves else 1.0, depth, load, pressure, time)
    return u * share if moves else u, v * share if moves else v


@slowed.of(Hysteretic)
def _(
    law: Uniform, u: float, v: float, h: float, load: float, pressure: float, time: float
) -> tuple[float, float]:
    speed = math.sqrt(u * u + v * v)
    if speed > 0.0:
        share = share_left(law, speed, h, load, pressure, time)
        u, v = u * share, v * share
    return u, v


@below_yield.of(Quadratic, BinghamProfile, Viscoplastic, Inertial, Hysteretic)
def _(law: Uniform, drive_x: float, drive_y: float, h: float, normal: float) -> bool:
    # compared as stresses, since depth may be 0
    most = rest_stress(law, h, h, normal) * YIELD_TOLERANCE
    return (drive_x * drive_x + drive_y * drive_y) * (h * h) <= most * most


@mean_drive.of(Quadratic, BinghamProfile, Viscoplastic)
def _(law: Uniform, back: float, forth: float, h_back: float, h_forth: float, h: float) -> float:
    # a thin cell beside a deep one: half of what presses on the face between stands in the deep one
    around = 0.5 * (h_back + h_forth)
    depth = h if h > around else around
    return 0.5 * (back * h_back + forth * h_forth) / (depth if depth > 0.0 else 1.0)


def resistance_at_rest(law: Uniform, h: Array, normal: Array) -> Array:
    """Give R(0, h), m s-2, of depths h (n,) above 0, m, and of g cos(xi) (n,), m s-2."""
    found = np.empty(len(h))
    _fill_resistance(law, h, normal, found)
    return found


@kernel(from_python=True)
def _fill_resistance(law: Uniform, h: Array, normal: Array, found: Array) -> None:
    for i in range(len(h)):
        found[i] = rest_stress(law, h[i], h[i], normal[i]) / h[i]


@faces_below_yield.of(Quadratic, BinghamProfile, Viscoplastic, Inertial, Hysteretic)
def _(
    law: Uniform,
    back: tuple[float, float],
    forth: tuple[float, float],
    h: float,
    behind: tuple[float, float],
    ahead: tuple[float, float],
    normal: float,
) -> bool:
    back_x, back_y = back
    forth_x, forth_y = forth
    west, south = 0.5 * (h + behind[0]), 0.5 * (h + behind[1])
    east, north = 0.5 * (h + ahead[0]), 0.5 * (h + ahead[1])
    mean_x = mean_drive(law, back_x, forth_x, west, east, h)
    mean_y = mean_drive(law, back_y, forth_y, south, north, h)
    rests = below_yield(law, back_x, mean_y, west, normal)
    rests &= below_yield(law, forth_x, mean_y, east, normal)
    rests &= below_yield(law, mean_x, back_y, south, normal)
    rests &= below_yield(law, mean_x, forth_y, north, normal)
    return rests


@rest_stress.of(Quadratic)
def _(law: Quadratic, h: float, load: float, pressure: float) -> float:
    cohesion = law.cohesion if law.cohesion > 0.0 else 1.0
    most = (1.0 - law.tangent) * law.cohesion
    held = law.tangent * pressure * load - most * exponential_less_1(-pressure * load / cohesion)
    return float(held + law.yield_stress * loaded(h, load))


@resistance.of(Quadratic)
def _(law: Quadratic, speed: float, h: float, pressure: float) -> float:
    drag = law.drag + law.rough * inverse_cube_root(h)
    return float((rest_stress(law, h, h, pressure) + speed * (law.viscous / h + speed * drag)) / h)


@share_left.of(Quadratic)
def _(law: Quadratic, speed: float, h: float, load: float, pressure: float, time: float) -> float:
    drag = law.drag + law.rough * inverse_cube_root(h)
    linear = 1.0 + time * law.viscous / (h * h)
    return 2.0 / (linear + math.sqrt(linear * linear + 4.0 * (time * drag / h) * speed))
