"""Emulators of fields over lattices and of what reaches places in them, the continuation by leave-one-out."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import TypeVar

import numpy as np
from numpy.typing import NDArray

from solver.emulator.latent import WET, Latent, candidates, wet
from solver.emulator.levels import Levels, fit_levels
from solver.emulator.scores import ExceedanceScore, ScalarScore, exceedance_score, scalar_score

Array = NDArray[np.float64]
Rows = NDArray[np.intp]
Key = TypeVar("Key")

# A continuation of the square root is taken where its score is better by more than a tenth. It is smoother
# where depths are heavy-tailed; elsewhere its score is as good and its probabilities are more biased.
PREFERENCE = 0.9


@dataclass(frozen=True)
class FieldLevel:
    """Fields of the runs of one level.

    Parameters
    ----------
    inputs : (n, inputs) array
        Scaled.
    values : (n, ny, nx) array
        At least 0.
    y, x : array
        Coordinates of the points, ascending, m.
    pairs : Rows, optional
        Rows of the level before that the runs are; of the coarsest level None.
    places : mapping of str to Rows
        By name, the cells of each place in the order of the flattened field.
    """

    inputs: Array
    values: NDArray[np.floating]
    y: Array
    x: Array
    places: Mapping[str, Rows]
    pairs: Rows | None = None


@dataclass(frozen=True)
class Chosen:
    """The emulator of a threshold: continuation, fitted levels, the level of the threshold, scores.

    Parameters
    ----------
    of_values : ScalarScore, optional
        Of a single place, how its latent values are predicted.
    """

    latent: Latent
    levels: Levels
    level: float
    score: ExceedanceScore
    of_values: ScalarScore | None = None


def choose(
    runs: Sequence[FieldLevel],
    thresholds: Sequence[float],
    weight: Array,
    size: float = 1.0,
    *,
    mapped: bool = True,
) -> tuple[dict[float, Chosen], dict[tuple[str, float], Chosen]]:
    """Fit emulators of fields, and of the largest value at each place, for each threshold.

    Parameters
    ----------
    runs : sequence of FieldLevel
        The coarsest first; maps are on the points of the last one.
    thresholds : sequence of float
        Of the field; those too low to be told from dry are left out.
    weight : array, shape (n,)
        Of each run of the coarsest level in the scores; their sum is 1.
    size : float
        What values of the field are relative to, see `Latent`.
    mapped : bool
        Whether to fit emulators of the fields, which take longest.

    Returns
    -------
    maps : dict
        By threshold; outputs are the flattened points of the last level.
    places : dict
        By name of the place and threshold; one output each.

    Raises
    ------
    ValueError
        If a field is not finite everywhere, or coordinates do not ascend.
    """
    for each in runs:
        _check(each)
    maps: dict[float, Chosen] = {}
    places: dict[tuple[str, float], Chosen] = {}
    wanted = [threshold for threshold in thresholds if threshold >= WET * size]
    last, near = runs[-1], None
    near_places: dict[str, Levels] = {}
    covered = [wet(each.values, _spacing(each), size) for each in runs] if wanted else []
    at_last = [
        fields.interpolated((each.y, each.x), (last.y, last.x)) if mapped else fields
        for fields, each in zip(covered, runs, strict=bool(wanted))
    ]
    for latent in candidates(size) if wanted else ():
        held = [each.continued(latent) for each in covered]
        if mapped:
            on_map = [each.continued(latent).reshape(len(each.values), -1) for each in at_last]
            near = _fitted(runs, on_map, near)
            _keep(maps, near, latent, {threshold: threshold for threshold in wanted}, weight)
        for name in last.places:
            largest = [
                fields.reshape(len(fields), -1)[:, each.places[name]].max(axis=1, keepdims=True)
                for fields, each in zip(held, runs, strict=True)
            ]
            near_places[name] = _fitted(runs, largest, near_places.get(name))
            keys = {threshold: (name, threshold) for threshold in wanted}
            _keep(places, near_places[name], latent, keys, weight)
    return maps, places


def _check(runs: FieldLevel) -> None:
    """Refuse what would count as dry, and lattices that no distance is right on."""
    if not np.isfinite(runs.values).all():
        raise ValueError("expected finite values of all runs at all points, found others")
    if not all((np.diff(axis) > 0).all() for axis in (runs.y, runs.x)):
        raise ValueError("expected ascending coordinates y and x of the points")


def _fitted(
    runs: Sequence[FieldLevel], outputs: Sequence[NDArray[np.floating]], near: Levels | None
) -> Levels:
    doubles = [np.asarray(each, np.float64) for each in outputs]
    pairs = [each.pairs for each in runs if each.pairs is not None]
    return fit_levels([each.inputs for each in runs], doubles, pairs, near)


def _keep(
    best: dict[Key, Chosen], levels: Levels, latent: Latent, keys: Mapping[float, Key], weight: Array
) -> None:
    """Keep for each threshold the emulator with the better score."""
    mean, deviation = levels.leave_one_out()
    values = levels.outputs[0]
    for threshold, key in keys.items():
        level = latent.level(threshold)
        score = exceedance_score(values, mean, deviation, level, weight)
        if key not in best or _rated(score, latent) < _rated(best[key].score, best[key].latent):
            single = values.shape[1] == 1
            of_values = scalar_score(values[:, 0], mean[:, 0], deviation[:, 0]) if single else None
            best[key] = Chosen(latent, levels, level, score, of_values)


def _rated(score: ExceedanceScore, latent: Latent) -> float:
    return float(score.brier.sum()) / (PREFERENCE if latent.root else 1.0)


def _spacing(runs: FieldLevel) -> tuple[float, float]:
    return float(np.diff(runs.y).mean()), float(np.diff(runs.x).mean())
