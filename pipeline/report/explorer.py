"""What the page's map is made of: every run of a scenario in few bytes, to look at and to ask."""

from __future__ import annotations

import json
from typing import Any

import numpy as np
import xarray as xr
from numpy.typing import NDArray

from pipeline.assess.ensemble import censored, computed, periods, weights
from pipeline.assess.frames import densities, mean_spacing
from pipeline.assess.georeference import Frame
from pipeline.assess.gridding import gridded
from pipeline.assess.tables import values
from pipeline.gis import symbology
from pipeline.gis.symbology import Style
from pipeline.readable import number, with_unit
from pipeline.report.explorer_ground import ground
from pipeline.report.packing import coarser, pack, rounded_up, step_of, times
from pipeline.settings.hazard import Hazard
from pipeline.store.variables import STATUS, Status

Array = NDArray[np.float64]
# characters of the page that the maxima of all runs, and the frames of some, may take
MAXIMA_BUDGET, FRAMES_BUDGET = 4_000_000, 2_500_000
MOST_BLOCK = 8
FIELDS = ("max_depth", "max_speed", "arrival_time")
# the coarsest steps: m, m/s, s
STEPS = {"max_depth": 0.01, "max_speed": 0.1, "arrival_time": 1.0}


def explorer(store: xr.Dataset, found: xr.Dataset, frame: Frame | None, settings: Hazard) -> str | None:
    """Give the data of a scenario's map as JSON; None where its runs did not keep what it needs.

    Parameters
    ----------
    store : Dataset
        A scenario's store.
    found : Dataset
        Its hazard maps, over the lattice that a cloud is brought to.
    frame : Frame, optional
        Of this lattice.
    settings : Hazard
        Thresholds.
    """
    known = computed(store).to_numpy()
    if not set(FIELDS) <= set(store) or not known.any():
        return None
    kept = store[[*FIELDS, *(["depth"] if "depth" in store else [])]]
    if "point" in kept.dims:
        kept = gridded(kept.assign_coords(area=store["area"]), mean_spacing(store))
    whole, steps = {}, {}
    for name in FIELDS:
        held = np.where(known[:, None, None], kept[name].to_numpy(), np.nan)
        largest = float(np.nanmax(held)) if np.isfinite(held).any() else 0.0
        steps[name] = step_of(largest, STEPS[name])
        whole[name] = (times if name == "arrival_time" else rounded_up)(held, steps[name])
    block, packed = _within_budget(whole)
    order, reach = _by_reach(store)
    frames = _frames(kept, order[known[order]], steps["max_depth"], block)
    data = {
        "title": str(store.attrs["title"]),
        "grid": _grid(found, frame, block),
        "ground": ground(found, block),
        "steps": steps,
        "fields": packed,
        "frames": frames,
        "runs": _runs(store, known, order, reach),
        "periods": _periods(store, settings),
        "thresholds": _thresholds(settings, steps),
        "styles": _styles(found, steps, whole),
        "receptors": json.loads(found.attrs.get("receptors", "[]")),
        "releases": json.loads(found.attrs.get("releases", "[]")),
    }
    return json.dumps(data, allow_nan=False, separators=(",", ":"))


def _within_budget(whole: dict[str, NDArray[np.uint16]]) -> tuple[int, dict[str, str]]:
    """Pack the maxima of all runs, in blocks of cells where they would make the page too large."""
    for block in range(1, MOST_BLOCK + 1):
        packed = {}
        for name, held in whole.items():
            # of a block, the first arrival
            taken = _first(held, block) if name == "arrival_time" else coarser(held, block)
            packed[name] = pack(taken)
        if sum(map(len, packed.values())) <= MAXIMA_BUDGET:
            break
    return block, packed


def _first(held: NDArray[np.uint16], block: int) -> NDArray[np.uint16]:
    """Take the least number of blocks of cells that is not 0."""
    turned = (0 - held.astype(np.int32)) % 2**16
    return ((0 - coarser(turned.astype(np.uint16), block).astype(np.int32)) % 2**16).astype(np.uint16)


def _by_reach(store: xr.Dataset) -> tuple[NDArray[np.intp], Array]:
    """Order the runs by run-out, those without one first; gives the order and the run-outs, m."""
    reach = values(store, "runout_distance").value
    return np.argsort(np.nan_to_num(reach, nan=-np.inf, neginf=-np.inf), kind="stable"), reach


def _frames(kept: xr.Dataset, order: NDArray[np.intp], step: float, block: int) -> dict[str, Any]:
    """Pack the depth of runs at their output times: of as many as there is room for, evenly over run-out."""
    if "depth" not in kept or kept.sizes["time"] < 2:
        return {"times": [], "runs": {}}
    found: dict[str, str] = {}
    room = FRAMES_BUDGET
    for run in order[_spread(len(order))]:
        packed = pack(coarser(rounded_up(kept["depth"].isel(run=int(run)).to_numpy(), step), block))
        room -= len(packed)
        if room < 0:
            break
        found[str(int(run))] = packed
    return {"times": kept["time"].to_numpy().tolist(), "runs": found}


