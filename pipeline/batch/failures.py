"""The runs that failed: where in its file each was asked for, and why it failed."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np

from pipeline.batch.task import Outcome
from pipeline.runs.runs import expand
from pipeline.scenario.scenario import Scenario
from pipeline.scenario.strict_yaml import Path, parse
from pipeline.store.place import store_name, store_path
from pipeline.store.storage import Location
from pipeline.store.variables import Status
from pipeline.store.zarr_store import values_of_runs

if TYPE_CHECKING:
    import pandas as pd

MOST_LISTED = 20
AGAIN = "run again with --retry-failed to repeat them"


@dataclass(frozen=True)
class Failed:
    """A failed run of a store: its position, its varied parameters and the reason."""

    scenario: str
    run: int
    parameters: dict[str, Any]
    reason: str

    @property
    def described(self) -> dict[str, Any]:
        """As JSON has it."""
        return {"run": self.run, "parameters": self.parameters, "reason": self.reason}

    def __str__(self) -> str:
        """``heap run 3, bed_friction=20: failed: ...``."""
        given = "".join(f", {name}={value}" for name, value in self.parameters.items())
        return f"{self.scenario} run {self.run}{given}: failed: {self.reason}"


def failed(out: Location, name: str) -> list[Failed]:
    """Read the failed runs of a scenario from its store."""
    values, attributes = values_of_runs(store_path(out, name))
    varied = [key for key in values if "key" in attributes[key]]
    return [
        Failed(
            name,
            int(run),
            {key: values[key][run : run + 1].tolist()[0] for key in varied},
            str(values["failure_reason"][run]),
        )
        for run in np.flatnonzero(values["status"] == Status.FAILED)
    ]


def told_again(runs: Sequence[Failed]) -> Iterator[str]:
    """Give a line for each failed run, up to a number, and how to repeat them."""
    for each in runs[:MOST_LISTED]:
        yield str(each)
    yield from _more(len(runs))
    if runs:
        yield f"{len(runs)} failed; {AGAIN}"


def unfinished(scenario: Scenario, counts: Mapping[Status, int]) -> Iterator[str]:
    """Say how many runs of a scenario are no plain ends, by the number of runs of each status."""
    planned = sum(counts.values())
    cut_off = sum(n for status, n in counts.items() if status.is_cut_off)
    lost = sum(n for status, n in counts.items() if status.is_overrun)
    if cut_off:
        end = scenario.settings.time.end
        when = "the latest end" if end is None else f"time.end ({end:g} s)"
        advice = "give a later time.end" if end is None else "make time.end later, or leave it out"
        yield (
            f"{scenario.name}: {cut_off} of {planned} runs still moved at {when}; how far they reach is a "
            f"lower bound: {advice}"
        )
    if lost:
        ground = scenario.settings.on_surface
        where = "where the domain or the data end" if ground else "through an open side"
        larger = "or take a larger elevation model" if ground else "or leave it out"
        yield (
            f"{scenario.name}: {lost} of {planned} runs lost material {where}; how far they reach is a lower "
            f"bound: make the domain larger, {larger}"
        )


def without_runout(scenario: Scenario, rows: pd.DataFrame) -> Iterator[str]:
    """Say how many computed runs of a scenario have no run-out, as all of them is below its threshold.

    Parameters
    ----------
    scenario : Scenario
        The scenario.
    rows : DataFrame
        Its rows of the table of runs.
    """
    threshold = scenario.settings.output.threshold
    computed = rows[~rows["status"].isin(["failed", "pending"])]
    none = int(computed["runout_distance"].isna().sum())
    if threshold is not None and none:
        yield (
            f"{scenario.name}: {none} of {len(computed)} computed runs have no run-out, as nothing deeper "
            f"than output.threshold ({threshold:g} m) lies there at their end: check release, spacing and "
            "threshold"
        )


def place(scenario: Scenario, run: int) -> str:
    """Give file and lines that made a run: those of its values in the design, or that of the name."""
    document = parse(scenario.text, str(scenario.path))
    design = expand(scenario).design
    entries = zip(design.lists, design.place(run)[0], strict=True)
    paths: list[Path] = [("sweep", key, k) for key, k in entries]
    # chosen runs have a value of their own of every key
    swept = [("sweep", key) for key in design.draws if key in scenario.settings.sweep]
    paths += swept + [("sample", "values", key) for key in design.draws if ("sweep", key) not in swept]
    lines = dict.fromkeys(document.values[path].line for path in paths or [("name",)])
    return f"{scenario.path}:{','.join(map(str, lines))}"


def listed(scenarios: Iterable[Scenario], failed: Sequence[Outcome]) -> Iterator[str]:
    """Give a line for each failed run, up to a number: its place, the run, its varied values, the reason."""
    named = {scenario.name: scenario for scenario in scenarios}
    for outcome in sorted(failed, key=lambda each: (each.path, each.run))[:MOST_LISTED]:
        scenario = named[store_name(outcome.path)]
        values = expand(scenario).parameters(outcome.run)
        told = Failed(scenario.name, outcome.run, dict(values), outcome.reason)
        yield f"{place(scenario, outcome.run)}: {told}"
    yield from _more(len(failed))


def _more(count: int) -> Iterator[str]:
    if count > MOST_LISTED:
        yield f"and {count - MOST_LISTED} more; `pipeline summary` has them all"
