"""The exact cases as runs: a scene at a spacing, and its error against the closed form.

``python -m solver.verification`` prints the errors of all cases by spacing, with the fitted orders.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from solver import exact_solutions as exact
from solver.initial_state import lay
from solver.lattice import Array, Lattice
from solver.release import Paraboloid
from solver.rheology import Coulomb
from solver.simulation import Boundaries, Result, Scene, WeightedResidual, simulate
from solver.terrain import Plane

ROWS = 3


@dataclass(frozen=True)
class Measured:
    """Relative errors of one run, dimensionless, beside the run itself.

    depth, momentum : L2 norms over the lattice. depth_l1 : L1 norm of depth.
    """

    spacing: float
    depth: float
    momentum: float
    depth_l1: float
    run: Result


def relative_l2(found: Array, wanted: Array) -> float:
    """``sqrt(sum (found - wanted)^2 / sum wanted^2)``, dimensionless."""
    return float(np.sqrt(((found - wanted) ** 2).sum() / (wanted**2).sum()))


def measure(spacing: float, run: Result, depth: Array, velocity: Array) -> Measured:
    """Compare the last frame of a run with exact depth (m) and velocity (m s-1), each of shape (ny, nx)."""
    h, u = run.depth[-1], run.velocity_x[-1]
    return Measured(
        spacing,
        relative_l2(h, depth),
        relative_l2(h * u, depth * velocity),
        float(np.abs(h - depth).sum() / depth.sum()),
        run,
    )


def row(bounds: tuple[float, float], spacing: float) -> Lattice:
    """Lattice for what does not vary across the bed: cells fill the bounds along x, a few rows across."""
    half = spacing / 2
    return Lattice((bounds[0] + half, bounds[1] - half), (0.0, (ROWS - 1) * spacing), spacing)


def slide(
    lattice: Lattice,
    depth: Array,
    velocity: Array,
    angle: float,
    bed_friction: float,
    boundaries: Boundaries,
    gravity: float = exact.GRAVITY,
    scheme: WeightedResidual | None = None,
) -> Scene:
    """Scene on a plane with K = 1 from depth (m) and velocity (m s-1) along x, each of shape (nx,)."""
    h, u = (
        np.tile(np.broadcast_to(a, lattice.x_points.shape), (lattice.shape[0], 1)) for a in (depth, velocity)
    )
    friction = Coulomb(bed_friction)
    return Scene(
        lattice,
        Plane(angle),
        h,
        u,
        np.zeros_like(h),
        friction,
        gravity=gravity,
        boundaries=boundaries,
        scheme=scheme or WeightedResidual(),
    )


WALLED = Boundaries("open", "open", "wall", "wall")


def frictionless_cap(spacing: float, scheme: WeightedResidual | None = None) -> Measured:
    """Exact case 1 at t = 5 s."""
    solution = exact.FrictionlessCap()
    lattice = Lattice((-150.0, 300.0), (-150.0, 150.0), spacing)
    laid = lay([Paraboloid((0.0, 0.0), (solution.radius, solution.radius), solution.height)], lattice)
    scene = Scene(
        lattice,
        Plane(solution.angle),
        laid.depth,
        laid.velocity_x,
        laid.velocity_y,
        Coulomb(0.0),
        scheme=scheme or WeightedResidual(),
    )
    x, y = np.meshgrid(lattice.x_points, lattice.y_points)
    depth, velocity, _ = solution(x, y, 5.0)
    return measure(spacing, simulate(scene, [5.0]), depth, velocity)


def dam_break(
    spacing: float,
    angle: float = 22.0,
    bed_friction: float = 21.0,
    scheme: WeightedResidual | None = None,
    bounds: tuple[float, float] = (-60.0, 50.0),
    time: float = 5.0,
) -> Measured:
    """Exact case 3: the dam stands on a cell face, and the layer behind it is fed at its depth."""
    solution = exact.DamBreak(angle, bed_friction)
    lattice = row(bounds, spacing)
    x = lattice.x_points
    sides = Boundaries(solution.depth, "open", "wall", "wall")
    start = slide(
        lattice, np.where(x < 0, solution.depth, 0.0), 0 * x, angle, bed_friction, sides, scheme=scheme
    )
    depth, velocity = (np.tile(a, (ROWS, 1)) for a in solution(x, time))
    return measure(spacing, simulate(start, [time]), depth, velocity)


def steep_dam_break(spacing: float, scheme: WeightedResidual | None = None) -> Measured:
    """Exact case 3 at 30 degrees with bed friction 20, t = 3 s."""
    return dam_break(spacing, 30.0, 20.0, scheme, (-60.0, 60.0), 3.0)


def ritter(spacing: float, scheme: WeightedResidual | None = None) -> Measured:
    """Exact case 8: flat and frictionless, onto a dry bed, t = 3 s."""
    return dam_break(spacing, 0.0, 0.0, scheme, (-20.0, 30.0), 3.0)


def stoker(spacing: float, scheme: WeightedResidual | None = None) -> Measured:
    """Exact case 8: flat and frictionless, onto a layer at rest, t = 3 s."""
    solution = exact.WetDamBreak()
    lattice = row((-20.0, 30.0), spacing)
    x = lattice.x_points
    start = slide(
        lattice, np.where(x < 0, solution.depth, solution.ahead), 0 * x, 0.0, 0.0, WALLED, scheme=scheme
    )
    depth, velocity = (np.tile(a, (ROWS, 1)) for a in solution(x, 3.0))
    return measure(spacing, simulate(start, [3.0]), depth, velocity)


def parabolic_cap(spacing: float, scheme: WeightedResidual | None = None) -> Measured:
    """Exact case 4 at t = 4 s."""
    solution = exact.ParabolicCap()
    lattice = row((-25.0, 65.0), spacing)
    x = lattice.x_points
    start = slide(
        lattice,
        exact.cell_means(solution, x, spacing, 0.0),
        0 * x,
        solution.angle,
        solution.bed_friction,
        WALLED,
        scheme=scheme,
    )
    depth, velocity = (np.tile(a, (ROWS, 1)) for a in solution(x, 4.0))
    return measure(spacing, simulate(start, [4.0]), depth, velocity)


@dataclass(frozen=True)
class Shock:
    """What a granular shock left behind, at worst over the second half of its way.

    offset : distance of the shock from the exact one, in spacings. behind : largest speed from four spacings
    behind it to half way to the start-up wave, as part of the arriving one. start_up : the same with the wave
    that the first, sharp shock sends ahead of itself. precursor : how far beyond the reach of the fastest
    signal a cell is not exactly at rest, in spacings.
    """

    spacing: float
    offset: float
    behind: float
    start_up: float
    precursor: float
    run: Result


def travelling_shock(spacing: float, scheme: WeightedResidual | None = None, distance: float = 10.0) -> Shock:
    """Exact case 5: the shock on its way over a distance, m."""
    solution = exact.TravellingShock()
    duration = distance / abs(solution.speed)
    signal = np.sqrt(exact.GRAVITY * np.cos(np.radians(solution.angle)) * solution.downstream)
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


# Each case with the spacings, m, at which its order is fitted.
CASES: dict[str, tuple[Callable[[float], Measured], tuple[float, ...]]] = {
    "frictionless cap": (frictionless_cap, (8.0, 4.0, 2.0)),
    "dam break 22/21": (dam_break, (1.0, 0.5, 0.25)),
    "dam break 30/20": (steep_dam_break, (1.0, 0.5, 0.25)),
    "parabolic cap": (parabolic_cap, (1.0, 0.5, 0.25)),
    "Ritter": (ritter, (1.0, 0.5, 0.25)),
    "Stoker": (stoker, (1.0, 0.5, 0.25)),
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
        rows = [case(spacing) for spacing in spacings]
        for r in rows:
            print(
                f"| {name} | {r.spacing:g} | {r.depth:.2e} | {r.momentum:.2e} | {r.depth_l1:.2e} "
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


if __name__ == "__main__":
    main()
