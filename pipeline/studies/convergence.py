"""How results on the chute change from one spacing to the next, under each choice of the earth pressure.

``python -m pipeline.studies.convergence`` prints the tables. ``--finest 0.05`` stops at that spacing in two
dimensions, and takes two minutes; the default, 0.025, takes ten. ``--cloud`` adds those on clouds,
``--law smooth`` leaves the other laws out, and
``--cost`` measures their processor time instead.
"""

from __future__ import annotations

import argparse
from collections.abc import Callable, Iterator, Sequence
from dataclasses import replace
from itertools import pairwise

import numpy as np
from scipy.ndimage import gaussian_filter1d
from scipy.spatial import cKDTree

from pipeline.studies.stability import Stiff, Unswitched
from solver.arrays import Array
from solver.forms import prepare
from solver.physics.earth_pressure import EarthPressure, Isotropic, MohrCoulomb, MohrCoulombFlow
from solver.points.lattice import Lattice
from solver.result import Result
from solver.scene import Boundaries, Scene
from solver.simulation import simulate
from solver.verification.cases import CHUTE, CONSERVATIVE, Points, chute
from solver.verification.fine_solution import fine_solution, overlap
from solver.verification.surfaces import Inclined

TIMES = np.arange(3.0, 24.5, 3.0)
SPACINGS = (0.4, 0.2, 0.1, 0.05, 0.025)
ROW_SPACINGS = (0.2, 0.1, 0.05, 0.025, 0.0125, 0.00625, 0.003125)
CLOUD_SPACINGS = (0.4, 0.2, 0.1, 0.05)
BED_FRICTION = 30.0
# Where the deposit's roughness is measured, m, and the width of the mean that is taken from it across.
ALONG, ACROSS, MEAN = (19.0, 21.0), 3.0, 0.1
# Depth from which the flow counts as arrived.
EDGE = 0.01
# Centre and radius of the chute's heap, m.
CENTRE, RADIUS = 4.0, 1.85
# Points of the lattice that a cloud's cells are measured with, for each of its spacings.
FINER = 3
FLOW = "axes of the flow"
# Of the measurement of processor time: runs of each law, and the time that they go to.
REPEATS, COST_TIME = 5, 9.0


def laws(internal_friction: float) -> dict[str, EarthPressure]:
    """Name the laws to be compared at an angle of internal friction, degrees."""
    angles = internal_friction, BED_FRICTION
    return {
        "smooth": MohrCoulomb(*angles),
        FLOW: MohrCoulombFlow(*angles),
        "bare sign": MohrCoulomb(*angles, pressure_transition=0.0),
        "always active": Unswitched(*angles),
        "always passive": Stiff(*angles),
    }


def lattice(spacing: float) -> Lattice:
    """Lay the chute's lattice."""
    return CHUTE.lattice(spacing)


def row(spacing: float) -> Lattice:
    """Lay a lattice of three rows: what does not vary across is computed on one."""
    return Lattice(CHUTE.x, (-spacing, spacing), spacing)


def long_heap(points: Points) -> Scene:
    """Lay the chute's heap out as a round ridge across it; depths are means over cells."""
    scene = chute(points, CONSERVATIVE)
    if not isinstance(points, Lattice):
        raise TypeError("the ridge is laid on a lattice")
    edges = np.append(points.x_points - points.dx / 2, points.x_points[-1] + points.dx / 2)
    z = np.clip((edges - CENTRE) / RADIUS, -1.0, 1.0)
    area = RADIUS**2 / 2 * (np.arcsin(z) + z * np.sqrt(1 - z**2))
    depth = np.broadcast_to(np.diff(area) / points.dx, points.shape).copy()
    return replace(scene, depth=depth, velocity_x=0 * depth, velocity_y=0 * depth)


def heap(points: Points) -> Scene:
    """Lay out the chute."""
    return chute(points, CONSERVATIVE)


def run(points: Points, scene: Callable[[Points], Scene], law: EarthPressure) -> Result:
    """Run a scene under a law."""
    return simulate(replace(scene(points), earth_pressure=law), TIMES, frames=("depth",))


def on_coarse(coarse: Points, fine: Points, depth: Array) -> Array:
    """Average a depth on fine points, m, over the cells of coarse ones."""
    if isinstance(coarse, Lattice) and isinstance(fine, Lattice):
        across = overlap(fine.y_points, fine.dy, coarse.y_points, coarse.dy)
        along = overlap(fine.x_points, fine.dx, coarse.x_points, coarse.dx)
        # a row of the ridge stands for all
        return np.asarray((across / across.sum(axis=1, keepdims=True)) @ depth @ along.T)
    between = lattice(float(np.sqrt(np.mean(fine.cell_area))) / FINER)
    x, y = between.coordinates
    owner = cKDTree(np.stack([a.ravel() for a in fine.coordinates], axis=1)).query(
        np.stack([x.ravel(), y.ravel()], axis=1)
    )[1]
    expected = fine_solution(between, depth.ravel()[owner].reshape(x.shape), np.zeros(x.shape))
    return expected(coarse, CONSERVATIVE)[0]


def successive(coarse: Points, here: Result, fine: Points, there: Result) -> Array:
    """Relative L1 of the depth on coarse points against that on fine ones, at every time, (times,)."""
    found = []
    for mine, theirs in zip(here.depth, there.depth, strict=True):
        wanted = on_coarse(coarse, fine, theirs)
        area = coarse.cell_area
        found.append(float((area * np.abs(mine - wanted)).sum() / (area * wanted).sum()))
    return np.array(found)


