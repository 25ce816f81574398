"""The single maps among hazard results, each with its bounds, its name and what it shows."""

from __future__ import annotations

from collections.abc import Iterator, Sequence

import xarray as xr

from pipeline.assess.probability import BOUNDS
from pipeline.gis.layer import ERROR, Kind, Layer
from pipeline.gis.symbology import CHANGES
from pipeline.hazard.discretisation import ENDING
from pipeline.readable import written

EARLIEST = "earliest_arrival_time"


def layers(found: xr.Dataset) -> Iterator[Layer]:
    """List the maps of hazard results, on whatever grid they are."""
    for name in found.data_vars:
        quantity, _, what = str(name).rpartition("_")
        if str(name).endswith(f"_exceedance{ENDING}"):
            yield from _discretisation(found, str(name))
        if what in ("exceedance", "emulated") and f"{quantity}_threshold" in found.coords:
            yield from _thresholds(found, quantity, what)
        elif what == "quantile":
            for i, level in enumerate(found["quantile"].to_numpy().tolist()):
                title = f"{_words(quantity)} that {level:g} of the {_counted(found)} keep to"
                units = found[name].attrs["units"]
                kind: Kind = "difference" if quantity in CHANGES else "value"
                values = {
                    bound: part.isel(quantile=i, drop=True)
                    for bound, part in _bounds(found, str(name)).items()
                }
                yield Layer(f"{name}_{level:g}", title, units, kind, values, quantity)
        elif what == "mean" and quantity in CHANGES:
            title, units = f"mean {_words(quantity)}", found[name].attrs["units"]
            yield Layer(str(name), title, units, "difference", {"": found[name]}, quantity)
    if "arrival_share" in found:
        title = f"share of {_counted(found)} that arrive"
        yield Layer("arrival_share", title, "1", "share", _bounds(found, "arrival_share"))
        if "arrival_rate" in found:
            title = "events a year that arrive"
            yield Layer("arrival_rate", title, "year-1", "rate", _bounds(found, "arrival_rate"))
        yield from _times(found)
    for name in ("intensity", "hazard_level"):
        if name in found:
            title = found[name].attrs["long_name"]
            yield Layer(name, title, "", "class", _bounds(found, name), name)
    if "period_intensity" in found:
        yield from _periods(found)


def _periods(found: xr.Dataset) -> Iterator[Layer]:
    """List the maps of intensity of each return period."""
    first, last = (found[name].to_numpy() for name in ("shortest_return_period", "return_period"))
    for i, (shortest, longest) in enumerate(zip(first, last, strict=True)):
        values = {
            bound: part.isel(return_period=i, drop=True)
            for bound, part in _bounds(found, "period_intensity").items()
        }
        span = f"{longest:g}" if shortest == longest else f"{shortest:g} to {longest:g}"
        title = f"class of intensity of events of a return period of {span} years"
        yield Layer(f"intensity_{longest:g}_years", title, "", "class", values, "intensity")


def _times(found: xr.Dataset) -> Iterator[Layer]:
    """List the maps of times of arrival, with one legend for all."""
    titles = {"arrival_time": "mean time of arrival", EARLIEST: "earliest arrival of any run"}
    largest = float(found["arrival_time"].fillna(0).max())
    for name, title in titles.items():
        if name in found:
            units = found[name].attrs["units"]
            yield Layer(name, title, units, "time", {"": found[name]}, largest=largest)


def _thresholds(found: xr.Dataset, quantity: str, what: str) -> Iterator[Layer]:
    """List the maps of shares above the thresholds of one quantity, of the runs or emulated ones."""
    emulated = what == "emulated"
    endings = ("", ERROR) if emulated else BOUNDS
    thresholds = found[f"{quantity}_threshold"]
    units = thresholds.attrs["units"]
    for i, threshold in enumerate(thresholds.to_numpy().tolist()):
        values = {
            bound: part.isel({thresholds.name: i}, drop=True)
            for bound, part in _bounds(found, f"{quantity}_{what}", endings).items()
        }
        counted = "emulated share of events" if emulated else f"share of {_counted(found)}"
        title = f"{counted} with a {_words(quantity)} above {threshold:g} {written(units)}"
        name = f"{quantity}_above_{threshold:g}{'_emulated' if emulated else ''}"
        yield Layer(name, title, "1", "share", values, quantity, threshold, units)


def _discretisation(found: xr.Dataset, name: str) -> Iterator[Layer]:
    """List the maps of what the spacing leaves open of shares above the thresholds of one quantity."""
    quantity = name.removesuffix(f"_exceedance{ENDING}")
    thresholds = found[f"{quantity}_threshold"]
    units = thresholds.attrs["units"]
    for i, threshold in enumerate(thresholds.to_numpy().tolist()):
        above = f"a {_words(quantity)} above {threshold:g} {written(units)}"
        title = f"share of runs that have {above} on one spacing alone"
        values = {"": found[name].isel({thresholds.name: i}, drop=True)}
        layer = f"{quantity}_above_{threshold:g}{ENDING}"
        yield Layer(layer, title, "1", "share", values, quantity, threshold, units)


def _counted(found: xr.Dataset) -> str:
    """Name what shares are of: return periods weigh runs by the events that they stand for."""
    return "events" if "events_per_year" in found.attrs else "runs"


def _bounds(found: xr.Dataset, name: str, endings: Sequence[str] = BOUNDS) -> dict[str, xr.DataArray]:
    return {bound: found[name + bound] for bound in endings}


def _words(quantity: str) -> str:
    words = {"pressure": "largest dynamic pressure", "erosion_depth": "depth of erosion", **CHANGES}
    return words.get(quantity, f"largest {quantity.replace('_', ' ')}")
