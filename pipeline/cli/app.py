"""The command line. Heavy imports stand inside commands, so that help and mistakes come at once."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from pipeline.cli import assess, maps, stress
from pipeline.cli.options import (
    BAD_INPUT,
    TROUBLE,
    Codes,
    Out,
    Store,
    end,
    ending,
    read_bytes,
    read_engine,
    read_part,
    read_place,
)

if TYPE_CHECKING:
    import pandas as pd
    from rich.console import Console

    from pipeline.scenario.scenario import Scenario

SOME_FAILED = 1
IN_USE = 4

app = typer.Typer(
    add_completion=False,
    no_args_is_help=True,
    pretty_exceptions_enable=False,
    rich_markup_mode=None,
    help="Granular debris-flow scenarios: from YAML files to Zarr stores and a table.",
)

Files = Annotated[list[Path], typer.Argument(metavar="FILES...", help="Scenario files.")]


@app.command()
def run(
    files: Files,
    out: Annotated[
        Path,
        typer.Option(
            metavar="PLACE", parser=read_place, help="Folder or URL, as s3://bucket/path, for results."
        ),
    ] = Path("results"),
    workers: Annotated[
        int | None, typer.Option(min=1, help="Worker processes.", show_default="all cores")
    ] = None,
    overwrite: Annotated[
        bool, typer.Option("--overwrite", help="Replace stores of changed scenarios.")
    ] = False,
    retry_failed: Annotated[bool, typer.Option("--retry-failed", help="Do failed runs again.")] = False,
    memory_limit: Annotated[
        str | None, typer.Option(help="Memory a run may take, as 2GB.", show_default="no limit")
    ] = None,
    checkpoint_every: Annotated[
        float, typer.Option(min=0, help="Seconds between two checkpoints of a long run.")
    ] = 60.0,
    scheduler: Annotated[
        str | None, typer.Option(metavar="ADDRESS", help="Join a running Dask cluster, tcp://host:port.")
    ] = None,
    jobqueue: Annotated[
        str | None, typer.Option(metavar="KIND", help="Have workers started as jobs of a queue: slurm.")
    ] = None,
    part: Annotated[
        str | None, typer.Option(metavar="I/N", help="Do one of N parts of the runs, in this process.")
    ] = None,
    log: Annotated[
        Path | None,
        typer.Option(help="File that gets a line a run.", show_default="OUT/runs.log; of a URL, none"),
    ] = None,
) -> None:
    """Do what is left of the scenarios' runs.

    Finished runs are not done again.

    Exit codes: 0 all done, 1 some runs failed, 2 bad input, 3 trouble of the place (runs stay pending),
    4 the place is in use, 130 interrupted.
    """
    scenarios = _load(files)
    from pipeline.batch.driver import ChangedError, complete
    from pipeline.batch.limits import Limits
    from pipeline.batch.remote_workers import EngineError
    from pipeline.mistakes import BadInput
    from pipeline.store.place import WHOLE, PlaceInUseError, held, held_in_part, summary_path
    from pipeline.store.provenance import identity

    console, mine = _console(), read_part(part, overwrite)
    engine = read_engine(scheduler, jobqueue, part, workers)
    asked = identity("".join(scenario.digest for scenario in scenarios))
    codes: Codes = {BadInput: BAD_INPUT, PlaceInUseError: IN_USE, OSError: TROUBLE, EngineError: TROUBLE}
    try:
        with ending(codes), held(out) if mine == WHOLE else held_in_part(out, mine, asked) as alone:
            outcome = complete(
                scenarios,
                out,
                console,
                count=workers,
                overwrite=overwrite,
                retry_failed=retry_failed,
                limits=Limits(read_bytes(memory_limit)),
                checkpoint_every=checkpoint_every,
                engine=engine,
                part=mine,
                sweep=alone is not False,
                log=log,
            )
    except ChangedError as error:
        end(f"{error}\nuse --overwrite to replace, or another --out")
    _print(console, outcome.table[outcome.table["scenario"].isin([scenario.name for scenario in scenarios])])
    for path in [*(out / f"{scenario.name}.zarr" for scenario in scenarios), summary_path(out)]:
        console.print(str(path), soft_wrap=True, highlight=False)
    if outcome.ending.trouble:
        typer.echo(outcome.ending.trouble, err=True)
    raise typer.Exit(outcome.exit_code)


@app.command()
def validate(files: Files) -> None:
    """Check scenario files and list the runs they make; write nothing."""
    from pipeline.runs.runs import expand
    from pipeline.runs.size import size

    for scenario in _load(files):
        runs = expand(scenario)
        count = f"{len(runs)} run{'s' if len(runs) > 1 else ''}"
        large = size(scenario) or "points known once the domain is found"
        typer.echo(f"{scenario.path}: {scenario.name}: {count}, {large}")
        for each in runs:
            if each.parameters:
                values = ", ".join(f"{name}={value}" for name, value in each.parameters.items())
                typer.echo(f"  {each.index}: {values}")


@app.command()
def status(out: Out) -> None:
    """Say how far each scenario is, what made it, and who is at the place; write nothing."""
    from pipeline.store.status import survey, use

    with ending({FileNotFoundError: BAD_INPUT}):
        for found in survey(out):
            typer.echo(str(found))
    typer.echo(use(out))


@app.command()
def verify(out: Out) -> None:
    """Compute the digest of every run again; write nothing.

    Exit codes: 0 all is as it was written, 1 something is not, 2 there are no results.
    """
    from pipeline.store.place import store_paths
    from pipeline.store.verify import verify

    with ending({FileNotFoundError: BAD_INPUT}):
        paths = store_paths(out)
    reports = [verify(path) for path in paths]
    for report in reports:
        typer.echo(f"{report.name}: {report.runs} ended runs, {len(report.faults) or 'no'} faults")
        for fault in report.faults:
            typer.echo(fault, err=True)
    raise typer.Exit(SOME_FAILED if any(report.faults for report in reports) else 0)


@app.command()
def schema() -> None:
    """Print the JSON Schema of a scenario file, for editors."""
    import json

    from pipeline.scenario.scenario import json_schema

    typer.echo(json.dumps(json_schema(), indent=2))


@app.command()
def summary(
    out: Out,
    to: Annotated[
        Path | None, typer.Option(help="File to write: .csv or .parquet.", show_default="OUT/summary.csv")
    ] = None,
) -> None:
    """Print the table of a place; write it as CSV or Parquet."""
    if to is not None and to.suffix not in (".csv", ".parquet"):
        end(f"{to}: expected a file ending in .csv or .parquet")
    from pipeline.store import run_table
    from pipeline.store.place import summary_path

    with ending({FileNotFoundError: BAD_INPUT}):
        whole = run_table.read(out)
    path = to or summary_path(out)
    try:
        with ending({OSError: TROUBLE}):
            run_table.write(whole, path)
    except ImportError:
        end("Parquet needs pyarrow: pip install 'lmls[parquet]'")
    console = _console()
    _print(console, whole)
    console.print(str(path), soft_wrap=True, highlight=False)


@app.command()
def plot(
    store: Store,
    run: Annotated[int, typer.Option(min=0, help="Position of the run in the store.")] = 0,
    to: Annotated[
        Path | None,
        typer.Option(help="Picture to write.", show_default="STORE with .png for .zarr; of a URL, here"),
    ] = None,
) -> None:
    """Draw the depth of a run at its output times."""
    from pipeline.assess.plots import depth_panels
    from pipeline.store.storage import at_hand
    from pipeline.store.zarr_store import open_store

    path = to or at_hand(store.with_suffix(".png"))
    codes: Codes = {FileNotFoundError: BAD_INPUT, ValueError: BAD_INPUT, OSError: TROUBLE}
    with ending(codes), open_store(store) as opened:
        depth_panels(opened, run, path)
    typer.echo(str(path))


@app.command()
def figures(
    out: Out,
    to: Annotated[
        Path | None, typer.Option(help="Folder to write to.", show_default="OUT/figures; of a URL, figures")
    ] = None,
) -> None:
    """Draw and table the runs of a place side by side, as the paper's figures 3 to 7 do."""
    from pipeline.report.comparison import draw
    from pipeline.store.storage import at_hand

    with ending({FileNotFoundError: BAD_INPUT, OSError: TROUBLE}):
        for path in draw(out, to or at_hand(out / "figures")):
            typer.echo(str(path))


