"""What all sections of a scenario file have in common."""

from __future__ import annotations

from math import isfinite
from typing import Annotated, Any

from pydantic import BaseModel, ConfigDict, Field
from pydantic_core import PydanticCustomError

from pipeline.mistakes import describe

Angle = Annotated[float, Field(gt=-90, lt=90)]
FrictionAngle = Annotated[float, Field(ge=0, lt=90)]
Positive = Annotated[float, Field(gt=0)]
Pair = tuple[float, float]


class Section(BaseModel):
    """Base of all sections: frozen, no unknown keys, no conversions, finite numbers only."""

    model_config = ConfigDict(frozen=True, extra="forbid", strict=True, allow_inf_nan=False)


def key(description: str, unit: str = "", default: Any = ..., **limits: Any) -> Any:
    """Declare a key with its meaning and unit, which the JSON Schema and the reference table show."""
    return Field(default, description=description, json_schema_extra={"unit": unit}, **limits)


def relation(message: str, *keys: str | tuple[str | int, ...]) -> PydanticCustomError:
    """Make the error of keys, given relative to their section, that are each right but not together.

    The first of them is the one to blame. A key with dots in its name is given by its path.
    """
    return PydanticCustomError("relation", "{message}", {"message": message, "keys": keys})


def check_bounds(name: str, bounds: Pair) -> None:
    """Refuse bounds whose lower one is not below the upper one."""
    low, high = bounds
    if not low < high:
        raise relation(f"expected a lower bound below the upper one, found [{low:g}, {high:g}]", name)


def check_finite_scalar(value: Any) -> Any:
    """Refuse what is no finite number, no word, and neither true nor false."""
    if not isinstance(value, str | bool | int | float) or (isinstance(value, float) and not isfinite(value)):
        raise relation(f"expected a finite number, a word or true or false, found {describe(value)}")
    return value
