"""Outlines and places on the map: features of GeoPackage, GeoJSON or Shapefile, in the system asked for."""

from __future__ import annotations

import hashlib
from collections import Counter
from collections.abc import Callable
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any, Literal

import numpy as np
from numpy.typing import NDArray

from pipeline.inputs.raster_band import CUT_OFF, scaled
from pipeline.inputs.reference_system import called

Array = NDArray[np.float64]
Kind = Literal["point", "line", "polygon"]
# beyond it a coordinate is no degree
MOST_DEGREES = 360.0
# attributes that scenarios use, however they are written
USED = ("depth", "volume", "return_period")
Tell = Callable[[str], None]


class OutlineError(ValueError):
    """A file without usable polygons; ``str()`` says ``expected ..., found ...``, and what to do."""


@dataclass(frozen=True, eq=False)
class Outline:
    """One polygon, or several that belong together.

    Parameters
    ----------
    name : str
        Of the feature, or its number.
    rings : tuple of array
        Each (n, 2), m, outer ones counter-clockwise, holes clockwise.
    attributes : dict[str, Any]
        Of the feature, by name.
    """

    name: str
    rings: tuple[Array, ...]
    attributes: dict[str, Any] = field(default_factory=dict)

    @property
    def digest(self) -> str:
        """SHA-256 of the coordinates."""
        found = hashlib.sha256()
        for ring in self.rings:
            found.update(np.ascontiguousarray(ring).tobytes() + b"|")
        return found.hexdigest()


@dataclass(frozen=True)
class Place:
    """A point, a line or a polygon: its name, its kind, and its corners, m."""

    name: str
    kind: Kind
    corners: tuple[tuple[float, float], ...]


_PLAIN: dict[str, Kind] = {"Point": "point", "LineString": "line", "Polygon": "polygon"}
KINDS: dict[str, Kind] = {**_PLAIN, **{f"Multi{name}": kind for name, kind in _PLAIN.items()}}


def read_lines(
    path: Path, crs: str, layer: str | None = None, tell: Tell | None = None
) -> tuple[Outline, ...]:
    """Read the lines of a file as `read` reads polygons; the rings of each are its parts, which stay open.

    Raises
    ------
    OutlineError
        If there is no such file or layer, a feature is no line, or the file has no reference system.
    """
    system, features = _features(path, layer, "lines", tell)
    found: list[Outline] = []
    for geometry, name, where, values in features:
        if geometry.geom_type not in ("LineString", "MultiLineString"):
            raise OutlineError(f"expected lines, found a {geometry.geom_type} in {where}")
        pieces = getattr(geometry, "geoms", [geometry])
        rings = tuple(_brought(np.asarray(piece.coords)[:, :2], system, crs, where) for piece in pieces)
        found.append(Outline(name, rings, values))
    if not found:
        raise OutlineError(f"expected lines, found none in {path.name}")
    return tuple(found)


def read(path: Path, crs: str, layer: str | None = None, tell: Tell | None = None) -> tuple[Outline, ...]:
    """Read the polygons of a file and bring them to a reference system.

    Parameters
    ----------
    path : Path
        GeoPackage, GeoJSON, Shapefile, or another file that GDAL reads.
    crs : str
        Reference system of the coordinates that are given back.
    layer : str, optional
        Layer, where the file has several.
    tell : callable, optional
        Told of features without a shape, which are left out.

    Raises
    ------
    OutlineError
        If there is no such file or layer, a feature is no polygon or crosses itself, or the file has no
        reference system.
    """
    import shapely

    system, features = _features(path, layer, "polygons", tell)
    outlines: list[Outline] = []
    for geometry, name, where, values in features:
        if geometry.geom_type not in ("Polygon", "MultiPolygon"):
            raise OutlineError(f"expected polygons, found a {geometry.geom_type} in {where}")
        _check_simple(geometry, where)
        rings: list[Array] = []
        for part in getattr(geometry, "geoms", [geometry]):
            turned = shapely.geometry.polygon.orient(part)
            for ring in (turned.exterior, *turned.interiors):
                rings.append(_brought(np.asarray(ring.coords)[:-1, :2], system, crs, where))
        outlines.append(Outline(name, tuple(rings), values))
    if not outlines:
        raise OutlineError(f"expected polygons, found none in {path.name}")
    return tuple(outlines)


