# ruff: noqa: E501 - a message is one line
import math

import pytest

from pipeline.scenario.strict_yaml import Place, parse


@pytest.mark.parametrize(
    ("text", "value"),
    [
        ("1e3", 1000.0),
        ("1.5", 1.5),
        (".5", 0.5),
        ("+3", 3),
        ("007", 7),
        ("0x1F", 31),
        ("0o17", 15),
        ("no", "no"),
        ("on", "on"),
        ("true", True),
        ("False", False),
        ("~", None),
        ("null", None),
        ("'null'", "null"),
        ("'1'", "1"),
        ("1_000", "1_000"),
        ("12:30:00", "12:30:00"),
        ("2004-01-01", "2004-01-01"),
        ("<<", "<<"),
        ("=", "="),
        ("-.inf", -math.inf),
        ("[1, [2]]", (1, (2,))),
        ("{b: 1}", {"b": 1}),
    ],
)
def test_values_follow_the_core_schema_of_yaml_1_2(text, value):
    document = parse(f"a: {text}\n", "f")
    assert document.mistakes == []
    assert document.data == {"a": value}
    assert type(document.data["a"]) is type(value)


def test_not_a_number_is_read_so_that_it_can_be_refused_with_its_place():
    document = parse("a: .nan", "f")
    assert math.isnan(document.data["a"])
    assert document.values[("a",)] == Place(1, 4)


def test_every_key_and_value_has_its_place():
    document = parse("a: 1\nb:\n  c: [x, {d: 2}]\n", "f")
    assert document.keys == {
        ("a",): Place(1, 1),
        ("b",): Place(2, 1),
        ("b", "c"): Place(3, 3),
        ("b", "c", 0): Place(3, 7),
        ("b", "c", 1): Place(3, 10),
        ("b", "c", 1, "d"): Place(3, 11),
    }
    assert document.values[("b", "c", 1, "d")] == Place(3, 14)
    assert document.values[("b",)] == Place(3, 3)


def test_a_mistake_without_a_place_of_its_own_is_put_to_what_holds_it():
    document = parse("a: 1\nb: {c: 2}", "f")
    assert str(document.mistake(("b", "d", 3), "wrong")) == "f:2:1: b.d.3: wrong"
    assert str(document.mistake(("d",), "wrong")) == "f:1:1: d: wrong"


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("", "1:1: expected a mapping of keys, found an empty file"),
        ("# nothing\n", "1:1: expected a mapping of keys, found an empty file"),
        ("word", "1:1: expected a mapping of keys, found a single value"),
        ("- 1", "1:1: expected a mapping of keys, found a list"),
        ("a: b: c", "1:5: expected YAML, found a fault (mapping values are not allowed here)"),
        ("a: 'b", "1:6: expected YAML, found a fault (while scanning a quoted scalar, found unexpected end of stream)"),
        ("a: \x01", "1:4: expected YAML, found the unprintable character #x0001"),
        ("b: 1\na: x\x01", "2:5: expected YAML, found the unprintable character #x0001"),
        ("a: &x 1\nb: *x", "2:4: expected YAML, found a fault (aliases are not allowed)"),
        ("a: 1\n---\nb: 2", "2:1: expected YAML, found a fault (expected a single document in the stream, but found another document)"),
        ("a: !!set {b}", "1:4: a: expected a plain value, found the tag tag:yaml.org,2002:set"),
        ("a: !thing 1", "1:4: a: expected a plain value, found the tag !thing"),
        ("? [1]\n: 2", "1:3: expected text as a key, found a list or mapping"),
        ("a: 1\n'a': 2", "2:1: a: expected each key once, found it again after line 1, column 1"),
        ("b:\n- {c: 1, c: 2}", "2:10: b.0.c: expected each key once, found it again after line 2, column 4"),
    ],
)  # fmt: skip
def test_what_is_no_strict_yaml_is_told_with_its_place(text, message):
    assert [str(mistake) for mistake in parse(text, "f").mistakes] == [f"f:{message}"]


def test_all_duplicate_keys_are_told_and_the_first_counts():
    document = parse("a: 1\na: 2\na: 3", "f")
    assert [mistake.line for mistake in document.mistakes] == [2, 3]
    assert document.data == {"a": 1}
