"""Error and cost of runs over ladders of spacings, for every form and layout, on cases of known solution."""

from __future__ import annotations

import tracemalloc
from collections.abc import Iterator
from dataclasses import dataclass, replace
from statistics import median
from time import thread_time

import numpy as np

from solver.arrays import Array
from solver.forms import prepare
from solver.scene import Collocation, Scene, Scheme, WeightedResidual
from solver.simulation import simulate
from solver.verification.cases import CHUTE, Case, Points, cap, compare, dam_break, relative_errors
from solver.verification.plain_scheme import plain_run

FORMS: dict[str, Scheme] = {"weighted-residual": WeightedResidual(), "collocation": Collocation()}
LAYOUTS = ("lattice", "cloud")
# what the weighted-residual form on a lattice takes turns with where a ladder says so
PLAIN = ("plain MUSCL-HLL", "lattice")
# A run is repeated so often, and more often as long as all take less than so many seconds together.
LEAST_REPEATS, MOST_REPEATS, ENOUGH = 3, 15, 1.0
# A run longer than this, s, is timed once.
LONG = 5.0
# Coarse enough to cost nothing, fine enough for a support of collocation on a cloud, m.
QUARTER = 4


@dataclass(frozen=True)
class Row:
    """One run and what it took.

    Parameters
    ----------
    variant : str
        What is unusual about it, else empty.
    spacing : float
        In m.
    time : float
        Simulated, s.
    cpu_time : float
        Thread CPU seconds of the time loop, the median of ``repeats``.
    setup_time : float
        Thread CPU seconds from the bounds to the first step: points, operators, release.
    depth, momentum : float
        Relative L2 errors, depth_l1 : relative L1 error, dimensionless; NaN where no solution is known.
    memory : int
        Most bytes of arrays alive during the run, points and operators among them.
    setup_memory : int
        The same during set-up.
    """

    case: str
    form: str
    layout: str
    variant: str
    spacing: float
    time: float
    points: int
    steps: int
    cell_stages: int
    cpu_time: float
    repeats: int
    setup_time: float
    depth: float
    momentum: float
    depth_l1: float
    volume_error: float
    memory: int
    setup_memory: int

    @property
    def rate(self) -> float:
        """Cell-stages per CPU second."""
        return self.cell_stages / self.cpu_time


@dataclass(frozen=True)
class Ladder:
    """A case with the spacings, m, of each form and layout that it is run by.

    Parameters
    ----------
    fine : bool
        Whether it is compared with a fine solution, on a quarter of the least spacing of all.
    beside_plain : bool
        Whether `solver.verification.plain_scheme` runs it too.
    """

    name: str
    case: Case
    spacings: dict[tuple[str, str], tuple[float, ...]]
    fine: bool = False
    beside_plain: bool = False

    def known(self) -> Case:
        """Give the case with what to compare with, computing that where it has to be."""
        if not self.fine:
            return self.case
        return self.case.against_fine(min(min(s) for s in self.spacings.values()) / QUARTER)


@dataclass(frozen=True)
class Plan:
    """What a benchmark runs.

    Parameters
    ----------
    ladders : tuple of Ladder
        Of which the last is run to ``end_times``, s, and with and without skipping, at ``spacing``, m.
    laws : bool
        Whether all laws of friction are timed.
    """

    ladders: tuple[Ladder, ...]
    spacing: float
    end_times: tuple[float, ...]
    laws: bool = False


def _spacings(
    lattice: tuple[float, ...],
    cloud: tuple[float, ...],
    collocation: tuple[float, ...] = (),
    collocation_cloud: tuple[float, ...] = (),
) -> dict[tuple[str, str], tuple[float, ...]]:
    given = (lattice, cloud, collocation, collocation_cloud)
    kinds = [(form, layout) for form in FORMS for layout in LAYOUTS]
    return {kind: spacings for kind, spacings in zip(kinds, given, strict=True) if spacings}


# The collocation form knows no given depth at a side, and so no dam that is fed.
FULL = Plan(
    (
        Ladder(
            "frictionless cap",
            cap(),
            _spacings((8, 4, 2, 1, 0.5), (8, 4, 2, 1), (8, 4, 2), (8, 4)),
            beside_plain=True,
        ),
        Ladder("cap with friction", cap(25.0), _spacings((8, 4, 2, 1), (8, 4, 2), (8, 4, 2), (8, 4)), True),
        Ladder("dam break 22/21", dam_break(), _spacings((2, 1, 0.5, 0.25, 0.125), (2, 1, 0.5, 0.25))),
        Ladder(
            "chute",
            CHUTE,
            _spacings((0.8, 0.4, 0.2, 0.1), (0.8, 0.4, 0.2, 0.1), (0.4, 0.2), (0.4, 0.2)),
            True,
        ),
    ),
    0.2,
    (6.0, 12.0, 24.0, 48.0, 96.0),
    laws=True,
)
QUICK = Plan(
    (
        Ladder(
            "frictionless cap",
            cap(),
            _spacings((8, 4, 2, 1), (8, 4, 2), (16, 8), (16, 8)),
            beside_plain=True,
        ),
        Ladder("cap with friction", cap(25.0), _spacings((8, 4, 2), (8, 4), (16, 8), (16, 8)), True),
        Ladder("dam break 22/21", dam_break(), _spacings((2, 1, 0.5, 0.25), (2, 1, 0.5))),
        Ladder("chute", CHUTE, _spacings((0.8, 0.4), (0.8, 0.4), (0.8,), (0.8,)), True),
    ),
    0.4,
    (6.0, 24.0, 96.0),
)


