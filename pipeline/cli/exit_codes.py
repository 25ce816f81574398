"""Exit codes of the commands, and which error ends with which."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager
from typing import NoReturn

import typer

from pipeline.errors import (
    BadInput,
    ChangedError,
    EngineError,
    MissingExtraError,
    OptionError,
    PlaceInUseError,
)

SOME_FAILED = 1
BAD_INPUT = 2
TROUBLE = 3
IN_USE = 4

# the first kind that an error is of gives its code
ALWAYS: tuple[tuple[type[Exception], int], ...] = (
    (BadInput, BAD_INPUT),
    (ChangedError, BAD_INPUT),
    (OptionError, BAD_INPUT),
    (MissingExtraError, BAD_INPUT),
    (PlaceInUseError, IN_USE),
    (EngineError, TROUBLE),
)
# commands that read results are asked for what is not there
READING: tuple[tuple[type[Exception], int], ...] = ((FileNotFoundError, BAD_INPUT), (ValueError, BAD_INPUT))


@contextmanager
def exit_on_errors(*, reading: bool = False) -> Iterator[None]:
    """End a command with the message and the exit code of an error.

    Parameters
    ----------
    reading : bool
        Whether the command reads results: what is not there, or does not fit, is bad input then.
    """
    try:
        yield
    except Exception as error:
        code = _code(error, reading)
        if code is None:
            raise
        typer.echo(_words(error), err=True)
        raise typer.Exit(code) from None


def end(message: str) -> NoReturn:
    """End with a mistake of the user's."""
    typer.echo(message, err=True)
    raise typer.Exit(BAD_INPUT)


def _code(error: Exception, reading: bool) -> int | None:
    known: list[tuple[type[Exception], int]] = [*ALWAYS, *(READING if reading else ()), (OSError, TROUBLE)]
    found = next((code for kind, code in known if isinstance(error, kind)), None)
    if found is None:
        from pipeline.store.objects import unreachable

        return TROUBLE if isinstance(error, unreachable()) else None
    return found


def _words(error: Exception) -> str:
    if isinstance(error, OptionError):
        name = error.option
        option = name if name.startswith("-") or name in ("out", "store") else f"--{name.replace('_', '-')}"
        return f"{option}: {error.message}" if name else error.message
    if isinstance(error, ChangedError):
        return f"{error}\nuse --overwrite to replace, or another --out"
    if isinstance(error, OSError) and error.strerror and error.filename:
        return f"{error.filename}: {error.strerror}"
    return str(error)
