"""Settings of the points: a lattice or a cloud."""

from __future__ import annotations

from itertools import pairwise
from math import hypot
from typing import Annotated, ClassVar, Literal

from pydantic import Field, Tag, model_validator

from pipeline.settings.section import Pair, Positive, Section, check_bounds, chosen_by, key, relation

MOST_SCATTERED = 10_000_000
Seed = Annotated[int, Field(ge=0, lt=2**63)]


class LatticePoints(Section):
    """Regular points from bound to bound."""

    advice = "all assessments on a slope profile"
    layout: Literal["lattice"] = key("regular points from bound to bound", default="lattice")
    spacing: Positive = key(
        "distance between neighbouring points",
        "m",
        advice="Ten or more across the release and across the channel; halve it and compare before results "
        "are used. Half the spacing takes about eight times as long.",
    )
    most: ClassVar[int] = 100_000_000

    def estimate(self, width: float, height: float) -> float:
        """Estimate the number of points in a domain of this size, m."""
        return (1 + width / self.spacing) * (1 + height / self.spacing)


class PoissonDiscPoints(Section):
    """Points placed at random and evenly, by their number or their spacing."""

    advice = "tests of what the directions of a lattice do to a result"
    layout: Literal["poisson-disc"] = key("points placed at random and evenly")
    count: Annotated[int, Field(ge=3)] | None = key(
        "number of points, met within 1 %; or `spacing`", default=None
    )
    spacing: Positive | None = key("root of the area per point; or `count`", "m", None)
    seed: Seed = key("seed of the places: the same seed gives the same points everywhere", default=0)

    @model_validator(mode="after")
    def _one_of_both(self) -> PoissonDiscPoints:
        if (self.count is None) == (self.spacing is None):
            found = "nothing" if self.count is None else "both"
            raise relation(f"expected either count or spacing, found {found}", "count", "spacing")
        return self

    most: ClassVar[int] = MOST_SCATTERED

    def estimate(self, width: float, height: float) -> float:
        """Estimate the number of points in a domain of this size, m."""
        return self.count or (width / (self.spacing or 1.0)) * (height / (self.spacing or 1.0))


class Region(Section):
    """A rectangle."""

    x: Pair = key("bounds along the bed (arc length); eastings on an elevation model", "m")
    y: Pair = key("bounds across the bed; northings on an elevation model", "m")

    @model_validator(mode="after")
    def _ordered(self) -> Region:
        check_bounds("x", self.x)
        check_bounds("y", self.y)
        return self

    def holds(self, x: float, y: float) -> bool:
        """Whether a place is in it or on its edge."""
        return self.x[0] <= x <= self.x[1] and self.y[0] <= y <= self.y[1]


class Refine(Section):
    """A region with closer points: a rectangle, or what is near a line or a receptor."""

    region: Region | None = key("where the points stand closer; or `line` or `receptor`", default=None)
    line: Annotated[tuple[Pair, ...], Field(min_length=2)] | None = key(
        "corners of a line along which the points stand closer, as the bottom of a channel; or `region`",
        "m",
        None,
    )
    receptor: str | None = key(
        "name of a receptor where the points stand closer: along its line, or in the rectangle around its "
        "point or polygon; or `region`",
        default=None,
    )
    margin: Annotated[float, Field(ge=0)] = key(
        "distance from the line or the receptor within which they stand so", "m", default=0.0
    )
    spacing: Positive = key("root of the area per point there", "m")

    @model_validator(mode="after")
    def _one_of_both(self) -> Refine:
        found = [name for name in ("region", "line", "receptor") if getattr(self, name) is not None]
        if len(found) != 1:
            words = " and ".join(found) or "nothing"
            raise relation(
                f"expected one of region, line and receptor, found {words}", *(found or ["region"])
            )
        if self.region is not None and self.margin > 0:
            raise relation("expected no margin with region, found one", "margin", "region")
        return self

    @property
    def area(self) -> float:
        """Area where the points stand closer, about, m2."""
        if self.region is not None:
            (x0, x1), (y0, y1) = self.region.x, self.region.y
            return (x1 - x0) * (y1 - y0)
        length = sum(hypot(b[0] - a[0], b[1] - a[1]) for a, b in pairwise(self.line or ()))
        return length * (2 * self.margin + self.spacing)


class GradedPoints(Section):
    """Points placed at random, closer in regions of interest."""

    advice = "small objects in a long run-out"
    layout: Literal["graded"] = key("points placed at random, closer in regions of interest")
    spacing: Positive = key("root of the area per point away from the regions", "m")
    refine: tuple[Refine, ...] = key("regions with closer points", min_length=1)
    growth: Annotated[float, Field(gt=0, le=0.5)] = key(
        "change of the spacing per distance between the regions and the rest",
        default=0.1,
        advice="Leave it.",
    )
    seed: Seed = key("seed of the places: the same seed gives the same points everywhere", default=0)
    most: ClassVar[int] = MOST_SCATTERED

    @property
    def closest(self) -> float:
        """Smallest spacing anywhere, m."""
        return min(self.spacing, *(refine.spacing for refine in self.refine))

    def estimate(self, width: float, height: float) -> float:
        """Estimate the number of points in a domain of this size, m."""
        count = (width / self.spacing) * (height / self.spacing)
        return count + sum(refine.area / refine.spacing**2 for refine in self.refine)


class FilePoints(Section):
    """Points from a file."""

    advice = "points made by another program"
    layout: Literal["file"] = key("points from a file")
    path: Annotated[str, Field(min_length=1)] = key(
        "CSV with the columns x and y, or NetCDF with the variables x and y, m, relative to the scenario file"
    )
    most: ClassVar[int] = MOST_SCATTERED

    def estimate(self, width: float, height: float) -> float:
        """Leave the number of points to the file."""
        return 0.0


Points = Annotated[
    Annotated[LatticePoints, Tag("lattice")]
    | Annotated[PoissonDiscPoints, Tag("poisson-disc")]
    | Annotated[GradedPoints, Tag("graded")]
    | Annotated[FilePoints, Tag("file")],
    chosen_by("layout", "lattice"),
]
