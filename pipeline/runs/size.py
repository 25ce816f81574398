"""How large a scenario is before it is run: points, memory of a run and size of the results."""

from __future__ import annotations

from dataclasses import dataclass

import psutil

from pipeline.runs.scene_of_run import output_times
from pipeline.scenario.scenario import Scenario
from pipeline.settings.points import LatticePoints
from pipeline.store.variables import FIELDS
from solver.scheme import Collocation

# measured with tracemalloc: bytes a point at the peak of set-up and run, without frames
BYTES = {
    ("lattice", "weighted-residual"): 210,
    ("cloud", "weighted-residual"): 3100,
    ("surface", "weighted-residual"): 620,
    ("lattice", "collocation"): 1300,
    ("cloud", "collocation"): 12900,
}
# a value of a frame while a run lasts, and in the store before it is compressed
HELD, STORED = 8, 4
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

    def __str__(self) -> str:
        """``about 10,571 points, memory 2.3 MB a run, results 4.1 MB or less``, and what is too large."""
        here = psutil.virtual_memory().total
        more = f" (this machine has {_bytes(here)})" if self.memory > here else ""
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
    layout = "lattice" if isinstance(settings.points, LatticePoints) else "cloud"
    # a cloud takes most while its operators are made, whatever its bed
    layout = "surface" if settings.on_surface and layout == "lattice" else layout
    form = "collocation" if settings.scheme.source is Collocation else "weighted-residual"
    frames = len(output_times(settings))
    kept = [field for field in FIELDS if field.name in settings.output.fields]
    in_time = sum("time" in field.dims for field in kept)
    memory = points * (BYTES[layout, form] + HELD * frames * in_time)
    results = points * STORED * (frames * in_time + len(kept) - in_time) * settings.run_count
    return Size(points, float(memory), float(results))


def _bytes(count: float) -> str:
    for unit, name in _UNITS:
        if count >= unit:
            return f"{count / unit:.3g} {name}"
    return f"{count:.0f} B"
