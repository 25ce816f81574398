"""Sections of a scenario file made from the solver's dataclasses of parameters.

Keys, units, defaults, bounds and relations stand there alone, as declared by `solver.parameters`. A choice
between several classes is a section with a key that names one of them (`shape: box`), or a flat section with
the keys of all (`earth_pressure: isotropic` beside `bed_friction`).
"""

from __future__ import annotations

import re
from collections.abc import Collection, Iterable, Mapping
from dataclasses import MISSING, fields, is_dataclass
from inspect import cleandoc
from types import EllipsisType, NoneType, UnionType
from typing import Annotated, Any, ClassVar, Literal, TypeVar, Union, get_args, get_origin, get_type_hints

import pydantic
from pydantic import (
    Discriminator,
    SerializerFunctionWrapHandler,
    Tag,
    create_model,
    model_serializer,
    model_validator,
)

from pipeline.settings.section import Section, chosen_by, key, kind, relation
from solver.parameters import Parameter, ParameterError, declaration, parameters

T = TypeVar("T")
# keys of a section, each with its type and its declaration
Keys = dict[str, tuple[Any, Any]]


class FlatSection(Section):
    """Base of sections with the keys of dataclasses.

    Attributes
    ----------
    alternatives : frozenset[str]
        Second ways to give a key, which do not show where they were not taken.
    """

    alternatives: ClassVar[frozenset[str]] = frozenset()

    @model_serializer(mode="wrap")
    def _dumped(self, handler: SerializerFunctionWrapHandler) -> dict[str, Any]:
        found: dict[str, Any] = handler(self)
        return {
            name: value
            for name, value in found.items()
            if value is not None or name not in type(self).alternatives
        }


class Generated(FlatSection):
    """Base of sections made from one dataclass.

    Attributes
    ----------
    source : type
        The dataclass.
    complete : bool
        Whether its keys are all that it needs.
    """

    source: ClassVar[type]
    complete: ClassVar[bool] = True

    def make(self, **given: Any) -> Any:
        """Make an instance of the dataclass; ``given`` are fields that no key holds."""
        return made(self.source, self, {name: (value, name) for name, value in given.items()})

    @model_validator(mode="after")
    def _consistent(self) -> Generated:
        if self.complete:
            self.make()
        return self


def made(
    cls: type[T],
    section: object,
    given: Mapping[str, tuple[Any, str]] | None = None,
    why: str = "",
) -> T:
    """Make an instance of a dataclass from the keys of a section.

    Parameters
    ----------
    cls : type
        The dataclass.
    section : object
        Has the keys as attributes.
    given : mapping, optional
        Fields that are not taken from keys of the section, each with the key that holds it.
    why : str, optional
        Key that chose this class, where the section has the keys of several.

    Raises
    ------
    PydanticCustomError
        If a parameter is missing, given in two ways, or parameters do not go together.
    """
    values = {name: value for name, (value, _) in (given or {}).items()}
    keys = {name: held for name, (_, held) in (given or {}).items()}
    related = (why,) if why else ()
    for each, declared in parameters(cls):
        if each.name in values:
            continue
        name, other = declared.key or each.name, declared.alternative
        # left out where another section holds it
        value = getattr(section, name, None)
        if other is not None and (second := getattr(section, other.name)) is not None:
            if value is not None:
                raise relation(f"expected either {name} or {other.name}, found both", other.name, name)
            name, value = other.name, other.convert(second)
        if value is None:
            if each.default is not MISSING:
                continue
            because = f" with {why} {tag(cls)}" if why else ""
            raise relation(f"expected a value{because}, found nothing", name, *related)
        values[each.name], keys[each.name] = _objects(value), name
    try:
        result: T = cls(**values)
    except ParameterError as error:
        blamed = [f"{keys.get(first, first)}{dot}{rest}" for first, dot, rest in _parted(error.names)]
        message = error.message
        if blamed[0] in alternatives_of(cls):
            message += f" ({blamed[0]} {getattr(section, blamed[0]):g})"
        raise relation(message, *blamed, *related) from None
    return result


def _objects(value: Any) -> Any:
    """Make the instances that sections in a value stand for."""
    if isinstance(value, Generated):
        return value.make()
    return tuple(map(_objects, value)) if isinstance(value, tuple) else value


def _parted(names: Iterable[str]) -> list[tuple[str, str, str]]:
    return [name.partition(".") for name in names]


def keys_of(
    cls: type, *, optional: bool = False, unset: bool = False, only: Collection[str] | None = None
) -> Keys:
    """Give the keys of a section for the parameters of a dataclass.

    Parameters
    ----------
    optional : bool
        Whether those without a default may be left out, as in a section with the keys of several classes.
    unset : bool
        Whether nothing stands for what is left out, as in a section that changes some parameters. Lists may
        then be of any length, as several classes have the key.
    only : collection of str, optional
        Fields to give keys of. Default: all.
    """
    hints, found = get_type_hints(cls), Keys()
    for each, declared in parameters(cls):
        if only is not None and each.name not in only:
            continue
        other = declared.alternative
        default = None if unset else each.default
        if default is MISSING:
            default = None if optional or other is not None else ...
        hint = hints[each.name]
        if unset and get_origin(hint) is tuple:
            hint = tuple[get_args(hint)[0], ...]  # type: ignore[misc]
        hint = _strict(hint, declared)
        found[declared.key or each.name] = (
            hint if default is not None else hint | None,
            _key(declared, default),
        )
        if other is not None:
            found[other.name] = _strict(float, other.parameter) | None, _key(other.parameter, None)
    return found


