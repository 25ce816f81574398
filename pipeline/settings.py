"""Settings of a scenario: every key, with its unit, default and limits."""

from __future__ import annotations

from math import isfinite
from typing import Annotated, Any, Literal, get_args

from pydantic import BeforeValidator, Discriminator, Field, Tag, model_validator

from pipeline.hazard_settings import Georeference, Hazard
from pipeline.mistakes import describe
from pipeline.points_settings import Points, Region
from pipeline.release_settings import AnyRelease
from pipeline.scheme_settings import Collocation, Scheme, WeightedResidual
from pipeline.section import FrictionAngle, Positive, Section, key, relation
from pipeline.terrain_settings import Terrain

FieldName = Literal[
    "depth", "velocity_x", "velocity_y", "max_depth", "max_speed", "max_momentum_flux", "arrival_time",
    "deposit_depth",
]  # fmt: skip
MOST_FRAMES = 100_000
FIELDS: tuple[FieldName, ...] = get_args(FieldName)


class Domain(Region):
    """Bounds of the points; a lattice has points on them, and its cells reach half a spacing farther."""


class Material(Section):
    """Friction and earth pressure."""

    bed_friction: FrictionAngle = key("bed friction angle", "degrees")
    internal_friction: FrictionAngle | None = key(
        "internal friction angle, at least `bed_friction`; needed with mohr-coulomb", "degrees", None
    )
    earth_pressure: Literal["mohr-coulomb", "isotropic"] = key(
        "earth pressure coefficient: eqs. 8-11, or 1 everywhere", default="mohr-coulomb"
    )
    turbulent_friction: Positive | None = key(
        "Voellmy's turbulent friction; Coulomb friction alone where it is left out", "m s-2", None
    )

    @model_validator(mode="after")
    def _well_posed(self) -> Material:
        if self.earth_pressure != "mohr-coulomb":
            return self
        if self.internal_friction is None:
            raise relation(
                "expected a value with earth_pressure mohr-coulomb, found nothing",
                "internal_friction",
                "earth_pressure",
            )
        if self.internal_friction < self.bed_friction:
            found = (
                f"expected at most internal_friction ({self.internal_friction:g}) with earth_pressure "
                f"mohr-coulomb, found {self.bed_friction:g}"
            )
            raise relation(found, "bed_friction", "internal_friction", "earth_pressure")
        return self


class GivenDepth(Section):
    """A side where the depth is given."""

    depth: Annotated[float, Field(ge=0)] = key("depth held at the side", "m")


def _kind_of_side(value: Any) -> str:
    return "given" if isinstance(value, dict | GivenDepth) else "kind"


KindOfSide = Literal["open", "wall", "no-slip"]
Side = Annotated[
    Annotated[KindOfSide, Tag("kind")] | Annotated[GivenDepth, Tag("given")],
    Discriminator(_kind_of_side),
]


class Boundaries(Section):
    """What stands at each side."""

    x_min: Side = key("upslope side: `open`, `wall`, `no-slip` or `{depth: value in m}`", default="open")
    x_max: Side = key("downslope side, likewise", default="open")
    y_min: Side = key("side of lowest y, likewise", default="open")
    y_max: Side = key("side of highest y, likewise", default="open")


class Time(Section):
    """How long, and how often frames are kept."""

    end: Positive = key("time to stop at", "s")
    output_every: Positive | None = key(
        "time between frames, from 0; the end always is one. Default: a tenth of `end`", "s", None
    )
    stop_at_rest: bool = key("whether a run ends once everything is at rest", default=True)
    max_steps: Annotated[int, Field(gt=0)] | None = key(
        "time steps after which a run fails; no change of the scenario", default=None
    )
    max_wall: Positive | None = key(
        "elapsed time of computing after which a run fails; no change of the scenario", "s", None
    )

    @model_validator(mode="after")
    def _within(self) -> Time:
        every = self.output_every or self.end
        if every > self.end:
            raise relation(f"expected at most end ({self.end:g}), found {every:g}", "output_every", "end")
        if self.end / every > MOST_FRAMES:
            found = f"expected at most {MOST_FRAMES:,} frames, found {self.end / every:.3g}"
            raise relation(found, "output_every", "end")
        return self


