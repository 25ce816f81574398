"""Many runs of a case, and blocks of them, which emulated numbers are compared with.

A block of n runs are n consecutive points of the Sobol sequence, which are even like the first ones.
"""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from pipeline.assess.ensemble import ensemble
from pipeline.assess.receptors import Cells
from pipeline.emulation.sampled import Sampled
from pipeline.scenario.scenario import stored
from pipeline.store.variables import CHOSEN_FOR, Status
from pipeline.store.zarr_store import open_store

Array = NDArray[np.float64]
Rows = NDArray[np.intp]
BLOCKS = 4


class Truth:
    """Many runs on one spacing, and blocks of them."""

    def __init__(self, place: Path, name: str) -> None:
        self.store = open_store(place / f"{name}.zarr").load()
        self.settings = stored(self.store.attrs)

    def depth(self, rows: slice | NDArray[np.intp] = slice(None)) -> NDArray[np.float32]:
        """Largest depths of some runs, (runs, ny, nx)."""
        found: NDArray[np.float32] = self.store["max_depth"].to_numpy()[rows]
        return found

    def exceedance(self, threshold: float) -> Array:
        """Share of all runs above a threshold, (ny, nx)."""
        found: Array = (self.depth() > threshold).mean(axis=0)
        return found

    def cells(self, receptor: str) -> Rows:
        """Cells of a receptor, in the order of the flattened lattice."""
        (place,) = (each for each in self.settings.places if each.name == receptor)
        return Cells(ensemble(self.store)).of(place)

    def runs(
        self,
        rows: Rows,
        finer: Truth | None = None,
        pairs: int = 0,
        failed: Rows | None = None,
        chosen: Rows | None = None,
    ) -> Sampled:
        """Give a block of runs as if no others had been computed.

        finer, pairs : the first of the block are on a finer spacing too. failed : runs of the block that
        count as failed. chosen : further runs, beside the sample.
        """
        stores = [self.store.isel(run=rows)]
        if failed is not None:
            state = np.where(np.isin(rows, failed), Status.FAILED, stores[0]["status"])
            stores[0] = stores[0].assign(status=("run", state))
        beside = () if chosen is None else (self.store.isel(run=chosen).assign_attrs({CHOSEN_FOR: "study"}),)
        if finer is not None:
            stores.append(finer.store.isel(run=rows[:pairs]))
        return Sampled(self.settings, tuple(stores), beside)


def blocks(count: int, whole: int) -> Iterator[NDArray[np.intp]]:
    """Give some blocks of runs, far from each other in the sequence, among the first of the truth."""
    step = max(1, whole // count // BLOCKS)
    for i in range(min(BLOCKS, whole // count)):
        yield np.arange(i * step * count, (i * step + 1) * count)
