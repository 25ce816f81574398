"""Tables for an assessment: what scenarios come down to, and what reaches their receptors."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from math import prod
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd
import xarray as xr
from numpy.typing import NDArray

from pipeline.assess import spacing
from pipeline.assess.ensemble import (
    Period,
    censored,
    computed,
    counts,
    events_per_year,
    periods,
    weights,
)
from pipeline.assess.frames import mean_spacing, on_surface, space, threshold_of
from pipeline.assess.probability import Bounded, Values, in_words
from pipeline.assess.receptors import reached
from pipeline.assess.sections import passed
from pipeline.scenario.scenario import stored
from pipeline.store import run_table, zarr_store
from pipeline.store.place import LEVEL, store_path, store_paths
from pipeline.store.storage import Location, is_made
from pipeline.store.variables import SERIES, STATUS, Status
from pipeline.store.zarr_store import open_store

# how far a run came: of one that may have gone farther, the least
REACH = ("runout_distance", "drop_height")
# of such a run, the most
AT_MOST = ("reach_angle", "lowest_elevation")
DEPOSIT = ("deposit_length", "deposit_width", "deposit_area", "deposit_volume", "deposit_max_depth")
EROSION = ("volume_entrained", "erosion_max_depth")
PEAKS = ("affected_area", "peak_depth", "peak_speed")
QUANTITIES = (*REACH, *AT_MOST, *DEPOSIT, *EROSION, *PEAKS, "lifted_share", "rest_time")
# what has a meaning on profiles alone, or on elevation models alone
ON_PROFILE, ON_SURFACE = ("deposit_length", "deposit_width"), ("lowest_elevation", "lifted_share")
# at receptors, with what the most severe is called and the share of the runs that keep to it
AT_RECEPTORS = {
    "max_depth": ("largest", 1.0),
    "max_speed": ("largest", 1.0),
    "max_pressure": ("largest", 1.0),
    "arrival_time": ("first", 0.0),
    "erosion_depth": ("largest", 1.0),
    "bed_change": ("lowest", 0.0),
}
SHARES = (0.05, 0.5, 0.95)
NAMES = tuple(f"q{100 * share:02.0f}" for share in SHARES)
DISTANCES = 41
# crowns that differ by less are one
CLOSE = 1e-6
# of the columns that say how many runs are behind a number
LAST_COUNT = "runs_cut_off"
Array = NDArray[np.float64]


def assess(out: Location) -> dict[str, pd.DataFrame]:
    """Make the tables of a place.

    Parameters
    ----------
    out : Location
        The place.

    Returns
    -------
    dict of str to DataFrame
        ``runs``, a row a run; ``scenarios``, quantiles of each quantity; ``runout-exceedance``, the
        probability that the run-out is longer than a distance; ``receptors``, a row a receptor;
        ``receptor-periods``, a row a receptor and return period; ``receptor-runs``, a row a receptor and run;
        ``sections``, a row a run and section.
        Numbers over runs have bounds and the runs behind them, and with levels what changes on the closest
        spacing; runs that were chosen beside a sample are in
        ``runs``, with a weight of 0, and in no number.

    Raises
    ------
    FileNotFoundError
        If the place holds no store.
    ValueError
        If a store lacks a field that its receptors need.
    """
    paths = store_paths(out)
    stores = [open_store(path) for path in paths]
    closest = [finest(path, store) for path, store in zip(paths, stores, strict=True)]
    try:
        by_run = [reached(store) for store in stores]
        found = {
            "runs": run_table.read(out),
            "scenarios": pd.DataFrame(
                row for store, fine in zip(stores, closest, strict=True) for row in quantiles(store, fine)
            ),
            "runout-exceedance": pd.DataFrame(
                row
                for store, fine in zip(stores, closest, strict=True)
                for row in runout_exceedance(store, fine)
            ),
            "receptors": pd.DataFrame(
                row
                for store, rows, fine in zip(stores, by_run, closest, strict=True)
                for row in receptors(store, rows, fine)
            ),
            "receptor-periods": pd.DataFrame(
                row
                for store, rows, fine in zip(stores, by_run, closest, strict=True)
                for row in receptors_by_period(store, rows, fine)
            ),
            "receptor-runs": pd.concat(by_run, ignore_index=True),
            "sections": pd.concat([passed(store) for store in stores], ignore_index=True),
        }
    finally:
        for store in (*stores, *filter(None, closest)):
            store.close()
    chosen = {path.stem: zarr_store.chosen(path) for path in paths}
    for rows in found.values():
        if any(chosen.values()) and LAST_COUNT in rows.columns:
            at = list(rows.columns).index(LAST_COUNT) + 1
            rows.insert(at, "runs_chosen_left_out", rows["scenario"].map(chosen))
    return {name: rows for name, rows in found.items() if len(rows)}


def values(store: xr.Dataset, name: str) -> Values:
    """Give a quantity of every run of a store with its weight; that of runs not computed is not known.

    Of a censored run reach and peaks are at least what they were found to be, the reach angle at most; a run
    that was cut off while it moved says nothing of its deposit.
    """
    held = np.where(computed(store), store[name].to_numpy(), np.nan).astype(np.float64)
    states = [Status(state) for state in store[STATUS.name].to_numpy()]
    open_ended = censored(store).to_numpy()
    if name in DEPOSIT:
        held[[state.is_cut_off for state in states]] = np.nan
    elif name in (*REACH, *AT_MOST):
        held = _farthest(store, name, held)
    elif name == "rest_time":
        # films creep on in a run that counts as done
        moves = computed(store).to_numpy() & np.isnan(held)
        held, open_ended = np.where(moves, store["last_time"].to_numpy(), held), open_ended | moves
    if name in REACH:
        # a run that ends without a deposit reaches nothing
        nothing = np.isnan(held) & np.array([state is Status.DONE for state in states])
        held = np.where(nothing, -np.inf, held)
    return Values(held, weights(store), open_ended & (name not in AT_MOST), open_ended & (name in AT_MOST))


def creeping(store: xr.Dataset) -> NDArray[np.bool_]:
    """Say of each run whether it is done though not all of it was at rest at its end, shape (runs,)."""
    states = [Status(state) for state in store[STATUS.name].to_numpy()]
    ended = computed(store).to_numpy() & ~np.array([state.is_cut_off for state in states], bool)
    return np.asarray(ended & np.isnan(store["rest_time"].to_numpy()))


def _farthest(store: xr.Dataset, name: str, held: Array) -> Array:
    """Reach of runs, (runs,), where that of an overrun run holds the lower side that its flow left through.

    The crown is taken from the runs that have a deposit; where they differ, only a run's own will do.
    """
    overrun = np.flatnonzero([Status(state).is_overrun for state in store[STATUS.name].to_numpy()])
    needed = {"max_depth", "elevation", "horizontal_distance", "front_x"}
    if not overrun.size or not needed <= set(store.variables) or "run" in store["elevation"].dims:
        return held
    x = store["x"].to_numpy()
    places = [store[at].to_numpy() for at in ("horizontal_distance", "elevation")]
    if places[1][x.argmax()] >= places[1][x.argmin()]:
        return held
    deepest = store["max_depth"].isel(run=overrun)
    width = mean_spacing(store) if "point" in store.dims else 0.0
    at_side = store["x"] >= float(x.max()) - width
    passed = (deepest.where(at_side) > (threshold_of(store) or 0.0)).any(space(store)).to_numpy()
    crowns = _crowns(store, x, places)
    if crowns is None:
        return held
    side = [_at_outer_side(x, place, lattice="point" not in store.dims) for place in places]
    runout, drop = side[0] - crowns[0][overrun], crowns[1][overrun] - side[1]
    beyond = {
        "runout_distance": runout,
        "drop_height": drop,
        "reach_angle": np.degrees(np.arctan2(drop, runout)),
    }[name]
    farther = np.fmin if name in AT_MOST else np.fmax
    found = held.copy()
    found[overrun] = np.where(passed, farther(held[overrun], beyond), held[overrun])
    return found


def _at_outer_side(x: Array, place: Array, *, lattice: bool) -> float:
    """Place of the lower side, m: cells of a lattice reach half a spacing beyond the last point."""
    first = np.unique(x, return_index=True)[1]
    last, before = place[first[-1]], place[first[-2]]
    return float(last + (last - before) / 2) if lattice else float(last)


def _crowns(store: xr.Dataset, x: Array, places: list[Array]) -> tuple[Array, Array] | None:
    """Horizontal distance and elevation of the crowns of all runs, (runs,), m, by their toes and reaches."""
    order = np.argsort(x, kind="stable")
    found = []
    for place, name, sign in zip(places, REACH, (-1, 1), strict=True):
        toe = np.interp(store["front_x"].to_numpy(), x[order], place[order])
        crown = toe + sign * store[name].to_numpy()
        known = crown[np.isfinite(crown)]
        if not known.size:
            return None
        same = np.ptp(known) <= CLOSE * max(1.0, float(np.abs(known).max()))
        found.append(np.where(np.isnan(crown), known[0] if same else np.nan, crown))
    return found[0], found[1]


def behind(store: xr.Dataset) -> dict[str, object]:
    """Say how many runs are behind the numbers of a scenario, as maps do."""
    return {"scenario": str(store.attrs["title"]), **counts(store).attributes}


def tabled(store: xr.Dataset) -> list[str]:
    """List the quantities that have a meaning for the runs of a store."""
    left_out: tuple[str, ...] = ON_PROFILE if on_surface(store) else ON_SURFACE
    left_out += () if SERIES[0].name in store.variables else EROSION
    return [each for each in QUANTITIES if each not in left_out]


def quantiles(store: xr.Dataset, fine: xr.Dataset | None = None) -> Iterator[dict[str, object]]:
    """Table quantiles of each quantity, a row each; with a finer level how much a run changes on it."""
    for name in tabled(store):
        found = values(store, name).quantile(SHARES)
        words = map(in_words, found.lower.tolist(), found.estimate.tolist(), found.upper.tolist())
        yield {
            **behind(store),
            "quantity": name,
            "units": str(store[name].attrs.get("units", "")),
            **_columns(found, NAMES),
            **{f"{name}_in_words": text for name, text in zip(NAMES, words, strict=True)},
            **_change(store, fine, name),
        }


def finest(path: Location, store: xr.Dataset) -> xr.Dataset | None:
    """Open the finest level of a scenario; None where it has one level."""
    sample = stored(store.attrs).sample
    if sample is None or not sample.levels:
        return None
    finer = store_path(path.parent, f"{path.stem}{LEVEL}{sample.levels[-1].name}")
    return open_store(finer) if is_made(finer) else None


def _pairs(store: xr.Dataset, fine: xr.Dataset) -> tuple[NDArray[np.intp], NDArray[np.intp]]:
    sweep = stored(store.attrs).sweep
    return spacing.paired(store, fine, prod(map(len, sweep.values())))


def _change(store: xr.Dataset, fine: xr.Dataset | None, name: str) -> dict[str, float]:
    if fine is None:
        return {}
    pairs = _pairs(store, fine)
    one, other = (values(each, name).value[rows] for each, rows in zip((store, fine), pairs, strict=True))
    return {"discretisation": spacing.typical_change(one, other, weights(store)[pairs[0]])}


def runout_exceedance(store: xr.Dataset, fine: xr.Dataset | None = None) -> Iterator[dict[str, object]]:
    """Table the probability that the run-out is longer than each of a row of distances."""
    runout = values(store, "runout_distance")
    finite = runout.value[np.isfinite(runout.value)]
    if not finite.size:
        return
    distances = np.linspace(0, finite.max(), DISTANCES)
    found = runout.exceedance(distances)
    for i, distance in enumerate(distances):
        one = Bounded(*(getattr(found, end)[i] for end in ("lower", "estimate", "upper")))
        row = {**behind(store), "runout_distance": distance, **_columns(one, ["probability"])}
        if fine is not None:
            pairs = _pairs(store, fine)
            before, after = (
                values(each, "runout_distance").value[rows] > distance
                for each, rows in zip((store, fine), pairs, strict=True)
            )
            row["probability_discretisation"] = spacing.flips(before, after, weights(store)[pairs[0]])
        yield row


def receptors(
    store: xr.Dataset, by_run: pd.DataFrame, fine: xr.Dataset | None = None
) -> Iterator[dict[str, object]]:
    """Table how likely each receptor is reached, and quantiles of what reaches it where it is.

    With return periods the probability is of an event at least as rare as the most frequent one, and
    ``annual_rate`` says how often a year that is.
    """
    frequency = events_per_year(store)
    finer = {} if fine is None else dict(iter(reached(fine).groupby("receptor", sort=False)))
    for name, rows in by_run.groupby("receptor", sort=False):
        row = {**behind(store), "receptor": str(name), **_at_receptor(store, rows)}
        if fine is not None:
            row |= _changes(rows, finer[name], _pairs(store, fine), weights(store))
        if frequency is not None:
            row |= {
                f"annual_rate{end}": row[f"probability{end}"] * frequency for end in ("", "_lower", "_upper")
            }
        yield row


def _changes(
    rows: pd.DataFrame, finer: pd.DataFrame, pairs: tuple[NDArray[np.intp], ...], weight: Array
) -> dict[str, float]:
    """Columns of what changes at a receptor from a level to a finer one, over paired runs by their weight.

    What does not arrive has no depth, speed or pressure there; times are of the runs that arrive on both.
    """
    both = [each.iloc[at] for each, at in zip((rows, finer), pairs, strict=True)]
    before, after = (each["reached"].to_numpy(np.float64, na_value=np.nan) == 1 for each in both)
    by_pair = weight[pairs[0]]
    found = {"probability_discretisation": spacing.flips(before, after, by_pair)}
    for quantity in (name for name in AT_RECEPTORS if all(name in each for each in both)):
        nothing = np.nan if quantity == "arrival_time" else 0.0
        one, other = (
            np.where(there, each[quantity].to_numpy(np.float64, na_value=np.nan), nothing)
            for each, there in zip(both, (before, after), strict=True)
        )
        found[f"{quantity}_discretisation"] = spacing.typical_change(one, other, by_pair)
    return found


def receptors_by_period(
    store: xr.Dataset, by_run: pd.DataFrame, fine: xr.Dataset | None = None
) -> Iterator[dict[str, object]]:
    """Table the same of the events of each return period; none without return periods."""
    groups = periods(store, stored(store.attrs).hazard.levels.return_periods)
    finer = {} if fine is None or not groups else dict(iter(reached(fine).groupby("receptor", sort=False)))
    for name, rows in by_run.groupby("receptor", sort=False) if groups else ():
        for period in groups:
            some = store.isel(run=period.runs)
            changes = {}
            if fine is not None:
                pairs = _pairs(store, fine)
                of_period = np.isin(pairs[0], period.runs)
                by_run_of_period = np.zeros(store.sizes["run"])
                by_run_of_period[period.runs] = period.weight
                changes = _changes(
                    rows, finer[name], tuple(each[of_period] for each in pairs), by_run_of_period
                )
            yield {
                **behind(some),
                "receptor": str(name),
                "shortest_return_period": period.shortest,
                "return_period": period.longest,
                **_at_receptor(some, rows.iloc[period.runs], period),
                **changes,
            }


def _at_receptor(store: xr.Dataset, rows: pd.DataFrame, period: Period | None = None) -> dict[str, Any]:
    """Columns of what reaches a receptor; a censored run may have had more of it arrive."""
    weight = weights(store) if period is None else period.weight
    open_ended, nothing = censored(store).to_numpy(), np.zeros(store.sizes["run"], bool)
    arrives = rows["reached"].to_numpy(np.float64, na_value=np.nan)
    row: dict[str, Any] = _columns(
        Values(arrives, weight, open_ended, nothing).exceedance(0.5), ["probability"]
    )
    for quantity, (word, last) in AT_RECEPTORS.items():
        if quantity not in rows:
            continue
        there = np.flatnonzero(arrives == 1)
        of_runs = Values(rows[quantity].to_numpy(np.float64)[there], weight[there], *(nothing[there],) * 2)
        # the median, and the most severe of all
        middle, worst = of_runs.quantile([0.5, last]).estimate if there.size else (np.nan, np.nan)
        name_of_worst = f"{word}_{quantity.removeprefix('max_')}"
        row |= {f"median_{quantity}": middle, name_of_worst: worst}
    return row


def _columns(found: Bounded, names: Sequence[str]) -> dict[str, float]:
    """Columns of numbers with their bounds."""
    columns = {}
    for i, name in enumerate(names):
        for ending, part in found.by_bound.items():
            value = float(np.atleast_1d(part)[i])
            # a bound that no run gives is missing
            columns[name + ending] = value if np.isfinite(value) else np.nan
    return columns


def write(tables: dict[str, pd.DataFrame], to: Path, kinds: Sequence[str]) -> list[Path]:
    """Write tables to a folder, each in every kind asked for: ``csv``, ``parquet``, ``md``.

    Raises
    ------
    OSError
        If one cannot be written.
    ImportError
        If Parquet is asked for without pyarrow.
    """
    to.mkdir(parents=True, exist_ok=True)
    paths = [to / f"{name}.{kind}" for name in tables for kind in kinds]
    for path in paths:
        run_table.write(tables[path.stem], path)
    return paths
