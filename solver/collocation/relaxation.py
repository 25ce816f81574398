"""The selective relaxation of eqs. 24 and 25, as printed and as an exchange between pairs of points."""

from __future__ import annotations

import numpy as np

from solver.arrays import Array, Indices
from solver.collocation.arrays import CollocationArrays, Momenta, Relaxation
from solver.collocation.operators import Stencils
from solver.collocation.residual import fill_images, mirrored
from solver.compiled import kernel
from solver.kernels.state import CloudBed


@kernel()
def lmls_value(values: Array, i: int, stencils: Stencils) -> float:
    """LMLS value at point i (eq. 23), from three sums side by side."""
    i_ = np.uint64(i)
    row, size = i_ * np.uint64(stencils.own), stencils.neighbours.shape[1]
    total = second = third = 0.0
    for s in range(0, size - 2, 3):
        a, b, c = np.uint64(s), np.uint64(s + 1), np.uint64(s + 2)
        total += stencils.value[row, a] * values[np.uint64(stencils.neighbours[i_, a])]
        second += stencils.value[row, b] * values[np.uint64(stencils.neighbours[i_, b])]
        third += stencils.value[row, c] * values[np.uint64(stencils.neighbours[i_, c])]
    for s in range(size - size % 3, size):
        a = np.uint64(s)
        total += stencils.value[row, a] * values[np.uint64(stencils.neighbours[i_, a])]
    return total + second + third


@kernel()
def flag_rough(
    q: Momenta, chosen: Indices, stencils: Stencils, how: Relaxation, flag: Indices, value: Array
) -> None:
    """Flag points whose depth is off its LMLS value (eq. 24); put that value into ``value``."""
    flag[:] = 0
    for c in range(len(chosen)):
        i = chosen[c]
        value[i] = lmls_value(q.h, i, stencils)
        if abs(q.h[i] - value[i]) > how.threshold * max(abs(value[i]), how.floor):
            flag[i] = 1


@kernel()
def steepens_shock(q: Momenta, i: int, j: int, coordinates: Array, bed: CloudBed, dry: float) -> bool:
    """Whether one of a pair is dry, or both close faster than waves travel between them."""
    h, h_j = q.h[i], q.h[j]
    if h <= dry or h_j <= dry:
        return True
    x, y = coordinates[j, 0] - coordinates[i, 0], coordinates[j, 1] - coordinates[i, 1]
    closing = (q.hu[j] / h_j - q.hu[i] / h) * x + (q.hv[j] / h_j - q.hv[i] / h) * y
    waves = 0.5 * (bed.normal[i] * h + bed.normal[j] * h_j) * (x * x + y * y)
    in_shock: bool = closing < 0.0 and closing * closing > waves
    return in_shock


@kernel()
def exchange(arrays: CollocationArrays, count: int) -> int:
    """Relax by what pairs of points exchange if one of them is flagged.

    ``U_i += omega sum_j c_ij (U_j - U_i)`` with ``V_i c_ij = V_j c_ji``: volume moves, none is made. A
    negative c_ij steepens; it is left out where one of a pair is dry, and where both close in a shock: there
    it would make depths negative and drive what is shallow.

    Every pair is met at the flagged point of lower number. With the image of j, i exchanges what j does with
    the image of i. Returns the number of points chosen, with those that an exchange reached.
    """
    coordinates, area, stencils, images = arrays.coordinates, arrays.area, arrays.stencils, arrays.images
    scratch, bed, dry, omega = arrays.scratch, arrays.bed, arrays.material.dry, arrays.relaxation.omega
    q, change, flag, chosen = scratch.q, scratch.change, scratch.flag, scratch.chosen
    n, listed = len(chosen), count
    for c in range(count):
        i = chosen[c]
        change.h[i] = change.hu[i] = change.hv[i] = 0.0
    for c in range(listed):
        i = chosen[c]
        if flag[i] == 0:
            continue
        offset = 0 if stencils.own else stencils.first[i]
        for p in range(stencils.first[i], stencils.first[i + 1]):
            g = stencils.partners[p]
            j = images.owner[g]
            if flag[j] and j < i:
                continue
            size = stencils.exchange[p - offset]
            if size < 0.0 and steepens_shock(q, i, g, coordinates, bed, dry):
                continue
            size *= omega
            change.h[i] += size * (q.h[g] - q.h[i])
            change.hu[i] += size * (q.hu[g] - q.hu[i])
            change.hv[i] += size * (q.hv[g] - q.hv[i])
            if j == i:
                continue
            if scratch.mark[j] == 0:
                scratch.mark[j], chosen[count] = 1, j
                count += 1
                change.h[j] = change.hu[j] = change.hv[j] = 0.0
            size *= area[i] / area[j]
            hu, hv = (q.hu[i], q.hv[i]) if g < n else mirrored(q.hu[i], q.hv[i], g - n, images)
            change.h[j] += size * (q.h[i] - q.h[j])
            change.hu[j] += size * (hu - q.hu[j])
            change.hv[j] += size * (hv - q.hv[j])
    return count


@kernel()
def replace(
    q: Momenta, chosen: Indices, stencils: Stencils, omega: float, flag: Indices, change: Momenta
) -> None:
    """Relax flagged points toward their LMLS value (eq. 25), which ``change.h`` holds of depth."""
    for c in range(len(chosen)):
        i = chosen[c]
        change.h[i] = omega * (change.h[i] - q.h[i]) if flag[i] else 0.0
        change.hu[i] = omega * (lmls_value(q.hu, i, stencils) - q.hu[i]) if flag[i] else 0.0
        change.hv[i] = omega * (lmls_value(q.hv, i, stencils) - q.hv[i]) if flag[i] else 0.0


@kernel()
def relax(arrays: CollocationArrays, count: int) -> int:
    """Relax depth, and momentum if it is to be, of the chosen points; images follow. Returns their number."""
    how, scratch, images, stencils = arrays.relaxation, arrays.scratch, arrays.images, arrays.stencils
    q, change = scratch.q, scratch.change
    if how.omega > 0.0:
        fill_images(q.h, q.hu, q.hv, images)
        chosen = scratch.chosen[:count]
        flag_rough(q, chosen, stencils, how, scratch.flag, change.h)
        if how.pairs:
            count = exchange(arrays, count)
        else:
            replace(q, chosen, stencils, how.omega, scratch.flag, change)
        for c in range(count):
            i = scratch.chosen[c]
            q.h[i] += change.h[i]
            if how.momentum:
                q.hu[i] += change.hu[i]
                q.hv[i] += change.hv[i]
    if how.clip:
        for c in range(count):
            i = scratch.chosen[c]
            q.h[i] = max(q.h[i], 0.0)
    fill_images(q.h, q.hu, q.hv, images)
    return count
