"""Runs that are looked at together: those of one store, or of several, each with its weight."""

from __future__ import annotations

from collections import Counter
from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np
import xarray as xr
from numpy.typing import NDArray

from pipeline.assess.frames import DENSITY, densities, mean_spacing, on_surface, space
from pipeline.assess.gridding import gridded
from pipeline.store.variables import CHOSEN_FOR, COMPUTED, RETURN_PERIOD, STATUS, WEIGHT, Status

MAXIMA = ("max_depth", "max_speed", "max_momentum_flux", "arrival_time", "erosion_depth", "bed_change")
PLACES = ("x", "y", "elevation", "horizontal_distance", "building")
# runs whose values, and whose comparisons with thresholds, are held at once
RUNS_AT_ONCE = 16
VALUES_AT_ONCE = 4_000_000
# return periods that are looked at one by one
MOST_PERIODS = 12


class NotTogetherError(ValueError):
    """Scenarios cannot be laid over each other; ``str()`` says why."""


@dataclass(frozen=True)
class Counts:
    """How many of the runs that were planned are in which state.

    Parameters
    ----------
    done : int
        Came to their end, overrun ones included.
    overrun : int
        Lost material through an open side.
    failed, pending : int
        Have no values.
    cut_off : int
        Still moved at their end, and are not done; some may be overrun too.
    """

    done: int
    overrun: int
    failed: int
    pending: int
    cut_off: int = 0

    @property
    def planned(self) -> int:
        """All of them."""
        return self.done + self.cut_off + self.failed + self.pending

    @property
    def computed(self) -> int:
        """Those that have values."""
        return self.done + self.cut_off

    @property
    def attributes(self) -> dict[str, int]:
        """As attributes of a file, and as columns of a table."""
        return {f"runs_{name}": getattr(self, name) for name in ("planned", *self.__dataclass_fields__)}

    def __str__(self) -> str:
        """``97 of 100 runs done (2 of them overrun, 3 failed)``: the words every map has."""
        words = {
            # some of them may be among those cut off
            "overrun" if self.cut_off else "of them overrun": self.overrun,
            "still moving at time.end": self.cut_off,
            "failed": self.failed,
            "pending": self.pending,
        }
        rest = ", ".join(f"{n} {word}" for word, n in words.items() if n)
        note = f" ({rest})" if rest else ""
        return f"{self.done} of {self.planned} run{'s' * (self.planned != 1)} done{note}"


def counts(runs: xr.Dataset) -> Counts:
    """Count the runs by what became of them."""
    found = Counter(map(Status, runs[STATUS.name].to_numpy().tolist()))
    return Counts(
        done=found[Status.DONE] + found[Status.OVERRUN],
        overrun=sum(n for state, n in found.items() if state.is_overrun),
        failed=found[Status.FAILED],
        pending=found[Status.PENDING],
        cut_off=sum(n for state, n in found.items() if state.is_cut_off),
    )


def whose(runs: xr.Dataset) -> str:
    """Say what shares are of: with return periods runs are weighed by the events that they stand for."""
    return "events" if RETURN_PERIOD.name in runs.variables else "runs"


def computed(runs: xr.Dataset) -> xr.DataArray:
    """Whether each run has its values, over ``run``."""
    return _in_state(runs, COMPUTED)


def censored(runs: xr.Dataset) -> xr.DataArray:
    """Whether each run may have gone farther than it was computed, over ``run``: overrun or cut off."""
    return _in_state(runs, [state for state in Status if state.is_overrun or state.is_cut_off])


def _in_state(runs: xr.Dataset, states: Sequence[Status]) -> xr.DataArray:
    found: xr.DataArray = runs[STATUS.name].isin(states)
    # what a run is called by is no part of the answer
    return found.drop_vars(list(found.coords))


