"""Coordinate reference systems of scenarios."""

from __future__ import annotations

import warnings
from functools import lru_cache
from math import isfinite
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    # what is mapped decides no run
    from pipeline.settings.hazard import Georeference

# degrees beyond the area that a reference system is made for
FAR = 3.0
# share by which lengths in plan may differ from those on the ground
STRETCH = 0.005


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
    return f"{where}, but {called(crs)} is used in {area.name.rstrip('.')}: check the system"


def stretched(crs: str, x: float, y: float) -> str | None:
    """Say how much longer or shorter than on the ground lengths are at a place, if by more than `STRETCH`."""
    import pyproj

    system = pyproj.CRS.from_user_input(crs)
    lon, lat = pyproj.Transformer.from_crs(system, system.geodetic_crs, always_xy=True).transform(x, y)
    if not (isfinite(lon) and isfinite(lat)):
        return None
    factors = pyproj.Proj(system).get_factors(lon, lat)
    scale = max(factors.meridional_scale, factors.parallel_scale, key=lambda each: abs(each - 1))
    if not (isfinite(scale) and abs(scale - 1) > STRETCH):
        return None
    wrong = f"lengths in {called(crs)} are {scale:.3g} times those on the ground"
    return f"{wrong} there: gdalwarp -t_srs EPSG:... to the system of the country, or of the UTM zone"


def called(crs: str) -> str:
    """Give a reference system by its code, or by its name where it is WKT."""
    import pyproj

    return crs if crs.startswith("EPSG:") else f"'{pyproj.CRS.from_user_input(crs).name}'"


def in_plan(crs: str) -> str:
    """Give the part in plan of a reference system with heights, as WKT; others as they are."""
    import pyproj

    system = pyproj.CRS.from_user_input(crs)
    return system.sub_crs_list[0].to_wkt() if system.is_compound else crs


def same(one: str, other: str) -> bool:
    """Whether two reference systems, by code or WKT, are the same one but for heights and order of axes."""
    import pyproj

    first, second = (pyproj.CRS.from_user_input(in_plan(each)) for each in (one, other))
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
