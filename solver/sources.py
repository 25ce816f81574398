"""The source code a module depends on, found from imports without executing any.

Compiled kernels and stored results are kept under a hash of it, so that a change of anything they are made by
is seen, and a change of anything else is not.
"""

from __future__ import annotations

import ast
import hashlib
import json
import os
import platform
import shutil
import tempfile
from collections import Counter
from collections.abc import Collection, Iterable, Iterator, Mapping
from contextlib import suppress
from dataclasses import dataclass
from functools import cache
from pathlib import Path
from time import time

ROOT = Path(__file__).parent.parent
# a name of a package that is bound where its imports do not show
UNKNOWN = "unknown name "
# of what is kept on disk for former states of the code: the newest few, and what was used lately
KEPT = 3
LATELY_SECONDS = 24 * 3600.0


@dataclass(frozen=True)
class Module:
    """One module: the hash of its code, and the modules that it imports."""

    digest: str
    imports: tuple[str, ...]


def closure(starts: Iterable[str], modules: Mapping[str, Module]) -> frozenset[str]:
    """Find the modules that some import, directly or through others, themselves included.

    An import counts wherever it stands, in a function too, but for those that are for type checking alone. A
    package counts where something that it defines itself is imported from it; what its ``__init__`` imports
    when it is executed counts always.

    Parameters
    ----------
    starts : iterable of str
        Names of modules.
    modules : mapping of str to Module
        As `modules_of` gives them.

    Raises
    ------
    ImportError
        If a module is not among them, or imports a name of a package that comes from nowhere.
    """
    found: set[str] = set()
    left = list(starts)
    while left:
        name = left.pop()
        if name in found:
            continue
        if name not in modules:
            raise ImportError(f"cannot follow the imports of {', '.join(starts)}: {name}")
        found.add(name)
        parts = name.split(".")
        above = (".".join(parts[:depth]) for depth in range(1, len(parts)))
        left += [*modules[name].imports, *(f"{package}.__init__" for package in above)]
    # what reads code has no part in what it does
    return frozenset(name for name in found - {__name__} if not name.endswith(".__init__"))


def fingerprint(names: Collection[str], modules: Mapping[str, Module]) -> str:
    """Give the SHA-256 of the code of modules, hexadecimal."""
    held = "".join(f"{name} {modules[name].digest}\n" for name in sorted(names))
    return hashlib.sha256(held.encode()).hexdigest()


@cache
def modules_of(*packages: str) -> Mapping[str, Module]:
    """List the modules of packages that lie beside this one, by name.

    ``a.b`` is a module, or what the package ``a.b`` defines itself; ``a.b.__init__`` stands for what is
    executed when the package is imported. To go through all code takes half a second; the list is kept on
    disk for the state of the files.
    """
    paths = {_name(path): path for package in packages for path in sorted((ROOT / package).rglob("*.py"))}
    sources = {name: path.read_text(encoding="utf-8") for name, path in paths.items()}
    state = platform.python_version(), Path(__file__).read_text(encoding="utf-8"), sources
    kept = None
    with suppress(OSError, ValueError):
        kept = folder() / f"sources-{hashlib.sha256(repr(state).encode()).hexdigest()[:16]}.json"
        return {name: Module(d, tuple(i)) for name, (d, i) in json.loads(kept.read_text("ascii")).items()}
    found = _look(sources, {name for name, path in paths.items() if path.name == "__init__.py"})
    if kept is not None:
        with suppress(OSError):
            sweep(kept.parent, "sources-*")
            aside = kept.with_name(f"{kept.name}.{os.getpid()}.partial")
            aside.write_text(json.dumps({name: [m.digest, m.imports] for name, m in found.items()}), "ascii")
            aside.replace(kept)
    return found


@cache
def folder() -> Path:
    """Give the folder that what is found or compiled from the code is kept in.

    Raises
    ------
    OSError
        If none can be written.
    """
    for path in (Path(__file__).parent / "__pycache__", Path(tempfile.gettempdir()) / f"lmls-{os.getuid()}"):
        with suppress(OSError):
            path.mkdir(mode=0o755, parents=True, exist_ok=True)
            # what lies in a folder of somebody else would be executed
            if os.access(path, os.W_OK) and path.stat().st_uid == os.getuid():
                return path
    raise OSError("no writable folder for compiled kernels")


