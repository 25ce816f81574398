"""Scenario files, batches of runs, stores, assessment, maps and reports.

The functions below are what scripts and notebooks need. They are imported when they are first used, so that
``import pipeline`` takes no time.

>>> import pipeline
>>> results = pipeline.run("heap.yaml", out="results")  # doctest: +SKIP
>>> results["heap"].max_depth.max(), results.table  # doctest: +SKIP
"""

from __future__ import annotations

from importlib import import_module
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from pipeline.api.batch import load as load
    from pipeline.api.batch import run as run
    from pipeline.api.calibration import calibrate as calibrate
    from pipeline.api.emulation import emulate as emulate
    from pipeline.api.maps import compare as compare
    from pipeline.api.maps import hazard_maps as hazard_maps
    from pipeline.api.report import write_report as write_report
    from pipeline.api.results import open as open
    from pipeline.api.results import run_table as run_table
    from pipeline.api.results import to_lattice as to_lattice
    from pipeline.api.tables import assessment_tables as assessment_tables
    from pipeline.api.tables import sensitivity_indices as sensitivity_indices
    from pipeline.errors import BadInput as BadInput
    from pipeline.errors import ChangedError as ChangedError
    from pipeline.errors import OptionError as OptionError
    from pipeline.errors import PlaceInUseError as PlaceInUseError
    from pipeline.results import Results as Results

_BY_MODULE = {
    "pipeline.api.batch": ("load", "run"),
    "pipeline.api.results": ("open", "to_lattice", "run_table"),
    "pipeline.api.maps": ("hazard_maps", "compare"),
    "pipeline.api.tables": ("assessment_tables", "sensitivity_indices"),
    "pipeline.api.emulation": ("emulate",),
    "pipeline.api.calibration": ("calibrate",),
    "pipeline.api.report": ("write_report",),
    "pipeline.errors": ("BadInput", "ChangedError", "OptionError", "PlaceInUseError"),
    "pipeline.results": ("Results",),
}
_HOMES = {name: module for module, names in _BY_MODULE.items() for name in names}

__all__ = [*_HOMES]


def __getattr__(name: str) -> Any:
    """Import a public name when it is first asked for (PEP 562)."""
    if name not in _HOMES:
        raise AttributeError(f"module 'pipeline' has no attribute '{name}'")
    found = getattr(import_module(_HOMES[name]), name)
    globals()[name] = found
    return found


def __dir__() -> list[str]:
    return sorted({*globals(), *_HOMES})
