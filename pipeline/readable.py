"""Numbers and units as people read them."""

from __future__ import annotations

import math

WRITTEN = {
    **{
        "m s-1": "m/s",
        "m3 s-1": "m³/s",
        "m s-2": "m/s²",
        "m3 s-2": "m³/s²",
        "kg m-3": "kg/m³",
        "m2": "m²",
        "m3": "m³",
    },
    **{"degree": "°", "degrees": "°", "1": ""},
}


def number(value: object) -> str:
    """Write a number for people; missing ones as a dash, anything else as it is."""
    # numpy's double is one of Python's floats, its single is not
    if isinstance(value, float) or type(value).__name__ == "float32":
        size = float(value)  # type: ignore[arg-type]
        if math.isnan(size):
            return "–"
        # four digits, and no powers of ten where people write none
        short = float(f"{size:.4g}")
        return f"{short:,.0f}" if 1e4 <= abs(short) < 1e9 else f"{short:.4g}"
    return str(value)


def percent(share: float) -> str:
    """Write a share as a percentage without powers of ten; what is no whole is not rounded to it."""
    size = 100 * share
    if 99.5 <= size < 100:
        return "more than 99 %"
    if 0 < size < 0.01:
        return "less than 0.01 %"
    return f"{size:.0f} %" if size >= 9.95 else f"{size:.2g} %"


def written(units: str) -> str:
    """Write a unit of the CF conventions for people: ``m s-1`` as ``m/s``."""
    return WRITTEN.get(units, units)


def with_unit(text: str, units: str) -> str:
    """Write a number with its unit: ``12 m/s``, ``35°``, and without one ``12``."""
    unit = written(units)
    return f"{text}{unit}" if unit in ("°", "") else f"{text} {unit}"
