"""Elevation models: rasters of elevation in a projected reference system (GeoTIFF, ASC, NetCDF)."""

from __future__ import annotations

import hashlib
import warnings
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from pipeline.inputs.raster_band import CUT_OFF, scaled
from pipeline.inputs.reference_system import called, in_plan

# What rasters hold where they hold nothing, beside the value that they declare.
NO_DATA = (-9999.0, -99999.0, -32768.0, -32767.0)
# Elevations on Earth, m, with room to spare.
LOWEST, HIGHEST = -500.0, 9000.0
EVEN = 1e-3
# units of elevation: metres, and what is found in feet
METRES = ("", "m", "metre", "metres", "meter", "meters", "m asl", "m a.s.l.", "masl", "m above sea level")
FEET = ("ft", "feet", "foot", "'")


class ElevationRasterError(ValueError):
    """A file that is no elevation model; ``str()`` says ``expected ..., found ...``, and what to do."""


class UnknownSystemError(ElevationRasterError):
    """A reference system that was given and is none."""


@dataclass(frozen=True, eq=False)
class ElevationRaster:
    """Elevations of square cells, rows from south to north.

    Parameters
    ----------
    x, y : array
        Eastings (n,) and northings (m,) of the cell centres, increasing, m.
    elevation : (m, n) array
        In m; NaN where there is no data.
    crs : str
        Reference system, as ``EPSG:2056`` or WKT.
    digest : str
        SHA-256 of all of it.
    """

    x: NDArray[np.float64]
    y: NDArray[np.float64]
    elevation: NDArray[np.float64]
    crs: str
    digest: str

    @property
    def spacing(self) -> float:
        """Side of a cell, m."""
        return float(self.x[1] - self.x[0])


@dataclass(frozen=True)
class RasterExtent:
    """Where an elevation model lies, without its elevations.

    Parameters
    ----------
    x, y : tuple of float
        Eastings and northings of the centres of its outermost cells, m.
    spacing : float
        Side of a cell, m.
    crs : str
        Reference system, as ``EPSG:2056`` or WKT.
    """

    x: tuple[float, float]
    y: tuple[float, float]
    spacing: float
    crs: str

    @property
    def edges(self) -> tuple[tuple[float, float], tuple[float, float]]:
        """Outer edges along x and y, m."""
        half = self.spacing / 2
        (x0, x1), (y0, y1) = self.x, self.y
        return (x0 - half, x1 + half), (y0 - half, y1 + half)


@contextmanager
def _opened(path: Path) -> Iterator[Any]:
    """Open a raster of one band with square cells north up."""
    import rasterio
    from rasterio.errors import NotGeoreferencedWarning, RasterioError

    try:
        with warnings.catch_warnings():
            # it is told below
            warnings.simplefilter("ignore", NotGeoreferencedWarning)
            source = rasterio.open(path)
    except RasterioError as error:
        expected = "expected an elevation model as GeoTIFF, ASC or NetCDF"
        raise ElevationRasterError(f"{expected}, found {path.name}, which is none: {error}") from None
    with source:
        if source.subdatasets:
            names = [each.rpartition(":")[2] for each in source.subdatasets]
            raise ElevationRasterError(
                f"expected a raster of one variable, found {', '.join(names)}; write that of elevations to a "
                f"file of its own: gdal_translate NETCDF:{path.name}:{names[0]} {names[0]}.tif"
            )
        if source.count != 1:
            raise ElevationRasterError(f"expected a raster of one band, found {source.count} bands")
        step = source.transform
        if step.is_identity:
            raise ElevationRasterError(
                "expected a raster that says where it lies, found one without corner and cell size; "
                "gdal_edit.py -a_ullr WEST NORTH EAST SOUTH gives it them"
            )
        if step.b or step.d or step.e >= 0 or abs(step.a + step.e) > EVEN * step.a:
            raise ElevationRasterError(
                "expected square cells north up, found others; gdalwarp -tr D D makes them"
            )
        unit = str(source.units[0] or "").strip().strip("[]").lower()
        if unit not in METRES:
            fix = "gdal_calc.py --calc 'A*0.3048' makes metres of feet"
            if not any(word in unit for word in FEET):
                fix = f"gdal_calc.py makes metres of others, and gdal_edit.py -units m {path.name} says so"
            raise ElevationRasterError(f"expected elevations in metres, found '{source.units[0]}'; {fix}")
        yield source


def extent(path: Path, crs: str | None = None) -> RasterExtent:
    """Read where an elevation model lies, whatever its size; its elevations are not read.

    Parameters
    ----------
    path : Path
        As `read` takes it.
    crs : str, optional
        Reference system where the file has none.

    Raises
    ------
    ElevationRasterError
        If it is no raster of one band in a projected reference system in metres with square cells north up.
    """
    with _opened(path) as source:
        step, system = source.transform, _system(source.crs, crs)
        east, north = step.c + step.a / 2, step.f + step.e / 2
        return RasterExtent(
            (east, east + step.a * (source.width - 1)), (north - step.a * (source.height - 1), north),
            step.a, system,
        )  # fmt: skip


