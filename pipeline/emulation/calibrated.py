"""Posterior of the sampled parameters by an observed deposit, over many emulated draws."""

from __future__ import annotations

import numpy as np
import pandas as pd
import xarray as xr
from numpy.typing import NDArray

from pipeline.assess.observed import Observed
from pipeline.assess.tables import behind
from pipeline.emulation.errors import NotEmulatedError
from pipeline.emulation.sampled import Sampled
from pipeline.hazard.discretisation import ONE_SPACING
from solver.emulator import support
from solver.emulator.extrapolation import inside
from solver.emulator.levels import Draws
from solver.emulator.outline import measures, moved
from solver.emulator.posterior import LEAST_EFFECTIVE, Measured, Posterior
from solver.emulator.scalars import Scalar, allowance, fit_scalar

Array = NDArray[np.float64]
Rows = NDArray[np.intp]
SHARES = (0.05, 0.5, 0.95)
ENDS = tuple(f"q{100 * share:02.0f}" for share in SHARES)
# over few measures a posterior says more than is known
LEAST_MEASURES = 2
# root mean square of deviations of the best draw, above which the model cannot give what was observed
WORST_FIT = 3.0


def posterior_table(
    runs: Sampled, observed: Observed, threshold: float, error: float | None, count: int
) -> pd.DataFrame:
    """Table quantiles of each sampled parameter before and after an observation.

    Runs that came to rest within the domain are measured: area, centre, spread, ends and width of their
    deposits. Each measure that leave-one-out supports is emulated, on the closest spacing where there are
    levels, and compared. What changes from the widest spacing to it is the ``_discretisation`` of each
    quantile. ``left_out`` says how many runs were overrun or cut off: the emulator gives what they would have
    left.

    Parameters
    ----------
    runs : Sampled
        Of a scenario.
    observed : Observed
        On the cells of the coarsest level.
    threshold : float
        Depth above which a cell is part of the deposit, m.
    error : float, optional
        Standard deviation of where the observed outline lies, m; by default the spacing.
    count : int
        Draws.

    Raises
    ------
    NotEmulatedError
        If too few measures are supported, too few draws agree with the observation, or none does.
    """
    store = runs.stores[0]
    y, x = store["y"].to_numpy(), store["x"].to_numpy()
    seen = observed.covered.reshape(len(y), len(x))
    width = runs.spacings[0] if error is None else error
    here, low, high = (measures(moved(seen, y, x, by)[None], y, x) for by in (0.0, -width, width))
    scalars = {
        name: scalar
        for name, scalar in emulated_measures(runs, threshold).items()
        # an outline that ends when it is moved inward has no measures
        if np.isfinite(low[name][0]) and not (scalar.logarithm and here[name][0] <= 0)
    }
    if len(scalars) < LEAST_MEASURES:
        raise NotEmulatedError(
            f"expected {LEAST_MEASURES} measures that leave-one-out supports, found {len(scalars)}"
        )
    values = [float(here[name][0]) for name in scalars]
    shifts = [float(high[name][0] - low[name][0]) / 2 for name in scalars]
    used = list(scalars)
    drawn = runs.inputs.draws(count)
    found = Measured(list(scalars.values()), drawn).posterior(values, shifts)
    if found.misfit > WORST_FIT:
        raise NotEmulatedError(
            f"the best of {count:,} draws is {found.misfit:.1f} deviations from the observation"
        )
    if found.effective < LEAST_EFFECTIVE:
        raise NotEmulatedError(
            f"{found.effective:.0f} effective draws agree with the observation, fewer than {LEAST_EFFECTIVE}"
        )
    coarse = None
    if any(len(each.levels.parts) > 1 for each in scalars.values()):
        coarse = Measured([each.coarsest() for each in scalars.values()], drawn).posterior(values, shifts)
    return pd.DataFrame(_rows(runs, drawn, found, coarse, used))


