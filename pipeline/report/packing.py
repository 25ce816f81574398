"""Arrays small enough for a page: whole numbers, as differences along rows, compressed, as text."""

from __future__ import annotations

import base64
import zlib

import numpy as np
from numpy.typing import NDArray

# nothing is known there
MISSING = 65535
LARGEST = MISSING - 1


def step_of(largest: float, most: float) -> float:
    """Give the step that values are rounded by: 1 % of the power of ten below the largest, or ``most``."""
    if not largest > 0:
        return most
    power = int(np.floor(np.log10(largest))) - 2
    return min(most, float(f"1e{power}"))


def rounded_up(values: NDArray[np.floating], step: float) -> NDArray[np.uint16]:
    """Give values of 0 and above in whole steps, so that one is above a multiple of it as it was before.

    A value above ``n`` steps gets a number above ``n``: shares of runs above a threshold that is a whole
    number of steps are those of the values. What is missing is `MISSING`.
    """
    counted = values.astype(np.float64) / step
    # a multiple of the step, in binary, is off by round-off of its division
    near = np.rint(counted)
    same = near * step == values.astype(np.float64)
    whole = np.where(same, near, np.ceil(counted))
    known = np.clip(whole, 0, LARGEST)
    return np.where(np.isnan(values), MISSING, np.nan_to_num(known)).astype(np.uint16)


def times(values: NDArray[np.floating], step: float) -> NDArray[np.uint16]:
    """Give times in whole steps, rounded down, and one more: 0 where nothing arrives."""
    counted = np.clip(np.floor(values.astype(np.float64) / step) + 1, 0, LARGEST)
    return np.where(np.isnan(values), 0, np.nan_to_num(counted)).astype(np.uint16)


def pack(values: NDArray[np.uint16]) -> str:
    """Pack an array of any shape; `unpacked` says how it is read.

    Differences along the last axis are small where neighbours are alike. Their sign goes to the lowest bit,
    low and high bytes stand apart, and what is left is compressed (raw DEFLATE) and written in base 64.
    """
    before = np.concatenate([np.zeros_like(values[..., :1]), values[..., :-1]], axis=-1)
    difference = (values.astype(np.int32) - before.astype(np.int32) + 2**15) % 2**16 - 2**15
    signless = ((difference << 1) ^ (difference >> 31)).astype(np.uint16)
    planes = (signless & 0xFF).astype(np.uint8).tobytes() + (signless >> 8).astype(np.uint8).tobytes()
    engine = zlib.compressobj(9, wbits=-15)
    return base64.b64encode(engine.compress(planes) + engine.flush()).decode()


def unpacked(text: str, shape: tuple[int, ...]) -> NDArray[np.uint16]:
    """Read a packed array, as the page does."""
    planes = np.frombuffer(zlib.decompress(base64.b64decode(text), wbits=-15), np.uint8)
    low, high = planes.reshape(2, -1).astype(np.uint16)
    signless = low | (high << 8)
    difference = (signless >> 1) ^ (0 - (signless & 1)).astype(np.uint16)
    found: NDArray[np.uint16] = np.cumsum(difference.reshape(shape), axis=-1, dtype=np.uint16)
    return found


def coarser(values: NDArray[np.uint16], factor: int) -> NDArray[np.uint16]:
    """Take the largest of blocks of cells along the last two axes; the last ones may be smaller."""
    if factor == 1:
        return values
    for axis in (-2, -1):
        starts = np.arange(0, values.shape[axis], factor)
        values = np.maximum.reduceat(values, starts, axis=axis)
    return values
