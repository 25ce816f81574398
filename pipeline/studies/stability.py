"""At which Courant number a form breaks, and how far results depend on numerical choices.

``python -m pipeline.studies.stability docs/stability.md`` prints the tables and puts them into the page, in
three minutes.
"""

from __future__ import annotations

import sys
from collections.abc import Callable, Iterator
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np

from pipeline.studies.bench import insert
from pipeline.studies.ladders import FORMS, LAYOUTS
from pipeline.studies.stress.watch import ENDS, watch
from solver.arrays import Array
from solver.forms import prepare
from solver.lmls.gridding import gridding
from solver.physics.earth_pressure import Isotropic, MohrCoulomb, PressureCoefficients
from solver.points.lattice import Lattice
from solver.scene import Scene, Scheme, WeightedResidual
from solver.simulation import simulate
from solver.verification.cases import CHUTE, Case, Points, cap, chute, compare, dam_break
from solver.verification.exact_solutions import DamBreak

# A run is broken where its error is so many times that at the default Courant number.
BROKEN = 2.0
# The Courant number is raised by the first factor until a run breaks, at most to the second number, and then
# bisected to within the last factor.
FACTOR, MOST, NEAR = 1.1, 12.0, 1.01
# Depth of the body of a flow, part of the largest depth of the release.
BODY = 0.01
# Each case of known solution with its spacing, m; what the collocation form knows no given depth for.
CASES: dict[str, tuple[Callable[[], Case], float]] = {
    "frictionless cap": (cap, 4.0),
    "chute": (lambda: CHUTE.against_fine(0.1), 0.4),
    "dam break 22/21": (dam_break, 1.0),
}
FED = "dam break 22/21"
FINITE = "values are finite"
# Numerical choices that are varied; the default is the middle one, or the first where it is an end.
SPACINGS = {"chute": (0.4, 0.2, 0.1), FED: (1.0, 0.5, 0.25)}
COURANT, WET = (0.2, 0.45, 0.9, 1.2), (1e-6, 1e-5, 1e-4, 1e-3, 1e-2)
MOVING, AT_REST = 10.0, 80.0


class Unswitched(MohrCoulomb):
    """Earth pressure that is active everywhere, however the flow is strained."""

    def coefficients(self) -> PressureCoefficients:
        """Give the active coefficients for every state."""
        found = super().coefficients()
        return PressureCoefficients(*(found.x_active,) * 2, *(found.y_active_active,) * 4)


class Stiff(MohrCoulomb):
    """Earth pressure that is passive everywhere."""

    def coefficients(self) -> PressureCoefficients:
        """Give the passive coefficients for every state."""
        found = super().coefficients()
        return PressureCoefficients(*(found.x_passive,) * 2, *(found.y_passive_passive,) * 4)


PRESSURES = {
    "K = 1": Isotropic(),
    "phi 30, always active": Unswitched(30.0, 30.0),
    "phi 30, always passive": Stiff(30.0, 30.0),
    "phi 32": MohrCoulomb(32.0, 30.0),
    "phi 40": MohrCoulomb(40.0, 30.0),
}


def varied(scene: Scene, **changes: Any) -> Scene:
    """Change the numerical choices of a scene."""
    return replace(scene, scheme=replace(scene.scheme, **changes))


Trouble = Callable[[Scene], str]


def doubling(case: Case, scene: Scene) -> Trouble:
    """Make the test for an error of more than so many times that of a scene, or a run that fails."""
    usual = compare(case, scene, simulate(scene, [case.time])).depth

    def found(changed: Scene) -> str:
        run = simulate(changed, [case.time])
        if run.failure is not None:
            return run.failure.reason
        return "" if compare(case, changed, run).depth <= BROKEN * usual else "error"

    return found


def breaking(case: Case, scene: Scene) -> Trouble:
    """Make the test for a law that is broken; the collocation form has to stay finite and to go on."""
    kept = None if isinstance(scene.scheme, WeightedResidual) else {ENDS, FINITE}
    return lambda changed: ", ".join(
        law for law in watch(changed, case.time).violations if kept is None or law in kept
    )


def limit(scene: Scene, trouble: Trouble) -> tuple[float, str]:
    """Find the Courant number at which a scene comes to trouble, NaN where it does not, and what that is."""
    good = scene.scheme.cfl
    while not (how := trouble(varied(scene, cfl=good * FACTOR))):
        good *= FACTOR
        if good * FACTOR > MOST:
            return np.nan, ""
    bad = good * FACTOR
    while bad / good > NEAR:
        middle = float(np.sqrt(bad * good))
        found = trouble(varied(scene, cfl=middle))
        good, bad, how = (good, middle, found) if found else (middle, bad, how)
    return bad, how


def courant_numbers() -> Iterator[str]:
    """Table the Courant numbers at which each form breaks on each layout."""
    yield "| case | form | layout | default | error doubles at | a law breaks at | which |"
    yield "|---|---|---|---|---|---|---|"
    for name, (make, spacing) in CASES.items():
        case = make()
        for form, scheme in FORMS.items():
            if name == FED and form == "collocation":
                continue
            for layout in LAYOUTS:
                points = case.points(layout, spacing)
                scene = replace(case.scene(points, scheme), operators=prepare(points, scheme))
                tests = doubling(case, scene), breaking(case, scene)
                (error, failed), (law, which) = (limit(scene, test) for test in tests)
                told = "; ".join(filter(None, (which, failed.removeprefix("error"))))
                yield (
                    f"| {name}, {spacing:g} m | {form} | {layout} | {scheme.cfl:g} | {shown(error)} "
                    f"| {shown(law)} | {told} |"
                )


def shown(number: float) -> str:
    """Write a Courant number, or that there is none."""
    return f"{number:.2f}" if np.isfinite(number) else f"above {MOST:g}"


