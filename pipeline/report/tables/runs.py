"""Tables of the report on runs: quantiles, sensitivity, sections, volumes, failures, and what made them."""

from __future__ import annotations

from collections.abc import Callable, Hashable, Mapping
from io import BytesIO
from typing import Any

import numpy as np
import pandas as pd
import xarray as xr

from pipeline.assess import tables
from pipeline.assess.ensemble import computed, counts, whose
from pipeline.assess.probability import in_words
from pipeline.assess.sections import passed
from pipeline.assess.tables import creeping
from pipeline.readable import number, percent, written
from pipeline.report.tables.table import FAINT, MOST_ROWS, Table, bounded, short
from pipeline.runs.ending import MOVING_SHARE
from pipeline.store.provenance import BINDING, PACKAGES, differences
from pipeline.store.storage import Location
from pipeline.store.variables import PER_RUN, VOLUMES, Status

AT_SECTIONS = (
    "Net volume in the direction of the flow by the end of the run; the peak is the largest mean discharge "
    "between two samples, and arrival is when the flow was first deeper than the threshold below the section."
)
COLUMNS = {variable.name: variable for variable in PER_RUN}


def sections(store: xr.Dataset) -> Table | None:
    """Table what passed each section: run by run, or of many runs the least, the median and the largest."""
    found = passed(store)
    if not len(found):
        return None
    names = ("volume", "peak_discharge", "peak_time", "arrival_time")
    head = ["section", "volume (m³)", "peak discharge (m³/s)", "peak at (s)", "arrival (s)"]
    if len(found) <= MOST_ROWS:
        rows = [
            [
                str(row["run"]),
                str(row["status"]).replace("_", " "),
                str(row["section"]),
                *(number(row[n]) for n in names),
            ]
            for row in found.to_dict("records")
        ]
        return Table("Sections", ["run", "status", *head], rows, AT_SECTIONS)
    rows = [
        [word, str(section), *(number(getattr(held[name], how)()) for name in names)]
        for section, held in found.groupby("section", sort=False)
        for word, how in (("least", "min"), ("median", "median"), ("largest", "max"))
    ]
    return Table("Sections", ["of runs", *head], rows, AT_SECTIONS)


def volume_ledger(store: xr.Dataset) -> Table | None:
    """Table what became of the volume: run by run, or of many runs the least, the median and the largest."""
    ended = store.isel(run=np.flatnonzero((store["status"] != Status.PENDING).to_numpy()))
    names = [variable.name for variable in VOLUMES if variable.name in store]
    if "volume_entrained" in names and not (ended["volume_entrained"] > 0).any():
        names.remove("volume_entrained")
    words = {name: name.removeprefix("volume_").replace("_", " ") for name in names}
    head = [f"{words[name]} ({written(COLUMNS[name].units)})" for name in names]
    head[-1] = "error"
    values = np.stack([ended[name].to_numpy() for name in names], axis=1)
    if not len(values) or np.isnan(values).all():
        return None
    if len(values) <= MOST_ROWS:
        rows = [
            [str(run), Status(int(status)).plain_words, *map(number, row)]
            for run, status, row in zip(
                ended["run"].to_numpy(), ended["status"].to_numpy(), values, strict=True
            )
        ]
        return Table("Volume", ["run", "status", *head], rows, LEDGER)
    known = values[~np.isnan(values).any(axis=1)]
    if not len(known):
        return None
    kinds: dict[str, Callable[..., Any]] = {"least": np.min, "median": np.median, "largest": np.max}
    rows = [[kind, *map(number, take(known, axis=0))] for kind, take in kinds.items()]
    largest = int(np.abs(known[:, -1]).argmax())
    note = f"{LEDGER} Over {len(known)} runs; largest error {number(known[largest, -1])}."
    return Table("Volume", ["over runs", *head], rows, note)


LEDGER = (
    "Lost is what of the release lies outside the domain; in and out is what passed the boundaries, out open "
    "what left through open sides; moving is what still moved at the end, faster than a Froude number of "
    "0.1 by the largest depth of the release; entrained is what the flow took up from its bed; the error is "
    "that of the ledger, relative to what was released, came in and was entrained."
)


