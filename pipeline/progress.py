"""Progress of a batch: a bar on a terminal, plain lines otherwise."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager

from rich.console import Console
from rich.progress import BarColumn, MofNCompleteColumn, TextColumn, TimeElapsedColumn, TimeRemainingColumn
from rich.progress import Progress as Bar

from pipeline.task import Outcome
from pipeline.variables import Status

LINES = 50


class Progress:
    """Counts what became of the runs of a batch, and shows it."""

    def __init__(self, console: Console, total: int) -> None:
        self.console = console
        self.total = total
        self.ended = 0
        self.failed = 0
        self._every = max(1, total // LINES)
        self._bar = Bar(
            TextColumn("runs"),
            BarColumn(),
            MofNCompleteColumn(),
            TextColumn("{task.fields[failed]}"),
            TimeElapsedColumn(),
            TimeRemainingColumn(),
            console=console,
            disable=not console.is_terminal,
        )
        self._task = self._bar.add_task("runs", total=total, failed="")

    def report(self, outcome: Outcome) -> None:
        """Show a run that ended; failures always get a line of their own."""
        self.ended += 1
        failed = outcome.status is Status.FAILED
        self.failed += failed
        name = f"{outcome.path.stem} run {outcome.run}"
        if failed:
            self.tell(f"{name}: failed: {outcome.reason}")
        elif not self.console.is_terminal and self.ended % self._every == 0:
            self.tell(f"{self.ended} of {self.total}: {name}: {outcome.status.words}")
        self._bar.update(self._task, advance=1, failed=f"[red]{self.failed} failed[/]" if self.failed else "")

    def tell(self, line: str) -> None:
        """Print a line above the bar."""
        self.console.print(line, markup=False, highlight=False, soft_wrap=True)


@contextmanager
def shown(console: Console, total: int) -> Iterator[Progress]:
    """Show the progress of a batch of ``total`` runs while it lasts."""
    progress = Progress(console, total)
    with progress._bar:
        yield progress
