"""SSP Runge-Kutta steps (eq. 14; Shu & Osher 1988) of adaptive length, and why a run stops."""

from __future__ import annotations

import math
from typing import Any, NamedTuple

from solver.arrays import Array, Indices
from solver.compiled import kernel

# Eq. 14: weights of each stage's result in U = U_0 + part (U_k - U_0 + dt L(U_k)).
SSP_RK3 = (1.0, 1 / 4, 2 / 3)
REACHED, AT_REST, OUT_OF_STEPS, NOT_FINITE, COLLAPSED, GROW, OUT_OF_TIME = range(7)
# A rate, s-1, whose square is a number still.
FASTEST = 1e150
# What the parts of a step return that does not stop the run.
CONTINUE = -1


class Limits(NamedTuple):
    """Until when a run goes on, and how fast.

    Attributes
    ----------
    target
        Time to stop at, s.
    max_steps
        Most time steps.
    shortest
        A step below it counts as collapsed, s.
    cfl
        Courant number.
    rest_volume
        A run is at rest where at most this much moves, m3.
    arrival_depth
        Depth above which a cell counts as reached, m.
    """

    target: float
    max_steps: int
    shortest: float
    cfl: float
    rest_volume: float
    arrival_depth: float


class Progress(NamedTuple):
    """What a run has used, arrays of shape (1,) or (2,) changed in place.

    Attributes
    ----------
    time
        Time reached, s.
    steps, cell_stages
        Time steps taken, and cells updated, summed over stages.
    place
        Row, column of a failure.
    ledger
        Volumes in and out of each side, shape (2, 4, 2), m3: sums, and what rounding has taken from them.
    """

    time: Array
    steps: Indices
    cell_stages: Indices
    ledger: Array
    place: Indices


@kernel(inline=True)
def added(total: float, lost: float, amount: float) -> tuple[float, float]:
    """Add an amount to a sum that keeps what rounding takes from it.

    However many amounts there are, ``total + lost`` is right to round-off (Neumaier 1974).
    """
    whole = total + amount
    if abs(total) >= abs(amount):
        return whole, lost + ((total - whole) + amount)
    return whole, lost + ((amount - whole) + total)


@kernel()
def step_length(rate: float, cfl: float, remaining: float, shortest: float) -> float:
    """Length of the next step, s, by the largest wave rate (s-1); 0 where it would be below ``shortest``.

    The last two steps before a target are of equal length, so that no sliver of a step is left.

    Parameters
    ----------
    rate : float
        Largest wave rate, s-1; 0 where nothing flows.
    cfl : float
        Courant number.
    remaining : float
        Time to the target, s.
    shortest : float
        Least length, s.
    """
    dt = cfl / rate if rate > 0.0 else remaining
    if dt < shortest:
        return 0.0
    if dt >= remaining:
        return remaining
    return 0.5 * remaining if 2.0 * dt > remaining else dt


@kernel(inline=True)
def raised_by_fall(rate: float, carried: float, falling: float) -> float:
    """Wave rate of a cell, s-1, raised where gravity speeds the flow up within a step.

    Later stages move a cell with the velocity u + a dt of the end of the step, and an even layer gives away
    the part dt (u + a dt)/dx of what it has. A film, which has next to no waves, would give more than it has
    where u dt = cfl dx alone bounds the step: what it cannot give is faster without having fallen. Of
    ``dt (u + a dt) <= cfl dx`` this is the rate cfl/dt.

    Parameters
    ----------
    rate : float
        Wave rate, s-1.
    carried : float
        The same without waves, ``|u|/dx + |v|/dy``, s-1.
    falling : float
        ``sqrt(cfl a/dx)``, s-1: what it is from rest, by `solver.run.falling_rate`.
    """
    # what is faster than that has no square, and gravity has no part in its step
    carried = carried if carried < FASTEST else FASTEST
    fallen = 0.5 * (carried + math.sqrt(carried * carried + 4.0 * falling * falling))
    return fallen if fallen > rate else rate


@kernel(inline=True)
def weight_of_start(part: float) -> float:
    """Weight of the state at the start of a step in what a stage can give away, where its own state has one.

    The stage ends with ``part`` times ``U_1 + start_weight U_0``, less what has left (`can_give`).
    """
    return 1.0 / part - 1.0


@kernel(inline=True)
def can_give(h: float, begun: float, start_weight: float) -> float:
    """Depth that a cell can give away in a stage, m, by that in this stage and at the start of the step."""
    return h + start_weight * begun


@kernel()
def share_of_step(parts: tuple[float, ...], k: int) -> float:
    """Weight of the k-th stage's fluxes in the whole step."""
    share = 1.0
    for n in range(k, len(parts)):
        share *= parts[n]
    return share


@kernel(inline=True)
def less_moving(
    left: float, moves: bool, static: float, amount: float, u: float, v: float
) -> tuple[float, bool]:
    """Take what a cell holds off a volume, unless it is static; say whether a cell so far has a velocity.

    A run is not at rest where the volume becomes negative and a cell moves. Once it has started, one has to:
    what a step leaves all at rest is left so by the next, even where a single face is above yield.

    Parameters
    ----------
    left : float
        What is left of the volume, m3 or m.
    moves : bool
        Whether a cell before has a velocity.
    static : float
        Status of the cell.
    amount : float
        What the cell holds, in the unit of ``left``.
    u, v : float
        Velocity of the cell, m s-1.
    """
    if static != 0.0:
        return left, moves
    return left - amount, moves | (u != 0.0) | (v != 0.0)


@kernel(as_source=True, cached=False)
def march(
    arrays: Any, begin_step: Any, take_step: Any, end_step: Any, limits: Limits, progress: Progress
) -> int:
    """Step until a target time or until the run is at rest; return why it stopped.

    It is compiled into what calls it, once for each form, with the kernels that it is given.

    Parameters
    ----------
    arrays : named tuple
        What these kernels read and write.
    begin_step : kernel
        Called with arrays, limits and progress. Returns why the run stops before the step, or CONTINUE; the
        largest wave rate, s-1; and what the step is to know.
    take_step : kernel
        Called with arrays, that, the time step (s), and progress; it takes all stages.
    end_step : kernel
        Called with arrays, limits and progress. Returns why the run stops after the step, or CONTINUE.
    """
    while progress.time[0] < limits.target:
        # before anything is touched, so that the run can go on from here as if it had not stopped
        if progress.steps[0] >= limits.max_steps:
            return OUT_OF_STEPS
        outcome, rate, known = begin_step(arrays, limits, progress)
        if outcome != CONTINUE:
            return int(outcome)
        remaining = limits.target - progress.time[0]
        dt = step_length(rate, limits.cfl, remaining, limits.shortest)
        if dt == 0.0:
            return COLLAPSED
        take_step(arrays, known, dt, progress)
        progress.time[0] = limits.target if dt == remaining else progress.time[0] + dt
        progress.steps[0] += 1
        outcome = end_step(arrays, limits, progress)
        if outcome != CONTINUE:
            return int(outcome)
    return REACHED
