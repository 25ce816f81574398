"""LMLS slopes on a cloud, and the state at both sides of faces, as on a lattice but in any direction."""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np

from solver.arrays import Array, Numbers
from solver.cloud.faces import Faces, normal_beyond, own_normals, whole_blocks
from solver.compiled import kernel
from solver.kernels.earth_pressure import lean_of
from solver.kernels.flow_axes import normal_pressure, sheared
from solver.kernels.limiter import (
    AHEAD,
    at_rear,
    face_state,
    largest_step,
    lead,
    least_shown,
    limited,
    rear_step,
    steepness_of,
)
from solver.kernels.state import BELOW_YIELD, DEPTH, Fields, Sides, Status
from solver.lmls.shape_functions import Approximation

# Neighbours taken at a time: their sums stay in registers.
GROUP = 4
# What has less than this share of the depth of a cell is a film beside it.
FILM = 0.1
# A cell may be faster than all around it by this share of its speed, beside 2 c, before it has one velocity.
LEADING = 0.01
# What the cell itself counts for in the difference of both sides, as part of all weights, is none below it.
LOPSIDED = 1e-9


class Gradient(NamedTuple):
    """LMLS derivative weights of the differences to neighbours, each (s, cells); s is a multiple of GROUP.

    Attributes
    ----------
    neighbours
        Numbers of cells.
    along, across
        Weights, m-1.
    cosine, sine
        By which velocities of the neighbours are turned into the frame of the cell, on a surface.
    """

    neighbours: Numbers
    along: Array
    across: Array
    cosine: Array | None = None
    sine: Array | None = None


class Strain(NamedTuple):
    """Weights of the differences of velocity to the neighbours of `Gradient`, each (s, cells), m-1.

    Attributes
    ----------
    along, across
        Of the derivatives by the other cells of a support, whatever the value at the cell itself.
    bent_along, bent_across
        Of half the difference between the derivatives ahead of a cell and behind it; they give 0 of what is
        linear.
    """

    along: Array
    across: Array
    bent_along: Array
    bent_across: Array


