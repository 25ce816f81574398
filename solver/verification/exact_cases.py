"""The exact cases as runs: a scene at a spacing, and its error against the closed form.

``python -m solver.verification.exact_cases`` prints the errors of all cases by spacing, with fitted orders.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal

import numpy as np

from solver.physics.constants import GRAVITY
from solver.points.lattice import Lattice
from solver.release.initial_state import initial_state
from solver.release.shapes import Box, Cylinder
from solver.result import Result
from solver.scene import Boundaries, Scheme
from solver.simulation import simulate
from solver.verification import exact_solutions as exact
from solver.verification.cases import (
    CONSERVATIVE,
    WALLED,
    cap,
    dam_break,
    measure,
    parabolic_cap,
    slide,
    stoker,
)

ROWS = 3
ColumnName = Literal["round", "plane"]
# Run-out over aspect ratio in experiments below an aspect ratio of 1 (Lube et al. 2004, 2005), with a sand of
# this angle, degrees; and shares of the column's height that may count as the edge of its deposit.
COLUMNS: dict[ColumnName, float] = {"round": 1.24, "plane": 1.2}
LOOSE_SAND, EDGES, ASPECTS = 31.0, (0.01, 0.03, 0.1), (0.2, 0.4, 0.8)


def row(bounds: tuple[float, float], spacing: float) -> Lattice:
    """Lattice for what does not vary across the bed: cells fill the bounds along x, a few rows across."""
    half = spacing / 2
    return Lattice((bounds[0] + half, bounds[1] - half), (0.0, (ROWS - 1) * spacing), spacing)


@dataclass(frozen=True)
class Shock:
    """What a granular shock left behind, at worst over the second half of its way.

    Parameters
    ----------
    offset : float
        Distance of the shock from the exact one, in spacings.
    behind : float
        Largest speed from four spacings behind it to half way to the start-up wave, as part of the
        arriving one.
    start_up : float
        The same with the wave that the first, sharp shock sends ahead of itself.
    precursor : float
        How far beyond the reach of the fastest signal a cell is not exactly at rest, in spacings.
    """

    spacing: float
    offset: float
    behind: float
    start_up: float
    precursor: float
    run: Result


def travelling_shock(spacing: float, scheme: Scheme = CONSERVATIVE, distance: float = 10.0) -> Shock:
    """Exact case 5: the shock on its way over a distance, m."""
    solution = exact.TravellingShock()
    duration = distance / abs(solution.speed)
    signal = np.sqrt(GRAVITY * np.cos(np.radians(solution.angle)) * solution.downstream)
    # nothing enters through the open side, so that the layer's rear must stay away from the shock
    upstream = distance + duration * (solution.arriving + 2 * signal)
    lattice = row((-np.ceil(upstream / spacing) * spacing, np.ceil(30 / spacing) * spacing), spacing)
    x = lattice.x_points
    arriving = x < 0
    start = slide(
        lattice,
        np.where(arriving, solution.upstream, solution.downstream),
        np.where(arriving, solution.arriving, 0.0),
        solution.angle,
        solution.angle,
        Boundaries("open", "wall", "wall", "wall"),
        scheme=scheme,
    )
    times = np.linspace(duration / 2, duration, 6)
    run = simulate(start, times)
    middle = (solution.upstream + solution.downstream) / 2
    worst = np.zeros(4)
    for time, h, u in zip(times, run.depth[:, 1], run.velocity_x[:, 1], strict=True):
        shock = solution.speed * time
        crossing = int(np.flatnonzero((h[1:] > middle) & (h[:-1] <= middle))[-1])
        found = x[crossing] + spacing * (middle - h[crossing]) / (h[crossing + 1] - h[crossing])
        passed = x > shock + 4 * spacing
        touched = x[(u != 0) | ((x > 0) & (h != solution.downstream))].max()
        this = (
            abs(found - shock) / spacing,
            np.abs(u[passed & (x < signal * time / 2)]).max(initial=0) / solution.arriving,
            np.abs(u[passed]).max() / solution.arriving,
            (touched - signal * time) / spacing,
        )
        worst = np.maximum(worst, this)
    offset, behind, start_up, precursor = (float(w) for w in worst)
    return Shock(spacing, offset, behind, start_up, precursor, run)


def column_collapse(aspect: float, kind: ColumnName, cells: int = 10) -> tuple[float, ...]:
    """Exact case 11: how far a column of a radius or half-width of 1 m runs out on flat ground.

    Parameters
    ----------
    aspect : float
        Height over radius or half-width.
    kind : str
        "round", or "plane" for one that does not vary across the bed.
    cells : int
        Spacings of the lattice in the height.

    Returns
    -------
    tuple of float
        Distance from the column to where the deposit is a share of its height deep, over ``aspect``, for each
        of ``EDGES``.
    """
    reach, spacing = 1.0 + 3.0 * aspect, aspect / cells
    lattice = (
        Lattice((-reach, reach), (-reach, reach), spacing)
        if kind == "round"
        else row((-reach, reach), spacing)
    )
    x, y = lattice.coordinates
    shape: Cylinder | Box = Cylinder((0.0, 0.0), 1.0, aspect)
    if kind == "plane":
        shape = Box((-1.0, 1.0), (-spacing, ROWS * spacing), aspect)
    laid = initial_state([shape], lattice)
    run = simulate(slide(lattice, laid.depth, laid.velocity_x, 0.0, LOOSE_SAND, WALLED), [1e3])
    away = np.hypot(x, y) if kind == "round" else np.abs(x)
    ends = (away[run.deposit_depth > share * aspect].max() for share in EDGES)
    return tuple(float((end + spacing / 2 - 1.0) / aspect) for end in ends)


# Each case with the spacings, m, at which its order is fitted.
FINE = (1.0, 0.5, 0.25)
CASES = {
    "frictionless cap": (cap(), (8.0, 4.0, 2.0)),
    "dam break 22/21": (dam_break(), FINE),
    "dam break 30/20": (dam_break(30.0, 20.0, (-60.0, 60.0), 3.0), FINE),
    "parabolic cap": (parabolic_cap(), FINE),
    "Ritter": (dam_break(0.0, 0.0, (-20.0, 30.0), 3.0), FINE),
    "Stoker": (stoker(), FINE),
}

SHOCK_SPACINGS = (0.4, 0.2, 0.1, 0.05)


def order(errors: list[float], spacings: tuple[float, ...]) -> float:
    """Slope of log error over log spacing, dimensionless."""
    return float(np.polyfit(np.log(spacings), np.log(errors), 1)[0])


def main() -> None:
    """Print a Markdown table of the errors of all cases."""
    print("| case | spacing, m | depth L2 | momentum L2 | depth L1 | volume error | steps |")
    print("|---|---|---|---|---|---|---|")
    for name, (case, spacings) in CASES.items():
        rows = [measure(case, case.lattice(spacing)) for spacing in spacings]
        for spacing, r in zip(spacings, rows, strict=True):
            print(
                f"| {name} | {spacing:g} | {r.depth:.2e} | {r.momentum:.2e} | {r.depth_l1:.2e} "
                f"| {r.run.ledger.error:.0e} | {r.run.steps} |"
            )
        fitted = [order([getattr(r, k) for r in rows], spacings) for k in ("depth", "momentum", "depth_l1")]
        print(f"| order | | {fitted[0]:.2f} | {fitted[1]:.2f} | {fitted[2]:.2f} | | |")
    print("\n| shock, spacing, m | offset, spacings | behind | start-up | precursor, spacings |")
    print("|---|---|---|---|---|")
    for spacing in SHOCK_SPACINGS:
        shock = travelling_shock(spacing)
        print(
            f"| {spacing:g} | {shock.offset:.3f} | {shock.behind:.1e} | {shock.start_up:.1e} "
            f"| {shock.precursor:.0f} |"
        )
    shown = " | ".join(f"edge at {100 * share:g} %" for share in EDGES)
    print(f"\n| column | aspect ratio | {shown} | measured |")
    print("|---|---|---|---|---|---|")
    for kind, wanted in COLUMNS.items():
        for aspect in ASPECTS:
            found = " | ".join(f"{distance:.2f}" for distance in column_collapse(aspect, kind))
            print(f"| {kind} | {aspect:g} | {found} | {wanted:g} |")


if __name__ == "__main__":
    main()
