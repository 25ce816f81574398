"""Emulated quantiles of run-out, deposit and peaks, beside those of the runs and their bounds."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from pipeline.assess.tables import SHARES, behind, tabled, values
from pipeline.emulation.sampled import Sampled
from solver.emulator import support
from solver.emulator.extrapolation import inside
from solver.emulator.levels import Draws
from solver.emulator.scalars import Scalar, fit_scalar, quantiles
from solver.emulator.support import Verdict

Array = NDArray[np.float64]
Rows = NDArray[np.intp]


@dataclass(frozen=True)
class Quantity:
    """A summary of the runs and its emulator; rows : of each level, the runs it is fitted to."""

    name: str
    units: str
    rows: Sequence[Rows]
    scalar: Scalar | None
    verdict: Verdict

    def row(self, runs: Sampled) -> dict[str, object]:
        """Row of the table of leave-one-out."""
        score = None if self.scalar is None else self.scalar.score
        return {
            **behind(runs.stores[0]),
            "what": self.name,
            "verdict": self.verdict.word,
            "brier_ratio": np.nan,
            "calibration": np.nan,
            "q2": np.nan if score is None else score.q2,
            "coverage": np.nan if score is None else score.coverage,
            "worst": np.nan if score is None else score.worst,
            "reason": self.verdict.reason,
        }


def emulated_scalars(runs: Sampled) -> list[Quantity]:
    """Fit an emulator to each quantity that quantiles are tabled of."""
    return [_fitted(runs, name) for name in tabled(runs.stores[0])]


def _fitted(runs: Sampled, name: str) -> Quantity:
    units = str(runs.stores[0][name].attrs.get("units", ""))
    held = [runs.values(level, name) for level in range(len(runs.stores))]
    known = [
        rows[np.isfinite(each.value[rows]) & ~each.at_least[rows] & ~each.at_most[rows]]
        for each, rows in zip(held, runs.usable, strict=True)
    ]
    count, inputs = int((known[0] < runs.counted).sum()), runs.at(0)
    if few := support.of_runs(count, inputs.shape[1]):
        return Quantity(name, units, known, None, Verdict(f"{few} with a known {name}"))
    for level in range(1, len(known)):
        before = runs.root_rows(level - 1, known[level - 1])
        known[level] = known[level][np.isin(runs.root_rows(level, known[level]), before)]
    if nothing := int(np.isneginf(held[0].value[: runs.counted]).sum()):
        return Quantity(name, units, known, None, Verdict(f"{nothing} runs end without any {name}"))
    if alike := support.of_places(inputs[known[0]]):
        return Quantity(name, units, known, None, Verdict(f"{alike}, with a known {name}"))
    doubts = []
    while len(known) > 1 and not support.of_pairs(len(known[-1]))[0]:
        doubts = [support.of_pairs(len(known.pop()))[1]]
    if len(known) > 1:
        doubts = [*filter(None, [support.of_pairs(len(known[-1]))[1]])]
    some = [each.value[rows] for each, rows in zip(held, known, strict=False)]
    if np.ptp(some[0]) == 0:
        return Quantity(name, units, known, None, Verdict("all runs are alike"))
    places = [runs.at(level)[rows] for level, rows in enumerate(known)]
    scalar = fit_scalar(places, some, runs.pairs(known))
    verdict = support.of_scalar(scalar.score)
    verdict = replace(verdict, warned=(*verdict.warned, *doubts))
    unknown = np.setdiff1d(runs.usable[0], known[0])
    if unknown.size:
        beyond = int((~inside(inputs[unknown], inputs[known[0]])).sum())
        told = f"{unknown.size} runs that are not known in full are left to the emulator"
        far = (f"{told}, {beyond} of them extrapolated",) if beyond else ()
        verdict = Verdict(verdict.refused, (*verdict.warned, *far), "" if beyond else told)
    return Quantity(name, units, known, scalar, verdict)


def quantile_rows(runs: Sampled, scalars: Sequence[Quantity], draws: Draws) -> Iterator[dict[str, object]]:
    """Table quantiles of each quantity, a row each."""
    store = runs.stores[0]
    for each in scalars:
        plain = values(store, each.name).quantile(SHARES)
        found = None
        if each.scalar is not None and not each.verdict.refused:
            found = quantiles(each.scalar, SHARES, draws, runs.weight(each.rows[0]))
        for i, share in enumerate(SHARES):
            errors = dict.fromkeys(("", "_sampling", "_discretisation", "_error"), np.nan)
            if found is not None:
                several = not np.isnan(found.discretisation[i])
                errors = {
                    "": found.values[i],
                    "_sampling": found.sampling[i],
                    "_discretisation": found.discretisation[i],
                    "_error": found.total[i] if several else found.sampling[i],
                }
            yield {
                **behind(store),
                "quantity": each.name,
                "units": each.units,
                "share": share,
                **{f"quantile{bound}": _finite(part[i]) for bound, part in plain.by_bound.items()},
                **{f"emulated{ending}": value for ending, value in errors.items()},
                "verdict": each.verdict.word,
                "reason": each.verdict.reason,
            }


def _finite(value: float) -> float:
    return float(value) if np.isfinite(value) else np.nan
