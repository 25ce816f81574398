"""What comes in through sections, at most."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from solver.arrays import Array, Indices
from solver.inflow.entrance import Entrance
from solver.run import entrances_of
from solver.scene import Scene


class Coming(NamedTuple):
    """What comes in through sections at most.

    Parameters
    ----------
    depth, speed : float
        In m and m s-1; critical speed at least.
    cells : tuple of array
        Indices of the cells it comes to, each (n,): row and column on a lattice, number on a cloud.
    starts : array
        Times at which an inflow begins, s.
    """

    depth: float
    speed: float
    cells: tuple[Indices, ...]
    starts: Array


def coming_in(scene: Scene, entrances: tuple[Entrance, ...] | None = None) -> Coming | None:
    """Find what comes in through sections of a scene; None where nothing does.

    Parameters
    ----------
    entrances : tuple of Entrance, optional
        Its inflows, where a run has placed them already.
    """
    found = entrances_of(scene) if entrances is None else entrances
    if not found:
        return None
    peaks = [float(each.inflow.hydrograph.discharges.max()) for each in found]
    deepest = max(float(each.depths(q).max()) for each, q in zip(found, peaks, strict=True))
    speeds = [each.speeds(q) for each, q in zip(found, peaks, strict=True)]
    units = [each.depths(q) * v for each, q, v in zip(found, peaks, speeds, strict=True)]
    critical = (scene.gravity * max(scene.earth_pressure.coefficients()) * np.concatenate(units)) ** (1 / 3)
    cells = tuple(np.concatenate(each) for each in zip(*(e.placed.cells for e in found), strict=True))
    graphs = [each.inflow.hydrograph for each in found]
    starts = [graph.times[max(0, int(np.flatnonzero(graph.discharges)[0]) - 1)] for graph in graphs]
    fastest = max(float(np.concatenate(speeds).max()), float(critical.max()))
    return Coming(deepest, fastest, cells, np.array(starts))
