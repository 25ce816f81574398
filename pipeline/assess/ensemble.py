"""Runs that are looked at together: those of one store, or of several, each with its weight."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np
import xarray as xr
from numpy.typing import NDArray

from pipeline.assess.frames import mean_spacing, space
from pipeline.assess.gridding import gridded
from pipeline.store.variables import RETURN_PERIOD, STATUS, WEIGHT, Status

MAXIMA = ("max_depth", "max_speed", "max_momentum_flux", "arrival_time")
PLACES = ("x", "y", "elevation", "horizontal_distance")
# runs whose values, and whose comparisons with thresholds, are held at once
RUNS_AT_ONCE = 16
VALUES_AT_ONCE = 4_000_000


class NotTogetherError(ValueError):
    """Scenarios cannot be laid over each other; ``str()`` says why."""


@dataclass(frozen=True)
class Counts:
    """How many of the runs that were planned are in which state."""

    done: int
    overrun: int
    failed: int
    pending: int

    @property
    def planned(self) -> int:
        """All of them."""
        return self.done + self.overrun + self.failed + self.pending

    @property
    def attributes(self) -> dict[str, int]:
        """As attributes of a file."""
        return {f"runs_{name}": getattr(self, name) for name in ("planned", *self.__dataclass_fields__)}

    def __str__(self) -> str:
        """``97 of 100 runs done (2 of them overrun, 3 failed)``: the words every map has."""
        rest = {"overrun": self.overrun, "failed": self.failed, "pending": self.pending}
        words = [f"{n} {'of them ' * (name == 'overrun')}{name}" for name, n in rest.items() if n]
        note = f" ({', '.join(words)})" if words else ""
        return f"{self.done + self.overrun} of {self.planned} run{'s' * (self.planned != 1)} done{note}"


def counts(runs: xr.Dataset) -> Counts:
    """Count the runs by what became of them."""
    found = {s: int((runs[STATUS.name] == s).sum()) for s in Status}
    return Counts(*(found[s] for s in (Status.DONE, Status.OVERRUN, Status.FAILED, Status.PENDING)))


def weights(store: xr.Dataset) -> NDArray[np.float64]:
    """Give the share of each planned run of a store, (runs,), their sum 1; all have the same without weights.

    Raises
    ------
    ValueError
        If the weights are none.
    """
    given = WEIGHT.name in store.variables
    weight = np.asarray(store[WEIGHT.name] if given else np.ones(store.sizes["run"]), np.float64)
    if not (np.isfinite(weight).all() and (weight >= 0).all() and weight.sum() > 0):
        raise ValueError(f"{store.attrs.get('title')}: expected weights of at least 0, not all of them 0")
    share: NDArray[np.float64] = weight / weight.sum()
    return share


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
        Over ``run``, ``y`` and ``x``: the maxima and the arrival time that were kept, lazy; over ``run``:
        ``status``, ``weight``, which sums to 1 over the planned runs, and where the scenario gives it
        ``return_period``, years; the places of the points.

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
        runs = gridded(runs.assign_coords(area=store["area"]), spacing or mean_spacing(store))
    places = [name for name in PLACES if name in runs.variables]
    runs = runs[[*kept, STATUS.name]].reset_coords()[[*kept, STATUS.name, *places]].set_coords(places)
    runs = runs.drop_vars("run", errors="ignore")
    shares = {WEIGHT.name: weights(store)}
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

    Scenarios have equal weights, unless all runs have return periods; then an event as rare as each stands
    for all that are rarer than it and not than the next one, so that the probabilities are those of an event
    at least as rare as the most frequent one.

    Raises
    ------
    NotTogetherError
        If points or profiles differ, or only some runs have return periods.
    """
    (first_name, first), *others = scenarios.items()
    for name, other in others:
        for place in PLACES:
            same = place in first.variables and place in other.variables
            if not same or not _equal(first[place], other[place]):
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
        weight = _by_rarity(weight, whole["return_period"].to_numpy())
    return whole.assign_coords(weight=("run", weight))


def _equal(one: xr.DataArray, other: xr.DataArray) -> bool:
    same = one.dims == other.dims and "run" not in one.dims and one.shape == other.shape
    return same and bool(np.allclose(one, other, rtol=1e-9, atol=1e-9))


def _by_rarity(weight: NDArray[np.float64], years: NDArray[np.float64]) -> NDArray[np.float64]:
    """Weights of runs whose return periods are ``years``, (n,), of which equal ones share what they had."""
    ascending, which = np.unique(years, return_inverse=True)
    rarer = np.append(1 / ascending[1:], 0.0)
    share = (1 / ascending - rarer) * ascending[0]
    return np.asarray(share[which] * weight / np.bincount(which, weight)[which])