def sweep(within: Path, pattern: str) -> None:
    """Remove what is kept for former states of the code, but for the newest few and what was used lately.

    Names are ``<of what>-<hash>``. A process that still uses what is removed makes it again.
    """
    ages: dict[Path, float] = {}
    for path in within.glob(pattern):
        # another process may sweep too
        with suppress(OSError):
            ages[path] = time() - path.stat().st_mtime
    newer: Counter[str] = Counter()
    for path in sorted(ages, key=ages.__getitem__):
        what = path.name.rpartition("-")[0]
        newer[what] += 1
        if newer[what] <= KEPT or ages[path] < LATELY_SECONDS:
            continue
        if path.is_dir():
            shutil.rmtree(path, ignore_errors=True)
        else:
            with suppress(OSError):
                path.unlink()


def use(path: Path) -> None:
    """Note that something is used, so that it is not swept."""
    with suppress(OSError):
        if time() - path.stat().st_mtime > LATELY_SECONDS / 24:
            os.utime(path)


def code(source: str) -> str:
    """Give source code without comments, docstrings and imports for type checking."""
    return _plain(_Executed().visit(ast.parse(source)))


def _plain(tree: ast.AST) -> str:
    for node in ast.walk(tree):
        if isinstance(node, ast.Module | ast.ClassDef | ast.FunctionDef | ast.AsyncFunctionDef):
            match node.body:
                case [ast.Expr(ast.Constant(str())), *rest]:
                    node.body = rest
    return ast.unparse(tree)


class _Executed(ast.NodeTransformer):
    """Leaves out what is for type checking alone."""

    def visit_If(self, node: ast.If) -> ast.AST | list[ast.stmt]:
        self.generic_visit(node)
        match node.test:
            case ast.Name("TYPE_CHECKING") | ast.Attribute(attr="TYPE_CHECKING"):
                return node.orelse
        return node


def _name(path: Path) -> str:
    parts = path.relative_to(ROOT).with_suffix("").parts
    return ".".join(parts[:-1] if parts[-1] == "__init__" else parts)


def _look(sources: Mapping[str, str], packages: Collection[str]) -> dict[str, Module]:
    """Find code and imports of modules, of which some are the ``__init__`` of packages."""
    handing_on = {name: ast.parse(sources[name]) for name in packages}
    found = {}
    for name, source in sources.items():
        executed = _Executed().visit(ast.parse(source))
        imports = tuple(dict.fromkeys(_imports(name, executed, sources, handing_on)))
        found[name] = Module(hashlib.sha256(_plain(executed).encode()).hexdigest(), imports)
        if name in packages:
            found[f"{name}.__init__"] = Module("", imports)
    return found


def _imports(
    module: str, tree: ast.AST, names: Collection[str], packages: Mapping[str, ast.Module]
) -> Iterator[str]:
    """Go through the modules that a tree imports; ``packages`` holds the trees of each ``__init__``."""
    own = {name.partition(".")[0] for name in names}
    for node in ast.walk(tree):
        if isinstance(node, ast.Import):
            for alias in node.names:
                if alias.name.partition(".")[0] in own:
                    yield alias.name
                    if alias.name in packages:
                        # any of its names may be used
                        yield from _imports(alias.name, packages[alias.name], names, packages)
        elif isinstance(node, ast.ImportFrom):
            origin = _origin(module, node, packages)
            if origin.partition(".")[0] in own:
                yield from (_bound(origin, alias.name, names, packages) for alias in node.names)


def _origin(module: str, node: ast.ImportFrom, packages: Collection[str]) -> str:
    """Give the module that names are imported from, by its full name."""
    if not node.level:
        return str(node.module)
    parts = module.split(".")
    above = parts[: len(parts) - node.level + (module in packages)]
    return ".".join([*above, *([node.module] if node.module else [])])


def _bound(origin: str, name: str, names: Collection[str], packages: Mapping[str, ast.Module]) -> str:
    """Give the module that an imported name is of, through packages that only hand it on.

    What a package gives lazily it imports for type checking, which shows where it is from.
    """
    if f"{origin}.{name}" in names:
        return f"{origin}.{name}"
    if origin not in packages:
        return origin
    for node in ast.walk(packages[origin]):
        match node:
            case ast.ImportFrom():
                for alias in node.names:
                    if name == (alias.asname or alias.name):
                        return _bound(_origin(origin, node, packages), alias.name, names, packages)
            case ast.FunctionDef() | ast.ClassDef() if node.name == name:
                return origin
            case ast.Name(ident, ast.Store()) if ident == name:
                return origin
    return f"{UNKNOWN}{name} of {origin}"
