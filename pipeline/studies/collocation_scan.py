"""The collocation form on the paper's chute, against the conservative form on the same points.

``python -m pipeline.studies.collocation_scan`` prints one table of all its free parameters, on both layouts
points; ``--part`` and ``--points`` choose from it.
"""

from __future__ import annotations

from argparse import ArgumentParser
from collections.abc import Iterator
from dataclasses import asdict, dataclass, replace
from itertools import product
from typing import Any

import numpy as np

from solver.arrays import Array
from solver.points.cloud import PointCloud, random_points
from solver.points.lattice import Lattice
from solver.result import Result
from solver.scene import Collocation, WeightedResidual
from solver.scheme import DerivativeName
from solver.simulation import simulate
from solver.verification.cases import CHUTE, relative_l2

X, Y = CHUTE.x, CHUTE.y
TIMES = np.arange(3.0, 25.0, 3.0)
# Of the largest initial depth: what counts as covered by a deposit, and as a film.
COVERED, FILM = 0.01, 0.005
COLUMNS = (
    "points",
    "choices",
    "volume error",
    "front",
    "tail",
    "depth L2",
    "film / body",
    "fastest",
    "below zero",
    "steps",
    "failure",
)

SUPPORTS = ((25, 4.0), (25, 9.0), (37, 6.0), (49, 4.0), (49, 9.0))
DERIVATIVES: tuple[DerivativeName, ...] = ("full", "diffuse")
SHIPPED = Collocation()
LITERAL = replace(SHIPPED, smoothing="printed", floor=0.0, film=0.0)
PARTS = {
    "operators": [
        replace(SHIPPED, support=support, weight_shape=c, degree=degree, derivative=derivative)
        for (support, c), degree, derivative in product(SUPPORTS, (1, 2), DERIVATIVES)
    ],
    "relaxation": [
        replace(SHIPPED, relaxation=omega, threshold=threshold)
        for omega, threshold in product((0.2, 0.5, 0.8), (0.01, 0.02, 0.05, 0.1))
    ],
    "open": [
        *(replace(SHIPPED, floor=floor) for floor in (5e-3, 2e-2)),
        *(replace(SHIPPED, film=film) for film in (0.0, 1e-3, 2e-2)),
        *(replace(SHIPPED, cfl=cfl) for cfl in (0.35, 1.0)),
        *(replace(SHIPPED, wet_limit=limit) for limit in (1e-5, 1e-3)),
        replace(SHIPPED, smoothed="depth"),
        replace(SHIPPED, clip=True),
        replace(SHIPPED, relaxation=0.0),
    ],
    "printed": [
        *(replace(LITERAL, smoothed="depth", clip=clip) for clip in (False, True)),
        *(replace(LITERAL, clip=clip) for clip in (False, True)),
        replace(LITERAL, clip=True, relaxation=1.0),
        *(replace(LITERAL, clip=clip, floor=SHIPPED.floor, film=SHIPPED.film) for clip in (False, True)),
    ],
}


@dataclass(frozen=True)
class Outcome:
    """What a run on the chute comes to, beside the run itself.

    Parameters
    ----------
    front, tail : float
        Of what is covered in the last frame computed, m; NaN if nothing is.
    film, body : array
        Fastest speed in each frame of what is at most and of what is more than `FILM` deep, (nt,), m s-1.
    """

    run: Result
    front: float
    tail: float
    film: Array
    body: Array


def outcome(points: Lattice | PointCloud, scheme: WeightedResidual | Collocation) -> Outcome:
    """Run the chute."""
    scene = CHUTE.scene(points, scheme)
    run = simulate(scene, TIMES, max_steps=20_000)
    release = float(np.max(scene.depth))
    x, _ = points.coordinates
    computed = [k for k in range(len(TIMES)) if np.isfinite(run.depth[k]).all()]
    covered = x[run.depth[computed[-1]] > COVERED * release] if computed else np.empty(0)
    extent = (float(covered.max()), float(covered.min())) if covered.size else (np.nan, np.nan)
    speed = np.hypot(run.velocity_x, run.velocity_y)[computed]
    shallow = run.depth[computed] <= FILM * release
    axes = tuple(range(1, speed.ndim))
    return Outcome(
        run,
        *extent,
        np.where(shallow, speed, 0.0).max(axis=axes, initial=0.0),
        np.where(shallow, 0.0, speed).max(axis=axes, initial=0.0),
    )


def named(scheme: Collocation) -> str:
    """Say in which choices a scheme is not the one that is shipped."""
    shipped = asdict(SHIPPED)
    return ", ".join(f"{k} {v}" for k, v in asdict(scheme).items() if v != shipped[k]) or "shipped"


def row(name: str, points: Lattice | PointCloud, scheme: Collocation, reference: Outcome) -> list[str]:
    """One line of the table; front and tail as distances from the conservative form's, m."""
    found = outcome(points, scheme)
    run, wanted = found.run, reference.run.depth[-1]
    area = np.broadcast_to(points.cell_area, wanted.shape)
    fastest = np.max(found.film / np.maximum(found.body, 1e-300), initial=0.0)
    cells = [name, named(scheme), f"{100 * run.ledger.error:+.4f} %"]
    if run.failure:
        return [*cells, *("",) * 6, str(run.steps), f"{run.failure.reason} at {run.failure.time:.3g}"]
    off = relative_l2(run.depth[-1], wanted, area)
    negative = (area * np.minimum(run.depth[-1], 0.0)).sum() / run.ledger.released
    return [
        *cells,
        f"{found.front - reference.front:+.2f}",
        f"{found.tail - reference.tail:+.2f}",
        f"{off:.3f}",
        f"{found.film[-1]:.2f} / {found.body[-1]:.2f}",
        f"{fastest:.2f}",
        f"{100 * abs(negative):.3f} %",
        str(run.steps),
        "",
    ]


def table(parts: list[str], layouts: list[str]) -> Iterator[str]:
    """Lines of the Markdown table."""
    yield "| " + " | ".join(COLUMNS) + " |"
    yield "|" + "---|" * len(COLUMNS)
    made: dict[str, Any] = {
        "regular": lambda: Lattice(X, Y, 0.2),
        "random": lambda: random_points(X, Y, 15_700, 1),
    }
    for layout in layouts:
        points = made[layout]()
        reference = outcome(points, WeightedResidual())
        for part in parts:
            for scheme in PARTS[part]:
                yield "| " + " | ".join(row(layout, points, scheme, reference)) + " |"


def main() -> None:
    """Print the table, line by line."""
    parser = ArgumentParser(description=__doc__)
    parser.add_argument("--part", choices=PARTS, action="append", help="of the scan; by default all")
    parser.add_argument("--points", choices=("regular", "random"), action="append", help="by default both")
    chosen = parser.parse_args()
    for line in table(chosen.part or list(PARTS), chosen.points or ["regular", "random"]):
        print(line, flush=True)


if __name__ == "__main__":
    main()