def alternatives_of(cls: type) -> frozenset[str]:
    """Name the keys that are second ways to give a parameter of a dataclass."""
    return frozenset(declared.alternative.name for _, declared in parameters(cls) if declared.alternative)


def _key(declared: Parameter, default: Any) -> Any:
    limits = {"min_length": declared.min_items} if declared.min_items else {}
    return key(
        declared.meaning, declared.unit, default, choices=declared.choices, advice=declared.advice, **limits
    )


def _word_or_number(value: Any) -> str:
    return "word" if isinstance(value, str) else "number"


def _strict(hint: Any, declared: Parameter) -> Any:
    """Add the bounds of a parameter to each number of its type, and make sections of dataclasses."""
    origin, inner = get_origin(hint), get_args(hint)
    if declared.choices is not None and hint in (int, str):
        return Literal[tuple(declared.choices)]
    if hint in (int, float):
        most = declared.scenario_at_most if declared.at_most is None else declared.at_most
        bounds = {"gt": declared.above, "ge": declared.at_least, "lt": declared.below, "le": most}
        limits: dict[str, Any] = {name: bound for name, bound in bounds.items() if bound is not None}
        return Annotated[hint, pydantic.Field(**limits)] if limits else hint
    if origin is Literal or hint in (bool, str, NoneType, Ellipsis, EllipsisType):
        return hint
    if origin is tuple:
        return tuple[tuple(_strict(each, declared) for each in inner)]  # type: ignore[misc]
    if origin in (Union, UnionType):
        words = [each for each in inner if get_origin(each) is Literal]
        if words and float in inner:
            # one message, by what was written
            number, word = _strict(float, declared), words[0]
            return Annotated[
                Annotated[number, Tag("number")] | Annotated[word, Tag("word")],
                Discriminator(_word_or_number),
            ]
        return Union[tuple(_strict(each, declared) for each in inner)]  # noqa: UP007
    if isinstance(hint, type) and is_dataclass(hint):
        return section_of(hint)
    raise TypeError(f"no scenario file holds a {hint}")


_sections: dict[tuple[type, str, bool], type[Generated]] = {}


def section_of(
    cls: type, choice: str = "", *, default: bool = False, without: Collection[str] = ()
) -> type[Generated]:
    """Make a section whose keys are the parameters of a dataclass, once.

    Parameters
    ----------
    cls : type
        A dataclass of parameters.
    choice : str
        Key that names the class where several may stand, with the class's `tag` as its value.
    default : bool
        Whether that key may be left out.
    without : collection of str
        Keys of parameters that another section holds.
    """
    wanted = cls, choice, default
    if wanted not in _sections:
        _sections[wanted] = section_with(cls, choice, {}, default=default, without=without)
    return _sections[wanted]


def section_with(
    cls: type, choice: str, more: Keys, *, default: bool = False, without: Collection[str] = ()
) -> type[Generated]:
    """Make a section as `section_of` does, with ``more`` keys before those of the class."""
    held = {name: of for name, of in keys_of(cls).items() if name not in without}
    # what all classes of a choice have in common comes first
    common = {declared.key or each.name for each, declared in parameters(cls) if each.kw_only}
    named: Keys = {}
    if choice:
        word = key(phrase(summary(cls)), default=tag(cls) if default else ...)
        named = {choice: (Literal[tag(cls)], word)}
    keys: dict[str, Any] = {
        **{name: held[name] for name in held if name in common},
        **named,
        **more,
        **{name: held[name] for name in held if name not in common},
    }
    model = create_model(
        cls.__name__, __base__=Generated, __doc__=summary(cls), __module__="pipeline.settings.physics", **keys
    )
    model.source, model.advice = cls, getattr(cls, "advice", "")
    model.alternatives = alternatives_of(cls)
    model.complete = all(
        declaration(each) or each.default is not MISSING for each in fields(cls) if each.init
    )
    return model


def union_of(
    choice: str,
    models: Iterable[type[Section]],
    default: str = "",
    implied: Mapping[str, str] | None = None,
) -> Any:
    """Make the type of a section that is one of several models, by the value of a key.

    Parameters
    ----------
    default : str
        The value where the key is left out; without one it must be there.
    implied : mapping of str to str, optional
        Values by another key that says them as well.
    """
    models = tuple(models)
    if not default and not implied:
        return Annotated[Union[models], pydantic.Field(discriminator=choice)]  # noqa: UP007
    tagged = tuple(Annotated[model, Tag(kind(model))] for model in models)
    return Annotated[Union[tagged], chosen_by(choice, default, implied)]  # noqa: UP007


def tag(cls: type) -> str:
    """Give the word by which a class is chosen: its name in lower case, with hyphens."""
    return re.sub(r"(?<=[a-z])(?=[A-Z])", "-", cls.__name__).lower()


def summary(cls: type) -> str:
    """Give the first paragraph of a class's docstring, in one line."""
    return " ".join(cleandoc(cls.__doc__ or "").partition("\n\n")[0].split())


def phrase(sentence: str) -> str:
    """Make a phrase of a sentence, as for a table."""
    words = re.sub(r"^(A|An|The) ", "", sentence.removesuffix("."))
    return words[:1].lower() + words[1:]
