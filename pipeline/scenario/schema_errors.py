"""Errors of the schema in plain words: which key, what was expected and what was found."""

from __future__ import annotations

import types
from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass
from functools import cache
from typing import Annotated, Any, Literal, Union, get_args, get_origin

from pydantic import BaseModel, ValidationError
from pydantic_core import ErrorDetails

from pipeline.mistakes import describe
from pipeline.scenario.strict_yaml import Path
from pipeline.settings.settings import Settings

# Stands in a location for a key that is the user's own.
ANY_KEY = "*"


@dataclass(frozen=True)
class Problem:
    """What is wrong at a path of the data.

    at_key : whether the key is wrong and not its value. related : paths that the problem depends on, the one
    to blame first.
    """

    path: Path
    message: str
    at_key: bool = False
    related: tuple[Path, ...] = ()


def check(data: Mapping[str, Any]) -> Settings | list[Problem]:
    """Make settings of plain data, or list all that is wrong with it."""
    try:
        return Settings.model_validate(data)
    except ValidationError as error:
        errors = (e for e in error.errors(include_url=False) if not _is_long_enough(e))
        return [_explain(details, data) for details in errors]


def _is_long_enough(error: ErrorDetails) -> bool:
    """Whether a list is called too short because items of it failed, which are not counted."""
    return error["type"] == "too_short" and len(error["input"]) >= error["ctx"]["min_length"]


def sections(
    annotation: Any = Settings, loc: tuple[str, ...] = ()
) -> Iterator[tuple[tuple[str, ...], type[BaseModel]]]:
    """Walk the models of a schema, each with the location (without list indices) that its errors have."""
    origin = get_origin(annotation)
    if origin is Annotated:
        inner, *metadata = get_args(annotation)
        tags = tuple(item.tag for item in metadata if hasattr(item, "tag"))
        yield from sections(inner, (*loc, *tags))
    elif origin in (Union, types.UnionType):
        members = get_args(annotation)
        several = sum(_is_model(member) for member in members) > 1
        for member in members:
            yield from sections(member, (*loc, kind(member)) if several and _is_model(member) else loc)
    elif origin is tuple:
        yield from sections(get_args(annotation)[0], loc)
    elif origin is dict:
        yield from sections(get_args(annotation)[1], (*loc, ANY_KEY))
    elif _is_model(annotation):
        yield loc, annotation
        for name, info in annotation.model_fields.items():
            yield from sections(info.annotation, (*loc, name))


def kind(model: type[BaseModel]) -> str:
    """Give the value of the key that tells a model from others of its union, ``plane`` or ``box``."""
    annotations = (info.annotation for info in model.model_fields.values())
    return str(next(get_args(annotation)[0] for annotation in annotations if _is_single_literal(annotation)))


def _is_model(annotation: Any) -> bool:
    return isinstance(annotation, type) and issubclass(annotation, BaseModel)


def _is_single_literal(annotation: Any) -> bool:
    return get_origin(annotation) is Literal and len(get_args(annotation)) == 1


@cache
def _open() -> frozenset[tuple[str, ...]]:
    """Locations of mappings whose keys are the user's own."""
    return frozenset(loc[: loc.index(ANY_KEY)] for loc in _models() if ANY_KEY in loc)


@cache
def _models() -> dict[tuple[str, ...], type[BaseModel]]:
    return dict(sections())


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
        keys = ", ".join(model.model_fields)
        return Problem(path, f"expected one of the keys {keys}, found '{loc[-1]}'", at_key=True)
    if type_ == "missing":
        if isinstance(loc[-1], int):
            return Problem(path[:-1], f"expected 2 values, found {len(error['input'])}")
        return Problem(path, "expected a value, found nothing")
    if type_ in ("union_tag_invalid", "union_tag_not_found"):
        name = context["discriminator"].strip("'")
        tags = [kind(model) for at, model in _models().items() if at[:-1] == _names(loc)]
        found = describe(error["input"].get(name))
        return Problem((*path, name), f"expected one of {', '.join(tags)}, found {found}")
    if type_ in ("too_short", "too_long"):
        found = str(len(error["input"]))
    expected = _EXPECTED[type_](context)
    if type_ == "too_short" and path[-1:] in (("line",), ("polygon",)):
        expected = expected.replace("values", "corners")
    return Problem(path, f"expected {expected}, found {found}")


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


def _path(loc: tuple[int | str, ...], data: Any, missing: bool) -> Path:
    """Leave out of a location what is no key of the data, as the kinds that unions add, but a missing key."""
    path: list[str | int] = []
    for i, part in enumerate(loc):
        if _names(loc[: i + 1]) in _models() and _names(loc[:i]) not in _models() and isinstance(part, str):
            continue
        known = isinstance(data, Mapping) and part in data
        item = isinstance(data, tuple) and isinstance(part, int) and part < len(data)
        if known or item:
            data = data[part]
        elif not (missing and i == len(loc) - 1):
            continue
        path.append(part)
    return tuple(path)
