"""Stores in memory of sampled runs whose depths are known in closed form."""

import numpy as np
import xarray as xr
from known_maps import X, Y, depths

from pipeline.assess.tables import QUANTITIES
from pipeline.scenario.design import draw
from pipeline.scenario.levels import at_level
from pipeline.scenario.scenario import stored
from pipeline.store.variables import Status

TEXT = """\
name: sheet
terrain: {{profile: plane, angle: 30}}
domain: {{x: [0, 100], y: [-40, 40]}}
points: {{spacing: {spacing:g}}}
release: {{shape: box, x: [1, 20], y: [-10, 10], height: 1}}
material: {{bed_friction: 20, turbulent_friction: 500, earth_pressure: isotropic}}
output: {{threshold: 0.1}}
sample:
  {count}
  values:
    material.turbulent_friction: {{distribution: uniform, lower: 200, upper: 1200}}
    release.volume: {{distribution: uniform, lower: 0.5, upper: 1.5}}{more}
hazard: {{depth: [0.5], speed: []}}
receptors:
  - {{name: near, point: [48, 0]}}
  - {{name: far, point: [84, 0]}}
"""
SPACING, CLOSE = 4.0, 2.0
THINNER = 0.2


def scaled(store):
    """Give the places of the runs in the unit square."""
    turbulent = (store["turbulent_friction"].to_numpy() - 200) / 1000
    return np.stack([turbulent, store["volume"].to_numpy() - 0.5], axis=1)


def sheet(count=64, levels="", status=None, noise=None, more=""):
    """Give the store of a sampled scenario; on ``levels`` also that of 16 runs of a thinner sheet.

    more : further lines of the sample's values.
    """
    said = f"levels: [{{spacing: {SPACING:g}, count: {count}}}, {{spacing: {CLOSE:g}, count: 16}}]"
    asked = said if levels else f"count: {count}"
    text = TEXT.format(spacing=CLOSE if levels else SPACING, count=asked, more=more)
    made = [store_of(text, count, SPACING, 0.0, status, noise)]
    return [*made, store_of(text, 16, CLOSE, THINNER)] if levels else made


def store_of(text, count, spacing, thinner, status=None, noise=None):
    """Give the store of runs of a text on a spacing, which makes them thinner."""
    sample = stored({"title": "sheet", "scenario": text}).sample
    drawn = draw(at_level(sample, count))
    given = {key.rpartition(".")[2]: ("run", np.array(values), {"key": key}) for key, values in drawn.items()}
    x, y = (np.linspace(a[0], a[-1], round((a[-1] - a[0]) / spacing) + 1) for a in (X, Y))
    found = xr.Dataset(
        coords={
            "run": np.arange(count),
            "x": x,
            "y": y,
            "elevation": ("x", -x),
            "horizontal_distance": ("x", x),
            "weight": ("run", np.full(count, 1 / count)),
            **given,
        },
        attrs={"title": "sheet", "scenario": text, "threshold": 0.1, "scenario_hash": "a"}
        | {"solver_hash": "b", "lmls_version": "0"},
    )
    depth = depths(scaled(found), x, y, thinner)
    if noise is not None:
        depth = np.random.default_rng(noise).uniform(0, 1, depth.shape)
    state = np.full(count, Status.DONE) if status is None else status
    depth[np.isin(state, (Status.FAILED, Status.PENDING))] = np.nan
    cells = ("run", "y", "x")
    found["max_depth"] = (cells, depth)
    found["max_speed"] = (cells, 5 * depth)
    found["arrival_time"] = (cells, np.where(depth > 0.1, 10.0, np.nan))
    found["status"] = ("run", state)
    reach = np.where(np.isnan(depth).any(axis=(1, 2)), np.nan, 50 + 40 * scaled(found)[:, 0])
    for name in (*QUANTITIES, "last_time"):
        found[name] = ("run", reach + thinner, {"units": "m"})
    return found
