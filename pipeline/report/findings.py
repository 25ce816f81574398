"""What a scenario comes down to, in sentences with numbers."""

from __future__ import annotations

from collections.abc import Iterator
from io import BytesIO
from typing import Any

import numpy as np
import pandas as pd
import xarray as xr

from pipeline.assess import tables
from pipeline.assess.ensemble import counts, whose
from pipeline.assess.frames import on_surface
from pipeline.assess.probability import BOUNDS
from pipeline.assess.receptors import reached
from pipeline.gis.symbology import CLASSES
from pipeline.report.tables.runs import creeping_words
from pipeline.report.tables.table import between, is_open, share_in_words, short
from pipeline.store.storage import Location

SHARES = (0.05, 0.5, 0.95)
SQUARE_METRES = 10_000.0


def findings(store: xr.Dataset, found: xr.Dataset, indices: Location) -> list[str]:
    """Give the findings of a scenario, the most important ones first.

    Parameters
    ----------
    store : Dataset
        A scenario's store.
    found : Dataset
        Its hazard maps.
    indices : Location
        Table of sensitivity, which may be missing.
    """
    return [*_receptors(store), *_levels(found), *_runout(store), *_drivers(indices, store), *_doubts(store)]


def _receptors(store: xr.Dataset) -> Iterator[str]:
    try:
        by_run = reached(store)
    except ValueError:
        return
    periods: dict[str, list[dict[str, Any]]] = {}
    for each in tables.receptors_by_period(store, by_run):
        periods.setdefault(str(each["receptor"]), []).append(each)
    never = []
    rows: list[dict[str, Any]] = list(tables.receptors(store, by_run))
    for row in rows:
        name = str(row["receptor"])
        if not row["probability_upper"] > 0:
            never.append(name)
            continue
        if periods:
            yield by_period(name, periods[name], row)
            continue
        text = f"{name}: reached with a probability of {share_in_words(row, 'probability')}"
        if is_open(row, "probability"):
            text = f"{name}: it is not known whether it is reached"
        yield f"{text}{_at_the_earliest(row)}."
    if never:
        yield f"Not reached in any run: {', '.join(never)}."


def _at_the_earliest(row: dict[str, Any]) -> str:
    """Say when a receptor is reached first, and by what; nothing where no computed run reaches it."""
    if not row["probability"] > 0:
        return ""
    missing = int(row["runs_failed"]) + int(row["runs_pending"])
    of_runs = " in the computed runs" if missing else ""
    return f", at the earliest after {short(row['first_arrival_time'])} s{of_runs}. {_what(row)}"


def _what(row: dict[str, Any]) -> str:
    unknown = sum(int(row[f"runs_{each}"]) for each in ("overrun", "cut_off", "failed", "pending"))
    # what left the domain, still moved or failed may be deeper and faster than all that was computed
    depth, speed = short(row["largest_depth"]), short(row["largest_speed"])
    most = f"{depth} m at most, and up to {speed} m/s fast"
    if unknown:
        most = f"{depth} m in the deepest computed run, and {speed} m/s fast in the fastest"
    return f"Where it is reached the flow is {short(row['median_max_depth'])} m deep in the median and {most}"


def by_period(name: str, rows: list[dict[str, Any]], whole: dict[str, Any]) -> str:
    """Say at what return periods a receptor is reached, and how likely by each.

    Parameters
    ----------
    name : str
        Of the receptor.
    rows : list of dict
        Its rows of the table of receptors by return period, the shortest first.
    whole : dict
        Its row of the table of receptors.
    """
    chances = ", ".join(f"{share_in_words(row, 'probability')} at {_years(row)}" for row in rows)
    often = [row["probability_lower"] >= 0.5 for row in rows]
    # runs that are missing, overrun or cut off may decide it
    doubtful = [
        _years(row)
        for row, enough in zip(rows, often, strict=True)
        if not enough and not row["probability_upper"] < 0.5
    ]
    chosen = [_years(row) for row, enough in zip(rows, often, strict=True) if enough]
    begins = f"{name}: reached by half of the events or more"
    if len(doubtful) == len(rows):
        begins = f"{name}: it is not known of any return period whether half of the events reach it"
    elif not chosen:
        begins = f"{name}: reached by less than half of the events of each return period"
        if doubtful:
            begins = f"{begins} but {', '.join(doubtful)}, of which it is not known"
    elif all(often[often.index(True) :]):
        begins += f" from a return period of {chosen[0]} on"
    else:
        begins += f" at {', '.join(chosen)}" + " and at no other return period" * (not doubtful)
    if chosen and doubtful:
        begins += f"; of {', '.join(doubtful)} it is not known"
    return f"{begins} (probability {chances}){_at_the_earliest(whole)}."


