"""Progress of a batch: a bar on a terminal, plain lines otherwise."""

from __future__ import annotations

import logging
from collections.abc import Callable, Iterator
from contextlib import ExitStack, contextmanager, suppress
from datetime import UTC, datetime, timedelta
from pathlib import Path
from time import monotonic
from typing import IO

from rich.console import Console
from rich.progress import (
    BarColumn,
    MofNCompleteColumn,
    SpinnerColumn,
    TextColumn,
    TimeElapsedColumn,
    TimeRemainingColumn,
)
from rich.progress import Progress as Bar

from pipeline.batch.task import Outcome
from pipeline.store.place import store_name
from pipeline.store.variables import Status

LINES = 50


class _Stages(logging.Handler):
    """Shows what the package logs."""

    def __init__(self, show: Callable[[str], None]) -> None:
        super().__init__(logging.INFO)
        self.show = show

    def emit(self, record: logging.LogRecord) -> None:
        """Show a record."""
        self.show(record.getMessage())


@contextmanager
def stages(console: Console, what: str) -> Iterator[Callable[[str], None]]:
    """Show on a terminal that something long is being done, the stage it is in, and since when.

    What the package logs meanwhile (level INFO) is a stage. Where the output is no terminal nothing is shown.

    Parameters
    ----------
    console : Console
        Where it is shown.
    what : str
        What is being done.

    Yields
    ------
    callable
        Takes the words of a stage.
    """
    if not console.is_terminal:
        yield lambda words: None
        return
    columns = SpinnerColumn(), TextColumn("{task.description}", markup=False), TimeElapsedColumn()
    logger = logging.getLogger("pipeline")
    level = logger.level
    with Bar(*columns, console=console, transient=True, redirect_stdout=False, redirect_stderr=False) as bar:
        task = bar.add_task(what, total=None)

        def show(words: str) -> None:
            bar.update(task, description=f"{what}: {words}")

        handler = _Stages(show)
        logger.addHandler(handler)
        logger.setLevel(logging.INFO)
        try:
            yield show
        finally:
            logger.removeHandler(handler)
            logger.setLevel(level)


class Progress:
    """Counts what became of the runs of a batch, and shows it."""

    def __init__(self, console: Console, total: int, log: IO[str] | None = None) -> None:
        self.console = console
        self.log = log
        self.failures: list[Outcome] = []
        self.running = 0
        self._began = monotonic()
        self.total = total
        self.ended = 0
        self.failed = 0
        self._every = max(1, total // LINES)
        self._bar = Bar(
            TextColumn("runs"),
            BarColumn(),
            MofNCompleteColumn(),
            TextColumn("{task.fields[running]}"),
            TextColumn("{task.fields[failed]}"),
            TimeElapsedColumn(),
            TimeRemainingColumn(),
            console=console,
            disable=not console.is_terminal,
        )
        self._task = self._bar.add_task("runs", total=total, failed="", running="")

    def report(self, outcome: Outcome) -> None:
        """Show a run that ended; failures always get a line of their own."""
        self.ended += 1
        failed = outcome.status is Status.FAILED
        self.failed += failed
        self._note(outcome)
        if failed:
            self.failures.append(outcome)
        name = f"{store_name(outcome.path)} run {outcome.run}"
        if failed:
            self.tell(f"{name}: failed: {outcome.reason}")
        elif not self.console.is_terminal and self.ended % self._every == 0:
            left = (self.total - self.ended) * (monotonic() - self._began) / self.ended
            state = f"{self.failed} failed, {self.running} running, {timedelta(seconds=round(left))} left"
            self.tell(f"{self.ended} of {self.total} ({state}): {name}: {outcome.status.words}")
        self._bar.update(self._task, advance=1, failed=f"[red]{self.failed} failed[/]" if self.failed else "")

    def under_way(self, runs: int) -> None:
        """Show how many runs have been handed to workers."""
        self.running = runs
        self._bar.update(self._task, running=f"{runs} running")

    def _note(self, outcome: Outcome) -> None:
        """Write the run's line of the log; a log without room is no reason to stop."""
        if self.log is None:
            return
        now = datetime.now(UTC).isoformat(timespec="seconds")
        name = f"{store_name(outcome.path)} run {outcome.run}"
        line = f"{now} {name}: {outcome.status.words}, {outcome.elapsed:.3g} s"
        with suppress(OSError):
            self.log.write(f"{line}{': ' if outcome.reason else ''}{outcome.reason}\n")
            self.log.flush()

    def tell(self, line: str) -> None:
        """Print a line above the bar."""
        self.console.print(line, markup=False, highlight=False, soft_wrap=True)


@contextmanager
def shown(console: Console, total: int, log: Path | None) -> Iterator[Progress]:
    """Show the progress of a batch of ``total`` runs while it lasts, and add a line a run to a log."""
    with ExitStack() as stack:
        try:
            opened: IO[str] | None = None
            if log is not None:
                opened = stack.enter_context(log.open("a", encoding="utf-8"))
        except OSError as error:
            console.print(f"no log is kept: {error}", markup=False, highlight=False)
        progress = Progress(console, total, opened)
        stack.enter_context(progress._bar)
        yield progress