def emulated_measures(runs: Sampled, threshold: float) -> dict[str, Scalar]:
    """Fit an emulator to each measure of deposits that leave-one-out supports, by its name.

    Raises
    ------
    NotEmulatedError
        If too few runs came to rest.
    """
    rows = [_settled(runs, level) for level in range(len(runs.stores))]
    inputs = [runs.inputs.of(store)[some] for store, some in zip(runs.stores, rows, strict=True)]
    if few := support.of_runs(len(rows[0]), inputs[0].shape[1]):
        raise NotEmulatedError(f"{few} that came to rest within the domain")
    if alike := support.of_places(inputs[0]):
        raise NotEmulatedError(f"{alike}, of those that came to rest")
    for level in range(1, len(rows)):
        before = runs.root_rows(level - 1, rows[level - 1])
        known = np.isin(runs.root_rows(level, rows[level]), before)
        rows[level], inputs[level] = rows[level][known], inputs[level][known]
    while len(rows) > 1 and not support.of_pairs(len(rows[-1]))[0]:
        rows.pop()
    held = [_measured(store, some, threshold) for store, some in zip(runs.stores, rows, strict=False)]
    found = {}
    for name, first in held[0].items():
        values = [each[name] for each in held]
        # what does not vary but for round-off says nothing
        if np.isnan(first).any() or np.ptp(first) < 1e-9 * max(1.0, float(np.abs(first).max())):
            continue
        if any(np.isnan(each).any() for each in values):
            continue
        scalar = fit_scalar(inputs[: len(rows)], values, runs.pairs(rows))
        if not support.of_scalar(scalar.score).refused:
            found[name] = scalar
    return found


def _settled(runs: Sampled, level: int) -> Rows:
    """Give the runs of the sample that are computed on a level and came to rest there within the domain."""
    rows = runs.usable[level][~runs.unsettled[level]]
    settled: Rows = rows[rows < runs.stores[level].sizes["run"]]
    return settled


def _left_out(runs: Sampled) -> str:
    """Say how many runs of the sample have no deposit to be measured; empty where all have one."""
    usable = runs.usable[0][runs.usable[0] < runs.counted]
    some = _settled(runs, 0)
    unsettled = np.setdiff1d(usable, some)
    if not unsettled.size:
        return ""
    places = runs.at(0)
    beyond = int((~inside(places[unsettled], places[some])).sum())
    told = f"{unsettled.size} of {usable.size} computed runs were overrun or cut off"
    return f"{told}; the emulator stands for them" + (f", {beyond} of them extrapolated" if beyond else "")


def _measured(store: xr.Dataset, rows: Rows, threshold: float) -> dict[str, Array]:
    deposits = store["deposit_depth"].isel(run=rows).transpose("run", "y", "x").to_numpy() > threshold
    return measures(deposits, store["y"].to_numpy(), store["x"].to_numpy())


def _rows(
    runs: Sampled, drawn: Draws, found: Posterior, coarse: Posterior | None, used: list[str]
) -> list[dict[str, object]]:
    """Table each parameter; coarse : posterior by the widest spacing alone, where there are several."""
    store, rows, column = runs.stores[0], list[dict[str, object]](), 0
    names = {str(c.attrs["key"]): str(name) for name, c in store.coords.items() if "key" in c.attrs}
    told = runs.told_of_spacing if coarse is not None else ONE_SPACING
    for key, each in runs.inputs.by_key.items():
        width = each.columns
        if width == 1 and not each.words:
            values = each.back(drawn.at[:, column])
            row: dict[str, object] = {**behind(store), "parameter": names[key]}
            after = found.quantiles(values, SHARES)
            prior = Posterior(drawn.share, 0.0).quantiles(values, SHARES)
            for when, part in (("prior", prior), ("posterior", after)):
                row |= {f"{when}_{end}": float(q) for end, q in zip(ENDS, part, strict=True)}
            before = after if coarse is None else coarse.quantiles(values, SHARES)
            error = allowance(after - before, 1 if coarse is None else 2)
            row |= {f"posterior_{end}_discretisation": float(q) for end, q in zip(ENDS, error, strict=True)}
            said = {"effective_draws": found.effective, "measures": ", ".join(used), "spacing": told}
            said["left_out"] = _left_out(runs)
            rows.append(row | said)
        column += width
    return rows
