"""Commands that make of a place's runs what an assessment needs."""

from __future__ import annotations

from enum import StrEnum
from pathlib import Path
from typing import Annotated

import typer

import pipeline
from pipeline.cli.exit_codes import exit_on_errors
from pipeline.cli.options import Emulate, Out, Store


class Kind(StrEnum):
    """How a table is written."""

    CSV = "csv"
    PARQUET = "parquet"
    MARKDOWN = "md"


def tables(
    out: Out,
    to: Annotated[Path | None, typer.Option(help="Folder to write to.", show_default="OUT/tables")] = None,
    kind: Annotated[
        list[Kind] | None, typer.Option(help="May be repeated.", show_default="csv and md")
    ] = None,
    emulate: Emulate = False,
) -> None:
    """Table runs, scenarios and receptors, with the runs behind each number and its bounds."""
    from pipeline.cli.display import working
    from pipeline.store.storage import at_hand

    with exit_on_errors(reading=True), working("tables") as told:
        pipeline.assessment_tables(
            out,
            to=to or at_hand(out / "tables"),
            kinds=kind or [Kind.CSV, Kind.MARKDOWN],
            emulate=emulate,
            tell=told.line,
            warn=told.warning,
        )


def sensitivity(
    out: Out,
    to: Annotated[
        Path | None,
        typer.Option(help="Table to write: .csv, .parquet or .md.", show_default="OUT/sensitivity.csv"),
    ] = None,
) -> None:
    """Table which varied parameter drives run-out, deposit and what reaches receptors."""
    from pipeline.cli.display import working
    from pipeline.store import run_table
    from pipeline.store.place import indices_path

    path = to or indices_path(out)
    with exit_on_errors(reading=True), working("sensitivity") as told:
        found = pipeline.sensitivity_indices(out, to=path, warn=told.warning)
    if found.empty:
        raise typer.Exit(1)
    typer.echo(run_table.markdown(found))
    typer.echo(str(path))


def calibrate(
    store: Store,
    observed: Annotated[
        Path,
        typer.Option(help="Outline (CSV of x, y; GeoPackage, GeoJSON) or depths (CSV, NetCDF, GeoTIFF)."),
    ],
    threshold: Annotated[
        float | None,
        typer.Option(min=0, help="Depth of a deposit, m.", show_default="the scenario's output.threshold"),
    ] = None,
    accepted: Annotated[float, typer.Option(min=0, max=1, help="Share of runs that is accepted.")] = 0.1,
    emulate: Annotated[
        bool, typer.Option("--emulate", help="Give the posterior over many emulated draws too.")
    ] = False,
    outline_error: Annotated[
        float | None,
        typer.Option(min=0, help="Error of the observed outline, m.", show_default="the spacing"),
    ] = None,
    to: Annotated[
        Path | None,
        typer.Option(help="Folder to write to.", show_default="STORE with -calibration for .zarr"),
    ] = None,
) -> None:
    """Score runs by an observed deposit; table the best ones and the ranges of their parameters."""
    from pipeline.cli.display import working
    from pipeline.store import run_table
    from pipeline.store.storage import at_hand

    folder = to or at_hand(store.with_name(f"{store.stem}-calibration"))
    written: list[str] = []
    with exit_on_errors(reading=True), working("calibrate") as told:
        made = pipeline.calibrate(
            store,
            observed,
            threshold=threshold,
            accepted=accepted,
            emulate=emulate,
            outline_error=outline_error,
            to=folder,
            tell=written.append,
            warn=told.warning,
        )
    typer.echo(run_table.markdown(made["scores"].head(10)))
    for title in ("parameters", "posterior"):
        if title in made:
            typer.echo(run_table.markdown(made[title]))
    for path in written:
        typer.echo(path)
