"""How large a scenario is before it is run: points, memory of a run and size of the results."""

from __future__ import annotations

from dataclasses import dataclass
from math import prod

import numpy as np
import psutil

from pipeline.runs.scene_of_run import output_times, section_times
from pipeline.runs.template import variables
from pipeline.scenario.scenario import Scenario
from pipeline.settings.points import LatticePoints
from pipeline.store.variables import FIELDS, SECTION_COORDINATES, coordinates
from solver.scheme import Collocation

# measured with tracemalloc: bytes a point at the peak of set-up and run, without frames
BYTES = {
    ("lattice", "weighted-residual"): 210,
    ("cloud", "weighted-residual"): 3100,
    ("surface", "weighted-residual"): 620,
    ("lattice", "collocation"): 1300,
    ("cloud", "collocation"): 12900,
}
# a value of a frame while a run lasts
HELD = 8
# of a word in the store, a digest or a reason of failure
TEXT = 500
_UNITS = ((1e12, "TB"), (1e9, "GB"), (1e6, "MB"), (1e3, "kB"))


@dataclass(frozen=True)
class Size:
    """Points of a scenario, memory of one of its runs and size of the results of all before compression.

    Parameters
    ----------
    points : int
        Number of them.
    memory, results : float
        Bytes.
    """

    points: int
    memory: float
    results: float

    @property
    def too_large(self) -> bool:
        """Whether a run takes more memory than this machine has."""
        return bool(self.memory > psutil.virtual_memory().total)

    def __str__(self) -> str:
        """``about 10,571 points, memory 2.3 MB a run, results 4.1 MB or less``, and what is too large."""
        here = psutil.virtual_memory().total
        more = f" (this machine has {_bytes(here)})" if self.too_large else ""
        return (
            f"about {self.points:,} points, memory {_bytes(self.memory)} a run{more}, "
            f"results {_bytes(self.results)} or less"
        )


def size(scenario: Scenario) -> Size | None:
    """Estimate the size of a scenario; None where its domain is still to be found.

    Points that are placed by a spacing are counted within some percent.
    """
    settings = scenario.settings
    if settings.domain is None:
        return None
    (x0, x1), (y0, y1) = settings.domain.x, settings.domain.y
    points = int(settings.points.estimate(x1 - x0, y1 - y0) + 1e-6)
    if scenario.points is not None:
        points = len(scenario.points.points)
    cloud = not isinstance(settings.points, LatticePoints)
    layout = "cloud" if cloud else "lattice"
    # a cloud takes most while its operators are made, whatever its bed
    layout = "surface" if settings.on_surface and layout == "lattice" else layout
    form = "collocation" if settings.scheme.source is Collocation else "weighted-residual"
    frames = len(output_times(settings))
    kept = [field for field in FIELDS if field.name in settings.output.fields]
    in_time = sum("time" in field.dims for field in kept)
    memory = points * (BYTES[layout, form] + HELD * frames * in_time)
    samples = len(section_times(settings)) if settings.sections else 0
    # what has rows and columns has both lengths in their place
    sizes = {"run": settings.run_count, "time": frames, "section": len(settings.sections)}
    sizes |= {"section_time": samples, "point": points, "x": points, "y": 1}
    known = [*coordinates(cloud, settings.on_surface), *SECTION_COORDINATES[1:]]
    results = sum(
        prod(sizes[dim] for dim in each.dims)
        * (TEXT if each.dtype == "string" else np.dtype(each.dtype).itemsize)
        for each in (*variables(scenario), *known)
    )
    return Size(points, float(memory + HELD * samples * len(settings.sections)), float(results))


def _bytes(count: float) -> str:
    for unit, name in _UNITS:
        if count >= unit:
            return f"{count / unit:.3g} {name}"
    return f"{count:.0f} B"
