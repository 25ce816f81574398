"""Mutants of shipped files: what a slip of the hand, another program or an attacker makes of them."""

from __future__ import annotations

import copy
import random
from collections.abc import Iterator
from typing import Any

import yaml

WRONG: tuple[Any, ...] = (
    *(None, True, False, 0, -1, 3, -0.0, 1e308, -1e308, 1e-300, 10**30),
    *(float("nan"), float("inf"), -float("inf")),
    *("", "x", "1", "1,5", "20,000", "é☃\u202e", "a|b", "../x", "plane", "open", "map"),
    *([], {}, [[]], [None], [1], [1, 2], [2, 1], [1, 2, 3], ["a", "a"]),
    *([[1, 2], [3, 4]], [[1, 2], [3, 4], [1, 2]], {"a": 1}, {"depth": 1}, {"x": [0, 1], "y": [0, 1]}),
)
LETTERS = ("", "\t", "é", "{", "}", "[", ":", "-", "\x00", "&a ", "*a", "!!x ", '"', "\n", ",", ";", " ")
CELLS = ("", "nan", "inf", "-9999", "1e400", "x", "1,5", '"1,5"', "1_0", "-", "é", "0", "1 000")


def of_scenario(text: str, rng: random.Random) -> str:
    """Change one to three things of a scenario, and sometimes its letters."""
    data = yaml.safe_load(text)
    for _ in range(rng.choice((1, 1, 1, 2, 3))):
        places = [path for path in _paths(data) if path]
        if not places:
            break
        _change(data, rng.choice(places), places, rng)
    written = yaml.safe_dump(data, allow_unicode=True, sort_keys=False)
    return of_letters(written, rng) if rng.random() < 0.2 else written


def of_table(text: str, rng: random.Random) -> str:
    """Change a table: a cell, a line, its separators, the order of its columns, or its letters."""
    lines = text.splitlines()
    at = rng.randrange(len(lines))
    match rng.randrange(8):
        case 0:
            cells = lines[at].split(",")
            cells[rng.randrange(len(cells))] = rng.choice(CELLS)
            lines[at] = ",".join(cells)
        case 1:
            del lines[at]
        case 2:
            lines.insert(at, lines[rng.randrange(len(lines))])
        case 3:
            mark = rng.choice(";\t |")
            lines = [line.replace(",", mark) for line in lines]
        case 4:
            lines = [",".join(reversed(line.split(","))) for line in lines]
        case 5:
            lines[1:] = lines[:0:-1]
        case 6:
            lines[0] = rng.choice(("", "a,b", "x,y,z", "distance (ft),elevation", "elevation", "d;z"))
        case _:
            return of_letters(text, rng)
    return "\n".join(lines)


def of_letters(text: str, rng: random.Random) -> str:
    """Replace up to two letters of a text, or cut it off."""
    at = rng.randrange(len(text))
    return (
        text[:at] if rng.random() < 0.1 else text[:at] + rng.choice(LETTERS) + text[at + rng.randrange(3) :]
    )


def _change(data: Any, path: tuple[Any, ...], places: list[tuple[Any, ...]], rng: random.Random) -> None:
    holder, last = _at(data, path[:-1]), path[-1]
    value = holder[last]
    match rng.randrange(8):
        case 0:
            del holder[last]
        case 1 | 2:
            holder[last] = copy.deepcopy(rng.choice(WRONG))
        case 3 if isinstance(value, int | float):
            holder[last] = rng.choice((-value, value * 1e6, value * 1e-6, str(value), [value]))
        case 4 if isinstance(value, list):
            holder[last] = rng.choice((value[::-1], value + value, value[:1], value[:-1], []))
        case 5 if isinstance(value, dict) and len(value) > 1:
            first, second = rng.sample(list(value), 2)
            value[first], value[second] = value[second], value[first]
        case 6 if isinstance(holder, dict):
            holder[rng.choice(("a", "é", "x.y", "0", "name", f"{last}s", str(last).upper()))] = value
        case _:
            holder[last] = copy.deepcopy(_at(data, rng.choice(places)))


def _at(data: Any, path: tuple[Any, ...]) -> Any:
    for key in path:
        data = data[key]
    return data


def _paths(node: Any, path: tuple[Any, ...] = ()) -> Iterator[tuple[Any, ...]]:
    yield path
    items = node.items() if isinstance(node, dict) else enumerate(node) if isinstance(node, list) else ()
    for key, value in items:
        yield from _paths(value, (*path, key))
