"""What reaches receptors in one scenario beside another: a row a receptor and quantity, with bounds."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np
import pandas as pd
import xarray as xr

from pipeline.assess.ensemble import NotTogetherError, censored, counts, events_per_year, weights
from pipeline.assess.probability import Bounded, Values
from pipeline.assess.receptors import reached
from pipeline.scenario.scenario import stored

# what a receptor that is not reached has none of
QUANTITIES = {"max_depth": "m", "max_speed": "m s-1", "max_pressure": "kPa"}
STATISTICS = {"median": 0.5, "largest": 1.0}


def receptor_differences(first: xr.Dataset, second: xr.Dataset) -> pd.DataFrame:
    """Table what reaches the receptors that two scenarios share, and by how much it differs.

    Parameters
    ----------
    first, second : Dataset
        Their stores.

    Returns
    -------
    DataFrame
        A row a receptor and quantity: the probability that it is reached, its annual rate where there are
        return periods, and the median and the largest depth, speed and pressure of all runs, 0 of those that
        do not reach it. Columns ``first``, ``second`` and ``difference`` (second less first), each with
        ``_lower`` and ``_upper``, which hold whatever runs are missing; how many runs are behind them. Empty
        where neither has receptors.

    Raises
    ------
    NotTogetherError
        If they have receptors and none of them in common.
    ValueError
        If a store lacks a field that receptors need.
    """
    places = [
        {each.name: each.model_dump() for each in stored(store.attrs).places} for store in (first, second)
    ]
    shared = [name for name, place in places[0].items() if places[1].get(name) == place]
    titles = [str(store.attrs["title"]) for store in (first, second)]
    if any(places) and not shared:
        raise NotTogetherError(f"{titles[0]} and {titles[1]} have no receptor in common")
    by_run = [reached(store) for store in (first, second)]
    runs = {
        f"runs_{what}_{end}": getattr(counts(store), what)
        for end, store in (("first", first), ("second", second))
        for what in ("planned", "done", "failed", "pending", "overrun", "cut_off")
    }
    rows = []
    for name in shared:
        found = [
            dict(_quantities(store, table[table["receptor"] == name]))
            for store, table in zip((first, second), by_run, strict=True)
        ]
        for quantity in found[0]:
            (units, before), (_, after) = found[0][quantity], found[1][quantity]
            row: dict[str, object] = {"receptor": name, "quantity": quantity, "units": units}
            numbers = {"first": before, "second": after, "difference": difference(before, after)}
            for end, number in numbers.items():
                row |= _ends(end, number)
            rows.append({**row, "first_scenario": titles[0], "second_scenario": titles[1], **runs})
    return pd.DataFrame(rows)


def difference(before: Bounded, after: Bounded) -> Bounded:
    """Give the difference of two numbers that are each known to lie between bounds."""
    return Bounded(after.lower - before.upper, after.estimate - before.estimate, after.upper - before.lower)


def _quantities(store: xr.Dataset, rows: pd.DataFrame) -> Iterator[tuple[str, tuple[str, Bounded]]]:
    """Give the numbers of a receptor by name, each with its units."""
    weight, open_ended = weights(store), censored(store).to_numpy()
    nothing = np.zeros(len(weight), bool)
    arrives = rows["reached"].to_numpy(np.float64, na_value=np.nan)
    probability = Values(arrives, weight, open_ended, nothing).exceedance(0.5)
    yield "probability", ("1", probability)
    frequency = events_per_year(store)
    if frequency is not None:
        ends = (probability.lower, probability.estimate, probability.upper)
        yield "annual_rate", ("year-1", Bounded(*(end * frequency for end in ends)))
    for name, units in QUANTITIES.items():
        values = np.where(arrives == 0, 0.0, rows[name].to_numpy(np.float64, na_value=np.nan))
        known = np.flatnonzero(np.isfinite(values))
        computed = Values(values[known], weight[known], nothing[known], nothing[known])
        for word, level in STATISTICS.items():
            bounds = Values(values, weight, open_ended, nothing).quantile(level)
            estimate = computed.quantile(level).estimate if known.size else np.array(np.nan)
            number = Bounded(bounds.lower, estimate, bounds.upper)
            yield f"{word}_{name.removeprefix('max_')}", (units, number)


def _ends(name: str, number: Bounded) -> dict[str, float]:
    """Columns of a number with its bounds; a bound that no run gives is missing."""
    found = {f"{name}{end}": float(value) for end, value in number.by_bound.items()}
    return {key: value if np.isfinite(value) else np.nan for key, value in found.items()}
