"""Named tuples that kernels are given by their place in memory."""

import gc
from typing import Any, NamedTuple

import numpy as np
import pytest
from numba.core.types import Function

from solver.arrays import Array, Indices
from solver.compiled import kernel
from solver.referenced import Reference, Referenced, by_reference


class Pair(NamedTuple):
    first: Array
    second: Indices


@by_reference
class Inner(NamedTuple):
    value: float
    table: Array


@by_reference
class Outer(NamedTuple):
    count: int
    scale: float
    none: Array | None
    pair: Pair
    numbers: tuple[float, float]
    inner: Inner
    flags: Any


@kernel(from_python=True)
def total(outer: Outer) -> float:
    found = outer.scale * outer.count + outer.numbers[1]
    if outer.none is None:
        found += 0.5
    for k in range(len(outer.pair.first)):
        found += outer.pair.first[k] * outer.pair.second[k]
    rows, columns = outer.inner.table.shape
    for j in range(rows):
        for i in range(columns):
            found += outer.inner.table[j, i] * outer.inner.value * outer.flags[0]
    return found


@kernel()
def doubled(inner: Inner) -> None:
    for j in range(inner.table.shape[0]):
        for i in range(inner.table.shape[1]):
            inner.table[j, i] *= 2.0


def outer(scale=3.0, table=None):
    # every second column: strides are those of the array
    table = np.arange(12.0).reshape(3, 4)[:, ::2] if table is None else table
    pair = Pair(np.array([1.0, 10.0]), np.array([2, 3]))
    return Outer(7, scale, None, pair, (0.0, 0.25), Inner(2.0, table), np.array([True]))


def by_hand(given):
    pair, inner = given.pair, given.inner
    return 7 * given.scale + 0.25 + 0.5 + (pair.first * pair.second).sum() + (inner.table * inner.value).sum()


def test_a_kernel_reads_the_same_from_memory_as_from_values():
    assert total(outer()) == by_hand(outer())
    assert total(Referenced(outer())) == by_hand(outer())
    kinds = [isinstance(signature[0], Reference) for signature in total.signatures]
    assert kinds == [False, True]


def test_what_a_kernel_writes_is_in_the_arrays_and_kernels_called_from_python_are_given_references():
    given = outer()
    before = given.inner.table.copy()
    doubled(given.inner)
    np.testing.assert_array_equal(given.inner.table, 2 * before)
    ((found,),) = doubled.outer().signatures
    assert isinstance(found, Reference)


def test_what_has_changed_since_is_looked_up_and_nothing_else():
    first = Referenced(outer())
    values = first.values._replace(scale=4.0, inner=Inner(5.0, np.ones((2, 2))))
    second = Referenced(values, first)
    assert total(second) == by_hand(values)
    assert total(first) == by_hand(first.values)
    kept = [new is old for new, old in zip(second._words, first._words, strict=True)]
    assert kept == [True, False, True, True, True, False, True]


def test_what_has_no_place_in_memory_is_refused():
    with pytest.raises(TypeError, match="no place in memory for bool"):
        Referenced(outer()._replace(scale=True))
    with pytest.raises(TypeError, match="Pair is not declared"):
        Referenced(outer().pair)


@pytest.mark.parametrize("enabled", [False, True])
def test_compiling_leaves_numba_and_the_collection_of_garbage_as_they_were(enabled):
    @kernel(from_python=True, cached=False)
    def plus(a: float, b: float) -> float:
        return a + b

    try:
        (gc.enable if enabled else gc.disable)()
        assert plus(1.0, 2.0) == 3.0
        assert gc.isenabled() is enabled
        assert "get_call_type" not in vars(Function)
    finally:
        gc.enable()
