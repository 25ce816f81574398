"""Flows that go beyond the ends of the profile, where nobody surveyed the bed."""

from __future__ import annotations

from collections.abc import Iterable

import numpy as np
from numpy.typing import NDArray

from pipeline.runs.scene_of_run import Prepared
from pipeline.settings.section import Pair
from solver.physics.terrain import SlopeProfile

Array = NDArray[np.float64]
# begins the warning of a run, by which it is counted
BEYOND = "flow beyond the profile"


def covered(terrain: SlopeProfile) -> Pair | None:
    """Give the arc lengths from the first to the last point of a surveyed profile, m; None of others."""
    length = getattr(terrain, "length", None)
    return None if length is None else (0.0, float(length))


def beyond(terrain: SlopeProfile, flow: Pair) -> str | None:
    """Say how far a flow within arc lengths, m, goes beyond the ends of its profile; None if it does not."""
    ends = covered(terrain)
    if ends is None or (flow[0] >= ends[0] and flow[1] <= ends[1]):
        return None
    parts = [
        f"{abs(place - end):.3g} m {side}"
        for place, end, side, out in (
            (flow[0], ends[0], "above its start", flow[0] < ends[0]),
            (flow[1], ends[1], "below its end", flow[1] > ends[1]),
        )
        if out
    ]
    return (
        f"{BEYOND}, which covers x from {ends[0]:g} to {ends[1]:.6g} m: it comes {' and '.join(parts)}, "
        "where the end slopes go on"
    )


def warning(prepared: Prepared, max_depth: Array) -> list[str]:
    """List the warning of a run whose flow went beyond the ends of its profile, if it did.

    Parameters
    ----------
    prepared : Prepared
        The run.
    max_depth : array
        Largest depth over all time steps at its points, m.
    """
    if not isinstance(prepared.terrain, SlopeProfile):
        return []
    wet = max_depth > prepared.threshold
    if not wet.any():
        return []
    x = prepared.scene.points.coordinates[0][wet]
    found = beyond(prepared.terrain, (float(x.min()), float(x.max())))
    return [] if found is None else [found]


def count(warnings: Iterable[object]) -> int:
    """Count the runs whose flow went beyond the ends of the profile, by their warnings."""
    return sum(BEYOND in str(warning) for warning in warnings)


def note(runs: int) -> str:
    """Say in how many runs the flow went beyond the ends of the profile, where it did in some."""
    return f"; flow beyond the surveyed profile in {runs}" if runs else ""
