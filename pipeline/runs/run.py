"""One run of a scenario: its settings, and the values that vary between runs."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from pipeline.inputs.elevation_table import ElevationTable
    from pipeline.scenario.solver_objects import Hydrographs, Outlines
    from pipeline.scenario.sweep import Value
    from pipeline.settings.settings import Settings


@dataclass(frozen=True)
class Run:
    """One run of a scenario; small, and pickles.

    Parameters
    ----------
    index : int
        Position along the store's ``run`` dimension, from 0.
    parameters : dict[str, Value]
        Varied values by coordinate name, in the order of the design; empty for a single run.
    settings : Settings
        Complete settings of this run, without what is said of all runs.
    table : ElevationTable, optional
        The elevation table of a ``table`` terrain, else None.
    outlines : Outlines, optional
        Polygons of the releases on an elevation model, by file and layer.
    hydrographs : Hydrographs
        Those of files, by name.
    """

    index: int
    parameters: dict[str, Value]
    settings: Settings
    table: ElevationTable | None = None
    outlines: Outlines | None = None
    hydrographs: Hydrographs = field(default_factory=dict)
