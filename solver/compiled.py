"""How kernels are compiled: ahead of nothing, cached on disk, keyed by the source of the whole package."""

from __future__ import annotations

import hashlib
import os
import tempfile
from collections.abc import Callable
from functools import cache
from pathlib import Path
from typing import Any

import numba
import numpy as np
from numba.core.codegen import get_host_cpu_features
from numba.core.compiler import Compiler

# What kernels give each other in place of literals: for each of these Numba would compile them once more.
ZERO, ONE = np.int64(0), np.int64(1)
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
def cache_directory() -> Path:
    """Folder of the compiled kernels.

    Numba does not notice a change in a function of another module, so the folder is named by a digest of
    all of this package's source.
    """
    here = Path(__file__).parent
    digest = hashlib.sha256(b"".join(path.read_bytes() for path in sorted(here.rglob("*.py")))).hexdigest()[
        :16
    ]
    for parent in (here / "__pycache__", Path(tempfile.gettempdir()) / f"lmls-{os.getuid()}"):
        folder = parent / f"kernels-{digest}"
        try:
            folder.mkdir(parents=True, exist_ok=True)
        except OSError:
            continue
        if os.access(folder, os.W_OK):
            return folder
    raise OSError("no writable folder for compiled kernels")


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
        Whether its source becomes part of what calls it. It is not compiled by itself then, which takes a
        second where many arrays are given. It leaves no address of kernels that are its arguments, with which
        Numba could not keep the caller on disk.
    cached : bool
        Whether it is kept on disk.
    """
    flags = {"nnan", "nsz"} if fastmath else False

    def compile_(function: Callable[..., Any]) -> Any:
        widen_vectors()
        before = config.CACHE_DIR
        config.CACHE_DIR = str(cache_directory())
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


def is_compiled(function: Any) -> bool:
    """Whether a kernel is on disk."""
    return any(Path(function.stats.cache_path).glob(f"*.{function.__name__}-*.nbi"))
