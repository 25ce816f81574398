"""What the files of a scenario on elevation models hold, and the domains that fit an elevation model."""

from __future__ import annotations

import hashlib
from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from pipeline.hints import of_exchanged
from pipeline.inputs import elevation_raster
from pipeline.inputs.elevation_raster import ElevationRaster, RasterExtent
from pipeline.inputs.outlines import Outline
from pipeline.inputs.reference_system import called
from pipeline.mistakes import Problem
from pipeline.readable import percent
from pipeline.settings.section import Pair
from pipeline.settings.settings import Domain
from solver.physics.elevation import SAME

# no bed of loose material is steeper, degrees
STEEP = 60.0
# of a cell
SLIVER = 1e-9
LEAST_CELLS = 4
# ground above it has no neighbour at exactly 0, m
HIGH = 50.0


@dataclass(frozen=True, eq=False)
class Ground:
    """What the files of a scenario on elevation models hold.

    Parameters
    ----------
    rasters : mapping of str to ElevationRaster
        Elevation models by file, around the domain; the first is that of the scenario itself, the others
        those of runs.
    extent : RasterExtent
        Of the whole first elevation model.
    folder : Path
        That names of files are relative to.
    given_crs : str, optional
        Reference system of elevation models that have none.
    reach : float
        How far beyond the domain elevations are averaged from, m.
    outlines : mapping of (str, str or None) to tuple of Outline
        Polygons, and lines of dams, by file and layer.
    depths : mapping of str to ElevationRaster
        Rasters of erodible depth by file.
    """

    rasters: Mapping[str, ElevationRaster]
    extent: RasterExtent
    folder: Path
    given_crs: str | None = None
    reach: float = 0.0
    outlines: Mapping[tuple[str, str | None], tuple[Outline, ...]] = field(default_factory=dict)
    depths: Mapping[str, ElevationRaster] = field(default_factory=dict)

    @property
    def crs(self) -> str:
        """Reference system of all of it."""
        return self.extent.crs

    @property
    def digests(self) -> dict[str, Any]:
        """Hashes of all of it that decides a run, by name of file."""
        found = {
            " ".join(filter(None, name)): _digest(held)
            for name, held in sorted(self.outlines.items(), key=str)
        }
        elevations = {name: raster.digest for name, raster in sorted(self.rasters.items())}
        depths = {name: raster.digest for name, raster in sorted(self.depths.items())}
        one = next(iter(elevations.values())) if len(elevations) == 1 else elevations
        return {"elevation": one, "polygons": found, **({"erodible_depth": depths} if depths else {})}

    def within(self, domain: Domain, reach: float = 0.0) -> Ground:
        """Read the rasters around another domain.

        Parameters
        ----------
        domain : Domain
            The other domain.
        reach : float
            How far beyond it elevations are needed at least, m.

        Raises
        ------
        ElevationRasterError
            If a file is no longer what it was, or holds nothing there.
        """
        bounds = around(domain, max(reach, self.reach))

        def read(name: str, crs: str | None) -> ElevationRaster:
            return elevation_raster.read(self.folder / name, crs, *bounds)

        return replace(
            self,
            rasters={name: read(name, self.given_crs) for name in self.rasters},
            depths={name: read(name, self.crs) for name in self.depths},
        )


def doubtful(raster: ElevationRaster, domain: Domain) -> list[str]:
    """Say what is doubtful of an elevation model within a domain: cells without data, and steep ones."""
    sides = ((raster.y, domain.y), (raster.x, domain.x))
    half = raster.spacing / 2
    inside = np.ix_(*((low - half < at) & (at < high + half) for at, (low, high) in sides))
    said = []
    filled = _filled(raster.elevation[inside])
    if filled > 0:
        said.append(
            f"{percent(filled)} of the domain are at exactly 0 m beside ground above {HIGH:g} m: if this "
            "means no data, declare it in the file (gdal_edit.py -a_nodata 0)"
        )
    gaps = float(np.isnan(raster.elevation[inside]).mean())
    if gaps > 0:
        fix = "fill them (gdal_fillnodata.py) if flow comes there"
        said.append(f"{percent(gaps)} of the domain have no data; what flows there has left: {fix}")
    with np.errstate(invalid="ignore"):
        slope = np.degrees(np.arctan(np.hypot(*np.gradient(raster.elevation, raster.spacing))))
        steep = float((slope[inside] > STEEP).mean())
    if steep > 0:
        fix = "where that are no cliffs, check the unit of elevations, and what stands for no data"
        said.append(f"{percent(steep)} of the cells are steeper than {STEEP:g} degrees: {fix}")
    return said


