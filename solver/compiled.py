"""How kernels are compiled: ahead of nothing, cached on disk, keyed by the source of what they import."""

from __future__ import annotations

import gc
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from functools import cache, cached_property, partial, wraps
from pathlib import Path
from typing import Any, ClassVar, ParamSpec, Protocol, TypeVar, cast

import numba
import numpy as np
from llvmlite.binding import get_host_cpu_name  # type: ignore[import-untyped]
from numba.core.caching import FunctionCache
from numba.core.codegen import get_host_cpu_features
from numba.core.compiler import Compiler, Flags
from numba.core.registry import CPUDispatcher
from numba.core.types import BaseFunction, Function
from numba.extending import overload

from solver import sources
from solver.referenced import referenced, type_of

P = ParamSpec("P")
R_co = TypeVar("R_co", covariant=True)
Kernel = TypeVar("Kernel", bound=Callable[..., Any])
# What kernels give each other in place of literals: for each of these Numba would compile them once more.
ZERO, ONE = np.int64(0), np.int64(1)
# Of fast mathematics: no NaN occurs, and zeros have no sign.
FAST = {"nnan", "nsz"}
# the settings of numba are made at run time
config: Any = numba.config


@cache
def choose_vectors() -> None:
    """Let LLVM use vectors of 512 bits where the processor has them, and no gathers where they are slow.

    LLVM prefers 256 bits there, for the sake of code that uses them rarely; the kernels do little else. On
    processors of AMD an instruction that loads values from places of a list takes longer than as many single
    loads: clouds take 1.4 times as long with it. Neither has an effect on results, nor where Numba has
    compiled something before in the process.
    """
    features: str = get_host_cpu_features()  # type: ignore[no-untyped-call]
    if config.CPU_FEATURES is not None:
        return
    chosen = vectors_of(get_host_cpu_name(), features.split(","))
    if chosen:
        config.CPU_FEATURES = ",".join([features, *chosen])


def vectors_of(processor: str, features: Sequence[str]) -> list[str]:
    """Give the settings of LLVM for a processor that differ from its own, by LLVM's name of it."""
    wide = ["-prefer-256-bit"] if "+avx512f" in features else []
    return [*wide, *(["+prefer-no-gather"] if processor.startswith("znver") else [])]


@cache
def cache_directory(module: str) -> Path:
    """Folder of the compiled kernels of a module.

    Numba does not notice a change in a function of another module, so the folder is named by the hash of the
    code of all that the module imports. For a module outside of this package that is the whole package.

    Raises
    ------
    OSError
        If no folder can be written.
    """
    modules = sources.modules_of("solver")
    names = sources.closure([module], modules) if module in modules else modules
    name = f"kernels-{module.partition('.')[2]}-{sources.fingerprint(names, modules)[:16]}"
    folder = sources.folder() / name
    if folder.exists():
        sources.use(folder)
    else:
        folder.mkdir(exist_ok=True)
        sources.sweep(folder.parent, "kernels-*")
    return folder


class _Flags(Flags):
    """Settings that a function is compiled with, as quick to look things up by as they can be.

    Numba looks up what every operator of a function means under its settings, and compares them one by one,
    which took a third of the time of compiling. Equal settings are one object here. Those that a callee does
    not take over are left out, so that it is looked up once for all functions.
    """

    known: ClassVar[dict[str, Any]] = {}
    __eq__, __hash__ = object.__eq__, object.__hash__

    def copy(self) -> Any:
        """Give the settings that Numba looks things up by while it compiles a function."""
        copied: Any = _Flags(self)  # type: ignore[no-untyped-call]
        copied.noalias = copied.no_cpython_wrapper = copied.no_cfunc_wrapper = False
        return self.known.setdefault(repr(copied.values()), copied)


_function: Any = Function
_call_types: dict[tuple[Any, ...], tuple[Any, Any]] = {}


