"""Results of a place: the dataset of each scenario, opened when it is asked for, and the table of runs."""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterator, Mapping, Sequence
from functools import cached_property
from typing import TYPE_CHECKING

from pipeline.store import zarr_store
from pipeline.store.place import store_name, store_path, store_paths, with_levels
from pipeline.store.storage import Location, store_of
from pipeline.store.variables import STATUS, Status

if TYPE_CHECKING:
    import pandas as pd
    import xarray as xr


class Results(Mapping[str, "xr.Dataset"]):
    """The scenarios of a place by name, each an `xarray.Dataset` that is opened when it is asked for.

    Values are read from the store when they are used. A dataset shows the runs that were done when it was
    opened.

    Parameters
    ----------
    place : Path
        Folder or URL of the results.
    names : sequence of str, optional
        Names of the scenarios; by default all of the place.
    interrupted : bool
        Whether the batch that wrote them was interrupted.
    trouble : str
        Why that batch stopped early: the disk is full, the place cannot be written. Empty where it did not.

    Raises
    ------
    FileNotFoundError
        If the place holds no store.
    """

    def __init__(
        self,
        place: Location,
        names: Sequence[str] | None = None,
        *,
        interrupted: bool = False,
        trouble: str = "",
    ) -> None:
        self.place = place
        self.interrupted = interrupted
        self.trouble = trouble
        self._names = (
            tuple(map(store_name, with_levels(store_paths(place)))) if names is None else tuple(names)
        )
        self._opened: dict[str, xr.Dataset] = {}

    def __getitem__(self, name: str) -> xr.Dataset:
        if name not in self._names:
            raise KeyError(f"{name}: the scenarios are {', '.join(self._names)}")
        if name not in self._opened:
            self._opened[name] = open_lazily(store_path(self.place, name))
        return self._opened[name]

    def __iter__(self) -> Iterator[str]:
        return iter(self._names)

    def __len__(self) -> int:
        return len(self._names)

    def __repr__(self) -> str:
        """One line a scenario: its name, and how many of its runs are in which state."""
        lines = [f"results in {self.place}"]
        for name in self._names:
            counts = ", ".join(
                f"{count} {status.plain_words}" for status, count in sorted(self._counts(name).items())
            )
            lines.append(f"  {name}: {counts}")
        return "\n".join(lines)

    @cached_property
    def table(self) -> pd.DataFrame:
        """The table of runs: a row per run, with its parameters, status and summaries."""
        from pipeline.store import run_table

        whole = run_table.read(self.place)
        return whole[whole["scenario"].isin(self._names)].reset_index(drop=True)

    @property
    def exit_code(self) -> int:
        """0 if all runs are done, 1 if some failed, 3 on trouble of the place, 130 if interrupted."""
        if self.interrupted:
            return 130
        if self.trouble:
            return 3
        return 1 if any(self._counts(name)[Status.FAILED] for name in self._names) else 0

    def _counts(self, name: str) -> Counter[Status]:
        return Counter(map(Status, zarr_store.statuses(store_path(self.place, name)).tolist()))


def open_lazily(path: Location) -> xr.Dataset:
    """Open a store with Dask, in the chunks it was written in."""
    import xarray as xr

    opened: xr.Dataset = xr.open_zarr(store_of(path), chunks={}, consolidated=False)
    # a few numbers a run, that selections need at once
    for name in (STATUS.name, *opened.coords):
        if opened[name].dims in ((), ("run",)):
            opened[name].load()
    return opened