def _filled(elevation: NDArray[np.float64]) -> float:
    """Share of cells that are at exactly 0 m where no other is low; 0 near the sea."""
    rest = elevation[(elevation != 0) & np.isfinite(elevation)]
    return float((elevation == 0).mean()) if rest.size and rest.min() > HIGH else 0.0


def _digest(held: tuple[Outline, ...]) -> str:
    lines = []
    for each in held:
        depth, volume = (each.attributes.get(name) for name in ("depth", "volume"))
        # what has no volume has the hash that it had before there were any
        lines.append(f"{each.name}|{depth}|{'' if volume is None else f'{volume}|'}{each.digest}\n")
    return hashlib.sha256("".join(lines).encode()).hexdigest()


def around(domain: Domain, reach: float) -> tuple[Pair, Pair]:
    """Bounds along x and y of a domain and as much around it, m."""
    (x0, x1), (y0, y1) = domain.x, domain.y
    return (x0 - reach, x1 + reach), (y0 - reach, y1 + reach)


def clipped(domain: Domain, extent: RasterExtent) -> Domain:
    """Give the part of a domain on an elevation model; a sliver of it where there is none."""
    sides = []
    for (low, high), (first, last) in zip((domain.x, domain.y), (extent.x, extent.y), strict=True):
        start = min(max(low, first), last - LEAST_CELLS * extent.spacing)
        sides.append((start, max(min(high, last), start + LEAST_CELLS * extent.spacing)))
    return Domain(x=sides[0], y=sides[1])


def beyond(domain: Domain, extent: RasterExtent) -> Problem | None:
    """Say that a domain goes beyond an elevation model, if it does."""
    for axis, (west, east) in zip("xy", extent.edges, strict=True):
        low, high = getattr(domain, axis)
        if low < west - SLIVER * extent.spacing or high > east + SLIVER * extent.spacing:
            wanted = f"expected a domain on the elevation model, which covers {axis} from {west:.12g} to"
            hint = of_exchanged(domain.x, domain.y, *extent.edges)
            if not hint and (high < west or low > east):
                hint = f"; write coordinates of its reference system, {called(extent.crs)}"
            return Problem(
                ("domain", axis), f"{wanted} {east:.12g} m, found [{low:.12g}, {high:.12g}]{hint}",
                related=(("domain", axis), ("terrain", "elevation")),
            )  # fmt: skip
    return None


def fitted(asked: Domain | None, extent: RasterExtent, spacing: float) -> Domain | Problem:
    """Give the domain asked for, or all of an elevation model, in whole cells.

    Where spacings agree its points are the centres of the elevation model's cells.
    """
    if asked is not None and (wrong := beyond(asked, extent)) is not None:
        return wrong
    found = {}
    alike = abs(spacing - extent.spacing) < SAME * extent.spacing
    for axis, (first, last) in zip("xy", (extent.x, extent.y), strict=True):
        low, high = (first, last) if asked is None else getattr(asked, axis)
        if alike:
            # to the centres within
            count = round((last - first) / extent.spacing)
            start = max(int(np.ceil((low - first) / spacing - SAME)), 0)
            stop = min(int(np.floor((high - first) / spacing + SAME)), count)
            step = (last - first) / count
            low, high = first + step * start, first + step * max(stop, start)
        else:
            high = low + spacing * np.floor((high - low) / spacing + SAME)
        if high - low < (LEAST_CELLS - 0.5) * spacing:
            found_here = f"found {high - low:g} m at {spacing:g} m"
            message = f"expected {LEAST_CELLS} cells or more along {axis}, {found_here}"
            return Problem(("domain", axis) if asked else ("points", "spacing"), message)
        found[axis] = float(f"{low:.12g}"), float(f"{high:.12g}")
    return Domain(**found)
