"""Emulated maps: shares above thresholds with their errors, beside those of the runs and their bounds."""

from __future__ import annotations

from collections.abc import Sequence

import dask
import numpy as np
import xarray as xr
from numpy.typing import NDArray

from pipeline.assess.frames import on_surface
from pipeline.assess.probability import BOUNDS
from pipeline.assess.probability import exceedance as plain_exceedance
from pipeline.emulation.sampled import Sampled
from pipeline.emulation.thresholds import Threshold, with_errors
from pipeline.hazard.mapping import THREADS, without_buildings
from pipeline.hazard.quantities import BOUND_NAMES, QUANTITIES, Quantity, values_of
from pipeline.store.variables import COORDINATES, SURFACE_COORDINATES
from solver.emulator.exceedance import REST

Array = NDArray[np.float64]
EMULATED = "_emulated"
ENDINGS = {
    "_upper": "with runs that were overrun or cut off counted as exceeding it",
    "_sampling": "half width of its 95 % interval for the few runs, and for missing ones",
    "_discretisation": "half width of its allowance for the spacing; missing with one spacing",
    "_error": (
        "half width of its total error, with what runs that were overrun or cut off may add; with one "
        "spacing without that of the spacing"
    ),
}


def mapped(runs: Sampled, chosen: Sequence[Threshold]) -> xr.Dataset | None:
    """Map the thresholds that leave-one-out supports; None where there is none.

    Returns
    -------
    Dataset
        Over ``y`` and ``x`` of the finest level: ``<quantity>_emulated`` by ``<quantity>_threshold`` with
        ``_upper``, ``_sampling``, ``_discretisation`` and ``_error``, and the share of the runs
        ``<quantity>_exceedance`` with its bounds, of the coarsest level.
    """
    grid = runs.whole[-1]
    found = xr.Dataset(coords={name: c for name, c in grid.coords.items() if "run" not in c.dims})
    for name in found.coords:
        known = SURFACE_COORDINATES if on_surface(grid) else COORDINATES
        found[name].attrs = next((v.cf_attributes for v in known if v.name == name), {})
    for quantity in QUANTITIES:
        some = [
            each
            for each in chosen
            if each.quantity == quantity and not each.receptor and each.found is not None
        ]
        if some:
            found.update(_quantity(runs, quantity, some))
    return without_buildings(found) if len(found.data_vars) else None


def _quantity(runs: Sampled, quantity: Quantity, some: Sequence[Threshold]) -> xr.Dataset:
    layers: dict[str, list[Array]] = {ending: [] for ending in ("", *ENDINGS)}
    # where no run comes
    several, levels = len(runs.stores) > 1, range(len(runs.stores))
    unsettled = max(float(runs.level_weight(level) @ runs.unsettled[level]) for level in levels)
    outside = {
        "": 0.0,
        "_upper": unsettled,
        "_sampling": REST,
        "_discretisation": REST if several else np.nan,
        "_error": REST + unsettled,
    }
    for each in some:
        assert each.found is not None
        for ending, held in with_errors(each.found, unsettled=each.unsettled).items():
            layers[ending].append(_laid(runs, held, outside[ending]))
    dim = f"{quantity.name}_threshold"
    thresholds = [each.threshold for each in some]
    about = {"long_name": f"threshold of the {quantity.long_name}", "units": quantity.units}
    found = xr.Dataset(coords={dim: (dim, thresholds, about)})
    words = f"emulated share of events whose {quantity.long_name} exceeds the threshold"
    name = f"{quantity.name}{EMULATED}"
    for ending, maps in layers.items():
        said = words if not ending else f"{words}: {ENDINGS[ending]}"
        whole = np.stack(maps).astype(np.float32)
        found[name + ending] = ((dim, "y", "x"), whole, {"long_name": said, "units": "1"})
    return found.merge(_plain(runs, quantity, thresholds, dim))


def _laid(runs: Sampled, values: Array, beyond: float) -> Array:
    """Lay what is over the part that the flow comes to on the whole lattice."""
    part, whole = runs.ensembles[-1], runs.whole[-1]
    laid = np.full((whole.sizes["y"], whole.sizes["x"]), beyond)
    at = [int(np.abs(whole[axis].to_numpy() - float(part[axis][0])).argmin()) for axis in ("y", "x")]
    size = part.sizes["y"], part.sizes["x"]
    laid[at[0] : at[0] + size[0], at[1] : at[1] + size[1]] = values.reshape(size)
    return laid


def _plain(runs: Sampled, quantity: Quantity, thresholds: Sequence[float], dim: str) -> xr.Dataset:
    """Give the share of the runs of the coarsest level and its bounds, at the nearest of its points."""
    grid, coarse = runs.whole[-1], runs.whole[0]
    with dask.config.set(scheduler="threads", num_workers=THREADS):
        shares = xr.Dataset(plain_exceedance(values_of(quantity, coarse), thresholds, coarse, dim)).compute()
    near = shares.sel(x=grid["x"], y=grid["y"], method="nearest").assign_coords(x=grid["x"], y=grid["y"])
    words = f"share of runs whose {quantity.long_name} exceeds the threshold"
    spacing = f", at {runs.spacings[0]:g} m" if len(runs.stores) > 1 else ""
    return xr.Dataset(
        {
            f"{quantity.name}_exceedance{bound}": (
                (dim, "y", "x"),
                near[bound].transpose(dim, "y", "x").to_numpy().astype(np.float32),
                {"long_name": words + spacing + BOUND_NAMES[bound], "units": "1"},
            )
            for bound in BOUNDS
        }
    )
