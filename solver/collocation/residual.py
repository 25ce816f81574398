"""The collocation form of the paper (eqs. 12-23): what LMLS derivatives at a point make of its state."""

from __future__ import annotations

import math

import numpy as np

from solver.arrays import Array, Indices
from solver.collocation.arrays import Images, Momenta, Open, Scratch
from solver.collocation.operators import Stencils
from solver.compiled import ONE, kernel
from solver.kernels.boundary import account
from solver.kernels.earth_pressure import earth_pressure, wave_speed
from solver.kernels.friction import law_at
from solver.kernels.source_terms import update_cell
from solver.kernels.state import CloudBed, Fields, Material


@kernel()
def mirrored(along: float, across: float, k: int, images: Images) -> tuple[float, float]:
    """Turn both components of a velocity or momentum as the k-th image has them."""
    a = abs(along) if images.outward[k, 0] else along
    b = abs(across) if images.outward[k, 1] else across
    return images.sign[k, 0] * a, images.sign[k, 1] * b


@kernel()
def fill_images(h: Array, along: Array, across: Array, images: Images) -> None:
    """Set depth and velocity, or momentum, of the images, which stand behind those of the points."""
    n = len(h) - len(images.sign)
    for k in range(len(images.sign)):
        g, i = n + k, images.owner[n + k]
        h[g] = h[i]
        along[g], across[g] = mirrored(along[i], across[i], k, images)


@kernel()
def choose(
    h: Array,
    dry: float,
    count: int,
    stencils: Stencils,
    images: Images,
    mark: Indices,
    chosen: Indices,
) -> int:
    """List the points that have in their support a depth above ``dry`` or below its negative.

    Parameters
    ----------
    count
        Points listed before in this step, which stay; with 0 the list is made anew. Returns the new one.
    mark
        1 for what is listed, 2 where what it reaches is listed too.
    """
    if count == 0:
        mark[:] = 0
        for i in range(len(chosen)):
            if abs(h[i]) > dry:
                mark[i], chosen[count] = 1, i
                count += 1
    for c in range(count):
        i = chosen[c]
        if mark[i] == 2 or abs(h[i]) <= dry:
            continue
        mark[i] = 2
        for p in range(stencils.first[i], stencils.first[i + 1]):
            j = images.owner[stencils.partners[p]]
            if mark[j] == 0:
                mark[j], chosen[count] = 1, j
                count += 1
    return count


@kernel()
def derivatives(now: Fields, chosen: Indices, stencils: Stencils, gains: Array) -> None:
    """Set what eqs. 12-13 need of the chosen points, in one pass over their supports (eq. 23).

    Two sums run side by side, so that one does not wait for the other's last addition.

    Parameters
    ----------
    gains
        (n, 5), filled with the divergence of ``h u`` (m s-1), of the fluxes of momentum along and across (m2
        s-2), and with the gradient of h (dimensionless).
    """
    h, u, v = now
    near, weights, own = stencils.neighbours, stencils.gradient, np.uint64(stencils.own)
    x, y, size = np.uint64(0), np.uint64(1), near.shape[1]
    for c in range(len(chosen)):
        i = np.uint64(chosen[c])
        row = i * own
        mass = along = across = h_x = h_y = 0.0
        mass_ = along_ = across_ = h_x_ = h_y_ = 0.0
        for s in range(0, size - 1, 2):
            s_, t_ = np.uint64(s), np.uint64(s + 1)
            j, k = np.uint64(near[i, s_]), np.uint64(near[i, t_])
            part = h[j] * (weights[row, s_, x] * u[j] + weights[row, s_, y] * v[j])
            part_ = h[k] * (weights[row, t_, x] * u[k] + weights[row, t_, y] * v[k])
            h_x, h_x_ = h_x + weights[row, s_, x] * h[j], h_x_ + weights[row, t_, x] * h[k]
            h_y, h_y_ = h_y + weights[row, s_, y] * h[j], h_y_ + weights[row, t_, y] * h[k]
            mass, mass_ = mass + part, mass_ + part_
            along, along_ = along + part * u[j], along_ + part_ * u[k]
            across, across_ = across + part * v[j], across_ + part_ * v[k]
        if size % 2:
            s_ = np.uint64(size - 1)
            j = np.uint64(near[i, s_])
            part = h[j] * (weights[row, s_, x] * u[j] + weights[row, s_, y] * v[j])
            h_x, h_y = h_x + weights[row, s_, x] * h[j], h_y + weights[row, s_, y] * h[j]
            mass, along, across = mass + part, along + part * u[j], across + part * v[j]
        gains[i, 0], gains[i, 1], gains[i, 2] = mass + mass_, along + along_, across + across_
        gains[i, 3], gains[i, 4] = h_x + h_x_, h_y + h_y_


