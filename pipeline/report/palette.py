"""Pictures of few colours, which take a third of the bytes: greys stay grey, classes keep their colours."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray
from PIL import Image

Numbers = NDArray[np.intp]


def with_palette(pictures: Sequence[Image.Image], most: int) -> list[Image.Image]:
    """Give pictures one palette.

    A quarter of it is even steps of grey, for hillshades and letters. The colours that are there most often,
    as those of legends, are kept as they are; the others go to colours near them. No grey gets a colour.

    Parameters
    ----------
    pictures : sequence of Image
        In RGB.
    most : int
        Colours of the palette, at most 256.
    """
    numbers = [_numbered(each) for each in pictures]
    found = [np.unique(each, return_counts=True) for each in numbers]
    colours, which = np.unique(np.concatenate([each for each, _ in found]), return_inverse=True)
    counts = np.bincount(which, np.concatenate([each for _, each in found])).astype(np.intp)
    palette, index = _reduced(colours, counts, most)
    made = []
    for each in numbers:
        one = Image.fromarray(index[np.searchsorted(colours, each)])
        one.putpalette(palette.tobytes())
        made.append(one)
    return made


def _numbered(picture: Image.Image) -> Numbers:
    """Write each pixel's colour as one number."""
    red, green, blue = np.moveaxis(np.asarray(picture.convert("RGB")).astype(np.intp), -1, 0)
    numbers: Numbers = red << 16 | green << 8 | blue
    return numbers


def _reduced(colours: Numbers, counts: Numbers, most: int) -> tuple[NDArray[np.uint8], ...]:
    """Choose a palette, (most, 3); with the number in it of each colour."""
    parts = np.stack([colours >> 16, colours >> 8 & 255, colours & 255], axis=1).astype(np.uint8)
    greys = most // 4
    steps = np.linspace(0, 255, greys).round().astype(np.uint8)
    palette = np.zeros((most, 3), np.uint8)
    palette[:greys] = steps[:, None]
    index = np.round(parts[:, 0] / 255 * (greys - 1)).astype(np.uint8)
    coloured = np.flatnonzero(np.ptp(parts.astype(int), axis=1) > 0)
    coloured = coloured[np.argsort(-counts[coloured], kind="stable")]
    room = most - greys
    kept, others = np.split(coloured, [len(coloured) if len(coloured) <= room else room // 2])
    palette[greys : greys + len(kept)] = parts[kept]
    index[kept] = greys + np.arange(len(kept))
    if len(others):
        first = greys + len(kept)
        # each of them once, however often it is there
        strip = Image.fromarray(parts[None, others]).quantize(
            most - first, method=Image.Quantize.MAXCOVERAGE, dither=Image.Dither.NONE
        )
        near = np.asarray(strip.getpalette("RGB"), np.uint8).reshape(-1, 3)[: most - first]
        palette[first : first + len(near)] = near
        index[others] = first + np.asarray(strip)[0]
    return palette, index
