"""Which parameter drives what: indices from the runs there are, with their confidence intervals (SALib)."""

from __future__ import annotations

import logging
from collections.abc import Callable, Iterator, Mapping, Sequence
from typing import Any

import numpy as np
import pandas as pd
import xarray as xr
from numpy.typing import NDArray

from pipeline.assess.ensemble import censored, computed, counts, weights
from pipeline.assess.receptors import reached
from pipeline.assess.tables import behind
from pipeline.scenario.scenario import stored
from pipeline.store.place import store_paths
from pipeline.store.storage import Location
from pipeline.store.zarr_store import open_store

Array = NDArray[np.float64]
_log = logging.getLogger(__name__)

QUANTITIES = ("runout_distance", "deposit_area", "deposit_max_depth", "peak_speed")
LEAST_RUNS = 40
RUNS_A_SLICE = 20
MOST_SLICES = 10
RESAMPLES = 50
# half widths of intervals of 95 %, in standard deviations, to both sides and to one
NORMAL, NORMAL_ONE_SIDED = 1.96, 1.645
SEED = 0


def sensitivity_indices(out: Location, tell: Callable[[str], None]) -> pd.DataFrame:
    """Table the indices of every varied parameter of a place's scenarios.

    PAWN's index is the distance between the distribution of a quantity and that where the parameter is held
    in a slice of its range, the median over slices: 0 where it does nothing, at most 1. It takes the runs
    there are. ``noise`` is what a parameter that does nothing gets by chance in 19 of 20 cases. Sobol's
    indices are the share of the variance that a parameter explains alone (``first``) or with others
    (``total``); they need design ``saltelli`` without a gap.

    Parameters
    ----------
    out : Location
        The place.
    tell : callable
        Told a line for each scenario, or quantity of one, that has no indices, and why.

    Returns
    -------
    DataFrame
        A row for each scenario, quantity, parameter and index: ``index`` with its 95 % confidence interval
        ``lower`` to ``upper``, ``noise``, and the runs used and planned.

    Raises
    ------
    FileNotFoundError
        If the place holds no store.
    ImportError
        If SALib is not installed.

    References
    ----------
    Pianosi & Wagener 2018, Distribution-based sensitivity analysis from a generic input-output sample,
    https://doi.org/10.1016/j.envsoft.2018.07.019
    """
    tables = []
    for path in store_paths(out):
        with open_store(path) as store:
            tables.append(table_of(store, tell))
    return pd.concat(tables, ignore_index=True)


def table_of(store: xr.Dataset, tell: Callable[[str], None]) -> pd.DataFrame:
    """Table the indices of one scenario, as ``sensitivity_indices`` does of all."""
    from SALib.analyze import pawn, sobol

    return pd.DataFrame(_rows(store, tell, pawn.analyze, sobol.analyze))


def _rows(
    store: xr.Dataset, tell: Callable[[str], None], pawn: Any, sobol: Any
) -> Iterator[dict[str, object]]:
    """Rows of one scenario."""
    title = str(store.attrs["title"])
    settings = stored(store.attrs)
    given = parameters(store, settings.varied)
    if all(len(np.unique(values)) == 1 for values in given.values()):
        tell(f"{title}: no parameter is varied")
        return
    inputs = {name: _numbers(values) for name, values in given.items()}
    positional = settings.sample is not None and settings.sample.design == "saltelli"
    for line in _left_out(store):
        tell(f"{title}: {line}")
    for quantity, values in quantities(store):
        _log.info("%s: %s", title, quantity)
        known = np.isfinite(values)
        row = {**behind(store), "quantity": quantity, "runs_used": int(known.sum())}
        if known.sum() < LEAST_RUNS:
            tell(f"{title}: {quantity}: no indices from {known.sum()} runs, at least {LEAST_RUNS} are needed")
            continue
        if np.ptp(values[known]) == 0:
            tell(f"{title}: {quantity}: the same in all runs")
            continue
        for name, found in _pawn(pawn, {k: given[known] for k, given in inputs.items()}, values[known]):
            yield {**row, "parameter": name, "method": "pawn", **found}
        if not positional:
            continue
        if settings.sweep or not known.all():
            why = (
                "the sample is swept"
                if settings.sweep
                else f"{(~known).sum()} of {len(known)} runs are missing"
            )
            tell(f"{title}: {quantity}: no Sobol indices: {why}, and the design holds only as a whole")
            continue
        problem = {"num_vars": len(inputs), "names": [*inputs], "bounds": [[0, 1]] * len(inputs)}
        indices = sobol(problem, values, calc_second_order=False, seed=SEED)
        for i, name in enumerate(inputs):
            for method, key in (("sobol first", "S1"), ("sobol total", "ST")):
                index, half = float(indices[key][i]), float(indices[f"{key}_conf"][i])
                found = {"index": index, "lower": index - half, "upper": index + half}
                yield {**row, "parameter": name, "method": method, **found}


