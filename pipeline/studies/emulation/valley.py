"""Tables of the valley: maps, receptors, run-out, chosen runs and calibration against thousands of runs."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping
from dataclasses import replace
from time import process_time

import numpy as np
import pandas as pd
from numpy.typing import NDArray
from scipy.spatial.distance import cdist

from pipeline.emulation.calibrated import emulated_measures
from pipeline.emulation.next_runs import chosen_runs, probability_of, target_of
from pipeline.emulation.sampled import Sampled
from pipeline.store.variables import Status
from pipeline.studies.emulation.cases import VALLEY
from pipeline.studies.emulation.pictures import (
    CLOSE,
    DRAWS,
    FINE,
    FINE_PAIRS,
    PAIRS,
    SHIPPED_PAIRS,
    WIDE,
    cut,
    emulated,
)
from pipeline.studies.emulation.truth import Truth, blocks
from solver.emulator.exceedance import exceedance
from solver.emulator.fields import Chosen, choose
from solver.emulator.levels import Draws
from solver.emulator.outline import measures, moved
from solver.emulator.posterior import Measured
from solver.emulator.scalars import Scalar, fit_scalar, quantiles

Array = NDArray[np.float64]
COUNTS = (32, 64, 128)
# as many as the shipped valley has, on its spacing
SHIPPED = 256
# blocks are of what is in the truth of both spacings
LEAST = VALLEY.truth[CLOSE]
# draws that numbers are taken over, and runs that are emulated for them
NUMBERS_OF_DRAWS, DRAWN = (1024, 4096, 16384, 65536), 64
MISSING = 8
SHARES = (0.5, 0.95)
# a rare probability, and how many runs are chosen for it
RARE, FEW, CHOSEN = "school: depth > 1.2", 32, 16
# where a probability is neither next to 0 nor to 1
OPEN = (0.01, 0.99)
# depth of a deposit, m, and runs that are taken as observed, a block
DEPOSIT, OBSERVED = 0.1, 100
# draws of a posterior, as many as the command takes: of fewer too few agree with what is observed
POSTERIOR_DRAWS = 1 << 16


def errors(
    runs: Sampled,
    truth: Truth,
    plain: NDArray[np.float32],
    what: str,
    two_levels: bool = False,
    own: Truth | None = None,
) -> Iterator[dict[str, object]]:
    """Compare emulated maps and shares of runs with a truth, a row by threshold.

    own : truth whose points the runs of the share are on, where these are others.
    """
    on = own or truth
    for threshold, found in emulated(runs).items():
        known = cut(runs, truth.exceedance(threshold), truth.store)
        some = (known > OPEN[0]) & (known < OPEN[1])
        error = np.abs(found.probability - known)[some]
        half = (found.total() if two_levels else found.sampling)[some]
        alone = 1.96 * np.sqrt(known * (1 - known) / len(runs.usable[0]))[some]
        row: dict[str, object] = {
            "what": what,
            "threshold": threshold,
            "rmse": float(np.sqrt(np.mean(error**2))),
            "coverage": float(np.mean(error <= half)),
            "interval": float(half.mean()),
            "interval_of_sampling": float(alone.mean()),
            "brier_ratio": found.score.ratio,
        }
        if plain.shape[1:] == on.depth(slice(1)).shape[1:]:
            share = cut(runs, (plain > threshold).mean(axis=0), on.store)
            row["rmse_of_share"] = float(np.sqrt(np.mean((share - known)[some] ** 2)))
        yield row


def maps(wide: Truth, close: Truth, fine: Truth) -> Iterator[dict[str, object]]:
    """Compare maps of few runs, of runs without the largest, of two spacings, and of the shipped valley."""
    for count in COUNTS:
        for rows in blocks(count, LEAST):
            yield from errors(wide.runs(rows), wide, wide.depth(rows), f"{count} runs at {WIDE:g} m")
    for rows in blocks(64, LEAST):
        volume = wide.store["volume"].to_numpy()[rows]
        failed, rest = np.split(rows[np.argsort(-volume)], [MISSING])
        words = f"64 runs at {WIDE:g} m, the {MISSING} largest failed"
        yield from errors(wide.runs(rows, failed=failed), wide, wide.depth(rest), words)
    for pairs in (PAIRS, SHIPPED_PAIRS):
        for rows in blocks(64, LEAST):
            runs, few = wide.runs(rows, close, pairs), close.depth(rows[:pairs])
            words = f"64 runs at {WIDE:g} m and {pairs} at {CLOSE:g} m"
            yield from errors(runs, close, few, words, two_levels=True)
    # the last runs on the finest spacing are the first of the others
    for rows in blocks(64, VALLEY.truth[FINE]):
        runs, few = wide.runs(rows, close, PAIRS), close.depth(rows[:PAIRS])
        words = f"64 runs at {WIDE:g} m and {PAIRS} at {CLOSE:g} m, against {FINE:g} m"
        yield from errors(runs, fine, few, words, two_levels=True, own=close)
        runs, few = wide.runs(rows, fine, FINE_PAIRS), fine.depth(rows[:FINE_PAIRS])
        words = f"64 runs at {WIDE:g} m and {FINE_PAIRS} at {FINE:g} m"
        yield from errors(runs, fine, few, words, two_levels=True)
    for rows in blocks(SHIPPED, LEAST):
        words = f"{SHIPPED} runs at {CLOSE:g} m"
        yield from errors(close.runs(rows), close, close.depth(rows), words)


def numbers_of_draws(wide: Truth) -> Iterator[dict[str, object]]:
    """Compare what the same runs give over more and more draws with as many as the most, of another seed."""
    for rows in blocks(DRAWN, LEAST):
        runs = wide.runs(rows)
        weight, fields = runs.weight(runs.usable[0]), runs.fields("max_depth")
        maps_of, places = choose(fields, (0.5,), runs.judged(runs.usable[0]))
        run_out = fit_scalar([runs.at(0)], [wide.store["flow_runout_distance"].to_numpy()[rows]], [])

        def numbers(
            draws: Draws,
            weight: Array = weight,
            run_out: Scalar = run_out,
            emulators: Mapping[str, Chosen] = {
                "map above 0.5 m": maps_of[0.5],
                "school above 0.5 m": places["school", 0.5],
            },
        ) -> Iterator[tuple[str, Array, float, float]]:
            """Give name, numbers, half width and processor time of each."""
            for what, each in emulators.items():
                start = process_time()
                found = exceedance(each.levels, each.level, draws, weight)
                some = (found.probability > OPEN[0]) & (found.probability < OPEN[1])
                half = float(found.sampling[some].mean()) if some.any() else float(found.sampling.mean())
                yield what, found.probability, half, process_time() - start
            start = process_time()
            far = quantiles(run_out, (0.95,), draws, weight)
            yield "run-out, 95 %, m", far.values, float(far.sampling[0]), process_time() - start

        most = NUMBERS_OF_DRAWS[-1]
        known = {what: found for what, found, *_ in numbers(other_seed(runs).inputs.draws(most))}
        for count in NUMBERS_OF_DRAWS:
            for what, found, half, seconds in numbers(runs.inputs.draws(count)):
                some = (known[what] > OPEN[0]) & (known[what] < OPEN[1])
                some = some if some.any() else np.ones(len(some), bool)
                yield {
                    "what": what,
                    "draws": count,
                    "rmse_of_draws": float(np.sqrt(np.mean((found - known[what])[some] ** 2))),
                    "interval": half,
                    "processor_seconds": seconds,
                }


def other_seed(runs: Sampled) -> Sampled:
    """Give the same runs with draws of another seed."""
    sample = runs.settings.sample
    assert sample is not None
    other = sample.model_copy(update={"seed": sample.seed + 1000})
    return replace(runs, settings=runs.settings.model_copy(update={"sample": other}))


def next_runs(wide: Truth) -> Iterator[dict[str, object]]:
    """Compare a rare probability from a sample, from a larger one, and with runs chosen beside a sample.

    Of the runs of the truth those next to what is chosen stand for it.
    """
    target = target_of(RARE, wide.settings)
    whole = wide.runs(np.arange(wide.store.sizes["run"]))
    maxima = whole.fields("max_depth")[0]
    flat = maxima.values.reshape(len(maxima.values), -1)
    above = flat[:, maxima.places[target.receptor]].max(axis=1) > target.threshold
    at, known = whole.at(0), float(above.mean())
    for rows in blocks(FEW, LEAST):
        asked = chosen_runs(wide.runs(rows), target, CHOSEN)
        columns = [whole.inputs.by_key[key].of(values) for key, values in asked.draws.items()]
        free = np.setdiff1d(np.arange(len(at)), rows)
        near = free[cdist(np.concatenate(columns, axis=1), at[free]).argmin(axis=1)]
        tried = {
            f"{FEW} runs": wide.runs(rows),
            f"{FEW + CHOSEN} runs": wide.runs(np.arange(rows[0], rows[0] + FEW + CHOSEN)),
            f"{FEW} runs and {CHOSEN} chosen": wide.runs(rows, chosen=np.unique(near)),
        }
        for words, runs in tried.items():
            found = probability_of(runs, target)
            error = float(found.probability[0]) - known
            yield {
                "what": f"{RARE} m, {words}",
                "probability": known,
                "rmse": error,
                "coverage": float(abs(error) <= found.sampling[0]),
                "interval": float(found.sampling[0]),
                "rmse_of_share": float(above[runs.stores[0]["run"].to_numpy()].mean()) - known,
            }


def receptors(wide: Truth) -> Iterator[dict[str, object]]:
    """Compare the probability to reach receptors, with the threshold of the scenario and a larger one."""
    for rows in blocks(64, LEAST):
        runs = wide.runs(rows)
        weight, draws = runs.weight(runs.usable[0]), runs.inputs.draws(4 * DRAWS)
        fields = runs.fields("max_depth")
        _, places = choose(fields, (0.1, 0.5), weight)
        whole = wide.runs(np.arange(wide.store.sizes["run"])).fields("max_depth")[0]
        flat = whole.values.reshape(len(whole.values), -1)
        for (place, threshold), each in places.items():
            known = float((flat[:, whole.places[place]].max(axis=1) > threshold).mean())
            found = exceedance(each.levels, each.level, draws, weight)
            here = fields[0].values.reshape(len(rows), -1)[:, fields[0].places[place]].max(axis=1)
            yield {
                "what": f"{place} above {threshold:g} m",
                "probability": known,
                "rmse": float(found.probability[0]) - known,
                "coverage": float(abs(found.probability[0] - known) <= found.sampling[0]),
                "interval": float(found.sampling[0]),
                "rmse_of_share": float((here > threshold).mean()) - known,
            }


def runouts(wide: Truth) -> Iterator[dict[str, object]]:
    """Compare quantiles of how far the flow came; of all runs, also those that crept on at their end."""
    values = wide.store["flow_runout_distance"].to_numpy()
    known = np.quantile(values, SHARES)
    for rows in blocks(32, LEAST):
        runs = wide.runs(rows)
        scalar = fit_scalar([runs.inputs.of(runs.stores[0])], [values[rows]], [])
        found = quantiles(scalar, SHARES, runs.inputs.draws(4 * DRAWS), runs.weight(runs.usable[0]))
        for i, share in enumerate(SHARES):
            yield {
                "what": f"run-out of the flow, {100 * share:g} %",
                "value": known[i],
                "rmse": found.values[i] - known[i],
                "coverage": float(abs(found.values[i] - known[i]) <= found.sampling[i]),
                "interval": found.sampling[i],
                "rmse_of_share": np.quantile(values[rows], share) - known[i],
            }


def calibrations(wide: Truth) -> Iterator[dict[str, object]]:
    """Count how often posteriors of 90 % hold the parameters of runs that are taken as observed."""
    y, x = wide.store["y"].to_numpy(), wide.store["x"].to_numpy()
    rest = np.flatnonzero((wide.store["status"] == Status.DONE).to_numpy())
    for rows in blocks(64, LEAST):
        runs = wide.runs(rows)
        scalars, draws = emulated_measures(runs, DEPOSIT), runs.inputs.draws(POSTERIOR_DRAWS)
        model, inputs = Measured(list(scalars.values()), draws), runs.inputs.of(wide.store)
        truths = np.random.default_rng(0).choice(np.setdiff1d(rest, rows), OBSERVED, replace=False)
        for truth in truths:
            seen = wide.store["deposit_depth"].to_numpy()[truth] > DEPOSIT
            for error in (0.0, WIDE):
                here, low, high = (measures(moved(seen, y, x, by)[None], y, x) for by in (0.0, -error, error))
                shift = [float(high[name][0] - low[name][0]) / 2 for name in scalars]
                found = model.posterior([float(here[name][0]) for name in scalars], shift)
                ends = [found.quantiles(draws.at[:, j], (0.05, 0.95)) for j in range(inputs.shape[1])]
                row: dict[str, object] = {"what": f"outline known to {error:g} m"}
                for name, (first, last), known in zip(runs.inputs.by_key, ends, inputs[truth], strict=True):
                    row[f"holds_{name.rpartition('.')[2]}"] = float(first <= known <= last)
                yield row | {"effective_draws": found.effective}


def over_blocks(rows: Iterator[dict[str, object]], by: list[str]) -> pd.DataFrame:
    """Put blocks together: root mean squares of errors, means of all else."""
    table = pd.DataFrame(rows)
    squares = [str(name) for name in table if str(name).startswith("rmse")]
    table[squares] = table[squares] ** 2
    found = table.groupby(by, sort=False).mean().reset_index()
    found[squares] = found[squares] ** 0.5
    return found


# parts of the study, each a table
PARTS: Mapping[str, Callable[[Truth, Truth, Truth], pd.DataFrame]] = {
    "maps": lambda wide, close, fine: over_blocks(maps(wide, close, fine), ["what", "threshold"]),
    "draws": lambda wide, close, fine: over_blocks(numbers_of_draws(wide), ["what", "draws"]),
    "next-runs": lambda wide, close, fine: over_blocks(next_runs(wide), ["what"]),
    "receptors": lambda wide, close, fine: over_blocks(receptors(wide), ["what"]),
    "runouts": lambda wide, close, fine: over_blocks(runouts(wide), ["what"]),
    "calibrations": lambda wide, close, fine: over_blocks(calibrations(wide), ["what"]),
}
