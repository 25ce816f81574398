"""Settings of the terrain: slope profiles."""

from __future__ import annotations

from itertools import pairwise
from typing import Annotated, Literal

from pydantic import Field, model_validator

from pipeline.settings.section import Angle, Positive, Section, key, relation


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
        "law of the inclination in the bend; quadratic is eq. 26 as printed", default="linear"
    )
    curvature: bool = key("whether bed curvature adds to the normal load in the friction", default=True)

    @model_validator(mode="after")
    def _ordered(self) -> Bend:
        if not self.start < self.end:
            found = f"expected a number above start ({self.start:g}), found {self.end:g}"
            raise relation(found, "end", "start")
        return self


class Segment(Section):
    """One straight piece of a slope of segments."""

    start: float = key("where the segment begins", "m")
    angle: Angle = key("inclination of the segment", "degrees")


class Segments(Section):
    """A slope of straight segments with smoothed joints."""

    profile: Literal["segments"] = key("slope of straight segments, the inclination linear over each joint")
    segments: tuple[Segment, ...] = key(
        "segments from top to bottom; the first also holds above its start", min_length=1
    )
    joint: Positive = key("length of a joint, centred on the start of each later segment", "m")
    curvature: bool = key("whether bed curvature adds to the normal load in the friction", default=True)

    @model_validator(mode="after")
    def _ordered(self) -> Segments:
        for i, (above, below) in enumerate(pairwise(self.segments), 1):
            least = above.start + (self.joint if i > 1 else self.joint / 2)
            if not (below.start > above.start and below.start >= least):
                found = f"expected at least {least:g} (clear of the joint before), found {below.start:g}"
                raise relation(found, f"segments.{i}.start", "joint")
        return self


class Table(Section):
    """A slope read from a table."""

    profile: Literal["table"] = key("slope read from a table of horizontal distance and elevation")
    file: str = key(
        "CSV with the columns `distance` (horizontal) and `elevation`, m unless a heading says `(km)` or "
        "`(ft)`, relative to the scenario file",
        min_length=1,
    )
    smoothing: Positive = key("horizontal length over which the table's corners are rounded", "m")
    curvature: bool = key("whether bed curvature adds to the normal load in the friction", default=True)


Terrain = Annotated[Plane | Bend | Segments | Table, Field(discriminator="profile")]
