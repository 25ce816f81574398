"""Named tuples that kernels are given by their place in memory, not value by value.

Numba gives a kernel a named tuple as all values in it, and an array as seven: some 700 for what a run on a
lattice reads and writes. Each kernel on the way hands them on, and compiling that, copies of them above all,
takes longer than compiling what is done with them. Of a tuple in memory a kernel is given the address, and
loads what it names.

A class is declared so by `by_reference`, and then is so inside of others in memory too. Kernels of long loops
take their arrays as values: LLVM knows of those that they do not overlap (`solver.compiled.kernel`).
"""

from __future__ import annotations

from collections.abc import Iterator
from functools import cache
from itertools import chain
from struct import Struct
from typing import Any, ClassVar, TypeVar

import numba
import numpy as np
from numba import _dispatcher
from numba.core import cgutils, types
from numba.core.datamodel import models
from numba.core.imputils import lower_getattr_generic
from numba.core.typing.templates import AttributeTemplate
from numba.extending import NativeValue, infer_getattr, register_model, unbox

Class = TypeVar("Class", bound=type)
# What Numba keeps of an array, in this order, each a word of 8 bytes; shape and strides have one a dimension.
_OF_ARRAY = ("meminfo", "parent", "nitems", "itemsize", "data", "shape", "strides")
_WORD = 8
_declared: set[type] = set()
_typeof: Any = numba.typeof


def by_reference(declared: Class) -> Class:
    """Declare a class of named tuples that kernels are given by reference."""
    _declared.add(declared)
    return declared


class Reference(types.Type):
    """Numba's type of the address of a named tuple.

    Parameters
    ----------
    of : NamedTuple
        Numba's type of the tuple.
    """

    def __init__(self, of: Any) -> None:
        self.of = of
        super().__init__(f"Reference({of})")


def passed(kind: Any) -> Any:
    """Give the type by which kernels are given what is of this type."""
    return _reference(kind) if getattr(kind, "instance_class", None) in _declared else kind


# the name of a type, which Numba compares types by, is as long as the tuple
_reference = cache(Reference)


def type_of(value: Any) -> Any:
    """Give the type by which kernels are given a value."""
    return passed(_typeof(value))


@register_model(Reference)
class _Model(models.PrimitiveModel):
    def __init__(self, manager: Any, kind: Any) -> None:
        super().__init__(manager, kind, manager[kind.of].get_data_type().as_pointer())  # type: ignore[no-untyped-call]


@infer_getattr
class _Attribute(AttributeTemplate):
    key = Reference

    def generic_resolve(self, reference: Any, name: str) -> Any:  # type: ignore[override]
        of = reference.of
        return passed(of.types[of.fields.index(name)]) if name in of.fields else None


@lower_getattr_generic(Reference)  # type: ignore[no-untyped-call]
def _load(context: Any, builder: Any, reference: Any, address: Any, name: str) -> Any:
    """Load a field; of one that is given by reference, find the place."""
    n = reference.of.fields.index(name)
    kind = reference.of.types[n]
    place = cgutils.gep_inbounds(builder, address, 0, n)  # type: ignore[no-untyped-call]
    if isinstance(passed(kind), Reference):
        return place
    block = builder.block.instructions
    before = len(block)
    loaded = context.data_model_manager[kind].load_from_data_pointer(builder, place)
    # nothing is written there while a kernel runs: a loop need not load it again
    invariant = builder.module.add_metadata([])
    for made in block[before:]:
        if made.opname == "load":
            made.set_metadata("invariant.load", invariant)
    return loaded


@unbox(Reference)  # type: ignore[no-untyped-call]
def _unbox(kind: Any, value: Any, c: Any) -> NativeValue:
    manager = c.context.data_model_manager
    for each in _leaves(kind.of):
        if isinstance(each, types.Array) and tuple(manager[each]._fields) != _OF_ARRAY:
            raise NotImplementedError("this release of Numba keeps arrays in another way")
    size = c.context.get_abi_sizeof(manager[kind.of].get_data_type())
    if size != _layout(kind.of).size:
        raise NotImplementedError("this release of Numba keeps tuples in another way")
    address = c.pyapi.object_getattr_string(value, "address")
    place = c.pyapi.long_as_longlong(address)
    c.pyapi.decref(address)
    return NativeValue(c.builder.inttoptr(place, c.context.get_value_type(kind)))  # type: ignore[no-untyped-call]


class Referenced:
    """A named tuple of arrays, numbers, None and such tuples, in memory for kernels that Python calls.

    Parameters
    ----------
    values : named tuple
        Of a class that is declared by `by_reference`. Its arrays are kept as long as this is.
    before : Referenced, optional
        Another of the class: of fields that are the same objects nothing is looked up again.

    Attributes
    ----------
    address : int
        Where it is.

    Raises
    ------
    TypeError
        If it is of another class, or holds something else.
    """

    # type and layout by the fingerprint of values: to find them by the type itself takes longer than to pack
    _known: ClassVar[dict[bytes, tuple[Any, Struct]]] = {}

    def __init__(self, values: Any, before: Referenced | None = None) -> None:
        fingerprint = _dispatcher.compute_fingerprint(values)
        known = self._known.get(fingerprint)
        if known is None:
            kind = type_of(values)
            if not isinstance(kind, Reference):
                raise TypeError(f"{type(values).__name__} is not declared to be given by reference")
            known = self._known[fingerprint] = kind, _layout(kind.of)
        self.values = values
        self._numba_type_: Any = known[0]
        layout = known[1]
        self._memory = np.empty(layout.size // _WORD, dtype=np.int64)
        # the same object has the same words
        same = {} if before is None else dict(zip(map(id, before.values), before._words, strict=True))
        self._words: list[list[Any]] = [same.get(id(each)) or _words((each,)) for each in values]
        layout.pack_into(self._memory.data, 0, *chain.from_iterable(self._words))
        self.address: int = self._memory.ctypes.data


def referenced(value: Any) -> Any:
    """Put what kernels are given by reference in memory; anything else is given back."""
    return Referenced(value) if type(value) in _declared else value


def _leaves(kind: Any) -> Iterator[Any]:
    if isinstance(kind, types.BaseTuple):
        members: Any = kind
        for each in members.types:
            yield from _leaves(each)
    else:
        yield kind


@cache
def _layout(kind: Any) -> Struct:
    """Words of a type in memory."""
    words = ""
    for each in _leaves(kind):
        if isinstance(each, types.Array):
            words += "q" * (len(_OF_ARRAY) - 2 + 2 * each.ndim)
        elif isinstance(each, types.NoneType) or each == types.int64:
            words += "q"
        elif each == types.float64:
            words += "d"
        else:
            raise TypeError(f"no place in memory for {each}")
    return Struct(words)


def _words(values: Any) -> list[Any]:
    words: list[Any] = []
    for each in values:
        if isinstance(each, np.ndarray):
            # references to arrays are not counted there: Python keeps them
            words += (0, 0, each.size, each.itemsize, each.ctypes.data, *each.shape, *each.strides)
        elif isinstance(each, tuple):
            words += _words(each)
        else:
            words.append(0 if each is None else each)
    return words
