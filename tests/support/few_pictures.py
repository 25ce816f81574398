"""Maps of a kind that are drawn once: copies stand for the others, where a test does not look at them."""

from collections.abc import Iterator
from contextlib import contextmanager

import pytest

# by kind, number of panels and format: kept for all tests of a process
KNOWN: dict[tuple[object, ...], bytes] = {}


@contextmanager
def drawn_once() -> Iterator[None]:
    """Draw one map of each kind."""
    from pipeline.hazard import pictures

    draw = pictures._draw

    def draw_or_copy(layer, found, frame, kind):
        key = layer.kind, layer.is_certain, len(layer.values), frame is None, kind
        if key not in KNOWN:
            KNOWN[key] = draw(layer, found, frame, kind)
        return KNOWN[key]

    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(pictures, "drawn", {})
        patch.setattr(pictures, "_draw", draw_or_copy)
        yield