class Output(Section):
    """What is kept."""

    fields: Annotated[tuple[FieldName, ...], Field(min_length=1)] = key(
        "fields kept in the store. Default: all", default=FIELDS
    )
    threshold: Positive | None = key(
        "depth above which a cell counts as reached or as deposit. Default: 1 % of the largest release depth",
        "m",
        None,
    )


def _one_or_many(value: Any) -> str:
    return "many" if isinstance(value, tuple | list) else "one"


OneOrMany = Annotated[
    Annotated[AnyRelease, Tag("one")] | Annotated[tuple[AnyRelease, ...], Field(min_length=1), Tag("many")],
    Discriminator(_one_or_many),
]


def _check_scalar(value: Any) -> Any:
    if not isinstance(value, str | bool | int | float) or (isinstance(value, float) and not isfinite(value)):
        raise relation(f"expected a finite number, a word or true or false, found {describe(value)}")
    return value


Scalar = Annotated[int | float | str | bool, BeforeValidator(_check_scalar)]


class Settings(Section):
    """A scenario: one or many runs that share points, output times and a store."""

    name: str = key(
        "name of the scenario and of its store: letters, digits, `-`, `_` and `.`, "
        "beginning with a letter or digit",
        pattern=r"^[A-Za-z0-9][A-Za-z0-9._-]*$",
        max_length=100,
    )
    description: str = key("what the scenario is, in a line", default="")
    gravity: Positive = key("gravity; 1 for the paper's dimensionless cases", "m s-2", 9.81)
    terrain: Terrain = key("shape of the bed")
    domain: Domain = key("bounds of the points")
    points: Points = key("layout of the points")
    release: OneOrMany = key("what is released, one shape or a list of them")
    material: Material = key("friction and earth pressure")
    boundaries: Boundaries = key("what stands at each side", default=Boundaries())
    scheme: Scheme = key("numerical choices", default=WeightedResidual())
    time: Time = key("duration and frames")
    output: Output = key("what is kept", default=Output())
    sweep: dict[str, Annotated[tuple[Scalar, ...], Field(min_length=1)]] = key(
        "lists of values by dotted key (`material.bed_friction`, `release.0.volume`); "
        "the runs are the product of all lists, the last varying fastest",
        default={},
    )

    georeference: Georeference | None = key(
        "where the profile lies on the map; no change of the scenario", default=None
    )
    hazard: Hazard = key("what is mapped of the results; no change of the scenario", default=Hazard())

    @model_validator(mode="after")
    def _countable(self) -> Settings:
        (x0, x1), (y0, y1) = self.domain.x, self.domain.y
        count, most = self.points.estimate(x1 - x0, y1 - y0), self.points.most
        if count > most:
            at = "points.count" if getattr(self.points, "count", None) else "points.spacing"
            raise relation(f"expected at most {most:,} points, found {count:.3g}", at, "domain")
        return self

    @model_validator(mode="after")
    def _possible(self) -> Settings:
        if isinstance(self.scheme, Collocation):
            for side, stands in self.boundaries:
                if isinstance(stands, GivenDepth):
                    found = "expected open, wall or no-slip with form collocation, found a given depth"
                    raise relation(found, f"boundaries.{side}", "scheme.form")
        return self

    @property
    def releases(self) -> tuple[AnyRelease, ...]:
        """The releases as a tuple, however they were written."""
        return self.release if isinstance(self.release, tuple) else (self.release,)


def json_schema() -> dict[str, Any]:
    """Give the JSON Schema of a scenario file, for editors."""
    return {"$schema": "https://json-schema.org/draft/2020-12/schema", **Settings.model_json_schema()}