def weights(store: xr.Dataset) -> NDArray[np.float64]:
    """Give the share of each planned run of a store, (runs,), their sum 1; all have the same without weights.

    Chosen runs are no part of a sample: theirs are 0.

    With return periods they are shares of the events at least as rare as the most frequent one: a run stands
    for all events that are rarer than it and not than the next one, beside the others of its period.

    Raises
    ------
    ValueError
        If the weights are none.
    """
    if CHOSEN_FOR in store.attrs:
        return np.zeros(store.sizes["run"])
    given = WEIGHT.name in store.variables
    weight = np.asarray(store[WEIGHT.name] if given else np.ones(store.sizes["run"]), np.float64)
    if not (np.isfinite(weight).all() and (weight >= 0).all() and weight.sum() > 0):
        raise ValueError(f"{store.attrs.get('title')}: expected weights of at least 0, not all of them 0")
    if RETURN_PERIOD.name in store.variables:
        weight = _by_rarity(weight, store[RETURN_PERIOD.name].to_numpy().astype(np.float64))
    share: NDArray[np.float64] = weight / weight.sum()
    return share


def events_per_year(runs: xr.Dataset) -> float | None:
    """Give how many events a year the probabilities are of; None without return periods."""
    if RETURN_PERIOD.name not in runs.variables:
        return None
    return float(1 / runs[RETURN_PERIOD.name].to_numpy()[weights(runs) > 0].min())


@dataclass(frozen=True)
class Period:
    """Runs of one return period, or of one class of them where they are many.

    Parameters
    ----------
    shortest, longest : float
        Years.
    runs : (n,) array
        Positions.
    weight : (n,) array
        Share of each among them, their sum is 1.
    """

    shortest: float
    longest: float
    runs: NDArray[np.intp]
    weight: NDArray[np.float64]

    @property
    def words(self) -> str:
        """``100 years``, or ``30 to 100 years``."""
        first = "" if self.shortest == self.longest else f"{self.shortest:g} to "
        return f"{first}{self.longest:g} years"


def periods(runs: xr.Dataset, edges: Sequence[float]) -> list[Period]:
    """Group the runs by their return periods, the most frequent ones first; none without return periods.

    Parameters
    ----------
    runs : Dataset
        An ensemble, or a store.
    edges : sequence of float
        Upper ends of the classes that periods are put into where there are more than `MOST_PERIODS` of them,
        years; what is rarer makes one more.
    """
    if RETURN_PERIOD.name not in runs.variables:
        return []
    weight, years = weights(runs), runs[RETURN_PERIOD.name].to_numpy()
    counted = weight > 0
    many = len(np.unique(years[counted])) > MOST_PERIODS
    group = np.searchsorted(np.asarray(edges), years) if many else years
    found = []
    for one in np.unique(group[counted]):
        at = np.flatnonzero(counted & (group == one))
        found.append(
            Period(float(years[at].min()), float(years[at].max()), at, weight[at] / weight[at].sum())
        )
    return found


def ensemble(store: xr.Dataset, spacing: float | None = None) -> xr.Dataset:
    """Take from a scenario's store what maps are made of.

    Parameters
    ----------
    store : Dataset
        A scenario's store; one that is not open with Dask is read by it, some runs at once.
    spacing : float, optional
        Of the lattice a cloud is brought to, m; by default its mean spacing.

    Returns
    -------
    Dataset
        Over ``run``, ``y`` and ``x``: the maxima, the arrival time and what was eroded, as far as they were
        kept, lazy; over ``run``:
        ``status``, ``weight``, which sums to 1 over the planned runs, ``flow_density``, kg m-3, and where the
        scenario gives it ``return_period``, years; the places of the points.

    Raises
    ------
    ValueError
        If the weights are none.
    """
    kept = [name for name in MAXIMA if name in store]
    runs = store[[*kept, STATUS.name]]
    if not any(runs[name].chunks for name in kept):
        runs = runs.chunk({"run": _at_once(store)})
    # a handful of numbers, looked at again and again
    runs[STATUS.name] = store[STATUS.name].load()
    if "point" in store.dims:
        ground = {name: store[name] for name in ("area", "elevation", "building") if name in store.variables}
        runs = gridded(runs.assign_coords(ground), spacing or mean_spacing(store))
    elif on_surface(store):
        runs = runs.assign_coords(elevation=store["elevation"])
    if on_surface(store) and "run" in runs["elevation"].dims:
        # one ground for maps of runs whose earthworks differ
        runs = runs.assign_coords(elevation=runs["elevation"].max("run", keep_attrs=True))
    places = [name for name in PLACES if name in runs.variables]
    runs = runs[[*kept, STATUS.name]].reset_coords()[[*kept, STATUS.name, *places]].set_coords(places)
    runs = runs.drop_vars("run", errors="ignore")
    shares = {WEIGHT.name: weights(store), DENSITY: densities(store)}
    if RETURN_PERIOD.name in store.variables:
        shares[RETURN_PERIOD.name] = store[RETURN_PERIOD.name].to_numpy().astype(np.float64)
    runs = runs.assign_coords({name: ("run", values) for name, values in shares.items()})
    return runs.set_coords(STATUS.name)


