"""Emulated maps of the valley beside the truth, and pictures of them."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

import numpy as np
import xarray as xr
from matplotlib.figure import Figure
from numpy.typing import NDArray

from pipeline.emulation.sampled import Sampled
from pipeline.emulation.thresholds import exceedance_of
from pipeline.studies.emulation.cases import VALLEY
from pipeline.studies.emulation.truth import Truth, blocks
from solver.emulator.exceedance import Exceedance
from solver.emulator.fields import choose

Array = NDArray[np.float64]
THRESHOLDS = (0.25, 0.5, 1.0)
# runs on the closer spacing, as many as the shipped levels have there, and on the finest one
PAIRS, SHIPPED_PAIRS, FINE_PAIRS = 16, 40, 4
DRAWS = 4096
WIDE, CLOSE, FINE = VALLEY.truth


def emulated(runs: Sampled, thresholds: Sequence[float] = THRESHOLDS) -> dict[float, Exceedance]:
    """Emulate maps of thresholds, where the flow of the runs comes."""
    draws = runs.inputs.draws(DRAWS)
    chosen, _ = choose(runs.fields("max_depth"), thresholds, runs.judged(runs.usable[0]))
    return {threshold: exceedance_of(runs, each, draws, mapped=True) for threshold, each in chosen.items()}


def cut(runs: Sampled, whole: Array, truth: xr.Dataset) -> Array:
    """Cut a map of the truth to what is emulated, as one row."""
    part = runs.ensembles[-1]
    rows = np.isin(truth["y"].to_numpy(), part["y"].to_numpy())
    columns = np.isin(truth["x"].to_numpy(), part["x"].to_numpy())
    return np.asarray(whole[np.ix_(rows, columns)].ravel())


def draw(wide: Truth, close: Truth, path: Path, threshold: float = 0.5) -> None:
    """Draw the truth, the share of the runs, the emulated map and its error side by side."""
    rows = next(blocks(64, VALLEY.truth[CLOSE]))
    columns = [
        _panels(wide.runs(rows), wide, wide.depth(rows), WIDE, f"64 runs at {WIDE:g} m", threshold),
        _panels(
            wide.runs(rows, close, PAIRS), close, close.depth(rows[:PAIRS]), CLOSE,
            f"64 at {WIDE:g} m, {PAIRS} at {CLOSE:g} m", threshold,
        ),
    ]  # fmt: skip
    figure = Figure(figsize=(11, 9), layout="constrained", dpi=130)
    for panels, column in zip(figure.subplots(5, 2).T, columns, strict=True):
        for panel, (title, grid, values, largest) in zip(panels, column, strict=True):
            shape = grid.sizes["y"], grid.sizes["x"]
            colours = "YlGnBu" if largest == 1 else "magma_r"
            mesh = panel.pcolormesh(
                grid["x"], grid["y"], values.reshape(shape), vmin=0, vmax=largest,
                cmap=colours, shading="nearest",
            )  # fmt: skip
            panel.set_aspect("equal")
            panel.set_title(title, fontsize="small", loc="left")
            figure.colorbar(mesh, ax=panel, shrink=0.9)
    figure.suptitle(f"share of events deeper than {threshold:g} m; along and across the bed in m")
    figure.savefig(path)


Panel = tuple[str, xr.Dataset, Array, float]


def _panels(
    runs: Sampled, truth: Truth, plain: NDArray[np.float32], spacing: float, words: str, threshold: float
) -> list[Panel]:
    """Give title, lattice, values and largest shown value of the pictures of one column."""
    found, part = emulated(runs, [threshold])[threshold], runs.ensembles[-1]
    known = cut(runs, truth.exceedance(threshold), truth.store)
    share = cut(runs, (plain > threshold).mean(axis=0), truth.store)
    half, named = (found.sampling, "95 % interval") if found.levels == 1 else (found.total(), "total error")
    return [
        (f"truth: {VALLEY.truth[spacing]:,} runs at {spacing:g} m", part, known, 1.0),
        (f"share of {len(plain)} runs at {spacing:g} m", part, share, 1.0),
        (f"emulated from {words}", part, found.probability, 1.0),
        (f"half width of its {named}", part, half, 0.12),
        ("its difference from the truth", part, np.abs(found.probability - known), 0.12),
    ]
