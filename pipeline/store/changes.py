"""What has changed between the scenario of a store and that of a file, in words."""

from __future__ import annotations

import json
import re
from collections.abc import Iterator, Mapping
from typing import Any

from pipeline.mistakes import describe

DIGEST = re.compile("[0-9a-f]{64}")
# keys of ``content`` with digests of files: by name of file, and of one file with the key that names it
OF_FILES = ("tables", "hydrographs", "map_files.polygons", "map_files.erodible_depth", "map_files.elevation")
OF_ONE_FILE = {"map_files.elevation": "terrain.elevation", "points.file": "points.path"}
# what differs where others do: rasters are read around the domain, values are drawn from the sample
FOLLOWS = (
    ("map_files.elevation", ("domain", "points", "terrain")),
    ("map_files.erodible_depth", ("domain", "points", "terrain")),
    ("draws", ("sample",)),
)


def differences(before: str, after: str) -> list[str]:
    """Say key by key how two scenarios' ``content`` differ: ``material.bed_friction: was 26, is 30``.

    Of files it is said that their content has changed. What follows from another difference is left out.
    """
    old, new = dict(_leaves(json.loads(before))), dict(_leaves(json.loads(after)))
    changed = [key for key in {**old, **new} if old.get(key) != new.get(key)]
    found = []
    for key in changed:
        follows_from = next((keys for name, keys in FOLLOWS if _below(key, name)), ())
        if any(_below(other, name) for other in changed for name in follows_from):
            continue
        if not (_is_digest(old.get(key)) and _is_digest(new.get(key))):
            found.append(f"{key}: was {describe(old.get(key))}, is {describe(new.get(key))}")
        elif key == "draws":
            found.append(f"{key}: the values drawn have changed, as with another version of SciPy")
        else:
            found.append(f"{key}: the content of {_file(key, new)} has changed")
    return found


def _below(key: str, name: str) -> bool:
    return key == name or key.startswith(f"{name}.")


def _is_digest(value: Any) -> bool:
    return isinstance(value, str) and DIGEST.fullmatch(value) is not None


def _file(key: str, held: Mapping[str, Any]) -> str:
    """Name the file whose digest is at a key of ``content``."""
    if (named := OF_ONE_FILE.get(key)) is not None:
        name = str(held.get(named, "the file"))
        return f"{name} around the domain" if key.startswith("map_files") else name
    # names of files may hold dots
    return next((key.removeprefix(f"{name}.") for name in OF_FILES if _below(key, name)), "the file")


def _leaves(value: Any, key: str = "") -> Iterator[tuple[str, Any]]:
    """Go through the single values of nested JSON, each with its dotted key."""
    if isinstance(value, dict | list) and value:
        items = value.items() if isinstance(value, dict) else enumerate(value)
        for name, inner in items:
            yield from _leaves(inner, f"{key}.{name}" if key else str(name))
    else:
        yield key, value
