"""Sections for terrain, release, material and scheme, made from the solver's own dataclasses.

A class that is named in the solver's list of its kind (`terrain.PROFILES`, `shapes.SHAPES`, `friction.LAWS`,
`earth_pressure.LAWS`, `scheme.SCHEMES`) can be chosen in a scenario file.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Any, Literal, TypeAlias

from pydantic import create_model, model_validator

from pipeline.settings.generated import (
    FlatSection,
    Generated,
    alternatives_of,
    keys_of,
    made,
    phrase,
    section_of,
    section_with,
    summary,
    tag,
    union_of,
)
from pipeline.settings.section import key, kind, relation
from pipeline.settings.surface import ElevationTerrain, PolygonsRelease
from pipeline.settings.zones import Zone, laws_of_zones
from solver import scheme
from solver.parameters import parameters
from solver.physics import earth_pressure, erosion, friction, terrain, terrain_table
from solver.release import shapes

_PRESSURES = {tag(law): law for law in earth_pressure.LAWS}

_TABLE = section_with(
    terrain_table.Table,
    "profile",
    {
        "file": (
            str,
            key(
                "CSV with one header line and columns of distance and elevation, in m unless the heading "
                "says another unit: `distance (km)`, `elevation (ft)`; relative to the scenario file",
                min_length=1,
            ),
        )
    },
)
_PROFILES = [*(section_of(each, "profile") for each in terrain.PROFILES), _TABLE]
_SHAPES = [section_of(each, "shape") for each in shapes.SHAPES]
# what laws of friction and of erosion have in common with others of the flow
OF_MATERIAL = ("density",)
_FRICTION = [section_of(each, "law", without=OF_MATERIAL) for each in friction.LAWS]
_EROSION = [section_of(each, "model", without=OF_MATERIAL) for each in erosion.LAWS]
_SECTIONS = [section_of(terrain.Segment)]
_SCHEMES = [section_of(each, "form", default=i == 0) for i, each in enumerate(scheme.SCHEMES)]


class MaterialLaws(FlatSection):
    """Friction and earth pressure."""

    def laws(self) -> tuple[friction.Friction, earth_pressure.EarthPressure]:
        """Make the laws of basal friction and of earth pressure.

        Raises
        ------
        PydanticCustomError
            If a parameter of one is missing, or parameters do not go together.
        """
        named = getattr(self, "friction", None)
        resistance: friction.Friction = self._shorthand() if named is None else self._named(named)
        law = _PRESSURES[getattr(self, "earth_pressure")]  # noqa: B009
        given = {}
        if any(each.name == "bed_friction" for each, _ in parameters(law)):
            if not isinstance(resistance, friction.Coulomb):
                found = f"expected isotropic with friction {tag(type(resistance))}, found {tag(law)}"
                raise relation(found, "earth_pressure", "friction")
            if named is not None:
                given = {"bed_friction": (resistance.bed_friction, "friction")}
        return resistance, made(law, self, given, why="earth_pressure")

    def zone_laws(self) -> tuple[friction.Friction, ...]:
        """Make the laws of friction of the zones.

        Raises
        ------
        PydanticCustomError
            If a zone has a parameter that is none of the law's, or lacks a density.
        """
        law, _ = self.laws()
        found = laws_of_zones(getattr(self, "zones"), law)  # noqa: B009
        for i, each in enumerate(found):
            if each.needs_density and getattr(self, "density") is None:  # noqa: B009
                told = f"expected a density with {tag(type(law))} friction of a zone, found nothing"
                raise relation(told, "density", ("zones", i))
        return found

    def _named(self, named: Generated) -> friction.Friction:
        """Make the law of friction of a section of its own, with what the material holds of it."""
        here = [each.name for each, _ in parameters(named.source) if each.name in OF_MATERIAL]
        law: friction.Friction = named.make(**{name: getattr(self, name) for name in here})
        if law.needs_density and getattr(self, "density") is None:  # noqa: B009
            found = f"expected a density with friction {tag(type(law))}, found nothing"
            raise relation(found, "density", "friction")
        return law

    def _shorthand(self) -> friction.Coulomb:
        """Make the law of friction whose own keys are given beside those of earth pressure."""
        dragged = getattr(self, "turbulent_friction") is not None  # noqa: B009
        return made(friction.Voellmy if dragged else friction.Coulomb, self)

    @model_validator(mode="after")
    def _well_posed(self) -> MaterialLaws:
        beside = [name for name in _SHORTHAND if getattr(self, name) is not None]
        if getattr(self, "friction", None) is not None and beside:
            raise relation(f"expected either friction or {beside[0]}, found both", beside[0], "friction")
        _, pressure = self.laws()
        if self.zone_laws() and not isinstance(pressure, earth_pressure.Isotropic):
            found = f"expected isotropic with zones, found {tag(type(pressure))}"
            raise relation(found, "earth_pressure", "zones")
        return self


_SHORTHAND = {
    name: held
    for name, held in keys_of(friction.Voellmy, optional=True).items()
    if name in keys_of(friction.Coulomb) or name == "turbulent_friction"
}


def _material() -> type[MaterialLaws]:
    """Make the section: one key for each parameter of a law, and those that choose a law."""
    choices = {tag(law): f"{phrase(summary(law))}; for {law.advice}" for law in earth_pressure.LAWS}
    keys: dict[str, Any] = {
        **keys_of(friction.Coulomb, optional=True),
        **{name: held for law in earth_pressure.LAWS for name, held in keys_of(law, optional=True).items()},
        "earth_pressure": (
            Literal[tuple(_PRESSURES)],
            key("law of earth pressure", default=next(iter(_PRESSURES)), choices=choices),
        ),
        **_SHORTHAND,
        **{name: keys_of(friction.Bingham)[name] for name in OF_MATERIAL},
        "friction": (
            union_of("law", _FRICTION) | None,
            key(
                "law of basal friction by name; in place of `bed_friction` and `turbulent_friction`, which "
                "are short for it",
                default=None,
            ),
        ),
        "zones": (
            tuple[Zone, ...] | None,
            key(
                "parts of the domain where friction has other parameters; where they overlap the later one "
                "counts, and a cell on an edge has the mean over its area of mu, 1/turbulent_friction, n^2, "
                "1/C^2 and every other number; where flow_index or kappa differs it has the parameters that "
                "hold in most of it",
                default=None,
            ),
        ),
    }
    model = create_model(
        "Material", __base__=MaterialLaws, __doc__=MaterialLaws.__doc__, __module__=__name__, **keys
    )
    model.alternatives = alternatives_of(friction.Coulomb) | {"friction", "zones", *OF_MATERIAL}
    return model


if TYPE_CHECKING:
    AnyTerrain: TypeAlias = Generated | ElevationTerrain
    AnyRelease: TypeAlias = Generated | PolygonsRelease
    AnyScheme: TypeAlias = Generated
    AnyErosionLaw: TypeAlias = Generated
    Material: TypeAlias = MaterialLaws
else:
    AnyTerrain = union_of("profile", [*_PROFILES, ElevationTerrain], implied={"elevation": "elevation"})
    AnyRelease = union_of("shape", [*_SHAPES, PolygonsRelease], implied={"polygons": "polygons"})
    AnyErosionLaw = union_of("model", _EROSION)
    AnyScheme = union_of("form", _SCHEMES, default=kind(_SCHEMES[0]))
    Material = _material()
    # pickle finds sections by their names
    globals().update(
        {each.__name__: each for each in (*_SECTIONS, *_PROFILES, *_SHAPES, *_FRICTION, *_EROSION, *_SCHEMES)}
    )

DEFAULT_SCHEME = _SCHEMES[0]()
