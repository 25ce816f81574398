"""Commands that tell what a place holds."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Annotated

import typer

import pipeline
from pipeline.cli.exit_codes import SOME_FAILED, exit_on_errors
from pipeline.cli.options import Json, Out


def status(out: Out, as_json: Json = False) -> None:
    """Tell how far each scenario is, why runs failed, what made it, and who uses the place; write nothing."""
    from pipeline.batch.failures import failed, told_again
    from pipeline.store.place import holder
    from pipeline.store.status import survey, use
    from pipeline.store.variables import CHOSEN_FOR

    with exit_on_errors(reading=True):
        surveys = list(survey(out))
        reasons = {found.name: failed(out, found.name) for found in surveys}
        if as_json:
            held = [
                {
                    "name": found.name,
                    "runs": {state.words: count for state, count in sorted(found.statuses.items())},
                    "made_by": {
                        name: value
                        for name, value in found.attributes.items()
                        if name.endswith(("_version", "_hash"))
                    },
                    **(
                        {"chosen_for": found.attributes[CHOSEN_FOR]} if CHOSEN_FOR in found.attributes else {}
                    ),
                    "failures": [each.described for each in reasons[found.name]],
                }
                for found in surveys
            ]
            typer.echo(json.dumps({"scenarios": held, "in_use_by": holder(out)}, indent=2))
            return
        for found in surveys:
            typer.echo(str(found))
        for line in told_again([each for name in reasons for each in reasons[name]]):
            typer.echo(line)
    typer.echo(use(out))


def verify(out: Out) -> None:
    """Compute the digest of every run again; write nothing.

    Exit codes: 0 all is as it was written, 1 something is not, 2 there are no results.
    """
    from pipeline.cli.display import working
    from pipeline.store.place import store_name, store_paths, with_levels
    from pipeline.store.verify import verify

    with exit_on_errors(reading=True):
        paths = with_levels(store_paths(out))
    reports = []
    with working("verify") as told:
        for path in paths:
            told.stage(store_name(path))
            reports.append(verify(path))
    for report in reports:
        typer.echo(f"{report.name}: {report.runs} ended runs, {len(report.faults) or 'no'} faults")
        for fault in report.faults:
            typer.echo(fault, err=True)
    raise typer.Exit(SOME_FAILED if any(report.faults for report in reports) else 0)


def summary(
    out: Out,
    to: Annotated[
        Path | None,
        typer.Option(help="File to write: .csv, .parquet or .md.", show_default="OUT/summary.csv"),
    ] = None,
    as_json: Json = False,
) -> None:
    """Print the table of a place; write it as CSV or Parquet."""
    from pipeline.cli.display import show_table, width
    from pipeline.store.place import summary_path

    path = to or summary_path(out)
    with exit_on_errors(reading=True):
        table = pipeline.run_table(out, to=path)
    if as_json:
        typer.echo(table.to_json(orient="records", indent=2))
        return
    show_table(table, width())
    typer.echo(str(path))
