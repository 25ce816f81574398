"""The selective relaxation of eqs. 24 and 25, as printed and as an exchange between pairs of points."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from solver.cloud_activity import CloudBed
from solver.collocation_operators import Stencils
from solver.collocation_residual import Images, Momenta, Scratch, fill_images, fold_marks, spread_marks
from solver.compiled import Array, Indices, kernel


class Relaxation(NamedTuple):
    """How the state is relaxed after each stage.

    omega : of eq. 25, 0 for none. threshold : of eq. 24. floor : least depth that eq. 24 divides by, m.
    pairs : 1 to exchange between pairs, 0 for eq. 25 as printed. momentum : 1 to relax momentum too. clip : 1
    to set negative depths to zero afterwards.
    """

    omega: float
    threshold: float
    floor: float
    pairs: int
    momentum: int
    clip: int


@kernel()
def lmls_value(values: Array, i: int, stencils: Stencils) -> float:
    """LMLS value at point i (eq. 23)."""
    i_ = np.uint64(i)
    row, total = i_ * np.uint64(stencils.own), 0.0
    for s in range(stencils.neighbours.shape[1]):
        s_ = np.uint64(s)
        total += stencils.value[row, s_] * values[np.uint64(stencils.neighbours[i_, s_])]
    return total


@kernel()
def flag_rough(
    q: Momenta, chosen: Indices, stencils: Stencils, images: Images, how: Relaxation, scratch: Scratch
) -> None:
    """Flag points whose depth is off its LMLS value (eq. 24), and mark those that exchange with them.

    The value is put into ``scratch.smoothed.h``.
    """
    flag, mark = scratch.flag, scratch.mark
    n = len(flag) - len(images.source)
    flag[:n] = 0
    mark[:] = 0
    for c in range(len(chosen)):
        i = chosen[c]
        value = lmls_value(q.h, i, stencils)
        scratch.smoothed.h[i] = value
        if abs(q.h[i] - value) > how.threshold * max(abs(value), how.floor):
            flag[i] = mark[i] = 1
            spread_marks(mark, i, stencils)
    for k in range(len(images.source)):
        flag[n + k] = flag[images.source[k]]
    fold_marks(mark, images)


@kernel()
def exchange(
    q: Momenta,
    chosen: Indices,
    coordinates: Array,
    stencils: Stencils,
    bed: CloudBed,
    dry: float,
    how: Relaxation,
    scratch: Scratch,
) -> None:
    """Relax by what pairs of points exchange if one of them is flagged; put the result into `smoothed`.

    ``U_i += omega sum_j c_ij (U_j - U_i)`` with ``V_i c_ij = V_j c_ji``: volume moves, none is made. A
    negative c_ij steepens; it is left out where one of a pair is dry, and where both close faster than waves
    travel between them, in a shock: there it would make depths negative and drive what is shallow.
    """
    out, own = scratch.smoothed, stencils.own
    for c in range(len(chosen)):
        i = np.uint64(chosen[c])
        h, hu, hv = q.h[i], q.hu[i], q.hv[i]
        more = more_u = more_v = 0.0
        if scratch.mark[i]:
            first = stencils.first[i]
            offset = np.uint64(first if own == 0 else 0)
            flagged = scratch.flag[i]
            for p in range(first, stencils.first[i + np.uint64(1)]):
                p_ = np.uint64(p)
                j = np.uint64(stencils.partners[p_])
                if not (flagged or scratch.flag[j]):
                    continue
                size, h_j = stencils.exchange[p_ - offset], q.h[j]
                if size < 0.0:
                    if h <= dry or h_j <= dry:
                        continue
                    x, y = coordinates[j, 0] - coordinates[i, 0], coordinates[j, 1] - coordinates[i, 1]
                    closing = (q.hu[j] / h_j - hu / h) * x + (q.hv[j] / h_j - hv / h) * y
                    waves = 0.5 * (bed.normal[i] * h + bed.normal[j] * h_j) * (x * x + y * y)
                    if closing < 0.0 and closing * closing > waves:
                        continue
                more += size * (h_j - h)
                more_u += size * (q.hu[j] - hu)
                more_v += size * (q.hv[j] - hv)
        out.h[i] = h + how.omega * more
        out.hu[i], out.hv[i] = hu + how.omega * more_u, hv + how.omega * more_v


@kernel()
def replace(q: Momenta, chosen: Indices, stencils: Stencils, how: Relaxation, scratch: Scratch) -> None:
    """Relax flagged points toward their LMLS value (eq. 25); put the result into `smoothed`."""
    out, omega = scratch.smoothed, how.omega
    for c in range(len(chosen)):
        i = chosen[c]
        h, hu, hv = q.h[i], q.hu[i], q.hv[i]
        if scratch.flag[i]:
            h = omega * out.h[i] + (1.0 - omega) * h
            hu = omega * lmls_value(q.hu, i, stencils) + (1.0 - omega) * hu
            hv = omega * lmls_value(q.hv, i, stencils) + (1.0 - omega) * hv
        out.h[i], out.hu[i], out.hv[i] = h, hu, hv


@kernel()
def relax(
    q: Momenta,
    chosen: Indices,
    coordinates: Array,
    stencils: Stencils,
    images: Images,
    bed: CloudBed,
    dry: float,
    how: Relaxation,
    scratch: Scratch,
) -> None:
    """Relax depth, and momentum if it is to be, of the chosen points; images follow."""
    smoothed = scratch.smoothed
    if how.omega > 0.0:
        fill_images(q.h, q.hu, q.hv, images)
        flag_rough(q, chosen, stencils, images, how, scratch)
        if how.pairs:
            exchange(q, chosen, coordinates, stencils, bed, dry, how, scratch)
        else:
            replace(q, chosen, stencils, how, scratch)
        for c in range(len(chosen)):
            i = chosen[c]
            q.h[i] = smoothed.h[i]
            if how.momentum:
                q.hu[i], q.hv[i] = smoothed.hu[i], smoothed.hv[i]
    if how.clip:
        for c in range(len(chosen)):
            i = chosen[c]
            q.h[i] = max(q.h[i], 0.0)
    fill_images(q.h, q.hu, q.hv, images)
