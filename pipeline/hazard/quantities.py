"""What is mapped: the maximum that each quantity comes from, and how maps of it are called."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import xarray as xr

from pipeline.assess.frames import pressure, run_densities
from pipeline.errors import OptionError
from pipeline.scenario.scenario import stored
from pipeline.store.variables import ERODED

BOUND_NAMES = {
    "": "",
    "_lower": ", if no failed or pending run does, and overrun and cut-off ones do as they were computed",
    "_upper": ", if all failed, pending, overrun and cut-off runs do",
}
QUANTILE_NAMES = {
    "": " over the computed runs",
    "_lower": " over all runs, if what is not known is 0",
    "_upper": " over all runs, if what is not known is above all; missing where it is above all then",
}


SIGNED_NAMES = {
    "": " over the computed runs",
    "_lower": " over all runs, if what is not known is below all; missing where it is below all then",
    "_upper": " over all runs, if what is not known is above all; missing where it is above all then",
}


@dataclass(frozen=True)
class Quantity:
    """Something that is mapped: the field it comes from, and what it is called.

    Parameters
    ----------
    is_signed : bool
        Whether it may be below 0: it has no thresholds then, and a mean.
    """

    name: str
    field: str
    units: str
    long_name: str
    is_signed: bool = False


QUANTITIES = (
    Quantity("depth", "max_depth", "m", "largest depth"),
    Quantity("speed", "max_speed", "m s-1", "largest speed"),
    Quantity("momentum_flux", "max_momentum_flux", "m3 s-2", "largest momentum flux"),
    Quantity("pressure", "max_speed", "kPa", "largest dynamic pressure"),
    Quantity("erosion_depth", "erosion_depth", "m", "depth of erosion"),
    Quantity("bed_change", "bed_change", "m", "change of the ground's elevation", is_signed=True),
)
# of these quantiles are mapped where no threshold is asked for
ALWAYS = ("depth", "speed", "erosion_depth", "bed_change")


def values_of(quantity: Quantity, runs: xr.Dataset) -> xr.DataArray:
    """Give a quantity of the runs of an ensemble, over ``run`` and the points, in its units."""
    found: xr.DataArray = runs[quantity.field]
    return pressure(found.astype("f8"), run_densities(runs)) if quantity.name == "pressure" else found


def check_mapped(stores: Sequence[xr.Dataset], thresholds: Mapping[str, tuple[float, ...]]) -> None:
    """Refuse thresholds of what none of some stores has.

    Parameters
    ----------
    stores : sequence of Dataset
        Stores of scenarios.
    thresholds : mapping
        Thresholds that are asked for, by name of quantity.

    Raises
    ------
    OptionError
        If no store has the field of one of them.
    """
    for quantity in QUANTITIES:
        if thresholds.get(quantity.name) and not any(quantity.field in store for store in stores):
            lacking = dict.fromkeys(why_not(store, quantity) for store in stores)
            raise OptionError(quantity.name, f"there is no {quantity.long_name}: {'; '.join(lacking)}")


def why_not(store: xr.Dataset, quantity: Quantity) -> str:
    """Say why a store has no field of a quantity."""
    name = str(store.attrs["title"])
    if quantity.field in ERODED and stored(store.attrs).erodible_bed is None:
        return f"{name} has no erodible_bed"
    return f"output.fields of {name} leaves out {quantity.field}"
