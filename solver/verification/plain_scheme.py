"""A plain scheme to hold the solver's errors and times against: MUSCL-HLL, SSP RK3, on a frictionless plane.

It is what textbooks put together, and no more. Depth and both velocities are linear in a cell, limited by the
monotonised central limiter (van Leer 1977). Fluxes are those of Harten, Lax & van Leer (1983) with speeds
toward dry sides as in Toro (2001); momentum along a face goes with the mass. Steps are those of Shu & Osher
(1988). There is no front rule, no friction and no rest, and a mirror image is computed too. A rectangle
around what is wet is stepped row by row, in loops that are compiled as the solver's are.
"""

from __future__ import annotations

import math
from time import thread_time
from typing import NamedTuple

import numpy as np

from solver.arrays import Array
from solver.compiled import kernel
from solver.physics.earth_pressure import Isotropic
from solver.physics.friction import Coulomb
from solver.physics.terrain import Plane
from solver.points.lattice import Lattice
from solver.scene import Scene

# Of a step: the share of a cell that a wave crosses in either direction. Depth stays positive below one half.
COURANT = 0.45
# What is no deeper has no velocity, m.
WET = 1e-6
# Rows and columns of zeros around the lattice, and how far what is wet spreads in a step: a cell a stage.
GHOSTS, SPREAD = 2, 3
Extent = tuple[int, int, int, int]


class PlainRun(NamedTuple):
    """What a run came to, and what it took.

    Attributes
    ----------
    depth, momentum_x, momentum_y
        Cell means of h (m), h u and h v (m2 s-1), of the shape of the lattice.
    steps, cell_stages : int
        Time steps, and cells updated, summed over stages.
    cpu_time : float
        Thread CPU seconds of the time loop.
    """

    depth: Array
    momentum_x: Array
    momentum_y: Array
    steps: int
    cell_stages: int
    cpu_time: float


class _State(NamedTuple):
    """Depth (m) and both momenta (m2 s-1), flat arrays of the lattice with its ghosts."""

    h: Array
    p: Array
    q: Array


class _Fluxes(NamedTuple):
    """Through the faces of a row: mass (m2 s-1), momentum across and along the face (m3 s-2)."""

    mass: Array
    across: Array
    along: Array


class _Plane(NamedTuple):
    """Rows and row length with ghosts, spacings (m), gravity across and along the bed (m s-2)."""

    rows: int
    stride: int
    dx: float
    dy: float
    presses: float
    pulls: float


@kernel(inline=True)
def _half_step(behind: float, ahead: float) -> float:
    """Step from a cell's mean to its face ahead, from the differences to both neighbours."""
    one, two = abs(behind), abs(ahead)
    least, centred = one if one < two else two, 0.25 * (one + two)
    step = centred if centred < least else least
    return math.copysign(step if math.copysign(ahead, behind) == ahead else 0.0, ahead)


@kernel(unaliased=True)
def _fluxes(
    h: Array, n: Array, t: Array, at: int, step: int, count: int, presses: float, out: _Fluxes
) -> None:
    """Fluxes through ``count`` faces, the first between the cells ``at`` and ``at + step``.

    ``n`` and ``t`` are velocities across the faces and along them, m s-1.
    """
    for k in range(count):
        o = np.uint64(k)
        i = np.uint64(at) + o
        b, a, c = i - np.uint64(step), i + np.uint64(step), i + np.uint64(2 * step)
        h_i, h_a, n_i, n_a, t_i, t_a = h[i], h[a], n[i], n[a], t[i], t[a]
        h_d, n_d, t_d = h_a - h_i, n_a - n_i, t_a - t_i
        low, high = h_i + _half_step(h_i - h[b], h_d), h_a - _half_step(h_d, h[c] - h_a)
        low, high = low if low > 0.0 else 0.0, high if high > 0.0 else 0.0
        n_low, n_high = n_i + _half_step(n_i - n[b], n_d), n_a - _half_step(n_d, n[c] - n_a)
        t_low, t_high = t_i + _half_step(t_i - t[b], t_d), t_a - _half_step(t_d, t[c] - t_a)
        c_low, c_high = math.sqrt(presses * low), math.sqrt(presses * high)
        one, two = n_low - c_low if low > 0.0 else n_high - 2.0 * c_high, n_high - c_high
        slow = one if one < two else two
        slow = slow if slow < 0.0 else 0.0
        one, two = n_high + c_high if high > 0.0 else n_low + 2.0 * c_low, n_low + c_low
        fast = one if one > two else two
        fast = fast if fast > 0.0 else 0.0
        per = 1.0 / (fast - slow + 1e-300)
        low_n, high_n = low * n_low, high * n_high
        mass = (fast * low_n - slow * high_n + fast * slow * (high - low)) * per
        low_pushes = low_n * n_low + 0.5 * presses * low * low
        high_pushes = high_n * n_high + 0.5 * presses * high * high
        out.mass[o] = mass
        out.across[o] = (fast * low_pushes - slow * high_pushes + fast * slow * (high_n - low_n)) * per
        out.along[o] = mass * (t_low if mass > 0.0 else t_high)


