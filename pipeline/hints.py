"""What a person may have meant: keys of another name, and numbers written as in other places."""

from __future__ import annotations

import re
from collections.abc import Iterable, Mapping
from difflib import get_close_matches
from itertools import chain
from math import atan, degrees
from typing import Any

Pair = tuple[float, float]
# names that other tools and books use, and those of the keys here
_SYNONYMS: Mapping[str, str] = {
    "mu": "friction_coefficient",
    "friction": "friction_coefficient",
    "dry_friction": "friction_coefficient",
    "xi": "turbulent_friction",
    "turbulence": "turbulent_friction",
    "phi": "internal_friction",
    "delta": "bed_friction",
    "basal_friction": "bed_friction",
    "friction_angle": "bed_friction",
    "center": "centre",
    "depth": "height",
    "thickness": "height",
    "dx": "spacing",
    "resolution": "spacing",
    "cell_size": "spacing",
    "slope": "angle",
    "inclination": "angle",
    "type": "shape",
    "kind": "profile",
    "t_end": "end",
    "duration": "end",
    "dt": "output_every",
    "interval": "output_every",
    "g": "gravity",
    "velocities": "velocity",
}
_DIGITS = r"[-+]?[0-9]"
_GROUPED = re.compile(rf"{_DIGITS}{{1,3}}([,' _][0-9]{{3}})+(\.[0-9]*)?")
_DECIMAL_COMMA = re.compile(rf"{_DIGITS}*,[0-9]+")
_WITH_UNIT = re.compile(r"([-+]?(?:[0-9]+\.?[0-9]*|\.[0-9]+)(?:[eE][-+]?[0-9]+)?)\s*([A-Za-z°/%][\w°/%^ -]*)")
# spellings of units, and units that others are brought to, each with its factor
_SPELLINGS: Mapping[str, str] = {
    **dict.fromkeys(("sec", "secs", "second", "seconds"), "s"),
    **dict.fromkeys(("minute", "minutes"), "min"),
    **dict.fromkeys(("hour", "hours", "hr", "hrs"), "h"),
    **dict.fromkeys(("day", "days"), "d"),
    **dict.fromkeys(("metre", "metres", "meter", "meters"), "m"),
    **dict.fromkeys(("kilometre", "kilometres", "kilometer", "kilometers"), "km"),
    **dict.fromkeys(("foot", "feet"), "ft"),
    **dict.fromkeys(("litre", "litres", "liter", "liters"), "l"),
    **dict.fromkeys(("°", "deg", "degree"), "degrees"),
    **dict.fromkeys(("radian", "radians"), "rad"),
    **dict.fromkeys(("a", "yr", "yrs", "year"), "years"),
    "kmh": "km h-1",
    "kph": "km h-1",
}
_FACTORS: Mapping[str, Mapping[str, float]] = {
    "s": {"ms": 0.001, "min": 60.0, "h": 3600.0, "d": 86400.0},
    "m": {"mm": 0.001, "cm": 0.01, "km": 1000.0, "ft": 0.3048},
    "m3": {"l": 0.001, "km3": 1e9},
    "m s-1": {"cm s-1": 0.01, "km h-1": 1 / 3.6},
    "m3 s-1": {"l s-1": 0.001},
    "kg m-3": {"g cm-3": 1000.0, "t m-3": 1000.0},
    "pa": {"kpa": 1000.0, "mpa": 1e6},
    "kpa": {"pa": 0.001, "mpa": 1000.0},
    "degrees": {"rad": degrees(1.0)},
    "": {"%": 0.01},
}


def meant(found: str, known: Iterable[str], elsewhere: Mapping[str, str] | None = None) -> str:
    """Say which key may be meant by one that is not known; "" for none.

    Parameters
    ----------
    found : str
        What was written.
    known : iterable of str
        The keys that may stand there.
    elsewhere : mapping, optional
        Keys that may stand in other places, each with its dotted key.
    """
    known = list(known)
    word = found.lower().replace("-", "_")
    right = _SYNONYMS.get(word, word)
    if right in known:
        return f". Did you mean '{right}'?"
    if close := get_close_matches(word, known, 1, 0.7):
        return f". Did you mean '{close[0]}'?"
    place = (elsewhere or {}).get(right, "")
    return f". Did you mean '{place}'?" if place else ""


