"""The profile on the ground: its points in a projected reference system, its fields on a grid north up."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import xarray as xr
from numpy.typing import NDArray

from pipeline.settings.hazard import Georeference

Array = NDArray[np.float64]
SPACE = ("y", "x")
# of the code of a reference system
LONGEST = 20


class GeoreferenceError(ValueError):
    """Results cannot be laid on the map; ``str()`` says why."""


@dataclass(frozen=True)
class MapAxes:
    """A lattice whose x are eastings and whose y are northings, as on an elevation model.

    Parameters
    ----------
    crs : str
        Its reference system, as EPSG:2056 or WKT.
    """

    crs: str
    origin: tuple[float, float] = (0.0, 0.0)
    azimuth: float = 90.0


@dataclass(frozen=True, eq=False)
class Frame:
    """Where the points of a lattice lie on the map.

    Parameters
    ----------
    georeference : Georeference or MapAxes
        Reference system, origin and azimuth.
    arc, distance : (nx,) array
        Arc length and horizontal distance of the points along the profile, m, both ascending.
    across : (ny,) array
        Their positions across it, m, evenly spaced.
    """

    georeference: Georeference | MapAxes
    arc: Array
    distance: Array
    across: Array

    @property
    def is_map(self) -> bool:
        """Whether the lattice itself lies along eastings and northings."""
        return isinstance(self.georeference, MapAxes)

    @property
    def system(self) -> str:
        """Reference system for people: its code, or the name that its WKT begins with."""
        code = self.georeference.crs
        return code if len(code) < LONGEST else code.split('"')[1]

    @property
    def _downslope(self) -> tuple[float, float]:
        """Unit vector of growing x, east and north."""
        if self.is_map:
            return 1.0, 0.0
        azimuth = np.radians(self.georeference.azimuth)
        return float(np.sin(azimuth)), float(np.cos(azimuth))

    def on_map(self, x: Array, y: Array) -> tuple[Array, Array]:
        """Easting and northing of points at arc length x and y across, m, of any one shape."""
        if self.is_map:
            return x, y
        (east, north), (e0, n0) = self._downslope, self.georeference.origin
        s = np.interp(x, self.arc, self.distance)
        # y grows to the left of x, as seen from above
        return e0 + s * east - y * north, n0 + s * north + y * east

    def indices(self, easting: Array, northing: Array) -> tuple[Array, Array, NDArray[np.bool_]]:
        """Find places on the lattice: fractional indices along y and x, and whether a cell of it is there."""
        (east, north), (e0, n0) = self._downslope, self.georeference.origin
        s = (easting - e0) * east + (northing - n0) * north
        y = (northing - n0) * east - (easting - e0) * north
        (west, right), (low, high) = _edges(self.distance), _edges(self.across)
        inside = (s >= west) & (s <= right) & (y >= low) & (y <= high)
        column = np.interp(s, self.distance, np.arange(len(self.distance), dtype=float))
        row = np.interp(y, self.across, np.arange(len(self.across), dtype=float))
        return row, column, inside

    @property
    def corners(self) -> tuple[Array, Array]:
        """Easting and northing of the corners of the lattice's outer cells, in turn, (4,), m."""
        (east, north), (e0, n0) = self._downslope, self.georeference.origin
        s = np.repeat(_edges(self.distance), 2)
        y = np.array(_edges(self.across))[[0, 1, 1, 0]]
        return e0 + s * east - y * north, n0 + s * north + y * east

    @property
    def spacing(self) -> float:
        """Of the map's grid, m: that across the profile."""
        return float(self.across[1] - self.across[0])


def frame(found: xr.Dataset, georeference: Georeference | MapAxes) -> Frame:
    """Lay the lattice of hazard maps on the map.

    Raises
    ------
    GeoreferenceError
        If the profile differs between the runs.
    """
    if isinstance(georeference, MapAxes):
        x, y = (found[axis].to_numpy().astype(np.float64) for axis in ("x", "y"))
        return Frame(georeference, x, x, y)
    if "horizontal_distance" not in found.coords:
        raise GeoreferenceError("the profile differs between the runs, so that their places on the map do")
    places = (found[name].to_numpy() for name in ("x", "horizontal_distance", "y"))
    return Frame(georeference, *(np.asarray(place, np.float64) for place in places))


