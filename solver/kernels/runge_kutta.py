"""SSP Runge-Kutta steps (eq. 14) of adaptive length, and why a run stops."""

from __future__ import annotations

from typing import NamedTuple

from solver.arrays import Array, Indices
from solver.compiled import kernel

# Eq. 14: weights of each stage's result in U = U_0 + part (U_k - U_0 + dt L(U_k)).
SSP_RK3 = (1.0, 1 / 4, 2 / 3)
REACHED, AT_REST, OUT_OF_STEPS, NOT_FINITE, COLLAPSED, GROW, OUT_OF_TIME = range(7)


class Progress(NamedTuple):
    """What a run has used, arrays of shape (1,) or (2,) changed in place.

    time : s. steps, cell_stages : counts. place : row, column of a failure. ledger : volumes in and out
    of each side, shape (4, 2), m3.
    """

    time: Array
    steps: Indices
    cell_stages: Indices
    ledger: Array
    place: Indices


@kernel()
def step_length(rate: float, cfl: float, remaining: float, shortest: float) -> float:
    """Length of the next step, s, by the largest wave rate (s-1); 0 where it would be below ``shortest``.

    The last two steps before a target are of equal length, so that no sliver of a step is left.
    """
    dt = cfl / rate if rate > 0.0 else remaining
    if dt < shortest:
        return 0.0
    if dt >= remaining:
        return remaining
    return 0.5 * remaining if 2.0 * dt > remaining else dt


@kernel()
def share_of_step(parts: tuple[float, ...], k: int) -> float:
    """Weight of the k-th stage's fluxes in the whole step."""
    share = 1.0
    for n in range(k, len(parts)):
        share *= parts[n]
    return share
