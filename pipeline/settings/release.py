"""Settings of the release: its shapes."""

from __future__ import annotations

from typing import Annotated, Literal

from pydantic import Field, model_validator

from pipeline.settings.section import Pair, Positive, Section, check_bounds, key, relation


class Release(Section):
    """What every release may have."""

    volume: Annotated[float, Field(gt=0)] | None = key(
        "volume; the depth is scaled so that the cells hold it. Default: that of the shape", "m3", None
    )
    velocity: Pair = key("initial velocity along and across the bed", "m s-1", (0.0, 0.0))


class Hemisphere(Release):
    """A half ball."""

    shape: Literal["hemisphere"] = key("half ball")
    centre: Pair = key("centre", "m")
    radius: Positive = key("radius", "m")


class Cap(Release):
    """A spherical cap."""

    shape: Literal["cap"] = key("spherical cap")
    centre: Pair = key("centre", "m")
    radius: Positive = key("radius of the base", "m")
    height: Positive = key("depth at the centre, at most the radius", "m")

    @model_validator(mode="after")
    def _no_overhang(self) -> Cap:
        if self.height > self.radius:
            found = f"expected at most radius ({self.radius:g}), found {self.height:g}"
            raise relation(found, "height", "radius")
        return self


class Paraboloid(Release):
    """An elliptic paraboloid."""

    shape: Literal["paraboloid"] = key("elliptic paraboloid")
    centre: Pair = key("centre", "m")
    radii: tuple[Positive, Positive] = key("half axes of the base along and across the bed", "m")
    height: Positive = key("depth at the centre", "m")


class Box(Release):
    """A box of constant depth."""

    shape: Literal["box"] = key("box of constant depth")
    x: Pair = key("extent along the bed", "m")
    y: Pair = key("extent across the bed", "m")
    height: Positive = key("depth", "m")

    @model_validator(mode="after")
    def _ordered(self) -> Box:
        check_bounds("x", self.x)
        check_bounds("y", self.y)
        return self


class Cylinder(Release):
    """A round column of constant depth."""

    shape: Literal["cylinder"] = key("round column of constant depth")
    centre: Pair = key("centre", "m")
    radius: Positive = key("radius", "m")
    height: Positive = key("depth", "m")


AnyRelease = Annotated[Hemisphere | Cap | Paraboloid | Box | Cylinder, Field(discriminator="shape")]
