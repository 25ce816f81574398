"""The values that a store holds of a run, from what the solver was given and what it gave.

What this module imports, beside what decides the run, is what the hash of summaries covers.
"""

from __future__ import annotations

import warnings
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from functools import lru_cache
from typing import Any

import numpy as np
from numpy.typing import NDArray

from pipeline.runs import ending, profile_ends, surface_summary
from pipeline.runs.scene_of_run import Prepared
from pipeline.runs.summary import affected_area, summarise
from pipeline.store.variables import FIELDS, SERIES, Status
from solver.checks.plausibility import doubts
from solver.physics.elevation import ElevationModel
from solver.physics.terrain import SlopeProfile
from solver.points.cloud import PointCloud
from solver.points.lattice import Lattice
from solver.points.on_surface import area_on_bed
from solver.result import OUT_OF_TIME, Failure, Result, SectionResult


def stored(
    prepared: Prepared, result: Result, told: Sequence[str], max_wall: float | None
) -> tuple[Status, dict[str, Any]]:
    """Status of a run, and its values by name of variable.

    Parameters
    ----------
    prepared : Prepared
        What the solver was given.
    result : Result
        What it gave.
    told : sequence of str
        Warnings of the numerics.
    max_wall : float, optional
        The run's own limit of elapsed time, s, which a failure names.
    """
    warned = {"warnings": len(told), "warning": "; ".join(dict.fromkeys(told))}
    return ending.status(result), _row(prepared, result, max_wall) | warned


def implausible(prepared: Prepared, result: Result) -> list[str]:
    """Say what is not plausible in a result, as warnings."""
    found = [*doubts(prepared.scene, result), *profile_ends.warning(prepared, result.max_depth)]
    if isinstance(prepared.terrain, ElevationModel):
        found += surface_summary.narrow_channels(
            prepared, profile_values(prepared)["elevation"], result.max_depth
        )
    return found


def profile_values(prepared: Prepared) -> dict[str, NDArray[np.float64]]:
    """Elevation and horizontal distance at the points of a cloud or along those of a lattice, (nx,), m.

    On an elevation model elevation, m, area on the bed, m2, and that over the area in plan, all of the shape
    of the points.
    """
    return _profile_values(prepared.terrain, prepared.scene.points)


@lru_cache(maxsize=8)
def _profile_values(
    terrain: SlopeProfile | ElevationModel, points: Lattice | PointCloud
) -> dict[str, NDArray[np.float64]]:
    if isinstance(terrain, ElevationModel):
        elevation = (
            terrain.at(points.x_points, points.y_points)
            if isinstance(points, Lattice)
            else terrain.elevation_at(*points.control_volumes.centroid.T)
        )
        area = area_on_bed(terrain, points)
        return {"elevation": elevation, "area": area, "vertical_extent": area / points.cell_area}
    x = points.x_points if isinstance(points, Lattice) else points.coordinates[0]
    return {"elevation": terrain.elevation(x), "horizontal_distance": terrain.horizontal_distance(x)}


@contextmanager
def warned() -> Iterator[list[str]]:
    """Collect what NumPy and SciPy warn of, that nobody reads on the terminals of workers."""
    told: list[str] = []
    with warnings.catch_warnings(record=True) as caught:
        warnings.simplefilter("always", RuntimeWarning)
        yield told
    told += [str(each.message) for each in caught]


def at_sections(found: SectionResult) -> dict[str, Any]:
    """Values of a run at its sections, by name of variable."""
    peak, time = found.peak
    return {
        "section_volume": found.volume,
        "section_discharge": found.discharge,
        "section_peak_discharge": peak,
        "section_peak_time": np.where(peak > 0, time, np.nan),
        "section_arrival_time": found.arrival,
    }


def _told(failure: Failure, max_wall: float | None) -> str:
    """Reason, time and place of a failure in words."""
    reason = failure.reason + (f" ({max_wall:g} s)" if failure.reason == OUT_OF_TIME else "")
    place = "" if np.isnan(failure.x) else f", x = {failure.x:.6g} m, y = {failure.y:.6g} m"
    return f"{reason} at t = {failure.time:.6g} s{place}"


def _row(prepared: Prepared, result: Result, max_wall: float | None) -> dict[str, Any]:
    """Values of a run by name of variable; a failed one has no summaries."""
    profile = profile_values(prepared)
    # a group holds the rows of all its runs until they are written
    row: dict[str, Any] = {
        v.name: np.asarray(held, v.dtype)
        for v in (*FIELDS, *SERIES)
        if (held := getattr(result, v.name)) is not None
    }
    row |= profile
    row |= {
        "volume_asked": prepared.volume_asked,
        "volume_released": result.ledger.released,
        "volume_lost": prepared.volume_lost,
        "volume_in": result.ledger.inflow,
        "volume_entrained": result.ledger.entrained,
        "volume_out": result.ledger.outflow,
        **ending.volumes(result),
        "volume_error": result.ledger.error,
        "steps": result.steps,
        "last_time": result.time,
        "rest_time": result.rest_time,
        "wall_time": result.wall_time,
        "cpu_time": result.cpu_time,
    }
    if result.sections is not None:
        row |= at_sections(result.sections)
    if result.failure is not None:
        return row | {
            "failure_reason": _told(result.failure, max_wall),
            "failure_time": result.failure.time,
            "failure_x": result.failure.x,
            "failure_y": result.failure.y,
        }
    if result.erosion_depth is not None:
        row["erosion_max_depth"] = float(result.erosion_depth.max())
    points, reached = prepared.scene.points, result.max_depth > prepared.threshold
    if isinstance(prepared.terrain, ElevationModel):
        row["affected_area"] = affected_area(points, reached)
        row["lifted_share"] = surface_summary.lifted_share(
            prepared.terrain, points, reached, result.max_speed, prepared.scene.gravity
        )
        return row | surface_summary.summarise_on_surface(
            points,
            profile["elevation"],
            profile["area"],
            prepared.origin,
            result.deposit_depth,
            result.max_depth,
            result.max_speed,
            prepared.threshold,
        )
    along = points.x_points if isinstance(points, Lattice) else points.coordinates[0]
    row["affected_area"] = affected_area(points, reached, prepared.terrain.inclination(along))
    return row | summarise(
        points,
        profile["elevation"],
        profile["horizontal_distance"],
        prepared.origin,
        result.deposit_depth,
        result.max_depth,
        result.max_speed,
        prepared.threshold,
    )
