"""The depth above which a cell counts as reached or as deposit: one for all runs of a scenario."""

from __future__ import annotations

from collections.abc import Mapping
from typing import TYPE_CHECKING

from pipeline.runs.run import Run
from pipeline.runs.runs import expand
from pipeline.runs.scene_of_run import DEFAULT_THRESHOLD
from pipeline.scenario import solver_objects, structures
from solver.release.polygons import ring_area

if TYPE_CHECKING:
    from pipeline.inputs.elevation_raster import ElevationRaster
    from pipeline.scenario.scenario import Scenario
    from solver.points.cloud import PointCloud
    from solver.points.lattice import Lattice


def threshold(scenario: Scenario, points: Lattice | PointCloud) -> float:
    """Give the threshold of a scenario, m.

    That of the scenario file, or else a share of the largest depth that is released on the points or comes
    in, in the run where this is smallest: a larger event then reaches no less than a smaller one.
    """
    settings = scenario.settings
    if settings.output.threshold is not None:
        return settings.output.threshold
    runs = expand(scenario)
    varied = any(key.startswith("release") for key in settings.varied)
    rasters = {} if scenario.ground is None else scenario.ground.rasters
    if settings.inflow:
        several = runs if settings.varied else runs[:1]
        return DEFAULT_THRESHOLD * min(max(_depth(run), _comes_in(run, points, rasters)) for run in several)
    shallowest = min(runs, key=_depth) if varied else runs[0]
    ground = structures.ground(shallowest.settings, rasters, shallowest.outlines)
    laid = solver_objects.laid(shallowest.settings, points, shallowest.outlines, ground)
    return DEFAULT_THRESHOLD * float(laid.depth.max())


def _depth(run: Run) -> float:
    """Largest depth of the releases of a run, m, each by itself."""
    depths = [
        each.depth or (each.volume or 0.0) / sum(map(ring_area, each.rings))
        for each in solver_objects.outlined(run.settings, run.outlines)
    ]
    for shape in solver_objects.releases(run.settings):
        x_min, x_max, y_min, y_max = shape.extent
        scale = 1.0 if shape.volume is None else shape.volume / shape.shape_volume
        depths.append(scale * float(shape.depth((x_min + x_max) / 2, (y_min + y_max) / 2)))
    return max(depths, default=0.0)


def _comes_in(run: Run, points: Lattice | PointCloud, rasters: Mapping[str, ElevationRaster]) -> float:
    """Largest depth that flow comes in with on points, m."""
    ground = structures.ground(run.settings, rasters, run.outlines)
    terrain = solver_objects.slope(run.settings.terrain, run.table) if ground is None else ground
    return solver_objects.deepest_inflow(run.settings, points, terrain, run.hydrographs, run.outlines)
