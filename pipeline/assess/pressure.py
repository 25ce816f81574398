"""Dynamic pressure: density times speed squared, each run with the density of its own material."""

from __future__ import annotations

from typing import TypeVar

import numpy as np
import xarray as xr
from numpy.typing import NDArray

from pipeline.scenario.scenario import stored
from pipeline.settings.hazard import USUAL_DENSITY
from pipeline.settings.settings import MATERIAL_DENSITY

T = TypeVar("T", xr.DataArray, NDArray[np.float64], float)

# coordinate of an ensemble
DENSITY = "flow_density"
PASCALS = 1000.0


def pressure(speed: T, density: T | float) -> T:
    """Give the dynamic pressure, kPa, of a speed (m s-1) and a density (kg m-3)."""
    return density * speed**2 / PASCALS


def speed_of(threshold: float, density: float) -> float:
    """Give the speed, m s-1, at which a pressure (kPa) is reached."""
    return float(np.sqrt(threshold * PASCALS / density))


def densities(store: xr.Dataset) -> NDArray[np.float64]:
    """Give the density of the flow in each run of a store, shape (runs,), kg m-3.

    It is `hazard.density` where that is written, else that of the material, which may differ between runs.
    """
    if "scenario" not in store.attrs:
        return np.full(store.sizes["run"], USUAL_DENSITY)
    known = stored(store.attrs)
    if known.hazard.density is not None:
        return np.full(store.sizes["run"], known.hazard.density)
    varied = (c.to_numpy() for c in store.coords.values() if c.attrs.get("key") == MATERIAL_DENSITY)
    given = next(varied, known.density)
    return np.full(store.sizes["run"], given, np.float64)


def of_runs(runs: xr.Dataset) -> xr.DataArray:
    """Give the density of each run of an ensemble, over ``run``, kg m-3."""
    found: xr.DataArray = runs[DENSITY]
    return found.drop_vars(list(found.coords))


def told(density: NDArray[np.float64]) -> str | float:
    """Give a density that all runs have as a number, several as ``1600 to 2100``."""
    low, high = float(density.min()), float(density.max())
    return low if low == high else f"{low:g} to {high:g}"
