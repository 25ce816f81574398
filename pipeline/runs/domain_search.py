"""The domain of a scenario that gives none: as far as the flow of any run comes on wider spacing."""

from __future__ import annotations

import logging
from collections.abc import Callable, Hashable, Iterator, Sequence
from concurrent.futures import ThreadPoolExecutor
from contextlib import contextmanager
from dataclasses import dataclass, replace
from functools import lru_cache, partial
from math import ceil, floor

import numpy as np
from numpy.typing import NDArray

from pipeline.inputs.elevation_raster import ElevationRasterError
from pipeline.inputs.ground import Ground, clipped, fitted
from pipeline.mistakes import BadInput
from pipeline.runs import ending
from pipeline.runs.domain_doubts import doubts, of_ground, shared_cells
from pipeline.runs.run import Run
from pipeline.runs.runs import expand
from pipeline.runs.scene_of_run import build_scene
from pipeline.runs.shared_points import SharedPoints
from pipeline.runs.size import size
from pipeline.scenario import solver_objects
from pipeline.scenario.places import corners_to_hold
from pipeline.scenario.scenario import UNSETTLED, Scenario
from pipeline.scenario.strict_yaml import parse
from pipeline.settings.physics import DEFAULT_SCHEME
from pipeline.settings.section import Pair
from pipeline.settings.settings import Domain
from pipeline.store import zarr_store
from pipeline.store.storage import Location
from pipeline.store.variables import Status
from solver.points.lattice import Lattice
from solver.release.polygons import ring_area
from solver.simulation import simulate

Array = NDArray[np.float64]
_log = logging.getLogger(__name__)

# wider spacing of the runs that find the domain, and cells across the smallest release at least
WIDER = 4
LEAST_CELLS = 8
# rows along a side that stay dry where the flow ends within the domain
CLEAR = 3
GROWTH = 0.5
# beyond the farthest that the wide runs came, as a share of the extent
MARGIN = 0.1
MOST_POINTS = 2_000_000


@dataclass
class _Box:
    """Bounds along and across the bed, m, that grow."""

    x: Pair
    y: Pair

    def holding(self, x: Pair, y: Pair) -> _Box:
        """Give the box that holds another too."""
        return _Box(
            (min(self.x[0], x[0]), max(self.x[1], x[1])), (min(self.y[0], y[0]), max(self.y[1], y[1]))
        )


def settled(
    scenario: Scenario, path: Location | None, tell: Callable[[str], None], threads: int = 1
) -> Scenario:
    """Give a scenario with a domain: its own, that of its store, or one found from the flow.

    Every run is done on a lattice of wider spacing without sides, which is made larger until the flow of none
    reaches its edge; the domain holds the largest extent of all, with a margin. On an elevation model it ends
    where that does. The domain does not depend on the number of threads.

    Parameters
    ----------
    scenario : Scenario
        As it was read.
    path : Location, optional
        Its store, where that may be there and holds what is asked for.
    tell : callable
        Told the domain that was found.
    threads : int
        Runs that are done at once.

    Raises
    ------
    BadInput
        If the flow does not end within as many points as a scenario may have.
    """
    (found,) = settled_together([(scenario, path)], tell, threads)
    return found


