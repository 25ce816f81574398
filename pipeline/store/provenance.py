"""What decides a run besides its scenario: the solver's code, and the libraries beneath it."""

from __future__ import annotations

import ast
import hashlib
import platform
from collections.abc import Mapping
from contextlib import suppress
from functools import cache
from importlib.metadata import version
from pathlib import Path

from pipeline.store.storage import put

# Modules of this package that turn settings into a scene, or a result into what the store holds.
DECISIVE = (
    "runs.ending",
    "runs.runs",
    "runs.shared_points",
    "runs.summary",
    "runs.template",
    "runs.threshold",
    "scenario.solver_objects",
    "batch.task",
)
PACKAGES = ("lmls", "numpy", "scipy", "numba", "xarray", "zarr")
# What may change a value; a store keeps to one of each.
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
        "solver_hash": _solver_hash(),
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


def _solver_hash() -> str:
    """SHA-256 of the solver's code and of the modules around it that decide a run's values.

    A declared version would hold only as long as nobody forgets to raise it. Docstrings and comments do not
    count: better words are no reason to compute for days again.
    """
    here = Path(__file__).parent
    pipeline = here.parent
    solver = pipeline.parent / "solver"
    paths = [
        *(path for path in sorted(solver.rglob("*.py")) if "verification" not in path.parts),
        *((pipeline / name.replace(".", "/")).with_suffix(".py") for name in DECISIVE),
    ]
    sources = {str(path.relative_to(pipeline.parent)): path.read_text(encoding="utf-8") for path in paths}
    # to go through all code takes half a second, and it rarely changes
    decides = platform.python_version(), Path(__file__).read_text(encoding="utf-8"), sources
    kept = here / "__pycache__" / f"solver-{hashlib.sha256(repr(decides).encode()).hexdigest()}"
    with suppress(OSError):
        return kept.read_text(encoding="ascii")
    digest = hashlib.sha256()
    for name, source in sources.items():
        digest.update(f"{name}\n{code(source)}\n".encode())
    with suppress(OSError):
        kept.parent.mkdir(exist_ok=True)
        put(kept, digest.hexdigest().encode())
    return digest.hexdigest()


def code(source: str) -> str:
    """Give source code without its comments and docstrings."""
    tree = ast.parse(source)
    for node in ast.walk(tree):
        if isinstance(node, ast.Module | ast.ClassDef | ast.FunctionDef | ast.AsyncFunctionDef):
            match node.body:
                case [ast.Expr(ast.Constant(str())), *rest]:
                    node.body = rest
    return ast.unparse(tree)
