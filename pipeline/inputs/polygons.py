"""Polygons that later ones lie over: what is left of each, by its outlines."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray

Ring = NDArray[np.float64]


def crossing(corners: Sequence[tuple[float, float]]) -> str:
    """Say why corners are no simple polygon; "" if they are one."""
    import shapely

    if not shapely.MultiPoint(corners).convex_hull.area > 0:
        return "one of no area"
    polygon = shapely.Polygon(corners)
    return "" if polygon.is_valid else str(shapely.is_valid_reason(polygon))


def reaches(polygons: Sequence[Sequence[Ring]], x: tuple[float, float], y: tuple[float, float]) -> bool:
    """Whether polygons, each with its rings, cover a part of a rectangle with bounds x and y, m."""
    import shapely

    bounds = x[0], y[0], x[1], y[1]
    return any(shapely.clip_by_rect(_polygon(rings), *bounds).area > 0 for rings in polygons)


def inside(rings: Sequence[Ring], places: NDArray[np.float64]) -> NDArray[np.bool_]:
    """Whether places, shape (n, 2), lie in a polygon with its rings, m."""
    import shapely

    return np.asarray(shapely.contains_xy(_polygon(rings), places))


def overlaps(polygons: Sequence[Sequence[Ring]]) -> list[tuple[float, int, int]]:
    """List polygons, each with its rings, that overlap: the area, m2, and their numbers; largest first."""
    import shapely

    shapes = np.array([_polygon(rings) for rings in polygons], dtype=object)
    pairs = zip(*shapely.STRtree(shapes).query(shapes, predicate="intersects"), strict=True)
    found = [(shapely.intersection(shapes[i], shapes[j]).area, int(i), int(j)) for i, j in pairs if i < j]
    return sorted((each for each in found if each[0] > 0), key=lambda each: (-each[0], each[1:]))


def width(rings: Sequence[Ring]) -> float:
    """Width of the widest part of a polygon, m: that of the rectangle of its area and perimeter."""
    import shapely

    widths = []
    for ring in rings:
        part = shapely.Polygon(ring)
        if shapely.LinearRing(ring).is_ccw:
            half = part.length / 2
            widths.append((half - np.sqrt(max(half**2 - 4 * part.area, 0.0))) / 2)
    return float(max(widths))


def uncovered(layers: Sequence[Sequence[Sequence[Ring]]]) -> list[list[Ring]]:
    """Give the outlines of what later layers leave of each layer, outer ones counter-clockwise.

    Parameters
    ----------
    layers : sequence
        Polygons of each layer, each with its rings (n, 2), m: outer ones counter-clockwise, holes clockwise.
        Polygons of a layer may overlap.
    """
    import shapely

    above: Any = shapely.Polygon()
    found: list[list[Ring]] = []
    for layer in reversed(layers):
        whole = shapely.union_all([_polygon(rings) for rings in layer])
        found.append(_rings(shapely.difference(whole, above)))
        above = shapely.union(above, whole)
    return found[::-1]


def _polygon(rings: Sequence[Ring]) -> Any:
    """Make a polygon, or several, of rings whose orientation says what is a hole."""
    import shapely

    outer = [ring for ring in rings if shapely.LinearRing(ring).is_ccw]
    holes = [ring for ring in rings if not shapely.LinearRing(ring).is_ccw]
    whole = shapely.union_all([shapely.Polygon(ring) for ring in outer])
    return shapely.difference(whole, shapely.union_all([shapely.Polygon(ring) for ring in holes]))


def _rings(geometry: Any) -> list[Ring]:
    """List the rings of what is an area in a geometry."""
    import shapely

    found: list[Ring] = []
    for part in getattr(geometry, "geoms", [geometry]):
        if part.geom_type == "Polygon" and part.area > 0:
            turned = shapely.geometry.polygon.orient(part)
            found += [np.asarray(ring.coords)[:-1, :2] for ring in (turned.exterior, *turned.interiors)]
        elif part.geom_type == "MultiPolygon":
            found += _rings(part)
    return found
