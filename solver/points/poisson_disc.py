"""Poisson-disc placement: random points, none closer to another than their spacing allows.

The same seed gives the same points on every machine: raw generator integers, sums taken in order, and no
arithmetic but + - * / and the square root, which IEEE 754 defines to the last bit.
"""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from solver.arrays import Array, Indices
from solver.compiled import ONE, kernel
from solver.points.spacing import Spacing, points_per_domain, spacing_at

# Distance kept between points as a share of the spacing, at first; the count is met by adjusting it.
DISTANCE = 0.83
# Candidates thrown around each point (Bridson 2007), in a square of this half width in distances kept.
CANDIDATES, REACH = 48, 1.2
# Relative error of the count, and placements tried to meet it.
COUNT_TOLERANCE, PLACEMENTS = 0.01, 100


@kernel(fastmath=False)
def apart(points: Array, spacings: Array, other: int, x: float, y: float, s: float, distance: float) -> bool:
    """Whether a place of spacing s (m) keeps ``distance`` times the mean spacing from a point."""
    dx, dy = points[other, 0] - x, points[other, 1] - y
    kept = 0.5 * distance * (s + spacings[other])
    return bool(dx * dx + dy * dy >= kept * kept)


def scatter(
    bounds: Array,
    coarsest: float,
    table: Array,
    growth: float,
    distance: float,
    raw: NDArray[np.uint64],
    width: float,
    points: Array,
) -> int:
    """Fill a domain from one first point by throwing candidates around every point placed, oldest first.

    Two points stand at least ``distance`` times their mean spacing apart, and half of that from the sides, so
    that the cells at a side are as wide as any.

    Parameters
    ----------
    bounds : (4,) array
        x_min, x_max, y_min, y_max, m.
    coarsest, table, growth
        The spacing, as in `Spacing`.
    distance : float
        Part of the spacing, dimensionless.
    raw : (CANDIDATES * capacity + 1 or more,) array
        Random 64-bit integers; the upper half of each places a candidate along x, the lower half along y.
    width : float
        Of the bins of the background grid, m.
    points : (capacity, 2) array
        Filled, m.

    Returns
    -------
    int
        How many points were placed, at most the capacity.
    """
    columns, rows = (int((high - low) / width) + 1 for low, high in bounds.reshape(2, 2))
    bins, following = np.full((rows, columns), -1), np.full(len(points), -1)
    spacings = np.empty(len(points))
    law = (coarsest, table, growth)
    return int(_place(bounds, *law, distance, raw, width, points, bins, following, spacings))


@kernel(fastmath=False, from_python=True)
def _place(
    bounds: Array,
    coarsest: float,
    table: Array,
    growth: float,
    distance: float,
    raw: NDArray[np.uint64],
    width: float,
    points: Array,
    first_in_bin: Indices,
    next_in_bin: Indices,
    spacings: Array,
) -> int:
    """Do what `scatter` does, with arrays to work with: compiled code that makes some takes 1.5 s more."""
    unit = 1.0 / 4294967296.0
    low_x, high_x, low_y, high_y = bounds
    rows, columns = first_in_bin.shape
    count = 0
    parent = -ONE
    while parent < count and count < len(points):
        for k in range(1 if parent < 0 else CANDIDATES):
            number = raw[0] if parent < 0 else raw[1 + parent * CANDIDATES + k]
            part_x = float(number >> np.uint64(32)) * unit
            part_y = float(number & np.uint64(4294967295)) * unit
            if parent < 0:
                x, y = low_x + part_x * (high_x - low_x), low_y + part_y * (high_y - low_y)
            else:
                reach = REACH * distance * spacings[parent]
                x = points[parent, 0] + (2.0 * part_x - 1.0) * reach
                y = points[parent, 1] + (2.0 * part_y - 1.0) * reach
            s = spacing_at(x, y, coarsest, table, growth)
            side_x = min(0.5 * distance * s, 0.25 * (high_x - low_x))
            side_y = min(0.5 * distance * s, 0.25 * (high_y - low_y))
            if parent < 0:
                x, y = (
                    min(max(x, low_x + side_x), high_x - side_x),
                    min(max(y, low_y + side_y), high_y - side_y),
                )
            elif x < low_x + side_x or x > high_x - side_x or y < low_y + side_y or y > high_y - side_y:
                continue
            # a neighbour at distance d has a spacing of at most s + growth d
            far = distance * s / (1.0 - 0.5 * distance * growth)
            free = parent < 0 or apart(points, spacings, parent, x, y, s, distance)
            west, east = (
                max(int((x - far - low_x) / width), 0),
                min(int((x + far - low_x) / width), columns - 1),
            )
            row, north = max(int((y - far - low_y) / width), 0), min(int((y + far - low_y) / width), rows - 1)
            while free and row <= north:
                column = west
                while free and column <= east:
                    other = first_in_bin[row, column]
                    while free and other >= 0:
                        free = apart(points, spacings, other, x, y, s, distance)
                        other = next_in_bin[other]
                    column += 1
                row += 1
            if free:
                points[count, 0], points[count, 1], spacings[count] = x, y, s
                row, column = int((y - low_y) / width), int((x - low_x) / width)
                next_in_bin[count] = first_in_bin[row, column]
                first_in_bin[row, column] = count
                count += 1
                if count == len(points):
                    break
        parent += 1
    return count


def poisson_disc(
    x: tuple[float, float], y: tuple[float, float], spacing: Spacing, seed: int, count: int | None = None
) -> Array:
    """Place points at random, as far apart as the spacing asks, and as many as it asks within 1 %.

    Parameters
    ----------
    x, y : tuple of float
        Bounds of the domain, m.
    spacing : Spacing
        As a function of place; it asks for one point per its square.
    seed : int
        At least 0; the same seed gives the same points.
    count : int, optional
        Points wanted in all where the spacing only grades them; by default what the spacing asks for.

    Returns
    -------
    (n, 2) array
        Coordinates, m.

    Raises
    ------
    ValueError
        If fewer than one point is asked for, or the count cannot be met.
    """
    bounds = np.array([*x, *y], dtype=np.float64)
    law = (spacing.coarsest, spacing.table, spacing.growth)
    columns, rows = (int(np.clip(4 * (b[1] - b[0]) / spacing.finest, 64, 2048)) for b in (x, y))
    asked = points_per_domain(bounds, *law, columns, rows)
    wanted = round(asked) if count is None else count
    if wanted < 1:
        raise ValueError("the spacing must leave room for a point in the domain")
    capacity = wanted + wanted // 4 + 8
    raw = np.random.PCG64(seed).random_raw(CANDIDATES * capacity + PLACEMENTS)
    area = (bounds[1] - bounds[0]) * (bounds[3] - bounds[2])
    distance = DISTANCE * math.sqrt(asked / wanted)
    width = max(distance * spacing.finest, math.sqrt(area / (16 * wanted)))
    points = np.empty((capacity, 2))
    for placement in range(PLACEMENTS):
        got = scatter(bounds, *law, distance, raw[placement:], width, points)
        if abs(got - wanted) <= COUNT_TOLERANCE * wanted:
            return points[:got].copy()
        # half a step, since the count of a few points scatters more than the distance changes it
        distance *= math.sqrt((got + wanted) / (2 * wanted))
    raise ValueError(f"{wanted} points could not be placed within 1 %; the last placement had {got}")
