"""Settings of a sample: distributions of parameters, and the design that draws from them."""

from __future__ import annotations

from itertools import pairwise
from typing import Annotated, Literal, Protocol, TypeVar

import numpy as np
from pydantic import BeforeValidator, Field, model_validator

from pipeline.settings.points import Seed
from pipeline.settings.section import OF_KEY, Positive, Section, check_finite_scalar, key, relation

MOST_RUNS = 100_000
# designs whose first draws are designs too
NESTED = ("sobol", "random")

Scalar = Annotated[int | float | str | bool, BeforeValidator(check_finite_scalar)]


class _Bounded(Protocol):
    @property
    def lower(self) -> float | None: ...

    @property
    def upper(self) -> float | None: ...


Given = TypeVar("Given", bound=_Bounded)


def _ordered(distribution: Given) -> Given:
    """Refuse bounds that are not in order."""
    lower, upper = distribution.lower, distribution.upper
    if lower is not None and upper is not None and not lower < upper:
        raise relation(f"expected a number above lower ({lower:g}), found {upper:g}", "upper", "lower")
    return distribution


class Uniform(Section):
    """Every value between two bounds equally likely."""

    distribution: Literal["uniform"] = key("every value between two bounds equally likely")
    lower: float = key("least value", OF_KEY)
    upper: float = key("largest value", OF_KEY)

    _check = model_validator(mode="after")(_ordered)


class Normal(Section):
    """The normal distribution, cut off where bounds are given."""

    distribution: Literal["normal"] = key("the normal distribution, cut off where bounds are given")
    mean: float = key("mean before it is cut off", OF_KEY)
    deviation: Positive = key("standard deviation before it is cut off", OF_KEY)
    lower: float | None = key("no value below it", OF_KEY, None)
    upper: float | None = key("no value above it", OF_KEY, None)

    _check = model_validator(mode="after")(_ordered)


class Lognormal(Section):
    """A distribution whose logarithm is normal, cut off where bounds are given."""

    distribution: Literal["lognormal"] = key("its logarithm is normal; cut off where bounds are given")
    median: Positive = key("median before it is cut off", OF_KEY)
    deviation: Positive = key("standard deviation of the natural logarithm")
    lower: Positive | None = key("no value below it", OF_KEY, None)
    upper: Positive | None = key("no value above it", OF_KEY, None)

    _check = model_validator(mode="after")(_ordered)


class Triangular(Section):
    """A most likely value between two bounds, falling off in straight lines."""

    distribution: Literal["triangular"] = key("a most likely value between two bounds")
    lower: float = key("least value", OF_KEY)
    mode: float = key("most likely value", OF_KEY)
    upper: float = key("largest value", OF_KEY)

    _check = model_validator(mode="after")(_ordered)

    @model_validator(mode="after")
    def _within(self) -> Triangular:
        if not self.lower <= self.mode <= self.upper:
            found = f"expected a number from {self.lower:g} to {self.upper:g}, found {self.mode:g}"
            raise relation(found, "mode", "lower", "upper")
        return self


class Discrete(Section):
    """One of a list of values."""

    distribution: Literal["discrete"] = key("one of a list of values")
    values: Annotated[tuple[Scalar, ...], Field(min_length=1)] = key("the values", OF_KEY)
    weights: tuple[Positive, ...] | None = key(
        "how likely each of them is, relative to the others. Default: all equally", default=None
    )

    @model_validator(mode="after")
    def _alike(self) -> Discrete:
        if self.weights is not None and len(self.weights) != len(self.values):
            found = f"expected {len(self.values)} values, one a value of `values`, found {len(self.weights)}"
            raise relation(found, "weights", "values")
        if len({float if type(value) is int else type(value) for value in self.values}) > 1:
            raise relation("expected values of one kind, found several", "values")
        return self


Distribution = Annotated[
    Uniform | Normal | Lognormal | Triangular | Discrete, Field(discriminator="distribution")
]


class Correlation(Section):
    """How two sampled keys go together."""

    between: tuple[str, str] = key("two of the sampled keys")
    value: Annotated[float, Field(gt=-1, lt=1)] = key("correlation of their normal scores")


def power_of_two(count: int) -> bool:
    """Whether a count is 1, 2, 4, 8 and so on, with which Sobol's sequence is balanced."""
    return not count & (count - 1)


