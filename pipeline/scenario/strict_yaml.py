"""A strict reader of YAML: 1.2 core scalars, no duplicate keys, and the place of everything."""

from __future__ import annotations

import re
from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Any

import yaml

from pipeline.mistakes import Mistake

Path = tuple[str | int, ...]
_TAG = "tag:yaml.org,2002:"
_LONGEST_INTEGER = 19
_INTEGER = re.compile(r"[-+]?[0-9]+|0o[0-7]+|0x[0-9a-fA-F]+")
_FLOAT = re.compile(r"[-+]?(\.[0-9]+|[0-9]+(\.[0-9]*)?)([eE][-+]?[0-9]+)?")
_INFINITE = re.compile(r"[-+]?\.(inf|Inf|INF)")
_WORDS: Mapping[str, Any] = {
    **dict.fromkeys(("", "~", "null", "Null", "NULL")),
    **dict.fromkeys(("true", "True", "TRUE"), True),
    **dict.fromkeys(("false", "False", "FALSE"), False),
    **dict.fromkeys((".nan", ".NaN", ".NAN"), float("nan")),
}


@dataclass(frozen=True)
class Place:
    """A place in a file, counted from 1."""

    line: int
    column: int


@dataclass(frozen=True)
class Document:
    """One file as read.

    Parameters
    ----------
    data : dict[str, Any]
        Its mapping, lists as tuples; empty where the text was no YAML mapping.
    keys, values : dict[Path, Place]
        The place of each key and of each value by its path, ``("release", 0, "volume")``; an item of a
        list has the same place in both.
    mistakes : list[Mistake]
        All that was wrong with it as YAML.
    no_file : bool
        Whether nobody has seen the text, so that mistakes have no place in it.
    """

    file: str
    data: dict[str, Any] = field(default_factory=dict)
    keys: dict[Path, Place] = field(default_factory=dict)
    values: dict[Path, Place] = field(default_factory=dict)
    mistakes: list[Mistake] = field(default_factory=list)
    no_file: bool = False

    def mistake(self, path: Path, message: str, *, at_key: bool = False) -> Mistake:
        """Make a mistake about a path, at its value or its key, or at the nearest thing above it."""
        places = self.keys if at_key else self.values
        for length in range(len(path), 0, -1):
            if place := places.get(path[:length]):
                break
            places = self.keys
        else:
            place = Place(1, 1)
        if self.no_file:
            place = Place(0, 0)
        return Mistake(self.file, place.line, place.column, ".".join(map(str, path)), message)


def parse(text: str, file: str) -> Document:
    """Read the one YAML mapping that a text holds; ``file`` is the name that mistakes show."""
    document = Document(file)
    try:
        root = yaml.compose(text, Loader=_Loader)
    except yaml.MarkedYAMLError as error:
        mark = error.problem_mark or error.context_mark
        place = Place(mark.line + 1, mark.column + 1) if mark else Place(1, 1)
        why = ", ".join(part for part in (error.context, error.problem) if part)
        found = f"expected YAML, found a fault ({why})"
        document.mistakes.append(Mistake(file, place.line, place.column, "", found))
        return document
    except yaml.reader.ReaderError as error:
        before = text[: error.position]
        line, column = before.count("\n") + 1, error.position - before.rfind("\n")
        found = f"expected YAML, found the unprintable character #x{error.character:04x}"
        document.mistakes.append(Mistake(file, line, column, "", found))
        return document
    if root is None:
        document.mistakes.append(Mistake(file, 1, 1, "", "expected a mapping of keys, found an empty file"))
        return document
    data = _Construction(document).value(root, ())
    if isinstance(data, dict):
        document.data.update(data)
    elif not document.mistakes:
        found = "a list" if isinstance(data, tuple) else "a single value"
        document.mistakes.append(document.mistake((), f"expected a mapping of keys, found {found}"))
    return document


class _Loader(yaml.SafeLoader):
    """Composes nodes with plain scalars left unresolved, and refuses aliases."""

    yaml_implicit_resolvers: dict[str, Any] = {}  # noqa: RUF012 - as the base class has it

    def compose_node(self, parent: yaml.Node | None, index: Any) -> yaml.Node | None:
        if self.check_event(yaml.AliasEvent):
            mark = self.peek_event().start_mark  # type: ignore[no-untyped-call]
            raise yaml.composer.ComposerError(None, None, "aliases are not allowed", mark)
        return super().compose_node(parent, index)


class _Construction:
    """Turns nodes into data, noting places and mistakes in a document."""

    def __init__(self, document: Document) -> None:
        self.document = document

    def value(self, node: yaml.Node, path: Path) -> Any:
        """Construct the value of a node and of all below it."""
        self.document.values[path] = _place(node)
        if isinstance(node, yaml.MappingNode) and node.tag == _TAG + "map":
            return self._mapping(node, path)
        if isinstance(node, yaml.SequenceNode) and node.tag == _TAG + "seq":
            for i, item in enumerate(node.value):
                self.document.keys[(*path, i)] = _place(item)
            return tuple(self.value(item, (*path, i)) for i, item in enumerate(node.value))
        if isinstance(node, yaml.ScalarNode) and node.tag == _TAG + "str":
            return node.value if node.style else _plain(node.value)
        self._complain(path, f"expected a plain value, found the tag {node.tag}")
        return None

    def _mapping(self, node: yaml.MappingNode, path: Path) -> dict[str, Any]:
        data: dict[str, Any] = {}
        for key_node, value_node in node.value:
            place = _place(key_node)
            if not isinstance(key_node, yaml.ScalarNode) or not isinstance(key_node.value, str):
                self._complain(path, "expected text as a key, found a list or mapping", place)
                continue
            key = key_node.value
            if key in data:
                first = self.document.keys[(*path, key)]
                self._complain(
                    (*path, key),
                    f"expected each key once, found it again after line {first.line}, column {first.column}",
                    place,
                )
                continue
            self.document.keys[(*path, key)] = place
            data[key] = self.value(value_node, (*path, key))
        return data

    def _complain(self, path: Path, message: str, place: Place | None = None) -> None:
        place = place or self.document.values[path]
        key = ".".join(map(str, path))
        self.document.mistakes.append(Mistake(self.document.file, place.line, place.column, key, message))


def _place(node: yaml.Node) -> Place:
    return Place(node.start_mark.line + 1, node.start_mark.column + 1)


def _plain(text: str) -> Any:
    """Resolve a plain scalar by the YAML 1.2 core schema."""
    if text in _WORDS:
        return _WORDS[text]
    if _INTEGER.fullmatch(text) and len(text) < _LONGEST_INTEGER:
        return int(text, 0) if text[:2] in ("0o", "0x") else int(text)
    if _FLOAT.fullmatch(text):
        return float(text)
    if _INFINITE.fullmatch(text):
        return float(text.replace(".", ""))
    return text
