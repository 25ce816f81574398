"""Error of emulated numbers on the valley example, against thousands of runs.

``python -m pipeline.studies.emulation`` computes the runs, prints the tables of docs/emulation.md and draws
its pictures. ``--runs PLACE`` keeps the runs there, or takes those that are there; ``--to FOLDER`` gets
tables and pictures. 4,096 runs at 8 m and 1,024 at 4 m take about half an hour of processor time.

A block of n runs are n consecutive points of the Sobol sequence, which are even like the first ones.
"""

from __future__ import annotations

import argparse
from collections.abc import Iterator, Sequence
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd
import xarray as xr
import yaml
from matplotlib.figure import Figure
from numpy.typing import NDArray

import pipeline
from pipeline.emulation.calibrated import emulated_measures
from pipeline.emulation.sampled import Sampled
from pipeline.scenario.scenario import stored
from pipeline.store import run_table
from pipeline.store.variables import Status
from pipeline.store.zarr_store import open_store
from solver.emulator.exceedance import Exceedance, exceedance
from solver.emulator.fields import choose
from solver.emulator.outline import measures, moved
from solver.emulator.posterior import Measured

Array = NDArray[np.float64]
VALLEY = Path("scenarios/valley/valley.yaml")
# runs of the truth by spacing, m
TRUTH = {8.0: 4096, 4.0: 1024}
COUNTS = (32, 64, 128)
BLOCKS = 4
PAIRS = 16
MISSING = 8
THRESHOLDS = (0.25, 0.5, 1.0)
SHARES = (0.5, 0.95)
# where a probability is neither next to 0 nor to 1
OPEN = (0.01, 0.99)
DRAWS = 4096
# depth of a deposit, m, and runs that are taken as observed, a block
DEPOSIT, OBSERVED = 0.1, 40
FIELDS = ["max_depth", "max_speed", "arrival_time", "deposit_depth"]
WIDE, CLOSE = TRUTH


def name(spacing: float) -> str:
    """Name of the scenario of a truth."""
    return f"valley-{spacing:g}m"


def scenario(spacing: float, count: int) -> dict[str, Any]:
    """Give the valley on a spacing, with many Sobol draws."""
    content: dict[str, Any] = yaml.safe_load(VALLEY.read_text(encoding="utf-8"))
    content["name"], content["points"] = name(spacing), {"spacing": spacing}
    content["terrain"]["file"] = str((VALLEY.parent / content["terrain"]["file"]).resolve())
    content["output"]["fields"] = FIELDS
    content["sample"] |= {"design": "sobol", "count": count}
    return content


class Truth:
    """Many runs on one spacing, and blocks of them."""

    def __init__(self, place: Path, spacing: float) -> None:
        self.store = open_store(place / f"{name(spacing)}.zarr").load()
        self.settings = stored(self.store.attrs)

    def depth(self, rows: slice | NDArray[np.intp] = slice(None)) -> NDArray[np.float32]:
        """Largest depths of some runs, (runs, ny, nx)."""
        found: NDArray[np.float32] = self.store["max_depth"].to_numpy()[rows]
        return found

    def exceedance(self, threshold: float) -> Array:
        """Share of all runs above a threshold, (ny, nx)."""
        found: Array = (self.depth() > threshold).mean(axis=0)
        return found

    def runs(self, rows: NDArray[np.intp], finer: Truth | None = None, pairs: int = 0) -> Sampled:
        """Give a block of runs as if no others had been computed; with the first of it on a finer spacing."""
        stores = [self.store.isel(run=rows)]
        if finer is not None:
            stores.append(finer.store.isel(run=rows[:pairs]))
        return Sampled(self.settings, tuple(stores))


def emulated(runs: Sampled, thresholds: Sequence[float] = THRESHOLDS) -> dict[float, Exceedance]:
    """Emulate maps of thresholds, where the flow of the runs comes."""
    weight, draws = runs.weight(runs.usable[0]), runs.inputs.draws(DRAWS)
    chosen, _ = choose(runs.fields("max_depth"), thresholds, weight)
    return {
        threshold: exceedance(each.levels, each.level, draws, weight) for threshold, each in chosen.items()
    }


