"""Scenarios: what a YAML file says, checked, with the text it was read from."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING

from pipeline.mistakes import BadInput, Mistake
from pipeline.settings import Settings, json_schema

if TYPE_CHECKING:
    from pipeline.elevation_table import ElevationTable

__all__ = ["BadInput", "Mistake", "Scenario", "Settings", "differences", "json_schema", "load"]


@dataclass(frozen=True)
class Scenario:
    """One file of the catalogue.

    settings : the file's content with defaults filled in, before any sweep.
    path, text : the file and what stands in it.
    content : canonical JSON of everything that decides the result (description left out, tables by digest).
    digest : SHA-256 of ``content``, hexadecimal.
    tables : elevation tables by the name the settings give them.
    warnings : one line each, to be shown and not to be stopped by.
    """

    settings: Settings
    path: Path
    text: str
    content: str
    digest: str
    tables: Mapping[str, ElevationTable]
    warnings: tuple[str, ...] = ()

    @property
    def name(self) -> str:
        """Name of the scenario, which is that of its store."""
        return self.settings.name


def load(paths: Iterable[str | Path]) -> list[Scenario]:
    """Read and check scenario files, in the order given.

    Raises
    ------
    BadInput
        With every mistake of every file, if there is one.
    """
    raise NotImplementedError


def differences(before: str, after: str) -> list[str]:
    """Say key by key how two scenarios' ``content`` differ: ``key: was 26, is 30``."""
    raise NotImplementedError