def read(
    path: Path,
    crs: str | None = None,
    x: tuple[float, float] | None = None,
    y: tuple[float, float] | None = None,
) -> ElevationRaster:
    """Read an elevation model, or the part of it around a rectangle.

    Parameters
    ----------
    path : Path
        GeoTIFF, ASC, NetCDF, or another raster that GDAL reads.
    crs : str, optional
        Reference system where the file has none.
    x, y : tuple of float, optional
        Eastings and northings of the rectangle, m; four cells around it are read too.

    Raises
    ------
    ElevationRasterError
        If it is no raster of one band in a projected reference system in metres with square cells north up,
        or holds no elevations there.
    """
    from rasterio.errors import RasterioError
    from rasterio.windows import Window, from_bounds

    with _opened(path) as source:
        step, system = source.transform, _system(source.crs, crs)
        window = Window(0, 0, source.width, source.height)
        if x is not None and y is not None:
            d = 4 * step.a
            asked = from_bounds(x[0] - d, y[0] - d, x[1] + d, y[1] + d, step)
            whole = asked.round_offsets().round_lengths(op="ceil")
            try:
                window = window.intersection(whole)
            except RasterioError:
                raise ElevationRasterError(
                    f"expected a raster that covers the domain, found one of {_extent(source.bounds)}"
                ) from None
        try:
            values = source.read(1, window=window, masked=True)
        except RasterioError:
            raise ElevationRasterError(f"expected an elevation model, found one {CUT_OFF}") from None
        values[np.isin(values, NO_DATA)] = np.ma.masked
        elevation = np.ma.filled(scaled(values, source), np.nan)[::-1]
        corner = source.window_transform(window)
        east, north = corner.c + corner.a / 2, corner.f + corner.e / 2
    if not np.isfinite(elevation).any():
        raise ElevationRasterError("expected elevations, found no data alone in the domain")
    low, high = float(np.nanmin(elevation)), float(np.nanmax(elevation))
    if low < LOWEST or high > HIGHEST:
        worst = low if low < LOWEST else high
        raise ElevationRasterError(
            f"expected elevations between {LOWEST:g} and {HIGHEST:g} m, found {low:g} to {high:g}; where "
            f"{worst:.10g} means no data, declare it in the file (gdal_edit.py -a_nodata {worst:.10g})"
        )
    rows, columns = elevation.shape
    if min(rows, columns) < 4:
        raise ElevationRasterError(f"expected 4 rows and columns or more, found {rows} by {columns}")
    northings = (north - step.a * np.arange(rows))[::-1]
    digest = hashlib.sha256(repr((system, step.a, east, north, elevation.shape)).encode())
    digest.update(np.ascontiguousarray(elevation).tobytes())
    return ElevationRaster(
        east + step.a * np.arange(columns),
        np.ascontiguousarray(northings),
        np.ascontiguousarray(elevation),
        system,
        digest.hexdigest(),
    )


def _system(found: object, given: str | None) -> str:
    """Give the reference system of a raster, of its file or as given, if it is a projected one in metres."""
    from rasterio.crs import CRS
    from rasterio.errors import CRSError

    if found is None and given is None:
        raise ElevationRasterError(
            "expected a reference system, found none in the file; write it as `crs: EPSG:2056`"
        )
    try:
        # one that is given beside that of the file is compared with it
        asked = None if given is None else CRS.from_user_input(given)
        system = asked if found is None else CRS.from_user_input(found)
    except CRSError:
        raise UnknownSystemError(
            f"expected a reference system, as EPSG:2056, found '{given}', which is none"
        ) from None
    assert system is not None
    if (plan := in_plan(system.to_wkt())) != system.to_wkt():
        system = CRS.from_wkt(plan)
    if system.is_geographic:
        raise ElevationRasterError(
            "expected coordinates in metres, found a reference system in degrees; "
            "gdalwarp -t_srs EPSG:... projects the raster"
        )
    if not system.is_projected:
        raise ElevationRasterError(
            f"expected a projected reference system, found {called(system.to_wkt())}, which is none; "
            "gdal_edit.py -a_srs EPSG:... gives the raster one"
        )
    units, factor = system.linear_units_factor
    if abs(factor - 1) > 1e-9:
        raise ElevationRasterError(
            f"expected coordinates in metres, found {units}; gdalwarp -t_srs EPSG:... projects the raster"
        )
    code = system.to_epsg()
    return f"EPSG:{code}" if code is not None else str(system.to_wkt())


def _extent(bounds: tuple[float, float, float, float]) -> str:
    west, south, east, north = bounds
    return f"x {west:.12g} to {east:.12g}, y {south:.12g} to {north:.12g}"