@kernel(unaliased=True)
def _velocities(state: _State, u: Array, v: Array, at: int, count: int, plane: _Plane) -> float:
    """Velocities of a row (m s-1), and the largest share of a cell that a wave crosses in a second."""
    per_x, per_y, most = 1.0 / plane.dx, 1.0 / plane.dy, 0.0
    for k in range(count):
        i = np.uint64(at) + np.uint64(k)
        depth = state.h[i]
        inverse = 1.0 / (depth if depth > WET else 1.0) if depth > WET else 0.0
        here, beside = state.p[i] * inverse, state.q[i] * inverse
        u[i], v[i] = here, beside
        wave = math.sqrt(plane.presses * (depth if depth > 0.0 else 0.0))
        one, two = (abs(here) + wave) * per_x, (abs(beside) + wave) * per_y
        rate = one if one > two else two
        most = rate if rate > most else most
    return most


@kernel()
def _all_velocities(state: _State, u: Array, v: Array, extent: Extent, plane: _Plane) -> float:
    bottom, top, left, right = extent
    most = 0.0
    for row in range(bottom - GHOSTS, top + GHOSTS):
        at, count = row * plane.stride + left - GHOSTS, right - left + 2 * GHOSTS
        rate = _velocities(state, u, v, at, count, plane)
        most = rate if rate > most else most
    return most


@kernel(unaliased=True)
def _update(
    start: _State,
    before: _State,
    after: _State,
    at: int,
    count: int,
    sides: _Fluxes,
    below: _Fluxes,
    above: _Fluxes,
    share: float,
    dt: float,
    plane: _Plane,
) -> None:
    """``U_k = U_0 + b_k (U_(k-1) - U_0 + dt L(U_(k-1)))`` of a row (docs/method.md, 13)."""
    x, y, pull = dt / plane.dx, dt / plane.dy, dt * plane.pulls
    for k in range(count):
        o = np.uint64(k)
        i, n = np.uint64(at) + o, o + np.uint64(1)
        h, h_0, p_0, q_0 = before.h[i], start.h[i], start.p[i], start.q[i]
        more_h = x * (sides.mass[o] - sides.mass[n]) + y * (below.mass[o] - above.mass[o])
        more_p = x * (sides.across[o] - sides.across[n]) + y * (below.along[o] - above.along[o]) + pull * h
        more_q = x * (sides.along[o] - sides.along[n]) + y * (below.across[o] - above.across[o])
        depth = h_0 + share * (h - h_0 + more_h)
        after.h[i] = depth
        after.p[i] = p_0 + share * (before.p[i] - p_0 + more_p) if depth > WET else 0.0
        after.q[i] = q_0 + share * (before.q[i] - q_0 + more_q) if depth > WET else 0.0


@kernel()
def _stage(
    start: _State,
    before: _State,
    after: _State,
    u: Array,
    v: Array,
    extent: Extent,
    share: float,
    dt: float,
    plane: _Plane,
    buffers: tuple[_Fluxes, _Fluxes, _Fluxes],
) -> None:
    bottom, top, left, right = extent
    sides, below, above = buffers
    count, stride = right - left, plane.stride
    _fluxes(before.h, v, u, (bottom - 1) * stride + left, stride, count, plane.presses, below)
    for row in range(bottom, top):
        at = row * stride + left
        _fluxes(before.h, u, v, at - 1, 1, count + 1, plane.presses, sides)
        _fluxes(before.h, v, u, at, stride, count, plane.presses, above)
        _update(start, before, after, at, count, sides, below, above, share, dt, plane)
        below, above = above, below


