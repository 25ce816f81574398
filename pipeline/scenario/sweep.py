"""Varied keys: the dotted key of a scenario that a value replaces, and the name it has in the store."""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterable, Mapping
from typing import Any

from pipeline.scenario.strict_yaml import Path
from pipeline.settings.section import declared
from pipeline.settings.settings import Settings
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
    A single release or inflow may be addressed as the first of a list.
    """
    names = key.split(".")
    if names[0] not in SWEEPABLE:
        return None
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
    for part in key.split("."):
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
    return {
        key: key.replace(".", "_") if shared[name] > 1 or name in _TAKEN or name.isdigit() else name
        for key, name in last.items()
    }
