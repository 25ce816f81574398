"""The state that a cell has at a face: LMLS reconstruction, limiter and front rule.

The limiter is Koren's (1993): the third-order step, bounded here by once the difference to either neighbour.
Where the flow is being stopped, half the difference bounds it (minmod).
"""

from __future__ import annotations

import math

from solver.compiled import kernel
from solver.kernels.state import RETAINED, Fields

# The shape functions of eq. 23 at the far face of the middle of three cells, degree 2, from cell means.
BEHIND, MIDDLE, AHEAD = -1 / 6, 5 / 6, 1 / 3
# Nothing passes from a cell at the front into a dry one until it holds this share of the depth behind it.
FRONT = 0.45
# A cell that has this multiple of its mean depth at a face has next to nothing anywhere else.
ALL = 1.9
# Share of its depth that a cell has at least at a face that it moves to.
LEAST = 0.1
# Square of the share of its velocity by which a cell is not told from what lies behind it.
ALIKE = 1e-8
# A cell with at most this share of its depth behind it and this multiple ahead is at a rear (`at_rear`).
REAR_BEHIND, REAR_AHEAD = 0.5, 1.5
# It shows this multiple of its depth at most where it leaves: what empties it in a step.
REAR_MOST = 4.0
# A cell that would lose more than this share of what it has in a stage runs dry (`afforded`).
EMPTIED = 0.75
# What has no more than that, m or m3, gives nothing: what were left of it would be less than numbers hold. It
# is said to lose so many times what it has.
SMALLEST, TOO_MUCH = 1e-280, 1e300


@kernel(inline=True)
def largest_step(behind: float, ahead: float, steepness: float) -> float:
    """Size of the largest step from a cell's mean to its value at a face that makes no new extremum.

    It is the same at both faces, and 0 where the cell is an extremum.

    Parameters
    ----------
    behind, ahead : float
        Differences from the neighbour behind and to the one ahead.
    steepness : float
        Largest multiple of half a neighbour's difference: 2 stays between neighbours, 1 is minmod.
    """
    one, two = abs(behind), abs(ahead)
    most = 0.5 * steepness * (one if one < two else two)
    # by the signs: a product would underflow
    return most if math.copysign(ahead, behind) == ahead else 0.0


@kernel(inline=True)
def limited(wanted: float, most: float, ahead: float) -> float:
    """Limit the step from a cell's mean to its value at a face.

    Parameters
    ----------
    wanted : float
        Size of the step without a limit.
    most : float
        From `largest_step`.
    ahead : float
        Difference to the neighbour beyond the face, whose sign the step has.
    """
    return math.copysign(wanted if wanted < most else most, ahead)


@kernel(inline=True)
def at_rear(h: float, behind: float, ahead: float, n: float, steepness: float) -> bool:
    """Whether a cell is where a flow ends behind, and moves away from there.

    There depth is next to linear from the edge on, which stands within the cell or the one behind it. The
    limiter would show once the difference to the cell behind at most, and a cell that is full in part only
    would keep what leaves it in truth: the rear of a flow would be drawn out to a tail. The value on the line
    to the cell ahead is of second order (`rear_step`).

    Parameters
    ----------
    h, behind, ahead : float
        Depth of the cell, of what is behind it, and of what it moves to, m.
    n : float
        Its velocity toward the latter, m s-1.
    steepness : float
        From `steepness_of`: what is being stopped runs into what is ahead.
    """
    edge = (behind <= REAR_BEHIND * h) & (ahead > REAR_AHEAD * h)
    return edge & (n > 0.0) & (steepness > 1.0)


@kernel(inline=True)
def rear_step(h: float, ahead: float, part: float) -> float:
    """Step of depth at a rear to a part of the way to the cell ahead, m, as of `at_rear`."""
    step, most = part * (ahead - h), (REAR_MOST - 1.0) * h
    return step if step < most else most


@kernel(inline=True)
def slips(n: float, behind: tuple[float, float], ahead: tuple[float, float]) -> bool:
    """Whether a cell moves between two that rest.

    Parameters
    ----------
    n : float
        Its normal velocity, m s-1.
    behind, ahead : tuple
        Normal and tangential velocity of the neighbours, m s-1; of a dry one those of the cell.
    """
    around = (abs(behind[0]) + abs(ahead[0])) + (abs(behind[1]) + abs(ahead[1]))
    return (around == 0.0) & (n != 0.0)


@kernel(inline=True)
def steepness_of(behind: float, ahead: float, slips: bool) -> float:
    """Steepness for depth and normal velocity: 1 where the flow is being stopped, else 2.

    It is where it loses at least half its speed from one neighbour to the other: a steeper limiter rings at a
    granular shock, and friction turns the ringing into a wrong shock speed. A cell that slips between two at
    rest is stopped too. It would show where it moves to no more than what rests there, which gave back all
    that it brings.

    Parameters
    ----------
    behind, ahead : float
        Normal velocities of the neighbours, m s-1.
    slips : bool
        From `slips`.
    """
    slower = min(abs(ahead), abs(behind))
    return 1.0 if slips | (slower < behind - ahead) else 2.0


