import numba
import numpy as np
import pytest

from solver.compiled import _Flags, compile_for, kernel, vectors_of


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


@pytest.mark.parametrize(
    ("processor", "features", "wanted"),
    [
        ("znver4", ["+avx2", "+avx512f"], ["-prefer-256-bit", "+prefer-no-gather"]),
        ("znver2", ["+avx2"], ["+prefer-no-gather"]),
        ("skylake-avx512", ["+avx512f"], ["-prefer-256-bit"]),
        ("haswell", ["+avx2", "-avx512f"], []),
    ],
)
def test_settings_of_vectors_are_by_the_processor(processor, features, wanted):
    assert vectors_of(processor, features) == wanted
