"""What the spacing is worth: how much runs change from one level of a scenario to the next."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import ExitStack
from itertools import pairwise
from math import prod

import numpy as np
import xarray as xr
from numpy.typing import NDArray

from pipeline.assess import spacing
from pipeline.assess.frames import on_surface
from pipeline.assess.receptors import reached
from pipeline.assess.tables import ON_PROFILE, ON_SURFACE, values
from pipeline.readable import with_unit, written
from pipeline.report.tables.table import Table, short
from pipeline.scenario.scenario import stored
from pipeline.store.place import LEVEL, store_path
from pipeline.store.storage import Location, is_made
from pipeline.store.zarr_store import open_store

Array = NDArray[np.float64]
QUANTITIES = (
    *("runout_distance", "reach_angle", "lowest_elevation", "deposit_length", "deposit_width"),
    *("deposit_area", "deposit_max_depth", "peak_depth", "peak_speed"),
)
AT_RECEPTORS = {"max_depth": "m", "max_speed": "m/s"}
HEAD = ("from", "to", "quantity", "runs", "median before", "median after", "typical change", "largest change")
NOTE = (
    "Of runs that are computed on both spacings. The typical change is the root mean square over them; of "
    "the share that reaches a receptor it is the share of runs that reach it on one spacing alone. Where "
    "changes shrink from one step to the next, there is reason to expect no larger ones beyond the closest "
    "spacing. One step alone says nothing of it."
)


def spacing_table(out: Location, store: xr.Dataset) -> Table | None:
    """Table how much runs change from each level to the next closer one; None with one level.

    Parameters
    ----------
    out : Location
        The place.
    store : Dataset
        The scenario's store: its widest level.
    """
    sample = stored(store.attrs).sample
    if sample is None or not sample.levels:
        return None
    name = str(store.attrs["title"])
    paths = [store_path(out, f"{name}{LEVEL}{level.name}") for level in sample.levels[1:]]
    with ExitStack() as opened:
        finer = [opened.enter_context(open_store(path)) for path in paths if is_made(path)]
        steps = [with_unit(short(level.spacing), "m") for level in sample.levels]
        levels = zip(steps, [store, *finer], strict=False)
        rows = [
            [before, after, *row]
            for (before, coarse), (after, fine) in pairwise(levels)
            for row in changes(coarse, fine)
        ]
    return Table("What the spacing is worth", HEAD, rows, NOTE) if rows else None


def one_spacing(store: xr.Dataset) -> str:
    """Say of a scenario with one spacing what can be said of it."""
    step = getattr(stored(store.attrs).points, "spacing", None)
    points = "All runs are on the same points" if step is None else f"All runs have a spacing of {step:g} m"
    area = values(store, "deposit_area").quantile(0.5).estimate
    covered = ""
    if step is not None and np.isfinite(area) and area > 0:
        cells = short(float(area) / step**2)
        covered = f" The deposit of median area, {short(float(area))} m², covers {cells} cells."
    return (
        f"{points}: how much would change on a closer one was not computed.{covered} With levels under "
        "sample in the scenario, some runs are repeated on closer spacings, and their changes stand here."
    )


def changes(coarse: xr.Dataset, fine: xr.Dataset) -> Iterator[list[str]]:
    """Give rows of what changes between two levels: quantity, runs, medians before and after, changes."""
    entries = prod(map(len, stored(coarse.attrs).sweep.values()))
    pairs = spacing.paired(coarse, fine, entries)
    if not len(pairs[0]):
        return
    both = (coarse, fine)
    left_out = ON_PROFILE if on_surface(coarse) else ON_SURFACE
    for name in QUANTITIES:
        if name not in left_out and name in coarse:
            held = [values(each, name).value[rows] for each, rows in zip(both, pairs, strict=True)]
            title = _titled(name, str(coarse[name].attrs.get("units", "")))
            yield [title, *_changes(*held)]
    try:
        tables = [reached(each) for each in both]
    except ValueError:
        return
    for receptor in dict.fromkeys(tables[0].get("receptor", ())):
        parts = [
            table[table["receptor"] == receptor].iloc[rows] for table, rows in zip(tables, pairs, strict=True)
        ]
        arrives = [part["reached"].to_numpy(np.float64, na_value=np.nan) == 1 for part in parts]
        shares = [f"{each.mean():.2f}" for each in arrives]
        flips = f"{spacing.flips(*arrives):.2f}"
        yield [f"{receptor}: share that reaches it", str(len(pairs[0])), *shares, flips, "–"]
        for name, unit in AT_RECEPTORS.items():
            # what does not arrive has no depth there
            held = [
                np.where(there, part[name].to_numpy(np.float64, na_value=np.nan), 0.0)
                for part, there in zip(parts, arrives, strict=True)
            ]
            yield [f"{receptor}: {name.replace('max_', 'largest ')} ({unit})", *_changes(*held)]


def _changes(before: Array, after: Array) -> list[str]:
    known = np.isfinite(before) & np.isfinite(after)
    if not known.any():
        return ["0", *["–"] * 4]
    numbers = (
        float(np.median(before[known])),
        float(np.median(after[known])),
        spacing.typical_change(before, after),
        float(np.abs(after - before)[known].max()),
    )
    return [str(int(known.sum())), *map(short, numbers)]


def _titled(name: str, units: str) -> str:
    unit = written(units)
    return f"{name.replace('_', ' ')} ({unit})" if unit else name.replace("_", " ")
