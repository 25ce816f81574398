"""Outlines on the map: polygons from GeoPackage, GeoJSON or Shapefile, in the reference system asked for."""

from __future__ import annotations

import hashlib
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]


class OutlineError(ValueError):
    """A file without usable polygons; ``str()`` says ``expected ..., found ...``, and what to do."""


@dataclass(frozen=True, eq=False)
class Outline:
    """One polygon, or several that belong together.

    name : of the feature, or its number. rings : each (n, 2), m, outer ones counter-clockwise, holes
    clockwise. attributes : of the feature, by name.
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


def read(path: Path, crs: str, layer: str | None = None) -> tuple[Outline, ...]:
    """Read the polygons of a file and bring them to a reference system.

    Parameters
    ----------
    path : Path
        GeoPackage, GeoJSON, Shapefile, or another file that GDAL reads.
    crs : str
        Reference system of the coordinates that are given back.
    layer : str, optional
        Layer, where the file has several.

    Raises
    ------
    OutlineError
        If there is no such file or layer, a feature is no polygon or crosses itself, or the file has no
        reference system.
    """
    import pyogrio
    import shapely
    from pyogrio.errors import DataLayerError, DataSourceError
    from rasterio.warp import transform

    try:
        layers = [str(name) for name, _ in pyogrio.list_layers(path)]
        if layer is None and len(layers) > 1:
            raise OutlineError(
                f"expected the layer to be named, found {', '.join(layers)}; write `layer: ...`"
            )
        if layer is not None and layer not in layers:
            raise OutlineError(f"expected one of the layers {', '.join(layers)}, found '{layer}'")
        meta, _, geometries, columns = pyogrio.raw.read(path, layer=layer)
    except (DataSourceError, DataLayerError) as error:
        expected = "expected polygons as GeoPackage, GeoJSON or Shapefile"
        raise OutlineError(f"{expected}, found {path.name}, which is none: {error}") from None
    if meta["crs"] is None:
        found = f"found none in {path.name}; a Shapefile has it in .prj"
        raise OutlineError(f"expected a reference system, {found}")
    names = [str(name) for name in meta["fields"]]
    outlines: list[Outline] = []
    for number, geometry in enumerate(list(shapely.from_wkb(geometries))):
        values = {name: _plain(column[number]) for name, column in zip(names, columns, strict=True)}
        given = values.get("name") or values.get("Name") or values.get("NAME")
        name = str(given) if given else f"{number + 1}"
        where = f"feature {number + 1} ('{name}')" if given else f"feature {number + 1}"
        if geometry is None or geometry.is_empty or geometry.geom_type not in ("Polygon", "MultiPolygon"):
            kind = "nothing" if geometry is None or geometry.is_empty else f"a {geometry.geom_type}"
            raise OutlineError(f"expected polygons, found {kind} in {where} of {path.name}")
        if not geometry.is_valid:
            reason = shapely.is_valid_reason(geometry)
            raise OutlineError(f"expected simple polygons, found {where} of {path.name}: {reason}")
        rings: list[Array] = []
        for part in getattr(geometry, "geoms", [geometry]):
            turned = shapely.geometry.polygon.orient(part)
            for ring in (turned.exterior, *turned.interiors):
                x, y = np.asarray(ring.coords)[:-1, :2].T
                rings.append(np.stack(transform(meta["crs"], crs, x, y), axis=1))
        if not all(np.isfinite(ring).all() for ring in rings):
            raise OutlineError(
                f"expected coordinates that {crs} can hold, found others in {where} of {path.name}"
            )
        outlines.append(Outline(name, tuple(rings), values))
    if not outlines:
        raise OutlineError(f"expected polygons, found none in {path.name}")
    return tuple(outlines)


def _plain(value: Any) -> Any:
    """Give an attribute as a Python value; None where it is missing."""
    value = value.item() if isinstance(value, np.generic) else value
    return None if isinstance(value, float) and np.isnan(value) else value