def cut(runs: Sampled, whole: Array, truth: xr.Dataset) -> Array:
    """Cut a map of the truth to what is emulated, as one row."""
    part = runs.ensembles[-1]
    rows = np.isin(truth["y"].to_numpy(), part["y"].to_numpy())
    columns = np.isin(truth["x"].to_numpy(), part["x"].to_numpy())
    return np.asarray(whole[np.ix_(rows, columns)].ravel())


def errors(
    runs: Sampled, truth: Truth, plain: NDArray[np.float32], what: str, two_levels: bool = False
) -> Iterator[dict[str, object]]:
    """Compare emulated maps and shares of runs with a truth, a row by threshold."""
    for threshold, found in emulated(runs).items():
        known = cut(runs, truth.exceedance(threshold), truth.store)
        some = (known > OPEN[0]) & (known < OPEN[1])
        error = np.abs(found.probability - known)[some]
        half = (found.total() if two_levels else found.sampling)[some]
        alone = 1.96 * np.sqrt(known * (1 - known) / len(runs.usable[0]))[some]
        row: dict[str, object] = {
            "what": what,
            "threshold": threshold,
            "rmse": float(np.sqrt(np.mean(error**2))),
            "coverage": float(np.mean(error <= half)),
            "interval": float(half.mean()),
            "interval_of_sampling": float(alone.mean()),
            "brier_ratio": found.score.ratio,
        }
        if plain.shape[1:] == truth.depth(slice(1)).shape[1:]:
            share = cut(runs, (plain > threshold).mean(axis=0), truth.store)
            row["rmse_of_share"] = float(np.sqrt(np.mean((share - known)[some] ** 2)))
        yield row


