"""Emulated numbers of a scenario: leave-one-out first, then maps, receptors, quantiles and missing runs."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, field

import pandas as pd
import xarray as xr

from pipeline.assess.ensemble import counts
from pipeline.emulation.errors import NotEmulatedError
from pipeline.emulation.maps import mapped
from pipeline.emulation.missing import missing_runs
from pipeline.emulation.places import receptor_rows
from pipeline.emulation.sampled import Sampled, sampled
from pipeline.emulation.scenario_quantiles import emulated_scalars, quantile_rows
from pipeline.emulation.thresholds import fitted, left_plain, with_probabilities
from pipeline.hazard.place_maps import about
from pipeline.settings.hazard import Hazard
from pipeline.store.place import store_paths
from pipeline.store.storage import Location

# draws of maps; a single number is over more
DRAWS = 4096
MORE_FOR_NUMBERS = 4
FILE = "emulated.nc"
TABLES = ("leave-one-out", "emulated-scenarios", "emulated-receptors", "emulated-missing")


@dataclass(frozen=True)
class Emulated:
    """What the emulator makes of a scenario.

    Parameters
    ----------
    tables : mapping of str to pd.DataFrame
        By name, of `TABLES`, those that have rows.
    maps : xr.Dataset, optional
        Over ``y`` and ``x`` by threshold, of the thresholds that leave-one-out supports; None where there
        is none.
    """

    tables: Mapping[str, pd.DataFrame]
    maps: xr.Dataset | None
    comment: str
    refused: Sequence[str] = field(default=())


def emulate(runs: Sampled, asked: Hazard, count: int = DRAWS) -> Emulated:
    """Emulate a scenario.

    Parameters
    ----------
    runs : Sampled
        Its runs.
    asked : Hazard
        Thresholds.
    count : int
        Draws of maps; single numbers are over `MORE_FOR_NUMBERS` times as many.
    """
    few, many = runs.inputs.draws(count), runs.inputs.draws(count * MORE_FOR_NUMBERS)
    chosen = with_probabilities(runs, fitted(runs, asked), few, many)
    scalars = emulated_scalars(runs)
    rows = [*(each.row(runs) for each in chosen), *(each.row(runs) for each in scalars)]
    found = {
        "leave-one-out": pd.DataFrame([*rows, *left_plain(runs)]),
        "emulated-scenarios": pd.DataFrame(quantile_rows(runs, scalars, many)),
        "emulated-receptors": pd.DataFrame(receptor_rows(runs, chosen)),
        "emulated-missing": pd.DataFrame(missing_runs(runs, chosen, scalars)),
    }
    comment = f"{count:,} draws emulated from {runs.words}{_filled(found['emulated-missing'])}"
    if runs.told_of_unsettled:
        comment += f"; probabilities are lower bounds, as {runs.told_of_unsettled}"
    maps = mapped(runs, chosen)
    if maps is not None:
        store = runs.stores[0]
        maps = maps.assign_attrs(
            title=runs.name,
            comment=comment,
            **{
                "discretisation": runs.told_of_spacing,
                "Conventions": "CF-1.12",
                "draws": len(few.at),
                "outlines": list(asked.outlines),
            },
            **counts(store).attributes,
            **about(store, runs.settings),
        )
    refused = [f"{row['what']}: refused: {row['reason']}" for row in rows if row["verdict"] == "refused"]
    return Emulated(
        {name: table for name, table in found.items() if len(table)},
        maps,
        f"{runs.name}: {comment}",
        refused,
    )


def _filled(missing: pd.DataFrame) -> str:
    """Say how many runs the emulator stands for, and how far from the others they lie."""
    if missing.empty:
        return ""
    beyond = int(missing["extrapolated"].sum())
    return f"; {len(missing)} missing runs filled in" + (f", {beyond} of them extrapolated" if beyond else "")


def of_place(
    out: Location, thresholds: Mapping[str, tuple[float, ...]], name: str | None = None, count: int = DRAWS
) -> Iterator[tuple[str, Emulated | NotEmulatedError]]:
    """Emulate the scenarios of a place, or one of them; one that cannot be comes with the reason.

    Raises
    ------
    FileNotFoundError
        If the place holds no store.
    ValueError
        If there is no scenario of the name.
    """
    paths = store_paths(out)
    known = [path.stem for path in paths]
    if name is not None and name not in known:
        raise ValueError(f"expected a scenario of {', '.join(known)}, found '{name}'")
    for path in paths:
        if name not in (None, path.stem):
            continue
        try:
            with sampled(path) as runs:
                asked = runs.settings.hazard.model_copy(update=dict(thresholds))
                found: Emulated | NotEmulatedError = emulate(runs, asked, count)
        except NotEmulatedError as error:
            found = error
        yield path.stem, found


def table_of(found: Sequence[Emulated], name: str) -> pd.DataFrame:
    """Put together one table of several scenarios; empty where none has it."""
    held = [each.tables[name] for each in found if name in each.tables]
    return pd.concat(held, ignore_index=True) if held else pd.DataFrame()
