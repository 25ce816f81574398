"""From two commands to maps: processor time and error of plain runs and of emulated ones.

The valley is done as a user does it, by ``pipeline run`` and then ``pipeline hazard`` or ``pipeline
emulate``, with seeds that the truth has not.
"""

from __future__ import annotations

import json
import resource
import shutil
import subprocess
import sys
from collections.abc import Iterator, Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd
import xarray as xr
import yaml

from pipeline.emulation.emulate import FILE as EMULATED_FILE
from pipeline.hazard.netcdf import FILE as HAZARD_FILE
from pipeline.studies.emulation.cases import VALLEY, with_absolute_files
from pipeline.studies.emulation.pictures import CLOSE, FINE, SHIPPED_PAIRS, THRESHOLDS, WIDE
from pipeline.studies.emulation.truth import Truth
from pipeline.studies.emulation.valley import OPEN, SHIPPED, over_blocks
from solver.emulator.scores import TWO_SIDED

SEEDS = (101, 102)
LEVELS_FILE = VALLEY.file.with_name("levels.yaml")
# runs that it does on the wide and on the close spacing
LEVELS_COUNTS = 64, SHIPPED_PAIRS


@dataclass(frozen=True)
class Way:
    """A way to maps.

    Parameters
    ----------
    name : str
        Of its folder.
    words : str
        What it is called in tables.
    file : Path
        Scenario.
    command : str
        That makes the maps, ``hazard`` or ``emulate``.
    sample : mapping
        Keys of the section that are changed.
    """

    name: str
    words: str
    file: Path
    command: str
    sample: Mapping[str, Any] = field(default_factory=dict)

    def scenario(self, seed: int) -> dict[str, Any]:
        """Give the scenario with a seed."""
        content: dict[str, Any] = yaml.safe_load(self.file.read_text(encoding="utf-8"))
        content = with_absolute_files(content, self.file.parent)
        content["sample"] = content["sample"] | dict(self.sample) | {"seed": seed}
        return content


SOBOL = {"design": "sobol", "count": 64}
WAYS = (
    Way("plain", f"{SHIPPED} runs at {CLOSE:g} m", VALLEY.file, "hazard"),
    Way(
        "levels",
        f"{LEVELS_COUNTS[0]} at {WIDE:g} m, {LEVELS_COUNTS[1]} at {CLOSE:g} m, emulated",
        LEVELS_FILE,
        "emulate",
    ),
    Way("alone", f"64 at {CLOSE:g} m, emulated", VALLEY.file, "emulate", sample=SOBOL),
)


def commands(place: Path, code: str, close: Truth, fine: Truth) -> Iterator[dict[str, object]]:
    """Compare the maps of each way with the truth on two spacings, a row by seed and threshold.

    Parameters
    ----------
    place : Path
        Folder for the runs of the ways. A seed of a way that is there, and was made by the same code, is not
        done again.
    code : str
        What the code is known by.
    close, fine : Truth
        On the closer spacing and on the finest one.
    """
    for way in WAYS:
        for seed in SEEDS:
            folder = place / f"{way.name}-{seed}"
            cost = done(way, seed, folder, code)
            for threshold in THRESHOLDS:
                row = {"what": way.words, "threshold": threshold, **cost}
                found = maps_of(way, folder, threshold)
                if found is None:
                    continue
                for spacing, truth in ((CLOSE, close), (FINE, fine)):
                    row |= compared(found, truth, threshold, f"{spacing:g}m", plain=way.command == "hazard")
                yield row


def done(way: Way, seed: int, folder: Path, code: str) -> dict[str, float]:
    """Do the two commands of a way and give their processor time, s; what is done already is read."""
    kept = folder / "cost.json"
    if kept.exists():
        held = json.loads(kept.read_text(encoding="utf-8"))
        if held.pop("code") == code:
            return {name: float(value) for name, value in held.items()}
    folder.mkdir(parents=True, exist_ok=True)
    file, out = folder / "scenario.yaml", folder / "results"
    file.write_text(yaml.safe_dump(way.scenario(seed), sort_keys=False), encoding="utf-8")
    # runs that are there already, of an attempt that was cut off or of other code, would cost nothing
    shutil.rmtree(out, ignore_errors=True)
    cost = {
        "seconds_of_runs": processor_time(["run", str(file), "--out", str(out)]),
        "seconds_of_maps": processor_time([way.command, str(out)]),
    }
    kept.write_text(json.dumps({**cost, "code": code}), encoding="utf-8")
    return cost


