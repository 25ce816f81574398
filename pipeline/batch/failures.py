"""Where in its file a run was asked for, and the list of those that failed."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Sequence

from pipeline.batch.task import Outcome
from pipeline.runs.runs import expand
from pipeline.scenario.scenario import Scenario
from pipeline.scenario.strict_yaml import Path, parse

MOST_LISTED = 20


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
