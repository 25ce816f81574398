"""The command that tries to break the solver."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from pipeline.cli.options import BAD_INPUT, TROUBLE, ending

BROKEN = 1


def stress(
    files: Annotated[
        list[Path] | None,
        typer.Argument(metavar="[FILES]...", help="Scenario files in place of drawn scenes."),
    ] = None,
    scenes: Annotated[int, typer.Option(min=1, help="Scenes to draw.")] = 100,
    seed: Annotated[int, typer.Option(min=0, help="Seed they are drawn from.")] = 1,
    workers: Annotated[int, typer.Option(min=1, help="Worker processes.")] = 2,
    work: Annotated[float, typer.Option(min=1, help="Cell-stages after which a scene ends.")] = 2e6,
    to: Annotated[Path, typer.Option(help="Folder to write to.")] = Path("stress"),
) -> None:
    """Try to break the solver: run random scenes and check the laws of the equations at their steps.

    Exit codes: 0 the conservative form keeps all laws, 1 it does not; scenario files of what fails are in
    TO/failing.
    """
    from pipeline.mistakes import BadInput
    from pipeline.studies.stress.campaign import stress as try_to_break

    with ending({BadInput: BAD_INPUT, OSError: TROUBLE}):
        reports, failing = try_to_break(to, typer.echo, scenes, seed, workers, files, work)
    for path in [*reports, *failing]:
        typer.echo(str(path))
    raise typer.Exit(BROKEN if failing else 0)