@kernel(inline=True)
def lead(n: float, n_behind: float, sign: float) -> float:
    """Square of what a cell is faster by than what lies behind it, m2 s-2; 0 where it is slower."""
    more = sign * (n - n_behind)
    more = more if more > 0.0 else 0.0
    return more * more


@kernel(inline=True)
def least_shown(h: float, n: float, more: float, wave: float) -> float:
    """Depth that a cell has at least at a face that it moves to, m.

    What is faster than what lies behind it by more than 2 c has come off it, and the slope of depth between
    them is of no flow. The farther it has, the nearer to its mean is what it has there, and it drains as fast
    as it moves. Below a steep heap at rest it would have none, and fall without going anywhere. What is as
    fast as the one behind it to some 1e-4 has not: cells that a side feeds alike differ by round-off.

    Parameters
    ----------
    h, n : float
        Mean depth (m) and normal velocity (m s-1) of the cell.
    more : float
        From `lead`.
    wave : float
        Squared wave speed behind it, m2 s-2; below 0 where a gradient says that nothing is there.
    """
    sent = 4.0 * wave
    share = (more - (sent if sent > 0.0 else 0.0)) / (more + ALIKE * n * n + 1e-300)
    return h * (share if share > LEAST else LEAST)


@kernel(inline=True)
def face_state(
    cell: tuple[float, float, float],
    at_face: tuple[float, float, float],
    h_beyond: float,
    behind: tuple[float, float, float],
    least: float,
    sign: float,
    dry: float,
) -> tuple[float, float, float]:
    """Bound the reconstruction of a cell at a face, and apply the rule at fronts.

    A velocity is the mean over the mass of a cell. Of one that has twice its mean depth at a face, all is
    there, and leaves with this mean: if it left slower, the rest, ever thinner, would be ever faster. Where a
    cell moves to it has LEAST of its depth at least, and up to all of it where it has come off what lies
    behind (`least_shown`).

    A cell beside a dry one has no depth at the face between before it holds the share FRONT of what lies
    behind: a front would run ahead as a film otherwise. What lies behind has to follow, and the cell may be
    faster than it by no more than a front is, 2 c: what has come off a heap at rest would stay for ever
    otherwise, and fall without going anywhere.

    Parameters
    ----------
    cell : tuple
        Mean depth (m), normal and tangential velocity (m s-1).
    at_face : tuple
        The same as reconstructed at the face, velocities as steps from the mean.
    h_beyond : float
        Depth of the cell beyond the face, m.
    behind : tuple
        Depth (m), normal velocity (m s-1) and squared wave speed (m2 s-2) behind the cell.
    least : float
        From `least_shown`, m; it counts where the cell moves to the face.
    sign : float
        1 if the normal points out of the cell, -1 if it points into it.
    dry : float
        Depth up to which a cell counts as dry, m.
    """
    h, n, t = cell
    depth, n_step, t_step = at_face
    h_behind, n_behind, wave = behind
    # a front follows what is behind it, at most as fast as that can send it
    led = (sign * n <= 0.0) | ((sign * n_behind > 0.0) & (lead(n, n_behind, sign) <= 4.0 * wave))
    least = least if sign * n > 0.0 else 0.0
    depth = depth if depth > least else least
    hidden = (h_beyond <= dry) & (h < FRONT * h_behind) & led
    # what is all at the face that it leaves through leaves with the velocity of all
    all_there = (depth > ALL * h) & (sign * (n + n_step) > 0.0)
    return 0.0 if hidden else depth, n if all_there else n + n_step, t if all_there else t + t_step


@kernel(inline=True)
def mean_velocity(start: Fields, now: Fields, start_weight: float, cell: int) -> tuple[float, float]:
    """Velocity of all that a cell can give in a stage, m s-1."""
    had, kept = now.h[cell], start_weight * start.h[cell]
    over = 1.0 / (had + kept + 1e-300)
    u, v = had * now.u[cell] + kept * start.u[cell], had * now.v[cell] + kept * start.v[cell]
    return over * u, over * v


@kernel(inline=True)
def afforded(flux: tuple[float, float, float], lost: float, n: float, t: float) -> tuple[float, float, float]:
    """Flux out of a cell that it can afford: the positivity limiter, for momentum too.

    What leaves is as fast as the cell's mean, but for what the rest can make up for: the rest keeps between
    none and twice its velocity. If all but a little left faster, as it would where the flow is faster ahead,
    that little would be thrown the other way.

    Parameters
    ----------
    flux : tuple
        Of mass and of normal and tangential momentum, out of the cell; that of mass is not 0.
    lost : float
        Share of what it has that the cell would lose in this stage through all faces.
    n, t : float
        Velocity of all that it has (`mean_velocity`), normal to the face and along it, m s-1.
    """
    mass, normal, tangential = flux
    if lost <= EMPTIED:
        return mass, normal, tangential
    if lost >= TOO_MUCH:
        return 0.0, 0.0, 0.0
    part = lost if lost < 1.0 - RETAINED else 1.0 - RETAINED
    more = (abs(n) + abs(t)) * (1.0 - part) / part
    normal, tangential = normal / mass, tangential / mass
    mass *= part / lost
    return mass, mass * min(max(normal, n - more), n + more), mass * min(max(tangential, t - more), t + more)