def _years(row: dict[str, Any]) -> str:
    first, last = row["shortest_return_period"], row["return_period"]
    return f"{last:g} years" if first == last else f"{first:g} to {last:g} years"


def _levels(found: xr.Dataset) -> Iterator[str]:
    """Say how large the areas of each level or intensity are."""
    name = next((each for each in ("hazard_level", "intensity") if each in found), None)
    if name is None or found.sizes["x"] < 2:
        return
    cell = float(np.prod([found[axis][1] - found[axis][0] for axis in ("x", "y")])) / SQUARE_METRES
    is_certain = all((found[f"{name}{bound}"] == found[name]).all() for bound in BOUNDS)
    parts, last = [], len(CLASSES[name])
    for value, each in reversed([*enumerate(CLASSES[name], 1)]):
        # a bound may move a place from one class to a higher one: what is bounded is this class or more
        areas = [
            float(((held == value) | ((held > value) & (not is_certain))).sum()) * cell
            for held in (found[f"{name}{bound}"] for bound in BOUNDS)
        ]
        # what is not known counts in a bound alone
        areas[0] = max(areas[:2])
        if any(areas):
            more = "" if is_certain or value == last else " or higher"
            parts.append(f"{each.word}{more} on {between(*map(short, areas))} ha")
    what = "The level of hazard is" if name == "hazard_level" else "The intensity that is usual is"
    if parts:
        yield f"{what} {', '.join(parts)}."


def _runout(store: xr.Dataset) -> Iterator[str]:
    reach = tables.values(store, "runout_distance").quantile(SHARES)
    low, middle, high = reach.estimate.tolist()
    if np.isfinite([low, middle, high]).all():
        if counts(store).planned == 1:
            yield f"The run-out is {short(middle)} m."
        else:
            yield (
                f"The run-out is {short(middle)} m in the median; 5 % of the {whose(store)} stay below "
                f"{short(low)} m and 5 % go beyond {short(high)} m."
            )
    elif np.isfinite(reach.lower[1]):
        in_median = "" if counts(store).planned == 1 else " in the median"
        yield (
            f"The run-out is above {short(float(reach.lower[1]))} m{in_median}: by how much is not known, as "
            "runs are missing, overrun or cut off."
        )


def _drivers(indices: Location, store: xr.Dataset) -> Iterator[str]:
    if not indices.exists():
        return
    held = pd.read_csv(BytesIO(indices.read_bytes()))
    wanted = (held["scenario"] == store.attrs["title"]) & (held["quantity"] == "runout_distance")
    rows = held[wanted & (held["method"] == "pawn")].sort_values("index", ascending=False)
    rows = rows[rows["index"] > rows["noise"]]
    if len(rows):
        named = [
            f"{str(parameter).replace('_', ' ')} ({index:.2f})"
            for parameter, index in zip(rows["parameter"], rows["index"], strict=True)
        ]
        yield f"What drives the run-out, by PAWN's index: {', '.join(named)}."


def _doubts(store: xr.Dataset) -> Iterator[str]:
    found = counts(store)
    if found.overrun or found.cut_off:
        where = "where the domain or the data end" if on_surface(store) else "through open sides"
        yield (
            f"{_runs(found.overrun)} lost material {where} and {found.cut_off} still "
            "moved at their end: reach and probabilities are lower bounds of what these may do."
        )
    if "rest_time" in store and (words := creeping_words(store)):
        yield words
    if found.failed or found.pending:
        missing = (
            f"{_runs(found.failed)} failed and {_runs(found.pending)} of the plan have not been computed"
        )
        yield f"{missing}: bounds hold whatever they would give."


def _runs(count: int) -> str:
    return f"{count} run{'s' * (count != 1)}"
