"""The files of hazard maps: pictures, and what other programs read where the profile is georeferenced."""

from __future__ import annotations

import logging
import re
from collections.abc import Callable, Iterable, Iterator, Sequence
from dataclasses import dataclass, replace
from datetime import UTC, datetime
from pathlib import Path

import numpy as np
import xarray as xr

from pipeline.assess.georeference import Frame, MapAxes, frame
from pipeline.gis.layer import Layer
from pipeline.gis.project import Group, write_project
from pipeline.gis.stac import write_item
from pipeline.hazard import geo_files
from pipeline.hazard.differences import difference_layers
from pipeline.hazard.layers import layers
from pipeline.hazard.pictures import draw
from pipeline.settings.hazard import Georeference

_log = logging.getLogger(__name__)

# names that maps have had here: only such files are ever removed
OURS = re.compile(
    r"(?:\w+_above_[\d.e+-]+(?:_emulated|_discretisation)?|\w+_quantile_[\d.e+-]+|intensity_[\d.e+-]+_years|\w*arrival_\w+"
    r"|intensity|hazard_level)"
    r"(?:_difference)?(?:_lower|_upper|_error)?\.(?:png|tif|tif\.aux\.xml|qml)|outlines\.gpkg"
)


@dataclass(frozen=True)
class Written:
    """What was written of one scenario.

    Parameters
    ----------
    paths : list[Path]
        All files.
    group : Group, optional
        What is on the map; None without a georeference.
    """

    paths: list[Path]
    group: Group | None = None


def ground(found: xr.Dataset) -> Frame | None:
    """Give the frame of hazard maps; None where they have no georeference.

    Raises
    ------
    GeoreferenceError
        If the profile differs between the runs.
    """
    if crs := found.attrs.get("crs"):
        return frame(found, MapAxes(str(crs)))
    text = found.attrs.get("georeference")
    return frame(found, Georeference.model_validate_json(text)) if text else None


def write_differences(found: xr.Dataset, folder: Path, name: str) -> list[Path]:
    """Write maps of differences to a folder that is there, as hazard maps are written.

    Parameters
    ----------
    found : Dataset
        As `pipeline.hazard.differences` gives it.
    folder : Path
        Gets the maps, and on the ground a project of QGIS and a STAC item.
    name : str
        Of the item.

    Returns
    -------
    list of Path
        What was written.

    Raises
    ------
    GeoreferenceError
        If the maps cannot be laid on the ground.
    OSError
        If something cannot be written.
    """
    written = write_maps(found, folder, difference_layers)
    return [*written.paths, *write_place([written], folder, name)]


def write_maps(
    found: xr.Dataset, folder: Path, listed: Callable[[xr.Dataset], Iterator[Layer]] = layers
) -> Written:
    """Write maps to a folder that is there; what each is called stands in `pipeline.hazard.layers`.

    Maps that were written there before and are no longer asked for are removed.

    Raises
    ------
    GeoreferenceError
        If the maps cannot be laid on the ground.
    OSError
        If something cannot be written.
    """
    placed = ground(found)
    shares = tuple(np.atleast_1d(found.attrs.get("outlines", ())).tolist())
    group = None
    if placed is not None:
        geo_files.check(placed.georeference.crs)
        group = geo_files.write(found, placed, shares, folder, listed)
    pictures = []
    for layer in listed(found):
        _log.info("%s: %s", found.attrs["title"], layer.name)
        pictures.append(draw(layer, found, placed, folder / f"{layer.name}.png"))
    written = [*pictures, *(group.paths if group else ())]
    _remove_stale(folder, written)
    return Written(written, replace(group, paths=written) if group else None)


def write_place(written: Sequence[Written], folder: Path, name: str) -> list[Path]:
    """Write a project of QGIS and a STAC item of all maps of a place; nothing without a georeference.

    Parameters
    ----------
    written : sequence of Written
        The maps, by scenario.
    folder : Path
        That they lie in, or in folders of.
    name : str
        Of the place.

    Raises
    ------
    OSError
        If one cannot be written.
    """
    groups = [each.group for each in written if each.group]
    # one project is in one reference system
    groups = [each for each in groups if each.grid.crs == groups[0].grid.crs]
    if not groups:
        return []
    # all scenarios together come first
    groups.sort(key=lambda group: group.package.parent != folder)
    made = datetime.now(UTC).replace(microsecond=0).isoformat().replace("+00:00", "Z")
    return [write_project(groups, folder), write_item(groups, folder, name, made)]


def _remove_stale(folder: Path, written: Iterable[Path]) -> None:
    """Remove maps of an earlier call that this one did not write anew."""
    names = {path.name for path in written}
    for path in folder.iterdir():
        if path.is_file() and OURS.fullmatch(path.name) and path.name not in names:
            path.unlink()
