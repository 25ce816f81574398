"""What decides a run besides its scenario: the code that computes it, and the libraries beneath it.

Which code that is, its imports say (see `solver.sources`).
"""

from __future__ import annotations

import hashlib
import platform
from collections.abc import Mapping
from functools import cache
from importlib.metadata import version

from solver import sources

# what makes the scene of a run and has it computed, and what makes stored values of the result
COMPUTING = "pipeline.runs.scene_of_run"
STORING = "pipeline.runs.stored_values"
PACKAGES = ("lmls", "numpy", "scipy", "numba", "xarray", "zarr")
# What may change the solution of a run; a store keeps to one of each.
BINDING = {
    "solver_hash": "solver",
    "numpy_version": "NumPy",
    "scipy_version": "SciPy",
    "numba_version": "Numba",
}


@cache
def made_by() -> dict[str, str]:
    """Attributes of a store that say what makes it."""
    return {
        "solver_hash": solver_hash(),
        "summary_hash": summary_hash(),
        "python_version": platform.python_version(),
        **{f"{name}_version": version(name) for name in PACKAGES},
    }


def environment() -> dict[str, str]:
    """Give what a driver and its workers must have in common."""
    return {**made_by(), **{f"{name}_version": version(name) for name in ("dask", "distributed")}}


def differences(before: Mapping[str, object]) -> list[str]:
    """Say what of the attributes of a store is binding and is not so here: ``NumPy: was 2.1, is 2.2``."""
    here = made_by()
    return [
        f"{name}: was {short(before.get(key))}, is {short(here[key])}"
        for key, name in BINDING.items()
        if before.get(key) != here[key]
    ]


def identity(scenario_hash: str) -> str:
    """Hash of all that decides the values of a scenario's runs, hexadecimal."""
    held = [scenario_hash, *(made_by()[key] for key in BINDING)]
    return hashlib.sha256("\n".join(held).encode()).hexdigest()


def short(value: object) -> str:
    """Shorten a hash, for people to read; ``unknown`` where there is none."""
    return "unknown" if value is None else str(value)[:12]


def computing() -> frozenset[str]:
    """Names of the modules that compute a run: the solver, and what makes its scene."""
    return sources.closure([COMPUTING], sources.modules_of("solver", "pipeline"))


def storing() -> frozenset[str]:
    """Names of the modules that make the stored values of a run from its result."""
    return sources.closure([STORING], sources.modules_of("solver", "pipeline")) - computing()


def solver_hash() -> str:
    """SHA-256 of the code that computes a run.

    A declared version would hold only as long as nobody forgets to raise it. Docstrings and comments do not
    count: better words are no reason to compute for days again.
    """
    return sources.fingerprint(computing(), sources.modules_of("solver", "pipeline"))


def summary_hash() -> str:
    """SHA-256 of the code that makes the stored values of a run from its result.

    It is recorded and not binding: a further summary is no reason to refuse the runs that lack it.
    """
    return sources.fingerprint(storing(), sources.modules_of("solver", "pipeline"))
