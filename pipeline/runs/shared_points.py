"""Points of a scenario with what its runs need of them: made once by the driver, read by the workers."""

from __future__ import annotations

import pickle
from collections.abc import Hashable, Iterable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass, replace
from functools import lru_cache
from pathlib import Path
from typing import TYPE_CHECKING

from pipeline.mistakes import BadInput
from pipeline.scenario import solver_objects
from pipeline.scenario.strict_yaml import parse
from solver.points.lattice import Lattice

if TYPE_CHECKING:
    from pipeline.runs.runs import Run
    from pipeline.scenario.point_file import PointFile
    from pipeline.scenario.scenario import Scenario
    from pipeline.settings.settings import Settings
    from solver.forms import Kind, Operators
    from solver.points.cloud import PointCloud


@dataclass(frozen=True)
class SharedPoints:
    """Points of all runs of a scenario.

    points : a lattice or a cloud. operators : what runs of a scheme need of them, by `solver.forms.key`.
    kinds : of the runs. threshold : depth above which a cell counts as reached, m; None where each run has
    one by its own release.
    """

    points: Lattice | PointCloud
    operators: dict[Hashable, Operators | None]
    kinds: frozenset[Kind]
    threshold: float | None = None


def share(scenario: Scenario, runs: Iterable[Run]) -> SharedPoints:
    """Make the points of a scenario, the operators of its runs and their threshold.

    Raises
    ------
    BadInput
        If points or supports are not fit; the message names the points.
    """
    # which makes scenes on shared points
    from pipeline.runs.threshold import threshold

    try:
        shared = made(scenario.settings, scenario.points, runs)
    except ValueError as error:
        document = parse(scenario.text, str(scenario.path))
        found = f"expected points that fit, found {error}"
        raise BadInput([document.mistake(("points",), found)]) from None
    return replace(shared, threshold=threshold(scenario, shared.points))


def made(settings: Settings, file: PointFile | None, runs: Iterable[Run]) -> SharedPoints:
    """Make points by settings and what their file holds, and the operators of runs.

    Raises
    ------
    ValueError
        If points or supports are not fit.
    """
    from solver.forms import key, kind_of, prepare

    kinds: set[Kind] = set()
    operators: dict[Hashable, Operators | None] = {}
    points = solver_objects.points(settings, file)
    for run in runs:
        scheme = solver_objects.scheme(run.settings.scheme)
        kinds.add(kind_of(points, scheme))
        needed = key(points, scheme)
        if needed is not None and needed not in operators:
            operators[needed] = prepare(points, scheme)
    return SharedPoints(points, operators, frozenset(kinds))


@contextmanager
def kept(shared: SharedPoints, path: Path) -> Iterator[SharedPoints | Path]:
    """Give what a job carries of points: a lattice as it is, what is large as a file while this lasts.

    A driver that is killed leaves the file, which is named so as to be swept.
    """
    if isinstance(shared.points, Lattice) and not shared.operators:
        yield shared
        return
    with path.open("wb") as file:
        pickle.dump(shared, file, pickle.HIGHEST_PROTOCOL)
    try:
        yield path
    finally:
        path.unlink(missing_ok=True)


def load(carried: SharedPoints | Path) -> SharedPoints:
    """Give the points that a job carries; a file is read once a process."""
    return carried if isinstance(carried, SharedPoints) else _read(carried)


@lru_cache(maxsize=2)
def _read(path: Path) -> SharedPoints:
    with path.open("rb") as file:
        loaded = pickle.load(file)
    assert isinstance(loaded, SharedPoints)
    return loaded