@kernel()
def _extent(h: Array, plane: _Plane, former: Extent) -> Extent:
    """First and last row and column, these excluded, that a step changes: beside all that is wet.

    Nothing is wet outside a former extent. It never narrows, as what lies outside is not kept up to date.
    """
    bottom, top, left, right = former
    low, high, first, last = plane.rows, -1, plane.stride, -1
    for row in range(bottom, top):
        for column in range(left, right):
            if h[row * plane.stride + column] > 0.0:
                low, high = row if row < low else low, row
                first, last = column if column < first else first, column if column > last else last
    return (
        max(low - SPREAD, GHOSTS),
        min(high + 1 + SPREAD, plane.rows - GHOSTS),
        max(first - SPREAD, GHOSTS),
        min(last + 1 + SPREAD, plane.stride - GHOSTS),
    )


@kernel(from_python=True)
def _march(
    states: tuple[_State, _State, _State],
    u: Array,
    v: Array,
    time: float,
    plane: _Plane,
    buffers: tuple[_Fluxes, _Fluxes, _Fluxes],
) -> tuple[int, int]:
    """Go to a time (s); gives steps and cell-stages. Odd numbers of steps end in the second state."""
    state, one, two = states
    now, steps, cell_stages = 0.0, 0, 0
    extent = GHOSTS, plane.rows - GHOSTS, GHOSTS, plane.stride - GHOSTS
    while now < time:
        extent = _extent(state.h, plane, extent)
        dt = COURANT / _all_velocities(state, u, v, extent, plane)
        dt, now = (dt, now + dt) if now + dt < time else (time - now, time)
        _stage(state, state, one, u, v, extent, 1.0, dt, plane, buffers)
        _all_velocities(one, u, v, extent, plane)
        _stage(state, one, two, u, v, extent, 0.25, dt, plane, buffers)
        _all_velocities(two, u, v, extent, plane)
        _stage(state, two, one, u, v, extent, 2.0 / 3.0, dt, plane, buffers)
        state, one = one, state
        bottom, top, left, right = extent
        steps, cell_stages = steps + 1, cell_stages + 3 * (top - bottom) * (right - left)
    return steps, cell_stages


def plain_run(scene: Scene, time: float) -> PlainRun:
    """Run a scene to a time, s: a release at rest on a lattice on a frictionless plane, K = 1.

    Nothing enters at the sides, and what leaves is lost.

    Raises
    ------
    ValueError
        If the scene is another one.
    """
    points, bed, law = scene.points, scene.terrain, scene.friction
    plain = law == Coulomb(0.0) and isinstance(scene.earth_pressure, Isotropic)
    still = not scene.velocity_x.any() and not scene.velocity_y.any()
    if not (plain and still and isinstance(points, Lattice) and isinstance(bed, Plane)):
        raise ValueError("the plain scheme is for a release at rest on a frictionless plane, K = 1")
    padded = np.pad(scene.depth, GHOSTS)
    rows, stride = padded.shape
    states = tuple(_State(*(np.zeros(padded.size) for _ in range(3))) for _ in range(3))
    states[0].h[:] = padded.ravel()
    u, v = np.zeros(padded.size), np.zeros(padded.size)
    buffers = tuple(_Fluxes(*(np.zeros(stride) for _ in range(3))) for _ in range(3))
    slope = math.radians(bed.angle)
    gravity = scene.gravity * math.cos(slope), scene.gravity * math.sin(slope)
    plane = _Plane(rows, stride, points.dx, points.dy, *gravity)
    began = thread_time()
    steps, cell_stages = _march(states, u, v, float(time), plane, buffers)
    cpu_time = thread_time() - began
    inside = np.s_[GHOSTS:-GHOSTS, GHOSTS:-GHOSTS]
    h, p, q = (values.reshape(padded.shape)[inside] for values in states[steps % 2])
    return PlainRun(h, p, q, steps, cell_stages, cpu_time)
