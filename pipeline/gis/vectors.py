"""Maps and what is marked on them as features: outlines, classes, receptors, releases, profile and domain."""

from __future__ import annotations

import json
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from itertools import pairwise
from typing import TYPE_CHECKING, Any

import numpy as np
import xarray as xr
from numpy.typing import NDArray

from pipeline.assess.georeference import Frame
from pipeline.gis.layer import BANDS, ERROR, Layer
from pipeline.gis.qml import Geometry, Mark
from pipeline.gis.symbology import Entry, Style

if TYPE_CHECKING:
    from shapely import MultiPolygon
    from shapely.geometry.base import BaseGeometry

Array = NDArray[np.float64]
ABOVE_ALL = 1e30
RELEASE_COLOUR = "#8c510a"
RECEPTOR_COLOUR = "#d01c8b"
KINDS: dict[str, tuple[Geometry, str]] = {
    "point": ("Point", "receptor_points"),
    "line": ("Line", "receptor_lines"),
    "polygon": ("Polygon", "receptor_polygons"),
}
# names of fields with what they hold, as people and QGIS see it
FIELDS = {
    "map": "map",
    "quantity": "quantity",
    "threshold": "threshold",
    "share": "least share of the runs",
    "class": "class",
    "lower": "above",
    "upper": "up to",
    "units": "unit of the numbers",
    "bound": "estimate, or bound for runs that are missing",
    "area_m2": "area (m²)",
    "runs": "runs behind it",
    "runs_done": "runs done",
    "runs_planned": "runs planned",
    "name": "name",
}


@dataclass(frozen=True, eq=False)
class Features:
    """A layer of features of one kind, with how it looks.

    Parameters
    ----------
    name, title : str
        Of the layer.
    shapes : sequence of BaseGeometry
        In the reference system of the map.
    rows : Sequence[Mapping[str, Any]]
        Fields of each.
    labelled : str
        Field that is written at each.
    """

    name: str
    title: str
    geometry: Geometry
    shapes: Sequence[BaseGeometry]
    rows: Sequence[Mapping[str, Any]]
    marks: Sequence[Mark]
    labelled: str = ""
    aliases: Mapping[str, str] = field(default_factory=lambda: FIELDS)

    @property
    def fields(self) -> list[str]:
        """Names of the fields."""
        return list(self.rows[0]) if self.rows else []


def of_layer(layer: Layer, frame: Frame, shares: Sequence[float], runs: Mapping[str, Any]) -> Features:
    """Give a map as polygons: where at least a share exceeds a threshold, or one polygon a class.

    Parameters
    ----------
    layer : Layer
        Over the points of a lattice.
    frame : Frame
        Of the lattice.
    shares : sequence of float
        Shares of runs whose outlines are given, of a map of a threshold.
    runs : mapping
        How many runs are behind it: fields of every feature.
    """
    style = layer.style
    found = [
        (shape, {**row, "bound": BANDS[bound], "area_m2": round(shape.area, 1), **runs})
        for bound, values in layer.values.items()
        if not (bound and layer.is_certain) and bound != ERROR
        for shape, row in _parts(layer, style, values, frame, shares)
        if not shape.is_empty
    ]
    estimate = f"\"bound\" = '{BANDS['']}'"
    if layer.threshold is not None:
        marks = [
            Mark(
                f"{share:g} of the runs or more",
                line=_colour(style, share),
                width=0.5,
                filter=f'{estimate} AND "share" = {share:g}',
            )
            for share in shares
        ]
    else:
        marks = [
            Mark(each.label, each.colour, "#555555", 0.1, f"{estimate} AND \"class\" = '{each.label}'")
            for each in style.entries
        ]
    return Features(layer.name, layer.title, "Polygon", *_unzip(found), marks)


def _parts(
    layer: Layer, style: Style, values: xr.DataArray, frame: Frame, shares: Sequence[float]
) -> Iterator[tuple[MultiPolygon, dict[str, Any]]]:
    about = {"map": layer.name, "quantity": layer.quantity}
    if layer.threshold is not None:
        more = {"threshold": layer.threshold, "units": layer.threshold_units}
        for share in shares:
            yield outline(values, share, frame), {**about, **more, "share": share}
        return
    for each in style.entries:
        if each.lower < 0 < each.upper:
            # of differences: what is none
            continue
        row = {**about, "class": each.label, "lower": each.lower, "upper": each.upper, "units": layer.units}
        if style.discrete:
            yield cells(values.to_numpy() == each.lower, frame), row
        else:
            # what is as low as a legend of differences goes is of its first class
            least = -ABOVE_ALL if each.lower == style.edges[0] < 0 else each.lower
            yield outline(values, least, frame, each.upper), row


def _colour(style: Style, value: float) -> str:
    within: list[Entry] = [each for each in style.entries if each.lower < value <= each.upper]
    return within[0].colour if within else style.entries[-1].colour


