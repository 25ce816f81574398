"""The solver's own objects, made from settings."""

from __future__ import annotations

from pipeline import release_settings, terrain_settings
from pipeline.elevation_table import ElevationTable
from pipeline.settings import Material, Settings
from solver import release, rheology, terrain
from solver.lattice import Lattice

_SHAPES: dict[str, type[release.Release]] = {
    "hemisphere": release.Hemisphere,
    "cap": release.Cap,
    "paraboloid": release.Paraboloid,
    "box": release.Box,
    "cylinder": release.Cylinder,
}


def lattice(settings: Settings) -> Lattice:
    """Make the lattice of a scenario."""
    return Lattice(settings.domain.x, settings.domain.y, settings.points.spacing)


def shape(settings: release_settings.AnyRelease) -> release.Release:
    """Make one release, with its volume and velocity."""
    return _SHAPES[settings.shape](**settings.model_dump(exclude={"shape"}))


def slope(settings: terrain_settings.Terrain, table: ElevationTable | None = None) -> terrain.SlopeProfile:
    """Make the slope profile; ``table`` is what the file of a ``table`` profile holds.

    Raises
    ------
    ValueError
        If the profile is a table and none was given.
    """
    match settings:
        case terrain_settings.Plane():
            return terrain.Plane(settings.angle)
        case terrain_settings.Bend():
            return terrain.Bend(
                settings.angle,
                settings.start,
                settings.end,
                settings.runout_angle,
                settings.transition,
                settings.curvature,
            )
        case terrain_settings.Segments():
            starts, angles = zip(*((s.start, s.angle) for s in settings.segments), strict=True)
            return terrain.Segments(starts, angles, settings.joint, settings.curvature)
        case terrain_settings.Table():
            # SciPy takes longer to import than a scenario to check
            from solver.terrain_table import Table

            if table is None:
                raise ValueError("a table profile needs its table")
            return Table(table.distances, table.elevations, settings.smoothing, settings.curvature)


def friction(settings: Material) -> rheology.Coulomb | rheology.Voellmy:
    """Make the law of basal friction."""
    if settings.turbulent_friction is None:
        return rheology.Coulomb(settings.bed_friction)
    return rheology.Voellmy(settings.bed_friction, settings.turbulent_friction)


def earth_pressure(settings: Material) -> rheology.EarthPressure:
    """Make the law of earth pressure.

    Raises
    ------
    ValueError
        If the law is mohr-coulomb without an internal friction angle.
    """
    if settings.earth_pressure == "isotropic":
        return rheology.Isotropic()
    if settings.internal_friction is None:
        raise ValueError("mohr-coulomb needs an internal friction angle")
    return rheology.MohrCoulomb(settings.internal_friction, settings.bed_friction)
