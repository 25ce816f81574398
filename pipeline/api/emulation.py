"""Emulate the runs of sampled scenarios."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from os import PathLike
from pathlib import Path
from typing import TYPE_CHECKING

from pipeline.api.options import Tell, checked_thresholds, extra, silent, warn_user
from pipeline.api.places import place_of
from pipeline.errors import OptionError

if TYPE_CHECKING:
    from pipeline.api.places import Place
    from pipeline.emulation.emulate import Emulated

# below these draws shares have errors of their own
LEAST_DRAWS = 256


def emulate(
    out: Place,
    name: str | None = None,
    *,
    draws: int = 4096,
    to: str | PathLike[str] | None = None,
    depth: Sequence[float] | None = None,
    speed: Sequence[float] | None = None,
    momentum_flux: Sequence[float] | None = None,
    pressure: Sequence[float] | None = None,
    kinds: Sequence[str] = ("csv", "md"),
    pictures: bool = True,
    tell: Tell = silent,
    warn: Tell = warn_user,
) -> dict[str, Emulated]:
    """Emulate the runs of sampled scenarios: maps, receptors and quantiles of many draws, with their errors.

    Parameters
    ----------
    out : path, str or Results
        The place.
    name : str, optional
        One scenario; by default all that are sampled.
    draws : int
        Draws of maps; single numbers are over 4 times as many.
    to : path, optional
        Folder that tables and maps are written to, one by scenario. By default nothing is written.
    depth, speed, momentum_flux, pressure : sequence of float, optional
        Thresholds (m, m s-1, m3 s-2, kPa) in place of those of the scenarios.
    kinds : sequence of str
        How tables are written: ``csv``, ``parquet``, ``md``.
    pictures : bool
        Whether to draw the maps, where ``to`` is given.
    tell, warn : callable
        Told what was made and written, and what leave-one-out does not support, a line each.

    Returns
    -------
    dict of str to Emulated
        By name of scenario: ``tables`` with ``leave-one-out``, ``emulated-scenarios``, ``emulated-receptors``
        and ``emulated-missing``, and ``maps``. Scenarios that cannot be emulated are left out with a warning.

    Raises
    ------
    FileNotFoundError
        If the place holds no store.
    OptionError
        If a threshold is not above 0, there are too few draws, or the scenario that is named cannot be
        emulated.
    OSError
        If something cannot be written.
    """
    from pipeline.assess.tables import write

    thresholds = checked_thresholds(depth=depth, speed=speed, momentum_flux=momentum_flux, pressure=pressure)
    if draws < LEAST_DRAWS:
        raise OptionError("draws", f"expected at least {LEAST_DRAWS}, found {draws}")
    made: dict[str, Emulated] = {}
    for each, found in emulated(out, thresholds, warn, name, draws):
        made[each] = found
        tell(found.comment)
        if to is not None:
            with extra("parquet"):
                for path in write(dict(found.tables), Path(to) / each, list(kinds)):
                    tell(str(path))
            write_emulated(found, Path(to) / each, pictures, tell)
    return made


def emulated(
    out: Place,
    thresholds: Mapping[str, tuple[float, ...]],
    warn: Tell,
    name: str | None = None,
    draws: int = 4096,
) -> Iterator[tuple[str, Emulated]]:
    """Emulate the scenarios of a place; warn of those that cannot be, and of what leave-one-out refuses."""
    from pipeline.emulation.emulate import of_place
    from pipeline.emulation.errors import NotEmulatedError

    for each, found in of_place(place_of(out), thresholds, name, draws):
        if isinstance(found, NotEmulatedError):
            if name is not None:
                raise OptionError("", f"{each}: cannot be emulated: {found}")
            warn(f"{each}: cannot be emulated: {found}")
            continue
        for line in found.refused:
            warn(f"{each}: {line}; plain shares stand in the tables")
        yield each, found


def write_emulated(found: Emulated, folder: Path, pictures: bool, tell: Tell) -> None:
    """Write emulated maps to a folder; where there is none nothing is written."""
    from pipeline.emulation.emulate import FILE
    from pipeline.hazard.map_files import write_maps
    from pipeline.hazard.netcdf import write

    if found.maps is None:
        return
    tell(str(write(found.maps, folder, FILE)))
    for path in write_maps(found.maps, folder).paths if pictures else ():
        tell(str(path))