def climb(ladder: Ladder, case: Case) -> Iterator[Row]:
    """Run a ladder from coarse to fine; ``case`` is its own, with what to compare with."""
    for (form, layout), spacings in ladder.spacings.items():
        plain = ladder.beside_plain and (form, layout) == ("weighted-residual", "lattice")
        beside: list[Row] = []
        for spacing in spacings:
            row, *others = timed(ladder.name, case, form, layout, spacing, plain=plain)
            beside += others
            yield row
        yield from beside


def skipping(ladder: Ladder, case: Case, spacing: float) -> Iterator[Row]:
    """Run a case on a lattice with and without what is skipped, and on a domain doubled in each direction.

    A spacing, m, that divides the domain keeps the points where they are.
    """
    (x0, x1), (y0, y1) = case.x, case.y
    beside = round((y1 - y0) / 2 / spacing) * spacing
    doubled = replace(case, x=(x0, 2 * x1 - x0), y=(y0 - beside, y1 + beside))
    for domain, where in (("", case), ("domain doubled", doubled)):
        for what in ("", "nothing skipped"):
            variant = ", ".join(filter(None, (domain, what))) or "as it is"
            yield from timed(
                ladder.name, where, "weighted-residual", "lattice", spacing, variant, skip=not what
            )


def ending(ladder: Ladder, spacing: float, times: tuple[float, ...]) -> Iterator[Row]:
    """Run a case on a lattice to several end times, s, compared with nothing."""
    for time in times:
        case = replace(ladder.case, time=time, expected=unknown)
        yield from timed(ladder.name, case, "weighted-residual", "lattice", spacing, "end time")


def unknown(points: Points, scheme: Scheme) -> tuple[Array, Array]:
    """Expect NaN, for runs that are only timed."""
    nothing = np.full(points.shape, np.nan)
    return nothing, nothing


def timed(
    name: str,
    case: Case,
    form: str,
    layout: str,
    spacing: float,
    variant: str = "",
    *,
    skip: bool = True,
    plain: bool = False,
) -> list[Row]:
    """Run a case once for its errors and its memory, then for its times; the plain scheme in turn with it."""

    def scene() -> Scene:
        points = case.points(layout, spacing)
        return replace(case.scene(points, FORMS[form]), operators=prepare(points, FORMS[form]))

    tracemalloc.start()
    made = scene()
    _, setup_memory = tracemalloc.get_traced_memory()
    tracemalloc.reset_peak()
    run = simulate(made, [case.time], skip=skip)
    _, memory = tracemalloc.get_traced_memory()
    tracemalloc.stop()
    if run.failure is not None:
        raise RuntimeError(f"{name}, {form}, {layout}, {spacing:g} m: {run.failure.reason}")
    found = compare(case, made, run)
    setup_time = thread_time()
    made = scene()
    setup_time = thread_time() - setup_time
    row = Row(
        name,
        form,
        layout,
        variant,
        spacing,
        case.time,
        int(np.prod(made.points.shape)),
        run.steps,
        run.cell_stages,
        run.cpu_time,
        1,
        setup_time,
        found.depth,
        found.momentum,
        found.depth_l1,
        run.ledger.error,
        memory,
        setup_memory,
    )
    rows = [row, _plain(row, case)] if plain else [row]

    def again(which: Row) -> float:
        if which is row:
            return simulate(made, [case.time], skip=skip).cpu_time
        return plain_run(made, case.time).cpu_time

    turns: list[list[float]] = []
    while row.cpu_time <= LONG and (
        len(turns) < LEAST_REPEATS
        or (len(turns) < MOST_REPEATS and sum(first for first, *_ in turns) < ENOUGH)
    ):
        turns.append([again(each) for each in rows])
    times = zip(*turns, strict=True) if turns else [[each.cpu_time] for each in rows]
    return [
        replace(each, cpu_time=median(taken), repeats=len(taken))
        for each, taken in zip(rows, times, strict=True)
    ]


def _plain(row: Row, case: Case) -> Row:
    """Run a case by the plain scheme on the lattice of a row."""
    tracemalloc.start()
    made = case.scene(case.lattice(row.spacing), FORMS["weighted-residual"])
    run = plain_run(made, case.time)
    _, memory = tracemalloc.get_traced_memory()
    tracemalloc.stop()
    depth, momentum, depth_l1 = relative_errors(case, made, run.depth, run.momentum_x)
    form, layout = PLAIN
    return replace(
        row,
        form=form,
        layout=layout,
        steps=run.steps,
        cell_stages=run.cell_stages,
        cpu_time=run.cpu_time,
        depth=depth,
        momentum=momentum,
        depth_l1=depth_l1,
        volume_error=float(run.depth.sum() / made.depth.sum()) - 1.0,
        memory=memory,
    )


def cost_at(errors: list[float], costs: list[float], wanted: float) -> tuple[float, bool]:
    """Read off the cost at an error, linear in the logarithms, and whether it lies within those measured.

    Outside, the line through the nearest two goes on.

    Raises
    ------
    ValueError
        If fewer than two errors are given.
    """
    if len(errors) < 2:
        raise ValueError("one error alone gives no line")
    order = np.argsort(errors)
    x, y = np.log(np.array(errors)[order]), np.log(np.array(costs)[order])
    at = np.log(wanted)
    k = int(np.clip(np.searchsorted(x, at), 1, len(x) - 1))
    slope = (y[k] - y[k - 1]) / (x[k] - x[k - 1])
    return float(np.exp(y[k] + slope * (at - x[k]))), bool(x[0] <= at <= x[-1])
