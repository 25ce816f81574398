"""Options that several functions of the public face take."""

from __future__ import annotations

import warnings
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager

from pipeline.errors import MissingExtraError, OptionError

Tell = Callable[[str], None]

# a limit below is one whose unit was forgotten
LEAST_MEMORY = 2**20


def silent(line: str) -> None:
    """Take a line that nobody reads."""


def warn_user(line: str) -> None:
    """Warn of a line, at the call of the public function."""
    warnings.warn(line, stacklevel=3)


def positive(option: str, values: Sequence[float]) -> tuple[float, ...]:
    """Give numbers above 0 in ascending order, each once."""
    for value in values:
        if not 0 < value < float("inf"):
            raise OptionError(option, f"expected numbers above 0, found {value:g}")
    return tuple(sorted({float(value) for value in values}))


def checked_thresholds(**given: Sequence[float] | None) -> dict[str, tuple[float, ...]]:
    """Check the thresholds that are given, by quantity; those of the scenarios stand for the others."""
    return {name: positive(name, values) for name, values in given.items() if values is not None}


def size_in_bytes(size: str | int | None) -> int | None:
    """Read a size as ``2GB``."""
    if size is None:
        return None
    from dask.utils import parse_bytes

    try:
        found = int(parse_bytes(size))
    except ValueError:
        found = -1
    if found < LEAST_MEMORY:
        note = "" if found < 0 else f", which is {found:,} bytes"
        raise OptionError("memory_limit", f"expected a size as 2GB or 500MiB, found '{size}'{note}")
    return found


@contextmanager
def extra(name: str) -> Iterator[None]:
    """Name the extra of the package that a missing import comes with."""
    try:
        yield
    except ImportError as error:
        raise MissingExtraError(f"{error}: pip install 'lmls[{name}]'") from error
