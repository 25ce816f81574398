"""The solver's own objects, made from settings."""

from __future__ import annotations

from typing import TYPE_CHECKING

from pipeline.settings import points as points_settings
from pipeline.settings import release as release_settings
from pipeline.settings import scheme as scheme_settings
from pipeline.settings import terrain as terrain_settings
from solver.physics import terrain
from solver.physics.earth_pressure import EarthPressure, Isotropic, MohrCoulomb
from solver.physics.friction import Coulomb, Voellmy
from solver.points.lattice import Lattice
from solver.release import shapes

if TYPE_CHECKING:
    from pipeline.scenario.elevation_table import ElevationTable
    from pipeline.scenario.point_file import PointFile
    from pipeline.settings.settings import Material, Settings

    # compiled code takes longer to import than a scenario to check
    from solver.points.cloud import PointCloud
    from solver.scene import Scheme

_SHAPES: dict[str, type[shapes.Release]] = {
    "hemisphere": shapes.Hemisphere,
    "cap": shapes.Cap,
    "paraboloid": shapes.Paraboloid,
    "box": shapes.Box,
    "cylinder": shapes.Cylinder,
}


def points(settings: Settings, file: PointFile | None = None) -> Lattice | PointCloud:
    """Make the points of a scenario; ``file`` is what the file of a ``file`` layout holds.

    Raises
    ------
    ValueError
        If points coincide, lie outside the domain or on one line, or their number cannot be met.
    """
    x, y = settings.bounds.x, settings.bounds.y
    if isinstance(settings.points, points_settings.LatticePoints):
        return Lattice(x, y, settings.points.spacing)
    from solver.points import cloud
    from solver.points.spacing import Refinement

    match settings.points:
        case points_settings.PoissonDiscPoints(spacing=None, count=count, seed=seed):
            assert count is not None
            return cloud.random_points(x, y, count, seed)
        case points_settings.PoissonDiscPoints(spacing=spacing, seed=seed):
            assert spacing is not None
            return cloud.graded_points(x, y, spacing, seed=seed)
        case points_settings.GradedPoints() as graded:
            regions = [Refinement(r.region.x, r.region.y, r.spacing) for r in graded.refine]
            return cloud.graded_points(x, y, graded.spacing, regions, graded.growth, graded.seed)
        case points_settings.FilePoints():
            if file is None:
                raise ValueError("a file layout needs its file")
            return cloud.given_points(file.points, x, y)


def scheme(settings: scheme_settings.Scheme) -> Scheme:
    """Make the scheme."""
    from solver import scene

    kind = scene.Collocation if isinstance(settings, scheme_settings.Collocation) else scene.WeightedResidual
    return kind(**settings.model_dump(exclude={"form"}))


def extent(settings: Settings) -> tuple[tuple[float, float], tuple[float, float]]:
    """Bounds along and across the bed of what the cells cover, m."""
    if isinstance(settings.points, points_settings.LatticePoints):
        return Lattice(settings.bounds.x, settings.bounds.y, settings.points.spacing).extent
    return settings.bounds.x, settings.bounds.y


def shape(settings: release_settings.AnyRelease) -> shapes.Release:
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
            from solver.physics.terrain_table import Table

            if table is None:
                raise ValueError("a table profile needs its table")
            return Table(table.distances, table.elevations, settings.smoothing, settings.curvature)


def friction(settings: Material) -> Coulomb | Voellmy:
    """Make the law of basal friction."""
    if settings.turbulent_friction is None:
        return Coulomb(settings.bed_friction)
    return Voellmy(settings.bed_friction, settings.turbulent_friction)


def earth_pressure(settings: Material) -> EarthPressure:
    """Make the law of earth pressure.

    Raises
    ------
    ValueError
        If the law is mohr-coulomb without an internal friction angle.
    """
    if settings.earth_pressure == "isotropic":
        return Isotropic()
    if settings.internal_friction is None:
        raise ValueError("mohr-coulomb needs an internal friction angle")
    return MohrCoulomb(settings.internal_friction, settings.bed_friction)
