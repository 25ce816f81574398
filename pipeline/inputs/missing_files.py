"""Files that the data of a scenario names and that do not exist, whatever else is wrong with it."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from pathlib import Path as FilePath
from typing import Any

from pipeline.mistakes import Problem

Path = tuple[str | int, ...]
# keys whose text is the name of a file; a number stands for any item of a list, which one item may stand for
_KEYS: tuple[Path, ...] = (
    ("terrain", "elevation"),
    ("terrain", "file"),
    ("points", "path"),
    ("release", 0, "polygons"),
    ("material", "zones", 0, "polygon"),
    ("material", "zones", 0, "raster"),
    ("erodible_bed", "polygons"),
    ("erodible_bed", "depth"),
    ("erodible_bed", "zones", 0, "polygon"),
    ("erodible_bed", "zones", 0, "raster"),
    ("structures", 0, "line"),
    ("structures", 0, "polygon"),
    ("inflow", 0, "hydrograph", "file"),
    ("receptors",),
    ("receptors", "file"),
)


def not_found(file: FilePath) -> str:
    """Say that a file does not exist."""
    return f"expected a readable file, found none: {file}"


def missing_files(data: Mapping[str, Any], folder: FilePath) -> list[Problem]:
    """List the files that do not exist, each with the key that names it.

    Parameters
    ----------
    data : mapping
        What stands in the file of a scenario, right or wrong.
    folder : Path
        That names of files are relative to.
    """
    return [
        Problem(("receptors",) if path[0] == "receptors" else path, not_found(folder / name))
        for key in _KEYS
        for path, name in _texts(data, key)
        if name and not (folder / name).exists()
    ]


def _texts(data: Any, key: Path, before: Path = ()) -> Iterator[tuple[Path, str]]:
    """Find the texts at a key, each with its path."""
    if not key:
        if isinstance(data, str):
            yield before, data
        return
    part, *rest = key
    if isinstance(part, int):
        items = enumerate(data) if isinstance(data, tuple) else ()
        for i, item in items:
            yield from _texts(item, tuple(rest), (*before, i))
        if isinstance(data, Mapping):
            yield from _texts(data, tuple(rest), before)
    elif isinstance(data, Mapping) and part in data:
        yield from _texts(data[part], tuple(rest), (*before, part))
