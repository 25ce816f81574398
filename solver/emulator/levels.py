"""Emulators of runs on one spacing, or on several: many runs on the widest, few of them on closer ones."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property
from itertools import pairwise

import numpy as np
from numpy.typing import NDArray

from solver.emulator.kriging import Kriging, centred, fit

Array = NDArray[np.float64]
Rows = NDArray[np.intp]
# of scaled inputs, below which places are one
SAME = 1e-9


@dataclass(frozen=True)
class Levels:
    """Emulator of the outputs of the finest level: ``z_fine = z_coarse + delta``, level by level.

    Each ``delta`` is a process of its own with a constant trend, independent of the others, so that variances
    add (Kennedy & O'Hagan 2000 with a scale of one, https://doi.org/10.1093/biomet/87.1.1).

    Parameters
    ----------
    parts : tuple of Kriging
        Kriging of the coarsest level, then of each difference.
    outputs : tuple of array
        (runs of the part, c) what each is made from.
    pairs : tuple of Rows
        Rows of the level before that the runs of each difference are, one less.
    """

    parts: tuple[Kriging, ...]
    outputs: tuple[Array, ...]
    pairs: tuple[Rows, ...] = ()

    @cached_property
    def scales(self) -> tuple[Array, ...]:
        """Variance of each output's process, part by part, shape (c,) each."""
        return tuple(part.scale(held) for part, held in zip(self.parts, self.outputs, strict=True))

    def coarsest(self) -> Levels:
        """Give the emulator of the coarsest level alone."""
        return Levels(self.parts[:1], self.outputs[:1])

    def of(self, columns: slice | Rows) -> Levels:
        """Give the emulator of some of the outputs."""
        return Levels(self.parts, tuple(held[:, columns] for held in self.outputs), self.pairs)

    def leave_one_out(self) -> tuple[Array, Array]:
        """Mean and deviation of the runs of the coarsest level, (n, c), as predicted from the others."""
        return self.parts[0].leave_one_out(self.outputs[0])

    def leave_pair_out(self) -> tuple[Array, Array]:
        """Mean and deviation of the runs of the finest level, (n, c), left out on every level."""
        means, variances, rows = [], [], np.arange(len(self.outputs[-1]))
        for i in reversed(range(len(self.parts))):
            mean, deviation = self.parts[i].leave_one_out(self.outputs[i])
            means.append(mean[rows])
            variances.append(deviation[rows] ** 2)
            rows = self.pairs[i - 1][rows] if i else rows
        return np.sum(means, axis=0), np.sqrt(np.sum(variances, axis=0))


def fit_levels(
    inputs: Sequence[Array], outputs: Sequence[Array], pairs: Sequence[Rows] = (), start: Levels | None = None
) -> Levels:
    """Fit an emulator to the runs of one or several levels.

    Parameters
    ----------
    inputs : sequence of array, shape (runs of the level, inputs)
        Places of the runs, the coarsest level first.
    outputs : sequence of array, shape (runs of the level, c)
        Their outputs.
    pairs : sequence of array
        Of each level but the first, the row of the level before that each of its runs is.
    start : Levels, optional
        Emulator of similar outputs, from which the search for correlation lengths starts.

    Raises
    ------
    ValueError
        If a level has too few runs, or paired runs are at different places.
    """
    for i, before in enumerate(pairs, 1):
        _check_pairs(inputs[i - 1], inputs[i], before)
    made = [fit(inputs[0], outputs[0], "linear", start.parts[0] if start else None)]
    held = [outputs[0]]
    for i, ((_, fine), before) in enumerate(zip(pairwise(inputs), pairs, strict=True), 1):
        held.append(outputs[i] - outputs[i - 1][before])
        made.append(fit(fine, held[-1], "constant", start.parts[i] if start else None))
    return Levels(tuple(made), tuple(held), tuple(pairs))


def _check_pairs(coarse: Array, fine: Array, before: Rows) -> None:
    """Refuse pairs that are none, as of levels in another order: their differences would mean nothing."""
    if len(before) != len(fine) or (before >= len(coarse)).any():
        raise ValueError(
            f"expected a row of {len(coarse)} runs for each of {len(fine)}, found {len(before)} rows "
            f"up to {before.max(initial=0)}"
        )
    if not np.allclose(coarse[before], fine, rtol=0, atol=SAME):
        raise ValueError("expected paired runs at the same places of two levels")


@dataclass(frozen=True)
class Draws:
    """Draws of the inputs that probabilities are taken over.

    Parameters
    ----------
    at : (m, inputs) array
        Places, scaled as those of the runs.
    share : (m,) array
        Share of each, their sum is 1.
    first : Rows
        Positions of the few draws that paths are drawn at.
    share_of_first : array
        Share of each of these, their sum 1.
    """

    at: Array
    share: Array
    first: Rows
    share_of_first: Array


def draws(groups: Sequence[Array], shares: Sequence[float], most_paths: int) -> Draws:
    """Put together the draws of groups that have a share each.

    Parameters
    ----------
    groups : sequence of array, shape (m, inputs)
        Draws, of which the first are an even design of themselves.
    shares : sequence of float
        Of each group; their sum is 1.
    most_paths : int
        Draws that paths are drawn at, over all groups.
    """
    sizes = [len(group) for group in groups]
    few = [min(size, max(1, most_paths // len(groups))) for size in sizes]
    starts = np.cumsum([0, *sizes[:-1]])
    return Draws(
        np.concatenate(list(groups)),
        np.repeat(np.divide(shares, sizes), sizes),
        np.concatenate([start + np.arange(count) for start, count in zip(starts, few, strict=True)]),
        np.repeat(np.divide(shares, few), few),
    )


class Predictor:
    """Predictions of an emulator at places, whose weights are computed once for all outputs.

    In single precision they are several times faster, and good to some millionths of a probability.
    """

    def __init__(self, parts: Sequence[Kriging], at: Array, *, single: bool = False) -> None:
        self._kind = np.float32 if single else np.float64
        held = [part.predictor(at) for part in parts]
        self._weights = [weights.astype(self._kind) for weights, _ in held]
        self._variances = [variance[:, None].astype(self._kind) for _, variance in held]

    def __call__(self, levels: Levels, only_coarsest: bool = False) -> tuple[Array, Array]:
        """Mean and standard deviation of outputs, shape (m, c)."""
        count = 1 if only_coarsest else len(levels.parts)
        # weights add up to 1
        around = sum(levels.outputs[i].mean(axis=0) for i in range(count))
        mean = self._weights[0] @ centred(levels.outputs[0]).astype(self._kind)
        variance = self._variances[0] * levels.scales[0].astype(self._kind)
        for i in range(1, count):
            mean += self._weights[i] @ centred(levels.outputs[i]).astype(self._kind)
            variance += self._variances[i] * levels.scales[i].astype(self._kind)
        mean += np.asarray(around, self._kind)
        return mean, np.sqrt(variance)


def scaled_paths(parts: Sequence[Kriging], at: Array, count: int, seed: int = 0) -> list[Array]:
    """Paths of each part for outputs of variance one, shape (m, count) each; the same for all outputs."""
    rng = np.random.default_rng(seed)
    return [part.paths(at, rng.standard_normal((len(at), count))) for part in parts]
