"""Whether a store still holds what was written: every digest computed again."""

from __future__ import annotations

import hashlib
from collections.abc import Iterator
from dataclasses import dataclass
from typing import Any

import numpy as np

from pipeline.store import zarr_store
from pipeline.store.place import store_name
from pipeline.store.storage import Location
from pipeline.store.variables import DIGEST, STATUS, TIMINGS, Status


@dataclass(frozen=True)
class Report:
    """What was looked at in a store, and a line for everything that is not as it was written."""

    name: str
    runs: int
    faults: tuple[str, ...]


def verify(path: Location) -> Report:
    """Compute the digests of a store again: of each run that ended, of its coordinates, of its scenario.

    It may be read while runs are computed: a run that changes meanwhile is left out.
    """
    root = zarr_store.read(path)
    attributes = dict(root.attrs)
    faults = []
    content = str(attributes.get("scenario_content"))
    if hashlib.sha256(content.encode()).hexdigest() != attributes.get("scenario_hash"):
        faults.append(f"{path}: the scenario is not the one that was written")
    arrays = dict(root.arrays())
    auxiliary = str(attributes.get("coordinates", "")).split()
    known = {n: a for n, a in arrays.items() if n in auxiliary or zarr_store.dims(a) == (n,)}
    try:
        if zarr_store.digest({n: a[...] for n, a in known.items()}) != attributes.get("coordinates_hash"):
            faults.append(f"{path}: a coordinate is not the one that was written")
    except Exception as error:
        faults.append(f"{path}: a coordinate cannot be read: {error}")
    held = {
        n: a for n, a in arrays.items() if n not in known and n not in TIMINGS | {DIGEST.name, STATUS.name}
    }
    states, count = arrays[STATUS.name], 0
    for start in range(0, states.shape[0], states.chunks[0]):
        block = slice(start, min(start + states.chunks[0], states.shape[0]))
        before = np.asarray(states[block])
        found = list(_group(path, held, arrays[DIGEST.name], before, block))
        unchanged = before == np.asarray(states[block])
        count += int((before != Status.PENDING).sum())
        faults += [line for run, line in found if unchanged[run - start]]
    return Report(store_name(path), count, tuple(faults))


def _group(
    path: Location, held: dict[str, Any], digests: Any, states: Any, block: slice
) -> Iterator[tuple[int, str]]:
    """Find the runs of a group whose values are not those they were written with."""
    ended = [run for run in range(block.start, block.stop) if states[run - block.start] != Status.PENDING]
    if not ended:
        return
    values = {}
    for name, array in {**held, DIGEST.name: digests}.items():
        try:
            values[name] = array[block]
        except Exception as error:
            # a chunk that does not decode is as lost as one that decodes to something else
            yield from ((run, f"{path}: run {run}: {name} cannot be read: {error}") for run in ended)
            return
    written = values.pop(DIGEST.name)
    for run in ended:
        row = run - block.start
        now = zarr_store.digest({STATUS.name: states[row], **{n: v[row] for n, v in values.items()}})
        if now != written[row]:
            yield run, f"{path}: run {run}: not the values that were written"