def blocks(count: int) -> Iterator[NDArray[np.intp]]:
    """Give some blocks of runs, far from each other in the sequence but within the smaller truth."""
    step = max(1, min(TRUTH.values()) // count // BLOCKS)
    for i in range(BLOCKS):
        yield np.arange(i * step * count, (i * step + 1) * count)


def maps(wide: Truth, close: Truth) -> Iterator[dict[str, object]]:
    """Compare maps of few runs, of runs without the largest, and of two spacings."""
    for count in COUNTS:
        for rows in blocks(count):
            yield from errors(wide.runs(rows), wide, wide.depth(rows), f"{count} runs at {WIDE:g} m")
    for rows in blocks(64):
        volume = wide.store["volume"].to_numpy()[rows]
        rest = np.sort(rows[np.argsort(volume)[:-MISSING]])
        words = f"64 runs at {WIDE:g} m, the {MISSING} largest failed"
        yield from errors(wide.runs(rest), wide, wide.depth(rest), words)
    for rows in blocks(64):
        runs, few = wide.runs(rows, close, PAIRS), close.depth(rows[:PAIRS])
        words = f"64 runs at {WIDE:g} m and {PAIRS} at {CLOSE:g} m"
        yield from errors(runs, close, few, words, two_levels=True)


def receptors(wide: Truth) -> Iterator[dict[str, object]]:
    """Compare the probability to reach receptors, with the threshold of the scenario and a larger one."""
    for rows in blocks(64):
        runs = wide.runs(rows)
        weight, draws = runs.weight(runs.usable[0]), runs.inputs.draws(4 * DRAWS)
        fields = runs.fields("max_depth")
        _, places = choose(fields, (0.1, 0.5), weight)
        whole = wide.runs(np.arange(wide.store.sizes["run"])).fields("max_depth")[0]
        flat = whole.values.reshape(len(whole.values), -1)
        for (place, threshold), each in places.items():
            known = float((flat[:, whole.places[place]].max(axis=1) > threshold).mean())
            found = exceedance(each.levels, each.level, draws, weight)
            here = fields[0].values.reshape(len(rows), -1)[:, fields[0].places[place]].max(axis=1)
            yield {
                "what": f"{place} above {threshold:g} m",
                "probability": known,
                "rmse": float(found.probability[0]) - known,
                "coverage": float(abs(found.probability[0] - known) <= found.sampling[0]),
                "interval": float(found.sampling[0]),
                "rmse_of_share": float((here > threshold).mean()) - known,
            }


def runouts(wide: Truth) -> Iterator[dict[str, object]]:
    """Compare quantiles of how far the flow came; of all runs, also those that crept on at their end."""
    from solver.emulator.scalars import fit_scalar, quantiles

    values = wide.store["flow_runout_distance"].to_numpy()
    known = np.quantile(values, SHARES)
    for rows in blocks(32):
        runs = wide.runs(rows)
        scalar = fit_scalar([runs.inputs.of(runs.stores[0])], [values[rows]], [])
        found = quantiles(scalar, SHARES, runs.inputs.draws(4 * DRAWS), runs.weight(runs.usable[0]))
        for i, share in enumerate(SHARES):
            yield {
                "what": f"run-out of the flow, {100 * share:g} %",
                "value": known[i],
                "rmse": found.values[i] - known[i],
                "coverage": float(abs(found.values[i] - known[i]) <= found.sampling[i]),
                "interval": found.sampling[i],
                "rmse_of_share": np.quantile(values[rows], share) - known[i],
            }


def calibrations(wide: Truth) -> Iterator[dict[str, object]]:
    """Count how often posteriors of 90 % hold the parameters of runs that are taken as observed."""
    y, x = wide.store["y"].to_numpy(), wide.store["x"].to_numpy()
    rest = np.flatnonzero((wide.store["status"] == Status.DONE).to_numpy())
    for rows in blocks(64):
        runs = wide.runs(rows)
        scalars, draws = emulated_measures(runs, DEPOSIT), runs.inputs.draws(4 * DRAWS)
        model, inputs = Measured(list(scalars.values()), draws), runs.inputs.of(wide.store)
        truths = np.random.default_rng(0).choice(np.setdiff1d(rest, rows), OBSERVED, replace=False)
        for truth in truths:
            seen = wide.store["deposit_depth"].to_numpy()[truth] > DEPOSIT
            for error in (0.0, WIDE):
                here, low, high = (measures(moved(seen, y, x, by)[None], y, x) for by in (0.0, -error, error))
                shift = [float(high[name][0] - low[name][0]) / 2 for name in scalars]
                found = model.posterior([float(here[name][0]) for name in scalars], shift)
                ends = [found.quantiles(draws.at[:, j], (0.05, 0.95)) for j in range(inputs.shape[1])]
                row: dict[str, object] = {"what": f"outline known to {error:g} m"}
                for name, (first, last), known in zip(runs.inputs.by_key, ends, inputs[truth], strict=True):
                    row[name.rpartition(".")[2]] = float(first <= known <= last)
                yield row | {"effective_draws": found.effective}


def over_blocks(rows: Iterator[dict[str, object]], by: list[str]) -> pd.DataFrame:
    """Put blocks together: root mean squares of errors, means of all else."""
    table = pd.DataFrame(rows)
    squares = [str(name) for name in table if str(name).startswith("rmse")]
    table[squares] = table[squares] ** 2
    found = table.groupby(by, sort=False).mean().reset_index()
    found[squares] = found[squares] ** 0.5
    return found


def draw(wide: Truth, close: Truth, path: Path, threshold: float = 0.5) -> None:
    """Draw the truth, the share of the runs, the emulated map and its error side by side."""
    rows = next(blocks(64))
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
        (f"truth: {TRUTH[spacing]:,} runs at {spacing:g} m", part, known, 1.0),
        (f"share of {len(plain)} runs at {spacing:g} m", part, share, 1.0),
        (f"emulated from {words}", part, found.probability, 1.0),
        (f"half width of its {named}", part, half, 0.12),
        ("its difference from the truth", part, np.abs(found.probability - known), 0.12),
    ]


def main() -> None:
    """Compute the runs, print the tables and draw the pictures."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--runs", type=Path, default=Path("results/emulation"))
    parser.add_argument("--to", type=Path, default=Path("docs/emulation"))
    given = parser.parse_args()
    pipeline.run([scenario(*each) for each in TRUTH.items()], given.runs)
    wide, close = (Truth(given.runs, spacing) for spacing in TRUTH)
    given.to.mkdir(parents=True, exist_ok=True)
    made = {
        "maps": over_blocks(maps(wide, close), ["what", "threshold"]),
        "receptors": over_blocks(receptors(wide), ["what"]),
        "runouts": over_blocks(runouts(wide), ["what"]),
        "calibrations": over_blocks(calibrations(wide), ["what"]),
    }
    for title, table in made.items():
        text = run_table.markdown(table)
        print(text)
        (given.to / f"{title}.md").write_text(text, encoding="utf-8")
    draw(wide, close, given.to / "maps.png")


if __name__ == "__main__":
    main()
