"""Elementary functions in whole vectors, against those of extended precision."""

import numpy as np
import pytest

from solver.compiled import kernel
from solver.elementary import exponential, exponential_less_1, inverse_cube_root, logarithm

ROUND_OFF = np.finfo(float).eps


def over(function):
    """Compile a loop of it, in whole vectors."""

    @kernel(from_python=True, unaliased=True, cached=False)
    def fill(x, found):
        for i in range(len(x)):
            found[i] = function(x[i])

    return fill


inverse_cube_roots, exponentials_less_1 = over(inverse_cube_root), over(exponential_less_1)
exponentials, logarithms = over(exponential), over(logarithm)


def of(function, x):
    found = np.empty_like(x)
    function(x, found)
    return found


def rng():
    return np.random.default_rng(7)


def test_an_inverse_cube_root_has_all_its_digits():
    x = np.concatenate([10.0 ** rng().uniform(-290, 300, 100_000), 2.0 ** np.arange(-900, 900)])
    exact = 1 / np.cbrt(x.astype(np.longdouble))
    assert np.abs(of(inverse_cube_roots, x) / exact - 1).max() < 1.5 * ROUND_OFF


def test_an_inverse_cube_root_of_nothing_is_finite():
    assert np.isfinite(of(inverse_cube_roots, np.array([0.0, 5e-324, 1e-310]))).all()


@pytest.mark.parametrize(
    "x",
    [
        -(10.0 ** rng().uniform(-300, 2.8, 100_000)),
        # around halves of ln 2, where the power of 2 changes
        -np.log(2) * (0.5 + np.arange(60)[:, None] + np.linspace(-1e-9, 1e-9, 50)).ravel(),
        -np.linspace(0, 3, 50_001)[1:],
    ],
    ids=["small and large", "changes", "near"],
)
def test_an_exponential_less_1_has_all_its_digits(x):
    exact = np.expm1(x.astype(np.longdouble))
    assert np.abs(of(exponentials_less_1, x) / exact - 1).max() < 1.5 * ROUND_OFF


def test_an_exponential_less_1_of_0_and_of_what_has_none():
    assert of(exponentials_less_1, np.array([0.0, -708.0, -1e6, -1e300])).tolist() == [0.0, -1.0, -1.0, -1.0]


def test_an_exponential_has_all_its_digits():
    x = np.concatenate([rng().uniform(-700, 700, 100_000), rng().uniform(-1, 1, 100_000), [0.0]])
    exact = np.exp(x.astype(np.longdouble))
    assert np.abs(of(exponentials, x) / exact - 1).max() < 1.5 * ROUND_OFF


def test_a_logarithm_has_all_its_digits():
    x = np.concatenate([10.0 ** rng().uniform(-290, 300, 100_000), 1 + rng().uniform(-0.3, 0.45, 100_000)])
    exact = np.log(x.astype(np.longdouble))
    assert np.abs(of(logarithms, x) / exact - 1).max() < 1.5 * ROUND_OFF
    assert of(logarithms, np.array([1.0])).tolist() == [0.0]
