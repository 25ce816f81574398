import shutil
import subprocess
import sys

import numba
import numpy as np
import pytest

from solver import sources
from solver.compiled import _Flags, compile_for, kernel


@kernel(cached=False)
def twice(values):
    for i in range(len(values)):
        values[i] *= 2.0


@kernel(cached=False, from_python=True)
def four_times(values):
    twice(values)
    twice(values)


def test_a_kernel_of_kernels_can_be_called_and_stays_what_they_call():
    values = np.array([1.0, 2.0])
    twice(values)
    assert values.tolist() == [2.0, 4.0]
    assert twice.signatures == []
    four_times(values)
    assert values.tolist() == [8.0, 16.0]
    assert twice.signatures == [(numba.typeof(values),)]


def test_what_kernels_alone_call_is_machine_code_in_what_python_calls_alone():
    values = np.array([1.0, 2.0])
    four_times(values)
    (inner,), (outer,) = twice.overloads.values(), four_times.overloads.values()
    named = inner.fndesc.llvm_func_name
    # the linked code of the inner one is there, but no address of it
    assert named in inner.library.get_llvm_str()
    assert inner.library.get_pointer_to_function(named) == 0
    assert outer.library.get_pointer_to_function(outer.fndesc.llvm_cpython_wrapper_name) != 0


KEPT = """
from solver.compiled import kernel

@kernel()
def inner(values):
    for i in range(len(values)):
        values[i] *= 3.0

@kernel(from_python=True)
def outer(values):
    inner(values)

@kernel(from_python=True)
def another(values):
    inner(values)
    inner(values)
"""


def test_a_kernel_of_kernels_is_found_on_disk_and_gives_the_same(tmp_path):
    (tmp_path / "kept.py").write_text(KEPT)
    first = f"""
import sys
sys.path.insert(0, {str(tmp_path)!r})
import numpy as np
from kept import another, inner, outer
values = np.array([1.0, 2.0])
outer(values)
print(values.tolist())
"""
    # outer is read from disk, and another kernel takes the inner one from there
    again = (
        first
        + """
another(values)
print(values.tolist(), [sum(each.stats.cache_hits.values()) for each in (outer, another, inner)])
"""
    )
    try:
        said = [
            subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True).stdout
            for code in (first, again)
        ]
    finally:
        modules = sources.modules_of("solver")
        shutil.rmtree(sources.folder() / f"kernels--{sources.fingerprint(modules, modules)[:16]}")
    assert said == ["[3.0, 6.0]\n", "[3.0, 6.0]\n[27.0, 54.0] [1, 0, 1]\n"]


def test_compiling_ahead_does_nothing_else():
    values = np.arange(3, dtype=np.float32)
    compile_for(twice, values)
    assert values.tolist() == [0.0, 1.0, 2.0]
    assert (numba.typeof(values),) in twice.signatures


def test_arrays_are_given_to_python_by_kernels_that_count_them_alone():
    def given(values):
        return values

    with pytest.raises(TypeError, match="to be declared so"):
        kernel(cached=False)(given)(np.zeros(2))
    values = np.zeros(2)
    assert kernel(cached=False, makes_arrays=True)(given)(values) is values


def test_what_callees_do_not_take_over_makes_no_other_settings():
    some, other = _Flags(), _Flags()
    other.noalias = other.no_cpython_wrapper = True
    assert some.copy() is other.copy()
    other.fastmath = {"nnan"}
    assert some.copy() is not other.copy()
    assert other.copy().fastmath
    assert other.noalias
