"""Hazard of the runs of a place: shares that exceed thresholds, quantiles, arrival, intensity and level."""

from __future__ import annotations

import json
import logging
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import dask
import numpy as np
import xarray as xr

from pipeline.assess.ensemble import (
    Counts,
    NotTogetherError,
    counts,
    ensemble,
    events_per_year,
    together,
)
from pipeline.assess.frames import on_surface
from pipeline.assess.probability import (
    BOUNDS,
    Bounds,
    earliest_arrival,
    exceedance,
    mean_arrival,
    quantiles,
    share,
)
from pipeline.hazard import intensity
from pipeline.hazard.layers import EARLIEST
from pipeline.hazard.release_outlines import release_outlines
from pipeline.inputs.reference_system import cf_attributes
from pipeline.runs import profile_ends, surface_summary
from pipeline.scenario.scenario import stored
from pipeline.settings.hazard import Hazard
from pipeline.settings.settings import Settings
from pipeline.store import zarr_store
from pipeline.store.folder import whole
from pipeline.store.place import store_paths
from pipeline.store.storage import Location
from pipeline.store.variables import (
    BUILDING,
    COORDINATES,
    GRID_MAPPING,
    RETURN_PERIOD,
    SURFACE_COORDINATES,
    grid_mapping,
)
from pipeline.store.zarr_store import open_store

_log = logging.getLogger(__name__)

FILE = "hazard.nc"
SHORTEST = "shortest_return_period"
WHOLE = "all scenarios"
# of what maps say, where they lie
LAID = ("georeference", "crs")
# each holds a chunk of runs
THREADS = 2
PASCALS = 1000.0
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
        ``<quantity>_quantile`` by ``quantile``, ``arrival_share``, ``arrival_time``,
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
    found = _without_buildings(found)
    return found.assign_attrs(_attributes(counts(runs), settings, frequency))


def _without_buildings(found: xr.Dataset) -> xr.Dataset:
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
    thresholds = np.asarray(getattr(settings, quantity.name), np.float64)
    pressure = quantity.name == "pressure"
    found = xr.Dataset()
    if thresholds.size:
        # the speed at which the pressure is reached
        limits = np.sqrt(thresholds * PASCALS / settings.density) if pressure else thresholds
        found = _shares(
            f"{quantity.name}_exceedance",
            exceedance(runs[quantity.field], limits.tolist(), runs, dim),
            f"share of runs whose {quantity.long_name} exceeds the threshold",
        )
        about = {"long_name": f"threshold of the {quantity.long_name}", "units": quantity.units}
        found = found.assign_coords({dim: (dim, thresholds, about)})
    if thresholds.size or quantity.name in ALWAYS:
        for bound, values in quantiles(runs[quantity.field], settings.quantiles, runs).items():
            values = values**2 * settings.density / PASCALS if pressure else values
            name = f"quantile of the {quantity.long_name}{QUANTILE_NAMES[bound]}"
            about = {"long_name": name, "units": quantity.units}
            found[f"{quantity.name}_quantile{bound}"] = values.astype(np.float32).assign_attrs(about)
        found["quantile"].attrs = {"long_name": "share of runs that keep to the value", "units": "1"}
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
        "density": settings.density,
        "intensity_source": settings.intensity.source,
        "level_source": settings.levels.source,
        "intensity_share": settings.share,
        "outlines": list(settings.outlines),
    }


