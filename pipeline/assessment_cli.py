"""Commands that make of a place's runs what an assessment needs."""

from __future__ import annotations

from enum import StrEnum
from pathlib import Path
from typing import Annotated

import typer

from pipeline.options import BAD_INPUT, TROUBLE, Out, end, ending

commands = typer.Typer()

Density = Annotated[float, typer.Option(min=0, help="Density of the moving mass, kg m-3.")]
DENSITY = 2000.0


class Kind(StrEnum):
    """How a table is written."""

    CSV = "csv"
    PARQUET = "parquet"
    MARKDOWN = "md"


@commands.command()
def tables(
    out: Out,
    to: Annotated[Path | None, typer.Option(help="Folder to write to.", show_default="OUT/tables")] = None,
    kind: Annotated[
        list[Kind] | None, typer.Option(help="May be repeated.", show_default="csv and md")
    ] = None,
    density: Density = DENSITY,
) -> None:
    """Table runs, scenarios and receptors, with the runs behind each number and its bounds."""
    from pipeline.assessment import assess, write

    with ending({FileNotFoundError: BAD_INPUT, ValueError: BAD_INPUT}):
        made = assess(out, density)
    try:
        with ending({OSError: TROUBLE}):
            paths = write(made, to or out / "tables", kind or [Kind.CSV, Kind.MARKDOWN])
    except ImportError:
        end("Parquet needs pyarrow: pip install 'lmls[parquet]'")
    for path in paths:
        typer.echo(str(path))
