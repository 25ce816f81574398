"""The code that a module depends on: found through imports, kept for each state of the files, and swept."""

import ast
import os
from time import time

import pytest

from solver import sources
from solver.sources import KEPT, LATELY_SECONDS, Module, closure, code, fingerprint, modules_of, sweep

FILES = {
    "box/__init__.py": """
from typing import TYPE_CHECKING
if TYPE_CHECKING:
    from box.wall import Wall
    from box.shapes import sphere as ball
SIDES = 6
""",
    "box/wall.py": "from __future__ import annotations\nfrom .material import brick\nclass Wall: pass\n",
    "box/material.py": "brick = 1\n",
    "box/shapes/__init__.py": "from box.shapes.round import sphere\n",
    "box/shapes/round.py": "sphere = 1\n",
    "box/unused.py": "import os\n",
    "user/__init__.py": "",
    "user/direct.py": "import numpy\nfrom box.wall import Wall\n",
    "user/lazily.py": "from box import Wall\n",
    "user/renamed.py": "from box import ball\n",
    "user/whole.py": "import box\n",
    "user/own.py": "from box import SIDES\n",
    "user/within.py": "def f():\n    from box import material\n    return material\n",
    "user/typed.py": "import typing\nif typing.TYPE_CHECKING: import box.wall\nelse: import box.unused\n",
    "user/nowhere.py": "from box import door\n",
}


@pytest.fixture
def modules(tmp_path, monkeypatch):
    """Write packages and list their modules, anew each time."""
    monkeypatch.setattr(sources, "ROOT", tmp_path)
    monkeypatch.setattr(sources, "folder", lambda: tmp_path)

    def listed(**changed):
        for name, text in {**FILES, **changed}.items():
            path = tmp_path / name
            path.parent.mkdir(parents=True, exist_ok=True)
            path.write_text(text)
        return modules_of.__wrapped__("box", "user")

    return listed


@pytest.mark.parametrize(
    ("name", "expected"),
    [
        ("direct", {"box.wall", "box.material"}),
        ("lazily", {"box.wall", "box.material"}),
        ("renamed", {"box.shapes.round"}),
        ("whole", {"box", "box.wall", "box.material", "box.shapes.round"}),
        ("own", {"box"}),
        ("within", {"box.material"}),
        ("typed", {"box.unused"}),
    ],
)
def test_imports_are_followed(modules, name, expected):
    assert closure([f"user.{name}"], modules()) == expected | {f"user.{name}"}


def test_what_a_package_imports_when_it_is_executed_counts(modules):
    listed = modules(**{"box/__init__.py": "import box.unused\n"})
    assert closure(["user.direct"], listed) >= {"box.unused"}


def test_a_name_that_comes_from_nowhere_is_refused(modules):
    with pytest.raises(ImportError, match=r"user\.nowhere: unknown name door of box"):
        closure(["user.nowhere"], modules())


def test_code_counts_and_words_about_it_do_not():
    plain = 'x = 1\ndef f(a):\n    return a + "b"\n'
    worded = (
        '"""Words."""\nfrom typing import TYPE_CHECKING\nif TYPE_CHECKING:\n    import os\n'
        'x = 1  # one\n\n\ndef f(a):\n    """More."""\n    # why\n    return a + "b"\n'
    )
    assert code(worded) == "from typing import TYPE_CHECKING\n" + code(plain)
    assert code(plain) != code(plain.replace("1", "2"))
    assert code(plain) != code(plain.replace('"b"', '"c"'))


def test_the_fingerprint_changes_with_code_alone(modules):
    names = ["box.wall", "box.material"]
    before = fingerprint(names, modules())
    assert fingerprint(names, modules(**{"box/material.py": '"""Words."""\nbrick = 1  # one\n'})) == before
    assert fingerprint(names, modules(**{"box/unused.py": "import sys\n"})) == before
    assert fingerprint(names, modules(**{"box/material.py": "brick = 2\n"})) != before
    assert fingerprint(names[:1], modules()) != before


