"""Settings of a scenario: every key, with its unit, default and limits."""

from __future__ import annotations

from typing import Annotated, Any, ClassVar, Literal

from pydantic import BaseModel, ConfigDict, Discriminator, Field, Tag, model_validator
from pydantic_core import PydanticCustomError

FIELDS = (
    "depth", "velocity_x", "velocity_y", "max_depth", "max_speed", "max_momentum_flux", "arrival_time",
    "deposit_depth",
)  # fmt: skip
FieldName = Literal[
    "depth", "velocity_x", "velocity_y", "max_depth", "max_speed", "max_momentum_flux", "arrival_time",
    "deposit_depth",
]  # fmt: skip

Angle = Annotated[float, Field(gt=-90, lt=90)]
FrictionAngle = Annotated[float, Field(ge=0, lt=90)]
Positive = Annotated[float, Field(gt=0)]
Point = tuple[float, float]
Scalar = float | str | bool


def relation(message: str, *keys: str) -> PydanticCustomError:
    """Make the error of keys that are each right but not together; the first key is the one to blame."""
    return PydanticCustomError("relation", "{message}", {"message": message, "keys": keys})


class Section(BaseModel):
    """Base of all sections: frozen, no unknown keys, no conversions, finite numbers only."""

    model_config = ConfigDict(frozen=True, extra="forbid", strict=True, allow_inf_nan=False)
    unit: ClassVar[dict[str, str]] = {}


def key(description: str, unit: str = "", default: Any = ..., **limits: Any) -> Any:
    """Declare a key with its meaning and unit, which the JSON Schema and the reference table show."""
    return Field(default, description=description, json_schema_extra={"unit": unit} if unit else None, **limits)


class Plane(Section):
    """A plane slope."""

    profile: Literal["plane"] = key("plane slope")
    angle: Angle = key("inclination, positive downslope", "degrees")


class Bend(Section):
    """A slope that bends into a run-out."""

    profile: Literal["bend"] = key("slope that bends into a run-out")
    angle: Angle = key("inclination above the bend", "degrees")
    start: float = key("where the bend begins", "m")
    end: float = key("where the bend ends, above `start`", "m")
    runout_angle: Angle = key("inclination below the bend", "degrees", 0.0)
    transition: Literal["linear", "quadratic"] = key(
        "law of the inclination in the bend; quadratic is eq. 26 as printed", default="linear")
    curvature: bool = key("whether bed curvature adds to the normal load in the friction", default=True)

    @model_validator(mode="after")
    def _ordered(self) -> Bend:
        if not self.start < self.end:
            raise relation(f"expected a number above start ({self.start:g}), found {self.end:g}", "end", "start")
        return self


class Segment(Section):
    """One straight piece of a slope of segments."""

    start: float = key("where the segment begins", "m")
    angle: Angle = key("inclination of the segment", "degrees")


class Segments(Section):
    """A slope of straight segments with smoothed joints."""

    profile: Literal["segments"] = key("slope of straight segments, the inclination linear over each joint")
    segments: tuple[Segment, ...] = key("segments from top to bottom; the first also holds above its start",
                                        min_length=1)
    joint: Positive = key("length of a joint, centred on the start of each later segment", "m")
    curvature: bool = key("whether bed curvature adds to the normal load in the friction", default=True)

    @model_validator(mode="after")
    def _ordered(self) -> Segments:
        for i, (above, below) in enumerate(zip(self.segments, self.segments[1:], strict=False), 1):
            if below.start - above.start < (self.joint if i > 1 else self.joint / 2):
                raise relation(
                    f"expected joints of length {self.joint:g} that do not overlap, found a start at "
                    f"{below.start:g} after one at {above.start:g}", f"segments.{i}.start", "joint", "segments")
        return self


class Table(Section):
    """A slope read from a table."""

    profile: Literal["table"] = key("slope read from a table of horizontal distance and elevation")
    file: str = key("CSV with one header line and columns of distance and elevation in m, "
                    "relative to the scenario file", min_length=1)
    smoothing: Positive = key("horizontal length over which the table's corners are rounded", "m")
    curvature: bool = key("whether bed curvature adds to the normal load in the friction", default=True)


