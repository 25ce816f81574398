"""Commands of studies of the solver itself: its cost, and attempts to break it."""

from __future__ import annotations

from enum import StrEnum
from pathlib import Path
from typing import Annotated

import typer

from pipeline.cli.exit_codes import SOME_FAILED, exit_on_errors


class Section(StrEnum):
    """What not all scenes have, by the section of their files."""

    INFLOW = "inflow"
    ERODIBLE_BED = "erodible_bed"
    STRUCTURES = "structures"


def bench(
    to: Annotated[Path, typer.Option(help="Folder to write to.")] = Path("bench"),
    quick: Annotated[bool, typer.Option("--quick", help="Coarse spacings alone: a minute.")] = False,
) -> None:
    """Measure error against processor time on cases with a known solution; table and draw it."""
    from pipeline.studies.bench import bench as measure

    with exit_on_errors():
        for path in measure(to, typer.echo, quick=quick):
            typer.echo(str(path))


def stress(
    files: Annotated[
        list[Path] | None,
        typer.Argument(metavar="[FILES]...", help="Scenario files in place of drawn scenes."),
    ] = None,
    scenes: Annotated[
        int | None, typer.Option(min=1, help="Scenes to draw; 100, or 5000 with --claim.", show_default=False)
    ] = None,
    seed: Annotated[int, typer.Option(min=0, help="Seed they are drawn from.")] = 1,
    claim: Annotated[
        bool, typer.Option("--claim", help="Draw five seeds from a hash of the code, in place of --seed.")
    ] = False,
    only: Annotated[
        list[Section] | None, typer.Option(help="Draw only scenes that have it; may be given again.")
    ] = None,
    workers: Annotated[int, typer.Option(min=1, help="Worker processes.")] = 2,
    work: Annotated[float, typer.Option(min=1, help="Cell-stages after which a scene ends.")] = 2e6,
    to: Annotated[Path, typer.Option(help="Folder to write to.")] = Path("stress"),
    page: Annotated[
        Path | None, typer.Option(help="Page of Markdown to put the tables into, as docs/stability.md.")
    ] = None,
) -> None:
    """Try to break the solver: run random scenes and check the laws of the equations at their steps.

    Scenes run in pieces of 500. What is in TO/pieces of the same code is not run again: a campaign that was
    cut off goes on where it was.

    Exit codes: 0 the conservative form keeps all laws, 1 it does not; scenario files of what fails are in
    TO/failing.
    """
    from pipeline.studies.stress import pieces

    many = scenes or (pieces.SCENES if claim else 100)
    with exit_on_errors():
        reports, failing = pieces.stress(
            to,
            typer.echo,
            many,
            seed,
            workers,
            files,
            work,
            claim=claim,
            page=page,
            sections=tuple(sorted(section.value for section in set(only or ()))),
        )
    for path in [*reports, *failing]:
        typer.echo(str(path))
    raise typer.Exit(SOME_FAILED if failing else 0)