def _call_type(function: Any, context: Any, args: Any, named: Any) -> Any:
    """Give what a function or an operator of Numba's gives for types of arguments, looked for once.

    Numba tries all that it may mean wherever it stands, 8,000 times for a lattice, of which 350 differ.
    """
    key = (id(function), id(context), args, tuple(named.items()))
    if key not in _call_types:
        # with the function, so that no other takes its number
        _call_types[key] = function, BaseFunction.get_call_type(function, context, args, named)
    return _call_types[key][1]


@contextmanager
def _undisturbed() -> Iterator[None]:
    """Compile without looking for the same things, or for garbage, again and again; a fifth of the time."""
    if "get_call_type" in vars(_function):
        yield
        return
    collects = gc.isenabled()
    gc.disable()
    _function.get_call_type = _call_type
    try:
        yield
    finally:
        del _function.get_call_type
        if collects:
            gc.enable()


class _Compiler(Compiler):
    """Numba's compiler, without the wrapper that C would call a function by.

    Attributes
    ----------
    unaliased
        Whether no two arrays that a function is given overlap.
    counts
        Whether references to arrays are counted.
    wrapped
        Whether Python can call it.
    """

    unaliased: ClassVar[bool]
    counts: ClassVar[bool]
    wrapped: ClassVar[bool]

    def __init__(self, *args: Any) -> None:
        *before, given, types = args
        flags: Any = _Flags(given)  # type: ignore[no-untyped-call]
        flags.no_cfunc_wrapper, flags.noalias = True, self.unaliased
        flags.nrt, flags.no_cpython_wrapper = self.counts, not self.wrapped
        super().__init__(*before, flags, types)  # type: ignore[no-untyped-call, call-arg]

    def compile_extra(self, func: Any) -> Any:
        """Compile a function.

        Raises
        ------
        TypeError
            If Python calls it, it returns arrays, and it does not count the references to them.
        """
        with _undisturbed():
            compiled = super().compile_extra(func)  # type: ignore[no-untyped-call]
        models = compiled.target_context.data_model_manager
        if self.wrapped and not self.counts and models[compiled.signature.return_type].contains_nrt_meminfo():
            raise TypeError(f"a kernel that gives Python arrays is to be declared so: {func.__qualname__}")
        return compiled


@cache
def _compiler(unaliased: bool, counts: bool, wrapped: bool) -> type[_Compiler]:
    choice = {"unaliased": unaliased, "counts": counts, "wrapped": wrapped}
    return type("_Chosen", (_Compiler,), choice)


class _Kept:
    """What is kept on disk of a kernel, looked for when it is compiled first: most are never asked for.

    To find the place of one takes a millisecond, of all a quarter of a second.
    """

    def __init__(self, function: Callable[..., Any], called: bool) -> None:
        self._function, self._called = function, called

    def __getattr__(self, name: str) -> Any:
        return getattr(self._found, name)

    @cached_property
    def _found(self) -> FunctionCache:
        before, folder = config.CACHE_DIR, cache_directory(self._function.__module__)
        # under one name there is one of both kinds
        config.CACHE_DIR = str(folder / "called" if self._called else folder)
        try:
            return FunctionCache(self._function)  # type: ignore[no-untyped-call]
        finally:
            config.CACHE_DIR = before


class _Inner(CPUDispatcher):
    """A kernel that kernels call. Python calls it by another one that it is compiled to then."""

    outer: Callable[[], Any]

    def __call__(self, *args: Any, **named: Any) -> Any:
        named = {name: referenced(value) for name, value in named.items()}
        return self.outer()(*map(referenced, args), **named)