def order(differences: Array) -> float:
    """Order by which differences, one for each halving of the spacing, fall: a fit to their logarithms."""
    return float(-np.polyfit(np.arange(len(differences)), np.log2(differences), 1)[0])


def roughness(points: Lattice, depth: Array) -> float:
    """Root mean square of the deposit's depth less its Gaussian mean across, m."""
    fine = depth - gaussian_filter1d(depth, MEAN / points.dy, axis=0)
    inside = np.ix_(
        np.abs(points.y_points) < ACROSS, (points.x_points >= ALONG[0]) & (points.x_points <= ALONG[1])
    )
    return float(np.sqrt((fine[inside] ** 2).mean()))


def ladder(
    points: Callable[[float], Points],
    scene: Callable[[Points], Scene],
    law: EarthPressure,
    spacings: Sequence[float],
) -> tuple[list[tuple[Points, Result]], Array]:
    """Run a scene on ever finer points.

    Returns
    -------
    list of (Points, Result)
        One for each spacing.
    differences : (spacings - 1, times) array
        From `successive`.
    """
    runs = [(laid := points(spacing), run(laid, scene, law)) for spacing in spacings]
    return runs, np.array([successive(*coarse, *fine) for coarse, fine in pairwise(runs)])


def falls(differences: Array) -> tuple[float, float]:
    """Least fall of a difference over two halvings at any time, as a factor, and largest growth over one."""
    one, two = differences[1:] / differences[:-1], differences[:-2] / differences[2:]
    return float(two.min(initial=np.inf)), float(one.max(initial=0.0))


def lines(name: str, runs: list[tuple[Points, Result]], differences: Array) -> Iterator[str]:
    """Table a ladder."""
    yield f"| {name} | {' | '.join(f't = {time:g}' for time in TIMES)} |"
    yield "|---" * (1 + len(TIMES)) + "|"
    widths = [float(np.sqrt(np.mean(points.cell_area))) for points, _ in runs]
    for (coarse, fine), values in zip(pairwise(widths), differences, strict=True):
        yield f"| {coarse:.3g} / {fine:.3g} | {' | '.join(f'{value:.4f}' for value in values)} |"
    yield f"| order | {' | '.join(f'{order(column):.2f}' for column in differences.T)} |"
    yield ""
    least, growth = falls(differences)
    points, last = runs[-1]
    text = (
        f"Least fall over two halvings {least:.2f}, largest growth over one {growth:.2f}; {last.steps} steps"
    )
    if isinstance(points, Lattice):
        middle = last.depth[-1][points.shape[0] // 2]
        front = points.x_points[np.flatnonzero(middle > EDGE)[-1]]
        text += f", front at {front:.2f}, {last.depth[-1].max():.3f} deep"
        if points.shape[0] > len(row(1.0).y_points):
            text += f", roughness {1e3 * roughness(points, last.depth[-1]):.2f}e-3"
    yield f"{text}."
    yield ""


def report(finest: float, cloud: bool, only: str | None = None) -> Iterator[str]:
    """Give all tables, each under its title; of all laws or of one."""
    flat = [spacing for spacing in SPACINGS if spacing >= finest]
    kinds: list[tuple[str, Callable[[float], Points], Callable[[Points], Scene], Sequence[float]]] = [
        ("two dimensions", lattice, heap, flat),
        ("one dimension", row, long_heap, ROW_SPACINGS),
    ]
    if cloud:
        kinds.append(("clouds", CHUTE.cloud, heap, CLOUD_SPACINGS))
    for title, points, scene, spacings in kinds:
        for phi in (30.0, 40.0):
            yield from (f"## Chute, phi = {phi:g}, {title}", "")
            chosen = {name: law for name, law in laws(phi).items() if only in (None, name)}
            for name, law in chosen.items():
                yield from lines(name, *ladder(points, scene, law, spacings))


def costs() -> Iterator[str]:
    """Table processor time a cell-stage of each law, over that of K = 1, least of several runs in turn."""
    bed = Inclined(30.0, 35.0)
    scenes = {
        "lattice": heap(lattice(0.1)),
        "cloud": heap(CHUTE.cloud(0.15)),
        "surface": replace(heap(lattice(0.1)), terrain=bed, boundaries=Boundaries()),
    }
    kinds = {"K = 1": Isotropic(), **laws(40.0)}
    chosen = [name for name in kinds if name in ("K = 1", "smooth", FLOW)]
    yield f"| | {' | '.join(chosen)} |"
    yield "|---" * (1 + len(chosen)) + "|"
    for title, scene in scenes.items():
        scene = replace(scene, operators=prepare(scene.points, scene.scheme))
        least = dict.fromkeys(chosen, np.inf)
        for _ in range(REPEATS):
            for name in chosen:
                if title == "surface" and name == "smooth":
                    continue
                found = simulate(replace(scene, earth_pressure=kinds[name]), [COST_TIME])
                least[name] = min(least[name], found.cpu_time / found.cell_stages)
        ratios = (least[name] / least["K = 1"] for name in chosen)
        yield f"| {title} | {' | '.join(f'{a:.2f}' if np.isfinite(a) else '-' for a in ratios)} |"


def main() -> None:
    """Print the tables."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--finest", type=float, default=SPACINGS[-1], help="finest spacing, two dimensions")
    parser.add_argument("--cloud", action="store_true", help="also on clouds")
    parser.add_argument("--law", choices=list(laws(BED_FRICTION)), help="this law alone")
    parser.add_argument("--cost", action="store_true", help="processor time of the laws in place of tables")
    given = parser.parse_args()
    for line in costs() if given.cost else report(given.finest, given.cloud, given.law):
        print(line, flush=True)


if __name__ == "__main__":
    main()
