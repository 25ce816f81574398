"""What passed the sections of a scenario: volume, peak and arrival of each run."""

from __future__ import annotations

import numpy as np
import pandas as pd
import xarray as xr

from pipeline.assess.ensemble import computed
from pipeline.store.variables import STATUS, Status


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