def laid_out(given: Array, cells: int) -> Array:
    """Lay out a table (n, support) for kernels, (s, cells): without the cell itself, filled up by zeros."""
    n, support = given.shape
    laid = np.zeros((-(-(support - 1) // GROUP) * GROUP, cells))
    laid[: support - 1, :n] = given[:, 1:].T
    return laid


def gradient_of(slope: Approximation) -> Gradient:
    """Lay out the derivatives of an approximation at cells, each the first of its own support."""
    n, support = slope.neighbours.shape
    cells = whole_blocks(n)
    along, across = (laid_out(weights, cells) for weights in (slope.along, slope.across))
    neighbours = np.tile(np.arange(cells), (len(along), 1))
    if support > 1:
        # what fills up is a neighbour without weight: among the fastest the cell itself would count
        neighbours[:, :n] = slope.neighbours[:, 1]
    neighbours[: support - 1, :n] = slope.neighbours[:, 1:].T
    return Gradient(neighbours.astype(np.uint32), along, across)


def strain_of(slope: Approximation, places: Array) -> Strain:
    """Lay out the weights that tell how a cell is strained.

    What a cell counts for in its own derivatives is given to the others by their shape functions, whose first
    moment is zero: linear fields keep their derivatives, and a cell that moves alone has none. Half the
    difference between both sides is the derivative with the weights behind the cell turned round, less what
    that makes of linear fields. Where the two sides are so uneven that it is none, it is left out.

    Parameters
    ----------
    slope : Approximation
        At cells, each the first of its own support.
    places : (n, 2) array
        Centroids, m.
    """
    others = slope.value.copy()
    others[:, 0] = 0.0
    others /= others.sum(axis=1, keepdims=True)
    way = places[slope.neighbours] - places[:, None]
    along, across = (d + d[:, :1] * others for d in (slope.along, slope.across))
    along[:, 0] = across[:, 0] = 0.0
    bent = []
    for k, weights in enumerate((along, across)):
        sided = np.sign(way[:, :, k]) * weights
        of_linear = np.einsum("is,isk->ik", sided, way)
        half = sided - of_linear[:, :1] * along - of_linear[:, 1:] * across
        # a velocity of the cell's own alone has to be extension on one side and shortening on the other
        own, most = (a.sum(axis=1, keepdims=True) for a in (half, np.abs(half)))
        bent.append(np.where(own > LOPSIDED * most, half, 0.0))
    cells = whole_blocks(len(places))
    return Strain(*(laid_out(weights, cells) for weights in (along, across, *bent)))


@kernel(inline=True)
def turned(
    cosine: Array | None, sine: Array | None, m: int, i: int, u: float, v: float
) -> tuple[float, float]:
    """Turn a velocity of the m-th neighbour of cell i into the frame of the cell."""
    if cosine is None:
        return u, v
    c, s = cosine[m, i], sine[m, i]  # type: ignore[index]
    return c * u - s * v, s * u + c * v


@kernel(unaliased=True)
def slopes_at(now: Fields, gradient: Gradient, start: int, stop: int, dry: float, out: Array) -> None:
    """LMLS derivatives of depth and velocity at a run of cells; a dry neighbour has no velocity to differ by.

    Parameters
    ----------
    now : Fields
        Means over the cells.
    start, stop : int
        The cells.
    dry : float
        Depth up to which a cell counts as dry, m.
    out : (9, cells) array
        The first six rows are filled with h_x, h_y, u_x, u_y (s-1), v_x, v_y (s-1), the last one with the
        speed of a cell times what the fastest wet neighbour has more of it along the way of the cell, m2 s-2;
        minus infinity where all are dry.
    """
    h, u, v = now
    for group in range(0, len(gradient.neighbours), GROUP):
        for k in range(start, stop):
            i = np.uint64(k)
            h_i, u_i, v_i = h[i], u[i], v[i]
            # loaded before they are chosen from: a branch would keep the loop from vectorising
            h_x, h_y, u_x, u_y, v_x, v_y = out[0, i], out[1, i], out[2, i], out[3, i], out[4, i], out[5, i]
            fastest = out[8, i]
            if group == 0:
                h_x = h_y = u_x = u_y = v_x = v_y = 0.0
                fastest = -math.inf
            for m in range(GROUP):
                m_ = np.uint64(group) + np.uint64(m)
                j = np.uint64(gradient.neighbours[m_, i])
                a, b, h_j = gradient.along[m_, i], gradient.across[m_, i], h[j]
                step = h_j - h_i
                h_x += a * step
                h_y += b * step
                wet = 1.0 if h_j > dry else 0.0
                u_j, v_j = turned(gradient.cosine, gradient.sine, m_, i, u[j], v[j])
                step, t_step = wet * (u_j - u_i), wet * (v_j - v_i)
                u_x += a * step
                u_y += b * step
                v_x += a * t_step
                v_y += b * t_step
                more = u_i * step + v_i * t_step if h_j > dry else -math.inf
                fastest = fastest if fastest > more else more
            out[0, i], out[1, i], out[2, i], out[3, i] = h_x, h_y, u_x, u_y
            out[4, i], out[5, i], out[8, i] = v_x, v_y, fastest


@kernel(unaliased=True)
def find_most_slower(now: Fields, normal: Array, start: int, stop: int, slopes: Array) -> None:
    """Find by how much slower than its mean a cell may be at a face, as it is told by all around it.

    A face bounds what it is shown by one difference at a time, and what lies behind the cell is read off a
    lopsided gradient. A cell that is slower at the faces that it leaves by, while hardly anything comes that
    is faster, leaves by its slow part in each step, and what stays is ever faster. So its steps are bounded
    by twice what the fastest around it is faster, as on a lattice, where that is what lies behind. Beside
    that it may be slower by 2 c and LEADING of its speed, by which velocities on a curved bed differ, and by
    the square of these over the lead where it is faster than all around it by more.

    Parameters
    ----------
    now : Fields
        Means over the cells.
    normal : (cells,) array
        Gravity normal to the bed, m s-2.
    start, stop : int
        The cells.
    slopes : (9, cells) array
        As `slopes_at` fills it; the last row is filled with the bound times the speed of the cell, m2 s-2.
    """
    h, u, v = now
    for k in range(start, stop):
        i = np.uint64(k)
        more, u_i, v_i = slopes[8, i], u[i], v[i]
        square = u_i * u_i + v_i * v_i
        sent = (4.0 * normal[i] * h[i] + LEADING * LEADING * square) * square
        most = math.sqrt(sent)
        slopes[8, i] = most + 2.0 * more if more > 0.0 else (sent / -more if -more > most else most)


@kernel(unaliased=True)
def strain_at(
    now: Fields, neighbours: Numbers, strain: Strain, start: int, stop: int, dry: float, slopes: Array
) -> None:
    """Rates of stretching along and across a run of cells, as `stretching` has them, s-1.

    A dry neighbour has no velocity to differ by. By the slopes of `slopes_at` a cell that moves alone would
    extend or shorten by which way its support is lopsided.

    Parameters
    ----------
    now, start, stop, dry
        As in `slopes_at`.
    neighbours
        Of `Gradient`.
    slopes : (9, cells) array
        The first two rows are read, as `slopes_at` fills them, and rows 6 and 7 filled.
    """
    h, u, v = now
    for group in range(0, len(neighbours), GROUP):
        for k in range(start, stop):
            i = np.uint64(k)
            u_i, v_i, u_x, v_y = u[i], v[i], slopes[6, i], slopes[7, i]
            lean_x, lean_y = lean_of(slopes[0, i]), lean_of(slopes[1, i])
            if group == 0:
                u_x = v_y = 0.0
            for m in range(GROUP):
                m_ = np.uint64(group) + np.uint64(m)
                j = np.uint64(neighbours[m_, i])
                a = strain.along[m_, i] + lean_x * strain.bent_along[m_, i]
                b = strain.across[m_, i] + lean_y * strain.bent_across[m_, i]
                wet = 1.0 if h[j] > dry else 0.0
                u_x += a * (wet * (u[j] - u_i))
                v_y += b * (wet * (v[j] - v_i))
            slopes[6, i], slopes[7, i] = u_x, v_y


@kernel()
def flatten_fed(slopes: Array, faces: Faces, sides: Sides, start: int, stop: int) -> None:
    """Take the slopes of velocity out of cells beside some boundary faces, where these have a given depth.

    What comes in there has the velocity of the cell. If it left the cell slower, the cell would gain speed
    from nothing, and feed it to itself.

    Parameters
    ----------
    slopes : (9, cells) array
        As `slopes_at` and `strain_at` fill it.
    start, stop : int
        Numbers of the boundary faces.
    """
    for b in range(start, stop):
        if sides.kind[faces.side[b]] == DEPTH:
            slopes[2:8, int(faces.left[faces.outer + b])] = 0.0


@kernel(inline=True)
def step_to_face(gap: float, ahead: float, part: float, steepness: float) -> float:
    """Limited step from a cell's mean toward the cell beyond a face, to where the face stands.

    With ``2 gap - ahead`` for the difference to the cell behind it is `steps_to_faces` of the lattice.

    Parameters
    ----------
    gap, ahead : float
        Difference to the cell beyond by the gradient, and the true one.
    part : float
        Part of the way to the cell beyond.
    steepness : float
        As of `solver.kernels.limiter.largest_step`.
    """
    most = largest_step(2.0 * gap - ahead, ahead, steepness)
    step: float = limited(part * abs(gap + AHEAD * (ahead - gap)), most, ahead)
    return step


@kernel(inline=True)
def state_at_face(
    cell: tuple[float, float, float],
    beyond: tuple[float, float, float],
    gap: tuple[float, float, float],
    off: tuple[float, float, float],
    most_slower: float,
    part: float,
    sign: float,
    beta: float,
    wave: float,
    dry: float,
) -> tuple[float, float, float]:
    """Depth, normal and tangential velocity that a cell has at the midpoint of a face.

    Along the way to the cell beyond, it is the reconstruction on a lattice, with its limiter and its rule at
    fronts. What is behind the cell is read off the gradient, and has the cell's own beta. The rest of the
    way, to the midpoint, follows the gradient.

    Parameters
    ----------
    cell, beyond : tuple
        Mean depth (m), normal and tangential velocity (m s-1) of the cell and of the cell beyond.
    gap, off : tuple
        What the gradients make of the way to the cell beyond, and of the rest.
    most_slower : float
        Bound of what it is slower at the face, times its speed, from `find_most_slower`, m2 s-2.
    part : float
        Part of the way to the cell beyond at which the face stands.
    sign : float
        1 if the normal points to the cell beyond, -1 if it points back.
    beta : float
        g cos(xi) K of the cell along the normal (eq. 7), m s-2.
    wave : float
        Speed of waves in the cell along the normal, m s-1.
    dry : float
        Depth up to which a cell counts as dry, m.
    """
    h, n, t = cell
    h_beyond, n_beyond, t_beyond = beyond
    h_behind = h_beyond - 2.0 * gap[0]
    ahead, t_ahead = n_beyond if h_beyond > dry else n, t_beyond if h_beyond > dry else t
    n_behind = ahead - 2.0 * gap[1]
    steepness = steepness_of(sign * (n_behind if h_behind > dry else n), sign * ahead, False)
    n_step = step_to_face(gap[1], ahead - n, part, steepness) + off[1]
    t_step = step_to_face(gap[2], t_ahead - t, part, 2.0) + off[2]
    slower = -(n * n_step + t * t_step)
    share = (most_slower + 1e-300) / (slower + 1e-300) if slower > most_slower else 1.0
    depth_at_face = h + step_to_face(gap[0], h_beyond - h, part, steepness) + off[0]
    depth_at_face = depth_at_face if depth_at_face < 2.0 * h else 2.0 * h
    rear = at_rear(h, h_behind, h_beyond, sign * n, steepness)
    depth_at_face = h + rear_step(h, h_beyond, part) if rear else depth_at_face
    at_face = depth_at_face, share * n_step, share * t_step
    behind = h_behind, n_behind, beta * h_behind
    least = least_shown(h, n, lead(n, n_behind, sign), beta * h_behind)
    depth, normal, tangential = face_state(cell, at_face, h_beyond, behind, least, sign, dry)
    # what moves away from a face sends waves to it and no more: a film beyond would be fed with its own
    # velocity, which a gradient reads off it
    sent = sign * n + 2.0 * wave
    sent = sent if sent > 0.0 else 0.0
    turned = (sign * n < 0.0) & (sign * normal > sent) & (h_beyond < FILM * h)
    return depth, sign * sent if turned else normal, tangential


@kernel(unaliased=True)
def face_states(
    now: Fields,
    slopes: Array,
    status: Status,
    left: Numbers,
    right: Numbers,
    geometry: Array,
    far: Array | None,
    start: int,
    count: int,
    dry: float,
    h_low: Array,
    n_low: Array,
    t_low: Array,
    c_low: Array,
    h_high: Array,
    n_high: Array,
    t_high: Array,
    c_high: Array,
    static: Array,
    push: Array,
) -> None:
    """Reconstruct both sides of a run of faces.

    What reads or writes many arrays takes them one by one: to hand over a tuple costs for every array in it.

    Parameters
    ----------
    left, right, geometry, far
        Of `solver.cloud.faces.Faces`.
    start, count : int
        First face, and number of faces.
    h_low, n_low, t_low, c_low, h_high, n_high, t_high, c_high : (chunk,) arrays
        Filled with depth, normal and tangential velocity of the cells on the left at the faces, and
        their wave speed, then with those of the cells on the right.
    static : (2 chunk,) array
        Filled with the status of the cells on the left, then on the right.
    push : (4, chunk) array
        Filled with length times normal times beta, x and y, of the left cell and of the right one, m2 s-2; 0
        for a cell below yield.
    """
    h, u, v = now
    g = geometry
    chunk = np.uint64(len(static) // 2)
    for k in range(count):
        k_ = np.uint64(k)
        f = np.uint64(start) + k_
        i, j = np.uint64(left[f]), np.uint64(right[f])
        n_x, n_y, d_x, d_y, part, shift = g[0, f], g[1, f], g[2, f], g[3, f], g[4, f], g[5, f]
        o_x, o_y = -shift * d_y, shift * d_x
        h_i, h_j, u_i, u_j, v_i, v_j = h[i], h[j], u[i], u[j], v[i], v[j]
        m_x, m_y = normal_beyond(far, f, n_x, n_y)
        n_i, n_j = n_x * u_i + n_y * v_i, m_x * u_j + m_y * v_j
        t_i, t_j = n_x * v_i - n_y * u_i, m_x * v_j - m_y * u_j
        n_xi, n_yi = n_x * slopes[2, i] + n_y * slopes[4, i], n_x * slopes[3, i] + n_y * slopes[5, i]
        t_xi, t_yi = n_x * slopes[4, i] - n_y * slopes[2, i], n_x * slopes[5, i] - n_y * slopes[3, i]
        b_xi, b_yi, b_xj, b_yj = status.beta_x[i], status.beta_y[i], status.beta_x[j], status.beta_y[j]
        b_i = normal_pressure(status.beta_xy, i, b_xi, b_yi, n_x, n_y)
        b_j = normal_pressure(status.beta_xy, j, b_xj, b_yj, m_x, m_y)
        c_i, c_j = math.sqrt(b_i * h_i), math.sqrt(b_j * h_j)
        one, two = (h_i, n_i, t_i), (h_j, n_j, t_j)
        h_low[k_], n_low[k_], t_low[k_] = state_at_face(
            one,
            two,
            (slopes[0, i] * d_x + slopes[1, i] * d_y, n_xi * d_x + n_yi * d_y, t_xi * d_x + t_yi * d_y),
            (slopes[0, i] * o_x + slopes[1, i] * o_y, n_xi * o_x + n_yi * o_y, t_xi * o_x + t_yi * o_y),
            slopes[8, i],
            part,
            1.0,
            b_i,
            c_i,
            dry,
        )
        n_xj, n_yj = m_x * slopes[2, j] + m_y * slopes[4, j], m_x * slopes[3, j] + m_y * slopes[5, j]
        t_xj, t_yj = m_x * slopes[4, j] - m_y * slopes[2, j], m_x * slopes[5, j] - m_y * slopes[3, j]
        h_high[k_], n_high[k_], t_high[k_] = state_at_face(
            two,
            one,
            (-slopes[0, j] * d_x - slopes[1, j] * d_y, -n_xj * d_x - n_yj * d_y, -t_xj * d_x - t_yj * d_y),
            (slopes[0, j] * o_x + slopes[1, j] * o_y, n_xj * o_x + n_yj * o_y, t_xj * o_x + t_yj * o_y),
            slopes[8, j],
            1.0 - part,
            -1.0,
            b_j,
            c_j,
            dry,
        )
        c_low[k_], c_high[k_] = c_i, c_j
        s_i, s_j = status.static[i], status.static[j]
        static[k_], static[chunk + k_] = s_i, s_j
        own_i, own_j = own_normals(far, f, n_x, n_y)
        l_x, l_y, r_x, r_y = g[6, f] * own_i[0], g[6, f] * own_i[1], g[6, f] * own_j[0], g[6, f] * own_j[1]
        free_i, free_j = 0.0 if s_i == BELOW_YIELD else 1.0, 0.0 if s_j == BELOW_YIELD else 1.0
        x_i, y_i = sheared(status.beta_xy, i, l_x, l_y)
        x_j, y_j = sheared(status.beta_xy, j, r_x, r_y)
        push[0, k_], push[1, k_] = free_i * (b_xi * l_x + x_i), free_i * (b_yi * l_y + y_i)
        push[2, k_], push[3, k_] = free_j * (b_xj * r_x + x_j), free_j * (b_yj * r_y + y_j)
