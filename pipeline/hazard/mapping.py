"""Hazard of an ensemble: shares that exceed thresholds, quantiles, arrival, intensity and level."""

from __future__ import annotations

from collections.abc import Sequence

import dask
import numpy as np
import xarray as xr

from pipeline.assess.ensemble import (
    Counts,
    counts,
    events_per_year,
)
from pipeline.assess.frames import on_surface, run_densities, told_density
from pipeline.assess.probability import (
    BOUNDS,
    Bounds,
    earliest_arrival,
    exceedance,
    mean_arrival,
    mean_of,
    quantiles,
    share,
)
from pipeline.hazard import intensity
from pipeline.hazard.layers import EARLIEST
from pipeline.hazard.quantities import (
    ALWAYS,
    BOUND_NAMES,
    QUANTILE_NAMES,
    QUANTITIES,
    SIGNED_NAMES,
    Quantity,
    values_of,
)
from pipeline.settings.hazard import Hazard
from pipeline.store.variables import (
    BUILDING,
    COORDINATES,
    RETURN_PERIOD,
    SURFACE_COORDINATES,
)

SHORTEST = "shortest_return_period"
# each holds a chunk of runs
THREADS = 2


def map_hazard(runs: xr.Dataset, settings: Hazard) -> xr.Dataset:
    """Map the hazard of an ensemble.

    Parameters
    ----------
    runs : Dataset
        As `pipeline.assess.ensemble` gives it.
    settings : Hazard
        Thresholds, quantiles and matrices.

    Returns
    -------
    Dataset
        Loaded, over ``y`` and ``x``: ``<quantity>_exceedance`` by ``<quantity>_threshold``,
        ``<quantity>_quantile`` by ``quantile``, ``bed_change_mean``, ``arrival_share``, ``arrival_time``,
        ``earliest_arrival_time``, ``intensity_exceedance`` by ``intensity_class``, ``intensity``, and with
        return periods ``hazard_level``. Bounds, classes and levels come with ``_lower`` and ``_upper``. What
        needs a maximum that was not kept is not there.
    """
    found = xr.Dataset(coords={name: c for name, c in runs.coords.items() if "run" not in c.dims})
    for name in found.coords:
        known = (*(SURFACE_COORDINATES if on_surface(runs) else COORDINATES), BUILDING)
        found[name].attrs = next((v.cf_attributes for v in known if v.name == name), {})
    with dask.config.set(scheduler="threads", num_workers=THREADS):
        for quantity in QUANTITIES:
            if quantity.field in runs:
                found.update(_quantity(quantity, runs, settings))
        if "arrival_time" in runs:
            found.update(_arrival(runs))
        if {"max_depth", "max_speed"} <= set(runs):
            found.update(_classes(runs, settings))
    frequency = events_per_year(runs)
    if frequency is not None:
        found.update(_rates(found, frequency))
        # return periods weigh runs by the events that they stand for
        for variable in (*found.data_vars.values(), *found.coords.values()):
            if words := variable.attrs.get("long_name"):
                variable.attrs["long_name"] = str(words).replace("share of runs", "share of events", 1)
    found = without_buildings(found)
    density = told_density(run_densities(runs).to_numpy())
    return found.assign_attrs(density=density, **_attributes(counts(runs), settings, frequency))


def nowhere(found: xr.Dataset) -> list[str]:
    """Say which thresholds no computed run exceeds at any place, a line a quantity."""
    lines = []
    for quantity in QUANTITIES:
        name, dim = f"{quantity.name}_exceedance", f"{quantity.name}_threshold"
        if name not in found:
            continue
        largest = found[name].max([each for each in found[name].dims if each != dim])
        empty = found[dim].to_numpy()[largest.to_numpy() == 0]
        if empty.size:
            above = ", ".join(f"{threshold:g}" for threshold in empty)
            lines.append(
                f"no computed run has a {quantity.long_name} above {above} {quantity.units} anywhere"
            )
    return lines


def without_buildings(found: xr.Dataset) -> xr.Dataset:
    """Leave out the cells of buildings, of which no flow says what reaches them."""
    if "building" not in found.coords:
        return found
    stands = found["building"] == 1
    for name, values in found.data_vars.items():
        if {"y", "x"} <= {*values.dims}:
            unknown = intensity.UNKNOWN if np.issubdtype(values.dtype, np.integer) else np.nan
            kept = values.where(~stands, values.dtype.type(unknown)).transpose(*values.dims)
            kept.attrs, kept.encoding = values.attrs, values.encoding
            found[name] = kept
    return found


