"""Parameters: declared once, on frozen dataclasses, with meaning, unit, default and bounds.

A dataclass of parameters is decorated with `parametric` and has `Checked` as a base; its fields are made by
`parameter`. Scenario files, their JSON Schema and their reference are made from what is declared here.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import MISSING, Field, dataclass, field, fields, replace
from inspect import cleandoc
from math import isfinite
from numbers import Real
from textwrap import wrap
from typing import Any, ClassVar, TypeVar, dataclass_transform, overload

Class = TypeVar("Class", bound=type)
_KEY = "parameter"
# the abstract class last, as it takes longest to ask
_NUMBERS = (float, int, Real)


class ParameterError(ValueError):
    """A parameter out of its bounds, or parameters that do not go together.

    Parameters
    ----------
    message : str
        ``expected ..., found ...``.
    names : str
        Names of the parameters; the first is the one to change. A part of one is named with dots, as in
        ``segments.1.start``.
    """

    def __init__(self, message: str, *names: str) -> None:
        self.message, self.names = message, names
        super().__init__(f"{names[0]}: {message}")

    def __reduce__(self) -> tuple[Any, ...]:
        return type(self), (self.message, *self.names)


@dataclass(frozen=True)
class Alternative:
    """A second way to give a parameter in a scenario file, never beside the first.

    Parameters
    ----------
    name : str
        Its key.
    parameter : Parameter
        Its declaration.
    convert : callable
        Gives the value of the first.
    """

    name: str
    parameter: Parameter
    convert: Callable[[float], float]


@dataclass(frozen=True, kw_only=True)
class Parameter:
    """Declaration of a parameter.

    Parameters
    ----------
    meaning, unit : str
        For people; the unit in CF notation, empty for numbers without one and for words.
    above, at_least, below, at_most : float, optional
        Bounds of the number, or of each number of a tuple.
    usual : tuple of float, optional
        Range of a number above 0 that covers what is known of nature and laboratories; scenario files are
        warned of others, which are mostly of another unit.
    scenario_at_most : float, optional
        A bound for scenario files alone; experiments in Python may exceed it.
    ordered : bool
        Whether the first number of a pair must be below the second.
    min_items : int
        Least length of a tuple.
    choices : mapping of Any to str, optional
        For each word or number that is allowed, what it does.
    advice : str
        What to choose, in a sentence.
    key : str
        Name in scenario files where it is not that of the field.
    alternative : Alternative, optional
        A second way to give it in scenario files.
    """

    meaning: str
    unit: str = ""
    above: float | None = None
    at_least: float | None = None
    below: float | None = None
    at_most: float | None = None
    usual: tuple[float, float] | None = None
    scenario_at_most: float | None = None
    ordered: bool = False
    min_items: int = 0
    choices: Mapping[Any, str] | None = None
    advice: str = ""
    key: str = ""
    alternative: Alternative | None = None

    def check(self, name: str, value: Any) -> None:
        """Refuse a value out of bounds.

        Raises
        ------
        ParameterError
            If it is.
        """
        if self.choices is not None and value not in self.choices:
            expected = ", ".join(map(str, self.choices))
            raise ParameterError(f"expected one of {expected}, found {value!r}", name)
        if isinstance(value, tuple):
            if len(value) < self.min_items:
                raise ParameterError(f"expected {self.min_items} or more values, found {len(value)}", name)
            for i, item in enumerate(value):
                self.check(f"{name}.{i}", item)
            if self.ordered and not value[0] < value[1]:
                found = f"[{value[0]:g}, {value[1]:g}]"
                raise ParameterError(f"expected a lower bound below the upper one, found {found}", name)
        elif isinstance(value, _NUMBERS) and not isinstance(value, bool):
            self._check_number(name, float(value))

    def _check_number(self, name: str, value: float) -> None:
        expected = ""
        if self.above is not None and not value > self.above:
            expected = f"a number above {self.above:g}"
        if self.at_least is not None and not value >= self.at_least:
            expected = f"a number of at least {self.at_least:g}"
        if self.below is not None and not value < self.below:
            expected = f"a number below {self.below:g}"
        if self.at_most is not None and not value <= self.at_most:
            expected = f"a number of at most {self.at_most:g}"
        if not isfinite(value):
            expected = "a finite number"
        if expected:
            raise ParameterError(f"expected {expected}, found {value:.15g}", name)


def parameter(meaning: str, unit: str = "", *, default: Any = MISSING, **declared: Any) -> Any:
    """Make a dataclass field that is a parameter; ``declared`` are the other fields of `Parameter`."""
    return field(default=default, metadata={_KEY: Parameter(meaning=meaning, unit=unit, **declared)})


def shared(declared: Parameter, *, default: Any = MISSING, **changed: Any) -> Any:
    """Make a dataclass field of a declaration that several classes share; ``changed`` are fields of it."""
    return field(default=default, metadata={_KEY: replace(declared, **changed)})


def declaration(of: Field[Any]) -> Parameter | None:
    """Give the declaration of a dataclass field; None where it is not a parameter."""
    found: Parameter | None = of.metadata.get(_KEY)
    return found


_parameters: dict[type, list[tuple[Field[Any], Parameter]]] = {}


def parameters(cls: type) -> list[tuple[Field[Any], Parameter]]:
    """Give the fields of a dataclass that are parameters, each with its declaration."""
    if cls not in _parameters:
        _parameters[cls] = [
            (each, declared) for each in fields(cls) if (declared := declaration(each)) is not None
        ]
    return _parameters[cls]


@overload
def parametric(cls: Class, /) -> Class: ...
@overload
def parametric(*, kw_only: bool = False, eq: bool = True) -> Callable[[Class], Class]: ...
@dataclass_transform(field_specifiers=(parameter, shared, field), frozen_default=True)
def parametric(
    cls: Class | None = None, /, *, kw_only: bool = False, eq: bool = True
) -> Class | Callable[[Class], Class]:
    """Make a frozen dataclass of a class; its fields may be made by `parameter`.

    Its docstring is given a section of parameters, from what is declared of them.
    """

    def made(cls: Class) -> Class:
        decorate: Callable[[Class], Class] = dataclass(frozen=True, kw_only=kw_only, eq=eq)  # type: ignore[assignment]
        built = decorate(cls)
        built.__doc__ = _documented(built)
        return built

    return made if cls is None else made(cls)


def _documented(cls: type) -> str:
    """Give the docstring of a class of parameters with a numpy-style section of them."""
    head, rule, raises = cleandoc(cls.__doc__ or "").partition("\n\nRaises\n------")
    lines = []
    for each, declared in parameters(cls):
        kind = str(each.type).replace(" | None", "")
        lines.append(f"{each.name} : {kind}{'' if each.default is MISSING else ', optional'}")
        unit = f", {declared.unit}" if declared.unit else ""
        default = "" if each.default in (MISSING, None) else f" By default {each.default}."
        meaning = declared.meaning[:1].upper() + declared.meaning[1:]
        lines += wrap(f"{meaning}{unit}.{default}", 96, initial_indent="    ", subsequent_indent="    ")
    if not lines or "\nParameters\n---" in head:
        return cls.__doc__ or ""
    return "\n".join([head, "", "Parameters", "----------", *lines]) + rule + raises


class Checked:
    """Base of dataclasses of parameters: checks the bounds of each one.

    A subclass that checks what its parameters must be together calls ``super().__post_init__()`` first.

    Attributes
    ----------
    advice : str
        When to choose this class, where there are others.
    """

    advice: ClassVar[str] = ""

    def __post_init__(self) -> None:
        for each, declared in parameters(type(self)):
            value = getattr(self, each.name)
            if not (value is None and each.default is None):
                declared.check(each.name, value)
