"""Commands that make of a place's runs what an assessment needs."""

from __future__ import annotations

from enum import StrEnum
from pathlib import Path
from typing import Annotated

import typer

from pipeline.cli.options import BAD_INPUT, TROUBLE, Out, Store, end, ending


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
) -> None:
    """Table runs, scenarios and receptors, with the runs behind each number and its bounds."""
    from pipeline.assess.tables import assess, write
    from pipeline.store.storage import at_hand

    with ending({FileNotFoundError: BAD_INPUT, ValueError: BAD_INPUT}):
        made = assess(out)
    try:
        with ending({OSError: TROUBLE}):
            paths = write(made, to or at_hand(out / "tables"), kind or [Kind.CSV, Kind.MARKDOWN])
    except ImportError:
        end("Parquet needs pyarrow: pip install 'lmls[parquet]'")
    for path in paths:
        typer.echo(str(path))


def sensitivity(
    out: Out,
    to: Annotated[
        Path | None,
        typer.Option(help="Table to write: .csv, .parquet or .md.", show_default="OUT/sensitivity.csv"),
    ] = None,
) -> None:
    """Table which varied parameter drives run-out, deposit and what reaches receptors."""
    from pipeline.assess.sensitivity import sensitivity as indices
    from pipeline.store import run_table
    from pipeline.store.place import indices_path

    path = to or indices_path(out)
    try:
        with ending({FileNotFoundError: BAD_INPUT, ValueError: BAD_INPUT, OSError: TROUBLE}):
            found = indices(out, lambda line: typer.echo(line, err=True))
            if len(found):
                run_table.write(found, path)
    except ImportError as error:
        extra = "parquet" if "arrow" in str(error) else "sensitivity"
        end(f"{error}: pip install 'lmls[{extra}]'")
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
    to: Annotated[
        Path | None,
        typer.Option(help="Folder to write to.", show_default="STORE with -calibration for .zarr"),
    ] = None,
) -> None:
    """Score runs by an observed deposit; table the best ones and the ranges of their parameters."""
    from pipeline.assess.calibration import posterior, score
    from pipeline.assess.observed import ObservationError, read
    from pipeline.assess.tables import write
    from pipeline.scenario.scenario import stored
    from pipeline.store import run_table
    from pipeline.store.storage import at_hand
    from pipeline.store.zarr_store import open_store

    codes = {FileNotFoundError: BAD_INPUT, ObservationError: BAD_INPUT, OSError: TROUBLE}
    with ending(codes), open_store(store) as opened:
        least = threshold if threshold is not None else stored(opened.attrs).output.threshold
        if least is None:
            end("--threshold: expected a depth, as the scenario gives no output.threshold")
        try:
            deposit = read(observed, opened, least)
        except ImportError as error:
            end(f"{error}: pip install 'lmls[geo]'")
        scores = score(opened, deposit, least)
        made = {"scores": scores, "parameters": posterior(opened, scores, accepted)}
        folder = to or at_hand(store.with_name(f"{store.stem}-calibration"))
        paths = write(made, folder, [Kind.CSV, Kind.MARKDOWN])
    typer.echo(run_table.markdown(scores.head(10)))
    typer.echo(run_table.markdown(made["parameters"]))
    for path in paths:
        typer.echo(str(path))
