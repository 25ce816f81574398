"""Runs: a scenario's design expanded, and the points that its runs share."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from typing import overload

from pipeline.mistakes import BadInput
from pipeline.runs.run import Run
from pipeline.runs.shared_points import SharedPoints, made
from pipeline.scenario.design import Design, design
from pipeline.scenario.ground import of_run
from pipeline.scenario.scenario import Scenario
from pipeline.scenario.strict_yaml import parse
from pipeline.scenario.sweep import Value, assign, coordinate_names, path_of
from pipeline.settings.settings import OF_ALL_RUNS, Settings


class Runs(Sequence[Run]):
    """The runs of a scenario in the order of its design.

    Each is made when it is asked for: a list of them would grow the process that holds it.
    """

    def __init__(self, scenario: Scenario) -> None:
        self.tables, self.ground = scenario.tables, scenario.ground
        self.hydrographs, self.last_inflow = scenario.hydrographs, scenario.settings.last_inflow
        chosen = scenario.chosen
        self.design = design(scenario.settings) if chosen is None else Design({}, chosen.draws)
        self._data = {name: value for name, value in scenario.data.items() if name not in OF_ALL_RUNS}
        if scenario.settings.domain is not None:
            # given or found
            self._data["domain"] = scenario.settings.domain.model_dump()
        self._names = tuple(coordinate_names(self.design.keys).values())
        self.paths = [path for key in self.design.keys if (path := path_of(key, self._data)) is not None]

    def __len__(self) -> int:
        return len(self.design)

    @overload
    def __getitem__(self, index: int) -> Run: ...

    @overload
    def __getitem__(self, index: slice) -> Sequence[Run]: ...

    def __getitem__(self, index: int | slice) -> Run | Sequence[Run]:
        if isinstance(index, slice):
            return [self[i] for i in range(len(self))[index]]
        index = range(len(self))[index]
        changed = self._data
        for path, value in zip(self.paths, self.design[index], strict=True):
            changed = assign(changed, path, value)
        settings = Settings.model_validate(changed).fed_until(self.last_inflow)
        table = self.tables.get(settings.table_file or "")
        polygons = None if self.ground is None else of_run(settings, self.ground.outlines)
        graphs = {name: self.hydrographs[name] for name in settings.hydrograph_files}
        return Run(index, self.parameters(index), settings, table, polygons, graphs)

    def parameters(self, index: int) -> dict[str, Value]:
        """Varied values of a run by coordinate name."""
        return dict(zip(self._names, self.design[index], strict=True))


def expand(scenario: Scenario) -> Runs:
    """List the runs of a scenario."""
    return Runs(scenario)


def share(scenario: Scenario, runs: Sequence[Run]) -> SharedPoints:
    """Make the points of a scenario, the operators of its runs and their threshold.

    Raises
    ------
    BadInput
        If points or supports are not fit; the message names the points.
    """
    # which makes scenes on shared points
    from pipeline.runs.threshold import threshold

    try:
        rasters = {} if scenario.ground is None else scenario.ground.rasters
        shared = made(scenario.settings, scenario.points, runs, rasters)
        if scenario.ground is not None:
            shared = replace(shared, depths=scenario.ground.depths)
    except ValueError as error:
        document = parse(scenario.text, str(scenario.path))
        found = f"expected points that fit, found {error}"
        raise BadInput([document.mistake(("points",), found)]) from None
    return replace(shared, threshold=threshold(scenario, shared.points))
