"""Coordinate reference systems of scenarios."""

from __future__ import annotations

import warnings
from functools import lru_cache
from math import isfinite
from typing import Any

from pipeline.settings.hazard import Georeference

# degrees beyond the area that a reference system is made for
FAR = 3.0


@lru_cache(maxsize=64)
def doubt(georeference: Georeference) -> tuple[str, str] | None:
    """Say what is wrong with a georeference, and of which of its keys; None where nothing is known to be."""
    import rasterio.crs
    import rasterio.errors
    from rasterio.warp import transform

    code = georeference.crs
    try:
        with rasterio.Env():
            crs = rasterio.crs.CRS.from_user_input(code)
            unit, factor = crs.linear_units_factor if crs.is_projected else ("degrees", 0.0)
    except (rasterio.errors.CRSError, ValueError):
        return "crs", f"expected the code of a known reference system, found '{code}'"
    if not crs.is_projected or factor != 1:
        kind = f"one of {unit}" if crs.is_projected else "one that is not projected"
        return "crs", f"expected a projected reference system with metres, found {code}, {kind}"
    try:
        (lon,), (lat,) = transform(crs, "EPSG:4326", *([value] for value in georeference.origin))
    except (rasterio.errors.CRSError, ValueError):
        return None
    if not (isfinite(lon) and isfinite(lat)):
        return "origin", f"expected a place that {code} has, found {list(georeference.origin)}"
    return None


def elsewhere(crs: str, x: float, y: float) -> str | None:
    """Say where a place lies, if its reference system is not used there."""
    import pyproj

    system = pyproj.CRS.from_user_input(crs)
    area = system.area_of_use
    if area is None:
        return None
    to_degrees = pyproj.Transformer.from_crs(system, "EPSG:4326", always_xy=True)
    lon, lat = to_degrees.transform(x, y)
    where = "at no place on Earth"
    if isfinite(lon) and isfinite(lat):
        if area.west - FAR <= lon <= area.east + FAR and area.south - FAR <= lat <= area.north + FAR:
            return None
        where = f"at longitude {lon:.1f} and latitude {lat:.1f}"
    return f"{where}, but {crs} is used in {area.name.rstrip('.')}: check the system"


def same(one: str, other: str) -> bool:
    """Whether two reference systems, by code or WKT, are the same one but for the order of axes."""
    import pyproj

    first, second = (pyproj.CRS.from_user_input(each) for each in (one, other))
    return bool(first.equals(second, ignore_axis_order=True))


def cf_attributes(crs: str) -> dict[str, Any]:
    """Give a reference system as the attributes of a grid mapping of the CF conventions, with its WKT."""
    import pyproj

    with warnings.catch_warnings():
        # parameters that CF has no names for; the WKT beside them has all
        warnings.simplefilter("ignore", UserWarning)
        found: dict[str, Any] = pyproj.CRS.from_user_input(crs).to_cf()
    # the name by which GDAL looks for it
    return {**found, "spatial_ref": found["crs_wkt"]}
