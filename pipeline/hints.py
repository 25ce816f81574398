"""What a person may have meant: keys of another name, and numbers written as in other places."""

from __future__ import annotations

import re
from collections.abc import Iterable, Mapping
from difflib import get_close_matches
from typing import Any

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
_WITH_UNIT = re.compile(r"([-+]?[0-9.]+([eE][-+]?[0-9]+)?)\s*[A-Za-z°/%][\w°/%^ -]*")


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


def of_number(found: Any) -> str:
    """Say how a text that was meant as a number is written; "" where nothing is known."""
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
    if unit := _WITH_UNIT.fullmatch(text):
        return f". Write the number alone: {unit[1]}"
    return ""


def of_length(found: Any, expected: int) -> str:
    """Say why a list may be twice as long as it should, as ``[0,5, 1,5]`` is; "" for another length."""
    if isinstance(found, tuple) and found and len(found) == 2 * expected:
        return ". Decimals are written with a point: [0.5, 1.5]"
    return ""