for command in (
    assess.tables,
    maps.hazard,
    assess.sensitivity,
    assess.calibrate,
    maps.report,
    stress.stress,
):
    app.command()(command)


@app.command()
def bench(
    to: Annotated[Path, typer.Option(help="Folder to write to.")] = Path("bench"),
    quick: Annotated[bool, typer.Option("--quick", help="Coarse spacings alone: a minute.")] = False,
) -> None:
    """Measure error against processor time on cases with a known solution; table and draw it."""
    from pipeline.studies.bench import bench as measure

    with ending({OSError: TROUBLE}):
        for path in measure(to, typer.echo, quick=quick):
            typer.echo(str(path))


def _load(files: list[Path]) -> list[Scenario]:
    """Load scenarios, or end with every mistake on a line of its own."""
    from pipeline.scenario.scenario import BadInput, load

    with ending({BadInput: BAD_INPUT}):
        scenarios = load(files)
    for scenario in scenarios:
        for warning in scenario.warnings:
            typer.echo(warning, err=True)
    return scenarios


def _console() -> Console:
    """Give the terminal, or plain lines as wide as a table needs."""
    from rich.console import Console

    console = Console()
    return console if console.is_terminal else Console(width=160)


def _print(console: Console, whole: pd.DataFrame) -> None:
    from pipeline.cli.display import runs_table

    console.print(runs_table(whole, console.width))


def main() -> None:
    """Entry point of the ``pipeline`` command."""
    app()


if __name__ == "__main__":
    main()
