import math
import pickle
from dataclasses import FrozenInstanceError

import pytest

from solver.parameters import Checked, ParameterError, parameter, parametric


@parametric
class Thing(Checked):
    """A thing."""

    length: float = parameter("length", "m", above=0, at_most=10)
    pair: tuple[float, float] = parameter("bounds", "m", ordered=True, default=(0.0, 1.0))
    word: str = parameter("word", default="a", choices={"a": "first", "b": "second"})
    items: tuple[float, ...] = parameter("items", below=5, at_least=-1, min_items=1, default=(1.0,))
    volume: float | None = parameter("volume", "m3", above=0, default=None)
    gentle: float = parameter("gentle", scenario_at_most=1, default=0.5)


@pytest.mark.parametrize(
    ("given", "name", "message"),
    [
        ({"length": 0}, "length", "expected a number above 0, found 0"),
        ({"length": 10.5}, "length", "expected a number of at most 10, found 10.5"),
        ({"length": math.nan}, "length", "expected a finite number, found nan"),
        ({"length": 1, "gentle": math.inf}, "gentle", "expected a finite number, found inf"),
        (
            {"length": 1, "pair": (1.0, 1.0)},
            "pair",
            "expected a lower bound below the upper one, found [1, 1]",
        ),
        ({"length": 1, "word": "c"}, "word", "expected one of a, b, found 'c'"),
        ({"length": 1, "items": ()}, "items", "expected 1 or more values, found 0"),
        ({"length": 1, "items": (1.0, 5)}, "items.1", "expected a number below 5, found 5"),
        ({"length": 1, "items": (-2.0,)}, "items.0", "expected a number of at least -1, found -2"),
        ({"length": 1, "volume": 0.0}, "volume", "expected a number above 0, found 0"),
    ],
)
def test_a_parameter_out_of_bounds_is_refused(given, name, message):
    with pytest.raises(ParameterError) as caught:
        Thing(**given)
    assert (caught.value.names, caught.value.message) == ((name,), message)
    assert str(caught.value) == f"{name}: {message}"


def test_parameters_within_bounds_are_kept_and_frozen():
    thing = Thing(10, volume=None, gentle=1.5)
    assert (thing.length, thing.pair, thing.gentle) == (10, (0.0, 1.0), 1.5)
    with pytest.raises(FrozenInstanceError):
        thing.length = 3


def test_an_error_travels_between_processes():
    error = pickle.loads(pickle.dumps(ParameterError("expected this", "a", "b.0")))
    assert (error.message, error.names) == ("expected this", ("a", "b.0"))
