"""Emulated probabilities at receptors, beside those of the runs and their bounds."""

from __future__ import annotations

from collections.abc import Iterator, Sequence

import numpy as np

from pipeline.assess.ensemble import censored, weights
from pipeline.assess.probability import Values
from pipeline.assess.receptors import reached
from pipeline.assess.tables import behind
from pipeline.emulation.sampled import Sampled
from pipeline.emulation.thresholds import Threshold, with_errors

# columns of what reaches receptors in a run
COLUMNS = {"depth": "max_depth", "speed": "max_speed", "pressure": "max_pressure"}


def receptor_rows(runs: Sampled, chosen: Sequence[Threshold]) -> Iterator[dict[str, object]]:
    """Table the probability of each threshold at each receptor, a row each."""
    some = [each for each in chosen if each.receptor and each.quantity.name in COLUMNS]
    if not some:
        return
    store = runs.stores[0]
    by_run = {str(name): rows for name, rows in reached(store).groupby("receptor")}
    open_ended = censored(store).to_numpy()
    nothing = np.zeros_like(open_ended)
    for each in some:
        values = by_run[each.receptor][COLUMNS[each.quantity.name]].to_numpy(np.float64)
        plain = Values(values, weights(store), open_ended, nothing).exceedance([each.threshold])
        row: dict[str, object] = {
            **behind(store),
            "receptor": each.receptor,
            "quantity": each.quantity.name,
            "threshold": each.threshold,
            "units": each.quantity.units,
            **{f"probability{bound}": float(part[0]) for bound, part in plain.by_bound.items()},
        }
        errors = dict.fromkeys(("", "_upper", "_sampling", "_discretisation", "_error"), np.nan)
        if each.found is not None:
            given = with_errors(each.found, unsettled=each.unsettled).items()
            errors |= {ending: float(value[0]) for ending, value in given}
        row |= {f"emulated{ending}": value for ending, value in errors.items()}
        yield row | {"verdict": each.verdict.word, "reason": each.verdict.reason}
