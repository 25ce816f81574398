"""What reaches receptors in one scenario beside another: a row a receptor and quantity, with bounds."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence

import numpy as np
import pandas as pd
import xarray as xr
from numpy.typing import NDArray

from pipeline.assess.ensemble import NotTogetherError, censored, counts, events_per_year, weights
from pipeline.assess.probability import Bounded, Values
from pipeline.assess.receptors import reached
from pipeline.scenario.scenario import stored

Array = NDArray[np.float64]
# with its units
Number = tuple[str, Bounded]
# what a receptor that is not reached has none of
QUANTITIES = {"max_depth": "m", "max_speed": "m s-1", "max_pressure": "kPa"}
MEDIAN, LARGEST, LOWEST = ("median", 0.5), ("largest", 1.0), ("lowest", 0.0)
# there on erodible beds: units, the worst, and whether what was not seen may lower it
ERODED = {"erosion_depth": ("m", LARGEST, False), "bed_change": ("m", LOWEST, True)}


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
        do not reach it; where both have erodible beds, the median and the largest depth of erosion, and the
        median and the lowest change of the ground. Columns ``first``, ``second`` and ``difference`` (second
        less first), each with ``_lower`` and ``_upper``, which hold whatever runs are missing; how many runs
        are behind them. Empty where neither has receptors.

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
    if any(places) and not shared:
        titles = [str(store.attrs["title"]) for store in (first, second)]
        raise NotTogetherError(f"{titles[0]} and {titles[1]} have no receptor in common")
    return differences_at("receptor", shared, (first, second), reached, _quantities)


def differences_at(
    column: str,
    names: Iterable[str],
    stores: Sequence[xr.Dataset],
    table: Callable[[xr.Dataset], pd.DataFrame],
    numbers: Callable[[xr.Dataset, pd.DataFrame], Iterator[tuple[str, Number]]],
) -> pd.DataFrame:
    """Table how numbers differ at places that two scenarios share.

    Parameters
    ----------
    column : str
        That names the places.
    names : iterable of str
        Of the places.
    stores : sequence of Dataset
        Stores of the first and of the second scenario.
    table : callable
        Gives a row a run and place of a store.
    numbers : callable
        Gives numbers by quantity, with their units, of a store and its rows of one place.
    """
    by_run = [table(store) for store in stores]
    rows: list[dict[str, object]] = []
    for name in names:
        found = [
            dict(numbers(store, each[each[column] == name]))
            for store, each in zip(stores, by_run, strict=True)
        ]
        rows += _rows({column: name}, stores, found)
    return pd.DataFrame(rows)


def _rows(
    place: Mapping[str, str], stores: Sequence[xr.Dataset], found: Sequence[Mapping[str, Number]]
) -> Iterator[dict[str, object]]:
    """Give a row for each quantity of a place that two scenarios have.

    Parameters
    ----------
    place : mapping
        Its columns.
    stores : sequence of Dataset
        Stores of the first and of the second scenario.
    found : sequence of mapping
        Numbers of each by quantity, with their units.
    """
    runs = {
        f"runs_{what}_{end}": getattr(counts(store), what)
        for end, store in zip(("first", "second"), stores, strict=True)
        for what in ("planned", "done", "failed", "pending", "overrun", "cut_off")
    }
    titles = {
        f"{end}_scenario": str(s.attrs["title"]) for end, s in zip(("first", "second"), stores, strict=True)
    }
    one, other = found
    for quantity in one:
        if quantity in other:
            (units, before), (_, after) = one[quantity], other[quantity]
            row: dict[str, object] = {**place, "quantity": quantity, "units": units}
            numbers = {"first": before, "second": after, "difference": difference(before, after)}
            for end, number in numbers.items():
                row |= _ends(end, number)
            yield {**row, **titles, **runs}


def difference(before: Bounded, after: Bounded) -> Bounded:
    """Give the difference of two numbers that are each known to lie between bounds."""
    # of two that never come there is none
    with np.errstate(invalid="ignore"):
        return Bounded(
            after.lower - before.upper, after.estimate - before.estimate, after.upper - before.lower
        )


def chances(store: xr.Dataset, arrives: Array) -> Iterator[tuple[str, Number]]:
    """Give the probability that something arrives, and its annual rate where there are return periods.

    Parameters
    ----------
    store : Dataset
        A scenario's store.
    arrives : (runs,) array
        1 where it does and 0 where it does not, missing of a run that is not known.
    """
    weight = weights(store)
    nothing = np.zeros(len(weight), bool)
    probability = Values(arrives, weight, censored(store).to_numpy(), nothing).exceedance(0.5)
    yield "probability", ("1", probability)
    frequency = events_per_year(store)
    if frequency is not None:
        ends = (probability.lower, probability.estimate, probability.upper)
        yield "annual_rate", ("year-1", Bounded(*(end * frequency for end in ends)))


def _quantities(store: xr.Dataset, rows: pd.DataFrame) -> Iterator[tuple[str, Number]]:
    """Give the numbers of a receptor by name, each with its units."""
    weight, open_ended = weights(store), censored(store).to_numpy()
    nothing = np.zeros(len(weight), bool)
    arrives = rows["reached"].to_numpy(np.float64, na_value=np.nan)
    yield from chances(store, arrives)
    for name, units in QUANTITIES.items():
        values = np.where(arrives == 0, 0.0, rows[name].to_numpy(np.float64, na_value=np.nan))
        held = Values(values, weight, open_ended, nothing)
        for word, level in (MEDIAN, LARGEST):
            yield f"{word}_{name.removeprefix('max_')}", (units, quantile(held, level))
    for name, (units, worst, may_be_less) in ERODED.items():
        if name in rows:
            # what has gone farther may have filled what was seen to be eroded
            held = Values(rows[name].to_numpy(np.float64), weight, open_ended, open_ended & may_be_less)
            for word, level in (MEDIAN, worst):
                yield f"{word}_{name}", (units, quantile(held, level))


def quantile(held: Values, level: float, as_computed: Array | None = None) -> Bounded:
    """Give a quantile of the runs that are known, with the bounds of all planned ones.

    `Values.quantile` has no estimate where a bound is infinite.

    Parameters
    ----------
    held : Values
        The quantity.
    level : float
        Share of the runs that keep to the value.
    as_computed : (runs,) array, optional
        What the estimate is of, where that differs from the bounds.
    """
    value = held.value if as_computed is None else as_computed
    known = np.flatnonzero(~np.isnan(value))
    nothing = np.zeros(known.size, bool)
    bounds = held.quantile(level)
    some = Values(value[known], held.weight[known], nothing, nothing)
    estimate = some.quantile(level).estimate if known.size else np.array(np.nan)
    return Bounded(bounds.lower, estimate, bounds.upper)


def _ends(name: str, number: Bounded) -> dict[str, float]:
    """Columns of a number with its bounds; a bound that no run gives is missing."""
    found = {f"{name}{end}": float(value) for end, value in number.by_bound.items()}
    return {key: value if np.isfinite(value) else np.nan for key, value in found.items()}
