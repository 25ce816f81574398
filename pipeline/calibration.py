"""Runs scored by an observed deposit, and what they say of the parameters."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

import numpy as np
import pandas as pd
import xarray as xr
from matplotlib.path import Path as Outline
from numpy.typing import NDArray
from scipy.spatial import KDTree

from pipeline.assessment import behind, values
from pipeline.frames import cell_area, space
from pipeline.receptors import Cells
from pipeline.sensitivity import varied
from pipeline.statistics import Values
from pipeline.variables import STATUS, Status

Array = NDArray[np.float64]
SHARES = (0.05, 0.5, 0.95)


class ObservationError(Exception):
    """An observed deposit cannot be used; ``str()`` says why."""


@dataclass(frozen=True)
class Observed:
    """An observed deposit on the cells of a store.

    covered : (cells,) whether each is part of it. depth : (cells,) its depth, m; None where only the outline
    is known.
    """

    covered: NDArray[np.bool_]
    depth: Array | None


def read(path: Path, store: xr.Dataset, threshold: float) -> Observed:
    """Read an observed deposit in the coordinates of the bed.

    Parameters
    ----------
    path : Path
        CSV with the columns x and y, the corners of an outline in order; or with x, y and depth, or NetCDF
        with a variable ``depth`` over x and y: a survey on places, of which each cell takes the mean of those
        within it. Lengths in m.
    store : Dataset
        The store whose cells it is brought on.
    threshold : float
        Depth above which a cell is part of the deposit, m.

    Raises
    ------
    ObservationError
        If the file is none of these, or no cell is part of the deposit.
    OSError
        If it cannot be read.
    """
    cells = Cells(store)
    table = _table(path)
    if not np.isfinite(table.to_numpy(np.float64)).all():
        raise ObservationError(f"{path}: expected finite numbers in all rows")
    places = table[["x", "y"]].to_numpy(np.float64)
    if "depth" in table:
        depth = _means(cells, places, table["depth"].to_numpy(np.float64))
        covered = depth > threshold
    else:
        if len(places) < 3:
            raise ObservationError(f"{path}: expected 3 or more corners of an outline, found {len(places)}")
        depth, covered = None, Outline(np.vstack([places, places[:1]])).contains_points(cells.points)
    if not covered.any():
        raise ObservationError(f"{path}: no cell of {store.attrs['title']} is part of the deposit")
    return Observed(covered, depth)


def _table(path: Path) -> pd.DataFrame:
    """Give the places of a file as the columns x, y and perhaps depth."""
    try:
        if path.suffix == ".nc":
            with xr.open_dataset(path) as survey:
                table = survey["depth"].to_dataframe().reset_index().dropna(subset=["depth"])
        else:
            table = pd.read_csv(path)
        names = [name for name in ("x", "y", "depth") if name in table]
        if names[:2] != ["x", "y"]:
            raise KeyError("x and y")
        return table[names].astype(np.float64)
    except (KeyError, ValueError) as error:
        raise ObservationError(f"{path}: expected x, y and perhaps depth, in m: {error}") from error


def _means(cells: Cells, places: Array, depth: Array) -> Array:
    """Mean depth of the places within each cell, 0 in cells without one that lie apart, shape (cells,)."""
    tree = KDTree(cells.points)
    _, index = tree.query(places)
    count = np.bincount(index, minlength=len(cells.points))
    total = np.bincount(index, depth, minlength=len(cells.points))
    mean = total / np.maximum(count, 1)
    # a survey coarser than the cells: a cell between its places takes the depth of the nearest
    survey = KDTree(places)
    apart = survey.query(places, k=2)[0][:, 1] if len(places) > 1 else np.zeros(1)
    reach = np.sqrt(0.5) * float(np.median(apart))
    near, at = survey.query(cells.points)
    found: Array = np.where(count > 0, mean, np.where(near <= reach, depth[at], 0.0))
    return found


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
        ``false_alarm_ratio``, ``runout_misfit`` (horizontal distance from the observed toe on, m), and with
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
    area = np.broadcast_to(cell_area(store).to_numpy(), [store.sizes[d] for d in over]).ravel()
    distance = _by_run(xr.broadcast(store["horizontal_distance"], store["y"])[0], store)
    deposits = _by_run(store["deposit_depth"], store)
    states = store[STATUS.name].to_numpy()
    rows = []
    for run, state in enumerate(states):
        row: dict[str, object] = {"scenario": title, "run": run, "status": Status(state).words}
        row |= {name: held[run] for name, held in varied(store).items()}
        rows.append(row)
        if state not in (Status.DONE, Status.OVERRUN):
            continue
        deposit = deposits.isel(run=run).to_numpy().astype(np.float64).ravel()
        row |= _scores(deposit, distance.isel(run=run).to_numpy().ravel(), area, observed, threshold)
    table = pd.DataFrame(rows)
    if "critical_success_index" not in table:
        raise ObservationError(f"{title}: no run was computed")
    return table.sort_values("critical_success_index", ascending=False, ignore_index=True)


def _by_run(field: xr.DataArray, store: xr.Dataset) -> xr.DataArray:
    """Give a field with the dimension ``run`` first and those of the points in their order."""
    whole = field if "run" in field.dims else field.expand_dims(run=store.sizes["run"])
    return whole.transpose("run", *space(store))


def _scores(
    deposit: Array, distance: Array, area: Array, observed: Observed, threshold: float
) -> dict[str, float]:
    covered = deposit > threshold
    sets = (covered & observed.covered, covered | observed.covered, observed.covered, covered)
    both, either, seen, made = (float(area[cells].sum()) for cells in sets)
    toe = float(distance[covered].max()) if made else np.nan
    scores = {
        "critical_success_index": both / either,
        "hit_rate": both / seen,
        "false_alarm_ratio": 1 - both / made if made else 0.0,
        "runout_misfit": toe - float(distance[observed.covered].max()),
    }
    if observed.depth is not None:
        volume = float((observed.depth * area).sum())
        square = ((deposit - observed.depth) ** 2 * area)[covered | observed.covered].sum() / either
        scores |= {
            "volume_misfit": float((deposit * area).sum()) / volume - 1,
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
        runs (``prior_``) and over accepted ones (``posterior_``), and the runs behind it.

    References
    ----------
    Beven & Binley 1992, The future of distributed models, https://doi.org/10.1002/hyp.3360060305
    """
    known = scores.dropna(subset=["critical_success_index"])
    best = known.head(max(1, round(accepted * len(known))))
    runs = best["run"].to_numpy()
    weight = values(store, "peak_speed").weight
    likelihood = weight[runs] * best["critical_success_index"].to_numpy()
    if not likelihood.sum():
        raise ObservationError(f"{store.attrs['title']}: no run overlaps the observed deposit")
    rows = []
    for name, held in varied(store).items():
        if held.dtype.kind not in "fiu":
            continue
        row: dict[str, object] = {**behind(store), "runs_accepted": len(best), "parameter": name}
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
