"""What the spacing leaves open of maps of shares and quantiles: how runs change to the closest spacing."""

from __future__ import annotations

import numpy as np
import xarray as xr
from numpy.typing import NDArray

from pipeline.assess.ensemble import weights
from pipeline.assess.spacing import paired
from pipeline.hazard.quantities import QUANTITIES, Quantity, values_of
from pipeline.settings.hazard import Hazard
from solver.emulator.latent import interpolated

ENDING = "_discretisation"
# what the attribute of maps says
ONE_SPACING = "one spacing: not estimated"
TOGETHER = "of all scenarios together: not estimated"


def told_of(widest: float, closest: float, runs: int) -> str:
    """Say what the error of the spacing is from: spacings, m, and the number of runs on both."""
    return f"from {widest:g} to {closest:g} m, by {runs} runs on both"


def with_discretisation(
    found: xr.Dataset, coarse: xr.Dataset, fine: xr.Dataset, asked: Hazard, entries: int
) -> xr.Dataset:
    """Add to maps what changes from the widest spacing to the closest, by runs that are computed on both.

    Parameters
    ----------
    found : Dataset
        Hazard maps over the points of the widest spacing.
    coarse, fine : Dataset
        Ensembles of both spacings.
    asked : Hazard
        Thresholds of the maps.
    entries : int
        Of the sweep.

    Returns
    -------
    Dataset
        With ``<quantity>_exceedance_discretisation`` by threshold, the share of these runs, by their weights,
        that are above it on one spacing alone, and ``<quantity>_quantile_discretisation``, the root mean
        square change of a run. The attribute ``discretisation`` says from how many runs.
    """
    before, after = paired(coarse, fine, entries)
    weight = weights(coarse)[before]
    steps = [float(np.diff(np.sort(each["x"].to_numpy())).mean()) for each in (coarse, fine)]
    told = told_of(steps[0], steps[1], len(before))
    if not weight.sum() > 0:
        return found.assign_attrs({ENDING[1:]: "not estimated: no run is computed on both spacings"})
    for quantity in QUANTITIES:
        share, quantile = (f"{quantity.name}_{what}" for what in ("exceedance", "quantile"))
        if quantity.field not in coarse or quantity.field not in fine or quantile not in found:
            continue
        limits = () if share not in found else getattr(asked, quantity.name)
        flips, squares = np.zeros((len(limits), *found[quantile].shape[-2:])), 0.0
        for part, one, other in zip(weight / weight.sum(), before, after, strict=True):
            first, second = _on_points(quantity, coarse, fine, int(one), int(other))
            squares = squares + part * (second - first) ** 2
            for i, limit in enumerate(limits):
                flips[i] += part * ((first > limit) != (second > limit))
        named = {"long_name": f"root mean square change of the {quantity.long_name} of a run {told}"}
        units = {"units": quantity.units}
        found[quantile + ENDING] = (("y", "x"), np.sqrt(squares).astype(np.float32), named | units)
        if limits:
            words = (
                f"share of runs whose {quantity.long_name} exceeds the threshold on one spacing alone, {told}"
            )
            dims = (f"{quantity.name}_threshold", "y", "x")
            found[share + ENDING] = (dims, flips.astype(np.float32), {"long_name": words, "units": "1"})
    return found.assign_attrs({ENDING[1:]: told})


def _on_points(
    quantity: Quantity, coarse: xr.Dataset, fine: xr.Dataset, one: int, other: int
) -> tuple[NDArray[np.floating], NDArray[np.floating]]:
    """Give a quantity of a run on both spacings at the points of the wider, shape (ny, nx) each."""
    first, second = (
        values_of(quantity, runs.isel(run=[row])).isel(run=0).transpose("y", "x").to_numpy()
        for runs, row in ((coarse, one), (fine, other))
    )
    axes, to = ((runs["y"].to_numpy(), runs["x"].to_numpy()) for runs in (fine, coarse))
    return first, interpolated(second[None], axes, to)[0]
