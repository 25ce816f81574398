"""A single map with its bounds, its name, what it shows and how it looks."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from functools import cached_property
from typing import Literal

import numpy as np
import xarray as xr

from pipeline.gis import symbology
from pipeline.gis.symbology import Style

# by the ending of a variable, and by that of a file
ERROR = "_error"
BANDS = {"": "estimate", "_lower": "lower bound", "_upper": "upper bound", ERROR: "half width of the error"}
# of shares that are coloured
LEAST_SHOWN = 0.01
Kind = Literal["share", "rate", "value", "time", "class", "difference"]


@dataclass(frozen=True, eq=False)
class Layer:
    """One map.

    Parameters
    ----------
    name : str
        Of its files.
    title, units : str
        For people.
    kind : Kind
        What its values are.
    values : mapping of str to xr.DataArray
        By bound, over y and x; a time has no bounds, an emulated share has its error in their place.
    quantity : str
        What is mapped, by which `pipeline.gis.symbology` knows its classes.
    threshold : float, optional
        What is exceeded, in ``threshold_units``.
    largest : float, optional
        Value up to which the legend goes, where it is one with that of another map.
    """

    name: str
    title: str
    units: str
    kind: Kind
    values: Mapping[str, xr.DataArray]
    quantity: str = ""
    threshold: float | None = None
    threshold_units: str = ""
    largest: float | None = None

    @property
    def is_of_time(self) -> bool:
        """Whether it is missing where nothing arrives, which is known."""
        return "time" in (self.kind, self.quantity)

    @property
    def in_doubt(self) -> xr.DataArray | None:
        """Where the error exceeds the number; None without an error."""
        if ERROR not in self.values:
            return None
        doubt: xr.DataArray = (self.values[ERROR] > self.values[""]) & (self.values[""] > LEAST_SHOWN)
        return doubt

    @property
    def is_certain(self) -> bool:
        """Whether the bounds are the map itself."""
        return all(values.equals(self.values[""]) for values in self.values.values())

    @cached_property
    def style(self) -> Style:
        """How it looks: the same in every file of it."""
        if self.kind == "class":
            return symbology.of_classes(self.quantity, self.title)
        name = self.quantity if self.kind == "value" else self.kind
        known = np.concatenate([values.to_numpy().ravel() for values in self.values.values()])
        known = known[np.isfinite(known)]
        low, high = (float(known.min()), float(known.max())) if known.size else (0.0, 0.0)
        if self.kind == "difference":
            return symbology.of_differences(self.quantity, self.units, max(high, -low))
        return symbology.of_values(name, self.units, self.largest or high, low)