def test_what_was_found_is_kept_for_the_state_of_the_files(modules, tmp_path, monkeypatch):
    found = modules()
    (kept,) = tmp_path.glob("sources-*.json")

    def never(*given):
        raise AssertionError("went through the code again")

    with monkeypatch.context() as looked:
        looked.setattr(sources, "_look", never)
        assert modules() == found
    modules(**{"box/material.py": "brick = 2\n"})
    assert len(list(tmp_path.glob("sources-*.json"))) == 2
    kept.write_text("torn")
    assert modules() == found


def test_where_nothing_can_be_kept_it_is_found_each_time(modules, monkeypatch):
    found = modules()

    def refused():
        raise PermissionError("read-only")

    monkeypatch.setattr(sources, "folder", refused)
    assert modules() == found


def test_the_newest_and_what_was_used_lately_are_not_swept(tmp_path):
    def kept(name, hours):
        (tmp_path / name).mkdir()
        (tmp_path / name / "index").write_text("")
        os.utime(tmp_path / name, (time() - 3600 * hours,) * 2)

    old = LATELY_SECONDS / 3600 + 1
    for i in range(KEPT + 2):
        kept(f"kernels-lattice.residual-{i}", old + i)
    for i in range(KEPT + 2):
        kept(f"kernels-cloud.residual-{i}", i)
    kept("other-1", 10 * old)
    sweep(tmp_path, "kernels-*")
    left = {path.name for path in tmp_path.iterdir()}
    assert left == {
        "other-1",
        *(f"kernels-lattice.residual-{i}" for i in range(KEPT)),
        *(f"kernels-cloud.residual-{i}" for i in range(KEPT + 2)),
    }


def test_packages_compute_nothing_when_they_are_imported():
    """A package's own code is not part of what its modules depend on; it may only give names."""
    modules = modules_of("solver", "pipeline")
    packages = [name.removesuffix(".__init__") for name in modules if name.endswith(".__init__")]
    assert {"solver", "solver.kernels", "pipeline.runs"} <= set(packages)
    for name in packages:
        tree = ast.parse((sources.ROOT / name.replace(".", "/") / "__init__.py").read_text())
        for node in tree.body:
            match node:
                case ast.Expr(ast.Constant(str())) | ast.Import() | ast.ImportFrom() | ast.FunctionDef():
                    pass
                case ast.If(ast.Name("TYPE_CHECKING")) | ast.Assign() | ast.AnnAssign():
                    pass
                case _:
                    pytest.fail(f"{name}: {ast.unparse(node)}")


def test_kernels_are_kept_by_what_their_module_depends_on(monkeypatch, tmp_path):
    from solver import compiled

    listed = {
        "solver.lattice.a": Module("1", ("solver.kernels.b",)),
        "solver.kernels.b": Module("2", ()),
        "solver.cloud.c": Module("3", ()),
        "solver.__init__": Module("", ()),
        "solver.lattice.__init__": Module("", ()),
        "solver.kernels.__init__": Module("", ()),
        "solver.cloud.__init__": Module("", ()),
    }

    def folders(**changed):
        found = {**listed, **{name.replace("__", "."): Module(d, listed[name.replace("__", ".")].imports)
                              for name, d in changed.items()}}  # fmt: skip
        monkeypatch.setattr(sources, "modules_of", lambda *packages: found)
        monkeypatch.setattr(sources, "folder", lambda: tmp_path)
        names = ("solver.lattice.a", "solver.kernels.b", "solver.cloud.c", "elsewhere")
        return [compiled.cache_directory.__wrapped__(name) for name in names]

    before = folders()
    assert all(folder.is_dir() for folder in before)
    assert folders() == before
    changed = [a != b for a, b in zip(folders(solver__kernels__b="4"), before, strict=True)]
    assert changed == [True, True, False, True]
