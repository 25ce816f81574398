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
from solver.emulator.scalars import allowance

SHOWN = "runout_distance"


def missing_runs(
    runs: Sampled, chosen: Sequence[Threshold], scalars: Sequence[Quantity]
) -> Iterator[dict[str, object]]:
    """Table the runs of the coarsest level that have no values, a row each.

    ``extrapolated`` says that no computed runs lie around the parameters of the run. The run-out has bounds
    of 95 %; each receptor the probability to be deeper than what counts as reached. Both have the allowance
    for the spacing, missing with one spacing, and ``spacing`` says what it is from.
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
            change = each.scalar.predict(at)[0] - each.scalar.coarsest().predict(at)[0]
            columns[f"{SHOWN}_discretisation"] = allowance(change, len(each.scalar.levels.parts))
    for one in chosen:
        if not one.receptor or one.chosen is None or one.verdict.refused:
            continue
        if one.quantity.name != "depth" or one.threshold != runs.threshold:
            continue
        predictor = Predictor(one.chosen.levels.parts, at)
        mean, deviation = predictor(one.chosen.levels)
        coarse = predictor(one.chosen.levels, only_coarsest=True)
        reached, before = (
            ndtr((around - one.chosen.level) / half)[:, 0] for around, half in ((mean, deviation), coarse)
        )
        columns[f"{one.receptor}_reached"] = reached
        levels = len(one.chosen.levels.parts)
        columns[f"{one.receptor}_reached_discretisation"] = allowance(reached - before, levels)
    names = [str(name) for name, c in store.coords.items() if "key" in c.attrs]
    for i, row in enumerate(rows):
        yield {
            "scenario": runs.name,
            "run": int(store["run"][row]),
            "status": Status(int(store[STATUS.name][row])).words,
            **{name: store[name].to_numpy()[row] for name in names},
            "extrapolated": not among[i],
            **{name: float(values[i]) for name, values in columns.items()},
            "spacing": runs.told_of_spacing,
        }