def parameters(store: xr.Dataset, keys: Sequence[str]) -> dict[str, NDArray[Any]]:
    """Values of all parameters of a scenario by name, each of shape (runs,), in the order of its design.

    A store may list them in any order; ``keys`` are in that of the design. One that has the same value in all
    runs is there too, as it has its place in the design.
    """
    held = {
        str(c.attrs["key"]): (str(name), c.to_numpy()) for name, c in store.coords.items() if "key" in c.attrs
    }
    order = {key: place for place, key in enumerate(keys)}
    return dict(held[key] for key in sorted(held, key=lambda key: (order.get(key, len(order)), key)))


def varied(store: xr.Dataset) -> dict[str, NDArray[Any]]:
    """Values of the parameters that differ between runs, in the order of the design."""
    held = parameters(store, stored(store.attrs).varied)
    return {name: values for name, values in held.items() if len(np.unique(values)) > 1}


def _left_out(store: xr.Dataset) -> Iterator[str]:
    """Say what of the runs has no part in the indices."""
    found, weight = counts(store), weights(store)
    missing = found.failed + found.pending
    if missing:
        yield f"{missing} of {found.planned} runs failed or are pending: indices are of the others"
    if np.ptp(weight) > 0:
        yield "weights and return periods have no part in the indices: all runs count equally"
    open_ended = int(censored(store).sum())
    if open_ended:
        yield (
            f"{open_ended} of {found.planned} runs left the domain or still moved at time.end: "
            "indices are of how far they were computed"
        )


def quantities(store: xr.Dataset) -> Iterator[tuple[str, Array]]:
    """Go through what is looked at, with its values, shape (runs,), NaN where not known."""
    known = computed(store).to_numpy()
    for name in QUANTITIES:
        yield name, np.where(known, store[name].to_numpy().astype(np.float64), np.nan)
    for receptor, rows in reached(store).groupby("receptor", sort=False):
        for name in ("max_depth", "max_pressure"):
            yield f"{name} at {receptor}", rows[name].to_numpy(np.float64)


def _numbers(values: NDArray[Any]) -> Array:
    """Numbers in place of words, by their rank."""
    if values.dtype.kind in "fiu":
        return values.astype(np.float64)
    return np.unique(values.astype(str), return_inverse=True)[1].astype(np.float64)


def _pawn(analyze: Any, inputs: Mapping[str, Array], values: Array) -> Iterator[tuple[str, dict[str, float]]]:
    """PAWN's index by parameter; resampled runs give its confidence interval, shuffled ones its noise."""
    rng = np.random.default_rng(SEED)
    again = [rng.integers(len(values), size=len(values)) for _ in range(RESAMPLES)]
    shuffled = [rng.permutation(values) for _ in range(RESAMPLES)]
    for name, given in inputs.items():
        # slices are taken by quantiles, which only distinct values fill evenly
        distinct = len(np.unique(given))
        if distinct == 1:
            yield name, dict.fromkeys(("index", "lower", "upper", "noise"), 0.0)
            continue
        slices = min(int(np.clip(len(values) // RUNS_A_SLICE, 2, MOST_SLICES)), distinct)
        problem = {"num_vars": 1, "names": [name], "bounds": [[0, len(values)]]}

        def index(of: Array, rows: NDArray[np.intp] | slice = slice(None)) -> float:
            ranks = np.argsort(np.argsort(given[rows], kind="stable"))  # noqa: B023
            # where all distances are zero their coefficient of variation, which nobody asks for, is 0/0
            with np.errstate(invalid="ignore"):
                found = analyze(problem, ranks[:, None], of[rows], S=slices, seed=SEED)  # noqa: B023
            return float(found["median"][0])

        best = index(values)
        half = NORMAL * float(np.std([index(values, rows) for rows in again], ddof=1))
        idle = [index(other) for other in shuffled]
        noise = float(np.mean(idle) + NORMAL_ONE_SIDED * np.std(idle, ddof=1))
        yield name, {"index": best, "lower": best - half, "upper": best + half, "noise": noise}
