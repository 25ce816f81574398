"""Varied parameters of runs as places for the emulator, and draws of them."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from functools import cached_property
from itertools import product

import numpy as np
import xarray as xr
from numpy.typing import NDArray

from pipeline.assess.ensemble import weights
from pipeline.emulation.errors import NotEmulatedError
from pipeline.scenario.design import draw
from pipeline.scenario.levels import at_level
from pipeline.scenario.sweep import Value
from pipeline.settings.sample import Lognormal
from pipeline.settings.settings import Settings
from solver.emulator.levels import Draws, draws

Array = NDArray[np.float64]
Rows = NDArray[np.intp]
PATH_DRAWS = 512
# of draws that weights within an entry of the sweep may differ by
SAME = 1e-9


@dataclass(frozen=True)
class Input:
    """How one varied parameter is brought to about one: numbers over their range, words as one column each.

    Parameters
    ----------
    logarithm : bool
        Of a lognormal parameter.
    low, high : float
        Of the runs.
    words : tuple of str
        All but the first of a parameter that is no number.
    """

    logarithm: bool
    low: float
    high: float
    words: tuple[str, ...] = ()

    def of(self, values: Sequence[Value] | NDArray[np.generic]) -> Array:
        """Give the columns of values, shape (n, columns)."""
        if self.words:
            texts = np.array([str(value) for value in values])
            return np.stack([texts == word for word in self.words], axis=1).astype(np.float64)
        numbers = np.asarray(values, np.float64)
        numbers = np.log(numbers) if self.logarithm else numbers
        if self.high <= self.low:
            # one value in all runs says nothing
            return np.empty((len(numbers), 0))
        return ((numbers - self.low) / (self.high - self.low))[:, None]

    @property
    def columns(self) -> int:
        """Number of columns that it takes."""
        return len(self.words) or int(self.high > self.low)

    def back(self, column: Array) -> Array:
        """Give the values of a number by its column, shape (n,)."""
        found = self.low + column * (self.high - self.low)
        return np.exp(found) if self.logarithm else found


def _input(values: NDArray[np.generic], logarithm: bool) -> Input:
    if values.dtype.kind not in "fiu":
        return Input(False, 0.0, 0.0, tuple(sorted({str(value) for value in values}))[1:])
    numbers = values.astype(np.float64)
    numbers = np.log(numbers) if logarithm else numbers
    return Input(logarithm, float(numbers.min()), float(numbers.max()))


@dataclass(frozen=True)
class Inputs:
    """Varied parameters of a scenario.

    Parameters
    ----------
    settings : Settings
        Of the scenario.
    store : xr.Dataset
        Of its coarsest level.
    """

    settings: Settings
    store: xr.Dataset

    @cached_property
    def by_key(self) -> dict[str, Input]:
        """How each varied parameter is scaled, by its key, in the order of the design."""
        sample = self.settings.sample
        given = {str(c.attrs["key"]): c.to_numpy() for c in self.store.coords.values() if "key" in c.attrs}
        lognormal = {
            key for key, each in (sample.values.items() if sample else ()) if isinstance(each, Lognormal)
        }
        return {key: _input(given[key], key in lognormal) for key in self.settings.varied}

    def of(self, store: xr.Dataset) -> Array:
        """Give the places of the runs of a store, shape (runs, inputs)."""
        given = {str(c.attrs["key"]): c.to_numpy() for c in store.coords.values() if "key" in c.attrs}
        return np.concatenate([each.of(given[key]) for key, each in self.by_key.items()], axis=1)

    @cached_property
    def entries(self) -> list[tuple[Value, ...]]:
        """Entries of the sweep, in the order of the runs; one without values where nothing is swept."""
        return list(product(*self.settings.sweep.values()))

    @cached_property
    def shares(self) -> Array:
        """Share of each entry of the sweep in probabilities, shape (entries,), their sum is 1.

        Raises
        ------
        NotEmulatedError
            If draws of an entry differ in their weights, which says that they are of another distribution.
        """
        by_entry = weights(self.store).reshape(len(self.entries), -1)
        if np.ptp(by_entry, axis=1).max() > SAME:
            raise NotEmulatedError("expected equal weights of all draws, found one a run")
        share: Array = by_entry.sum(axis=1)
        return share

    def draws(self, count: int) -> Draws:
        """Draw from the distributions of the sample, for every entry of the sweep that counts.

        Parameters
        ----------
        count : int
            Draws over all entries, at least one each.
        """
        entries = self._drawn(count)
        groups = [
            np.concatenate([each.of(given[key]) for key, each in self.by_key.items()], axis=1)
            for given in entries
        ]
        return draws(groups, self.shares[self._used].tolist(), PATH_DRAWS)

    def values(self, count: int, rows: Rows) -> dict[str, tuple[Value, ...]]:
        """Give the values of every varied key of some of as many draws, in the order of the design."""
        entries = self._drawn(count)
        size = len(next(iter(entries[0].values())))
        return {key: tuple(entries[row // size][key][row % size] for row in rows) for key in self.by_key}

    @property
    def _used(self) -> Rows:
        """Entries of the sweep that count."""
        return np.flatnonzero(self.shares > 0)

    def _drawn(self, count: int) -> list[dict[str, Sequence[Value]]]:
        """Values by key of the draws of each entry that counts."""
        assert self.settings.sample is not None
        each = 1 << max(0, int(np.log2(max(1, count // len(self._used)))))
        drawn = draw(at_level(self.settings.sample, each).model_copy(update={"design": "sobol"}))
        swept = ({key: (value,) * each for key, value in self._entry(i)} for i in self._used)
        return [{**given, **drawn} for given in swept]

    def _entry(self, i: int) -> Iterator[tuple[str, Value]]:
        return zip(self.settings.sweep, self.entries[i], strict=True)