def settled_together(
    scenarios: Sequence[tuple[Scenario, Location | None]], tell: Callable[[str], None], threads: int = 1
) -> list[Scenario]:
    """Give scenarios with domains, each as `settled` does.

    Those on one elevation model with the same spacing get one domain that holds the flow of all, so that
    their results lie on the same cells.

    Parameters
    ----------
    scenarios : sequence of (Scenario, Location or None)
        Each with its store, where that may be there.
    tell : callable
        Told the domains that were found.
    threads : int
        Runs that are done at once.

    Raises
    ------
    BadInput
        If a flow does not end within as many points as a scenario may have.
    """
    known = [scenario if path is None else on_known_domain(scenario, path) for scenario, path in scenarios]
    searched = {
        number: _found(scenario, tell, threads)
        for number, scenario in enumerate(known)
        if scenario.settings.domain is None
    }
    boxes = {number: box for number, (box, _) in searched.items()}
    whole: dict[Hashable, _Box] = {}
    for number, scenario in enumerate(known):
        domain, key = scenario.settings.domain, _shares_cells(scenario)
        box = boxes[number] if domain is None else _Box(domain.x, domain.y)
        if key is not None:
            whole[key] = box if key not in whole else whole[key].holding(box.x, box.y)
    settled_ones = []
    for number, scenario in enumerate(known):
        if number in boxes:
            box = whole.get(_shares_cells(scenario), boxes[number])
            scenario = _within(scenario, Domain(x=box.x, y=box.y), searched[number][1], tell)
            found = Domain(x=boxes[number].x, y=boxes[number].y)
            for line in (*shared_cells(scenario, found), *of_ground(scenario)):
                tell(f"{scenario.name}: {line}")
        settled_ones.append(scenario)
    return settled_ones


def _within(scenario: Scenario, domain: Domain, unsettled: int, tell: Callable[[str], None]) -> Scenario:
    """Give a scenario with a domain that holds what was found of it and of others.

    unsettled : how many of the runs that found it were cut off, overrun or failed.

    Raises
    ------
    BadInput
        If it takes more points than a scenario may have, or a raster of the scenario has nothing there.
    """
    if scenario.ground is not None:
        fit = fitted(domain, scenario.ground.extent, float(getattr(scenario.settings.points, "spacing")))  # noqa: B009
        domain = fit if isinstance(fit, Domain) else domain
    points, ((x0, x1), (y0, y1)) = scenario.settings.points, (domain.x, domain.y)
    if (count := points.estimate(x1 - x0, y1 - y0)) > points.most:
        found = f"found {count:.3g} on the domain of the flow, x {list(domain.x)}, y {list(domain.y)} m"
        message = f"expected at most {points.most:,} points, {found}; give a domain or a larger spacing"
        document = parse(scenario.text, str(scenario.path))
        at = "count" if getattr(points, "count", None) else "spacing"
        raise BadInput([document.mistake(("points", at), message)])
    large = size(replace(scenario, settings=scenario.settings.model_copy(update={"domain": domain})))
    if large is not None and large.too_large:
        tell(f"{scenario.name}: {large}; give a larger spacing or a smaller domain")
    with _told_of(scenario):
        return scenario.within(domain, unsettled)


@contextmanager
def _told_of(scenario: Scenario) -> Iterator[None]:
    """Tell what is wrong with a raster as a mistake of the scenario that names it."""
    try:
        yield
    except ElevationRasterError as error:
        document = parse(scenario.text, str(scenario.path))
        raise BadInput([document.mistake(("terrain", "elevation"), str(error))]) from None


@lru_cache(maxsize=8)
def _read(ground: Ground, x: Pair, y: Pair, reach: float) -> Ground:
    """Read the rasters around a box, once for the runs that fit in it."""
    return ground.within(Domain(x=x, y=y), reach)


def on_known_domain(scenario: Scenario, path: Location) -> Scenario:
    """Give a scenario without a domain the one that was found when its store was made, if it was.

    What it has become otherwise since is left to be told.
    """
    if scenario.settings.domain is not None:
        return scenario
    known = zarr_store.attributes(path)
    if "domain" not in known:
        return scenario
    try:
        unsettled = int(known.get(UNSETTLED, 0))
        return scenario.within(Domain.model_validate_json(str(known["domain"])), unsettled)
    except ElevationRasterError:
        return scenario


def _shares_cells(scenario: Scenario) -> Hashable | None:
    """Give what scenarios that lie on the same cells have in common; None on a profile."""
    ground = scenario.ground
    if ground is None:
        return None
    return ground.extent, getattr(scenario.settings.points, "spacing", None)


