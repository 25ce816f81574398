"""Docstrings of the public faces name every parameter, in numpy style."""

import dataclasses
import inspect
import re

import pytest

import pipeline
import solver

PUBLIC = [(face, name) for face in (solver, pipeline) for name in face.__all__]


def named(doc: str) -> set[str]:
    """Names that stand in the section of parameters."""
    section = re.search(r"Parameters\n-{10}\n(.*?)(?:\n\n\w+\n---|$)", doc, re.DOTALL)
    heads = re.findall(r"^(\w[\w, ]*) :", section[1], re.MULTILINE) if section else []
    return {name.strip() for head in heads for name in head.split(",")}


@pytest.mark.parametrize(("face", "name"), PUBLIC, ids=[f"{face.__name__}.{name}" for face, name in PUBLIC])
def test_docstrings_say_what_each_parameter_is(face, name):
    found = getattr(face, name)
    doc = inspect.getdoc(found) or ""
    assert doc
    if dataclasses.is_dataclass(found):
        expected = {each.name for each in dataclasses.fields(found) if each.init}
    elif inspect.isclass(found) and issubclass(found, Exception):
        return
    else:
        expected = {*inspect.signature(found).parameters} - {"self"}
    assert expected <= named(doc)
    if inspect.isfunction(found) and name != "compile_kernels":
        assert "\nReturns\n" in doc
