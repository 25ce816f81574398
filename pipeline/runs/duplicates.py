"""Runs with the same physics: computed once, whatever the scenarios are called that ask for them."""

from __future__ import annotations

import hashlib
import json
from collections.abc import Mapping, Sequence
from typing import Any

from pipeline.runs.runs import Runs, expand
from pipeline.scenario.scenario import Scenario
from pipeline.scenario.sweep import assign
from pipeline.settings.sample import Discrete
from pipeline.settings.settings import OF_ALL_RUNS
from pipeline.store import zarr_store
from pipeline.store.place import store_path
from pipeline.store.storage import Location

Place = tuple[Location, int]
# what is no physics, and what is told of a run by its values
_ELSEWHERE = frozenset({"name", "draws", "chosen", *OF_ALL_RUNS})


def copies(scenarios: Sequence[Scenario], out: Location) -> dict[Location, dict[int, Place]]:
    """Find the runs that an earlier one has the physics of.

    Same is what gives the same values to write: equal settings but for words and limits of cost, equal
    tables and points.

    Parameters
    ----------
    scenarios : sequence of Scenario
        All of them, each with its domain.
    out : Location
        The place of their stores.

    Returns
    -------
    dict of Location to dict of int to (Location, int)
        By store and index of each such run, the store and index of the first with its physics.
    """
    if len(scenarios) < 2 and not any(map(_repeats, scenarios)):
        return {}
    first: dict[bytes, Place] = {}
    found: dict[Location, dict[int, Place]] = {}
    for scenario in scenarios:
        path, runs = store_path(out, scenario.name), expand(scenario)
        data = _plain(json.loads(scenario.content))
        data = {name: value for name, value in data.items() if name not in _ELSEWHERE}
        data["domain"] = _plain(scenario.settings.bounds.model_dump(mode="json"))
        # one of all runs, which is in the store by now
        data["output"] = data["output"] | {"threshold": zarr_store.attributes(path).get("threshold")}
        if scenario.settings.time.end is None:
            data["last_inflow"] = scenario.settings.last_inflow
        for i in range(len(runs)):
            place = path, i
            source = first.setdefault(_digest(data, runs, i), place)
            if source != place:
                found.setdefault(path, {})[i] = source
    return found


def _repeats(scenario: Scenario) -> bool:
    """Whether runs of one scenario may be the same: where all that is sampled is one of a list."""
    sample = scenario.settings.sample
    return sample is not None and all(isinstance(each, Discrete) for each in sample.values.values())


def _digest(data: Mapping[str, Any], runs: Runs, index: int) -> bytes:
    changed: Any = data
    for path, value in zip(runs.paths, runs.design[index], strict=True):
        # a single inflow is a list of one in what decides results
        single = path[:1] == ("inflow",) and not isinstance(path[1], int)
        changed = assign(changed, (path[0], 0, *path[1:]) if single else path, _plain(value))
    return hashlib.sha256(json.dumps(changed, sort_keys=True).encode()).digest()


def _plain(value: Any) -> Any:
    """Give JSON with all numbers as floats and lists as tuples, so that what is equal looks so."""
    if isinstance(value, dict):
        return {name: _plain(inner) for name, inner in value.items()}
    if isinstance(value, list):
        return tuple(map(_plain, value))
    return float(value) if isinstance(value, int) and not isinstance(value, bool) else value
