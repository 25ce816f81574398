"""What all sections of a scenario file have in common."""

from __future__ import annotations

import types
from collections.abc import Iterator, Mapping
from math import isfinite
from typing import Annotated, Any, ClassVar, Literal, Union, get_args, get_origin

from pydantic import BaseModel, ConfigDict, Discriminator, Field
from pydantic_core import PydanticCustomError

from pipeline.mistakes import describe

Positive = Annotated[float, Field(gt=0)]
Pair = tuple[float, float]

# Stands in a location for a key that is the user's own.
ANY_KEY = "*"
# unit of what is a value of the key that is varied
OF_KEY = "of the key"


class Section(BaseModel):
    """Base of all sections: frozen, no unknown keys, no conversions, finite numbers only.

    Attributes
    ----------
    advice : str
        When to choose this section, where there are others.
    """

    advice: ClassVar[str] = ""
    model_config = ConfigDict(frozen=True, extra="forbid", strict=True, allow_inf_nan=False, defer_build=True)


def key(
    description: str,
    unit: str = "",
    default: Any = ...,
    *,
    choices: Mapping[Any, str] | None = None,
    advice: str = "",
    **limits: Any,
) -> Any:
    """Declare a key with its meaning and unit, which the JSON Schema and the reference table show.

    Parameters
    ----------
    choices : mapping of Any to str, optional
        For each word that the key takes, what it does.
    advice : str
        What to choose, in a sentence.
    """
    extra: dict[str, Any] = {"unit": unit}
    if choices:
        extra["choices"] = {str(value): word for value, word in choices.items()}
    if advice:
        extra["advice"] = advice
    return Field(default, description=description, json_schema_extra=extra, **limits)


def declared(section: BaseModel, name: str, what: str) -> str:
    """Give the ``description`` of a key, its ``unit`` or its ``advice``; "" where there is none."""
    info = type(section).model_fields[name]
    extra = info.json_schema_extra if isinstance(info.json_schema_extra, dict) else {}
    return info.description or "" if what == "description" else str(extra.get(what, ""))


def relation(message: str, *keys: str | tuple[str | int, ...]) -> PydanticCustomError:
    """Make the error of keys, given relative to their section, that are each right but not together.

    The first of them is the one to blame. A key with dots in its name is given by its path.
    """
    return PydanticCustomError("relation", "{message}", {"message": message, "keys": keys})


def check_bounds(name: str, bounds: Pair) -> None:
    """Refuse bounds whose lower one is not below the upper one."""
    low, high = bounds
    if not low < high:
        raise relation(f"expected a lower bound below the upper one, found [{low:.12g}, {high:.12g}]", name)


def check_finite_scalar(value: Any) -> Any:
    """Refuse what is no finite number, no word, and neither true nor false."""
    if not isinstance(value, str | bool | int | float) or (isinstance(value, float) and not isfinite(value)):
        raise relation(f"expected a finite number, a word or true or false, found {describe(value)}")
    return value


class _Choice(Discriminator):
    """A discriminator that unions of unions can hold, which look for equal ones."""

    __slots__ = ()
    __hash__ = object.__hash__


def chosen_by(name: str, default: str = "", implied: Mapping[str, str] | None = None) -> Discriminator:
    """Choose between tagged sections by the value of a key, which may be left out.

    Parameters
    ----------
    name : str
        The key.
    default : str
        Its value where it is left out; without one it must be there.
    implied : mapping of str to str, optional
        Values by another key that says them as well, where that one is there.
    """

    def value_of(value: Any) -> Any:
        if not isinstance(value, Mapping):
            # any section refuses what is no mapping, in its own words
            return getattr(value, name, default or next(iter((implied or {}).values()), None))
        said = (word for other, word in (implied or {}).items() if other in value)
        return value.get(name, next(said, default or None))

    return _Choice(
        value_of,
        custom_error_type="union_tag_invalid",
        custom_error_context={"discriminator": f"'{name}'", "tag": "", "expected_tags": ""},
    )


def sections_of(
    annotation: Any, loc: tuple[str, ...] = ()
) -> Iterator[tuple[tuple[str, ...], type[BaseModel]]]:
    """Walk the models of a type, each with the location (without list indices) that its errors have."""
    origin = get_origin(annotation)
    if origin is Annotated:
        inner, *metadata = get_args(annotation)
        tags = tuple(item.tag for item in metadata if hasattr(item, "tag"))
        yield from sections_of(inner, (*loc, *tags))
    elif origin in (Union, types.UnionType):
        members = get_args(annotation)
        several = sum(is_section(member) for member in members) > 1
        for member in members:
            yield from sections_of(member, (*loc, kind(member)) if several and is_section(member) else loc)
    elif origin is tuple:
        yield from sections_of(get_args(annotation)[0], loc)
    elif origin is dict:
        yield from sections_of(get_args(annotation)[1], (*loc, ANY_KEY))
    elif is_section(annotation):
        yield loc, annotation
        for name, info in annotation.model_fields.items():
            yield from sections_of(info.annotation, (*loc, name))


def choosing_key(model: type[BaseModel]) -> str:
    """Name the key that tells a model from others of its union, ``profile`` or ``shape``; "" for none."""
    hints = ((name, info.annotation) for name, info in model.model_fields.items())
    return next((name for name, hint in hints if _is_single_literal(hint)), "")


def kind(model: type[BaseModel]) -> str:
    """Give the value of the key that tells a model from others of its union, ``plane`` or ``box``."""
    return str(get_args(model.model_fields[choosing_key(model)].annotation)[0])


def is_section(annotation: Any) -> bool:
    """Whether a type is a section."""
    return isinstance(annotation, type) and issubclass(annotation, BaseModel)


def _is_single_literal(annotation: Any) -> bool:
    return get_origin(annotation) is Literal and len(get_args(annotation)) == 1