def _spread(count: int) -> NDArray[np.intp]:
    """Order positions so that the first ones are spread: middle, ends, then halves of what is left."""
    cuts = [0.5, 0.0, 1.0, 0.25, 0.75]
    for parts in (8, 16, 32, 64, 128, 256, 512, 1024, 2048):
        cuts += [i / parts for i in range(1, parts, 2)]
    places = dict.fromkeys(round(cut * (count - 1)) for cut in cuts)
    return np.array([*places, *(i for i in range(count) if i not in places)], np.intp)


def _grid(found: xr.Dataset, frame: Frame | None, block: int) -> dict[str, Any]:
    """Say where the cells lie: along and across, and on the map."""
    x, y = (found[axis].to_numpy().astype(np.float64) for axis in ("x", "y"))
    about: dict[str, Any] = {
        "nx": -(-len(x) // block),
        "ny": -(-len(y) // block),
        "block": block,
        "x0": float(x[0]),
        "dx": float(x[1] - x[0]) * block,
        "y0": float(y[0]),
        "dy": float(y[1] - y[0]) * block,
        # of the first cell's outer side, in cells of the lattice
        "half": 0.5 / block,
        "system": frame.system if frame else "",
        "map": frame is not None,
    }
    if frame is not None and not frame.is_map:
        origin, azimuth = frame.georeference.origin, frame.georeference.azimuth
        about |= {"origin": list(origin), "azimuth": azimuth, "s": np.round(frame.distance, 3).tolist()}
    return about


def _runs(
    store: xr.Dataset, known: NDArray[np.bool_], order: NDArray[np.intp], reach: Array
) -> list[dict[str, Any]]:
    """Say of each run, in the order of run-out, what became of it and what it is."""
    share, open_ended, density = weights(store), censored(store).to_numpy(), densities(store)
    varied = [c for c in store.coords.values() if c.dims == ("run",) and "key" in c.attrs]
    return [
        {
            "run": int(run),
            "status": Status(int(store[STATUS.name][run])).plain_words,
            "computed": bool(known[run]),
            "censored": bool(open_ended[run]),
            "weight": float(share[run]),
            "density": float(density[run]),
            "reach": float(reach[run]) if np.isfinite(reach[run]) else None,
            "of": {str(c.name).replace("_", " "): _parameter(c, int(run)) for c in varied},
        }
        for run in order
    ]


def _parameter(values: xr.DataArray, run: int) -> str:
    value = values[run].item()
    return with_unit(number(value), str(values.attrs.get("units", "")))


def _periods(store: xr.Dataset, settings: Hazard) -> list[dict[str, Any]]:
    """Give the return periods with the runs of each and their weights within it."""
    return [
        {"words": each.words, "runs": each.runs.tolist(), "weights": each.weight.tolist()}
        for each in periods(store, settings.levels.return_periods)
    ]


def _thresholds(settings: Hazard, steps: dict[str, float]) -> dict[str, list[float]]:
    """Give the thresholds of the slider: those of the scenario, the edges of classes, and some between."""
    between = [step * 10.0**power for power in (-3, -2, -1, 0, 1) for step in (1, 1.5, 2, 3, 4, 5, 7.5)]
    found = {}
    for quantity, field in (("depth", "max_depth"), ("speed", "max_speed")):
        given = [*getattr(settings, quantity), *symbology.SCALES[quantity].edges, *between]
        step = steps[field]
        # whole numbers of steps: shares are then those of the values before they were rounded
        whole = {round(value / step) for value in given if abs(round(value / step) * step - value) < 1e-9}
        found[quantity] = [round(number * step, 9) for number in sorted(whole) if number > 0]
    return found


def _styles(
    found: xr.Dataset, steps: dict[str, float], whole: dict[str, NDArray[np.uint16]]
) -> dict[str, Any]:
    """Give the legends, the same as those of maps in files."""
    largest = {name: float(held[held < 65535].max(initial=0)) * steps[name] for name, held in whole.items()}
    made: dict[str, Style] = {
        "depth": symbology.of_values("depth", "m", largest["max_depth"]),
        "speed": symbology.of_values("speed", "m s-1", largest["max_speed"]),
        "time": symbology.of_values("time", "s", largest["arrival_time"]),
        "share": symbology.of_values("share", "1", 1.0),
    }
    return {
        name: {
            "caption": style.caption,
            "entries": [
                [each.lower, None if np.isinf(each.upper) else each.upper, each.colour, each.label]
                for each in style.entries
            ],
        }
        for name, style in made.items()
    }
