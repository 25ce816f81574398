"""Long runs: what they carry on from step to step, and looks at the clock between steps."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from time import perf_counter, thread_time
from typing import Protocol

import numpy as np

from solver.arrays import Array
from solver.kernels.runge_kutta import OUT_OF_STEPS, OUT_OF_TIME, REACHED
from solver.run import Carried, Run

# Steps between two looks take about this long, s.
LOOK_SECONDS = 0.25
# Time between two copies of the state, to which a run goes back from a step that fails, s.
COPY_SECONDS = 2.0


@dataclass(frozen=True)
class Snapshot:
    """All that is needed to go on with a run as if it had not stopped.

    Parameters
    ----------
    carried : Carried
        Arrays in double precision, by name.
    passed : int
        Output times passed.
    frames : tuple of array
        Depth (m) and velocity (m s-1) at these, each (passed, ...), or (0, ...) where it is not kept.
    wall, cpu : float
        Used so far, s.
    """

    carried: Carried
    passed: int
    frames: tuple[Array, ...]
    wall: float
    cpu: float


class Keeper(Protocol):
    """Keeps snapshots of a run.

    Parameters
    ----------
    every : float
        Elapsed time between two of them, s.
    """

    every: float

    def load(self) -> Snapshot | None:
        """Give the last snapshot, if there is one."""
        ...

    def save(self, snapshot: Snapshot) -> None:
        """Keep a snapshot in place of the last; its arrays are valid during the call only."""
        ...


class Watch:
    """Steps a run with a look at the clock now and then; without limit and keeper, without a look.

    Parameters
    ----------
    run : Run
        Made from its scene; set to the keeper's snapshot where that has one.
    kept : sequence of array
        Frames of each field, (nt, ...) or (0, ...); filled from the snapshot.
    max_steps : int, optional
        Steps in all.
    max_wall : float, optional
        Elapsed time in all, s.
    keeper : Keeper, optional
        Asked for a snapshot now, and given one whenever it is due.

    Raises
    ------
    ValueError
        If the snapshot is of another kind of run, or of other points.
    """

    def __init__(
        self,
        run: Run,
        kept: Sequence[Array],
        max_steps: int | None,
        max_wall: float | None,
        keeper: Keeper | None,
    ) -> None:
        self.run, self.kept, self.keeper, self.max_wall = run, kept, keeper, max_wall
        self.most = np.iinfo(np.int64).max if max_steps is None else max_steps
        self.passed, self._used = 0, (0.0, 0.0)
        self._copy: tuple[int, Carried | None] = (0, None)
        found = keeper.load() if keeper is not None else None
        if found is not None:
            run.restore(found.carried)
            for field, frames in zip(kept, found.frames, strict=True):
                field[: len(frames)] = frames
            self.passed, self._used = found.passed, (found.wall, found.cpu)
            self._copy = found.passed, found.carried
        self._began = perf_counter(), thread_time()
        self._saved, self._copied, self._chunk = perf_counter(), perf_counter(), 1

    @property
    def wall(self) -> float:
        """Elapsed time so far, s, that before the snapshot included."""
        return self._used[0] + perf_counter() - self._began[0]

    @property
    def cpu(self) -> float:
        """Processor time so far, s, that before the snapshot included."""
        return self._used[1] + thread_time() - self._began[1]

    def advance(self, target: float, passed: int) -> int:
        """Step to ``target``, s, the next output time after ``passed`` ones; say why it stopped."""
        if self.run.time >= target:
            return REACHED
        self._look_back(passed)
        if self.max_wall is None and self.keeper is None:
            return self.run.advance(target, self.most)
        steps = self.run.progress.steps
        while self.max_wall is None or self.wall <= self.max_wall:
            if self.keeper is not None and perf_counter() - self._saved >= self.keeper.every:
                frames = tuple(field[:passed] for field in self.kept)
                self.keeper.save(Snapshot(self.run.carried, passed, frames, self.wall, self.cpu))
                self._saved = perf_counter()
            self._look_back(passed)
            before, began = int(steps[0]), perf_counter()
            outcome = self.run.advance(target, min(before + self._chunk, self.most))
            taken, elapsed = int(steps[0]) - before, perf_counter() - began
            if outcome != OUT_OF_STEPS or steps[0] >= self.most:
                return outcome
            self._chunk = max(1, min(2 * self._chunk, int(taken * LOOK_SECONDS / max(elapsed, 1e-9))))
        return OUT_OF_TIME

    def _look_back(self, passed: int) -> None:
        """Copy the state now and then; the first is that of a new run, or the snapshot."""
        if perf_counter() - self._copied >= COPY_SECONDS:
            self._copy = passed, {name: array.copy() for name, array in self.run.carried.items()}
            self._copied = perf_counter()

    def rewind(self, again: Run, times: Array) -> Run:
        """Step a run made anew to where the last step, which failed, began; times : all output times, s."""
        passed, carried = self._copy
        if carried is not None:
            again.restore(carried)
        good = int(self.run.progress.steps[0]) - 1
        for time in times[passed:]:
            if again.advance(time, good) != REACHED:
                break
        return again
