"""Hazard maps as NetCDF of the CF conventions."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import xarray as xr

from pipeline.inputs.reference_system import cf_attributes
from pipeline.store.folder import whole
from pipeline.store.variables import GRID_MAPPING, grid_mapping

FILE = "hazard.nc"


def read(path: Path) -> xr.Dataset:
    """Read hazard maps as they were written: whole numbers stay whole, and -1 is unknown.

    Raises
    ------
    OSError
        If there are none.
    """
    with xr.open_dataset(path, engine="netcdf4", mask_and_scale=False) as opened:
        found = opened.load()
    for values in found.variables.values():
        if "_FillValue" in values.attrs:
            values.encoding["_FillValue"] = values.attrs.pop("_FillValue")
    return found


def write(found: xr.Dataset, folder: Path, file: str = FILE) -> Path:
    """Write hazard maps as NetCDF (CF) to a folder, made where it is missing; what was there is replaced.

    Raises
    ------
    OSError
        If it cannot be written.
    """
    folder.mkdir(parents=True, exist_ok=True)
    path = folder / file
    found = _mapped(found)
    encoding: dict[str, dict[str, object]] = {
        **{str(name): {"zlib": True, "complevel": 4} for name in found.data_vars},
        **{str(name): {"_FillValue": None} for name in found.coords},
    }
    with whole(path) as aside:
        found.to_netcdf(aside, engine="netcdf4", encoding=encoding)
    return path


def _mapped(found: xr.Dataset) -> xr.Dataset:
    """Add the grid mapping of maps on an elevation model."""
    if "crs" not in found.attrs:
        return found
    mapping = grid_mapping(cf_attributes(str(found.attrs["crs"])))
    written = found.assign_coords({GRID_MAPPING: ((), np.int64(0), mapping.cf_attributes)})
    for name, values in written.data_vars.items():
        if {"x", "y"} <= {*values.dims}:
            written[name] = values.assign_attrs(grid_mapping=GRID_MAPPING)
    return written
