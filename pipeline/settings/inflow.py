"""Settings of inflows, and of sections that discharge is measured at."""

from __future__ import annotations

from itertools import pairwise
from typing import TYPE_CHECKING, Annotated, Any, Literal

from pydantic import Discriminator, Field, Tag, model_validator
from pydantic_core import PydanticCustomError

from pipeline.settings.generated import Generated, section_of, union_of
from pipeline.settings.section import Pair, Positive, Section, key, relation
from solver.inflow.hydrograph import Triangle as TriangleOfVolume
from solver.scheme import Collocation

if TYPE_CHECKING:
    from pipeline.settings.settings import Settings

Line = Annotated[tuple[Pair, ...], Field(min_length=2)]
NotNegative = Annotated[float, Field(ge=0)]
LONGEST_NAME = 100


class HydrographFile(Section):
    """A hydrograph in a file: linear between its times, zero before the first and after the last."""

    advice = "measured or computed discharge"
    shape: Literal["file"] = key("hydrograph of a file; may be left out, as `file` says it", default="file")
    file: str = key(
        "CSV with one header line and columns `time` (increasing) and `discharge` (not negative), in s and "
        "m3/s unless the heading says another unit: `time (min)` or `(h)`, `discharge (l/s)`; relative to "
        "the scenario file; its content is part of the scenario",
        min_length=1,
    )


class HydrographList(Section):
    """A hydrograph of a few numbers: linear between its times, zero before the first and after the last."""

    advice = "a few times and discharges"
    shape: Literal["list"] = key("hydrograph of lists; may be left out, as `times` says it", default="list")
    times: Annotated[tuple[NotNegative, ...], Field(min_length=2)] = key("times, increasing", "s")
    discharges: Annotated[tuple[NotNegative, ...], Field(min_length=2)] = key(
        "discharge at each of the times", "m3 s-1"
    )

    @model_validator(mode="after")
    def _fit(self) -> HydrographList:
        if len(self.discharges) != len(self.times):
            wanted = f"expected {len(self.times)} values, one a time, found {len(self.discharges)}"
            raise relation(wanted, "discharges", "times")
        for i, (before, after) in enumerate(pairwise(self.times), 1):
            if after <= before:
                raise relation(
                    f"expected times that increase, found {after:g} after {before:g}", f"times.{i}"
                )
        if not any(self.discharges):
            raise relation("expected a discharge above 0, found none", "discharges")
        return self


def _word_or_number(value: Any) -> str:
    return "word" if isinstance(value, str) else "number"


NormalOrDepth = Annotated[
    Annotated[Positive, Tag("number")] | Annotated[Literal["normal"], Tag("word")],
    Discriminator(_word_or_number),
]

Triangle = section_of(TriangleOfVolume, "shape")
# pickle finds it here
Triangle.__module__ = __name__
if TYPE_CHECKING:
    AnyHydrograph = Generated | HydrographFile | HydrographList
else:
    AnyHydrograph = union_of(
        "shape", [HydrographFile, HydrographList, Triangle], implied={"file": "file", "times": "list"}
    )


class Inflow(Section):
    """What comes in through a section."""

    name: str = key("name in messages and tables", min_length=1, max_length=LONGEST_NAME)
    section: Line = key(
        "corners of the line that flow comes in through, in coordinates of the domain. Flow goes inward "
        "where the line is along one side of the domain, else down the bed; on level ground to the right "
        "hand of who walks along the line",
        "m",
    )
    hydrograph: AnyHydrograph = key("discharge over time")
    depth: NormalOrDepth | None = key(
        "`normal` for the depth of uniform flow down the bed at the section, with any law of friction but "
        "coulomb and edwards; or the largest depth of the section. Default: `normal`, unless froude or "
        "speed is given",
        "m",
        None,
    )
    froude: Positive | None = key(
        "Froude number of what comes in, in place of depth",
        "",
        None,
        advice="Surges of debris: about 1 to 3.",
    )
    speed: Positive | None = key("speed of what comes in, in place of depth", "m s-1", None)

    @model_validator(mode="after")
    def _one_condition(self) -> Inflow:
        given = [name for name in ("depth", "froude", "speed") if getattr(self, name) is not None]
        if len(given) > 1:
            raise relation(f"expected one of depth, froude and speed, found {' and '.join(given)}", given[1])
        if self.section[0] == self.section[-1]:
            raise relation("expected a line with two ends, found one whose ends coincide", "section")
        return self

    @property
    def file(self) -> str | None:
        """The file of its hydrograph, where it is in one."""
        return self.hydrograph.file if isinstance(self.hydrograph, HydrographFile) else None


class MeasuredSection(Section):
    """A line that discharge is measured at."""

    name: str = key("name in tables and pictures", min_length=1, max_length=LONGEST_NAME)
    line: Line = key(
        "corners of the line, in coordinates of the domain; discharge counts down the bed, on level ground "
        "to the right hand of who walks along the line",
        "m",
    )

    @model_validator(mode="after")
    def _has_ends(self) -> MeasuredSection:
        if self.line[0] == self.line[-1]:
            raise relation("expected a line with two ends, found one whose ends coincide", "line")
        return self


def unfit(settings: Settings) -> PydanticCustomError | None:
    """Say which settings do not go with inflows and sections, or with neither a release nor an inflow."""
    if not settings.releases and not settings.inflow:
        return relation("expected a release or an inflow, found neither", "release", "inflow")
    for name in ("inflow", "sections"):
        listed = getattr(settings, name)
        if not listed:
            continue
        if settings.scheme.source is Collocation:
            return relation(
                f"expected form weighted-residual with {name}, found collocation", "scheme.form", name
            )
        if settings.domain is None and not settings.on_surface:
            return relation(f"expected a domain with {name}, found none", "domain", name)
        names = [each.name for each in listed]
        for i, each in enumerate(names):
            if each in names[:i]:
                return relation(f"expected a name of its own, found '{each}' again", f"{name}.{i}.name")
    return None
