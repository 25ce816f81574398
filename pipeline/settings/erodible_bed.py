"""Settings of an erodible bed: how deep it is where, and by which law it is taken up."""

from __future__ import annotations

from typing import TYPE_CHECKING, Annotated, Any, Literal, TypeAlias

from pydantic import Discriminator, Field, Tag, create_model, model_validator
from pydantic_core import PydanticCustomError

from pipeline.settings.generated import Generated, keys_of
from pipeline.settings.physics import AnyErosionLaw
from pipeline.settings.points import Region
from pipeline.settings.section import Section, key, kind, relation
from pipeline.settings.zones import ErosionZone, laws_of_zones
from solver.parameters import ParameterError, parameters
from solver.physics.erosion import ErosionLaw, ErosionLimits, check_together
from solver.scheme import Collocation

if TYPE_CHECKING:
    from pipeline.settings.settings import Settings

FIELDS = ("erosion_depth", "bed_change")
"""Fields of the store that only runs on an erodible bed have."""


def _number_or_file(value: Any) -> str:
    return "file" if isinstance(value, str) else "number"


DepthOrFile = Annotated[
    Annotated[float, Field(ge=0), Tag("number")] | Annotated[str, Field(min_length=1), Tag("file")],
    Discriminator(_number_or_file),
]


class ErodibleBedKeys(Section):
    """What the flow may take up from its bed."""

    depth: DepthOrFile | None = key(
        "erodible depth: a number, or on an elevation model a raster of depths in m (GeoTIFF, ASC, NetCDF) "
        "in its reference system, no data counting as 0. It may be left out where each of `polygons` has an "
        "attribute `depth`",
        "m",
        None,
        advice="Down to rock or to the layer that past events did not reach: it bounds what the laws take.",
    )
    region: Region | None = key("part of a slope profile that is erodible. Default: all of it", default=None)
    polygons: str | None = key(
        "polygons that are erodible, on an elevation model: GeoPackage, GeoJSON or Shapefile in any "
        "reference system; where they overlap depths add up. Default: all of it",
        default=None,
        min_length=1,
    )
    layer: str | None = key("layer of the file of polygons; needed where it has several", default=None)
    name: str | None = key("polygons whose attribute `name` is this. Default: all of the layer", default=None)
    measured: Literal["normal", "vertical"] = key(
        "how depth is measured",
        default="normal",
        choices={"normal": "normal to the bed", "vertical": "vertically"},
    )

    zones: tuple[ErosionZone, ...] | None = key(
        "parts of the domain where the law has other parameters; where they overlap the later one counts, "
        "and a cell on an edge has means over its area",
        default=None,
    )

    if TYPE_CHECKING:
        law: Generated
        minimum_depth: float
        minimum_speed: float

    @property
    def raster(self) -> str | None:
        """File of depths, where the depth is read from one."""
        return self.depth if isinstance(self.depth, str) else None

    @property
    def limits(self) -> ErosionLimits:
        """From when on the flow erodes."""
        return ErosionLimits(self.minimum_depth, self.minimum_speed)

    def erosion_law(self, density: float | None = None) -> ErosionLaw:
        """Make the law of erosion; ``density`` is that of the flow, kg m-3."""
        named = {each.name for each, _ in parameters(self.law.source)}
        made: ErosionLaw = self.law.make(**({"density": density} if "density" in named else {}))
        return made

    def zone_laws(self, density: float | None = None) -> tuple[ErosionLaw, ...]:
        """Make the laws of erosion of the zones.

        Raises
        ------
        PydanticCustomError
            If a zone has a parameter that is none of the law's.
        """
        return laws_of_zones(self.zones, self.erosion_law(density))

    @model_validator(mode="after")
    def _consistent(self) -> ErodibleBedKeys:
        if self.depth is None and self.polygons is None:
            raise relation("expected a value, found nothing", "depth")
        for name in ("layer", "name"):
            if getattr(self, name) is not None and self.polygons is None:
                raise relation(f"expected polygons, as {name} is given, found none", "polygons", name)
        try:
            check_together(self.erosion_law(), self.limits)
        except ParameterError as error:
            raise relation(error.message, *error.names, "law") from None
        self.zone_laws()
        return self


if TYPE_CHECKING:
    ErodibleBed: TypeAlias = ErodibleBedKeys
else:
    ErodibleBed = create_model(
        "ErodibleBed",
        __base__=ErodibleBedKeys,
        __doc__=ErodibleBedKeys.__doc__,
        __module__=__name__,
        law=(AnyErosionLaw, key("law by which the bed is taken up")),
        **keys_of(ErosionLimits),
    )


def unfit(settings: Settings) -> PydanticCustomError | None:
    """Say which settings do not go with an erodible bed, or with none."""
    bed = settings.erodible_bed
    if bed is None:
        named = [name for name in FIELDS if name in settings.output.fields]
        if named and "fields" in settings.output.model_fields_set:
            found = f"expected an erodible bed, as {named[0]} is kept, found none"
            return relation(found, "output.fields", "erodible_bed")
        return None
    density = getattr(settings.material, "density")  # noqa: B009
    laws = bed.erosion_law(density), *bed.zone_laws(density)
    if any(each.needs_density for each in laws) and density is None:
        found = f"expected a density with erosion by {kind(type(bed.law))}, found nothing"
        return relation(found, "material.density", "erodible_bed.law")
    if settings.scheme.source is Collocation:
        return relation(
            "expected form weighted-residual with an erodible bed, as the other does not conserve volume, "
            "found collocation",
            "scheme.form",
            "erodible_bed",
        )
    if settings.on_surface and bed.region is not None:
        return relation(
            "expected polygons on an elevation model, found a region", "erodible_bed.region", "terrain"
        )
    if not settings.on_surface and bed.polygons is not None:
        return relation(
            "expected a region, as polygons need an elevation model, found polygons",
            "erodible_bed.polygons",
            "terrain",
        )
    if not settings.on_surface and bed.raster is not None:
        return relation(
            "expected a number, as a raster needs an elevation model, found a file",
            "erodible_bed.depth",
            "terrain",
        )
    return None