def _unzip(found: Sequence[tuple[Any, dict[str, Any]]]) -> tuple[list[Any], list[dict[str, Any]]]:
    return [shape for shape, _ in found], [row for _, row in found]


def outline(values: xr.DataArray, least: float, frame: Frame, most: float = ABOVE_ALL) -> MultiPolygon:
    """Outline where a map over a lattice is within limits, in the reference system; maybe empty."""
    from contourpy import FillType, contour_generator

    generator = contour_generator(
        frame.arc, frame.across, np.ma.masked_invalid(values.to_numpy()), fill_type=FillType.OuterOffset
    )
    rings = []
    for points, offsets in zip(*generator.filled(least, min(most, ABOVE_ALL)), strict=True):
        assert points is not None
        assert offsets is not None
        placed = np.stack(frame.on_map(points[:, 0], points[:, 1]), axis=1)
        rings.append([placed[a:b] for a, b in pairwise(offsets)])
    return _polygons(rings)


def cells(held: NDArray[np.bool_], frame: Frame) -> MultiPolygon:
    """Outline cells of a lattice, (ny, nx), in the reference system; maybe empty."""
    from rasterio.features import shapes

    sides = [_sides(places) for places in (frame.arc, frame.across)]
    found = []
    for shape, _ in shapes(held.astype(np.uint8), mask=held):
        rings = []
        for ring in shape["coordinates"]:
            column, row = np.array(ring, np.float64).T
            x, y = (
                np.interp(at, np.arange(len(edges)), edges)
                for at, edges in zip((column, row), sides, strict=True)
            )
            rings.append(np.stack(frame.on_map(x, y), axis=1))
        found.append(rings)
    return _polygons(found)


def _sides(places: Array) -> Array:
    middle = (places[1:] + places[:-1]) / 2
    return np.concatenate([[2 * places[0] - middle[0]], middle, [2 * places[-1] - middle[-1]]])


def _polygons(rings: Sequence[Sequence[Array]]) -> MultiPolygon:
    """Make one valid shape of polygons, each with its outer ring first."""
    import shapely

    polygons = [shapely.Polygon(one[0], one[1:]) for one in rings]
    try:
        whole = shapely.make_valid(shapely.MultiPolygon(polygons))
    except shapely.errors.GEOSException:
        # one of them has no area, and cannot be made valid together with others
        valid = [shapely.make_valid(each) for each in polygons if each.area > 0]
        flat = [part for part in shapely.get_parts(valid) if part.geom_type == "Polygon"]
        whole = shapely.union_all(flat)
    parts = [part for part in shapely.get_parts(whole, return_index=False) if part.geom_type == "Polygon"]
    return shapely.MultiPolygon(parts)


def marked(found: xr.Dataset, frame: Frame) -> list[Features]:
    """Give what is marked on the maps of a scenario: receptors, releases, profile and domain."""
    import shapely

    layers: list[Features] = []
    places = json.loads(found.attrs.get("receptors", "[]"))
    for kind, (geometry, name) in KINDS.items():
        held = [each for each in places if each[kind] is not None]
        if not held:
            continue
        make = {"point": shapely.Point, "line": shapely.LineString, "polygon": shapely.Polygon}[kind]
        # a point is a list of one place
        shapes = [make(_placed([each[kind]] if kind == "point" else each[kind], frame)) for each in held]
        mark = Mark("receptors", line=RECEPTOR_COLOUR, width=0.6)
        rows = [{"name": each["name"]} for each in held]
        layers.append(Features(name, "receptors", geometry, shapes, rows, [mark], labelled="name"))
    if rings := json.loads(found.attrs.get("releases", "[]")):
        shape = shapely.union_all(
            [shapely.make_valid(shapely.Polygon(_placed(ring, frame))) for ring in rings]
        )
        mark = Mark("release", line=RELEASE_COLOUR, width=0.6, dashed=True)
        rows = [{"name": "release", "area_m2": round(shape.area, 1)}]
        layers.append(Features("release", "release", "Polygon", [_many(shape)], rows, [mark]))
    if not frame.is_map:
        line = shapely.LineString(np.stack(frame.on_map(frame.arc, np.zeros_like(frame.arc)), axis=1))
        mark = Mark("profile", line="#444444", width=0.3, dashed=True)
        layers.append(Features("profile_line", "profile", "Line", [line], [{"name": "profile"}], [mark]))
    corners = shapely.Polygon(np.stack(frame.corners, axis=1))
    rows = [{"name": "domain", "area_m2": round(corners.area, 1)}]
    layers.append(Features("domain", "domain", "Polygon", [_many(corners)], rows, [Mark("domain")]))
    return layers


def _many(shape: BaseGeometry) -> BaseGeometry:
    import shapely

    return shape if shape.geom_type == "MultiPolygon" else shapely.MultiPolygon([shape])


def _placed(places: Sequence[Sequence[float]], frame: Frame) -> Array:
    x, y = np.array(places, np.float64).reshape(-1, 2).T
    return np.stack(frame.on_map(x, y), axis=1)
