"""The command line. Heavy imports stand inside commands, so that help and mistakes come at once."""

from __future__ import annotations

from typing import Annotated

import typer

from pipeline.cli import assess, inspect, maps, run, studies

app = typer.Typer(
    no_args_is_help=True,
    pretty_exceptions_enable=False,
    rich_markup_mode=None,
    help="Granular debris-flow scenarios: from YAML files to Zarr stores and a table.",
)


def _show_version(wanted: bool) -> None:
    if wanted:
        from importlib.metadata import version

        typer.echo(f"lmls {version('lmls')}")
        raise typer.Exit


@app.callback()
def options(
    version: Annotated[
        bool,
        typer.Option("--version", callback=_show_version, is_eager=True, help="Print the version and exit."),
    ] = False,
) -> None:
    """Options of the command itself."""


for command in (
    run.run,
    run.validate,
    inspect.status,
    inspect.verify,
    inspect.summary,
    maps.plot,
    maps.figures,
    maps.film,
    assess.tables,
    maps.hazard,
    maps.emulate,
    maps.compare,
    assess.sensitivity,
    assess.calibrate,
    maps.report,
    studies.bench,
    studies.stress,
    run.schema,
):
    app.command()(command)


def main() -> None:
    """Entry point of the ``pipeline`` command."""
    app()
