"""The single maps among hazard results, each with its bounds, its name and what it shows."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from typing import Literal

import xarray as xr

from pipeline.assess.exceedance import BOUNDS

BANDS = {"": "estimate", "_lower": "lower bound", "_upper": "upper bound"}
Kind = Literal["share", "value", "time", "class"]


@dataclass(frozen=True, eq=False)
class Layer:
    """One map.

    name : of its files. title, units : for people. kind : what its values are. values : by bound, over y and
    x; a quantile or a time has no bounds. threshold : what is exceeded, in ``threshold_units``.
    """

    name: str
    title: str
    units: str
    kind: Kind
    values: Mapping[str, xr.DataArray]
    quantity: str = ""
    threshold: float | None = None
    threshold_units: str = ""

    @property
    def is_certain(self) -> bool:
        """Whether the bounds are the map itself."""
        return all(values.equals(self.values[""]) for values in self.values.values())


def layers(found: xr.Dataset) -> Iterator[Layer]:
    """List the maps of hazard results, on whatever grid they are."""
    for name in found.data_vars:
        quantity, _, what = str(name).rpartition("_")
        if what == "exceedance" and f"{quantity}_threshold" in found.coords:
            yield from _thresholds(found, quantity)
        elif what == "quantile":
            for values in found[name].transpose("quantile", ...):
                level = values["quantile"].item()
                title = f"{_words(quantity)} that {level:g} of the runs keep to"
                units = found[name].attrs["units"]
                plain = values.drop_vars("quantile")
                yield Layer(f"{name}_{level:g}", title, units, "value", {"": plain}, quantity)
    if "arrival_share" in found:
        yield Layer(
            "arrival_share", "share of runs that arrive", "1", "share", _bounds(found, "arrival_share")
        )
        times = found["arrival_time"]
        yield Layer("arrival_time", "mean time of arrival", times.attrs["units"], "time", {"": times})
    for name in ("intensity", "hazard_level"):
        if name in found:
            title = found[name].attrs["long_name"]
            yield Layer(name, title, "", "class", _bounds(found, name))


def _thresholds(found: xr.Dataset, quantity: str) -> Iterator[Layer]:
    """List the maps of shares above the thresholds of one quantity."""
    thresholds = found[f"{quantity}_threshold"]
    units = thresholds.attrs["units"]
    for i, threshold in enumerate(thresholds.to_numpy().tolist()):
        values = {
            bound: part.isel({thresholds.name: i}, drop=True)
            for bound, part in _bounds(found, f"{quantity}_exceedance").items()
        }
        title = f"share of runs with a {_words(quantity)} above {threshold:g} {units}"
        name = f"{quantity}_above_{threshold:g}"
        yield Layer(name, title, "1", "share", values, quantity, threshold, units)


def _bounds(found: xr.Dataset, name: str) -> dict[str, xr.DataArray]:
    return {bound: found[name + bound] for bound in BOUNDS}


def _words(quantity: str) -> str:
    words = {"pressure": "dynamic pressure"}.get(quantity, quantity.replace("_", " "))
    return f"largest {words}"
