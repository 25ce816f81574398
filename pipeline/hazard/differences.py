"""Two scenarios beside each other: maps of how shares, depths and pressures differ, with their bounds."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from pathlib import Path
from typing import NamedTuple

import numpy as np
import pandas as pd
import xarray as xr

from pipeline.assess.ensemble import NotTogetherError, ensemble
from pipeline.assess.frames import threshold_of
from pipeline.assess.probability import BOUNDS
from pipeline.assess.receptor_differences import receptor_differences
from pipeline.assess.sections import section_differences, shared_sections
from pipeline.gis.layer import Layer
from pipeline.hazard.layers import layers
from pipeline.hazard.mapping import map_hazard
from pipeline.hazard.quantities import QUANTITIES, check_mapped, why_not
from pipeline.scenario.scenario import stored
from pipeline.store import run_table
from pipeline.store.place import store_path
from pipeline.store.storage import Location
from pipeline.store.zarr_store import open_store

FILE, TABLE, SECTIONS = "differences.nc", "receptor-differences.csv", "section-differences.csv"
ENDING = "_difference"
# layers whose values can be taken from each other
WORDS = {"share": "share", "rate": "events a year", "time": "time"}
KINDS = (*WORDS, "value", "difference")


class Compared(NamedTuple):
    """How a second scenario differs from a first one.

    Attributes
    ----------
    maps
        Over ``y`` and ``x``, for each map of shares, quantiles and means of `pipeline.hazard.mapping` the
        second less the first under its name and ``_difference``, with ``_lower`` and ``_upper``.
    receptors
        The table of `pipeline.assess.receptor_differences`.
    sections
        That of `pipeline.assess.sections`.
    """

    maps: xr.Dataset
    receptors: pd.DataFrame
    sections: pd.DataFrame


def compare(
    places: tuple[Location, Location],
    names: tuple[str, str],
    thresholds: Mapping[str, tuple[float, ...]],
    spacing: float | None = None,
) -> Compared:
    """Map and table how a second scenario differs from a first one.

    Parameters
    ----------
    places : tuple of Location
        Of the first and of the second scenario.
    names : tuple of str
        Of the scenarios.
    thresholds : mapping
        Thresholds by name of quantity, in place of those of the scenarios.
    spacing : float, optional
        Of the lattice clouds are brought to, m.

    Raises
    ------
    FileNotFoundError
        If there is no such scenario.
    OptionError
        If thresholds are given of what one of them has not.
    NotTogetherError
        If grids, thresholds, events or reference systems are not the same.
    """
    first, second = (open_store(store_path(place, name)) for place, name in zip(places, names, strict=True))
    for store in (first, second):
        check_mapped([store], thresholds)
    _check(first, second, spacing)
    settings = stored(first.attrs).hazard.model_copy(update=dict(thresholds))
    one, other = (map_hazard(ensemble(store, spacing), settings) for store in (first, second))
    _check_grids(one, other, names)
    found = _subtracted(one, other)
    receptors = [stored(store.attrs).places for store in (first, second)]
    alike = {each.name: each for each in receptors[0]}
    shown = [each for each in receptors[1] if alike.get(each.name) == each]
    found = found.assign_attrs(
        Conventions="CF-1.12",
        title=f"{names[1]} less {names[0]}",
        comment=f"{names[0]}: {one.attrs['comment']}; {names[1]}: {other.attrs['comment']}"
        + _not_compared(first, second),
        first_scenario=names[0],
        second_scenario=names[1],
        density=one.attrs["density"],
        second_density=other.attrs["density"],
        receptors="[" + ",".join(each.model_dump_json() for each in shown) + "]",
        georeference=_georeference(first),
        **({"crs": first.attrs["crs"]} if "crs" in first.attrs else {}),
        **({"events_per_year": one.attrs["events_per_year"]} if "events_per_year" in one.attrs else {}),
    )
    return Compared(found, receptor_differences(first, second), section_differences(first, second))


def write_tables(compared: Compared, folder: Path) -> list[Path]:
    """Write the tables that have rows to a folder, made where it is missing; others that lie there go.

    Raises
    ------
    OSError
        If one cannot be written.
    """
    folder.mkdir(parents=True, exist_ok=True)
    written = []
    for name, table in ((TABLE, compared.receptors), (SECTIONS, compared.sections)):
        if len(table):
            run_table.write(table, folder / name)
            written.append(folder / name)
        else:
            (folder / name).unlink(missing_ok=True)
    return written


def difference_layers(found: xr.Dataset) -> Iterator[Layer]:
    """List the single maps of differences."""
    # the layers of hazard maps, under the names that they have there
    plain = found.rename(
        {name: str(name).replace(ENDING, "", 1) for name in found.data_vars if ENDING in str(name)}
    )
    for layer in layers(plain):
        if layer.kind in KINDS:
            name, title = f"{layer.name}{ENDING}", f"difference of the {layer.title}"
            what = WORDS.get(layer.kind) or layer.quantity.replace("_", " ")
            yield Layer(name, title, layer.units, "difference", layer.values, what)


def _not_compared(first: xr.Dataset, second: xr.Dataset) -> str:
    """Say which quantities only one of two stores has, and why."""
    found: dict[str, list[str]] = {}
    for quantity in QUANTITIES:
        there = [quantity.field in store for store in (first, second)]
        if there[0] != there[1]:
            lacking = first if there[1] else second
            found.setdefault(why_not(lacking, quantity), []).append(quantity.long_name)
    told = [f"no {' and no '.join(names)} compared: {why}" for why, names in found.items()]
    sections = [stored(store.attrs).sections for store in (first, second)]
    if any(sections) and not shared_sections(first, second):
        told.append("no sections compared: none has the same name and line in both")
    return "".join(f"; {each}" for each in told)


def _subtracted(one: xr.Dataset, other: xr.Dataset) -> xr.Dataset:
    """Take maps from each other; what only one has is left out."""
    found = xr.Dataset(coords=other.coords)
    if "building" in one.coords or "building" in other.coords:
        built = [maps.coords["building"] for maps in (one, other) if "building" in maps.coords]
        found = found.assign_coords(building=built[0] if len(built) == 1 else np.maximum(built[0], built[1]))
    for name, values in other.data_vars.items():
        if name not in one or np.issubdtype(values.dtype, np.integer):
            continue
        base, bound = _parted(str(name))
        opposite = {"": "", "_lower": "_upper", "_upper": "_lower"}[bound]
        less = values - one[base + opposite]
        words = str(other[base].attrs["long_name"])
        end = {"": "", "_lower": ", lower bound", "_upper": ", upper bound"}[bound]
        about = {"long_name": f"difference of the {words}{end}", "units": values.attrs.get("units", "1")}
        found[f"{base}{ENDING}{bound}"] = less.astype(np.float32).assign_attrs(about)
    return found


def _parted(name: str) -> tuple[str, str]:
    """Part the name of a map from the ending of its bound."""
    bound = next(bound for bound in reversed(BOUNDS) if name.endswith(bound))
    return name.removesuffix(bound), bound


def _check(first: xr.Dataset, second: xr.Dataset, spacing: float | None) -> None:
    """Refuse stores whose numbers do not mean the same."""
    names = [str(store.attrs["title"]) for store in (first, second)]
    about = [stored(store.attrs) for store in (first, second)]
    if about[0].hazard != about[1].hazard:
        raise NotTogetherError(f"{names[0]} and {names[1]} differ in what is asked for under hazard")
    if first.attrs.get("crs") != second.attrs.get("crs") or _georeference(first) != _georeference(second):
        raise NotTogetherError(f"{names[0]} and {names[1]} differ in their georeference")
    depths = [threshold_of(store) for store in (first, second)]
    if depths[0] is None or depths[1] is None or not np.isclose(depths[0], depths[1], rtol=1e-9):
        raise NotTogetherError(
            f"{names[0]} and {names[1]} differ in the depth from which a place is reached "
            f"({depths[0]:g} and {depths[1]:g} m); give both the same output.threshold"
        )
    if ("point" in first.dims or "point" in second.dims) and spacing is None:
        raise NotTogetherError("clouds are compared on a lattice; give its spacing by --spacing")


def _check_grids(one: xr.Dataset, other: xr.Dataset, names: tuple[str, str]) -> None:
    for axis in ("y", "x"):
        before, after = one[axis].to_numpy(), other[axis].to_numpy()
        if before.shape != after.shape or not np.allclose(before, after, rtol=1e-9, atol=1e-9):
            raise NotTogetherError(
                f"{names[0]} and {names[1]} differ in {axis}: {_axis(before)} and {_axis(after)}; "
                "scenarios are compared on the same cells: give both the same domain and points"
            )
    events = [maps.attrs.get("events_per_year") for maps in (one, other)]
    if events[0] != events[1]:
        raise NotTogetherError(
            f"{names[0]} and {names[1]} differ in their events: return periods are not the same"
        )


def _axis(places: np.ndarray) -> str:
    return f"{len(places)} cells from {places[0]:.12g} to {places[-1]:.12g} m"


def _georeference(store: xr.Dataset) -> str:
    ground = stored(store.attrs).georeference
    return "" if ground is None else ground.model_dump_json(exclude={"receptors", "releases"})