def what_matters(path: Location, name: str) -> Table | None:
    """Table the indices of sensitivity that were written for a scenario; None where there are none."""
    if not path.exists():
        return None
    held = pd.read_csv(BytesIO(path.read_bytes()))
    held = held[held["scenario"] == name]
    if held.empty:
        return None
    parameters = list(dict.fromkeys(held["parameter"]))
    rows = []
    for (quantity, method), group in held.groupby(["quantity", "method"], sort=False):
        found = group.set_index("parameter").to_dict("index")
        cells = [_index(found[each]) if each in found else "–" for each in parameters]
        rows.append([str(quantity).replace("_", " "), str(method), *cells])
    used = f"{held['runs_used'].min()} of {held['runs_planned'].max()} runs"
    note = (
        f"From {used}, with 95 % confidence intervals. PAWN's index is 0 for a parameter that does nothing "
        "and at most 1; grey ones are within what chance gives."
    )
    head = ["quantity", "index", *(each.replace("_", " ") for each in parameters)]
    return Table("What matters", head, rows, note)


def _index(row: Mapping[Hashable, Any]) -> str:
    text = bounded(row, "index", "lower", "upper")
    return f"{FAINT}{text}" if row["index"] <= row["noise"] else text


def quantiles(store: xr.Dataset, fine: xr.Dataset | None = None) -> Table | None:
    """Table quantiles of what a run comes down to, with bounds where runs are missing or censored."""
    rows = []
    for row in tables.quantiles(store, fine):
        found = tables.values(store, str(row["quantity"])).quantile(tables.SHARES)
        bounds = zip(found.lower.tolist(), found.estimate.tolist(), found.upper.tolist(), strict=True)
        title = f"{str(row['quantity']).replace('_', ' ')} ({written(str(row['units']))})"
        changed = [] if fine is None else [short(float(str(row["discretisation"])))]
        rows.append([title, *(in_words(*each, short) for each in bounds), *changed])
    head = ["quantity", *(f"{100 * share:g} % of {whose(store)} below" for share in tables.SHARES)]
    note = f"{_open_words(store)} {creeping_words(store)}".strip()
    if fine is not None:
        head.append("spacing")
        note += (
            " Spacing is the discretisation error: the root mean square change of a run from the widest "
            "spacing to the closest."
        )
    return Table(f"Quantiles over {whose(store)}", head, rows, note) if computed(store).any() else None


def _open_words(store: xr.Dataset) -> str:
    """Say which runs leave numbers open."""
    found = counts(store)
    words = {
        "lost material": found.overrun,
        "were cut off": found.cut_off,
        "failed": found.failed,
        "are pending": found.pending,
    }
    held = [word for word, n in words.items() if n]
    what = f"; above is what runs that {' or '.join(held)} leave open" if held else ""
    return f"Of all planned runs{what}."


def creeping_words(store: xr.Dataset) -> str:
    """Say how many runs are done that were not at rest at their end, and by which limit; "" without one."""
    count = int(creeping(store).sum())
    if not count:
        return ""
    who = f"{count} run{'s' * (count != 1)} {'was' if count == 1 else 'were'}"
    return (
        f"{who} not wholly at rest at the end and counted as done, as no more than {percent(MOVING_SHARE)} "
        "of the volume still moved: rest times are above that end."
    )


def failures(store: xr.Dataset) -> Table | None:
    """Table the runs that failed, with their parameters, reason and place."""
    failed = store.isel(run=np.flatnonzero((store["status"] == Status.FAILED).to_numpy()))
    if not failed.sizes["run"]:
        return None
    swept = [str(name) for name, c in store.coords.items() if "key" in c.attrs]
    rows = [
        [
            str(one["run"].item()),
            *(number(one[name].item()) for name in swept),
            str(one["failure_reason"].item()),
            *(number(one[f"failure_{name}"].item()) for name in ("time", "x", "y")),
        ]
        for one in (failed.isel(run=i) for i in range(min(failed.sizes["run"], MOST_ROWS)))
    ]
    more = failed.sizes["run"] - len(rows)
    head = ["run", *(name.replace("_", " ") for name in swept), "reason", "time (s)", "x (m)", "y (m)"]
    return Table("Failed runs", head, rows, f"And {more} more." if more else "")


def origin(store: xr.Dataset) -> Table:
    """Table what made the store: hashes and versions."""
    held = store.attrs
    changed = differences(held)
    rows = [["scenario", str(held["scenario_hash"])], [BINDING["solver_hash"], str(held["solver_hash"])]]
    rows += [
        [name, str(held[f"{name}_version"])] for name in (*PACKAGES, "python") if f"{name}_version" in held
    ]
    note = f"Another one is installed here: {', '.join(changed)}." if changed else ""
    return Table("Versions and hashes", ["what", "SHA-256 or version"], rows, note)
