"""Settings of elevation models, and of releases outlined on them."""

from __future__ import annotations

from typing import TYPE_CHECKING, Annotated, Any, Literal, TypeVar

from pydantic import Discriminator, Field, Tag, model_validator
from pydantic_core import PydanticCustomError

from pipeline.settings.generated import tag
from pipeline.settings.points import FilePoints
from pipeline.settings.section import Positive, Section, key, relation
from solver.physics.earth_pressure import Isotropic
from solver.scheme import Collocation

if TYPE_CHECKING:
    from pipeline.settings.settings import Settings

CURVATURE_LENGTH = 20.0
Amount = TypeVar("Amount", "PolygonRelease", "PolygonsRelease")


def _word_or_length(value: Any) -> str:
    return "word" if isinstance(value, str) else "length"


CurvatureLength = Annotated[
    Annotated[float, Field(ge=0), Tag("length")] | Annotated[Literal["none"], Tag("word")],
    Discriminator(_word_or_length),
]


class ElevationTerrain(Section):
    """An elevation model: a raster of elevations in a projected reference system."""

    advice = "real terrain; releases by polygons only"
    profile: Literal["elevation"] = key(
        "elevation model; may be left out, as `elevation` says it", default="elevation"
    )
    elevation: str = key(
        "GeoTIFF, ASC or NetCDF of elevations in m, relative to the scenario file", min_length=1
    )
    crs: str | None = key(
        "reference system of the file, as EPSG:2056. Default: its own, where it has one", default=None
    )
    curvature_length: CurvatureLength = key(
        "length over which elevations are averaged before their curvature loads friction; 0 takes the raw "
        "curvature, `none` leaves curvature out",
        "m",
        CURVATURE_LENGTH,
        advice="Run-out depends on it: raw curvature of a noisy model slows the flow.",
    )

    @property
    def length(self) -> float | None:
        """The curvature length as a number, m; None without curvature."""
        return None if isinstance(self.curvature_length, str) else self.curvature_length


class PolygonRelease(Section):
    """What one polygon of a release has of its own."""

    depth: Positive | None = key("depth within the polygon", "m", None)
    volume: Positive | None = key("volume of the polygon; in place of `depth`", "m3", None)

    @model_validator(mode="after")
    def _one_of_both(self) -> PolygonRelease:
        if self.depth is None and self.volume is None:
            raise relation("expected depth or volume, found neither", "depth", "volume")
        return _one_of_both(self)


class PolygonsRelease(Section):
    """Polygons of a file, each of one depth, at rest."""

    advice = "elevation models"
    shape: Literal["polygons"] = key(
        "polygons of a file; may be left out, as `polygons` says it", default="polygons"
    )
    polygons: str = key(
        "GeoPackage, GeoJSON or Shapefile of polygons in any reference system, relative to the scenario file",
        min_length=1,
    )
    layer: str | None = key("layer of the file; needed where it has several", default=None)
    name: str | None = key(
        "polygons whose attribute `name` is this; one without such an attribute is called by its number, "
        "from 1. Default: all of the layer",
        default=None,
    )
    depth: Positive | None = key(
        "depth within the polygons. Default: the attribute `depth` of each, in m, or without one its "
        "attribute `volume`, in m3",
        "m",
        None,
    )
    volume: Positive | None = key(
        "volume of the polygons together, which have one depth then; in place of `depth`", "m3", None
    )
    measured: Literal["normal", "vertical"] = key(
        "how depth is measured",
        default="normal",
        choices={"normal": "normal to the bed", "vertical": "vertically"},
    )
    each: dict[str, PolygonRelease] = key(
        "depth or volume of single polygons by their name, as `{slide: {depth: 2}}`; `depth` and `volume` "
        "are those of the others then. Varied keys may leave `each` out, as `release.slide.depth`",
        default={},
    )

    @model_validator(mode="after")
    def _one_of_both(self) -> PolygonsRelease:
        return _one_of_both(self)


def _one_of_both(section: Amount) -> Amount:
    """Refuse a section that has both a depth and a volume."""
    if section.depth is not None and section.volume is not None:
        raise relation("expected either depth or volume, found both", "depth", "volume")
    return section


def unfit(settings: Settings) -> PydanticCustomError | None:
    """Say which settings do not go with the terrain: polygons and elevation models need each other.

    An elevation model takes points of a spacing with open sides, the weighted-residual form and earth
    pressure without the axes of a profile.
    """
    outlined = [isinstance(release, PolygonsRelease) for release in settings.releases]
    if not isinstance(settings.terrain, ElevationTerrain):
        if any(outlined):
            return relation(
                "expected a shape, as polygons need an elevation model, found polygons", "release", "terrain"
            )
        return None
    needs = "on an elevation model"
    if not all(outlined):
        return relation(f"expected polygons {needs}, found another shape", "release", "terrain")
    if isinstance(settings.points, FilePoints):
        found = settings.points.layout
        expected = f"expected layout lattice, poisson-disc or graded {needs}, found {found}"
        return relation(expected, "points.layout", "terrain")
    if settings.points.spacing is None:
        return relation(f"expected a spacing {needs}, found a count", "points.count", "terrain")
    if settings.scheme.source is Collocation:
        return relation(
            f"expected form weighted-residual {needs}, found collocation", "scheme.form", "terrain"
        )
    pressure = settings.material.laws()[1]
    if not (isinstance(pressure, Isotropic) or pressure.along_flow):
        asked = f"expected isotropic or mohr-coulomb-flow {needs}, found {tag(type(pressure))}"
        return relation(asked, "material.earth_pressure", "terrain")
    for side, stands in settings.boundaries:
        if stands != "open":
            return relation(f"expected open {needs}, found another side", f"boundaries.{side}", "terrain")
    if settings.georeference is not None:
        return relation(
            "expected none, as an elevation model has its own reference system, found a georeference",
            "georeference",
            "terrain",
        )
    return None
