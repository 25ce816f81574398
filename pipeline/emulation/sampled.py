"""Runs of a sampled scenario on all its levels, as the emulator takes them."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from contextlib import ExitStack, contextmanager
from dataclasses import dataclass
from functools import cached_property

import numpy as np
import xarray as xr
from numpy.typing import NDArray

from pipeline.assess.ensemble import computed, counts, ensemble
from pipeline.assess.frames import threshold_of
from pipeline.assess.receptors import Cells
from pipeline.assess.spacing import root_rows
from pipeline.emulation.errors import NotEmulatedError
from pipeline.emulation.inputs import Inputs
from pipeline.scenario.scenario import stored
from pipeline.settings.settings import Settings
from pipeline.store.place import LEVEL, store_path
from pipeline.store.storage import Location, is_made
from pipeline.store.zarr_store import open_store
from solver.emulator import support
from solver.emulator.fields import FieldLevel
from solver.emulator.latent import WET

Array = NDArray[np.float64]
Rows = NDArray[np.intp]
# cells beside the flow of all runs that are looked at; farther away nothing arrives
MARGIN = 10


@dataclass(frozen=True)
class Sampled:
    """A sampled scenario.

    Parameters
    ----------
    settings : Settings
        Of the scenario.
    stores : tuple[xr.Dataset, ...]
        Of its levels, the coarsest first.
    """

    settings: Settings
    stores: tuple[xr.Dataset, ...]

    @property
    def name(self) -> str:
        """Name of the scenario."""
        return self.settings.name

    @cached_property
    def inputs(self) -> Inputs:
        """Varied parameters."""
        return Inputs(self.settings, self.stores[0])

    @cached_property
    def ensembles(self) -> tuple[xr.Dataset, ...]:
        """Maxima of the runs of each level, lazy, where the flow of any of them comes."""
        return tuple(_cut(each, self._box) for each in self.whole)

    @cached_property
    def whole(self) -> tuple[xr.Dataset, ...]:
        """Maxima of the runs of each level over the whole domain, lazy."""
        return tuple(ensemble(store) for store in self.stores)

    @cached_property
    def _box(self) -> dict[str, tuple[float, float]]:
        """Bounds of what is looked at, m: places wet in a run or of a receptor, and a margin."""
        found: dict[str, tuple[float, float]] = {}
        wet = [(each["max_depth"] > WET).any("run").compute() for each in self.whole]
        wide = max(float(np.diff(each[axis]).mean()) for each in self.whole for axis in ("x", "y"))
        corners = np.array([corner for place in self.settings.places for corner in place.corners])
        for i, axis in enumerate(("x", "y")):
            other = "y" if axis == "x" else "x"
            at = [each[axis].to_numpy()[each.any(other).to_numpy()] for each in wet]
            held = np.concatenate([*at, corners[:, i] if len(corners) else []])
            if not held.size:
                raise NotEmulatedError("no run is deeper than 0.02 m anywhere")
            found[axis] = float(held.min()) - MARGIN * wide, float(held.max()) + MARGIN * wide
        return found

    @cached_property
    def usable(self) -> tuple[Rows, ...]:
        """Runs of each level that are computed, of finer ones those that are so on all coarser levels."""
        found = [np.flatnonzero(computed(self.stores[0]).to_numpy())]
        for fine in self.stores[1:]:
            rows = np.flatnonzero(computed(fine).to_numpy())
            level = len(found)
            before = self.root_rows(level - 1, found[-1])
            found.append(rows[np.isin(self.root_rows(level, rows), before)])
        return tuple(found)

    def root_rows(self, level: int, rows: Rows) -> Rows:
        """Positions among the runs of the coarsest level that have the values of runs of a level."""
        entries = len(self.inputs.entries)
        count, whole = (self.stores[i].sizes["run"] // entries for i in (level, 0))
        return root_rows(rows, count, whole)

    def pairs(self, chosen: Sequence[Rows]) -> list[Rows]:
        """Rows of the level before, among those chosen, that the chosen runs of each finer level are."""
        found = []
        for level in range(1, len(chosen)):
            before = self.root_rows(level - 1, chosen[level - 1])
            order = np.argsort(before)
            here = self.root_rows(level, chosen[level])
            found.append(order[np.searchsorted(before, here, sorter=order)])
        return found

    def weight(self, rows: Rows) -> Array:
        """Share of runs of the coarsest level, shape (n,), their sum is 1."""
        by_run = np.repeat(self.inputs.shares, self.stores[0].sizes["run"] // len(self.inputs.entries))
        found: Array = by_run[rows] / by_run[rows].sum()
        return found

    def fields(self, name: str) -> list[FieldLevel]:
        """Give a maximum of the usable runs of each level, loaded, with the cells of the receptors."""
        pairs = [None, *self.pairs(self.usable)]
        found = []
        for store, runs, rows, before in zip(self.stores, self.ensembles, self.usable, pairs, strict=True):
            cells = Cells(runs) if self.settings.places else None
            places = {each.name: cells.of(each) for each in self.settings.places} if cells else {}
            values = runs[name].isel(run=rows).transpose("run", "y", "x").to_numpy()
            if np.isnan(values).any():
                raise NotEmulatedError(f"{name} is missing at places of computed runs")
            inputs = self.inputs.of(store)[rows]
            found.append(
                FieldLevel(inputs, values, runs["y"].to_numpy(), runs["x"].to_numpy(), places, before)
            )
        return found

    @property
    def threshold(self) -> float | None:
        """Depth above which a receptor counts as reached, m."""
        return threshold_of(self.stores[0])

    @property
    def spacings(self) -> list[float]:
        """Spacing of the points of each level, m."""
        return [float(np.diff(each["x"]).mean()) for each in self.whole]

    @property
    def words(self) -> str:
        """Say what the numbers are made from: ``64 of 64 runs done at 8 m; 16 of 16 runs done at 4 m``."""
        parts = zip(self.stores, self.spacings, strict=True)
        return "; ".join(f"{counts(store)} at {spacing:g} m" for store, spacing in parts)


@contextmanager
def sampled(path: Location) -> Iterator[Sampled]:
    """Open the stores of a sampled scenario.

    Raises
    ------
    NotEmulatedError
        If nothing is sampled, or too few runs are computed.
    """
    with ExitStack() as stack:
        stores = [stack.enter_context(open_store(path))]
        settings = stored(stores[0].attrs)
        levels = () if settings.sample is None else settings.sample.levels[1:]
        finer = [store_path(path.parent, f"{path.stem}{LEVEL}{level.name}") for level in levels]
        stores += [stack.enter_context(open_store(each)) for each in finer if is_made(each)]
        if settings.sample is None:
            raise NotEmulatedError("expected a sample, as draws come from its distributions; found none")
        if "max_depth" not in stores[0]:
            raise NotEmulatedError("expected max_depth, which output.fields leaves out")
        found = Sampled(settings, tuple(stores))
        runs, inputs = len(found.usable[0]), found.inputs.of(stores[0]).shape[1]
        if few := support.of_runs(runs, inputs):
            raise NotEmulatedError(few)
        while len(found.stores) > 1 and not support.of_pairs(len(found.usable[-1]))[0]:
            found = Sampled(settings, found.stores[:-1])
        yield found


def _cut(runs: xr.Dataset, box: dict[str, tuple[float, float]]) -> xr.Dataset:
    """Cut a lattice to bounds, widened to whole cells."""
    index = {}
    for axis, (low, high) in box.items():
        at = np.flatnonzero((runs[axis] >= low) & (runs[axis] <= high))
        index[axis] = slice(max(0, at[0] - 1), at[-1] + 2)
    return runs.isel(index)
