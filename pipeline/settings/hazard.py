"""Sections of a scenario that say how its results are mapped; no run depends on them."""

from __future__ import annotations

import re
from collections.abc import Sequence
from itertools import pairwise
from typing import Annotated, Literal

from pydantic import Field, model_validator

from pipeline.mistakes import describe
from pipeline.settings.section import Pair, Positive, Section, key, relation

Thresholds = tuple[Positive, ...]
Edge = Annotated[float, Field(ge=0)]
Share = Annotated[float, Field(gt=0, le=1)]
IntensityClass = Annotated[int, Field(ge=1, le=3)]
Level = Annotated[int, Field(ge=0, le=4)]

RECOMMENDATION = (
    "BWW, BRP and BUWAL (1997): Berücksichtigung der Hochwassergefahren bei raumwirksamen Tätigkeiten, "
    "Empfehlungen, Biel; debris flows"
)
# of debris flows, kg m-3
USUAL_DENSITY = 2000.0
_CRS = re.compile(r"[A-Za-z]+:[0-9]+")


def _check_ascending(name: str, edges: Sequence[float]) -> None:
    if any(low >= high for low, high in pairwise(edges)):
        raise relation(f"expected ascending numbers, found {', '.join(map(describe, edges))}", name)


def _check_shape(name: str, matrix: Sequence[Sequence[int]], rows: int, columns: int) -> None:
    found = [len(row) for row in matrix]
    if found != [columns] * rows:
        raise relation(f"expected {rows} rows of {columns} values, found {len(found)} rows of {found}", name)


class Georeference(Section):
    """Where the profile lies on the map."""

    crs: str = key("projected coordinate reference system with metres, by its code, as EPSG:2056")
    origin: Pair = key("easting and northing of horizontal distance 0 at y = 0", "m")
    azimuth: Annotated[float, Field(ge=0, lt=360)] = key(
        "direction of growing x, clockwise from the north of the map; y grows to the left of it", "degrees"
    )
    receptors: Literal["bed", "map"] = key(
        "what receptors are given in: x and y on the bed, or easting and northing", default="bed"
    )
    releases: Literal["bed", "map"] = key(
        "what the centres of releases are given in; unlike the rest it changes the scenario", default="bed"
    )

    @model_validator(mode="after")
    def _coded(self) -> Georeference:
        if not _CRS.fullmatch(self.crs):
            raise relation(f"expected a code as EPSG:2056, found {describe(self.crs)}", "crs")
        return self


class Intensity(Section):
    """Classes of intensity, 1 weak, 2 medium and 3 strong, by the largest depth and speed at a place.

    The default is the Swiss one for debris flows: strong above 1 m and 1 m/s, else medium, never weak.
    """

    depth: Annotated[tuple[Edge, ...], Field(min_length=1)] = key(
        "edges above which the rows of `classes` begin; nothing below the first one is classed",
        "m",
        (0.0, 1.0),
    )
    speed: Annotated[tuple[Edge, ...], Field(min_length=1)] = key(
        "edges above which the columns begin but the first, which holds all that is slower",
        "m s-1",
        (0.0, 1.0),
    )
    classes: tuple[tuple[IntensityClass, ...], ...] = key(
        "class of each row (depth) and column (speed)", default=((2, 2), (2, 3))
    )
    source: str = key("where the classes are from, shown with the maps", default=RECOMMENDATION)

    @model_validator(mode="after")
    def _matrix(self) -> Intensity:
        for name, edges in (("depth", self.depth), ("speed", self.speed)):
            _check_ascending(name, edges)
        _check_shape("classes", self.classes, len(self.depth), len(self.speed))
        return self


class Levels(Section):
    """Hazard levels by intensity and return period: 1 residual, 2 low, 3 medium, 4 high, 0 none.

    The default is the Swiss matrix, in its more cautious reading for medium intensity at short return
    periods.
    """

    return_periods: Annotated[tuple[Positive, ...], Field(min_length=1)] = key(
        "upper ends of the columns of `matrix` but the last, which holds all that is rarer",
        "years",
        (30.0, 100.0, 300.0),
    )
    matrix: tuple[tuple[Level, ...], ...] = key(
        "level of each class of intensity (a row each, weak first) and return period (column)",
        default=((3, 2, 2, 1), (4, 3, 3, 1), (4, 4, 4, 1)),
    )
    source: str = key("where the levels are from, shown with the maps", default=RECOMMENDATION)

    @model_validator(mode="after")
    def _matrix(self) -> Levels:
        _check_ascending("return_periods", self.return_periods)
        _check_shape("matrix", self.matrix, 3, len(self.return_periods) + 1)
        return self


class Hazard(Section):
    """What `pipeline hazard` maps."""

    density: Positive | None = key(
        "of the flow, for its dynamic pressure. Default: `material.density` of each run, without one 2000",
        "kg m-3",
        None,
    )
    depth: Thresholds = key("thresholds of the largest depth", "m", (0.5, 1.0, 2.0))
    speed: Thresholds = key("thresholds of the largest speed", "m s-1", (1.0, 5.0, 10.0))
    momentum_flux: Thresholds = key(
        "thresholds of the largest momentum flux, depth times speed squared", "m3 s-2", ()
    )
    pressure: Thresholds = key(
        "thresholds of the largest dynamic pressure, density times speed squared", "kPa", ()
    )
    erosion_depth: Thresholds = key(
        "thresholds of the depth of erosion, where the scenario has an erodible bed", "m", (0.5, 1.0)
    )
    quantiles: tuple[Share, ...] = key("quantiles that are mapped", default=(0.5, 0.9))
    outlines: tuple[Annotated[float, Field(gt=0, lt=1)], ...] = key(
        "shares of runs whose outlines are written, for each threshold", default=(0.1, 0.5, 0.9)
    )
    share: Share = key(
        "share of the runs that must reach a class of intensity for a place to be of it", default=0.5
    )
    intensity: Intensity = key("classes of intensity", default=Intensity())
    levels: Levels = key("levels of hazard, where runs have return periods", default=Levels())
