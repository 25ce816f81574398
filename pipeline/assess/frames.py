"""What the frames of a store come down to: extent, volume and speeds of the flow at each output time.

Dynamic pressure is density times speed squared, each run with the density of its own material.
"""

from __future__ import annotations

import json
from typing import TypeVar

import numpy as np
import xarray as xr
from numpy.typing import NDArray

from pipeline.runs.scene_of_run import DEFAULT_THRESHOLD
from pipeline.scenario.scenario import stored
from pipeline.settings.hazard import USUAL_DENSITY
from pipeline.settings.settings import MATERIAL_DENSITY

T = TypeVar("T", xr.DataArray, NDArray[np.float64], float)

# coordinate of an ensemble
DENSITY = "flow_density"
PASCALS = 1000.0
# times of a run that differ by a smaller share are one
CLOSE = 1e-9


def on_surface(store: xr.Dataset) -> bool:
    """Whether a store is of runs on an elevation model."""
    # a cloud on a profile has no other area
    if "plan_area" in store.variables:
        return True
    return "elevation" in store.variables and {"x", "y"} <= {*store["elevation"].dims}


def bed(store: xr.Dataset, run: int) -> NDArray[np.float64]:
    """Elevation of the bed of a run on an elevation model, with its earthworks, of the shape of cells, m."""
    elevation = store["elevation"]
    return np.asarray(elevation.isel(run=run) if "run" in elevation.dims else elevation, np.float64)


def cell_area(store: xr.Dataset) -> xr.DataArray:
    """Area of the cells, m2: of each point of a cloud, on the bed of a surface; one number on a lattice."""
    if "area" in store:
        return store["area"]
    spacings = (float(np.ptp(store[axis].to_numpy())) / (store.sizes[axis] - 1) for axis in ("x", "y"))
    return xr.DataArray(np.prod(list(spacings)))


def plan_area(store: xr.Dataset) -> xr.DataArray:
    """Area of the cells in plan, m2; on a slope profile their area on it."""
    if "plan_area" in store.variables:
        return store["plan_area"]
    if on_surface(store):
        return xr.DataArray(float(np.diff(store["x"]).mean()) ** 2)
    return cell_area(store)


def mean_spacing(store: xr.Dataset) -> float:
    """Root of the area per point of a cloud, m."""
    return float(np.sqrt(plan_area(store).mean()))


def space(store: xr.Dataset) -> list[str]:
    """Names of the dimensions that count points."""
    return ["point"] if "point" in store.dims else ["y", "x"]


def threshold_of(store: xr.Dataset) -> float | None:
    """Depth above which a cell of a store counts as reached or as deposit, m; None where it has no one."""
    given = json.loads(store.attrs.get("scenario_content", "{}")).get("output", {}).get("threshold")
    held = store.attrs.get("threshold", given)
    return None if held is None else float(held)


def follow(store: xr.Dataset, threshold: float | None = None) -> xr.Dataset:
    """Follow the flow through the frames of a store.

    Parameters
    ----------
    store : Dataset
        A scenario's store with its frames of depth and velocity, or a selection of its runs and times.
    threshold : float, optional
        Depth above which a cell belongs to the body of the flow, m; below it is film. By default the
        scenario's own.

    Returns
    -------
    Dataset
        Over ``run`` and ``time``: ``front_x``, ``tail_x``, ``half_width`` (half the extent across the bed) of
        the body, m, on an elevation model ``lowest_elevation``, m, and ``body_area`` in plan, m2; ``volume``,
        m3; ``volume_error``, that of the ledger, see `_volume_error`; ``deepest``, m; ``body_speed`` and
        ``film_speed``, the largest ones, m s-1. NaN where a frame was not computed.
    """
    depth, over = store["depth"], space(store)
    if threshold is None:
        threshold = threshold_of(store)
    if threshold is None:
        threshold = DEFAULT_THRESHOLD * float(depth.isel(time=0).max())
    body, known = depth > threshold, depth.notnull().any(over)
    speed = (store["velocity_x"] ** 2 + store["velocity_y"] ** 2) ** 0.5
    x, y = store["x"].where(body), store["y"].where(body)
    volume = (depth.astype(np.float64) * cell_area(store)).sum(over)
    if on_surface(store):
        plan = plan_area(store)
        extent = {
            "lowest_elevation": store["elevation"].where(body).min(over),
            "body_area": plan * body.sum(over) if plan.ndim == 0 else (plan * body).sum(over),
        }
    else:
        extent = {
            "front_x": x.max(over),
            "tail_x": x.min(over),
            "half_width": (y.max(over) - y.min(over)) / 2,
        }
    found = {
        **extent,
        "volume": volume,
        "volume_error": _volume_error(store, volume),
        "deepest": depth.max(over),
        "body_speed": speed.where(body).max(over),
        "film_speed": speed.where((depth > 0) & ~body).max(over).fillna(0),
    }
    # a varied parameter may be called as what is found here, as volume
    axes = {"run", "time"}
    return xr.Dataset(
        {
            name: values.where(known).drop_vars([c for c in values.coords if c not in axes])
            for name, values in found.items()
        }
    )


def _volume_error(store: xr.Dataset, volume: xr.DataArray) -> xr.DataArray:
    """Give the error of the volume ledger by frame, relative to what was released, came in and was entrained.

    Entrainment is kept by frame, inflow and outflow by run alone. Of a run that has one of these the error is
    known at its release and from its last state on, and NaN between.
    """
    first = volume.isel(time=0, drop=True)
    entrained = store["entrained"] if "entrained" in store.variables else xr.zeros_like(volume)
    gained, lost = store["volume_in"], store["volume_out"]
    ended = store["time"] >= store["last_time"] * (1 - CLOSE)
    expected = first + entrained + (gained - lost).where(ended, 0.0)
    total = first + entrained + gained
    known = ended | (store["time"] == 0) | ((gained == 0) & (lost == 0))
    return ((volume - expected) / total.where(total > 0)).where(known)


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


def run_densities(runs: xr.Dataset) -> xr.DataArray:
    """Give the density of each run of an ensemble, over ``run``, kg m-3."""
    found: xr.DataArray = runs[DENSITY]
    return found.drop_vars(list(found.coords))


def told_density(density: NDArray[np.float64]) -> str | float:
    """Give a density that all runs have as a number, several as ``1600 to 2100``."""
    low, high = float(density.min()), float(density.max())
    return low if low == high else f"{low:g} to {high:g}"
