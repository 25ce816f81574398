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
from pipeline.assess.receptors import reached
from pipeline.gis.symbology import CLASSES
from pipeline.report.tables.table import share_in_words, short
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
        chance = share_in_words(row, "probability")
        text = f"{name}: reached with a probability of {chance}"
        if row["probability"] > 0:
            text += f", at the earliest after {short(row['first_arrival_time'])} s. {_what(row)}"
        yield text.rstrip(".") + "."
    if never:
        yield f"Not reached in any run: {', '.join(never)}."


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
    often = [row["probability"] >= 0.5 for row in rows]
    first = often.index(True) if any(often) else len(rows)
    begins = f"{name}: reached by half of the events or more"
    if not any(often):
        begins = f"{name}: reached by less than half of the events of each return period"
    elif all(often[first:]):
        begins += f" from a return period of {_years(rows[first])} on"
    else:
        chosen = [_years(row) for row, enough in zip(rows, often, strict=True) if enough]
        begins += f" at {', '.join(chosen)} and at no other return period"
    text = f"{begins} (probability {chances})"
    if whole["probability"] > 0:
        text += f", at the earliest after {short(whole['first_arrival_time'])} s. {_what(whole)}"
    return f"{text}."


def _years(row: dict[str, Any]) -> str:
    first, last = row["shortest_return_period"], row["return_period"]
    return f"{last:g} years" if first == last else f"{first:g} to {last:g} years"


def _levels(found: xr.Dataset) -> Iterator[str]:
    """Say how large the areas of each level or intensity are."""
    name = next((each for each in ("hazard_level", "intensity") if each in found), None)
    if name is None or found.sizes["x"] < 2:
        return
    side = [float(found[axis][1] - found[axis][0]) for axis in ("x", "y")]
    parts = []
    for value, each in reversed([*enumerate(CLASSES[name], 1)]):
        area = float((found[name] == value).sum()) * side[0] * side[1]
        if area:
            parts.append(f"{each.word} on {short(area / SQUARE_METRES)} ha")
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
        yield f"The run-out is above {short(float(reach.lower[1]))} m in the median: too many runs went on."


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
        yield (
            f"{_runs(found.overrun)} lost material through the sides of the domain and {found.cut_off} still "
            "moved at their end: reach and probabilities are lower bounds of what these may do."
        )
    if found.failed or found.pending:
        missing = (
            f"{_runs(found.failed)} failed and {_runs(found.pending)} of the plan have not been computed"
        )
        yield f"{missing}: bounds hold whatever they would give."


def _runs(count: int) -> str:
    return f"{count} run{'s' * (count != 1)}"
