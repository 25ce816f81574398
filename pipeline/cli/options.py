"""Arguments and options that several commands have."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from pipeline.cli.exit_codes import end


def read_place(text: str | Path) -> Path:
    """Give the path of a folder or of a URL, or end."""
    from pipeline.store.storage import located

    try:
        return located(str(text))
    except (ImportError, ValueError) as error:
        end(f"{text}: {error}; S3 needs s3fs: pip install 'lmls[s3]'")


Files = Annotated[list[Path], typer.Argument(metavar="FILES...", help="Scenario files.")]
Out = Annotated[
    Path, typer.Argument(metavar="OUT", parser=read_place, help="The place results were written to.")
]
Store = Annotated[
    Path,
    typer.Argument(metavar="STORE", parser=read_place, help="Store of a scenario, <out>/<name>.zarr."),
]
Json = Annotated[bool, typer.Option("--json", help="Print JSON, for other programs.")]


def read_numbers(option: str, text: str | None, *, zero: bool = False) -> tuple[float, ...] | None:
    """Read numbers above 0, or with ``zero`` from 0 on, as ``0.5,1,2``, or end; None where none are given."""
    if text is None:
        return None
    try:
        found = tuple(sorted({float(part) for part in text.split(",")}))
    except ValueError:
        found = (-1.0,)
    if not all((zero and value == 0) or 0 < value < float("inf") for value in found):
        end(f"{option}: expected numbers {'from 0 on' if zero else 'above 0'} as 0.5,1,2, found '{text}'")
    return found
