"""What is mapped: the maximum that each quantity comes from, and how maps of it are called."""

from __future__ import annotations

from dataclasses import dataclass

import xarray as xr

from pipeline.assess.frames import pressure, run_densities

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


@dataclass(frozen=True)
class Quantity:
    """Something that is mapped: the maximum it comes from, and what it is called."""

    name: str
    field: str
    units: str
    long_name: str


QUANTITIES = (
    Quantity("depth", "max_depth", "m", "largest depth"),
    Quantity("speed", "max_speed", "m s-1", "largest speed"),
    Quantity("momentum_flux", "max_momentum_flux", "m3 s-2", "largest momentum flux"),
    Quantity("pressure", "max_speed", "kPa", "largest dynamic pressure"),
    Quantity("erosion_depth", "erosion_depth", "m", "depth of erosion"),
)
# of these quantiles are mapped where no threshold is asked for
ALWAYS = ("depth", "speed", "erosion_depth")


def values_of(quantity: Quantity, runs: xr.Dataset) -> xr.DataArray:
    """Give a quantity of the runs of an ensemble, over ``run`` and the points, in its units."""
    found: xr.DataArray = runs[quantity.field]
    return pressure(found.astype("f8"), run_densities(runs)) if quantity.name == "pressure" else found
