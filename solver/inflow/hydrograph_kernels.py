"""Hydrographs of sections: discharge, volume and depth by time, and when something comes in."""

from __future__ import annotations

import math
from collections.abc import Iterable, Sequence
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np

from solver.arrays import Array, Indices
from solver.compiled import kernel

if TYPE_CHECKING:
    from solver.inflow.entrance import Entrance


class Hydrographs(NamedTuple):
    """Hydrographs one after another, and how deep a discharge is.

    Attributes
    ----------
    node, time, discharge, volume
        That of section k is from ``node[k]`` to ``node[k + 1]``; s, m3 s-1, and the volume by then, m3.
    table, log_depth, log_discharge, fixed
        Ratings of sections, likewise; see `solver.inflow.conditions.Rating`.
    """

    node: Indices
    time: Array
    discharge: Array
    volume: Array
    table: Indices
    log_depth: Array
    log_discharge: Array
    fixed: Array


@kernel()
def piece_of(values: Array, first: int, last: int, at: float) -> int:
    """Index of the piece between values that increase, from ``first`` to ``last``, that holds ``at``."""
    low, high = first, last - 1
    while high - low > 1:
        middle = (low + high) // 2
        if values[middle] <= at:
            low = middle
        else:
            high = middle
    return low


@kernel()
def discharge_at(graphs: Hydrographs, k: int, time: float) -> float:
    """Discharge of section k at a time (s), m3 s-1."""
    a, b = graphs.node[k], graphs.node[k + 1]
    t, q = graphs.time, graphs.discharge
    if time < t[a] or time > t[b - 1]:
        return 0.0
    i = piece_of(t, a, b, time)
    return float(q[i] + (time - t[i]) / (t[i + 1] - t[i]) * (q[i + 1] - q[i]))


@kernel()
def volume_until(graphs: Hydrographs, k: int, time: float) -> float:
    """Volume that has come in through section k by a time (s), m3."""
    a, b = graphs.node[k], graphs.node[k + 1]
    t = graphs.time
    if time <= t[a]:
        return 0.0
    if time >= t[b - 1]:
        return float(graphs.volume[b - 1])
    i = piece_of(t, a, b, time)
    now = discharge_at(graphs, k, time)
    return float(graphs.volume[i] + 0.5 * (time - t[i]) * (graphs.discharge[i] + now))


@kernel()
def next_flow(graphs: Hydrographs, k: int, time: float) -> float:
    """First time from ``time`` on at which section k has a discharge or begins to, s; infinite for none."""
    a, b = graphs.node[k], graphs.node[k + 1]
    t, q = graphs.time, graphs.discharge
    for i in range(a, b - 1):
        if time < t[i + 1] and (q[i] > 0.0 or q[i + 1] > 0.0):
            return float(max(t[i], time))
    return math.inf


@kernel()
def peak_within(graphs: Hydrographs, k: int, start: float, stop: float) -> float:
    """Largest discharge of section k between two times (s), m3 s-1."""
    peak = max(discharge_at(graphs, k, start), discharge_at(graphs, k, stop))
    for i in range(graphs.node[k], graphs.node[k + 1]):
        if start <= graphs.time[i] <= stop:
            peak = max(peak, graphs.discharge[i])
    return float(peak)


@kernel()
def interpolated(x: Array, y: Array, first: int, last: int, at: float) -> float:
    """Value at ``at`` of a table from ``first`` to ``last``, linear between and beyond its entries."""
    i = piece_of(x, first, last, at)
    return float(y[i] + (at - x[i]) / (x[i + 1] - x[i]) * (y[i + 1] - y[i]))


@kernel()
def unit_discharge(graphs: Hydrographs, k: int, h: float) -> float:
    """Discharge per width at a depth (m) in section k, m2 s-1."""
    if h <= 0.0:
        return 0.0
    a, b = graphs.table[k], graphs.table[k + 1]
    return float(math.exp(interpolated(graphs.log_depth, graphs.log_discharge, a, b, math.log(h))))


@kernel()
def depth_of(graphs: Hydrographs, k: int, discharge: float) -> float:
    """Depth at a discharge per width (m2 s-1) in section k, m."""
    a, b = graphs.table[k], graphs.table[k + 1]
    return float(math.exp(interpolated(graphs.log_discharge, graphs.log_depth, a, b, math.log(discharge))))


def no_hydrographs() -> Hydrographs:
    """Give what kernels are given where nothing comes in."""
    whole, real = np.zeros(0, np.int64), np.zeros(0)
    return Hydrographs(whole, real, real, real, whole, real, real, real)


def graphs_of(entrances: Sequence[Entrance]) -> dict[str, Any]:
    """Give what kernels know of whole sections, by the names of `solver.kernels.sections.inflow.Inflows`."""
    graphs = [each.inflow.hydrograph for each in entrances]
    ratings = [each.rating for each in entrances]
    count = len(entrances)
    return {
        "graphs": Hydrographs(
            _starts(len(each.times) for each in graphs),
            np.concatenate([each.times for each in graphs]),
            np.concatenate([each.discharges for each in graphs]),
            np.concatenate([each.volumes for each in graphs]),
            _starts(len(each.log_depth) for each in ratings),
            np.concatenate([each.log_depth for each in ratings]),
            np.concatenate([each.log_discharge for each in ratings]),
            np.array([each.fixed for each in ratings]),
        ),
        # exact sums, so that mirror images have the same
        "total": np.array([math.fsum(each.placed.width) for each in entrances]),
        "opened": np.zeros(count),
        "flowing": np.zeros(count),
        "entered": np.zeros(count),
        "until": np.array([max(each.last for each in graphs)]),
    }


def _starts(lengths: Iterable[int]) -> Indices:
    return np.concatenate(([0], np.cumsum(np.fromiter(lengths, np.int64))))