def _found(scenario: Scenario, tell: Callable[[str], None], threads: int) -> tuple[_Box, int]:
    """Find the domain of a scenario from its flow, and how many runs were cut off, overrun or failed."""
    runs = expand(scenario)
    releases = [_extent(run) for run in (runs if _released_anew(scenario) else runs[:1])]
    box = _Box(*releases[0])
    for x, y in releases:
        box = box.holding(x, y)
    least = min(map(_width, runs if _released_anew(scenario) else runs[:1]))
    spacing = float(getattr(scenario.settings.points, "spacing"))  # noqa: B009
    wide = max(spacing, min(WIDER * spacing, least / LEAST_CELLS))
    around, flow = _clipped(_grown(box, wide, np.ones(4, bool)), scenario), box
    count = f"{len(runs):,} run{'s' * (len(runs) > 1)}"
    tell(f"{scenario.name}: looking for the domain by {count} on {wide:g} m")
    with ThreadPoolExecutor(threads, "domain") as pool:
        done = unsettled = 0
        while done < len(runs):
            # rounds of 1, 1, 2, 4, ... runs: all of a round begin with what held the flow of those before
            some = runs[done : max(1, 2 * done)]
            _around(scenario, around, wide)
            began = around
            for box, x, y, status in pool.map(partial(_flow, scenario, around=began, wide=wide), some):
                done += 1
                unsettled += status is not Status.DONE
                _log.info("%s: domain, run %d of %d", scenario.name, done, len(runs))
                around, flow = around.holding(box.x, box.y), flow.holding(x, y)
    domain = _rounded(scenario, flow, spacing, wide)
    tell(f"{scenario.name}: domain x {list(domain.x)}, y {list(domain.y)} m, found by {count} on {wide:g} m")
    for line in doubts(scenario, runs, flow.x, domain, unsettled):
        tell(f"{scenario.name}: {line}")
    return _Box(domain.x, domain.y), unsettled


def _clipped(box: _Box, scenario: Scenario) -> _Box:
    """Give the part of a box that an elevation model covers."""
    if scenario.ground is None:
        return box
    domain = clipped(Domain(x=box.x, y=box.y), scenario.ground.extent)
    return _Box(domain.x, domain.y)


def _released_anew(scenario: Scenario) -> bool:
    return any(key.startswith(("release", "inflow")) for key in scenario.settings.varied)


def _extent(run: Run) -> tuple[Pair, Pair]:
    """Bounds of what a domain has to hold of a run, its releases above all."""
    if run.settings.on_surface:
        low, high = (
            way(corners_to_hold(run.settings, run.outlines or {}), axis=0) for way in (np.min, np.max)
        )
        return (float(low[0]), float(high[0])), (float(low[1]), float(high[1]))
    x0, x1, y0, y1 = np.array([r.extent for r in solver_objects.releases(run.settings)]).T
    return (float(x0.min()), float(x1.max())), (float(y0.min()), float(y1.max()))


def _width(run: Run) -> float:
    """Width that the wider spacing must show of the releases and inflows of a run, m."""
    if not run.settings.on_surface:
        x0, x1, y0, y1 = np.array([r.extent for r in solver_objects.releases(run.settings)]).T
        return float(min(x1.max() - x0.min(), y1.max() - y0.min()))
    widths = [
        float(np.sqrt(abs(ring_area(ring))))
        for each in solver_objects.outlined(run.settings, run.outlines)
        for ring in each.rings
    ]
    return min(widths + [float(np.ptp(np.array(each.section), axis=0).max()) for each in run.settings.inflow])


def _grown(box: _Box, spacing: float, sides: NDArray[np.bool_]) -> _Box:
    """Move sides (x_min, x_max, y_min, y_max) outward by a share of the larger extent."""
    step = GROWTH * max(box.x[1] - box.x[0], box.y[1] - box.y[0], 2 * CLEAR * spacing)
    left, right, low, high = (step * bool(side) for side in sides)
    return _Box((box.x[0] - left, box.x[1] + right), (box.y[0] - low, box.y[1] + high))