Terrain = Annotated[Plane | Bend | Segments | Table, Field(discriminator="profile")]


class Domain(Section):
    """Bounds of the lattice's points."""

    x: Point = key("first and last point along the bed (arc length)", "m")
    y: Point = key("first and last point across the bed", "m")

    @model_validator(mode="after")
    def _ordered(self) -> Domain:
        for axis in ("x", "y"):
            low, high = getattr(self, axis)
            if not low < high:
                raise relation(f"expected a lower bound below the upper one, found [{low:g}, {high:g}]", axis)
        return self


class LatticePoints(Section):
    """Regular points from bound to bound."""

    layout: Literal["lattice"] = key("regular points from bound to bound", default="lattice")
    spacing: Positive = key("distance between neighbouring points", "m")


class Release(Section):
    """What every release may have."""

    volume: Annotated[float, Field(gt=0)] | None = key(
        "volume; the depth is scaled so that the cells hold it. Default: that of the shape", "m3", None)
    velocity: Point = key("initial velocity along and across the bed", "m s-1", (0.0, 0.0))


class Hemisphere(Release):
    """A half ball."""

    shape: Literal["hemisphere"] = key("half ball")
    centre: Point = key("centre", "m")
    radius: Positive = key("radius", "m")


class Cap(Release):
    """A spherical cap."""

    shape: Literal["cap"] = key("spherical cap")
    centre: Point = key("centre", "m")
    radius: Positive = key("radius of the base", "m")
    height: Positive = key("depth at the centre, at most the radius", "m")

    @model_validator(mode="after")
    def _no_overhang(self) -> Cap:
        if self.height > self.radius:
            raise relation(f"expected at most radius ({self.radius:g}), found {self.height:g}", "height", "radius")
        return self


class Paraboloid(Release):
    """An elliptic paraboloid."""

    shape: Literal["paraboloid"] = key("elliptic paraboloid")
    centre: Point = key("centre", "m")
    radii: tuple[Positive, Positive] = key("half axes of the base along and across the bed", "m")
    height: Positive = key("depth at the centre", "m")


class Box(Release):
    """A box of constant depth."""

    shape: Literal["box"] = key("box of constant depth")
    x: Point = key("extent along the bed", "m")
    y: Point = key("extent across the bed", "m")
    height: Positive = key("depth", "m")

    _ordered = model_validator(mode="after")(Domain._ordered)


class Cylinder(Release):
    """A round column of constant depth."""

    shape: Literal["cylinder"] = key("round column of constant depth")
    centre: Point = key("centre", "m")
    radius: Positive = key("radius", "m")
    height: Positive = key("depth", "m")


AnyRelease = Annotated[Hemisphere | Cap | Paraboloid | Box | Cylinder, Field(discriminator="shape")]


class Material(Section):
    """Friction and earth pressure."""

    bed_friction: FrictionAngle = key("bed friction angle", "degrees")
    internal_friction: FrictionAngle | None = key(
        "internal friction angle, at least `bed_friction`; needed with mohr-coulomb", "degrees", None)
    earth_pressure: Literal["mohr-coulomb", "isotropic"] = key(
        "earth pressure coefficient: eqs. 8-11, or 1 everywhere", default="mohr-coulomb")
    turbulent_friction: Positive | None = key(
        "Voellmy's turbulent friction; Coulomb friction alone where it is left out", "m s-2", None)

    @model_validator(mode="after")
    def _well_posed(self) -> Material:
        if self.earth_pressure != "mohr-coulomb":
            return self
        if self.internal_friction is None:
            raise relation("expected a value with earth_pressure mohr-coulomb, found nothing",
                           "internal_friction", "earth_pressure")
        if self.internal_friction < self.bed_friction:
            raise relation(
                f"expected at most internal_friction ({self.internal_friction:g}) with earth_pressure "
                f"mohr-coulomb, found {self.bed_friction:g}", "bed_friction", "internal_friction", "earth_pressure")
        return self


