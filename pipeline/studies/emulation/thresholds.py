"""Every threshold of a case, on maps and at receptors, also those that leave-one-out refuses."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path

import numpy as np
import pandas as pd
from numpy.typing import NDArray

from pipeline.emulation.sampled import Sampled
from pipeline.emulation.thresholds import Threshold, exceedance_of, fitted, limit_of, with_errors
from pipeline.hazard.quantities import Quantity
from pipeline.studies.emulation.cases import Case
from pipeline.studies.emulation.pictures import DRAWS, cut
from pipeline.studies.emulation.truth import Truth, blocks
from pipeline.studies.emulation.valley import OPEN
from solver.emulator import support
from solver.emulator.fields import choose
from solver.emulator.scores import TWO_SIDED

Array = NDArray[np.float64]
# the inverse of an arrival time is 0 where nothing arrives, and is tried as any other field: one a minute
ARRIVAL = Quantity("arrival", "arrival_time", "s", "time of arrival")
MINUTE, LEAST_TIME = 60.0, 1.0


def compared(case: Case, place: Path) -> Iterator[dict[str, object]]:
    """Compare blocks of runs with the truth, a row by threshold, place, block and number of runs."""
    (spacing,) = case.truth
    truth = Truth(place, case.named(spacing))
    for count in case.few:
        for rows in blocks(count, case.truth[spacing]):
            runs = truth.runs(rows)
            for each in (*fitted(runs, runs.settings.hazard), *_arrivals(runs, case.arrival)):
                if each.chosen is not None:
                    yield from _row(each, runs, truth, rows)


def _arrivals(runs: Sampled, times: tuple[float, ...]) -> Iterator[Threshold]:
    """Emulate whether something arrives before given times, of which the product makes no numbers."""
    if not times:
        return
    held = runs.ensembles[0]["arrival_time"].isel(run=runs.usable[0]).transpose("run", "y", "x").to_numpy()
    (level,) = runs.fields("max_depth")
    inverse = replace(level, values=_inverse(held))
    limits = {time: MINUTE / time for time in times}
    maps, places = choose([inverse], [*limits.values()], runs.judged(runs.usable[0]))
    for time, limit in limits.items():
        for name, chosen in (
            ("", maps[limit]),
            *((place, places[place, limit]) for place in inverse.places),
        ):
            verdict = support.of_exceedance(chosen.score)
            yield Threshold(ARRIVAL, time, name, chosen, verdict)


def _inverse(times: NDArray[np.floating]) -> NDArray[np.floating]:
    return np.where(np.isnan(times), 0.0, MINUTE / np.maximum(np.nan_to_num(times, nan=1.0), LEAST_TIME))


def _above(each: Threshold, runs: Sampled, truth: Truth) -> NDArray[np.bool_]:
    """Say which of all runs of the truth exceed a threshold, (runs, ny, nx)."""
    values: NDArray[np.floating] = truth.store[each.quantity.field].to_numpy()
    if each.quantity is ARRIVAL:
        # as the emulator is asked: before the time
        return np.asarray(_inverse(values) > MINUTE / each.threshold)
    limit = limit_of(each.quantity, each.threshold, runs.density)
    return np.asarray(values > limit)


def _row(each: Threshold, runs: Sampled, truth: Truth, rows: NDArray[np.intp]) -> Iterator[dict[str, object]]:
    """Compare one threshold; nothing where it is certain everywhere."""
    assert each.chosen is not None
    above = _above(each, runs, truth)
    if each.receptor:
        found = exceedance_of(runs, each.chosen, runs.inputs.draws(4 * DRAWS))
        cells = truth.cells(each.receptor)
        by_run = np.asarray(above.reshape(len(above), -1)[:, cells].any(axis=1))
        known, share = np.array([by_run.mean()]), np.array([by_run[rows].mean()])
        some = np.array([True])
    else:
        found = exceedance_of(runs, each.chosen, runs.inputs.draws(DRAWS), mapped=True)
        known = cut(runs, above.mean(axis=0), truth.store)
        share = cut(runs, above[rows].mean(axis=0), truth.store)
        some = (known > OPEN[0]) & (known < OPEN[1])
    if not some.any() or np.isnan(each.chosen.score.ratio):
        return
    error, half = (found.probability - known)[some], with_errors(found)["_error"][some]
    yield {
        "runs": len(rows),
        "what": f"{each.quantity.name} {_sign(each)} {each.threshold:g} {each.quantity.units}",
        "place": "receptors" if each.receptor else "map",
        "receptor": each.receptor,
        "rmse": float(np.sqrt(np.mean(error**2))),
        "rmse_of_share": float(np.sqrt(np.mean((share - known)[some] ** 2))),
        "coverage": float(np.mean(np.abs(error) <= half)),
        "interval": float(half.mean()),
        "interval_of_sampling": float(np.mean(TWO_SIDED * np.sqrt(known * (1 - known) / len(rows))[some])),
        "brier_ratio": each.chosen.score.ratio,
        "verdict": each.verdict.word,
    }


def _sign(each: Threshold) -> str:
    return "before" if each.quantity is ARRIVAL else "above"


def by_threshold(table: pd.DataFrame) -> pd.DataFrame:
    """Put blocks, and receptors, together: a row by runs, quantity, threshold and kind of place."""
    return _together(table.assign(refused=table["verdict"] == "refused"), ["runs", "what", "place"])


def by_verdict(table: pd.DataFrame) -> pd.DataFrame:
    """Put all of one verdict together: how many there are, and in how many the share is nearer."""
    nearer = table["rmse_of_share"] < table["rmse"]
    kind = table["what"].str.startswith("arrival").map({True: "arrival, a trial", False: "all others"})
    counted = table.assign(share_is_nearer=nearer, quantity=kind, cases=1)
    found = _together(counted, ["quantity", "place", "verdict"])
    found["cases"] = counted.groupby(["quantity", "place", "verdict"], sort=False)["cases"].sum().to_numpy()
    return found


def _together(table: pd.DataFrame, by: list[str]) -> pd.DataFrame:
    squares = [str(name) for name in table if str(name).startswith("rmse")]
    held = table.assign(**{name: table[name] ** 2 for name in squares})
    found = held.groupby(by, sort=False).mean(numeric_only=True).reset_index()
    found[squares] = found[squares] ** 0.5
    return found.drop(columns=[name for name in ("runs",) if name not in by])
