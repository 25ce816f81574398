"""Settings of zones: parts of the domain where friction or erosion has other parameters."""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from dataclasses import replace
from typing import (
    TYPE_CHECKING,
    Annotated,
    Any,
    ClassVar,
    TypeAlias,
    TypeVar,
    get_origin,
    get_type_hints,
)

from pydantic import Discriminator, Field, Tag, create_model, model_validator
from pydantic_core import PydanticCustomError

from pipeline.settings.generated import FlatSection, keys_of, tag
from pipeline.settings.section import Pair, key, relation
from solver.parameters import Checked, Parameter, ParameterError, parameters
from solver.physics import erosion, friction


def _file_or_corners(value: Any) -> str:
    return "file" if isinstance(value, str) else "corners"


PolygonOrFile = Annotated[
    Annotated[str, Field(min_length=1), Tag("file")]
    | Annotated[tuple[Pair, ...], Field(min_length=3), Tag("corners")],
    Discriminator(_file_or_corners),
]
Law = TypeVar("Law", bound=Checked)


class ZoneKeys(FlatSection):
    """Where a zone is, and what a law has there.

    Attributes
    ----------
    called : str
        What the laws are of, as the key that chooses one.
    names : tuple of str
        Keys of parameters.
    """

    called: ClassVar[str]
    names: ClassVar[tuple[str, ...]]

    polygon: PolygonOrFile | None = key(
        "corners along and across the bed, or of eastings and northings on an elevation model, m; or there a "
        "GeoPackage, GeoJSON or Shapefile of polygons in any reference system, relative to the scenario file",
        default=None,
    )
    raster: str | None = key(
        "in place of `polygon`, on an elevation model: raster of classes, whole numbers, in any reference "
        "system, relative to the scenario file",
        default=None,
        min_length=1,
    )
    value: Annotated[int, Field(gt=0)] | None = key("class of the raster. Default: all but 0", default=None)
    layer: str | None = key("layer of the file; needed where it has several", default=None)
    name: str | None = key(
        "polygons of the file whose attribute `name` is this. Default: all of the layer", default=None
    )

    @property
    def file(self) -> str | None:
        """File of the polygons or the raster, if there is one."""
        return self.polygon if isinstance(self.polygon, str) else self.raster

    @property
    def picked(self) -> str | None:
        """Name of the polygons of the file, or class of the raster; None for all."""
        return self.name if self.value is None else str(self.value)

    @model_validator(mode="after")
    def _says_something(self) -> ZoneKeys:
        if (self.polygon is None) == (self.raster is None):
            found = "found none" if self.raster is None else "found both"
            raise relation(f"expected either polygon or raster, {found}", "polygon", "raster")
        place = "raster" if self.polygon is None else "polygon"
        given = [name for name in self.names if getattr(self, name) is not None]
        if not given:
            raise relation(f"expected one of {', '.join(self.names)}, found none", place)
        for name in ("layer", "name"):
            if not isinstance(self.polygon, str) and getattr(self, name) is not None:
                raise relation(f"expected a file of polygons with {name}, found none", place, name)
        if self.raster is None and self.value is not None:
            raise relation("expected a raster with value, found none", "polygon", "value")
        return self

    def law(self, of_all: Law) -> Law:
        """Give the law in the zone, that which holds elsewhere with other parameters.

        Raises
        ------
        PydanticCustomError
            If a parameter is none of the law's or given in two ways, or parameters do not go together.
        """
        own: dict[str, Parameter] = {}
        changed: dict[str, Any] = {}
        for name, declared in _numbers(type(of_all)):
            key_, other = declared.key or name, declared.alternative
            own |= {key_: declared} | ({} if other is None else {other.name: declared})
            value = getattr(self, key_)
            if other is not None and (second := getattr(self, other.name)) is not None:
                if value is not None:
                    raise relation(f"expected either {key_} or {other.name}, found both", other.name, key_)
                value = other.convert(second)
            if value is None:
                continue
            changed[name] = value
            before = getattr(of_all, name)
            if isinstance(before, tuple) and len(before) != len(value):
                raise relation(f"expected {len(before)} values, found {len(value)}", key_)
        for name in self.names:
            if getattr(self, name) is not None and name not in own:
                taken = ", ".join(name for name, declared in own.items() if not _is_second(name, declared))
                found = f"expected, with {self.called} {tag(type(of_all))}, {taken}; found {name}"
                raise relation(found, name)
        try:
            return replace(of_all, **changed)  # type: ignore[type-var]
        except ParameterError as error:
            raise relation(error.message, *error.names) from None


def laws_of_zones(zones: Iterable[ZoneKeys] | None, law: Law) -> tuple[Law, ...]:
    """Make the laws of zones from that of where there is none.

    Raises
    ------
    PydanticCustomError
        As `ZoneKeys.law` does, with keys below ``zones``.
    """
    made: list[Law] = []
    for i, zone in enumerate(zones or ()):
        try:
            made.append(zone.law(law))
        except PydanticCustomError as error:
            context = error.context or {}
            paths = (("zones", i, name) for name in context["keys"])
            raise relation(context["message"], *paths) from None
    return tuple(made)


def _numbers(law: type) -> Iterator[tuple[str, Parameter]]:
    """List the parameters of a law that are numbers of its own; words and density are of all of a flow."""
    hints = get_type_hints(law)
    for each, declared in parameters(law):
        if hints[each.name] is float or get_origin(hints[each.name]) is tuple:
            yield each.name, declared


def _is_second(name: str, declared: Parameter) -> bool:
    return declared.alternative is not None and declared.alternative.name == name


def _zone(name: str, meaning: str, called: str, laws: Iterable[type[Checked]]) -> Any:
    """Make the section of zones of some laws, with a key for each number that is a parameter of one."""
    keys: dict[str, Any] = {}
    for law in laws:
        numbers = [name for name, _ in _numbers(law)]
        for key_, held in keys_of(law, unset=True, only=numbers).items():
            keys.setdefault(key_, held)
    made: Any = create_model(name, __base__=ZoneKeys, __doc__=meaning, __module__=__name__, **keys)
    made.called, made.names = called, tuple(keys)
    made.alternatives = frozenset((*keys, "polygon", "raster", "value", "layer", "name"))
    return made


if TYPE_CHECKING:
    Zone: TypeAlias = ZoneKeys
    ErosionZone: TypeAlias = ZoneKeys
else:
    Zone = _zone(
        "Zone",
        "Polygons or a raster in which friction has other parameters; the law is that of the material.",
        "friction",
        friction.LAWS,
    )
    ErosionZone = _zone(
        "ErosionZone",
        "Polygons or a raster in which the bed is eroded with other parameters; the law is that of the bed.",
        "model",
        erosion.LAWS,
    )
