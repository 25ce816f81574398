"""The files of hazard maps: pictures, and what other programs read where the profile is georeferenced."""

from __future__ import annotations

import logging
from pathlib import Path

import numpy as np
import xarray as xr

from pipeline.assess.georeference import Frame, MapAxes, frame
from pipeline.hazard import geo_files
from pipeline.hazard.differences import difference_layers
from pipeline.hazard.layers import layers
from pipeline.hazard.pictures import draw
from pipeline.settings.hazard import Georeference

_log = logging.getLogger(__name__)


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


def draw_differences(found: xr.Dataset, folder: Path) -> list[Path]:
    """Draw maps of differences to a folder that is there.

    Raises
    ------
    GeoreferenceError
        If the maps cannot be laid on the ground.
    OSError
        If something cannot be written.
    """
    placed = ground(found)
    return [draw(layer, found, placed, folder / f"{layer.name}.png") for layer in difference_layers(found)]


def write_maps(found: xr.Dataset, folder: Path) -> list[Path]:
    """Write hazard maps to a folder that is there; what each is called stands in `pipeline.hazard.layers`.

    Raises
    ------
    GeoreferenceError
        If the maps cannot be laid on the ground.
    OSError
        If something cannot be written.
    """
    placed = ground(found)
    shares = tuple(np.atleast_1d(found.attrs["outlines"]).tolist())
    written: list[Path] = []
    if placed is not None:
        geo_files.check(placed.georeference.crs)
        written = geo_files.write(found, placed, shares, folder)
    pictures = []
    for layer in layers(found):
        _log.info("%s: %s", found.attrs["title"], layer.name)
        pictures.append(draw(layer, found, placed, folder / f"{layer.name}.png"))
    return [*pictures, *written]
