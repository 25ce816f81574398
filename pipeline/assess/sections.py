"""What passed the sections of a scenario in each run, and in one scenario beside another."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np
import pandas as pd
import xarray as xr

from pipeline.assess.ensemble import censored, computed, weights
from pipeline.assess.probability import Values
from pipeline.assess.receptor_differences import LARGEST, MEDIAN, Number, chances, differences_at, quantile
from pipeline.scenario.scenario import stored
from pipeline.store.variables import STATUS, Status

FIRST = ("first", 0.0)


def passed(store: xr.Dataset) -> pd.DataFrame:
    """Table what passed each section in each run, a row each; no rows without sections.

    Volume and peak of a run that failed are missing, as it had not passed all. Those of a run that still
    moved at its end, or that was overrun, are of what passed by then, as its status says.

    Parameters
    ----------
    store : Dataset
        A scenario's store.
    """
    if "section_volume" not in store:
        return pd.DataFrame()
    known = computed(store).to_numpy()
    volume = store["section_volume"].isel(section_time=-1).to_numpy()
    others = {
        name: store[f"section_{name}"].to_numpy() for name in ("peak_discharge", "peak_time", "arrival_time")
    }
    rows = []
    for i, run in enumerate(store["run"].to_numpy()):
        for k, name in enumerate(store["section"].to_numpy()):
            values = {"volume": volume[i, k], **{key: held[i, k] for key, held in others.items()}}
            rows.append(
                {
                    "scenario": str(store.attrs["title"]),
                    "run": int(run),
                    "status": Status(int(store[STATUS.name][i])).words,
                    "section": str(name),
                    **{key: float(value) if known[i] else np.nan for key, value in values.items()},
                }
            )
    return pd.DataFrame(rows)


def shared_sections(first: xr.Dataset, second: xr.Dataset) -> list[str]:
    """Name the sections that are the same line in two scenarios."""
    one, other = ({each.name: each for each in stored(store.attrs).sections} for store in (first, second))
    return [name for name, section in one.items() if other.get(name) == section]


def section_differences(first: xr.Dataset, second: xr.Dataset) -> pd.DataFrame:
    """Table what passes the sections that two scenarios share, and by how much it differs.

    Parameters
    ----------
    first, second : Dataset
        Their stores.

    Returns
    -------
    DataFrame
        A row a section and quantity: the probability that the flow arrives, its annual rate where there are
        return periods, the median and the largest volume (m3) and peak discharge (m3 s-1) of all runs, and
        the median and the first arrival (s). A run that does not arrive is later than all that do: the median
        is missing where half of the runs do not, and so is its difference. Columns as of
        `pipeline.assess.receptor_differences`. Empty where no section is in both.
    """
    shared = shared_sections(first, second)
    return differences_at("section", shared, (first, second), passed, quantities_at)


def quantities_at(store: xr.Dataset, rows: pd.DataFrame) -> Iterator[tuple[str, Number]]:
    """Give the numbers of a section by name, each with its units.

    Parameters
    ----------
    store : Dataset
        A scenario's store.
    rows : DataFrame
        What passed the section in each run, as `passed` tables it.
    """
    weight, open_ended = weights(store), censored(store).to_numpy()
    cut_off = np.array([Status(state).is_cut_off for state in store[STATUS.name].to_numpy()])
    nothing = np.zeros(len(weight), bool)
    volume, peak, arrival = (
        rows[name].to_numpy(np.float64) for name in ("volume", "peak_discharge", "arrival_time")
    )
    known = computed(store).to_numpy()
    yield from chances(store, np.where(known, np.isfinite(arrival), np.nan))
    # what still moves may come back through a section
    for name, units, held in (
        ("volume", "m3", Values(volume, weight, open_ended, cut_off)),
        ("peak_discharge", "m3 s-1", Values(peak, weight, open_ended, nothing)),
    ):
        for word, level in (MEDIAN, LARGEST):
            yield f"{word}_{name}", (units, quantile(held, level))
    never = known & np.isnan(arrival)
    last = store["last_time"].to_numpy()
    later = np.where(never, np.where(open_ended, last, np.inf), arrival)
    held = Values(later, weight, never & open_ended, nothing)
    for word, level in (MEDIAN, FIRST):
        yield f"{word}_arrival_time", ("s", quantile(held, level, np.where(never, np.inf, arrival)))
