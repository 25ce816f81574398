"""Settings of zones: parts of the domain where friction has other parameters."""

from __future__ import annotations

from dataclasses import replace
from typing import TYPE_CHECKING, Annotated, Any, TypeAlias

from pydantic import Discriminator, Field, Tag, create_model, model_validator

from pipeline.settings.generated import FlatSection, keys_of, tag
from pipeline.settings.section import Pair, key, relation
from solver.parameters import ParameterError, parameters
from solver.physics import friction


def _file_or_corners(value: Any) -> str:
    return "file" if isinstance(value, str) else "corners"


PolygonOrFile = Annotated[
    Annotated[str, Field(min_length=1), Tag("file")]
    | Annotated[tuple[Pair, ...], Field(min_length=3), Tag("corners")],
    Discriminator(_file_or_corners),
]
# parameters that differ between cells; of what resistance is linear in, cells on an edge have the mean
_KEPT = (
    *("bed_friction", "friction_coefficient", "turbulent_friction", "manning_n", "chezy_coefficient"),
    *("yield_stress", "viscosity", "consistency", "angles"),
)
# the angles of hysteresis are three
_LAWS = [law for law in friction.LAWS if law is not friction.Edwards]
_KEYS = {name: held for law in _LAWS for name, held in keys_of(law, optional=True).items() if name in _KEPT}


class ZoneOfFriction(FlatSection):
    """Polygons or a raster in which friction has other parameters; the law is that of the material."""

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
    def _says_something(self) -> ZoneOfFriction:
        if (self.polygon is None) == (self.raster is None):
            found = "found none" if self.raster is None else "found both"
            raise relation(f"expected either polygon or raster, {found}", "polygon", "raster")
        place = "raster" if self.polygon is None else "polygon"
        given = [name for name in _KEYS if getattr(self, name) is not None]
        if not given:
            raise relation(f"expected one of {', '.join(_KEYS)}, found none", place)
        if {"bed_friction", "friction_coefficient"} <= {*given}:
            message = "expected either bed_friction or friction_coefficient, found both"
            raise relation(message, "friction_coefficient", "bed_friction")
        for name in ("layer", "name"):
            if not isinstance(self.polygon, str) and getattr(self, name) is not None:
                raise relation(f"expected a file of polygons with {name}, found none", place, name)
        if self.raster is None and self.value is not None:
            raise relation("expected a raster with value, found none", "polygon", "value")
        return self

    def law(self, of_material: friction.Friction) -> friction.Friction:
        """Give the law of friction in the zone, that of the material with other parameters.

        Raises
        ------
        PydanticCustomError
            If a parameter is none of the law's, or parameters do not go together.
        """
        of_law = type(of_material)
        own = {each.name for each, _ in parameters(of_law)} if of_law in _LAWS else set()
        changed: dict[str, Any] = {}
        for name in _KEYS:
            value = getattr(self, name)
            if value is None:
                continue
            at, value = (
                ("bed_friction", friction.friction_angle(value))
                if name == "friction_coefficient"
                else (name, value)
            )
            if at not in own:
                taken = ", ".join(k for k in _KEYS if k in own)
                wanted = taken or "no zones, as none of its parameters may differ"
                found = f"expected, with friction {tag(of_law)}, {wanted}; found {name}"
                raise relation(found, name)
            changed[at] = value
        try:
            return replace(of_material, **changed)
        except ParameterError as error:
            raise relation(error.message, *error.names) from None


if TYPE_CHECKING:
    Zone: TypeAlias = ZoneOfFriction
else:
    Zone = create_model(
        "Zone",
        __base__=ZoneOfFriction,
        __doc__=ZoneOfFriction.__doc__,
        __module__=__name__,
        **_KEYS,
    )
    Zone.alternatives = frozenset((*_KEYS, "polygon", "raster", "value", "layer", "name"))
