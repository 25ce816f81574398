"""Mistakes in what a user wrote: where, which key, what was expected and what was found."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass
from math import isinf, isnan
from typing import Any


@dataclass(frozen=True, order=True)
class Mistake:
    """One mistake and its place; sorts by place and prints as one line.

    Lines and columns count from 1; what was not read from a file has 0 of both.
    """

    file: str
    line: int
    column: int
    key: str
    message: str

    def __str__(self) -> str:
        """``file:line:column: key: expected ..., found ...``; the key is left out where there is none."""
        where = f"{self.file}:{self.line}:{self.column}" if self.line else self.file
        return ": ".join(filter(None, (where, self.key, self.message)))


@dataclass(frozen=True)
class Problem:
    """What is wrong at a path of the data.

    Parameters
    ----------
    at_key : bool
        Whether the key is wrong and not its value.
    related : tuple[tuple[str or int, ...], ...]
        Paths that the problem depends on, the one to blame first.
    hint : str
        The end of the message that says what may have been meant.
    """

    path: tuple[str | int, ...]
    message: str
    at_key: bool = False
    related: tuple[tuple[str | int, ...], ...] = ()
    hint: str = ""


class BadInput(Exception):  # noqa: N818 - it names what was given, not what broke
    """All mistakes of all files, each once, in the order of their places; ``str()`` is one line a mistake."""

    def __init__(self, mistakes: Iterable[Mistake]) -> None:
        self.mistakes: tuple[Mistake, ...] = tuple(sorted(set(mistakes)))
        super().__init__("\n".join(str(mistake) for mistake in self.mistakes))


def describe(value: Any) -> str:
    """Say what was found, as one would write it in YAML."""
    match value:
        case None:
            return "nothing"
        case bool():
            return str(value).lower()
        case str():
            return f"'{value}'"
        case float() if isnan(value):
            return ".nan"
        case float() if isinf(value):
            return ".inf" if value > 0 else "-.inf"
        case int() | float():
            return f"{value:.15g}"
        case dict():
            return "a mapping"
        case _:
            return "a list"