def read_classes(path: Path, crs: str) -> tuple[Outline, ...]:
    """Read a raster of classes as polygons, one of each class but 0, and bring them to a reference system.

    Parameters
    ----------
    path : Path
        GeoTIFF, ASC, NetCDF, or another raster of one band of whole numbers that GDAL reads.
    crs : str
        Reference system of the coordinates that are given back.

    Raises
    ------
    OutlineError
        If it is none, or has no reference system or no class.
    """
    import rasterio
    import shapely
    from rasterio.errors import RasterioError
    from rasterio.features import shapes

    try:
        source = rasterio.open(path)
    except RasterioError as error:
        expected = "expected a raster of classes as GeoTIFF, ASC or NetCDF"
        raise OutlineError(f"{expected}, found {path.name}, which is none: {error}") from None
    with source:
        if source.count != 1:
            raise OutlineError(f"expected a raster of one band, found {source.count} bands")
        if source.crs is None:
            raise OutlineError(f"expected a reference system, found none in {path.name}")
        try:
            values = source.read(1, masked=True)
        except RasterioError:
            raise OutlineError(f"expected a raster of classes, found one {CUT_OFF}") from None
        classes = np.ma.filled(scaled(values, source), 0.0)
        step, system = source.transform, source.crs
    if not (np.mod(classes, 1) == 0).all():
        raise OutlineError("expected whole numbers as classes, found others")
    found: dict[int, list[Array]] = {}
    for geometry, number in shapes(classes.astype(np.int32), mask=classes != 0, transform=step):
        turned = shapely.geometry.polygon.orient(shapely.geometry.shape(geometry))
        found.setdefault(int(number), []).extend(
            _brought(np.asarray(ring.coords)[:-1, :2], system, crs, path.name)
            for ring in (turned.exterior, *turned.interiors)
        )
    if not found:
        raise OutlineError("expected a class beside 0, found none")
    return tuple(Outline(str(number), tuple(rings)) for number, rings in sorted(found.items()))


def read_places(
    path: Path, crs: str, layer: str | None = None, tell: Tell | None = None
) -> tuple[Place, ...]:
    """Read the points, lines and polygons of a file and bring them to a reference system.

    Of features with several parts each is a place of its own, called by a number after the name. Holes of
    polygons count as inside.

    Parameters
    ----------
    path, crs, layer, tell
        As `read` takes them.

    Raises
    ------
    OutlineError
        If there is no such file or layer, a feature is none or crosses itself, or the file has no
        reference system.
    """
    system, features = _features(path, layer, "points, lines or polygons", tell, "receptors")
    places: list[Place] = []
    names: Counter[str] = Counter()
    for geometry, name, where, _ in features:
        kind = KINDS.get(geometry.geom_type)
        if kind is None:
            found = f"found a {geometry.geom_type} in {where}"
            raise OutlineError(f"expected points, lines or polygons, {found}")
        _check_simple(geometry, where)
        for part in getattr(geometry, "geoms", [geometry]):
            coordinates = np.asarray((part.exterior if kind == "polygon" else part).coords)[:, :2]
            corners = _brought(coordinates[:-1] if kind == "polygon" else coordinates, system, crs, where)
            names[name] += 1
            own = name if names[name] == 1 else f"{name} {names[name]}"
            places.append(Place(own, kind, tuple((float(x), float(y)) for x, y in corners)))
    if not places:
        raise OutlineError(f"expected points, lines or polygons, found none in {path.name}")
    return tuple(places)


def _brought(corners: Array, system: Any, crs: str, where: str) -> Array:
    """Bring coordinates (n, 2) from one reference system to another."""
    # what GDAL says has no public name
    from rasterio._err import CPLE_BaseError
    from rasterio.warp import transform

    try:
        found = np.stack(transform(system, crs, *corners.T), axis=1)
    except (CPLE_BaseError, ValueError) as error:
        raise OutlineError(
            f"expected coordinates that {called(crs)} can hold, found {where}: {error}"
        ) from None
    if not np.isfinite(found).all():
        raise OutlineError(f"expected coordinates that {called(crs)} can hold, found others in {where}")
    return found


