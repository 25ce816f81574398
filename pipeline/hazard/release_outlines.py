"""Where the releases of a scenario lie, from the first frames of its runs."""

from __future__ import annotations

import numpy as np
import xarray as xr

from pipeline.assess.frames import mean_spacing
from pipeline.assess.gridding import gridded

# runs whose first frames are looked at, evenly spread: others of a sweep lie where these do
MOST_RUNS = 12


def release_outlines(store: xr.Dataset, spacing: float | None = None) -> list[list[list[float]]]:
    """Outline what is released in any run, as rings of places, m, in coordinates of the points.

    Parameters
    ----------
    store : Dataset
        A scenario's store.
    spacing : float, optional
        Of the lattice that a cloud is brought to, m.

    Returns
    -------
    list of list of [x, y]
        None where depth was not kept, or there is nothing at time 0.
    """
    from contourpy import contour_generator

    if "depth" not in store:
        return []
    runs = np.unique(np.linspace(0, store.sizes["run"] - 1, MOST_RUNS).astype(int))
    first = store[["depth"]].isel(run=runs, time=[0]).load()
    if "point" in first.dims:
        first = gridded(
            first.assign_coords(area=store["area"]).assign_attrs(store.attrs), spacing or mean_spacing(store)
        )
    held = (first["depth"] > 0).any(("run", "time")).to_numpy()
    x, y = (first[axis].to_numpy().astype(np.float64) for axis in ("x", "y"))
    # a ring of dry cells around, so that outlines at the sides are closed
    padded = np.pad(held.astype(np.float64), 1)
    around = [np.concatenate([[2 * at[0] - at[1]], at, [2 * at[-1] - at[-2]]]) for at in (x, y)]
    lines = contour_generator(around[0], around[1], padded).lines(0.5)
    return [np.round(np.asarray(line), 3).tolist() for line in lines]
