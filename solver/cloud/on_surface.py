"""What a surface adds to the cells of a cloud, as parts of kernels; without one they cost nothing."""

from __future__ import annotations

from solver.arrays import Array
from solver.cloud.blocks import Activity
from solver.compiled import kernel
from solver.kernels.boundary import account
from solver.kernels.state import Fields, Lift


@kernel(inline=True)
def pull_across(lift: Lift | None, i: int) -> float:
    """Gravity along e2, m s-2; a slope profile has none along y."""
    if lift is None:
        return 0.0
    pull: float = lift.across[i]
    return pull


@kernel(inline=True)
def loading(
    lift: Lift | None, normal: float, curvature: float, i: int, u: float, v: float
) -> tuple[float, float]:
    """Give normal gravity (m s-2) and curvature (m-1) to `update_cell`; on a surface all is in the first."""
    if lift is None:
        return normal, curvature
    return normal + (curvature * (u * u) + lift.k_22[i] * (v * v) + 2.0 * lift.k_12[i] * (u * v)), 0.0


@kernel(inline=True)
def in_frame(lift: Lift | None, i: int, d_x: float, d_y: float) -> tuple[float, float]:
    """Turn derivatives in plan into those along the axes of cell i."""
    if lift is None:
        return d_x, d_y
    return lift.p[i] * d_x, lift.r[i] * d_x + lift.q[i] * d_y


@kernel(inline=True)
def way_in_frame(lift: Lift | None, i: int, x: float, y: float) -> tuple[float, float]:
    """Turn a way in plan into the way on the bed above it, along the axes of cell i, m."""
    if lift is None:
        return x, y
    b = y / lift.q[i]
    return (x - lift.r[i] * b) / lift.p[i], b


@kernel()
def empty_drains(
    lift: Lift | None, states: tuple[Fields, Fields, Fields], area: Array, activity: Activity, ledger: Array
) -> None:
    """Take what has come to cells where nothing is known of the surface into the ledger, m3.

    Parameters
    ----------
    states : tuple of Fields
        That of the run and those of its stages, which are equal.
    """
    if lift is not None:
        for r in range(activity.counts[0]):
            start, stop = activity.stepped_runs[r]
            empty(lift.drain, states, area, start, stop, ledger)


@kernel()
def empty(
    drain: Array,
    states: tuple[Fields, Fields, Fields],
    area: Array,
    start: int,
    stop: int,
    ledger: Array,
) -> None:
    """Do so in a run of cells.

    Parameters
    ----------
    drain
        Of `Lift`.
    """
    h = states[0].h
    for i in range(start, stop):
        if drain[i] > 0 and h[i] > 0.0:
            account(h[i] * area[i], drain[i] - 1, ledger)
            for state in states:
                state.h[i] = state.u[i] = state.v[i] = 0.0
