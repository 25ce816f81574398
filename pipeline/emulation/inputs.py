"""Varied parameters of runs as places for the emulator, and draws of them."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property
from itertools import product

import numpy as np
import xarray as xr
from numpy.typing import NDArray

from pipeline.assess.ensemble import computed, weights
from pipeline.emulation.errors import NotEmulatedError
from pipeline.scenario.design import draw
from pipeline.scenario.levels import at_level
from pipeline.scenario.sweep import Value
from pipeline.settings.sample import Lognormal
from pipeline.settings.settings import Settings
from solver.emulator.exceedance import REST
from solver.emulator.levels import Draws, draws

Array = NDArray[np.float64]
Rows = NDArray[np.intp]
PATH_DRAWS = 512
# that weights within an entry of the sweep, and numbers that are one, may differ by
SAME = 1e-9


@dataclass(frozen=True)
class Input:
    """How one varied parameter is brought to about one: numbers over their range, words as one column each.

    Parameters
    ----------
    logarithm : bool
        Of a lognormal parameter.
    low, high : float
        Of the runs; one value where all computed runs have it.
    known : tuple of str
        Of a parameter that is no number, the words that computed runs have.
    """

    logarithm: bool
    low: float
    high: float
    known: tuple[str, ...] = ()

    @property
    def words(self) -> tuple[str, ...]:
        """All words but the first, each of which is a column."""
        return self.known[1:]

    def of(self, values: Sequence[Value] | NDArray[np.generic]) -> Array:
        """Give the columns of values, shape (n, columns)."""
        if self.columns == 0:
            # one value in all runs says nothing
            return np.empty((len(values), 0))
        if self.known:
            texts = np.array([str(value) for value in values])
            return np.stack([texts == word for word in self.words], axis=1).astype(np.float64)
        return ((self._numbers(values) - self.low) / (self.high - self.low))[:, None]

    def unseen(self, values: Sequence[Value] | NDArray[np.generic]) -> NDArray[np.bool_]:
        """Say which values no computed run is like, (n,): other words, or others than the only number."""
        if self.known:
            return np.array([str(value) not in self.known for value in values], bool)
        if self.columns:
            return np.zeros(len(values), bool)
        return ~np.isclose(self._numbers(values), self.low, rtol=SAME, atol=0)

    def _numbers(self, values: Sequence[Value] | NDArray[np.generic]) -> Array:
        numbers = np.asarray(values, np.float64)
        return np.log(numbers) if self.logarithm else numbers

    @property
    def columns(self) -> int:
        """Number of columns that it takes."""
        return len(self.words) if self.known else int(self.high > self.low)

    def back(self, column: Array) -> Array:
        """Give the values of a number by its column, shape (n,)."""
        found = self.low + column * (self.high - self.low)
        return np.exp(found) if self.logarithm else found


def _input(values: NDArray[np.generic], done: NDArray[np.bool_], logarithm: bool) -> Input:
    """Give the input of the values of all runs, some of which are done."""
    done = done if done.any() else np.ones_like(done)
    if values.dtype.kind not in "fiu":
        return Input(False, 0.0, 0.0, tuple(sorted({str(value) for value in values[done]})))
    numbers = values.astype(np.float64)
    numbers = np.log(numbers) if logarithm else numbers
    # without a run that has another value nothing says what it does
    numbers = numbers if np.ptp(numbers[done]) > 0 else numbers[done]
    return Input(logarithm, float(numbers.min()), float(numbers.max()))


def _given(store: xr.Dataset) -> dict[str, NDArray[np.generic]]:
    """Give the values of each varied key of the runs of a store."""
    return {str(c.attrs["key"]): c.to_numpy() for c in store.coords.values() if "key" in c.attrs}


@dataclass(frozen=True)
class Inputs:
    """Varied parameters of a scenario.

    Parameters
    ----------
    settings : Settings
        Of the scenario.
    store : xr.Dataset
        Of its coarsest level.
    beside : tuple of xr.Dataset
        Of chosen runs.
    """

    settings: Settings
    store: xr.Dataset
    beside: tuple[xr.Dataset, ...] = ()

    @cached_property
    def by_key(self) -> dict[str, Input]:
        """How each varied parameter is scaled, by its key, in the order of the design."""
        sample = self.settings.sample
        lognormal = {
            key for key, each in (sample.values.items() if sample else ()) if isinstance(each, Lognormal)
        }
        given, done = _given(self.store), computed(self.store).to_numpy()
        found = {}
        for key in self.settings.varied:
            more = [(_given(store)[key], computed(store).to_numpy()) for store in self.beside]
            values, ends = zip((given[key], done), *more, strict=True)
            whole, ended = np.concatenate(values), np.concatenate(ends)
            # numbers are scaled by the sample alone, so that chosen runs do not move the others
            if whole.dtype.kind in "fiu":
                whole, ended = given[key], done
            found[key] = _input(whole, ended, key in lognormal)
        return found

    def of(self, store: xr.Dataset) -> Array:
        """Give the places of the runs of a store, shape (runs, inputs)."""
        given = _given(store)
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

        Raises
        ------
        NotEmulatedError
            If more of them have a value that no computed run has than any error leaves room for.
        """
        entries = self._drawn(count)
        self._refuse_unseen(entries)
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

    def _refuse_unseen(self, entries: Sequence[Mapping[str, Sequence[Value]]]) -> None:
        for key, each in self.by_key.items():
            by_entry = [each.unseen(given[key]) for given in entries]
            share = float(self.shares[self._used] @ [unseen.mean() for unseen in by_entry])
            if share > REST:
                pairs = zip(by_entry, entries, strict=True)
                values = {str(given[key][int(i)]) for unseen, given in pairs for i in np.flatnonzero(unseen)}
                told = " or ".join(sorted(values))
                raise NotEmulatedError(
                    f"no computed run has {key} {told}, which {100 * share:.2g} % of the events have"
                )

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
