"""Arguments and options that several commands have."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from pipeline.api.places import find_place, find_store
from pipeline.cli.exit_codes import end, exit_on_errors
from pipeline.store.storage import Location


def read_place(text: str | Path) -> Location:
    """Give the path of a place, a folder or a URL, or end."""
    with exit_on_errors(reading=True):
        return find_place(str(text))


def read_store(text: str | Path) -> Location:
    """Give the path of a store, or end."""
    with exit_on_errors(reading=True):
        return find_store(str(text))


Files = Annotated[list[Path], typer.Argument(metavar="FILES...", help="Scenario files.")]
Out = Annotated[
    Location, typer.Argument(metavar="OUT", parser=read_place, help="The place results were written to.")
]
Store = Annotated[
    Location,
    typer.Argument(metavar="STORE", parser=read_store, help="Store of a scenario, <out>/<name>.zarr."),
]
Emulate = Annotated[
    bool, typer.Option("--emulate", help="Add emulated numbers of sampled scenarios, with their errors.")
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
