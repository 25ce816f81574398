"""Runs of a sampled scenario on all its levels, as the emulator takes them."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from contextlib import ExitStack, contextmanager
from dataclasses import dataclass
from functools import cached_property

import numpy as np
import xarray as xr
from numpy.typing import NDArray

from pipeline.assess.ensemble import censored, computed, counts, ensemble
from pipeline.assess.frames import densities, threshold_of
from pipeline.assess.probability import Values
from pipeline.assess.receptors import Cells
from pipeline.assess.spacing import root_rows
from pipeline.assess.tables import values
from pipeline.emulation.errors import NotEmulatedError
from pipeline.emulation.inputs import Inputs
from pipeline.hazard.discretisation import ONE_SPACING, told_of
from pipeline.scenario.scenario import stored
from pipeline.settings.settings import Settings
from pipeline.store.place import LEVEL, chosen_paths, store_path
from pipeline.store.storage import Location, is_made
from pipeline.store.zarr_store import open_store
from solver.emulator import support
from solver.emulator.extrapolation import Beyond, beyond, inside
from solver.emulator.fields import FieldLevel
from solver.emulator.latent import WET
from solver.emulator.levels import Draws

Array = NDArray[np.float64]
Rows = NDArray[np.intp]
# cells beside the flow of all runs that are looked at; farther away nothing arrives
MARGIN = 10


@dataclass(frozen=True)
class Sampled:
    """A sampled scenario.

    Rows of the coarsest level are those of the sample, then those that were chosen beside it: what is
    emulated rests on both, and what counts runs on the sample alone.

    Parameters
    ----------
    settings : Settings
        Of the scenario.
    stores : tuple[xr.Dataset, ...]
        Of its levels, the coarsest first.
    chosen : tuple[xr.Dataset, ...]
        Stores of chosen runs, on the spacing of the coarsest level.
    """

    settings: Settings
    stores: tuple[xr.Dataset, ...]
    chosen: tuple[xr.Dataset, ...] = ()

    @property
    def name(self) -> str:
        """Name of the scenario."""
        return self.settings.name

    @cached_property
    def inputs(self) -> Inputs:
        """Varied parameters."""
        return Inputs(self.settings, self.stores[0], self.chosen)

    @cached_property
    def pool(self) -> tuple[tuple[xr.Dataset, ...], ...]:
        """Stores of each level: of the coarsest one that of the sample, and those of chosen runs."""
        first, *finer = ((store,) for store in self.stores)
        return ((*first, *self.chosen), *finer)

    def at(self, level: int) -> Array:
        """Places of the runs of a level, shape (runs, inputs)."""
        return np.concatenate([self.inputs.of(store) for store in self.pool[level]])

    def values(self, level: int, name: str) -> Values:
        """Give a summary of the runs of a level."""
        held = [values(store, name) for store in self.pool[level]]
        value, weight, at_least, at_most = (
            np.concatenate([getattr(each, part) for each in held])
            for part in ("value", "weight", "at_least", "at_most")
        )
        return Values(value, weight, at_least, at_most)

    @cached_property
    def _outside(self) -> Array:
        """Places of the runs of the sample that have no values and lie outside of those that have some."""
        missing = self.at(0)[np.setdiff1d(np.arange(self.counted), self.usable[0])]
        found: Array = missing[~inside(missing, self.at(0)[self.usable[0]])]
        return found

    def beyond(self, draws: Draws) -> Beyond | None:
        """Draws beyond the computed runs, where runs are missing there."""
        return beyond(draws, self._outside, self.at(0)[self.usable[0]])

    @property
    def counted(self) -> int:
        """Runs of the sample."""
        return int(self.stores[0].sizes["run"])

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
        beside = (ensemble(store) for store in self.chosen)
        wet = [(each["max_depth"] > WET).any("run").compute() for each in (*self.whole, *beside)]
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
        coarse, *finer = (np.concatenate([computed(store) for store in level]) for level in self.pool)
        found = [np.flatnonzero(coarse)]
        for level, known in enumerate(finer, 1):
            rows = np.flatnonzero(known)
            before = self.root_rows(level - 1, found[-1])
            found.append(rows[np.isin(self.root_rows(level, rows), before)])
        return tuple(found)

    @cached_property
    def unsettled(self) -> tuple[NDArray[np.bool_], ...]:
        """Whether the usable runs of each level were overrun or cut off, and may have gone farther."""
        held = (np.concatenate([censored(store) for store in level]) for level in self.pool)
        return tuple(states[rows] for states, rows in zip(held, self.usable, strict=True))

    def level_weight(self, level: int) -> Array:
        """Weight of the usable runs of a level, their sum is 1; chosen ones count too."""
        rows = self.usable[level]
        return self.weight(self.root_rows(level, rows)) if level else self.judged(rows)

    @property
    def told_of_unsettled(self) -> str:
        """Say how many of the usable runs were overrun or cut off; empty where none was."""
        count = sum(int(states.sum()) for states in self.unsettled)
        if not count:
            return ""
        return f"{count} of {sum(map(len, self.usable))} computed runs were overrun or cut off"

    def root_rows(self, level: int, rows: Rows) -> Rows:
        """Positions among the runs of the coarsest level that have the values of runs of a level."""
        if level == 0:
            return rows
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
        """Share of runs of the coarsest level, shape (n,), their sum is 1; chosen ones have none."""
        by_run = np.repeat(self.inputs.shares, self.counted // len(self.inputs.entries))
        by_run = np.append(by_run, np.zeros(len(self.at(0)) - self.counted))
        found: Array = by_run[rows] / by_run[rows].sum()
        return found

    def judged(self, rows: Rows) -> Array:
        """Weight of the same runs where predictions are judged, their sum is 1: chosen ones count too."""
        found = self.weight(rows)
        if not self.chosen:
            return found
        found[rows >= self.counted] = found[rows < self.counted].mean()
        judged: Array = found / found.sum()
        return judged

    @cached_property
    def density(self) -> float:
        """Mean density of the flow of the runs, kg m-3, that speeds of a pressure are given for."""
        return float(np.mean(self._densities[0]))

    @cached_property
    def densities_differ(self) -> bool:
        """Whether the flow of some runs is denser than that of others, so that pressure is no speed."""
        return any(bool((each != self.density).any()) for each in self._densities)

    @cached_property
    def _densities(self) -> tuple[Array, ...]:
        """Density of the flow of the runs of each level, shape (runs,), kg m-3."""
        return tuple(np.concatenate([densities(store) for store in level]) for level in self.pool)

    def fields(self, name: str, *, of_pressure: bool = False) -> list[FieldLevel]:
        """Give a maximum of the usable runs of each level, loaded, with the cells of the receptors.

        Of a pressure these are the speeds that have it at the mean density.
        """
        pairs = [None, *self.pairs(self.usable)]
        found = []
        for level, (runs, rows, before) in enumerate(zip(self.ensembles, self.usable, pairs, strict=True)):
            cells = Cells(runs) if self.settings.places else None
            places = {each.name: cells.of(each) for each in self.settings.places} if cells else {}
            held = self._maxima(level, name)
            if of_pressure and self.densities_differ:
                held = held * np.sqrt(self._densities[level][rows] / self.density)[:, None, None]
            if np.isnan(held).any():
                raise NotEmulatedError(f"{name} is missing at places of computed runs")
            y, x = (runs[axis].to_numpy() for axis in ("y", "x"))
            found.append(FieldLevel(self.at(level)[rows], held, y, x, places, before))
        return found

    def _maxima(self, level: int, name: str) -> NDArray[np.floating]:
        """Load a maximum of the usable runs of a level, shape (runs, ny, nx)."""
        beside = [_cut(ensemble(store), self._box) for store in self.pool[level][1:]]
        found, start = [], 0
        for runs in (self.ensembles[level], *beside):
            rows = self.usable[level] - start
            rows = rows[(rows >= 0) & (rows < runs.sizes["run"])]
            found.append(runs[name].isel(run=rows).transpose("run", "y", "x").to_numpy())
            start += runs.sizes["run"]
        return np.concatenate(found)

    @property
    def threshold(self) -> float | None:
        """Depth above which a receptor counts as reached, m."""
        return threshold_of(self.stores[0])

    @property
    def spacings(self) -> list[float]:
        """Spacing of the points of each level, m."""
        return [float(np.diff(each["x"]).mean()) for each in self.whole]

    @property
    def told_of_spacing(self) -> str:
        """Say what the error of the spacing is from."""
        if len(self.stores) == 1:
            return ONE_SPACING
        return told_of(self.spacings[0], self.spacings[-1], len(self.usable[-1]))

    @property
    def left_out(self) -> str:
        """Say which closer spacing is asked for and not corrected to; empty where all are."""
        levels = () if self.settings.sample is None else self.settings.sample.levels
        if len(self.stores) >= len(levels):
            return ""
        least = support.LEAST_PAIRS
        return f"fewer than {least} at {levels[len(self.stores)].spacing:g} m, to which nothing is corrected"

    @cached_property
    def doubts(self) -> tuple[str, ...]:
        """What makes all numbers of the finest level doubtful."""
        pairs = len(self.usable[-1]) if len(self.stores) > 1 else support.FEW_PAIRS
        return tuple(filter(None, [support.of_pairs(pairs)[1]]))

    @property
    def words(self) -> str:
        """Say what the numbers are made from: ``64 of 64 runs done at 8 m; 16 of 16 runs done at 4 m``."""
        parts = zip(self.stores, self.spacings, strict=True)
        said = [f"{counts(store)} at {spacing:g} m" for store, spacing in parts]
        if self.left_out:
            said.append(self.left_out)
        if self.chosen:
            done, whole = (
                sum(getattr(counts(each), name) for each in self.chosen) for name in ("computed", "planned")
            )
            said.append(
                f"{done} of {whole} chosen runs done at {self.spacings[0]:g} m, which count in no share"
            )
        return "; ".join(said)


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
        chosen = tuple(stack.enter_context(open_store(each)) for each in chosen_paths(path))
        found = Sampled(settings, tuple(stores), chosen)
        counted = int(computed(stores[0]).sum())
        inputs = found.inputs.of(stores[0]).shape[1]
        if few := support.of_runs(counted, inputs):
            raise NotEmulatedError(few)
        if alike := support.of_places(found.at(0)[found.usable[0]]):
            raise NotEmulatedError(alike)
        while len(found.stores) > 1 and not support.of_pairs(len(found.usable[-1]))[0]:
            found = Sampled(settings, found.stores[:-1], chosen)
        yield found


def _cut(runs: xr.Dataset, box: dict[str, tuple[float, float]]) -> xr.Dataset:
    """Cut a lattice to bounds, widened to whole cells."""
    index = {}
    for axis, (low, high) in box.items():
        at = np.flatnonzero((runs[axis] >= low) & (runs[axis] <= high))
        index[axis] = slice(max(0, at[0] - 1), at[-1] + 2)
    return runs.isel(index)
