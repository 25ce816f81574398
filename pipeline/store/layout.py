"""The layout of a store: its template, how it is cut into chunks, and the making of it by the driver."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
import zarr
from numpy.typing import NDArray
from zarr.codecs import ZstdCodec

from pipeline.store.provenance import made_by
from pipeline.store.storage import Location, storage_of, store_of
from pipeline.store.variables import DIGEST, RETURN_PERIOD, STATUS, WEIGHT, Variable
from pipeline.store.zarr_store import attributes, digest, dims

LARGEST_CHUNK = 20_000_000
FRAMES_PER_CHUNK = 8
# By an estimate that is some nine times too long for a flow that covers a part of the lattice: a task takes
# five seconds then. Each costs 60 ms beside its runs.
TASK_SECONDS = 45.0
LONG_RUN_SECONDS = 1.0
LEAST_TASKS = 16
# Longer runs share a task only where there are so many that reading a file for each and each variable takes
# long: a millisecond for five of them.
LEAST_TASKS_OF_LONG_RUNS = 256
RESTATED = (WEIGHT.name, RETURN_PERIOD.name)


@dataclass(frozen=True)
class Template:
    """The structure of a store, before any run.

    Parameters
    ----------
    variables : tuple of Variable
        What is written per run, in the order of writing.
    coordinates : tuple of (Variable, array)
        What is known beforehand, with its values of shape (size of each of its dims,).
    sizes : dict
        Length of every dimension.
    group : int
        Runs per task, the chunk length along ``run`` of every variable.
    attributes : dict
        Attributes of the store.
    """

    variables: tuple[Variable, ...]
    coordinates: tuple[tuple[Variable, NDArray[Any]], ...]
    sizes: Mapping[str, int]
    group: int
    attributes: Mapping[str, str | float]

    def __post_init__(self) -> None:
        assert self.variables[-2:] == (DIGEST, STATUS), "status is written last, after the digest"
        assert all(v.dims[0] == "run" for v in self.variables), "every variable is written by run"
        for variable in self.variables:
            chunk = self.shard(variable) or self.chunk(variable)
            assert chunk[0] == self.group, f"a group of runs owns its chunks of {variable.name}"

    def shape(self, variable: Variable) -> tuple[int, ...]:
        """Length of each dimension of a variable."""
        return tuple(self.sizes[d] for d in variable.dims)

    def chunk(self, variable: Variable) -> tuple[int, ...]:
        """Chunk of a variable: a group of whole runs, or a few frames of one run that is large."""
        whole = (self.group, *self.shape(variable)[1:])
        if self.shard(variable) is None:
            return whole
        return (1, min(FRAMES_PER_CHUNK, whole[1]), *whole[2:])

    def shard(self, variable: Variable) -> tuple[int, ...] | None:
        """Shard of a variable whose frames of one run are too large for one chunk, else None."""
        _, *rest = self.shape(variable)
        if "time" not in variable.dims or run_bytes(rest) <= LARGEST_CHUNK:
            return None
        frames = min(FRAMES_PER_CHUNK, rest[0])
        return (1, -(-rest[0] // frames) * frames, *rest[1:])


def run_bytes(shape: Sequence[int]) -> int:
    """Bytes of one run of a single-precision variable of this shape."""
    return 4 * int(np.prod(shape))


def group_size(runs: int, seconds_per_run: float, bytes_per_run: int) -> int:
    """Choose the runs per task: many short runs share one of a few seconds, if they fit a chunk."""
    least = LEAST_TASKS if seconds_per_run <= LONG_RUN_SECONDS else LEAST_TASKS_OF_LONG_RUNS
    by_time = TASK_SECONDS / max(seconds_per_run, 1e-6)
    by_size = LARGEST_CHUNK / max(bytes_per_run, 1)
    return max(1, int(min(by_time, by_size, runs / least)))


def create(path: Location, template: Template, *, replace: bool = True) -> None:
    """Make the store of a template, replacing one that is there; it appears whole or not at all.

    With ``replace=False`` one that another process has made meanwhile stays.
    """
    storage = storage_of(path)
    aside = storage.aside()
    auxiliary = " ".join(v.name for v, _ in template.coordinates if v.dims != (v.name,))
    known = {
        v.name: np.asarray(values, v.dtype if v.dtype != "string" else object)
        for v, values in template.coordinates
    }
    attributes: dict[str, Any] = {
        **template.attributes,
        "coordinates": auxiliary,
        "coordinates_hash": digest(known),
        "runs_per_task": template.group,
    }
    root = zarr.open_group(aside, mode="w", zarr_format=3, attributes=attributes)
    for variable, values in template.coordinates:
        _create_array(root, variable, values.shape, values.shape, None)[...] = values
    for variable in template.variables:
        _create_array(
            root, variable, template.shape(variable), template.chunk(variable), template.shard(variable)
        )
    storage.publish(aside, replace=replace)


def add_summaries(path: Location) -> None:
    """Note in a store that values of further runs are made by the code of this process."""
    before = str(attributes(path).get("summary_hash", ""))
    here = made_by()["summary_hash"]
    if here not in before.split():
        root = zarr.open_group(store_of(path), mode="r+", use_consolidated=False)
        root.attrs.update({"summary_hash": f"{before} {here}".strip()})


def restate(path: Location, said: Mapping[str, str], shares: Sequence[tuple[Variable, NDArray[Any]]]) -> None:
    """Write anew what a store says of its runs that has no part in their values.

    Parameters
    ----------
    path : Location
        The store.
    said : mapping of str to str
        Attributes: the scenario's text and the like.
    shares : sequence of (Variable, array)
        Weights and return periods, shape (runs,).
    """
    root = zarr.open_group(store_of(path), mode="r+", use_consolidated=False)
    before = dict(root.attrs)
    if all(before.get(name) == value for name, value in said.items()):
        return
    names = [name for name in str(before["coordinates"]).split() if name not in RESTATED]
    for variable, values in shares:
        held = root.get(variable.name) or _create_array(root, variable, values.shape, values.shape, None)
        assert isinstance(held, zarr.Array)
        held[...] = values
        names.append(variable.name)
    arrays = dict(root.arrays())
    dimensions = {str(d) for array in arrays.values() for d in dims(array)}
    known = {name: np.asarray(array[...]) for name, array in arrays.items() if name in {*names, *dimensions}}
    root.attrs.update({**said, "coordinates": " ".join(names), "coordinates_hash": digest(known)})
    for name in ({*RESTATED} - {*names}) & {*arrays}:
        del root[name]


def _create_array(
    root: zarr.Group,
    variable: Variable,
    shape: tuple[int, ...],
    chunk: tuple[int, ...],
    shard: tuple[int, ...] | None,
) -> zarr.Array[Any]:
    return root.create_array(
        variable.name,
        shape=shape,
        chunks=tuple(max(1, c) for c in chunk),
        shards=shard,
        # as small as by the default level on depths and velocities, in little more than half the time
        compressors=ZstdCodec(level=1),
        dtype=str if variable.dtype == "string" else variable.dtype,
        fill_value=variable.fill,
        dimension_names=variable.dims,
        attributes=variable.cf_attributes,
    )
