"""Stores in memory whose runs are known in closed form."""

import numpy as np
import xarray as xr

from pipeline.store.variables import Status

TEXT = """\
name: synthetic
terrain: {profile: plane, angle: 30}
domain: {x: [0, 9], y: [0, 4]}
points: {spacing: 1}
release: {shape: box, x: [1, 2], y: [1, 2], height: 1}
material: {bed_friction: 20, internal_friction: 40}
time: {end: 1}
"""


def store(parameters, status=None, more="", **held):
    """Make a store of 5 by 10 cells of 1 m2 with given parameters and values by run, else zero."""
    runs = len(next(iter(parameters.values())))
    keys = {"bed_friction": "material.bed_friction", "volume": "release.volume"}
    scalars = ("runout_distance", "deposit_area", "deposit_max_depth", "peak_speed")
    values = {name: ("run", np.zeros(runs)) for name in scalars}
    values |= {name: (("run", "y", "x"), np.zeros((runs, 5, 10))) for name in ("max_depth", "deposit_depth")}
    values |= {
        name: (("run", "y", "x") if np.ndim(value) == 3 else "run", value) for name, value in held.items()
    }
    status = np.full(runs, Status.DONE) if status is None else status
    return xr.Dataset(
        {**values, "status": ("run", status)},
        coords={
            "run": np.arange(runs),
            "x": np.arange(10.0),
            "y": np.arange(5.0),
            "horizontal_distance": ("x", np.arange(10.0)),
            "weight": ("run", np.full(runs, 1 / runs)),
            **{name: ("run", value, {"key": keys[name]}) for name, value in parameters.items()},
        },
        attrs={"title": "synthetic", "scenario": TEXT + more},
    )
