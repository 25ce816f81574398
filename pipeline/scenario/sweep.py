"""Varied keys: the dotted key of a scenario that a value replaces, and the name it has in the store."""

from __future__ import annotations

import re
from collections import Counter
from collections.abc import Iterable, Mapping, Sequence
from typing import Any

from pipeline.scenario.strict_yaml import Path
from pipeline.settings.section import declared
from pipeline.settings.settings import Settings
from pipeline.settings.surface import PolygonsRelease
from pipeline.store.variables import COORDINATES, RETURN_PERIOD, WEIGHT, kept

SWEEPABLE = (
    "gravity",
    "terrain",
    "release",
    "inflow",
    "material",
    "erodible_bed",
    "structures",
    "boundaries",
    "scheme",
)
_TAKEN = {"run", "scenario", *(variable.name for variable in (*COORDINATES, WEIGHT, RETURN_PERIOD, *kept()))}

Value = int | float | str | bool


def path_of(key: str, data: Mapping[str, Any]) -> Path | None:
    """Give the path of a dotted key; None where a run of its own store would differ, or a part leads nowhere.

    Sections that may be left out are passed through; whether the last part exists is for the schema to say.
    A single release or inflow may be addressed as the first of a list, and polygons by their name.
    """
    names = key.split(".")
    if names[0] not in SWEEPABLE:
        return None
    if names[0] == "release" and (below := _of_polygon(names[1:], data.get("release"))) is not None:
        return ("release", *below)
    path: list[str | int] = []
    node: Any = data
    for name in names:
        if isinstance(node, tuple):
            if not (name.isdigit() and int(name) < len(node)):
                return None
            path.append(int(name))
            node = node[int(name)]
        elif isinstance(node, Mapping) and path in (["release"], ["inflow"]) and name == "0":
            continue
        elif isinstance(node, Mapping):
            path.append(name)
            node = node.get(name, {})
        else:
            return None
    return tuple(path)


def _of_polygon(names: list[str], release: Any) -> Path | None:
    """Give the path below ``release`` of a key that names a polygon; None of one that does not.

    A name is that which a release asks for, that of the one layer it takes, or that of one of its polygons,
    which ``each`` holds. Of several releases it must be clear which one is meant.
    """
    if isinstance(release, tuple):
        if len(names) > 2 and names[0].isdigit() and int(names[0]) < len(release):
            below = _of_polygon(names[1:], release[int(names[0])])
            return None if below is None else (int(names[0]), *below)
        found = named(names, release)
        return (found[0], *(_of_polygon(names, release[found[0]]) or ())) if len(found) == 1 else None
    if names[:1] == ["0"]:
        names = names[1:]
    if not isinstance(release, Mapping) or "polygons" not in release or len(names) < 2 or names[0] == "each":
        return None
    *parts, last = names
    name = ".".join(parts)
    return (last,) if name in (release.get("name"), _layer(release)) else ("each", name, last)


def named(names: list[str], releases: Sequence[Any]) -> list[int]:
    """List which of several releases a key may mean that begins with the name of a polygon.

    Those that ask for the name or its layer, or where there are none those that take all of a layer.
    """
    outlined = [
        (i, each) for i, each in enumerate(releases) if isinstance(each, Mapping) and "polygons" in each
    ]
    name = ".".join(names[:-1])
    if not name or names[0].isdigit():
        return []
    asked = [i for i, each in outlined if name in (each.get("name"), _layer(each))]
    return asked or [i for i, each in outlined if each.get("name") is None]


def _layer(release: Mapping[str, Any]) -> Any:
    """Layer that a release takes all polygons of."""
    return release.get("layer") if release.get("name") is None else None


def assign(data: Any, path: Path, value: Any) -> Any:
    """Copy data with the value at a path replaced."""
    if not path:
        return value
    first, *rest = path
    if isinstance(data, tuple):
        index = int(first)
        return (*data[:index], assign(data[index], tuple(rest), value), *data[index + 1 :])
    return {**data, first: assign(data.get(first, {}), tuple(rest), value)}


def meaning_of(key: str, settings: Settings) -> tuple[str, str]:
    """Give unit and meaning of a dotted key, from the declaration of the last section on its way."""
    at: Any = settings
    unit = meaning = ""
    parts = key.split(".")
    if parts[0] == "release" and any(isinstance(each, PolygonsRelease) for each in settings.releases):
        # between them are numbers and names of polygons
        parts = [parts[0], parts[-1]]
    for part in parts:
        if isinstance(at, tuple) and part.isdigit():
            at = at[int(part)]
            continue
        # of a single inflow
        at = at[0] if isinstance(at, tuple) else at
        if part in type(at).model_fields:
            unit, meaning = declared(at, part, "unit"), declared(at, part, "description")
            at = getattr(at, part)
    return unit, meaning


def coordinate_names(keys: Iterable[str]) -> dict[str, str]:
    """Name each varied key's coordinate: its last part, or all of it joined by underscores.

    The whole key is used where the last part is a number, is shared by another key, or is taken by a
    variable or dimension of the store.
    """
    keys = list(keys)
    last = {key: key.rpartition(".")[2] for key in keys}
    shared = Counter(last.values())
    found = {
        # names of polygons may hold any sign
        key: re.sub(r"\W", "_", key) if shared[name] > 1 or name in _TAKEN or name.isdigit() else name
        for key, name in last.items()
    }
    again = Counter(found.values())
    return {key: name if again[name] == 1 else f"{name}_{keys.index(key)}" for key, name in found.items()}
