"""Layers that come to rest between banks: a pond in a basin, and a flow that stops in a gully.

``python -m solver.verification.bank_cases`` prints what moves in the end, and where deposits lie, by spacing.
"""

from __future__ import annotations

from collections.abc import Iterator
from typing import NamedTuple

import numpy as np

from solver.physics.friction import Coulomb, Voellmy
from solver.points.lattice import Lattice
from solver.result import Result
from solver.scene import Scene
from solver.simulation import simulate
from solver.verification.surface_cases import centred
from solver.verification.surfaces import Basin, Gully

BASIN = Basin(radius=12.0, bank=0.6)
GULLY = Gully(azimuth=float(np.degrees(np.arctan2(3, 4))), half_width=6.0, bank=0.6, steep=0.14, gentle=0.05)


class Deposit(NamedTuple):
    """Where a flow has come to, along the gully, m: front above 0.1 m and centroid; and the moving share."""

    front: float
    centroid: float
    moving: float


def moving_share(run: Result, speed: float = 0.01) -> float:
    """Share of the volume on cells of one size that is faster than ``speed``, m s-1, in the last frame."""
    h, fast = run.depth[-1], np.hypot(run.velocity_x[-1], run.velocity_y[-1]) > speed
    return float(h[fast].sum() / h.sum())


def pond(spacing: float, friction: float = 10.0, end: float = 1000.0) -> Result:
    """Run a heap of 2 m that collapses in a basin, beside its middle, to a pond that touches the banks."""
    points = centred(30.0, 30.0, spacing)
    x, y = points.coordinates
    depth = np.maximum(0.0, 2.0 - ((x - 6.0) ** 2 + (y + 2.0) ** 2) / 60.0)
    return simulate(Scene(points, BASIN, depth, 0 * depth, 0 * depth, Coulomb(friction)), [0.0, end])


def in_gully(spacing: float, end: float = 600.0) -> Deposit:
    """Run a layer of 2.5 m down a gully of 12 m that turns gentler than friction, oblique to the lattice."""
    points = Lattice((-160.0, 240.0), (-144.0, 200.0), spacing)
    x, y = points.coordinates
    s, n = GULLY.along(x, y), GULLY.across(x, y)
    depth = 2.5 * np.maximum(0.0, 1.0 - ((s + 110.0) / 30.0) ** 4 - (n / 9.0) ** 4)
    law = Voellmy(5.5, 250.0)
    run = simulate(Scene(points, GULLY, depth, 0 * depth, 0 * depth, law), [0.0, end])
    h = run.depth[-1]
    return Deposit(float(s[h > 0.1].max()), float((s * h).sum() / h.sum()), moving_share(run))


def report() -> Iterator[str]:
    """Lines of the tables."""
    yield "| pond, friction, degrees | spacing, m | comes to rest, s | faster than 1 cm/s in the end |"
    yield "|---|---|---|---|"
    for friction in (3.0, 10.0):
        for spacing in (4.0, 2.0, 1.0):
            run = pond(spacing, friction)
            rest = "no" if np.isnan(run.rest_time) else f"{run.rest_time:.0f}"
            yield f"| {friction:g} | {spacing:g} | {rest} | {moving_share(run):.2%} |"
    yield ""
    yield "| gully, spacing, m | front, m | centroid, m | faster than 1 cm/s |"
    yield "|---|---|---|---|"
    for spacing in (8.0, 4.0, 2.0, 1.0):
        found = in_gully(spacing)
        yield f"| {spacing:g} | {found.front:.1f} | {found.centroid:.1f} | {found.moving:.1%} |"


if __name__ == "__main__":
    for line in report():
        print(line, flush=True)
