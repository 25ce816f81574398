"""Runs scored by an observed deposit, and what they say of the parameters."""

from __future__ import annotations

import numpy as np
import pandas as pd
import xarray as xr
from numpy.typing import NDArray

from pipeline.assess.ensemble import censored, computed, weights
from pipeline.assess.frames import cell_area, on_surface, space
from pipeline.assess.observed import ObservationError, Observed
from pipeline.assess.probability import Values
from pipeline.assess.receptors import Cells
from pipeline.assess.sensitivity import varied
from pipeline.assess.tables import behind
from pipeline.store.variables import STATUS, Status

Array = NDArray[np.float64]
SHARES = (0.05, 0.5, 0.95)


def score(store: xr.Dataset, observed: Observed, threshold: float) -> pd.DataFrame:
    """Score every run of a store.

    Parameters
    ----------
    store : Dataset
        With the field ``deposit_depth``.
    observed : Observed
        On the cells of the store.
    threshold : float
        Depth above which a cell is part of the deposit, m.

    Returns
    -------
    DataFrame
        A row a run, the best first: ``scenario``, ``run``, ``status``, the varied parameters,
        ``critical_success_index`` (area of both deposits over that of either), ``hit_rate``,
        ``false_alarm_ratio``, ``runout_misfit`` (horizontal distance from the observed toe on, m; on an
        elevation model that between the lowest cells of both, positive where the run's lies lower), and with
        observed depths ``volume_misfit`` (relative to the observed volume) and ``depth_rmse`` (m, over the
        area of either). Runs that were not computed are there, without a score.

    Raises
    ------
    ObservationError
        If the store lacks the deposit.
    """
    title = str(store.attrs["title"])
    if "deposit_depth" not in store:
        raise ObservationError(f"{title}: expected deposit_depth, which output.fields leaves out")
    over = space(store)
    sizes = [store.sizes[d] for d in over]
    areas = _by_run(xr.broadcast(cell_area(store), store["x"], store["y"])[0], store)
    if on_surface(store):
        ahead = _by_run(-store["elevation"], store)
        places = Cells(store).points
    else:
        ahead = _by_run(xr.broadcast(store["horizontal_distance"], store["y"])[0], store)
        places = None
    deposits = _by_run(store["deposit_depth"], store)
    states, known = store[STATUS.name].to_numpy(), computed(store).to_numpy()
    parameters = varied(store)
    rows = []
    for run, state in enumerate(states):
        row: dict[str, object] = {"scenario": title, "run": run, "status": Status(state).words}
        row |= {name: held[run] for name, held in parameters.items()}
        rows.append(row)
        if not known[run]:
            continue
        deposit = deposits.isel(run=run).to_numpy().astype(np.float64).ravel()
        farther = np.broadcast_to(ahead.isel(run=run).to_numpy(), sizes).ravel()
        area = np.broadcast_to(areas.isel(run=run).to_numpy(), sizes).ravel()
        misfit = _misfit(deposit > threshold, observed.covered, farther, places)
        row |= _scores(deposit, area, observed, threshold, misfit)
    table = pd.DataFrame(rows)
    if "critical_success_index" not in table:
        raise ObservationError(f"{title}: no run was computed")
    return table.sort_values("critical_success_index", ascending=False, ignore_index=True)


def _by_run(field: xr.DataArray, store: xr.Dataset) -> xr.DataArray:
    """Give a field with the dimension ``run`` first and those of the points in their order."""
    whole = field if "run" in field.dims else field.expand_dims(run=store.sizes["run"])
    return whole.transpose("run", *space(store))