class GivenDepth(Section):
    """A side where the depth is given."""

    depth: Annotated[float, Field(ge=0)] = key("depth held at the side", "m")


def _kind_of_side(value: Any) -> str:
    return "given" if isinstance(value, dict | GivenDepth) else "kind"


Side = Annotated[
    Annotated[Literal["open", "wall", "no-slip"], Tag("kind")] | Annotated[GivenDepth, Tag("given")],
    Discriminator(_kind_of_side),
]


class Boundaries(Section):
    """What stands at each side."""

    x_min: Side = key("upslope side: `open`, `wall`, `no-slip` or `{depth: value in m}`", default="open")
    x_max: Side = key("downslope side, likewise", default="open")
    y_min: Side = key("side of lowest y, likewise", default="open")
    y_max: Side = key("side of highest y, likewise", default="open")


class Scheme(Section):
    """Numerical choices."""

    form: Literal["weighted-residual"] = key("conservative weighted-residual form", default="weighted-residual")
    cfl: Annotated[float, Field(gt=0, le=1)] = key("Courant number of the time step", default=0.9)
    film_depth: Annotated[float, Field(gt=0, lt=1)] = key(
        "depth below which velocity is desingularised, as part of the largest initial depth", default=1e-4)


class Time(Section):
    """How long, and how often frames are kept."""

    end: Positive = key("time to stop at", "s")
    output_every: Positive | None = key("time between frames, from 0; the end always is one. "
                                        "Default: a tenth of `end`", "s", None)
    stop_at_rest: bool = key("whether a run ends once everything is at rest", default=True)

    @model_validator(mode="after")
    def _within(self) -> Time:
        if self.output_every is not None and self.output_every > self.end:
            raise relation(f"expected at most end ({self.end:g}), found {self.output_every:g}",
                           "output_every", "end")
        return self


class Output(Section):
    """What is kept."""

    fields: Annotated[tuple[FieldName, ...], Field(min_length=1)] = key(
        "fields kept in the store. Default: all", default=FIELDS)
    threshold: Positive | None = key(
        "depth above which a cell counts as reached or as deposit. Default: 1 % of the largest release depth",
        "m", None)


def _one_or_many(value: Any) -> str:
    return "many" if isinstance(value, tuple | list) else "one"


class Settings(Section):
    """A scenario: one or many runs that share a lattice, output times and a store."""

    name: str = key("name of the scenario and of its store: letters, digits, `-`, `_` and `.`, "
                    "beginning with a letter or digit", pattern=r"^[A-Za-z0-9][A-Za-z0-9._-]*$", max_length=100)
    description: str = key("what the scenario is, in a line", default="")
    gravity: Positive = key("gravity; 1 for the paper's dimensionless cases", "m s-2", 9.81)
    terrain: Terrain = key("shape of the bed")
    domain: Domain = key("bounds of the lattice")
    points: LatticePoints = key("layout of the points")
    release: Annotated[
        Annotated[AnyRelease, Tag("one")] | Annotated[tuple[AnyRelease, ...], Field(min_length=1), Tag("many")],
        Discriminator(_one_or_many),
    ] = key("what is released, one shape or a list of them")
    material: Material = key("friction and earth pressure")
    boundaries: Boundaries = key("what stands at each side", default=Boundaries())
    scheme: Scheme = key("numerical choices", default=Scheme())
    time: Time = key("duration and frames")
    output: Output = key("what is kept", default=Output())
    sweep: dict[str, Annotated[tuple[Scalar, ...], Field(min_length=1)]] = key(
        "lists of values by dotted key (`material.bed_friction`, `release.0.volume`); the runs are the product "
        "of all lists, the last varying fastest", default={})

    @property
    def releases(self) -> tuple[AnyRelease, ...]:
        """The releases as a tuple, however they were written."""
        return self.release if isinstance(self.release, tuple) else (self.release,)


def json_schema() -> dict[str, Any]:
    """Give the JSON Schema of a scenario file, for editors."""
    return {"$schema": "https://json-schema.org/draft/2020-12/schema", **Settings.model_json_schema()}
