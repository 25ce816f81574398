"""One scene run step by step, its laws checked at every step or at evenly spread ones."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass, field
from time import perf_counter

import numpy as np

from solver.checks.incoming import coming_in
from solver.checks.invariants import Laws
from solver.checks.states import Check, State, state_of_run
from solver.cloud.run import CloudRun
from solver.forms import begin
from solver.kernels.runge_kutta import AT_REST, OUT_OF_STEPS, REACHED
from solver.points.lattice import Lattice
from solver.result import REASONS
from solver.run import Run
from solver.scene import Collocation, Scene

# Work of a scene, cells updated in a stage; a point of the collocation form costs ten cells.
MOST_WORK = 2e6
COLLOCATION_WORK = MOST_WORK / 10
# Every step is checked up to so many, and so many cells; then ever fewer, evenly spread.
EVERY_STEP = 60
EVERY_CELL = 3e5
# A step that is at least this part of what is left was cut to meet the end.
CUT = 0.49
ENDS = "the run goes on to its end"


@dataclass
class Watched:
    """What became of a scene.

    Parameters
    ----------
    worst : dict[str, tuple[Check, float]]
        Of every law the check nearest to its limit, or the first beyond it, with its time, s.
    checks : dict[str, int]
        Number of checks of every law.
    shortest, longest : float
        Of its time steps, s.
    """

    outcome: int = REACHED
    time: float = 0.0
    steps: int = 0
    work: int = 0
    wall: float = 0.0
    points: int = 0
    worst: dict[str, tuple[Check, float]] = field(default_factory=dict)
    checks: dict[str, int] = field(default_factory=dict)
    steps_looked_at: int = 0
    shortest: float = float("inf")
    longest: float = 0.0

    def note(self, checks: Iterable[Check], time: float) -> None:
        """Remember the worst of every law, and the first that breaks it."""
        for check in checks:
            self.checks[check.law] = self.checks.get(check.law, 0) + 1
            before = self.worst.get(check.law)
            if before is None or (before[0].kept and not check.value <= before[0].value):
                self.worst[check.law] = check, time

    @property
    def violations(self) -> dict[str, tuple[Check, float]]:
        """The laws broken, each with its first check that says so, and its time, s."""
        return {law: worst for law, worst in self.worst.items() if not worst[0].kept}


def rates_of(run: Run) -> np.ndarray | float:
    """Rate of waves of 1 m s-1 in the cells of a run by which it finds its step, m-1."""
    points = run.scene.points
    if isinstance(run, CloudRun):
        rates: np.ndarray = run.tables.widths[2][: run.count]
        return rates
    spacings = (points.dx, points.dy) if isinstance(points, Lattice) else (points.mean_spacing,) * 2
    return float(sum(1.0 / d for d in spacings))


def watch(scene: Scene, end: float, most_work: float = MOST_WORK, stop_at_first: bool = False) -> Watched:
    """Run a scene to a time, s, or until its work is done, and check its laws.

    ``stop_at_first`` ends it with the first step that breaks one.
    """
    run = begin(scene, end, 0.0, True)
    found, start = Watched(points=scene.depth.size), state_of_run(run)
    laws = Laws(scene, start, rates_of(run), coming_in(scene, run.entrances))
    if isinstance(scene.scheme, Collocation):
        most_work *= COLLOCATION_WORK / MOST_WORK
    began, seen, last, outcome = perf_counter(), 0.0, start, OUT_OF_STEPS
    while outcome == OUT_OF_STEPS:
        stride = 1 + int(found.steps // EVERY_STEP) + int(seen // EVERY_CELL)
        if stride > 1:
            outcome = run.advance(end, found.steps + stride - 1)
            last, found.steps = state_of_run(run), int(run.progress.steps[0])
            if outcome != OUT_OF_STEPS:
                break
        left = end - run.time
        outcome = run.advance(end, found.steps + 1)
        if int(run.progress.steps[0]) == found.steps:
            break
        state, found.steps = state_of_run(run), found.steps + 1
        _look(found, laws, last, state, left)
        last, seen = state, seen + scene.depth.size
        # by work and not by the clock: a campaign is the same on every machine
        if run.progress.cell_stages[0] > most_work or (stop_at_first and found.violations):
            break
    # the end checks what no state was looked at for
    found.note(laws.of_state(state_of_run(run)), run.time)
    found.note(laws.of_end(run.time, outcome == AT_REST), run.time)
    found.note([Check(ENDS, float(outcome in REASONS and outcome != OUT_OF_STEPS), 0.0)], run.time)
    found.outcome, found.time, found.work = outcome, run.time, int(run.progress.cell_stages[0])
    found.wall = perf_counter() - began
    return found


def _look(found: Watched, laws: Laws, before: State, after: State, left: float) -> None:
    """Check a step."""
    dt = after.time - before.time
    found.shortest, found.longest = min(found.shortest, dt), max(found.longest, dt)
    found.steps_looked_at += 1
    found.note(laws.of_state(after), after.time)
    found.note(laws.of_step(before, after, dt >= CUT * left), after.time)