def processor_time(given: list[str]) -> float:
    """Do a command in a process of its own and give the processor time of it and its workers, s."""
    before = _of_children()
    subprocess.run([sys.executable, "-m", "pipeline", *given], stdout=subprocess.DEVNULL, check=True)
    return _of_children() - before


def _of_children() -> float:
    used = resource.getrusage(resource.RUSAGE_CHILDREN)
    return used.ru_utime + used.ru_stime


def maps_of(way: Way, folder: Path, threshold: float) -> xr.Dataset | None:
    """Give probability and error of a threshold as the command wrote them; None where it was refused."""
    name = yaml.safe_load((folder / "scenario.yaml").read_text(encoding="utf-8"))["name"]
    plain = way.command == "hazard"
    path = folder / "results" / ("hazard" if plain else "emulated") / name
    with xr.open_dataset(path / (HAZARD_FILE if plain else EMULATED_FILE)) as held:
        values = held["depth_exceedance" if plain else "depth_emulated"]
        if threshold not in held["depth_threshold"]:
            return None
        found = {"probability": values.sel(depth_threshold=threshold, drop=True)}
        if not plain:
            found["error"] = held["depth_emulated_error"].sel(depth_threshold=threshold, drop=True)
        return xr.Dataset(found).load()


def compared(found: xr.Dataset, truth: Truth, threshold: float, ending: str, plain: bool) -> dict[str, float]:
    """Compare a map with the truth at the points of both, where it is neither next to 0 nor to 1.

    A plain share has no error of sampling of its own. That of independent draws is taken for it.
    """
    whole = xr.DataArray(
        truth.exceedance(threshold),
        dims=("y", "x"),
        coords={a: truth.store[a].to_numpy() for a in ("y", "x")},
    )
    axes = {a: np.intersect1d(whole[a].to_numpy(), found[a].to_numpy()) for a in ("y", "x")}
    known = whole.sel(axes).to_numpy()
    at = {name: values.transpose("y", "x").sel(axes).to_numpy() for name, values in found.items()}
    some = (known > OPEN[0]) & (known < OPEN[1])
    off = (at["probability"] - known)[some]
    half = TWO_SIDED * np.sqrt(known * (1 - known) / SHIPPED)[some] if plain else at["error"][some]
    return {
        f"rmse_{ending}": float(np.sqrt(np.mean(off**2))),
        f"coverage_{ending}": float(np.mean(np.abs(off) <= half)),
        f"interval_{ending}": float(np.mean(half)),
        f"rmse_{ending}_independent": float(np.sqrt(np.mean(known * (1 - known) / SHIPPED, where=some))),
    }


def error_of_truth(truth: Truth, threshold: float) -> float:
    """Give half the root mean square difference of the halves of the truth, where it is neither 0 nor 1."""
    depth, known = truth.depth(), truth.exceedance(threshold)
    halves = [(part > threshold).mean(axis=0) for part in np.array_split(depth, 2)]
    some = (known > OPEN[0]) & (known < OPEN[1])
    return float(np.sqrt(np.mean((halves[0] - halves[1])[some] ** 2))) / 2


def together(rows: Iterator[dict[str, object]]) -> pd.DataFrame:
    """Put the seeds together, and give time and error of each way over those of the first, plain one."""
    found = over_blocks(rows, ["what", "threshold"])
    found["seconds"] = found["seconds_of_runs"] + found["seconds_of_maps"]
    plain = found[found["what"] == WAYS[0].words].set_index("threshold")
    for name in ("seconds", *(f"rmse_{spacing:g}m" for spacing in (CLOSE, FINE))):
        found[f"{name}_over_plain"] = found[name] / found["threshold"].map(plain[name])
    # of as many runs as are shipped, drawn by themselves: the measure that the first trial had
    name = f"rmse_{CLOSE:g}m"
    found[f"{name}_over_independent"] = found[name] / found[f"{name}_independent"]
    return found.drop(columns=[f"rmse_{spacing:g}m_independent" for spacing in (CLOSE, FINE)])
