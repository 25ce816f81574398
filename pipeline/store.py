"""One Zarr store per scenario: its template, the writing of a group of runs, and the opening of it.

The driver alone makes the template. A chunk along ``run`` is a group, written by exactly one task, and
``status`` is written last, so that it alone tells what is finished.
"""

from __future__ import annotations

import hashlib
import os
import shutil
import tempfile
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
import zarr
from numpy.typing import NDArray

from pipeline.variables import DIGEST, STATUS, TIMINGS, Status, Variable

if TYPE_CHECKING:
    import xarray as xr

LARGEST_CHUNK = 20_000_000
FRAMES_PER_CHUNK = 8
TASK_SECONDS = 2.0
LEAST_TASKS = 64

Values = Mapping[str, Any]


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
    attributes: Mapping[str, str]

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
    by_time = TASK_SECONDS / max(seconds_per_run, 1e-6)
    by_size = LARGEST_CHUNK / max(bytes_per_run, 1)
    return max(1, int(min(by_time, by_size, runs / LEAST_TASKS)))


def create(path: Path, template: Template) -> None:
    """Make the store of a template, replacing one that is there; it appears whole or not at all."""
    aside = Path(tempfile.mkdtemp(prefix=f".{path.name}.", suffix=".partial", dir=path.parent))
    aside.chmod(0o755)
    auxiliary = " ".join(v.name for v, _ in template.coordinates if v.dims != (v.name,))
    root = zarr.open_group(
        aside, mode="w", zarr_format=3, attributes={**template.attributes, "coordinates": auxiliary}
    )
    for variable, values in template.coordinates:
        _create_array(root, variable, values.shape, values.shape, None)[...] = values
    for variable in template.variables:
        _create_array(
            root, variable, template.shape(variable), template.chunk(variable), template.shard(variable)
        )
    if path.exists():
        old = aside.with_name(f"{aside.name}.old.partial")
        path.rename(old)
        aside.rename(path)
        shutil.rmtree(old)
    else:
        aside.rename(path)


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
        dtype=str if variable.dtype == "string" else variable.dtype,
        fill_value=variable.fill,
        dimension_names=variable.dims,
        attributes=variable.cf_attributes,
    )


def write(
    path: Path, variables: Sequence[Variable], rows: Mapping[int, Values], status: Mapping[int, Status]
) -> None:
    """Write runs of one group: their values, the digest of these, and the status last.

    Parameters
    ----------
    path : Path
        The store.
    variables : sequence of Variable
        What the store holds per run, in the order of writing, digest and status last.
    rows : mapping of run to values
        Values by name of variable, shaped as the variable without its ``run``; what is missing gets the fill.
    status : mapping of run to Status
        What became of each of these runs.

    Raises
    ------
    ValueError
        If the runs are not of one group, whose chunks alone the caller may touch.
    """
    root = zarr.open_group(path, mode="r+", use_consolidated=False)
    states = _array(root, STATUS)
    group = states.chunks[0]
    if len({run // group for run in status}) != 1:
        raise ValueError(f"runs {sorted(status)} are not of one group of {group}")
    start = min(status) // group * group
    block = slice(start, min(start + group, states.shape[0]))
    if np.any(states[block] != Status.PENDING):
        _put(states, block, dict.fromkeys(status, np.int8(Status.PENDING)))
    digests = {run: hashlib.sha256() for run in status}
    for variable in variables[:-2]:
        array = _array(root, variable)
        values = {run: _value(variable, rows[run], array.shape[1:]) for run in status}
        _put(array, block, values)
        for run, value in values.items():
            if variable.name not in TIMINGS:
                digests[run].update(value.encode() if isinstance(value, str) else value.tobytes())
    _put(_array(root, DIGEST), block, {run: digest.hexdigest() for run, digest in digests.items()})
    _put(states, block, {run: np.int8(state) for run, state in status.items()})


def _value(variable: Variable, row: Values, shape: tuple[int, ...]) -> Any:
    value = row.get(variable.name, variable.fill)
    if variable.dtype == "string":
        return str(value)
    return np.broadcast_to(np.asarray(value, variable.dtype), shape)


def _put(array: zarr.Array[Any], block: slice, values: Mapping[int, Any]) -> None:
    """Write a block of runs at once; runs of it that have no value here stay as they are."""
    whole: Any
    if len(values) == block.stop - block.start:
        first = values[block.start]
        whole = np.empty((len(values), *np.shape(first)), object if isinstance(first, str) else first.dtype)
    else:
        whole = array[block]
    for run, value in values.items():
        whole[run - block.start] = value
    array[block] = whole


def _array(root: zarr.Group, variable: Variable) -> zarr.Array[Any]:
    array = root[variable.name]
    assert isinstance(array, zarr.Array)
    return array


def statuses(path: Path) -> NDArray[np.int8]:
    """Status of every run, shape (runs,): all that resuming reads."""
    root = zarr.open_group(path, mode="r", use_consolidated=False)
    return np.asarray(_array(root, STATUS)[...], np.int8)


def group(path: Path) -> int:
    """Give the runs per task: the chunk length along ``run``."""
    return int(_array(zarr.open_group(path, mode="r", use_consolidated=False), STATUS).chunks[0])


def attributes(path: Path) -> dict[str, Any]:
    """Attributes of a store, empty where there is none."""
    try:
        return dict(zarr.open_group(path, mode="r", use_consolidated=False).attrs)
    except FileNotFoundError:
        return {}


def open_store(path: Path) -> xr.Dataset:
    """Open a store lazily, values read as they are used.

    Raises
    ------
    FileNotFoundError
        If there is no store at ``path``.
    """
    import xarray as xr

    opened: xr.Dataset = xr.open_zarr(path, chunks=None, consolidated=False)
    return opened


def sweep_partials(out: Path) -> int:
    """Remove what killed writers left in a place nobody else writes to; gives how many things."""
    found = 0
    for folder, folders, files in os.walk(out):
        for name in [f for f in folders if f.endswith(".partial")]:
            shutil.rmtree(Path(folder, name))
            folders.remove(name)
            found += 1
        for name in files:
            if name.endswith(".partial"):
                Path(folder, name).unlink()
                found += 1
    return found
