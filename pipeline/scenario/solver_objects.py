"""The solver's own objects, made from settings."""

from __future__ import annotations

from typing import TYPE_CHECKING

from pipeline.settings import points as points_settings
from pipeline.settings.generated import Generated
from pipeline.settings.physics import MaterialLaws
from solver.physics.earth_pressure import EarthPressure
from solver.physics.friction import Coulomb
from solver.physics.terrain import SlopeProfile
from solver.physics.terrain_table import Table
from solver.points.lattice import Lattice
from solver.release.shapes import Release
from solver.scheme import Scheme

if TYPE_CHECKING:
    from pipeline.inputs.elevation_table import ElevationTable
    from pipeline.inputs.point_file import PointFile
    from pipeline.settings.settings import Settings

    # compiled code takes longer to import than a scenario to check
    from solver.points.cloud import PointCloud


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


def extent(settings: Settings) -> tuple[tuple[float, float], tuple[float, float]]:
    """Bounds along and across the bed of what the cells cover, m."""
    if isinstance(settings.points, points_settings.LatticePoints):
        return Lattice(settings.bounds.x, settings.bounds.y, settings.points.spacing).extent
    return settings.bounds.x, settings.bounds.y


def scheme(settings: Settings) -> Scheme:
    """Make the scheme."""
    made: Scheme = settings.scheme.make()
    return made


def laws(settings: Settings) -> tuple[Coulomb, EarthPressure]:
    """Make the laws of basal friction and of earth pressure."""
    material: MaterialLaws = settings.material
    return material.laws()


def releases(settings: Settings) -> list[Release]:
    """Make the releases, with their volumes and velocities."""
    return [release.make() for release in settings.releases]


def slope(terrain: Generated, table: ElevationTable | None = None) -> SlopeProfile:
    """Make the slope profile; ``table`` is what the file of a ``table`` profile holds.

    Raises
    ------
    ValueError
        If the profile is a table and none was given.
    """
    points = {}
    if terrain.source is Table:
        if table is None:
            raise ValueError("a table profile needs its table")
        points = {"distances": table.distances, "elevations": table.elevations}
    made: SlopeProfile = terrain.make(**points)
    return made
