"""What ``import solver`` gives."""

import subprocess
import sys
from importlib.util import find_spec

import pytest

import solver


@pytest.mark.parametrize("name", solver.__all__)
def test_a_public_name_is_there_and_no_module_of_the_package_has_it(name):
    assert getattr(solver, name) is not None
    assert find_spec(f"solver.{name}") is None
    assert name in dir(solver)


def test_another_name_is_no_attribute():
    with pytest.raises(AttributeError, match="no attribute 'Sphere'"):
        _ = solver.Sphere


def test_importing_the_package_loads_nothing_heavy():
    heavy = "import sys, solver; print({*'numba scipy numpy xarray dask'.split()} & {*sys.modules})"
    shown = subprocess.run([sys.executable, "-c", heavy], capture_output=True, text=True, check=True)
    assert shown.stdout.strip() == "set()"