def of_place(
    out: Location, thresholds: Mapping[str, tuple[float, ...]], spacing: float | None = None
) -> Iterator[tuple[str, xr.Dataset]]:
    """Map the hazard of each scenario of a place, then of all together under the name `WHOLE`.

    Parameters
    ----------
    out : Location
        The place.
    thresholds : mapping
        Thresholds by name of quantity, in place of those of the scenarios.
    spacing : float, optional
        Of the lattice clouds are brought to, m.

    Raises
    ------
    FileNotFoundError
        If the place holds no store.
    NotTogetherError
        After the single scenarios, if they cannot be laid over each other.
    ValueError
        If a store's scenario is not known here.
    """
    held: dict[str, xr.Dataset] = {}
    asked: dict[str, Hazard] = {}
    said: dict[str, dict[str, str]] = {}
    releases: dict[str, list[Any]] = {}
    warnings: list[object] = []
    left_out = 0
    for path in store_paths(out):
        store = open_store(path)
        name = str(store.attrs["title"])
        settings = stored(store.attrs)
        asked[name] = settings.hazard.model_copy(update=dict(thresholds))
        said[name] = about(store, settings)
        held[name] = ensemble(store, spacing)
        warned = store["warning"].to_numpy().tolist()
        warnings += warned
        releases[name] = release_outlines(store, spacing)
        _log.info("maps of %s", name)
        found = map_hazard(held[name], asked[name])
        left_out += (chosen := zarr_store.chosen(path))
        found.attrs["comment"] += _note(warned) + _level(settings) + _left_out(chosen)
        said[name]["releases"] = json.dumps(releases[name])
        yield name, found.assign_attrs(title=name, **said[name])
    if len(held) > 1:
        runs = together(held)
        first, *others = asked
        for other in others:
            if asked[other] != asked[first]:
                raise NotTogetherError(f"{first} and {other} differ in what is asked for under hazard")
            if any(said[other].get(key) != said[first].get(key) for key in LAID):
                raise NotTogetherError(f"{first} and {other} differ in their georeference")
        found = map_hazard(runs, asked[first])
        found.attrs["comment"] += _note(warnings) + _left_out(left_out)
        where = {key: said[first][key] for key in LAID if key in said[first]}
        where["releases"] = json.dumps([ring for rings in releases.values() for ring in rings])
        # receptors of one scenario need not be those of another
        alike = len({each["receptors"] for each in said.values()}) == 1
        marks = said[first]["receptors"] if alike else "[]"
        yield WHOLE, found.assign_attrs(title=WHOLE, receptors=marks, scenarios=", ".join(held), **where)


def read(path: Path) -> xr.Dataset:
    """Read hazard maps as they were written: whole numbers stay whole, and -1 is unknown.

    Raises
    ------
    OSError
        If there are none.
    """
    with xr.open_dataset(path, engine="netcdf4", mask_and_scale=False) as opened:
        found = opened.load()
    for values in found.variables.values():
        if "_FillValue" in values.attrs:
            values.encoding["_FillValue"] = values.attrs.pop("_FillValue")
    return found


def _note(warnings: Sequence[object]) -> str:
    """Say in how many runs the flow came where the ground is not known or not shown, by their warnings."""
    return profile_ends.note(profile_ends.count(warnings)) + surface_summary.note(warnings)


def _level(settings: Settings) -> str:
    """Say on which spacing the runs of maps are, where a scenario has several."""
    levels = () if settings.sample is None else settings.sample.levels
    if not levels:
        return ""
    finer = ", ".join(f"{level.count} at {level.spacing:g} m" for level in levels[1:])
    return f", at {levels[0].spacing:g} m; those of {finer} count in emulated maps"


def _left_out(chosen: int) -> str:
    """Say how many runs were chosen beside the sample, which are no part of it."""
    return f"; {chosen} chosen runs left out" if chosen else ""


def about(store: xr.Dataset, settings: Settings) -> dict[str, str]:
    """Give what maps of a store say of the scenario and of where it lies."""
    ground = settings.georeference
    # what receptors and releases are given in says nothing of where the profile lies
    where = {"receptors", "releases"}
    return {
        **{key: str(store.attrs[key]) for key in ("scenario_hash", "solver_hash", "lmls_version")},
        "georeference": "" if ground is None else ground.model_dump_json(exclude=where),
        "receptors": json.dumps([receptor.model_dump(mode="json") for receptor in settings.places]),
        **({"crs": str(store.attrs["crs"])} if "crs" in store.attrs else {}),
    }


def write(found: xr.Dataset, folder: Path, file: str = FILE) -> Path:
    """Write hazard maps as NetCDF (CF) to a folder, made where it is missing; what was there is replaced.

    Raises
    ------
    OSError
        If it cannot be written.
    """
    folder.mkdir(parents=True, exist_ok=True)
    path = folder / file
    found = _mapped(found)
    encoding: dict[str, dict[str, object]] = {
        **{str(name): {"zlib": True, "complevel": 4} for name in found.data_vars},
        **{str(name): {"_FillValue": None} for name in found.coords},
    }
    with whole(path) as aside:
        found.to_netcdf(aside, engine="netcdf4", encoding=encoding)
    return path


def _mapped(found: xr.Dataset) -> xr.Dataset:
    """Add the grid mapping of maps on an elevation model."""
    if "crs" not in found.attrs:
        return found
    mapping = grid_mapping(cf_attributes(str(found.attrs["crs"])))
    written = found.assign_coords({GRID_MAPPING: ((), np.int64(0), mapping.cf_attributes)})
    for name, values in written.data_vars.items():
        if {"x", "y"} <= {*values.dims}:
            written[name] = values.assign_attrs(grid_mapping=GRID_MAPPING)
    return written
