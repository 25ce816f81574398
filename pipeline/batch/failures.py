"""Where in its file a run was asked for, and the list of those that failed."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping, Sequence

from pipeline.batch.task import Outcome
from pipeline.runs.runs import expand
from pipeline.scenario.scenario import Scenario
from pipeline.scenario.strict_yaml import Path, parse
from pipeline.store.variables import Status

MOST_LISTED = 20


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
        yield (
            f"{scenario.name}: {lost} of {planned} runs lost material through an open side; how far they "
            "reach is a lower bound: make the domain larger, or leave it out"
        )


def place(scenario: Scenario, run: int) -> str:
    """Give file and lines that made a run: those of its values in the design, or that of the name."""
    document = parse(scenario.text, str(scenario.path))
    design = expand(scenario).design
    entries = zip(design.lists, design.place(run)[0], strict=True)
    paths: list[Path] = [("sweep", key, k) for key, k in entries]
    paths += [("sample", "values", key) for key in design.draws]
    lines = dict.fromkeys(document.values[path].line for path in paths or [("name",)])
    return f"{scenario.path}:{','.join(map(str, lines))}"


def listed(scenarios: Iterable[Scenario], failed: Sequence[Outcome]) -> Iterator[str]:
    """Give a line for each failed run, up to a number: its place, the run, its swept values, the reason."""
    named = {scenario.name: scenario for scenario in scenarios}
    for outcome in sorted(failed, key=lambda each: (each.path, each.run))[:MOST_LISTED]:
        scenario = named[outcome.path.stem]
        values = expand(scenario).parameters(outcome.run)
        given = "".join(f", {name}={value}" for name, value in values.items())
        where = place(scenario, outcome.run)
        yield f"{where}: {scenario.name} run {outcome.run}{given}: failed: {outcome.reason}"
    if len(failed) > MOST_LISTED:
        yield f"and {len(failed) - MOST_LISTED} more; `pipeline summary` has them all"