def _at_once(store: xr.Dataset) -> int:
    """Choose the runs to read at once: whole chunks of the store, some of them where they are small."""
    group = int(store.attrs.get("runs_per_task", 1))
    cells = int(np.prod([store.sizes[d] for d in space(store)]))
    return group * max(1, min(RUNS_AT_ONCE, VALUES_AT_ONCE // cells) // group)


def together(scenarios: Mapping[str, xr.Dataset]) -> xr.Dataset:
    """Put the runs of scenarios that share a lattice and a profile into one ensemble.

    Scenarios have equal weights. Where runs have return periods, those that have runs of a period have equal
    weights within it, and the periods weigh as `weights` says: runs of one scenario or of several are alike.

    Raises
    ------
    NotTogetherError
        If points or profiles differ, or only some runs have return periods.
    """
    (first_name, first), *others = scenarios.items()
    for name, other in others:
        for place in PLACES:
            there = [place in first.variables, place in other.variables]
            if any(there) and not (all(there) and _equal(first[place], other[place])):
                raise NotTogetherError(
                    f"{first_name} and {name} differ in {place.replace('_', ' ')}; scenarios are laid over "
                    "each other only on the same points and profile (give clouds one spacing by --spacing)"
                )
        if ("return_period" in first.coords) != ("return_period" in other.coords):
            raise NotTogetherError(f"only one of {first_name} and {name} has return periods")
    kept = [name for name in MAXIMA if all(name in runs for runs in scenarios.values())]
    whole: xr.Dataset = xr.concat(
        [runs[kept] for runs in scenarios.values()],
        "run",
        data_vars="minimal",
        coords="minimal",
        compat="override",
        join="override",
    )
    weight = whole["weight"].to_numpy() / len(scenarios)
    if "return_period" in whole.coords:
        years = whole["return_period"].to_numpy()
        scenario = np.repeat(np.arange(len(scenarios)), [runs.sizes["run"] for runs in scenarios.values()])
        # the share of a scenario in a period it has runs of, whatever its other periods are
        _, group = np.unique(np.stack([scenario, years]), axis=1, return_inverse=True)
        held = np.bincount(group, weight)[group]
        weight = _by_rarity(np.divide(weight, held, out=np.zeros_like(weight), where=held > 0), years)
    return whole.assign_coords(weight=("run", weight))


def _equal(one: xr.DataArray, other: xr.DataArray) -> bool:
    same = one.dims == other.dims and "run" not in one.dims and one.shape == other.shape
    return same and bool(np.allclose(one, other, rtol=1e-9, atol=1e-9, equal_nan=True))


def _by_rarity(weight: NDArray[np.float64], years: NDArray[np.float64]) -> NDArray[np.float64]:
    """Weights of runs whose return periods are ``years``, (n,), of which equal ones share what they had."""
    # a period whose runs all weigh nothing is not there
    ascending = np.unique(years[weight > 0])
    rarer = np.append(1 / ascending[1:], 0.0)
    share = (1 / ascending - rarer) * ascending[0]
    which = np.searchsorted(ascending, years).clip(max=len(ascending) - 1)
    held = np.bincount(which, weight, minlength=len(ascending))
    return np.asarray(np.where(weight > 0, share[which] * weight / held[which], 0.0))