def _quantity(quantity: Quantity, runs: xr.Dataset, settings: Hazard) -> xr.Dataset:
    """Map one quantity by its thresholds and quantiles."""
    dim = f"{quantity.name}_threshold"
    thresholds = np.asarray([] if quantity.is_signed else getattr(settings, quantity.name), np.float64)
    found, field = xr.Dataset(), values_of(quantity, runs)
    if thresholds.size:
        found = _shares(
            f"{quantity.name}_exceedance",
            exceedance(field, thresholds.tolist(), runs, dim),
            f"share of runs whose {quantity.long_name} exceeds the threshold",
        )
        about = {"long_name": f"threshold of the {quantity.long_name}", "units": quantity.units}
        found = found.assign_coords({dim: (dim, thresholds, about)})
    if thresholds.size or quantity.name in ALWAYS:
        names = SIGNED_NAMES if quantity.is_signed else QUANTILE_NAMES
        least = -np.inf if quantity.is_signed else 0.0
        for bound, values in quantiles(field, settings.quantiles, runs, least).items():
            name = f"quantile of the {quantity.long_name}{names[bound]}"
            about = {"long_name": name, "units": quantity.units}
            found[f"{quantity.name}_quantile{bound}"] = values.astype(np.float32).assign_attrs(about)
        found["quantile"].attrs = {"long_name": "share of runs that keep to the value", "units": "1"}
    if quantity.is_signed:
        mean = mean_of(field, runs).astype(np.float32).compute()
        mean.attrs = {
            "long_name": f"mean {quantity.long_name} over the computed runs",
            "units": quantity.units,
        }
        found[f"{quantity.name}_mean"] = mean
    return found


def _arrival(runs: xr.Dataset) -> xr.Dataset:
    """Map which share of runs arrives, when on average, and when first."""
    arrives = share(runs["arrival_time"].notnull(), runs)
    found = _shares("arrival_share", arrives, "share of runs whose flow arrives")
    mean = mean_arrival(runs["arrival_time"], runs).astype(np.float32).compute()
    about = {"long_name": "mean time of arrival over the computed runs whose flow arrives", "units": "s"}
    mean.attrs = about
    first = earliest_arrival(runs["arrival_time"], runs).astype(np.float32).compute()
    first.attrs = {"long_name": "earliest time of arrival of any computed run", "units": "s"}
    return found.assign({"arrival_time": mean, EARLIEST: first})


def _classes(runs: xr.Dataset, settings: Hazard) -> xr.Dataset:
    """Map classes of intensity, and levels of hazard where runs have return periods."""
    dim = "intensity_class"
    found = _shares(
        "intensity_exceedance",
        intensity.shares(runs, settings),
        "share of runs whose intensity is of the class or above",
    )
    found = found.assign_coords(
        {dim: (dim, np.arange(1, 4, dtype=np.int8), _flags(intensity.CLASSES[1:], 1))}
    )
    shares = {bound: found[f"intensity_exceedance{bound}"].drop_vars(dim) for bound in BOUNDS}
    mapped: dict[str, tuple[Bounds, Sequence[str], str]] = {}
    mapped["intensity"] = (intensity.usual(shares, settings.share), intensity.CLASSES, "class of intensity")
    of_periods = intensity.by_period(runs, settings)
    if of_periods:
        mapped["hazard_level"] = (
            intensity.levels(of_periods, settings.levels),
            intensity.LEVELS,
            "level of hazard",
        )
        along: Bounds = {
            bound: xr.concat([each.classes[bound] for each in of_periods], RETURN_PERIOD.name)
            for bound in BOUNDS
        }
        mapped["period_intensity"] = (along, intensity.CLASSES, "class of intensity of events of the period")
        for name, end in ((RETURN_PERIOD.name, "longest"), (SHORTEST, "shortest")):
            years = [getattr(each, end) for each in of_periods]
            said = {"long_name": f"{end} return period of the events", "units": "year"}
            found = found.assign_coords({name: (RETURN_PERIOD.name, years, said)})
    for name, (values, words, long_name) in mapped.items():
        for bound in BOUNDS:
            about = {"long_name": long_name + BOUND_NAMES[bound], **_flags(words, 0)}
            found[name + bound] = values[bound].compute()
            found[name + bound].attrs = about
            found[name + bound].encoding["_FillValue"] = np.int8(intensity.UNKNOWN)
    return found


def _rates(found: xr.Dataset, frequency: float) -> xr.Dataset:
    """Give the events a year of every share."""
    rates = {}
    for name, shares in found.data_vars.items():
        base, bound = next(
            (str(name).removesuffix(bound), bound) for bound in reversed(BOUNDS) if str(name).endswith(bound)
        )
        if not base.endswith(("_exceedance", "_share")):
            continue
        rate = (shares.astype(np.float64) * frequency).astype(np.float32)
        words = str(shares.attrs["long_name"]).replace("share of runs", "events a year", 1)
        rates[f"{base.removesuffix('_share')}_rate{bound}"] = rate.assign_attrs(
            long_name=words, units="year-1"
        )
    return xr.Dataset(rates)


def _flags(words: Sequence[str], first: int) -> dict[str, object]:
    values = np.arange(first, first + len(words), dtype=np.int8)
    return {"flag_values": values, "flag_meanings": " ".join(words)}


def _shares(name: str, shares: Bounds, long_name: str) -> xr.Dataset:
    """Compute a share and its bounds in one go."""
    found = xr.Dataset(
        {name + bound: values.astype(np.float32) for bound, values in shares.items()}
    ).compute()
    for bound in BOUNDS:
        found[name + bound].attrs = {"long_name": long_name + BOUND_NAMES[bound], "units": "1"}
    return found


def _attributes(count: Counts, settings: Hazard, frequency: float | None) -> dict[str, object]:
    return {
        **({} if frequency is None else {"events_per_year": frequency}),
        "Conventions": "CF-1.12",
        "comment": str(count),
        **count.attributes,
        "intensity_source": settings.intensity.source,
        "level_source": settings.levels.source,
        "intensity_share": settings.share,
        "outlines": list(settings.outlines),
    }