def ends(places: Array, depth: Array, body: float) -> tuple[float, float]:
    """First and last place where a profile (n,) crosses a depth, linear between the places (n,), m."""
    inside = np.flatnonzero(depth > body)
    edges = (inside[0], inside[0] - 1), (inside[-1], inside[-1] + 1)
    first, last = (
        float(places[a] + (places[b] - places[a]) * (body - depth[a]) / (depth[b] - depth[a]))
        for a, b in edges
    )
    return first, last


def profile(points: Points, depth: Array, spacing: float, case: Case) -> tuple[Array, Array]:
    """Largest depth across the bed along x, m: places and depth, of a cloud on a lattice."""
    lattice = points if isinstance(points, Lattice) else case.lattice(spacing)
    found = depth if isinstance(points, Lattice) else gridding(points, lattice).keeping_integral(depth)
    return lattice.x_points, found.max(axis=0)


def deposit(scene: Scene, spacing: float) -> tuple[str, ...]:
    """Front while it moves and at rest, length and largest depth of the deposit, m, and when it rests, s.

    A run that does not come to rest is told by the share of the volume that still moves.
    """
    body = BODY * float(scene.depth.max())
    run = simulate(scene, [MOVING, AT_REST])
    moving, _ = (ends(*profile(scene.points, h, spacing, CHUTE), body) for h in run.depth)
    tail, front = ends(*profile(scene.points, run.depth[-1], spacing, CHUTE), body)
    found = moving[1], front, front - tail, float(run.depth[-1].max())
    volume = run.depth[-1] * scene.points.cell_area
    moves = volume[(run.velocity_x[-1] != 0) | (run.velocity_y[-1] != 0)].sum() / volume.sum()
    rests = f"{100 * moves:.2g} % move" if np.isnan(run.rest_time) else f"{run.rest_time:.1f}"
    return *(f"{value:.4g}" for value in found), rests


def fed_front(scene: Scene, spacing: float) -> tuple[str, ...]:
    """Distance of a dam break's front from the exact one, m, and the relative L2 error of depth."""
    case, solution = dam_break(), DamBreak()
    run = simulate(scene, [case.time])
    fine = np.linspace(0.0, case.x[1], 100_001)
    body = BODY * solution.depth
    exact = fine[solution(fine, case.time)[0] > body][-1]
    places, depth = profile(scene.points, run.depth[-1], spacing, case)
    inside = np.append(depth, 0.0), np.append(places, places[-1] + spacing)
    last = int(np.flatnonzero(inside[0] > body)[-1])
    front = np.interp(-body, -inside[0][last : last + 2], inside[1][last : last + 2])
    return f"{front - exact:.2f}", f"{compare(case, scene, run).depth:.2e}"


def sensitivity(
    case: Case,
    scene: Callable[[Points, Scheme], Scene],
    spacings: tuple[float, ...],
    measure: Callable[[Scene, float], tuple[str, ...]],
    titles: tuple[str, ...],
    more: dict[str, dict[str, Any]],
) -> Iterator[str]:
    """Table what a measure gives on both layouts where one choice is varied at a time.

    Parameters
    ----------
    spacings : tuple of float
        In m; the middle one is that of all other rows.
    more : dict[str, dict[str, Any]]
        Further changes of the scene by name.
    """
    yield f"| choice | {' | '.join(f'{layout}: {title}' for layout in LAYOUTS for title in titles)} |"
    yield "|---" * (1 + len(LAYOUTS) * len(titles)) + "|"
    usual, scheme = spacings[1], WeightedResidual()
    points = {layout: case.points(layout, usual) for layout in LAYOUTS}
    operators = {layout: prepare(on, scheme) for layout, on in points.items()}

    def line(name: str, changed: Callable[[str], tuple[Scene, float]]) -> str:
        cells = [value for layout in LAYOUTS for value in measure(*changed(layout))]
        return f"| {name} | {' | '.join(cells)} |"

    def base(layout: str) -> Scene:
        return replace(scene(points[layout], scheme), operators=operators[layout])

    yield line(f"as shipped, spacing {usual:g} m", lambda layout: (base(layout), usual))
    for spacing in (s for s in spacings if s != usual):
        yield line(
            f"spacing {spacing:g} m",
            lambda layout, s=spacing: (scene(case.points(layout, s), scheme), s),  # type: ignore[misc]
        )
    for key, values in (("cfl", COURANT), ("wet_limit", WET)):
        for value in (v for v in values if v != getattr(scheme, key)):
            yield line(
                f"{key} {value:g}",
                lambda layout, k=key, v=value: (varied(base(layout), **{k: v}), usual),  # type: ignore[misc]
            )
    for name, changes in more.items():
        yield line(name, lambda layout, c=changes: (replace(base(layout), **c), usual))  # type: ignore[misc]


def report() -> Iterator[str]:
    """Give all tables, each under its title."""
    yield from ("## Courant numbers", "", *courant_numbers(), "", "## Deposit of the chute", "")
    titles = ("front at t = 10", "front", "length", "depth", "rests at")
    pressures = {name: {"earth_pressure": pressure} for name, pressure in PRESSURES.items()}
    yield from sensitivity(CHUTE, chute, SPACINGS["chute"], deposit, titles, pressures)
    yield from ("", "## Front of a dam break", "")
    case = dam_break()
    yield from sensitivity(case, case.scene, SPACINGS[FED], fed_front, ("front, m", "depth L2"), {})


if __name__ == "__main__":
    lines = []
    for text in report():
        print(text, flush=True)
        lines.append(text)
    for page in map(Path, sys.argv[1:]):
        page.write_text(insert("\n".join(lines), page.read_text(encoding="utf-8")), encoding="utf-8")
