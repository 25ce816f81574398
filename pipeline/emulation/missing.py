"""What runs that failed or are pending would have given, by the emulator."""

from __future__ import annotations

from collections.abc import Iterator, Sequence

import numpy as np
from scipy.special import ndtr

from pipeline.emulation.sampled import Sampled
from pipeline.emulation.scenario_quantiles import Quantity
from pipeline.emulation.thresholds import Threshold
from pipeline.store.variables import STATUS, Status
from solver.emulator.extrapolation import inside
from solver.emulator.levels import Predictor

SHOWN = "runout_distance"


def missing_runs(
    runs: Sampled, chosen: Sequence[Threshold], scalars: Sequence[Quantity]
) -> Iterator[dict[str, object]]:
    """Table the runs of the coarsest level that have no values, a row each.

    ``extrapolated`` says that no computed runs lie around the parameters of the run. The run-out has bounds
    of 95 %; each receptor the probability to be deeper than what counts as reached.
    """
    store = runs.stores[0]
    rows = np.setdiff1d(np.arange(store.sizes["run"]), runs.usable[0])
    if not rows.size:
        return
    places = runs.at(0)
    at, known = places[rows], places[runs.usable[0]]
    among = inside(at, known)
    columns: dict[str, np.ndarray[tuple[int], np.dtype[np.float64]]] = {}
    for each in scalars:
        if each.name == SHOWN and each.scalar is not None and not each.verdict.refused:
            ends = zip(("", "_lower", "_upper"), each.scalar.predict(at), strict=True)
            columns |= {f"{SHOWN}{ending}": values for ending, values in ends}
    for one in chosen:
        if not one.receptor or one.chosen is None or one.verdict.refused:
            continue
        if one.quantity.name != "depth" or one.threshold != runs.threshold:
            continue
        mean, deviation = Predictor(one.chosen.levels.parts, at)(one.chosen.levels)
        columns[f"{one.receptor}_reached"] = ndtr((mean - one.chosen.level) / deviation)[:, 0]
    names = [str(name) for name, c in store.coords.items() if "key" in c.attrs]
    for i, row in enumerate(rows):
        yield {
            "scenario": runs.name,
            "run": int(store["run"][row]),
            "status": Status(int(store[STATUS.name][row])).words,
            **{name: store[name].to_numpy()[row] for name in names},
            "extrapolated": not among[i],
            **{name: float(values[i]) for name, values in columns.items()},
        }