@kernel()
def set_pressure(
    now: Fields, chosen: Indices, stencils: Stencils, bed: CloudBed, material: Material, beta: Array
) -> float:
    """Set beta (n, 2) of the chosen points by their LMLS velocity gradient (eqs. 7, 10, 11).

    A dry neighbour has no velocity and makes no gradient. Returns the largest of
    ``(|u| + c_x) sum |D_x| + (|v| + c_y) sum |D_y|``, D the derivative weights, s-1, c with the waves of the
    state.
    """
    h, u, v = now
    near, weights, own = stencils.neighbours, stencils.gradient, np.uint64(stencils.own)
    fastest = 0.0
    for c in range(len(chosen)):
        i = np.uint64(chosen[c])
        row = i * own
        u_x = v_y = h_x = h_y = 0.0
        if h[i] > material.dry:
            for s in range(near.shape[1]):
                s_ = np.uint64(s)
                j = np.uint64(near[i, s_])
                wet = 1.0 if h[j] > material.dry else 0.0
                u_x += wet * weights[row, s_, np.uint64(0)] * (u[j] - u[i])
                v_y += wet * weights[row, s_, np.uint64(1)] * (v[j] - v[i])
                h_x += weights[row, s_, np.uint64(0)] * h[j]
                h_y += weights[row, s_, np.uint64(1)] * h[j]
        normal, depth = bed.normal[i], max(h[i], 0.0)
        decrease = material.transition[1] * math.sqrt(depth / normal) if h[i] > material.dry else 0.0
        b_x, b_y, wave_x, wave_y = earth_pressure(u_x, v_y, decrease, normal, abs(h_x), abs(h_y), material)
        beta[i, 0], beta[i, 1] = b_x, b_y
        if h[i] > material.dry:
            rate = (abs(u[i]) + wave_speed(wave_x, b_x, h[i])) * stencils.reach[row, 0]
            rate += (abs(v[i]) + wave_speed(wave_y, b_y, h[i])) * stencils.reach[row, 1]
            fastest = max(fastest, rate, bed.falling[i])
    return fastest


@kernel()
def update(
    now: Fields,
    chosen: Indices,
    bed: CloudBed,
    material: Material,
    part: float,
    dt: float,
    scratch: Scratch,
) -> None:
    """Update the chosen points, as `solver.kernels.source_terms.update_cell` does one.

    A negative depth neither slides nor presses. The result, depth and momentum, is put into ``scratch.q``.
    """
    start, q, gains, beta = scratch.start, scratch.q, scratch.gains, scratch.beta
    for c in range(len(chosen)):
        i = np.uint64(chosen[c])
        load = max(now.h[i], 0.0)
        h, u, v = update_cell(
            (start.h[i], start.u[i], start.v[i]),
            (now.h[i], now.u[i], now.v[i]),
            (-gains[i, 0], -gains[i, 1], -gains[i, 2]),
            (load * (bed.along[i] - beta[i, 0] * gains[i, 3]), -load * beta[i, 1] * gains[i, 4]),
            (bed.normal[i], bed.curvature[i]),
            load,
            part,
            dt,
            law_at(material.law, i),
            -math.inf,
            material.dry,
        )
        q.h[i], q.hu[i], q.hv[i] = h, h * u, h * v


@kernel()
def velocities(
    q: Momenta, chosen: Indices, stencils: Stencils, dry: float, film: float, around: int, now: Fields
) -> None:
    """Set depth and velocity of the chosen points from their momenta.

    In a film, up to ``film`` (m) deep, momentum divided by depth is noise: it takes the mean velocity of the
    ``around`` nearest points, weighted by depth. What is dry has neither velocity nor momentum.
    """
    h = q.h
    for c in range(len(chosen)):
        i = np.uint64(chosen[c])
        hu, hv, depth = q.hu[i], q.hv[i], h[i]
        now.h[i] = h[i]
        if h[i] <= dry:
            q.hu[i] = q.hv[i] = now.u[i] = now.v[i] = 0.0
            continue
        if h[i] < film:
            hu = hv = depth = 0.0
            for s in range(around):
                j = np.uint64(stencils.neighbours[i, np.uint64(s)])
                if h[j] > dry:
                    hu, hv, depth = hu + q.hu[j], hv + q.hv[j], depth + h[j]
        now.u[i], now.v[i] = hu / depth, hv / depth


@kernel()
def account_open(now: Fields, sides: Open, duration: float, ledger: Array) -> None:
    """Add to the ledger (2, 4, 2), m3, what open sides let out within a duration, s.

    The sum over pairs of ``weight . (q_i + q_j)``; on a lattice the weight is ``V_i D_ij``.
    """
    before, rate = -ONE, 0.0
    for k in range(len(sides.point)):
        i, j, side = sides.point[k], sides.image[k], sides.side[k]
        if side != before:
            if before >= 0:
                account(rate * duration, before, ledger)
            before, rate = side, 0.0
        rate += sides.weight[k, 0] * (now.h[j] * now.u[j] + now.h[i] * now.u[i])
        rate += sides.weight[k, 1] * (now.h[j] * now.v[j] + now.h[i] * now.v[i])
    if before >= 0:
        account(rate * duration, before, ledger)
