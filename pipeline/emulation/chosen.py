"""Runs that are chosen beside a sample: a scenario of their own, in a store within that of the sample."""

from __future__ import annotations

import hashlib
import json
from collections.abc import Sequence
from dataclasses import replace

from pipeline.runs.domain_search import on_known_domain
from pipeline.scenario.design import ChosenRuns
from pipeline.scenario.scenario import Scenario
from pipeline.store import zarr_store
from pipeline.store.place import CHOSEN, LEVEL, chosen_number, chosen_paths, store_path
from pipeline.store.storage import Location
from pipeline.store.variables import CHOSEN_FROM


def with_chosen(base: Scenario, out: Location, number: int, chosen: ChosenRuns) -> Scenario:
    """Give the scenario of chosen runs: that of the sample but for its runs and its name.

    Parameters
    ----------
    base : Scenario
        That of the sample, on its widest spacing.
    out : Location
        The place that holds its store, whose domain and threshold the runs share.
    number : int
        Of the choice, from 1.
    chosen : ChosenRuns
        The runs.
    """
    path = store_path(out, base.name)
    held, base = zarr_store.attributes(path), on_known_domain(base, path)
    changed = {
        "name": f"{base.name}{LEVEL}{CHOSEN}{number}",
        "output": base.settings.output.model_copy(update={"threshold": float(held["threshold"])}),
    }
    said = {"for": chosen.target, "values": chosen.draws}
    content = json.dumps({**json.loads(base.content), "chosen": said})
    return replace(
        base,
        settings=base.settings.model_copy(update=changed),
        content=content,
        digest=hashlib.sha256(content.encode()).hexdigest(),
        warnings=(),
        chosen=chosen,
    )


def chosen_before(scenarios: Sequence[Scenario], out: Location) -> list[Scenario]:
    """Give the scenarios of the runs that were chosen beside those of others, as their stores have them."""
    found = []
    for base in scenarios:
        for path in chosen_paths(store_path(out, base.name)) if LEVEL not in base.name else ():
            held = zarr_store.attributes(path)
            said = json.loads(str(held["scenario_content"]))["chosen"]
            draws = {key: tuple(values) for key, values in said["values"].items()}
            chosen = ChosenRuns(said["for"], draws, str(held[CHOSEN_FROM]))
            found.append(with_chosen(base, out, chosen_number(path), chosen))
    return found