def north_up(found: xr.Dataset, frame: Frame) -> xr.Dataset:
    """Bring maps to a grid of the reference system whose rows run from north to south.

    A lattice along eastings and northings stays as it is, turned over. Of others shares and quantiles are
    interpolated between the four nearest points of the lattice; classes and times of
    arrival are those of the nearest one. What is outside the lattice's cells is missing, in whole numbers -1.

    Parameters
    ----------
    found : Dataset
        Over ``y`` and ``x`` of the lattice, y ascending.
    frame : Frame
        Of this lattice.

    Returns
    -------
    Dataset
        Over ``y``, northing, and ``x``, easting of the cells' centres, m, whole multiples of the spacing.
    """
    if frame.is_map:
        return _turned(found)
    step = frame.spacing
    easting, northing = (
        np.arange(np.floor(corners.min() / step), np.ceil(corners.max() / step) + 1) * step
        for corners in frame.corners
    )
    row, column, inside = frame.indices(*np.meshgrid(easting, northing[::-1]))
    held = {}
    for name, values in found.data_vars.items():
        if values.dims[-2:] != SPACE:
            continue
        given = values.to_numpy()
        if np.issubdtype(given.dtype, np.integer):
            placed = np.where(inside, _nearest(given, row, column), -1).astype(given.dtype)
        else:
            way = _nearest if str(name).endswith("arrival_time") else _between
            placed = np.where(inside, way(given, row, column), np.nan).astype(given.dtype)
        held[name] = (values.dims, placed, values.attrs)
    kept = {name: c for name, c in found.coords.items() if not set(SPACE) & set(c.dims)}
    return xr.Dataset(held, coords={**kept, **_axes(easting, northing[::-1])}, attrs=found.attrs)


def _axes(easting: Array, northing: Array) -> dict[str, tuple[str, Array, dict[str, str]]]:
    return {
        axis: (axis, places, {"standard_name": f"projection_{axis}_coordinate", "units": "m"})
        for axis, places in (("x", easting), ("y", northing))
    }


def _turned(found: xr.Dataset) -> xr.Dataset:
    """Give maps over northings and eastings from north to south, with nothing interpolated."""
    held = {
        name: (values.dims, values.to_numpy()[..., ::-1, :], values.attrs)
        for name, values in found.data_vars.items()
        if values.dims[-2:] == SPACE
    }
    kept = {name: c for name, c in found.coords.items() if not set(SPACE) & set(c.dims)}
    axes = _axes(found["x"].to_numpy(), found["y"].to_numpy()[::-1])
    return xr.Dataset(held, coords={**kept, **axes}, attrs=found.attrs)


def _edges(places: Array) -> tuple[float, float]:
    """Outer edges of the first and the last cell."""
    first, last = places[1] - places[0], places[-1] - places[-2]
    return float(places[0] - first / 2), float(places[-1] + last / 2)


def _nearest(values: NDArray[np.generic], row: Array, column: Array) -> NDArray[np.generic]:
    return values[..., np.rint(row).astype(int), np.rint(column).astype(int)]


def _between(values: Array, row: Array, column: Array) -> Array:
    """Bilinear interpolation in (..., ny, nx); a place next to a missing value has none."""
    above = np.clip(row.astype(int), 0, values.shape[-2] - 2)
    left = np.clip(column.astype(int), 0, values.shape[-1] - 2)
    down, right = row - above, column - left
    upper = values[..., above, left] * (1 - right) + values[..., above, left + 1] * right
    lower = values[..., above + 1, left] * (1 - right) + values[..., above + 1, left + 1] * right
    return np.asarray(upper * (1 - down) + lower * down)
