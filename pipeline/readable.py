"""Numbers as people read them."""

from __future__ import annotations

import math


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
