"""Settings of structures: dams and basins, which change an elevation model, and buildings."""

from __future__ import annotations

from typing import TYPE_CHECKING, Annotated, Any, ClassVar, Literal, TypeAlias

from pydantic import Discriminator, Field, Tag
from pydantic_core import PydanticCustomError

from pipeline.settings.generated import Keys, section_with, union_of
from pipeline.settings.section import Pair, Section, key, relation
from pipeline.settings.surface import ElevationTerrain
from solver.physics.earthworks import Basin, Dam
from solver.scheme import Collocation

if TYPE_CHECKING:
    from pipeline.settings.settings import Settings

# What says where a structure is, and is one for all runs.
PLACE = ("kind", "line", "polygon", "layer", "name")


def _file_or_corners(value: Any) -> str:
    return "file" if isinstance(value, str) else "corners"


Line = Annotated[
    Annotated[tuple[Pair, ...], Field(min_length=2), Tag("corners")]
    | Annotated[str, Field(min_length=1), Tag("file")],
    Discriminator(_file_or_corners),
]
Polygon = Annotated[
    Annotated[tuple[Pair, ...], Field(min_length=3), Tag("corners")]
    | Annotated[str, Field(min_length=1), Tag("file")],
    Discriminator(_file_or_corners),
]

_FILE = "or a GeoPackage, GeoJSON or Shapefile of them in any reference system, relative to the scenario file"
_LAYER: Keys = {
    "layer": (str | None, key("layer of the file; needed where it has several", default=None)),
    "name": (
        str | None,
        key("features of the file whose attribute `name` is this. Default: all of the layer", default=None),
    ),
}
DamSection = section_with(Dam, "kind", {"line": (Line, key(f"corners of the crest, {_FILE}", "m")), **_LAYER})
BasinSection = section_with(
    Basin, "kind", {"polygon": (Polygon, key(f"corners of the upper edge, {_FILE}", "m")), **_LAYER}
)


class Building(Section):
    """A building, which nothing flows through: its faces are walls without friction.

    A cell is a building where it covers half of it or more. The cells of a cloud that is placed end at the
    building, if it is half a spacing wide or wider.
    """

    advice: ClassVar[str] = "houses and walls that stand"
    kind: Literal["building"] = key("building")
    polygon: Polygon = key(f"corners, {_FILE}", "m")
    layer: str | None = key("layer of the file; needed where it has several", default=None)
    name: str | None = key(
        "features of the file whose attribute `name` is this. Default: all of the layer", default=None
    )


if TYPE_CHECKING:
    AnyStructure: TypeAlias = Any
else:
    AnyStructure = union_of("kind", [DamSection, BasinSection, Building])
    # pickle finds sections by their names
    for _made, _name in ((DamSection, "DamSection"), (BasinSection, "BasinSection")):
        _made.__module__, _made.__qualname__ = __name__, _name


def place_of(structure: Any) -> tuple[str, str | tuple[Pair, ...]]:
    """Give the key that says where a structure is, and its value: a file, or corners."""
    name = "line" if structure.kind == "dam" else "polygon"
    return name, getattr(structure, name)


def unfit(settings: Settings) -> PydanticCustomError | None:
    """Say which structures do not go with the terrain, the points or the scheme."""
    on_surface = isinstance(settings.terrain, ElevationTerrain)
    for i, structure in enumerate(settings.structures):
        name, place = place_of(structure)
        at = ("structures", i, "kind")
        if structure.kind != "building" and not on_surface:
            needed = f"expected an elevation model with a {structure.kind}, found a profile"
            return relation(f"{needed}, whose bed has one slope across it", at, "terrain")
        if isinstance(place, str) and not on_surface:
            needed = "expected corners, as a file takes an elevation model, found a file"
            return relation(needed, ("structures", i, name), "terrain")
        if not isinstance(place, str):
            given = next((each for each in ("layer", "name") if getattr(structure, each) is not None), None)
            if given:
                needed = f"expected a file with {given}, found corners"
                return relation(needed, ("structures", i, given), f"structures.{i}.{name}")
        if structure.kind != "building":
            continue
        if settings.scheme.source is Collocation:
            needed = "expected no building with form collocation, which has no faces"
            return relation(f"{needed}, found one", at, "scheme.form")
        if settings.domain is None and not on_surface:
            return relation("expected a domain, as there is a building", "domain", "structures")
    return None
