"""What commands have in common: how they end on errors, and options that are more than a number or a path."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, NoReturn

import typer

from pipeline.store.storage import Location, located

if TYPE_CHECKING:
    from pipeline.batch.driver import Engine
    from pipeline.store.place import Part

Codes = Mapping[type[Exception], int]
BAD_INPUT = 2
TROUBLE = 3


def end(message: str) -> NoReturn:
    """End with a mistake."""
    typer.echo(message, err=True)
    raise typer.Exit(BAD_INPUT)


@contextmanager
def ending(codes: Codes) -> Iterator[None]:
    """End with an error's words and the first exit code whose kind it is of."""
    from pipeline.store.objects import unreachable

    known = {**codes, **dict.fromkeys(unreachable(), TROUBLE)}
    try:
        yield
    except tuple(known) as error:
        typer.echo(str(error), err=True)
        raise typer.Exit(next(code for kind, code in known.items() if isinstance(error, kind))) from None


def read_place(text: str | Path) -> Location:
    """Give the location of a place, or end."""
    from pipeline.store.place import not_a_place

    place = read_location(text)
    if place.suffix == ".zarr":
        end(not_a_place(place))
    if isinstance(place, Path) and place.is_file():
        end(f"{place}: expected a folder, found a file")
    return place


def read_location(text: str | Path) -> Location:
    """Give the location of a folder or of a URL, or end."""
    try:
        return located(str(text))
    except (ImportError, ValueError) as error:
        end(str(error))


Out = Annotated[
    Location, typer.Argument(metavar="OUT", parser=read_place, help="The place results were written to.")
]
Store = Annotated[
    Location,
    typer.Argument(metavar="STORE", parser=read_location, help="Store of a scenario, <out>/<name>.zarr."),
]


def read_engine(
    scheduler: str | None, jobqueue: str | None, part: str | None, workers: int | None
) -> Engine | None:
    """Choose the workers, or end; None for those of this machine."""
    from functools import partial

    from pipeline.batch.remote_workers import joined, queued

    given = {"--scheduler": scheduler, "--jobqueue": jobqueue, "--part": part}
    several = [option for option, value in given.items() if value is not None]
    if len(several) > 1:
        end(f"{' and '.join(several)}: expected one of them at most")
    if jobqueue not in (None, "slurm"):
        end(f"--jobqueue: expected slurm, found '{jobqueue}'")
    if scheduler is not None:
        return partial(joined, scheduler)
    return None if jobqueue is None else partial(queued, jobqueue, workers or 1)


def read_part(text: str | None, overwrite: bool) -> Part:
    """Read a part as ``2/8``, or end; the whole where nothing is given."""
    from pipeline.store.place import WHOLE, Part

    if text is None:
        return WHOLE
    index, _, count = text.partition("/")
    if not (index.isdecimal() and count.isdecimal() and 1 <= int(index) <= int(count)):
        end(f"--part: expected a part as 1/8 to 8/8, found '{text}'")
    if overwrite:
        end("--overwrite: expected without --part, as each part would replace the store of the others")
    return Part(int(index), int(count))


def read_bytes(text: str | None) -> int | None:
    """Read a size as ``2GB``, or end."""
    from dask.utils import parse_bytes

    try:
        return None if text is None else int(parse_bytes(text))
    except ValueError:
        end(f"--memory-limit: expected a size as 2GB or 500MiB, found '{text}'")


def read_numbers(option: str, text: str | None) -> tuple[float, ...] | None:
    """Read numbers above 0 as ``0.5,1,2``, or end; None where nothing is given."""
    try:
        found = None if text is None else tuple(sorted({float(part) for part in text.split(",")}))
    except ValueError:
        found = (-1.0,)
    if found is not None and not all(0 < value < float("inf") for value in found):
        end(f"{option}: expected numbers above 0 as 0.5,1,2, found '{text}'")
    return found
