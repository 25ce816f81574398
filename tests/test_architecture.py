"""The structure of the code: what imports what, and how large folders are."""

import ast
import subprocess
import sys
from collections import defaultdict
from collections.abc import Iterator
from pathlib import Path

import pytest
from root import ROOT

import pipeline

MOST_MODULES = 15
FORMS = ("solver.lattice", "solver.cloud", "solver.collocation")
# from the bottom up: each imports from those before it alone
LAYERS = (
    "solver.emulator",
    *("solver.physics", "solver.points", "solver.release", "solver.inflow", "solver.lmls", "solver.kernels"),
    *(FORMS, "solver.surface", "solver.checks", "solver.verification"),
    *(
        "pipeline.mistakes",
        "pipeline.hints",
        "pipeline.errors",
        "pipeline.readable",
        "pipeline.store",
        "pipeline.settings",
        "pipeline.inputs",
        "pipeline.scenario",
    ),
    *("pipeline.runs", "pipeline.batch", "pipeline.assess", "pipeline.gis"),
    *("pipeline.hazard", "pipeline.emulation", "pipeline.report"),
    *(
        "pipeline.results",
        "pipeline.api",
        "pipeline",
        "pipeline.studies",
        "pipeline.cli",
        "pipeline.__main__",
    ),
)
HEIGHT = {
    name: i for i, layer in enumerate(LAYERS) for name in ([layer] if isinstance(layer, str) else layer)
}


def modules() -> dict[str, Path]:
    """Every module of the product by its dotted name."""
    found = {}
    for package in ("solver", "pipeline"):
        for path in (ROOT / package).rglob("*.py"):
            parts = path.relative_to(ROOT).with_suffix("").parts
            found[".".join(parts[:-1] if parts[-1] == "__init__" else parts)] = path
    return found


MODULES = modules()


def imported(path: Path) -> Iterator[str]:
    """Modules of the product that a file imports, inside functions and for type checkers too."""
    for node in ast.walk(ast.parse(path.read_text(encoding="utf-8"))):
        if isinstance(node, ast.Import):
            yield from (alias.name for alias in node.names if alias.name in MODULES)
        elif isinstance(node, ast.ImportFrom) and node.module in MODULES:
            for alias in node.names:
                full = f"{node.module}.{alias.name}"
                yield full if full in MODULES else node.module


def package(module: str) -> str:
    """Name of the package that a module is in; one at the root stands for itself."""
    if MODULES[module].name == "__init__.py":
        return module
    parent = module.rpartition(".")[0]
    return parent if "." in parent else module


def arrows() -> dict[str, dict[str, list[str]]]:
    """Imports between packages: from, to, and which modules."""
    found: dict[str, dict[str, list[str]]] = defaultdict(lambda: defaultdict(list))
    for module, path in MODULES.items():
        for other in imported(path):
            start, end = package(module), package(other)
            if start != end:
                found[start][end].append(f"{module} imports {other}")
    return found


ARROWS = arrows()


def reached_from(start: str) -> set[str]:
    seen: set[str] = set()
    waiting = [start]
    while waiting:
        for other in ARROWS.get(waiting.pop(), {}):
            if other not in seen:
                seen.add(other)
                waiting.append(other)
    return seen


def test_every_import_within_the_product_is_found():
    # a walk that sees nothing would find no circle either
    assert len(MODULES) > 100
    assert "pipeline.store" in ARROWS["pipeline.batch"]
    assert "solver.kernels" in ARROWS["solver.lattice"]


def test_no_packages_import_each_other_in_a_circle():
    circles = [
        line
        for start, others in ARROWS.items()
        for other, lines in others.items()
        if start in reached_from(other)
        for line in lines
    ]
    assert not circles, "\n".join(circles)


def test_the_three_forms_know_nothing_of_each_other():
    for form in FORMS:
        assert not set(FORMS) & set(ARROWS[form]), form


def test_packages_import_only_from_the_layers_below():
    upward = [
        line
        for start, others in ARROWS.items()
        for other, lines in others.items()
        if start in HEIGHT and other in HEIGHT and HEIGHT[start] < HEIGHT[other]
        for line in lines
    ]
    assert not upward, "\n".join(upward)


def test_every_package_of_the_pipeline_has_its_layer():
    there = {name for name in map(package, MODULES) if name.count(".") <= 1 and name.startswith("pipeline")}
    assert there <= {*HEIGHT}


def test_the_solver_knows_nothing_of_the_pipeline():
    upward = [
        name for start, others in ARROWS.items() for name in others if start[:6] == "solver" != name[:6]
    ]
    assert not upward


def test_no_folder_has_more_modules_than_one_can_look_over():
    sizes: dict[Path, int] = defaultdict(int)
    for path in MODULES.values():
        sizes[path.parent] += path.name != "__init__.py"
    assert not {str(folder): size for folder, size in sizes.items() if size > MOST_MODULES}


@pytest.mark.parametrize("name", pipeline.__all__)
def test_public_names_are_there_and_no_module_shadows_them(name):
    assert getattr(pipeline, name).__name__ == name
    assert name in dir(pipeline)
    # importing pipeline.<name> would put the module in the place of the function
    assert f"pipeline.{name}" not in MODULES


def test_an_unknown_name_is_no_attribute():
    with pytest.raises(AttributeError, match="no attribute 'nothing'"):
        pipeline.nothing  # noqa: B018 - the access is what is tested


def test_importing_the_package_loads_nothing_that_takes_long():
    heavy = "{'numba', 'xarray', 'dask', 'distributed', 'numpy', 'pandas', 'matplotlib'}"
    code = f"import sys, pipeline; dir(pipeline); print({heavy} & set(sys.modules))"
    loaded = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert loaded.stdout.strip() == "set()"


def test_checking_scenarios_loads_no_kernels_and_no_arrays_of_others(tmp_path):
    heavy = "{'numba', 'xarray', 'dask', 'distributed', 'pandas', 'matplotlib'}"
    files = [str(path) for path in sorted((ROOT / "scenarios").glob("*.yaml"))]
    code = f"import sys, pipeline; pipeline.load({files}); print({heavy} & set(sys.modules))"
    loaded = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert loaded.stdout.strip() == "set()"
