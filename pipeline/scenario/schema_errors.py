"""Errors of the schema in plain words: which key, what was expected and what was found."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping
from functools import cache
from typing import Any

from pydantic import BaseModel, ValidationError
from pydantic_core import ErrorDetails

from pipeline.hints import meant, of_key, of_length, of_number
from pipeline.mistakes import Problem, describe
from pipeline.scenario.strict_yaml import Path
from pipeline.settings.section import ANY_KEY, OF_KEY, choosing_key, kind, sections_of
from pipeline.settings.settings import Settings


def check(data: Mapping[str, Any]) -> Settings | list[Problem]:
    """Make settings of plain data, or list all that is wrong with it."""
    try:
        return Settings.model_validate(data)
    except ValidationError as error:
        errors = (e for e in error.errors(include_url=False) if not _is_long_enough(e))
        return [_explain(details, data) for details in errors]


def sections() -> Iterator[tuple[tuple[str, ...], type[BaseModel]]]:
    """Walk the sections of a scenario file, each with the location that its errors have."""
    return sections_of(Settings)


def _is_long_enough(error: ErrorDetails) -> bool:
    """Whether a list is called too short because items of it failed, which are not counted."""
    return error["type"] == "too_short" and len(error["input"]) >= error["ctx"]["min_length"]


@cache
def _open() -> frozenset[tuple[str, ...]]:
    """Locations of mappings whose keys are the user's own."""
    return frozenset(loc[: loc.index(ANY_KEY)] for loc in _models() if ANY_KEY in loc)


@cache
def _models() -> dict[tuple[str, ...], type[BaseModel]]:
    return dict(sections())


@cache
def keys_elsewhere() -> Mapping[str, str]:
    """Keys of the sections that may be varied, each with its dotted key; of several the first."""
    found: dict[str, str] = {}
    # those of numerical schemes are the last that are meant
    for loc, model in sorted(_models().items(), key=lambda each: each[0][:1] == ("scheme",)):
        # keys of the items of a list are not where a single key may have been meant
        if loc[:1] in (("inflow",), ("sections",)):
            continue
        if len(loc) == 1 or (len(loc) in (2, 3) and choosing_key(model)):
            found |= {name: f"{loc[0]}.{name}" for name in model.model_fields if name not in found}
    return found


def _outside(loc: tuple[int | str, ...]) -> Mapping[str, str]:
    """Keys of other sections than the one of a location."""
    own = f"{loc[0]}." if len(loc) > 1 else ""
    return {name: place for name, place in keys_elsewhere().items() if not own or not place.startswith(own)}


def _explain(error: ErrorDetails, data: Mapping[str, Any]) -> Problem:
    """Turn one of pydantic's errors into a problem."""
    loc, context, type_ = error["loc"], error.get("ctx", {}), error["type"]
    path = _path(loc, data, type_ == "missing")
    found = describe(error["input"])
    if type_ == "relation":
        related = tuple((*path, *_parts(name)) for name in context["keys"]) or (path,)
        return Problem(related[0], context["message"], related=related)
    if type_ == "extra_forbidden":
        model = _models()[_names(loc[:-1])]
        keys, name = ", ".join(model.model_fields), str(loc[-1])
        hint = of_key(name, error["input"]) or meant(name, model.model_fields, _outside(loc))
        return Problem(path, f"expected one of the keys {keys}, found '{name}'{hint}", at_key=True, hint=hint)
    if type_ == "missing":
        if isinstance(loc[-1], int):
            return Problem(path[:-1], f"expected 2 values, found {len(error['input'])}")
        return Problem(path, "expected a value, found nothing")
    if type_ in ("union_tag_invalid", "union_tag_not_found"):
        name = context["discriminator"].strip("'")
        tags = [kind(model) for at, model in _models().items() if at[:-1] == _names(loc)]
        if not isinstance(error["input"], Mapping):
            return Problem(path, f"expected a mapping, found {describe(error['input'])}")
        found = describe(error["input"].get(name))
        return Problem((*path, name), f"expected one of {', '.join(tags)}, found {found}")
    hint = of_number(error["input"], _unit(loc)) if type_ in ("float_type", "int_type") else ""
    if type_ == "string_type" and path[-1:] == ("crs",) and isinstance(error["input"], int):
        hint = f'. Write "EPSG:{error["input"]}"'
    if type_ in ("too_short", "too_long"):
        found = str(len(error["input"]))
        hint = of_length(error["input"], context.get("max_length", 0))
    expected = _EXPECTED[type_](context)
    if type_ == "too_short" and path[-1:] in (("line",), ("polygon",)):
        expected = expected.replace("values", "corners")
    return Problem(path, f"expected {expected}, found {found}{hint}", hint=hint)


_EXPECTED: dict[str, Callable[[Mapping[str, Any]], str]] = {
    "float_type": lambda _: "a number",
    "int_type": lambda _: "a whole number",
    "int_from_float": lambda _: "a whole number",
    "bool_type": lambda _: "true or false",
    "string_type": lambda _: "text",
    "tuple_type": lambda _: "a list",
    "dict_type": lambda _: "a mapping",
    "model_type": lambda _: "a mapping",
    "model_attributes_type": lambda _: "a mapping",
    "finite_number": lambda _: "a finite number",
    "greater_than": lambda context: f"a number above {context['gt']:g}",
    "greater_than_equal": lambda context: f"a number of at least {context['ge']:g}",
    "less_than": lambda context: f"a number below {context['lt']:g}",
    "less_than_equal": lambda context: f"a number of at most {context['le']:g}",
    "literal_error": lambda context: "one of " + context["expected"].replace(" or ", ", ").replace("'", ""),
    "too_short": lambda context: f"{context['min_length']} or more values",
    "too_long": lambda context: f"{context['max_length']} values",
    "string_too_short": lambda _: "some text",
    "string_too_long": lambda context: f"at most {context['max_length']} characters",
    "string_pattern_mismatch": lambda _: "letters, digits, - _ and . with a letter or digit first",
}


def _parts(dotted: str | Path) -> Path:
    if isinstance(dotted, tuple):
        return dotted
    return tuple(int(part) if part.isdigit() else part for part in dotted.split("."))


def _names(loc: tuple[int | str, ...]) -> tuple[str, ...]:
    names: tuple[str, ...] = ()
    for part in loc:
        if isinstance(part, str):
            names = (*names, ANY_KEY if names in _open() else part)
    return names


def _unit(loc: tuple[int | str, ...]) -> str | None:
    """Give the unit of the key at a location; None where it is none of its own."""
    names = _names(loc)
    for count in range(len(names) - 1, -1, -1):
        info = model.model_fields.get(names[count]) if (model := _models().get(names[:count])) else None
        if info is not None and isinstance(info.json_schema_extra, dict):
            unit = str(info.json_schema_extra.get("unit", ""))
            return None if unit == OF_KEY else unit
    return None


def _path(loc: tuple[int | str, ...], data: Any, missing: bool) -> Path:
    """Leave out of a location what is no key of the data, as the kinds that unions add, but a missing key."""
    path: list[str | int] = []
    for i, part in enumerate(loc):
        before = _names(loc[:i])
        chosen = _names(loc[: i + 1]) in _models() and before not in _models() and before not in _open()
        if chosen and isinstance(part, str):
            continue
        known = isinstance(data, Mapping) and part in data
        item = isinstance(data, tuple) and isinstance(part, int) and part < len(data)
        if known or item:
            data = data[part]
        elif not (missing and i == len(loc) - 1):
            continue
        path.append(part)
    return tuple(path)