def _check_degrees(geometry: Any, system: str, where: str, *, json: bool) -> None:
    """Refuse what cannot be degrees in a file whose reference system has degrees."""
    from rasterio.crs import CRS

    if max(map(abs, geometry.bounds)) <= MOST_DEGREES:
        return
    if CRS.from_user_input(system).is_geographic:
        x, y, *_ = geometry.bounds
        found = f"found {where} at {x:.12g}, {y:.12g}"
        if json:
            said = f"expected degrees, as in {system}, which GeoJSON is in where it says nothing else"
            raise OutlineError(f"{said}, {found}; export it with its reference system, or as GeoPackage")
        fix = "ogr2ogr -a_srs EPSG:... gives it the reference system that its coordinates are of"
        raise OutlineError(f"expected degrees, as in {system}, that of the file, {found}; {fix}")


def _check_simple(geometry: Any, where: str) -> None:
    import shapely

    if not geometry.is_valid:
        raise OutlineError(f"expected simple polygons, found {where}: {shapely.is_valid_reason(geometry)}")


def _features(
    path: Path, layer: str | None, wanted: str, tell: Tell | None, key: str = ""
) -> tuple[Any, list[tuple[Any, str, str, dict[str, Any]]]]:
    """Read a layer: its system, and each feature with its name, its place in words and its attributes."""
    import pyogrio
    import shapely
    from pyogrio.errors import DataLayerError, DataSourceError

    try:
        # tables without shapes, as of styles, are no layers to choose from
        layers = [str(name) for name, shape in pyogrio.list_layers(path) if shape is not None]
        if layer is None and len(layers) > 1:
            said = f"layer: {layers[0]}"
            said = f"{key}: {{file: {path.name}, {said}}}" if key else said
            raise OutlineError(f"expected the layer to be named, found {', '.join(layers)}; write `{said}`")
        if layer is not None and layer not in layers:
            raise OutlineError(f"expected one of the layers {', '.join(layers)}, found '{layer}'")
        if not layers:
            raise OutlineError(f"expected {wanted}, found none in {path.name}")
        meta, _, geometries, columns = pyogrio.raw.read(path, layer=layer or layers[0])
    except (DataSourceError, DataLayerError) as error:
        expected = f"expected {wanted} as GeoPackage, GeoJSON or Shapefile"
        raise OutlineError(f"{expected}, found {path.name}, which is none: {error}") from None
    if meta["crs"] is None:
        shapefile = path.suffix.lower() == ".shp"
        fix = "a Shapefile has it in .prj" if shapefile else "ogr2ogr -a_srs EPSG:... gives the file one"
        raise OutlineError(f"expected a reference system, found none in {path.name}; {fix}")
    names = [str(name) for name in meta["fields"]]
    features: list[tuple[Any, str, str, dict[str, Any]]] = []
    made = list(shapely.from_wkb(geometries))
    empty = [number for number, geometry in enumerate(made) if geometry is None or geometry.is_empty]
    if empty and tell is not None:
        tell(f"{len(empty)} of {len(made)} features of {path.name} have no shape and are left out")
    for number, geometry in enumerate(made):
        if number in empty:
            continue
        values = {name: _plain(column[number]) for name, column in zip(names, columns, strict=True)}
        for used in USED:
            other = next((name for name in names if name.lower() == used), used)
            if used not in values and other in values:
                values[used] = values.pop(other)
        given = values.get("name") or values.get("Name") or values.get("NAME")
        name = str(given) if given else f"{number + 1}"
        where = f"feature {number + 1} ('{name}')" if given else f"feature {number + 1}"
        where = f"{where} of {path.name}"
        _check_degrees(geometry, meta["crs"], where, json=path.suffix.lower() in (".geojson", ".json"))
        features.append((geometry, name, where, values))
    return meta["crs"], features


def _plain(value: Any) -> Any:
    """Give an attribute as a Python value; None where it is missing."""
    value = value.item() if isinstance(value, np.generic) else value
    return None if isinstance(value, float) and np.isnan(value) else value
