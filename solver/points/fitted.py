"""Clouds fitted to outlines: points in pairs that are mirror images of each other, so that cells end there.

Where two points are each other's image in an edge, and no other point is nearer to it, the face between their
cells lies on the edge. Around a corner the points stand on a circle, so that the corner is one of their cells
(Abdelkader et al. 2020, VoroCrust).
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from itertools import chain

import numpy as np
import scipy

from solver.arrays import Array
from solver.points.spacing import Spacing

# Distances as shares of the spacing: of a pair from its edge, and at least where there is less room;
OFFSET, LEAST = 0.5, 0.25
# within which a point gives way to an edge or to a point that was placed there; between points placed there;
CLEARED, APART = 0.75, 0.4
# of the same point placed twice; between the places by which an edge is known.
SAME, STEP = 1e-6, 0.125
# Corners of an outline between which there is less are left out, and those that cut off less than its square.
SHORTEST, SMALLEST = 0.75, 0.2
# A sector has one point, half way, up to this angle; else points stand so far from its edges, and fill it.
NARROW, BESIDE, BETWEEN = np.radians(135.0), np.radians(45.0), np.radians(75.0)


def fitted(
    points: Array, x: tuple[float, float], y: tuple[float, float], spacing: Spacing, rings: Sequence[Array]
) -> Array:
    """Put points near outlines elsewhere, so that the cells of the points end at them.

    Cells do not end at edges that are closer to each other than half a spacing, nor at what of an outline is
    finer than the spacing.

    Parameters
    ----------
    points : (n, 2) array
        Placed by this spacing, m.
    x, y : tuple of float
        Bounds of the domain, m.
    spacing : Spacing
        Of the points.
    rings : sequence of array
        Closed outlines, each (m, 2), m: outer ones counter-clockwise, holes clockwise.

    Returns
    -------
    (k, 2) array
        Points that were kept and points that were placed. Their number is another one.
    """
    kept = [each for ring in rings if len(each := _coarsened(ring, spacing)) >= 3]
    if not kept:
        return points
    edges = _Edges(kept, spacing)
    corners = chain.from_iterable(_at_corners(ring, spacing) for ring in kept)
    between = chain.from_iterable(_beside_edges(ring, spacing, edges) for ring in kept)
    placed = _chosen([*corners, *between], np.array([x, y]), spacing, edges)
    if not len(placed):
        return points
    fits = scipy.spatial.cKDTree(placed).query(edges.places)[0] <= CLEARED * spacing.at(edges.places)
    clear = np.ones(len(points), bool)
    for places in (placed, edges.places[fits]):
        away, which = scipy.spatial.cKDTree(places).query(points)
        clear &= away >= CLEARED * spacing.at(places)[which]
    return np.concatenate([points[clear], placed])


def _coarsened(ring: Array, spacing: Spacing) -> Array:
    """Leave out corners that are finer than the spacing, smallest first (Visvalingam and Whyatt 1993)."""
    ring = np.asarray(ring, np.float64)
    ring = ring[(ring != np.roll(ring, 1, axis=0)).any(axis=1)]
    size = spacing.at(ring)
    while len(ring) >= 3:
        before, after = ring - np.roll(ring, 1, axis=0), np.roll(ring, -1, axis=0) - ring
        shorter = np.minimum(np.hypot(*before.T), np.hypot(*after.T))
        area = np.abs(before[:, 0] * after[:, 1] - before[:, 1] * after[:, 0]) / 2
        fine = ((shorter < SHORTEST * size) & (area < (SMALLEST * size) ** 2)) | (area == 0)
        if not fine.any():
            break
        least = int(np.where(fine, area, np.inf).argmin())
        ring, size = np.delete(ring, least, axis=0), np.delete(size, least)
    return ring


class _Edges:
    """The edges of outlines, by places along them, (n, 2), m."""

    def __init__(self, rings: Sequence[Array], spacing: Spacing) -> None:
        pieces, ends = [], []
        for ring in rings:
            for start, stop in zip(ring, np.roll(ring, -1, axis=0), strict=True):
                least = spacing.at(np.linspace(start, stop, 5)).min()
                count = int(np.ceil(np.hypot(*(stop - start)) / (STEP * least)))
                pieces.append(np.linspace(start, stop, count, endpoint=False))
                ends.append(np.tile([start, stop], (count, 1, 1)))
        self.places = np.concatenate(pieces)
        self._ends, self._tree = np.concatenate(ends), scipy.spatial.cKDTree(self.places)

    def distance(self, points: Array) -> Array:
        """Distance of points (n, 2) from the edge that is nearest to each, (n,), m."""
        start, stop = self._ends[self._tree.query(points)[1]].transpose(1, 0, 2)
        way = stop - start
        part = np.einsum("nk,nk->n", points - start, way) / np.einsum("nk,nk->n", way, way)
        return np.asarray(np.hypot(*(start + np.clip(part, 0.0, 1.0)[:, None] * way - points).T))


def _circle(ring: Array, spacing: Spacing) -> tuple[Array, Array, Array]:
    """Give the radius of the circle around each corner, m, its angle, and that of a point to an edge."""
    way = np.roll(ring, -1, axis=0) - ring
    length, course = np.hypot(*way.T), np.arctan2(way[:, 1], way[:, 0])
    inside = (np.roll(course, 1) + np.pi - course) % (2 * np.pi)
    narrow = np.minimum(inside, 2 * np.pi - inside)
    beside = np.where(narrow < NARROW, narrow / 2, BESIDE)
    radius = np.sqrt(2) * np.minimum(OFFSET * spacing.at(ring), np.minimum(length, np.roll(length, 1)) / 2)
    return radius, inside, beside


def _at_corners(ring: Array, spacing: Spacing) -> Iterator[Array]:
    """Give the points around each corner of an outline, (k, 2), m."""
    way = np.roll(ring, -1, axis=0) - ring
    course = np.arctan2(way[:, 1], way[:, 0])
    for place, start, *about in zip(ring, course, *_circle(ring, spacing), strict=True):
        radius, inside, beside = about
        # anticlockwise from the edge that leaves the corner; what is inside is on its left
        turns = [beside, inside - beside, inside + beside, -beside]
        outside = 2 * np.pi - inside - 2 * beside
        if outside > np.pi / 2:
            pieces = max(1, round(outside / BETWEEN))
            turns += [inside + beside + outside * k / pieces for k in range(1, pieces)]
        angle = start + np.array(turns)
        yield place + radius * np.stack([np.cos(angle), np.sin(angle)], axis=1)


def _beside_edges(ring: Array, spacing: Spacing, edges: _Edges) -> Iterator[Array]:
    """Give pairs of points on both sides of the edges of an outline, each (2, 2), m."""
    radius, _, beside = _circle(ring, spacing)
    taken = radius * np.cos(beside)
    ends = zip(ring, np.roll(ring, -1, axis=0), taken, np.roll(taken, -1), strict=True)
    for start, stop, first, last in ends:
        way = stop - start
        length = float(np.hypot(*way))
        way = way / length
        if first + last >= length:
            continue
        at = np.linspace(first, length - last, 1 + 8 * int(np.ceil(length / spacing.at(start[None])[0])))
        density = 1.0 / spacing.at(start + at[:, None] * way)
        passed = np.concatenate([[0.0], np.cumsum(np.diff(at) * (density[1:] + density[:-1]) / 2)])
        pieces = max(1, round(passed[-1]))
        at = np.interp(passed[-1] * np.arange(1, pieces) / pieces, passed, at)
        if not len(at):
            continue
        places, left = start + at[:, None] * way, np.array([-way[1], way[0]])
        size = spacing.at(places)
        off = OFFSET * size
        for sign in (1.0, -1.0):
            # half way to an edge that is nearer
            found = edges.distance(places + sign * off[:, None] * left)
            off = np.where(found < (1.0 - SAME) * off, (off + found) / 2, off)
        for place, own in zip(places[off >= LEAST * size], off[off >= LEAST * size], strict=True):
            yield place + own * np.array([[1.0], [-1.0]]) * left


def _chosen(groups: list[Array], bounds: Array, spacing: Spacing, edges: _Edges) -> Array:
    """Join groups of points, (n, 2), m, but for those that leave the domain or come too close to others."""
    low, high = bounds.T
    points = np.concatenate([*groups, np.zeros((0, 2))])
    owner = np.repeat(np.arange(len(groups)), [len(each) for each in groups])
    size = spacing.at(points)
    good = np.ones(len(groups), bool)
    # a point at a corner may be as near to the next edge as to its own, but not nearer
    beyond = (points < low + LEAST * size[:, None]) | (points > high - LEAST * size[:, None])
    crowded = edges.distance(points) < 0.6 * LEAST * size
    good[owner[beyond.any(axis=1) | crowded]] = False
    pairs = scipy.spatial.cKDTree(points).query_pairs(APART * float(size.max()), output_type="ndarray")
    away = np.hypot(*(points[pairs[:, 0]] - points[pairs[:, 1]]).T) / np.minimum(*size[pairs].T)
    alike, close = pairs[away <= SAME], pairs[(away > SAME) & (away < APART)]
    for one, other in sorted(
        {tuple(sorted(pair)) for pair in owner[close].tolist()}, key=lambda pair: pair[1]
    ):
        if good[one] and one != other:
            good[other] = False
        elif one == other:
            good[one] = False
    kept = good[owner]
    for one, other in alike:
        if kept[one] and kept[other]:
            kept[max(one, other)] = False
    return points[kept]
