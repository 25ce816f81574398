"""Map the hazard, and what differs between two scenarios."""

from __future__ import annotations

from collections.abc import Sequence
from os import PathLike
from pathlib import Path
from typing import TYPE_CHECKING

from pipeline.api.emulation import emulated, write_emulated
from pipeline.api.options import Tell, checked_thresholds, positive, silent, warn_user
from pipeline.api.places import place_of
from pipeline.errors import OptionError

if TYPE_CHECKING:
    import xarray as xr

    from pipeline.api.places import Place
    from pipeline.hazard.differences import Compared


def hazard_maps(
    out: Place,
    *,
    to: str | PathLike[str] | None = None,
    depth: Sequence[float] | None = None,
    speed: Sequence[float] | None = None,
    momentum_flux: Sequence[float] | None = None,
    pressure: Sequence[float] | None = None,
    erosion_depth: Sequence[float] | None = None,
    spacing: float | None = None,
    pictures: bool = True,
    emulate: bool = False,
    tell: Tell = silent,
    warn: Tell = warn_user,
) -> dict[str, xr.Dataset]:
    """Map the hazard of each scenario of a place, and of all together.

    Parameters
    ----------
    out : path, str or Results
        The place.
    to : path, optional
        Folder that the maps are written to: NetCDF and PNG, on the ground also GeoTIFF, GeoPackage, a project
        of QGIS and a STAC item.
        By default nothing is written.
    depth, speed, momentum_flux, pressure, erosion_depth : sequence of float, optional
        Thresholds (m, m s-1, m3 s-2, kPa, m) in place of those of the scenarios.
    spacing : float, optional
        Of the lattice that clouds are brought to, m; by default their mean spacing.
    pictures : bool
        Whether to draw the maps, where ``to`` is given.
    emulate : bool
        Whether to add emulated maps of sampled scenarios, see `emulate`, each with its error.
    tell, warn : callable
        Told what was made and written, and what could not be, a line each.

    Returns
    -------
    dict of str to Dataset
        Maps by name of scenario, those over all under ``"all scenarios"``; without these where the scenarios
        cannot be laid over each other, which is warned of. Emulated ones are under ``"<name>, emulated"``.

    Raises
    ------
    FileNotFoundError
        If the place holds no store.
    OptionError
        If a threshold or the spacing is not above 0, or thresholds are given of what no scenario has.
    OSError
        If something cannot be written.
    """
    from pipeline.assess.ensemble import NotTogetherError
    from pipeline.hazard.map_files import Written, write_maps, write_place
    from pipeline.hazard.mapping import nowhere
    from pipeline.hazard.netcdf import write
    from pipeline.hazard.place_maps import WHOLE, of_place

    thresholds = checked_thresholds(
        depth=depth, speed=speed, momentum_flux=momentum_flux, pressure=pressure, erosion_depth=erosion_depth
    )
    if spacing is not None:
        positive("spacing", [spacing])
    made: dict[str, xr.Dataset] = {}
    written: list[Written] = []
    place = place_of(out)
    try:
        for name, found in of_place(place, thresholds, spacing):
            made[name] = found
            tell(f"{name}: {found.attrs['comment']}")
            for line in nowhere(found):
                tell(f"{name}: {line}")
            if to is not None:
                folder = Path(to) if name == WHOLE else Path(to) / name
                tell(str(write(found, folder)))
                if pictures:
                    written.append(write_maps(found, folder))
                    for path in written[-1].paths:
                        tell(str(path))
    except NotTogetherError as error:
        warn(f"no map over all scenarios: {error}")
    for name, each in emulated(out, thresholds, warn) if emulate else ():
        if each.maps is not None:
            made[f"{name}, emulated"] = each.maps
            tell(each.comment)
        if to is not None:
            write_emulated(each, Path(to) / name / "emulated", pictures, tell)
    if to is not None:
        for path in write_place(written, Path(to), place.resolve().name):
            tell(str(path))
    return made


def compare(
    out: Place,
    scenarios: tuple[str, str],
    other: Place | None = None,
    *,
    to: str | PathLike[str] | None = None,
    depth: Sequence[float] | None = None,
    speed: Sequence[float] | None = None,
    momentum_flux: Sequence[float] | None = None,
    pressure: Sequence[float] | None = None,
    erosion_depth: Sequence[float] | None = None,
    spacing: float | None = None,
    pictures: bool = True,
    tell: Tell = silent,
) -> Compared:
    """Map and table how a second scenario differs from a first one, as with a dam and without it.

    Parameters
    ----------
    out : path, str or Results
        The place of the first scenario, and of the second where no other is given.
    scenarios : tuple of str
        Names of the first and of the second scenario.
    other : path, str or Results, optional
        The place of the second scenario.
    to : path, optional
        Folder that maps and tables are written to: NetCDF, PNG and CSV. By default nothing is written.
    depth, speed, momentum_flux, pressure, erosion_depth : sequence of float, optional
        Thresholds (m, m s-1, m3 s-2, kPa, m) in place of those of the scenarios.
    spacing : float, optional
        Of the lattice that clouds are brought to, m, which they need.
    pictures : bool
        Whether to draw the maps, where ``to`` is given.
    tell : callable
        Told what was made and written, a line each.

    Returns
    -------
    Compared
        ``maps`` of the second less the first, ``receptors``, a row a receptor and quantity, and ``sections``,
        a row a section and quantity; with bounds.

    Raises
    ------
    FileNotFoundError
        If there is no such scenario.
    ValueError
        If the scenarios do not have the same cells, thresholds and events.
    OptionError
        If a threshold or the spacing is not above 0, thresholds are given of what a scenario lacks, or one
        is compared with itself.
    OSError
        If something cannot be written.
    """
    from pipeline.hazard import differences
    from pipeline.hazard.map_files import write_differences
    from pipeline.hazard.netcdf import write

    thresholds = checked_thresholds(
        depth=depth, speed=speed, momentum_flux=momentum_flux, pressure=pressure, erosion_depth=erosion_depth
    )
    if spacing is not None:
        positive("spacing", [spacing])
    if other is None and scenarios[0] == scenarios[1]:
        raise OptionError("scenarios", f"expected two scenarios, found '{scenarios[0]}' twice")
    places = place_of(out), place_of(out if other is None else other)
    compared = differences.compare(places, scenarios, thresholds, spacing)
    found = compared.maps
    tell(f"{found.attrs['title']}: {found.attrs['comment']}")
    if to is not None:
        folder = Path(to)
        tell(str(write(found, folder, differences.FILE)))
        for path in differences.write_tables(compared, folder):
            tell(str(path))
        for path in write_differences(found, folder, "-".join(scenarios)) if pictures else ():
            tell(str(path))
    return compared