def _flow(scenario: Scenario, run: Run, around: _Box, wide: float) -> tuple[_Box, Pair, Pair, Status]:
    """Do a run on a lattice that is made larger until it holds the flow.

    Its bounds, those of the flow, and what became of the run.
    """
    settings, ground = run.settings.model_copy(update={"scheme": DEFAULT_SCHEME}), scenario.ground
    if ground is not None:
        points = settings.points.model_copy(update={"spacing": wide})
        settings = settings.model_copy(update={"points": points})
    while True:
        x, y = (_whole_cells(side, wide, ground) for side in (around.x, around.y))
        lattice = Lattice(x, y, wide)
        if len(lattice.x_points) * len(lattice.y_points) > MOST_POINTS:
            document = parse(scenario.text, str(scenario.path))
            low, high = around.x
            found = (
                f"expected a domain, as the flow of run {run.index} goes on beyond x [{low:g}, {high:g}] m"
            )
            raise BadInput([document.mistake(("domain",), found)])
        here = settings.model_copy(update={"domain": Domain(x=around.x, y=around.y)})
        shared = SharedPoints(lattice, {}, frozenset())
        if (read := _around(scenario, around, wide)) is not None:
            shared = replace(shared, rasters=read.rasters, depths=read.depths)
        prepared = build_scene(replace(run, settings=here), shared)
        ends = prepared.times[[0, -1]]
        result = simulate(prepared.scene, ends, arrival_depth=prepared.threshold, frames=())
        wet = result.max_depth > 0
        sides = (wet[:, :CLEAR], wet[:, -CLEAR:], wet[:CLEAR], wet[-CLEAR:])
        reached = np.array([side.any() for side in sides])
        larger = _clipped(_grown(around, wide, reached), scenario)
        # where the elevation model ends it cannot grow
        if not reached.any() or larger == around:
            break
        around = larger
    along, across = lattice.x_points[wet.any(0)], lattice.y_points[wet.any(1)]
    bounds = (float(along[0]), float(along[-1])), (float(across[0]), float(across[-1]))
    return around, *bounds, ending.status(result)


def _around(scenario: Scenario, box: _Box, wide: float) -> Ground | None:
    """Give the rasters around a box, which its runs share; None on a profile."""
    if scenario.ground is None:
        return None
    with _told_of(scenario):
        return _read(scenario.ground, box.x, box.y, 2 * wide)


def _whole_cells(side: Pair, wide: float, ground: Ground | None) -> Pair:
    """Give bounds that a number of cells fits in, as cells on an elevation model are square."""
    low, high = side
    return side if ground is None else (low, low + wide * floor((high - low) / wide))


def _rounded(scenario: Scenario, flow: _Box, spacing: float, wide: float) -> Domain:
    """Move the bounds of a flow outward by the margin and on to multiples of the spacing, or on to cells."""
    found = _Box(*(_with_margin(bounds, wide) for bounds in (flow.x, flow.y)))
    if scenario.ground is not None:
        extent = scenario.ground.extent
        x, y = (
            _on_multiples((low - first, high - first), spacing, first)
            for (low, high), (first, _) in zip((found.x, found.y), (extent.x, extent.y), strict=True)
        )
        domain = fitted(clipped(Domain(x=x, y=y), extent), extent, spacing)
        assert isinstance(domain, Domain)
        return domain
    return Domain(x=_on_multiples(found.x, spacing), y=_on_multiples(found.y, spacing))


def _with_margin(bounds: Pair, wide: float) -> Pair:
    margin = max(MARGIN * (bounds[1] - bounds[0]), CLEAR * wide)
    return bounds[0] - margin, bounds[1] + margin


def _on_multiples(bounds: Pair, spacing: float, origin: float = 0.0) -> Pair:
    low, high = floor(bounds[0] / spacing), ceil(bounds[1] / spacing)
    # as one would write them
    return float(f"{origin + low * spacing:.12g}"), float(f"{origin + high * spacing:.12g}")