def alike(found: str, known: Iterable[str]) -> str:
    """Say which name of the user's own may be meant by one that is not known; "" for none."""
    lowered = {name.casefold(): name for name in known}
    close = get_close_matches(found.casefold(), lowered, 1, 0.6)
    return f". Did you mean '{lowered[close[0]]}'?" if close else ""


def of_key(found: str, value: Any) -> str:
    """Say what is behind a key that is a part of a number, as in ``{volume: 20,000}``; "" for nothing."""
    if found.isdigit() and value is None:
        return ". A comma ends a value here: write 20000 for 20,000 and 1.5 for 1,5"
    return ""


def of_number(found: Any, unit: str | None = None) -> str:
    """Say how a text that was meant as a number is written; "" where nothing is known.

    Parameters
    ----------
    found : Any
        What was written.
    unit : str, optional
        That of the key, in CF notation, "" for a number without one; None where it is not known.
    """
    if not isinstance(found, str):
        return ""
    text = found.strip()
    if ";" in text:
        return ". Separate values by commas, not by semicolons"
    if _GROUPED.fullmatch(text):
        plain = re.sub(r"[,' _]", "", text)
        return f". Write {plain}, without separators between digits"
    if _DECIMAL_COMMA.fullmatch(text):
        return f". Write {text.replace(',', '.')}, with a decimal point"
    if parts := _WITH_UNIT.fullmatch(text):
        return _in_unit(parts[1], parts[2], unit)
    return ""


def _in_unit(number: str, found: str, unit: str | None) -> str:
    """Say how a number with a unit is written for a key of another one or the same."""
    if unit is None:
        return ". Write the number alone, in the unit of the key"
    own, other = _plain_unit(unit), _plain_unit(found)
    if own == other:
        return f". Write the number alone: {number}"
    if own == "degrees" and other == "%":
        return f". Write the slope of {number} % in degrees: {degrees(atan(float(number) / 100)):.3g}"
    if (factor := _FACTORS.get(own, {}).get(other)) is not None:
        digits = ".3g" if other == "rad" else ".10g"
        alone = f"in {unit}" if unit else "as a share"
        return f". Write it {alone}: {float(number) * factor:{digits}}"
    return f". Write a number in {unit}" if unit else ". Write a number without a unit"


def _plain_unit(unit: str) -> str:
    """Give a unit in CF notation and small letters, as ``m3 s-1`` of ``m^3/s``."""
    text = unit.strip().casefold().replace("^", "").replace("³", "3").replace("²", "2")
    if text in _SPELLINGS:
        return _SPELLINGS[text]
    above, *below = ([_SPELLINGS.get(word, word) for word in part.split()] for part in text.split("/"))
    for word in chain.from_iterable(below):
        above.append(re.sub(r"(\d+)$", r"-\1", word if word[-1].isdigit() else f"{word}1"))
    return " ".join(above)


def of_length(found: Any, expected: int) -> str:
    """Say why a list may be twice as long as it should, as ``[0,5, 1,5]`` is; "" for another length."""
    if isinstance(found, tuple) and found and len(found) == 2 * expected:
        return ". Decimals are written with a point: [0.5, 1.5]"
    return ""


def of_place(corners: Iterable[Iterable[float]], x: Pair, y: Pair, files: str = "", crs: str = "") -> str:
    """Say where corners lie that are outside bounds, and what may be wrong with their coordinates.

    Parameters
    ----------
    corners : iterable of (easting, northing)
        m.
    x, y : tuple of float
        The bounds, m.
    files : str
        That the corners are from; "" for the scenario itself.
    crs : str
        Reference system of the bounds, as it is called, if it may be what is wrong.
    """
    (x0, x1), (y0, y1) = (
        (round(float(min(each)), 2), round(float(max(each)), 2)) for each in zip(*corners, strict=True)
    )
    place = f", x from {x0:.12g} to {x1:.12g} and y from {y0:.12g} to {y1:.12g} m"
    if hint := of_exchanged((x0, x1), (y0, y1), x, y):
        return f"{place}{hint}"
    named = (
        f"the reference systems of {files} and of the elevation model" if files else "the reference system"
    )
    return f"{place}; check {named}, {crs}" if crs else place


def of_exchanged(found_x: Pair, found_y: Pair, x: Pair, y: Pair) -> str:
    """Say that what lies outside bounds lies within once its coordinates are exchanged; "" if it does not."""
    meet = found_y[0] <= x[1] and found_y[1] >= x[0] and found_x[0] <= y[1] and found_x[1] >= y[0]
    return "; exchange them: eastings come first" if meet else ""
