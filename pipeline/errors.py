"""Errors that a caller of the package may want to catch; the command line gives each its exit code."""

from __future__ import annotations

from pipeline.mistakes import BadInput

__all__ = ["BadInput", "ChangedError", "EngineError", "MissingExtraError", "OptionError", "PlaceInUseError"]


class ChangedError(Exception):
    """Stores were made from other scenarios, or by another solver; ``str()`` has a line per difference."""


class EngineError(Exception):
    """The workers cannot be reached, or do not fit; ``str()`` says why."""


class MissingExtraError(ImportError):
    """A package is not installed that an extra of this one brings; ``str()`` says which."""


class PlaceInUseError(Exception):
    """Another driver holds the place; ``str()`` says which."""


class OptionError(ValueError):
    """An option has a value that it cannot have.

    Parameters
    ----------
    option : str
        Name of the parameter in Python, as ``memory_limit``; empty where the message names what it is about.
    message : str
        What was expected, and what was found.
    """

    def __init__(self, option: str, message: str) -> None:
        super().__init__(f"{option}: {message}" if option else message)
        self.option = option
        self.message = message
