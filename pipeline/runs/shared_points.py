"""Points of a scenario with what its runs need of them: made once by the driver, read by the workers."""

from __future__ import annotations

import pickle
from collections.abc import Hashable, Iterator, Mapping, Sequence
from contextlib import contextmanager
from dataclasses import dataclass, field
from functools import lru_cache
from typing import TYPE_CHECKING

from pipeline.scenario import solver_objects, structures
from solver.points.lattice import Lattice

if TYPE_CHECKING:
    from pipeline.inputs.elevation_raster import ElevationRaster
    from pipeline.inputs.point_file import PointFile
    from pipeline.runs.run import Run
    from pipeline.settings.settings import Settings
    from pipeline.store.storage import Location
    from solver.forms import Kind, Operators
    from solver.points.cloud import PointCloud


@dataclass(frozen=True)
class SharedPoints:
    """Points of all runs of a scenario.

    Parameters
    ----------
    points : Lattice or PointCloud
        A lattice or a cloud.
    operators : dict[Hashable, Operators], optional
        What runs of a scheme need of them, by `solver.forms.key`.
    kinds : frozenset[Kind]
        Of the runs.
    threshold : float, optional
        Depth above which a cell counts as reached, m; None where each run has one by its own release.
    rasters : mapping of str to ElevationRaster
        Elevation models that they stand on, by file; none on a profile.
    depths : mapping of str to ElevationRaster
        Rasters of erodible depth on them, by file.
    """

    points: Lattice | PointCloud
    operators: dict[Hashable, Operators | None]
    kinds: frozenset[Kind]
    threshold: float | None = None
    rasters: Mapping[str, ElevationRaster] = field(default_factory=dict)
    depths: Mapping[str, ElevationRaster] = field(default_factory=dict)


def made(
    settings: Settings,
    file: PointFile | None,
    runs: Sequence[Run],
    rasters: Mapping[str, ElevationRaster] | None = None,
) -> SharedPoints:
    """Make points by settings and what their file holds, and the operators of runs.

    Raises
    ------
    ValueError
        If points or supports are not fit.
    """
    from solver.forms import key, kind_of, prepare

    kinds: set[Kind] = set()
    operators: dict[Hashable, Operators | None] = {}
    outlines = runs[0].outlines
    points = structures.points(settings, file, outlines)
    # which stand at one place in all runs
    buildings = structures.buildings(settings, points, outlines)
    for run in runs:
        scheme = solver_objects.scheme(run.settings)
        kinds.add(kind_of(points, scheme, on_surface=bool(rasters), built=buildings is not None))
        needed = key(points, scheme)
        if needed is not None and needed not in operators:
            operators[needed] = prepare(points, scheme, buildings)
    return SharedPoints(points, operators, frozenset(kinds), rasters=dict(rasters or {}))


@contextmanager
def kept(shared: SharedPoints, path: Location) -> Iterator[SharedPoints | Location]:
    """Give what a job carries of points: a lattice as it is, what is large as a file while this lasts.

    A driver that is killed leaves the file, which is named so as to be swept.
    """
    if isinstance(shared.points, Lattice) and not shared.operators and not shared.rasters:
        yield shared
        return
    with path.open("wb") as file:
        pickle.dump(shared, file, pickle.HIGHEST_PROTOCOL)
    try:
        yield path
    finally:
        path.unlink(missing_ok=True)


def load(carried: SharedPoints | Location) -> SharedPoints:
    """Give the points that a job carries; a file is read once a process."""
    return carried if isinstance(carried, SharedPoints) else _read(carried)


@lru_cache(maxsize=2)
def _read(path: Location) -> SharedPoints:
    with path.open("rb") as file:
        loaded = pickle.load(file)
    assert isinstance(loaded, SharedPoints)
    return loaded
