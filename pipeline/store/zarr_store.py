"""One Zarr store per scenario: the writing of a group of runs, their statuses, and the opening of it.

A chunk along ``run`` is a group, written by exactly one task, and ``status`` is written last, so that it
alone tells what is finished.
"""

from __future__ import annotations

import asyncio
import hashlib
import json
from collections.abc import Hashable, Mapping, Sequence
from typing import TYPE_CHECKING, Any, TypeVar, cast

import numpy as np
import zarr
from numpy.typing import NDArray
from zarr.api.asynchronous import open_group
from zarr.core.sync import sync

from pipeline.store.place import ROOT, chosen_paths, not_a_store
from pipeline.store.storage import Location, store_of
from pipeline.store.variables import DIGEST, LATER, PER_RUN, STATUS, TIMINGS, Status, Variable, parameter_keys

if TYPE_CHECKING:
    import xarray as xr

Values = Mapping[str, Any]
N = TypeVar("N", bound=Hashable)
# The arrays of the store that was written last: a batch goes through its stores one after another.
_opened: dict[tuple[str, str, tuple[str, ...]], dict[str, zarr.AsyncArray[Any]]] = {}


def write(
    path: Location, variables: Sequence[Variable], rows: Mapping[int, Values], status: Mapping[int, Status]
) -> None:
    """Write runs of one group: their values, the digest of these, and the status last.

    Parameters
    ----------
    path : Location
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
    # zarr's own event loop and threads stay; making new ones each time costs as much as all else
    sync(_write(path, variables, rows, status))


async def _write(
    path: Location, variables: Sequence[Variable], rows: Mapping[int, Values], status: Mapping[int, Status]
) -> None:
    arrays = await _arrays(path, tuple(variable.name for variable in variables))
    states = arrays[STATUS.name]
    group = states.chunks[0]
    if len({run // group for run in status}) != 1:
        raise ValueError(f"runs {sorted(status)} are not of one group of {group}")
    start = min(status) // group * group
    block = slice(start, min(start + group, states.shape[0]))
    if np.any(np.asarray(await states.getitem(block)) != Status.PENDING):
        await _put(states, block, dict.fromkeys(status, Status.PENDING))
    # each call of zarr from outside its event loop costs more than the writing of a scalar
    written = await asyncio.gather(
        *(
            _put(arrays[v.name], block, {run: rows[run].get(v.name, v.fill) for run in status})
            for v in variables[:-2]
        )
    )
    held = {v.name: whole for v, whole in zip(variables, written, strict=False) if v.name not in TIMINGS}
    digests = {
        run: digest({STATUS.name: np.int8(state), **{name: held[name][run - start] for name in held}})
        for run, state in status.items()
    }
    await _put(arrays[DIGEST.name], block, digests)
    await _put(states, block, status)


async def _arrays(path: Location, names: tuple[str, ...]) -> dict[str, zarr.AsyncArray[Any]]:
    """Give arrays of a store, opened once as long as the store is the same."""
    root = await open_group(store_of(path), mode="r+", use_consolidated=False)
    key = str(path), json.dumps(root.attrs, sort_keys=True), names
    if key not in _opened:
        found = await asyncio.gather(*(root.getitem(name) for name in names))
        _opened.clear()
        arrays = [array for array in found if isinstance(array, zarr.AsyncArray)]
        # to look whether a chunk of a field is empty costs half as much as to compress it
        _opened[key] = {a.basename: a.with_config({"write_empty_chunks": a.ndim > 1}) for a in arrays}
    return _opened[key]


def digest(values: Values) -> str:
    """SHA-256 of values by name, hexadecimal, whatever their order."""
    found = hashlib.sha256()
    for name, value in sorted(values.items()):
        array = np.asarray(value)
        if name in LATER and not array > 0:
            continue
        text = array.dtype.kind in "OUT"
        found.update(f"{name}\0".encode())
        found.update("\0".join(array.ravel().tolist()).encode() if text else np.ascontiguousarray(array).data)
    return found.hexdigest()


async def _put(array: zarr.AsyncArray[Any], block: slice, values: Mapping[int, Any]) -> NDArray[Any]:
    """Write a block of runs at once and give it; runs of it that have no value here stay as they are."""
    whole: Any
    if len(values) == block.stop - block.start:
        whole = np.empty((len(values), *array.shape[1:]), array.dtype)
    else:
        whole = await array.getitem(block)
    for run, value in values.items():
        whole[run - block.start] = value
    await array.setitem(block, whole)
    return np.asarray(whole)


def _array(root: zarr.Group, variable: Variable) -> zarr.Array[Any]:
    array = root[variable.name]
    assert isinstance(array, zarr.Array)
    return array


def dims(array: Any) -> tuple[str, ...]:
    """Names of the dimensions of an array."""
    return tuple(array.metadata.dimension_names or ())


def read(path: Location) -> zarr.Group:
    """Open a store to read it."""
    return zarr.open_group(store_of(path), mode="r", use_consolidated=False)


def statuses(path: Location, runs: slice = slice(None)) -> NDArray[np.int8]:
    """Give the status of every run, or of some, shape (runs,): all that resuming reads."""
    root = read(path)
    return np.asarray(_array(root, STATUS)[runs], np.int8)


def chosen(path: Location) -> int:
    """Count the runs that were chosen beside those of a store, whatever became of them."""
    return sum(statuses(each).size for each in chosen_paths(path))


def group(path: Location) -> int:
    """Give the runs per task: the chunk length along ``run``."""
    return int(_array(read(path), STATUS).chunks[0])


def row(path: Location, variables: Sequence[Variable], run: int) -> dict[str, Any]:
    """Read the values of a run by name of variable, digest and status apart, as ``write`` takes them.

    Variables that the store lacks are left out.
    """
    root = read(path)
    arrays = {v.name: _array(root, v) for v in variables[:-2] if v.name in root}
    return {name: array[run] if "run" in dims(array) else array[...] for name, array in arrays.items()}


def held(path: Location, known: Sequence[Variable]) -> tuple[Variable, ...]:
    """List what a store holds per run, in the order of writing.

    A store keeps to the variables that it was made with: those it lacks are left out, and those that are not
    known any more get their fill value.

    Parameters
    ----------
    path : Location
        The store.
    known : sequence of Variable
        What it would hold if it were made now, digest and status last.
    """
    root = read(path)
    apart = {*str(root.attrs.get("coordinates", "")).split(), *(variable.name for variable in known)}
    former = [
        Variable(name, dims(array), cast(Any, array.dtype.name), "", "", array.fill_value)
        for name, array in sorted(root.arrays())
        if dims(array)[:1] == ("run",) and name not in apart and dims(array) != (name,)
    ]
    *values, digests, status = (variable for variable in known if variable.name in root)
    return (*values, *former, digests, status)


def attributes(path: Location) -> dict[str, Any]:
    """Attributes of a store, empty where there is none."""
    try:
        return dict(read(path).attrs)
    except FileNotFoundError:
        return {}


def values_of_runs(path: Location) -> tuple[dict[str, NDArray[Any]], dict[str, dict[str, Any]]]:
    """Read all that is one value a run, parameters first, in the order of the design.

    Parameters
    ----------
    path : Location
        The store.

    Returns
    -------
    dict of str to array
        Values by name, of shape (runs,); what was never computed has the fill value of its variable.
    dict of str to dict
        Attributes by name, those of the store under ``""``.

    Raises
    ------
    FileNotFoundError
        If there is no store at ``path``.
    """
    if not (path / ROOT).exists():
        raise FileNotFoundError(not_a_store(path))
    values, attributes = sync(_values_of_runs(path))
    first = _in_order(attributes[""], attributes)
    return {name: values[name] for name in dict.fromkeys([*first, *sorted(values)])}, attributes


def _in_order(of_store: Mapping[Any, Any], of_arrays: Mapping[N, Mapping[Any, Any]]) -> list[N]:
    """Name the parameters in the order of the design; a store lists its arrays in that of its folders."""
    keys = parameter_keys(json.loads(str(of_store.get("scenario_content", "{}"))))
    named = {found["key"]: name for name, found in of_arrays.items() if "key" in found}
    return [named[key] for key in keys if key in named]


async def _values_of_runs(path: Location) -> tuple[dict[str, NDArray[Any]], dict[str, dict[str, Any]]]:
    root = await open_group(store_of(path), mode="r", use_consolidated=False)
    found = {name: each async for name, each in root.arrays() if dims(each) == ("run",)}
    read = await asyncio.gather(*(each.getitem(slice(None)) for each in found.values()))
    values = {name: np.asarray(each) for name, each in zip(found, read, strict=True)}
    texts = {name: each.astype(object) for name, each in values.items() if each.dtype.kind in "OUT"}
    return values | texts, {"": dict(root.attrs), **{name: dict(each.attrs) for name, each in found.items()}}


def open_store(path: Location) -> xr.Dataset:
    """Open a store lazily, values read as they are used; its parameters are in the order of the design.

    Variables per run that are younger than the store are missing in every run.

    Raises
    ------
    FileNotFoundError
        If there is no store at ``path``.
    """
    if not (path / ROOT).exists():
        raise FileNotFoundError(not_a_store(path))
    import xarray as xr

    found: xr.Dataset = xr.open_zarr(store_of(path), chunks=None, consolidated=False)
    if STATUS.name not in found:
        return found
    younger = [variable for variable in PER_RUN if variable.name not in found]
    empty = {v.name: np.full(found.sizes["run"], "" if v.dtype == "string" else np.nan) for v in younger}
    opened = found.assign({v.name: (v.dims, empty[v.name], v.cf_attributes) for v in younger})
    names = _in_order(opened.attrs, {name: c.attrs for name, c in opened.coords.items()})
    ordered = opened.drop_vars(names).assign_coords({name: opened[name].variable for name in names})
    ordered.set_close(found.close)
    return ordered