def kernel(
    fastmath: bool = True,
    unaliased: bool = False,
    inline: bool = False,
    as_source: bool = False,
    cached: bool = True,
    from_python: bool = False,
    makes_arrays: bool = False,
) -> Callable[[Callable[..., Any]], Any]:
    """Decorate a function to be compiled by Numba.

    NumPy's error model (a division by zero gives inf) lets loops vectorise. Of fast mathematics only the
    assumptions that no NaN occurs and that zeros have no sign are taken: contraction or reassociation
    would break the mirror symmetry of results to the last bit.

    Parameters
    ----------
    fastmath : bool
        False for the functions that look for NaN.
    unaliased : bool
        Promise that nothing written lies in an array given under another name. LLVM asks otherwise each time
        that a loop is entered, which costs short rows as much as their cells do; where what is read is found
        by an index it cannot ask, and the loop does not vectorise.
    inline : bool
        Whether it becomes part of what calls it, however long it is: a loop that calls does not vectorise.
    as_source : bool
        Whether its source becomes part of what calls it, and it is not compiled by itself. That would take a
        second where many arrays are given. No address of the kernels that it is given stays behind, with
        which Numba could not keep the caller on disk.
    cached : bool
        Whether it is kept on disk.
    from_python : bool
        Whether it is compiled with what Python calls it by, which takes longer than many a kernel does where
        it is given many arrays. A kernel without can be called too: it is then compiled once more.
    makes_arrays : bool
        Whether it makes arrays, or returns one. References to arrays are counted in those kernels alone.
    """
    options: dict[str, Any] = {
        "nogil": True,
        "error_model": "numpy",
        "fastmath": FAST if fastmath else False,
        "forceinline": inline,
        "inline": "always" if as_source else "never",
    }

    def compile_(function: Callable[..., Any], called: bool = from_python or as_source) -> Any:
        choose_vectors()
        compiler = _compiler(unaliased, makes_arrays, called)
        made = numba.njit(pipeline_class=compiler, **options)(function)
        if cached:
            made._cache = _Kept(function, called)
        if not called:
            made.__class__ = _Inner
            made.outer = cache(partial(compile_, function, True))
        return made

    return compile_


def compile_for(function: Any, *args: Any) -> None:
    """Compile a kernel for arguments like these as other kernels call it, or load it, and do nothing else."""
    function.compile(tuple(map(type_of, args)))


class ByType(Protocol[P, R_co]):
    """Kernels of one meaning, called with a named tuple and the rest."""

    def __call__(self, *args: P.args, **kwargs: P.kwargs) -> R_co:
        """Call the kernel that the class of the first argument chooses."""
        ...

    def of(self, *classes: type) -> Callable[[Kernel], Kernel]:
        """Decorate the kernel for named tuples of some classes."""
        ...


def by_type(declared: Callable[P, R_co]) -> ByType[P, R_co]:
    """Decorate the declaration of kernels between which the class of their first argument chooses.

    The choice is made when what calls them is compiled, and they become part of it: the choice costs nothing,
    and what is not chosen is not compiled. Python chooses in the same way.
    """
    chosen: dict[type, Callable[..., Any]] = {}
    compile_ = cache(numba.njit(error_model="numpy", fastmath=FAST))

    @wraps(declared)
    def call(law: Any, *rest: Any) -> Any:
        return compile_(chosen[type(law)])(law, *rest)

    def of(*classes: type) -> Callable[[Kernel], Kernel]:
        def keep(function: Kernel) -> Kernel:
            chosen.update(dict.fromkeys(classes, function))
            return function

        return keep

    options: Any = {"error_model": "numpy", "fastmath": FAST, "forceinline": True}
    options |= {"_nrt": False, "no_cfunc_wrapper": True}

    @overload(call, jit_options=options, strict=False)
    def _choose(law: Any, *rest: Any) -> Any:
        return chosen.get(getattr(law, "instance_class", type(None)))

    call.of = of  # type: ignore[attr-defined]
    return cast("ByType[P, R_co]", call)


def is_compiled(function: Any) -> bool:
    """Whether a kernel is on disk."""
    return any(Path(function.stats.cache_path).glob(f"*.{function.__name__}-*.nbi"))
