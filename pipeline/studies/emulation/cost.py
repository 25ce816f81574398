"""Processor time and error of two commands on two spacings, beside the runs of the closer one alone."""

from __future__ import annotations

import os
import subprocess
import sys
import tempfile
from collections.abc import Iterator, Sequence
from pathlib import Path

import numpy as np
import pandas as pd
import xarray as xr
from numpy.typing import NDArray

from pipeline.emulation.emulate import FILE
from pipeline.studies.emulation.cases import VALLEY
from pipeline.studies.emulation.pictures import CLOSE, THRESHOLDS
from pipeline.studies.emulation.truth import Truth
from pipeline.studies.emulation.valley import OPEN

Array = NDArray[np.float64]
NAME = "cost"
FOLDER = VALLEY.file.parent
ALONE, LEVELS = "valley", "valley-levels"


def seconds(*arguments: str) -> float:
    """Do a command of the pipeline and give the processor time of it and of its workers, s."""
    before = os.times()
    subprocess.run([sys.executable, "-m", "pipeline", *arguments], check=True, stdout=subprocess.DEVNULL)
    after = os.times()
    return after.children_user + after.children_system - before.children_user - before.children_system


def tables(place: Path) -> Iterator[tuple[str, pd.DataFrame]]:
    """Table processor time and error of maps, against the truth on the closer spacing."""
    truth = Truth(place, VALLEY.named(CLOSE))
    yield NAME, pd.DataFrame(compared(truth, THRESHOLDS))


def compared(truth: Truth, thresholds: Sequence[float]) -> Iterator[dict[str, object]]:
    """Do both ways one after the other, a row each."""
    with tempfile.TemporaryDirectory() as folder:
        alone, levels = Path(folder, "alone"), Path(folder, "levels")
        # what is compiled is compiled before either is timed
        seconds("run", str(FOLDER / "levels.yaml"), "--out", str(Path(folder, "first")), "--workers", "1")
        took = seconds("run", str(FOLDER / "valley.yaml"), "--out", str(alone), "--workers", "1")
        mapped = seconds("hazard", str(alone), "--to", str(alone / "maps"))
        runs = Truth(alone, ALONE)
        shares = {threshold: runs.exceedance(threshold) for threshold in thresholds}
        known = {threshold: truth.exceedance(threshold) for threshold in thresholds}
        words = f"{len(runs.depth())} runs at {CLOSE:g} m, shares and their maps"
        yield {"what": words, "run_s": took, "maps_s": mapped, **_errors(shares, known)}
        took = seconds("run", str(FOLDER / "levels.yaml"), "--out", str(levels), "--workers", "1")
        mapped = seconds("emulate", str(levels), "--to", str(levels / "emulated"))
        with xr.open_dataset(next(levels.rglob(FILE))) as found:
            emulated = {each: _of(found, "depth_emulated", each) for each in thresholds}
            half = {each: _of(found, "depth_emulated_error", each) for each in thresholds}
        words = "64 runs at 8 m and 16 at 4 m, emulated"
        yield {"what": words, "run_s": took, "maps_s": mapped, **_errors(emulated, known, half)}


def _of(found: xr.Dataset, name: str, threshold: float) -> Array:
    held = found[name].sel(depth_threshold=threshold, method="nearest").transpose("y", "x")
    return np.asarray(held.to_numpy(), np.float64)


def _errors(
    found: dict[float, Array], known: dict[float, Array], half: dict[float, Array] | None = None
) -> dict[str, float]:
    """Root mean square errors, and what part of the differences is within the stated error."""
    row: dict[str, float] = {}
    within: list[float] = []
    for threshold, truth in known.items():
        some = (truth > OPEN[0]) & (truth < OPEN[1])
        error = np.abs(found[threshold] - truth)[some]
        row[f"rmse_{threshold:g}_m"] = float(np.sqrt(np.mean(error**2)))
        if half is not None:
            within.append(float(np.mean(error <= half[threshold][some])))
    return row | {"coverage": float(np.mean(within)) if within else float("nan")}
