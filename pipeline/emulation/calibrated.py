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
from pipeline.store.variables import STATUS, Status
from solver.emulator import support
from solver.emulator.outline import measures, moved
from solver.emulator.posterior import LEAST_EFFECTIVE, Measured, Posterior
from solver.emulator.scalars import Scalar, fit_scalar

Array = NDArray[np.float64]
SHARES = (0.05, 0.5, 0.95)
# over few measures a posterior says more than is known
LEAST_MEASURES = 2
# root mean square of deviations of the best draw, above which the model cannot give what was observed
WORST_FIT = 3.0


def posterior_table(
    runs: Sampled, observed: Observed, threshold: float, error: float | None, count: int
) -> pd.DataFrame:
    """Table quantiles of each sampled parameter before and after an observation.

    Runs of the coarsest level that came to rest are measured: area, centre, spread, ends and width of their
    deposits. Each measure that leave-one-out supports is emulated and compared.

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
    return pd.DataFrame(_rows(runs, store, drawn.at, drawn.share, found.share, used, found.effective))


def emulated_measures(runs: Sampled, threshold: float) -> dict[str, Scalar]:
    """Fit an emulator to each measure of deposits that leave-one-out supports, by its name.

    Raises
    ------
    NotEmulatedError
        If too few runs came to rest.
    """
    store = runs.stores[0]
    states = [Status(int(state)) for state in store[STATUS.name].to_numpy()]
    rows = np.array(
        [row for row in runs.usable[0][runs.usable[0] < runs.counted] if not states[row].is_cut_off], np.intp
    )
    inputs = runs.inputs.of(store)
    if few := support.of_runs(len(rows), inputs.shape[1]):
        raise NotEmulatedError(f"{few} that came to rest")
    if alike := support.of_places(inputs[rows]):
        raise NotEmulatedError(f"{alike}, of those that came to rest")
    deposits = store["deposit_depth"].isel(run=rows).transpose("run", "y", "x").to_numpy() > threshold
    found = {}
    for name, values in measures(deposits, store["y"].to_numpy(), store["x"].to_numpy()).items():
        # what does not vary but for round-off says nothing
        if np.isnan(values).any() or np.ptp(values) < 1e-9 * max(1.0, float(np.abs(values).max())):
            continue
        scalar = fit_scalar([inputs[rows]], [values], [])
        if not support.of_scalar(scalar.score).refused:
            found[name] = scalar
    return found


def _rows(
    runs: Sampled,
    store: xr.Dataset,
    at: Array,
    before: Array,
    after: Array,
    used: list[str],
    effective: float,
) -> list[dict[str, object]]:
    rows: list[dict[str, object]] = []
    column = 0
    names = {str(c.attrs["key"]): str(name) for name, c in store.coords.items() if "key" in c.attrs}
    for key, each in runs.inputs.by_key.items():
        width = each.columns
        if width == 1 and not each.words:
            values = each.back(at[:, column])
            row: dict[str, object] = {**behind(store), "parameter": names[key]}
            for when, share in (("prior", before), ("posterior", after)):
                found = Posterior(share, 0.0).quantiles(values, SHARES)
                row |= {f"{when}_q{100 * s:02.0f}": float(q) for s, q in zip(SHARES, found, strict=True)}
            rows.append(row | {"effective_draws": effective, "measures": ", ".join(used)})
        column += width
    return rows