def _misfit(made: NDArray[np.bool_], seen: NDArray[np.bool_], ahead: Array, places: Array | None) -> float:
    """Horizontal distance from the observed toe to that of a run, m, positive beyond it; NaN without one.

    Parameters
    ----------
    made, seen : array
        Whether each cell is part of the deposit of the run, and of the observed one, (cells,).
    ahead : array
        Horizontal distance of each cell along the profile, or how low it lies on an elevation model, m.
    places : array or None
        Eastings and northings on an elevation model, (cells, 2), m.
    """
    if not made.any():
        return float("nan")
    known = np.where(np.isfinite(ahead), ahead, -np.inf)
    toe, observed = (int(np.where(cells, known, -np.inf).argmax()) for cells in (made, seen))
    if places is None:
        return float(ahead[toe] - ahead[observed])
    farther = float(known[toe] - known[observed])
    return float(np.sign(farther) * np.hypot(*(places[toe] - places[observed])))


def _scores(
    deposit: Array, area: Array, observed: Observed, threshold: float, misfit: float
) -> dict[str, float]:
    covered = deposit > threshold
    sets = (covered & observed.covered, covered | observed.covered, observed.covered, covered)
    both, either, seen, made = (float(area[cells].sum()) for cells in sets)
    scores = {
        "critical_success_index": both / either,
        "hit_rate": both / seen,
        "false_alarm_ratio": 1 - both / made if made else 0.0,
        "runout_misfit": misfit,
    }
    if observed.depth is not None:
        # films below the threshold are no part of either deposit
        seen_depth = np.where(observed.covered, observed.depth, 0.0)
        deposit = np.where(covered, deposit, 0.0)
        square = ((deposit - seen_depth) ** 2 * area)[covered | observed.covered].sum() / either
        scores |= {
            "volume_misfit": float((deposit * area).sum()) / float((seen_depth * area).sum()) - 1,
            "depth_rmse": float(np.sqrt(square)),
        }
    return scores


def posterior(store: xr.Dataset, scores: pd.DataFrame, accepted: float) -> pd.DataFrame:
    """Table ranges of the parameters before and after the observation.

    The runs with the best critical success index are accepted, each weighted by its index and its weight in
    the scenario (generalised likelihood uncertainty estimation).

    Parameters
    ----------
    store : Dataset
        The scenario's store.
    scores : DataFrame
        As ``score`` gives them.
    accepted : float
        Share of the computed runs that is accepted.

    Returns
    -------
    DataFrame
        A row for each numeric parameter: its value in the best run, its 5, 50 and 95 % quantiles over all
        runs (``prior_``) and over accepted ones (``posterior_``), and the runs behind it: how many are
        accepted, and of these overrun or cut off, whose deposits are not those of rest.

    References
    ----------
    Beven & Binley 1992, The future of distributed models, https://doi.org/10.1002/hyp.3360060305
    """
    known = scores.dropna(subset=["critical_success_index"])
    best = known.head(max(1, round(accepted * len(known))))
    runs = best["run"].to_numpy()
    weight = weights(store)
    likelihood = weight[runs] * best["critical_success_index"].to_numpy()
    if not likelihood.sum():
        misfit = known["runout_misfit"].dropna()
        why = "no run has a deposit above the threshold"
        if len(misfit):
            reach = f"{misfit.min():.4g} to {misfit.max():.4g} m from its own"
            why = f"their toes lie {reach}, positive beyond it; check where it lies, and the friction"
        raise ObservationError(f"{store.attrs['title']}: no run overlaps the observed deposit: {why}")
    unsettled = int(censored(store).to_numpy()[runs].sum())
    rows = []
    for name, held in varied(store).items():
        if held.dtype.kind not in "fiu":
            continue
        row: dict[str, object] = {**behind(store), "runs_accepted": len(best)}
        row |= {"runs_accepted_overrun_or_cut_off": unsettled, "parameter": name}
        row["best_run"] = held[runs[0]]
        for when, chosen, share in (
            ("prior", held, weight),
            ("posterior", held[runs], likelihood / likelihood.sum()),
        ):
            nothing = np.zeros(len(chosen), bool)
            found = Values(chosen.astype(np.float64), share, nothing, nothing).quantile(SHARES).estimate
            row |= {f"{when}_q{100 * s:02.0f}": float(q) for s, q in zip(SHARES, found, strict=True)}
        rows.append(row)
    return pd.DataFrame(rows)
