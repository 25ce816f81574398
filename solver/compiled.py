"""How kernels are compiled: ahead of nothing, cached on disk, keyed by the source of what they import."""

from __future__ import annotations

from collections.abc import Callable
from functools import cache, wraps
from pathlib import Path
from typing import Any, ParamSpec, Protocol, TypeVar, cast

import numba
import numpy as np
from numba.core.codegen import get_host_cpu_features
from numba.core.compiler import Compiler
from numba.extending import overload

from solver import sources

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
def widen_vectors() -> None:
    """Let LLVM use vectors of 512 bits where the processor has them.

    LLVM prefers 256 bits there, for the sake of code that uses them rarely; the kernels do little else. It
    has no effect on results, nor where Numba has compiled something before in the process.
    """
    features: str = get_host_cpu_features()  # type: ignore[no-untyped-call]
    if config.CPU_FEATURES is None and "+avx512f" in features.split(","):
        config.CPU_FEATURES = features + ",-prefer-256-bit"


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


class _Compiler(Compiler):
    """Numba's compiler, without the wrapper that C would call a function by."""

    unaliased = False

    def __init__(self, *args: Any) -> None:
        *before, flags, types = args
        flags = flags.copy()
        flags.no_cfunc_wrapper, flags.noalias = True, self.unaliased
        super().__init__(*before, flags, types)  # type: ignore[no-untyped-call, call-arg]


class _Unaliased(_Compiler):
    """The same, told that no two arrays that a function is given overlap."""

    unaliased = True


def kernel(
    fastmath: bool = True,
    unaliased: bool = False,
    inline: bool = False,
    as_source: bool = False,
    cached: bool = True,
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
    """
    flags = FAST if fastmath else False

    def compile_(function: Callable[..., Any]) -> Any:
        widen_vectors()
        before = config.CACHE_DIR
        config.CACHE_DIR = str(cache_directory(function.__module__))
        try:
            return numba.njit(
                cache=cached,
                nogil=True,
                error_model="numpy",
                fastmath=flags,
                forceinline=inline,
                inline="always" if as_source else "never",
                pipeline_class=_Unaliased if unaliased else _Compiler,
            )(function)
        finally:
            config.CACHE_DIR = before

    return compile_


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

    @overload(call, jit_options=options, strict=False)
    def _choose(law: Any, *rest: Any) -> Any:
        return chosen.get(getattr(law, "instance_class", type(None)))

    call.of = of  # type: ignore[attr-defined]
    return cast("ByType[P, R_co]", call)


def is_compiled(function: Any) -> bool:
    """Whether a kernel is on disk."""
    return any(Path(function.stats.cache_path).glob(f"*.{function.__name__}-*.nbi"))
