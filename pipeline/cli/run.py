"""Commands that take scenario files: check them, run them."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

import pipeline
from pipeline.cli.exit_codes import BAD_INPUT, exit_on_errors
from pipeline.cli.options import Files, Json, read_place
from pipeline.errors import BadInput
from pipeline.readable import number

if TYPE_CHECKING:
    from pipeline.runs.run import Run

# runs that validate lists before it gives the ranges of all
MOST_LISTED = 10


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
    next_runs: Annotated[
        int | None,
        typer.Option(
            "--next", min=1, help="Choose and do so many further runs, where --for is least certain."
        ),
    ] = None,
    for_: Annotated[
        str | None,
        typer.Option(
            "--for", metavar="TARGET", help="Threshold at a receptor, as 'school: depth > 1.2', for --next."
        ),
    ] = None,
    log: Annotated[
        Path | None,
        typer.Option(help="File that gets a line a run.", show_default="OUT/runs.log; of a URL, none"),
    ] = None,
    quiet: Annotated[bool, typer.Option("--quiet", "-q", help="Show no progress and no table.")] = False,
) -> None:
    """Do what is left of the scenarios' runs.

    Finished runs are not done again.

    Exit codes: 0 all done, 1 some runs failed, 2 bad input, 3 trouble of the place (runs stay pending),
    4 the place is in use, 130 interrupted.
    """
    with exit_on_errors():
        results = pipeline.run(
            files,
            out,
            workers=workers,
            overwrite=overwrite,
            retry_failed=retry_failed,
            memory_limit=memory_limit,
            checkpoint_every=checkpoint_every,
            scheduler=scheduler,
            jobqueue=jobqueue,
            part=part,
            next=next_runs,
            for_=for_,
            log=log,
            quiet=quiet,
            warn=_warn,
            check=False,
        )
    if not quiet:
        from pipeline.cli.display import show_results

        show_results(results)
    if results.trouble:
        typer.echo(results.trouble, err=True)
    raise typer.Exit(results.exit_code)


def validate(files: Files, as_json: Json = False) -> None:
    """Check scenario files and list the runs they make; write nothing."""
    from pipeline.runs.runs import expand
    from pipeline.runs.size import size

    try:
        scenarios = pipeline.load(files)
    except BadInput as error:
        if as_json:
            _print_json({"mistakes": [vars(mistake) for mistake in error.mistakes]})
        else:
            typer.echo(str(error), err=True)
        raise typer.Exit(BAD_INPUT) from None
    if as_json:
        _print_json(
            {
                "scenarios": [
                    {
                        "file": str(scenario.path),
                        "name": scenario.name,
                        "warnings": list(scenario.warnings),
                        "runs": [dict(each.parameters) for each in expand(scenario)],
                    }
                    for scenario in scenarios
                ]
            }
        )
        return
    for scenario in scenarios:
        for warning in scenario.warnings:
            _warn(warning)
        runs = expand(scenario)
        count = f"{len(runs)} run{'s' if len(runs) > 1 else ''}"
        large = size(scenario) or "points known once the domain is found"
        typer.echo(f"{scenario.path}: {scenario.name}: {count}, {large}")
        for line in _listed(runs):
            typer.echo(f"  {line}")


def _listed(runs: Sequence[Run]) -> Iterator[str]:
    """List the parameters of runs, of many the first ones and the ranges of all."""
    for each in runs[:MOST_LISTED] if len(runs) > MOST_LISTED + 1 else runs:
        if each.parameters:
            yield f"{each.index}: " + "; ".join(f"{name}={number(v)}" for name, v in each.parameters.items())
    if len(runs) > MOST_LISTED + 1 and runs[0].parameters:
        ranges = []
        for name in runs[0].parameters:
            values = [each.parameters[name] for each in runs]
            if all(isinstance(value, int | float) for value in values):
                ranges.append(f"{name} from {number(min(values))} to {number(max(values))}")
            else:
                ranges.append(f"{name} one of {len({str(value) for value in values})}")
        yield f"... {len(runs) - MOST_LISTED} more (--json lists them). All: {'; '.join(ranges)}"


def schema() -> None:
    """Print the JSON Schema of a scenario file, for editors."""
    from pipeline.scenario.scenario import json_schema

    _print_json(json_schema())


def _warn(line: str) -> None:
    typer.echo(line, err=True)


def _print_json(content: Any) -> None:
    import json

    typer.echo(json.dumps(content, indent=2))
