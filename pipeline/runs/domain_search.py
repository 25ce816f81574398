"""The domain of a scenario that gives none: as far as the flow of any run comes on wider spacing."""

from __future__ import annotations

import logging
from collections.abc import Callable, Iterator
from dataclasses import dataclass, replace
from math import ceil, floor

import numpy as np
from numpy.typing import NDArray

from pipeline.mistakes import BadInput
from pipeline.runs.profile_ends import beyond
from pipeline.runs.run import Run
from pipeline.runs.runs import Runs, expand
from pipeline.runs.scene_of_run import build_scene
from pipeline.runs.shared_points import SharedPoints
from pipeline.scenario import solver_objects
from pipeline.scenario.places import part_inside
from pipeline.scenario.scenario import Scenario
from pipeline.scenario.strict_yaml import parse
from pipeline.settings.physics import DEFAULT_SCHEME
from pipeline.settings.section import Pair
from pipeline.settings.settings import Domain
from pipeline.store import zarr_store
from pipeline.store.storage import Location
from solver.points.lattice import Lattice
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


def settled(scenario: Scenario, path: Location | None, tell: Callable[[str], None]) -> Scenario:
    """Give a scenario with a domain: its own, that of its store, or one found from the flow.

    Every run is done on a lattice of wider spacing without sides, which is made larger until the flow of none
    reaches its edge; the domain holds the largest extent of all, with a margin.

    Parameters
    ----------
    scenario : Scenario
        As it was read.
    path : Location, optional
        Its store, where that may be there and holds what is asked for.
    tell : callable
        Told the domain that was found.

    Raises
    ------
    BadInput
        If the flow does not end within as many points as a scenario may have.
    """
    if scenario.settings.domain is not None:
        return scenario
    known = {} if path is None else zarr_store.attributes(path)
    if "domain" in known:
        return _within(scenario, Domain.model_validate_json(str(known["domain"])))
    runs = expand(scenario)
    releases = [_extent(run) for run in (runs if _released_anew(scenario) else runs[:1])]
    box, least = _Box(*releases[0]), float("inf")
    for x, y in releases:
        box = box.holding(x, y)
        least = min(least, x[1] - x[0], y[1] - y[0])
    spacing = float(getattr(scenario.settings.points, "spacing"))  # noqa: B009
    wide = max(spacing, min(WIDER * spacing, least / LEAST_CELLS))
    around, flow = _grown(box, wide, np.ones(4, bool)), box
    count = f"{len(runs):,} run{'s' * (len(runs) > 1)}"
    tell(f"{scenario.name}: looking for the domain by {count} on {wide:g} m")
    for run in runs:
        _log.info("%s: domain, run %d of %d", scenario.name, run.index + 1, len(runs))
        around, x, y = _flow(scenario, run, around, wide)
        flow = flow.holding(x, y)
    domain = Domain(x=_rounded(flow.x, spacing, wide), y=_rounded(flow.y, spacing, wide))
    tell(f"{scenario.name}: domain x {list(domain.x)}, y {list(domain.y)} m, found by {count} on {wide:g} m")
    for line in _doubts(scenario, runs, flow, domain):
        tell(f"{scenario.name}: {line}")
    return _within(scenario, domain)


def _doubts(scenario: Scenario, runs: Runs, flow: _Box, domain: Domain) -> Iterator[str]:
    """Say what of a domain that was found is to be known: an end of the profile in it, receptors outside."""
    profiles = {
        solver_objects.slope(run.settings.terrain, run.table)
        for run in (runs if any(key.startswith("terrain") for key in scenario.settings.varied) else runs[:1])
    }
    yield from filter(None, dict.fromkeys(beyond(profile, flow.x) for profile in profiles))
    receptors = scenario.settings.places
    outside = [each.name for each in receptors if part_inside(each, domain) == 0]
    if outside:
        names = "all receptors" if len(outside) == len(receptors) > 1 else ", ".join(outside)
        yield f"outside of the domain, where no flow comes: {names}"


def _within(scenario: Scenario, domain: Domain) -> Scenario:
    return replace(scenario, settings=scenario.settings.model_copy(update={"domain": domain}))


def _released_anew(scenario: Scenario) -> bool:
    return any(key.startswith("release") for key in scenario.settings.varied)


def _extent(run: Run) -> tuple[Pair, Pair]:
    """Bounds of a run's releases."""
    x0, x1, y0, y1 = np.array([r.extent for r in solver_objects.releases(run.settings)]).T
    return (float(x0.min()), float(x1.max())), (float(y0.min()), float(y1.max()))


def _grown(box: _Box, spacing: float, sides: NDArray[np.bool_]) -> _Box:
    """Move sides (x_min, x_max, y_min, y_max) outward by a share of the larger extent."""
    step = GROWTH * max(box.x[1] - box.x[0], box.y[1] - box.y[0], 2 * CLEAR * spacing)
    left, right, low, high = (step * bool(side) for side in sides)
    return _Box((box.x[0] - left, box.x[1] + right), (box.y[0] - low, box.y[1] + high))


def _flow(scenario: Scenario, run: Run, around: _Box, wide: float) -> tuple[_Box, Pair, Pair]:
    """Do a run on a lattice that is made larger until it holds the flow; give its bounds and the flow's."""
    settings = run.settings.model_copy(update={"scheme": DEFAULT_SCHEME})
    while True:
        lattice = Lattice(around.x, around.y, wide)
        if len(lattice.x_points) * len(lattice.y_points) > MOST_POINTS:
            document = parse(scenario.text, str(scenario.path))
            low, high = around.x
            found = (
                f"expected a domain, as the flow of run {run.index} goes on beyond x [{low:g}, {high:g}] m"
            )
            raise BadInput([document.mistake(("domain",), found)])
        here = settings.model_copy(update={"domain": Domain(x=around.x, y=around.y)})
        prepared = build_scene(replace(run, settings=here), SharedPoints(lattice, {}, frozenset()))
        ends = prepared.times[[0, -1]]
        wet = simulate(prepared.scene, ends, arrival_depth=prepared.threshold, frames=()).max_depth > 0
        sides = (wet[:, :CLEAR], wet[:, -CLEAR:], wet[:CLEAR], wet[-CLEAR:])
        reached = np.array([side.any() for side in sides])
        if not reached.any():
            break
        around = _grown(around, wide, reached)
    along, across = lattice.x_points[wet.any(0)], lattice.y_points[wet.any(1)]
    return around, (float(along[0]), float(along[-1])), (float(across[0]), float(across[-1]))


def _rounded(bounds: Pair, spacing: float, wide: float) -> Pair:
    """Move bounds outward by the margin and on to multiples of the spacing."""
    margin = max(MARGIN * (bounds[1] - bounds[0]), CLEAR * wide)
    low, high = floor((bounds[0] - margin) / spacing), ceil((bounds[1] + margin) / spacing)
    # as one would write them
    return float(f"{low * spacing:.12g}"), float(f"{high * spacing:.12g}")
