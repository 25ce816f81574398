"""The hazard maps of a place: of each scenario, and of all together."""

from __future__ import annotations

import json
import logging
from collections.abc import Iterator, Mapping, Sequence
from math import prod
from typing import Any

import xarray as xr

from pipeline.assess.ensemble import NotTogetherError, ensemble, together
from pipeline.assess.tables import finest
from pipeline.hazard.discretisation import ENDING, ONE_SPACING, TOGETHER, with_discretisation
from pipeline.hazard.mapping import map_hazard, without_buildings
from pipeline.hazard.quantities import check_mapped
from pipeline.hazard.release_outlines import release_outlines
from pipeline.runs import profile_ends, surface_summary
from pipeline.scenario.scenario import stored
from pipeline.settings.hazard import Hazard
from pipeline.settings.settings import Settings
from pipeline.store import zarr_store
from pipeline.store.place import store_paths
from pipeline.store.storage import Location
from pipeline.store.zarr_store import open_store

WHOLE = "all scenarios"
# of what maps say, where they lie
LAID = ("georeference", "crs")
_log = logging.getLogger(__name__)


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
    OptionError
        If thresholds are given of what no scenario has.
    ValueError
        If a store's scenario is not known here.
    """
    held: dict[str, xr.Dataset] = {}
    asked: dict[str, Hazard] = {}
    said: dict[str, dict[str, str]] = {}
    releases: dict[str, list[Any]] = {}
    warnings: list[object] = []
    left_out, has_levels = 0, False
    paths = store_paths(out)
    stores = [open_store(path) for path in paths]
    check_mapped(stores, thresholds)
    for path, store in zip(paths, stores, strict=True):
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
        has_levels |= bool(_level(settings))
        left_out += (chosen := zarr_store.chosen(path))
        found.attrs["comment"] += _note(warned) + _level(settings) + _left_out(chosen)
        found = _discretised(found, path, store, settings, asked[name], held[name], spacing)
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
        found.attrs[ENDING[1:]] = TOGETHER if has_levels else ONE_SPACING
        yield WHOLE, found.assign_attrs(title=WHOLE, receptors=marks, scenarios=", ".join(held), **where)


def _discretised(
    found: xr.Dataset,
    path: Location,
    store: xr.Dataset,
    settings: Settings,
    asked: Hazard,
    runs: xr.Dataset,
    spacing: float | None,
) -> xr.Dataset:
    """Add what the spacing leaves open, where some runs are on a closer one, or say that it is not known."""
    finer = finest(path, store)
    if finer is None:
        return found.assign_attrs({ENDING[1:]: ONE_SPACING})
    with finer:
        entries = prod(map(len, settings.sweep.values()))
        return without_buildings(with_discretisation(found, runs, ensemble(finer, spacing), asked, entries))


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