class SampleLevel(Section):
    """Runs of a sample on one spacing."""

    spacing: Positive = key("of the points", "m")
    count: Annotated[int, Field(gt=0, le=MOST_RUNS)] = key("draws, the first ones of the sample")

    @property
    def name(self) -> str:
        """Name of the level, ``4m``."""
        return f"{self.spacing:g}m"


class Sample(Section):
    """Parameters drawn at random, one run a draw; with a sweep, the same draws for each of its runs."""

    values: Annotated[dict[str, Distribution], Field(min_length=1)] = key(
        "a distribution for each sampled key (`material.bed_friction`, `release.0.volume`)"
    )
    count: Annotated[int, Field(gt=0, le=MOST_RUNS)] = key(
        "draws; with `saltelli` they are `count` times the number of keys plus 2. Left out with `levels`",
        default=None,
    )
    levels: tuple[SampleLevel, ...] = key(
        "many draws on a wide spacing, and the first of them on closer ones, the widest first; "
        "`pipeline emulate` puts them together",
        default=(),
    )
    design: Literal["sobol", "latin-hypercube", "saltelli", "random"] = key(
        "how the draws cover the space",
        default="sobol",
        choices={
            "sobol": "evenly, by Sobol's scrambled sequence, of which the first draws are a design too",
            "latin-hypercube": "in layers of each key",
            "saltelli": "as Sobol's sensitivity indices need them",
            "random": "independently",
        },
        advice="`sobol` for probabilities, with a count that is a power of 2; `saltelli` to rank parameters.",
    )
    seed: Seed = key("the same seed gives the same draws", default=0)
    correlations: tuple[Correlation, ...] = key("which keys go together; others are independent", default=())

    @property
    def rows(self) -> int:
        """Number of draws."""
        return self.count * (len(self.values) + 2) if self.design == "saltelli" else self.count

    @property
    def correlation(self) -> np.ndarray[tuple[int, int], np.dtype[np.float64]]:
        """Correlation of the normal scores of all keys, shape (keys, keys)."""
        keys, matrix = list(self.values), np.eye(len(self.values))
        for each in self.correlations:
            i, j = (keys.index(name) for name in each.between)
            matrix[i, j] = matrix[j, i] = each.value
        return matrix

    @model_validator(mode="after")
    def _levelled(self) -> Sample:
        if not self.levels:
            if self.count is None:
                raise relation("expected a number of draws, or levels", "count")
            return self
        if "count" in self.model_fields_set and self.count is not None:
            raise relation(f"expected none beside levels, found {self.count}", "count", "levels")
        if len(self.levels) < 2:
            raise relation("expected two levels or more, found 1", "levels")
        if self.design not in NESTED:
            found = f"expected sobol or random with levels, found {self.design}"
            raise relation(f"{found}, whose first draws are no design", "design", "levels")
        for i, (wide, close) in enumerate(pairwise(self.levels), 1):
            if not close.spacing < wide.spacing:
                found = f"expected a spacing below {wide.spacing:g}, found {close.spacing:g}"
                raise relation(found, f"levels.{i}.spacing")
            if close.count > wide.count:
                found = f"expected at most {wide.count} draws, found {close.count}"
                raise relation(found, f"levels.{i}.count")
        # frozen for all but its own making
        object.__setattr__(self, "count", self.levels[0].count)
        return self

    @model_validator(mode="after")
    def _well_posed(self) -> Sample:
        if self.design == "saltelli" and not power_of_two(self.count):
            found = f"expected a power of 2 with design saltelli, found {self.count}"
            raise relation(found, "count", "design")
        if self.rows > MOST_RUNS:
            found = (
                f"expected at most {MOST_RUNS:,} runs with their {len(self.values)} keys, found {self.rows:,}"
            )
            raise relation(found, "count", "design")
        if self.correlations and self.design == "saltelli":
            raise relation(
                "expected none with design saltelli, whose indices hold for independent keys only",
                "correlations",
                "design",
            )
        seen: set[frozenset[str]] = set()
        for i, each in enumerate(self.correlations):
            pair = frozenset(each.between)
            if len(pair) != 2 or not pair <= set(self.values):
                expected = f"expected two of {', '.join(self.values)}"
                raise relation(f"{expected}, found {' and '.join(each.between)}", f"correlations.{i}.between")
            if pair in seen:
                found = f"expected each pair once, found {' and '.join(each.between)} again"
                raise relation(found, f"correlations.{i}.between")
            seen.add(pair)
        if np.linalg.eigvalsh(self.correlation)[0] <= 0:
            raise relation("expected correlations that can be true together", "correlations")
        return self
