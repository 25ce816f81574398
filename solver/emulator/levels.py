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
# of draws, from which the error of their number is told
BLOCKS = 16


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

    @property
    def alike(self) -> NDArray[np.bool_]:
        """Outputs, (c,), that all runs of each level agree on."""
        found: NDArray[np.bool_] = np.all([(held == held[0]).all(axis=0) for held in self.outputs], axis=0)
        return found

    @property
    def of_first(self) -> Array:
        """Outputs, (c,), as the first runs of the levels have them."""
        found: Array = np.sum([held[0] for held in self.outputs], axis=0)
        return found

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
    block : Rows
        Block of draws that each is in, (m,), from 0; every block is even by itself.
    """

    at: Array
    share: Array
    first: Rows
    share_of_first: Array
    block: Rows

    @property
    def blocks(self) -> int:
        """How many blocks there are."""
        return int(self.block.max()) + 1

    @property
    def few(self) -> Draws:
        """The few draws that paths are drawn at, all of one block."""
        every = np.arange(len(self.first))
        return Draws(self.at[self.first], self.share_of_first, every, self.share_of_first, 0 * every)

    def variance(self, values: Array) -> float:
        """Variance of a mean over the draws of values, (m,), that comes of their number."""
        of_blocks: Array = np.bincount(self.block, self.share * values, self.blocks).astype(np.float64)
        return float(variance_of_draws(of_blocks))


def variance_of_draws(of_blocks: Array) -> Array:
    """Variance of the sum over blocks of draws, shape (...), from what each adds to it, shape (blocks, ...).

    Blocks of an even design make up for each other, so that it is rather too large. One block tells nothing.
    """
    blocks = len(of_blocks)
    if blocks == 1:
        return np.zeros(of_blocks.shape[1:])
    found: Array = blocks * of_blocks.var(axis=0, ddof=1)
    return found


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
        np.concatenate([np.arange(size) * min(BLOCKS, *sizes, size) // size for size in sizes]),
    )


class Predictor:
    """Predictions of an emulator at places, whose weights are computed once for all outputs.

    In single precision they are several times faster, and good to some millionths of a probability.

    Attributes
    ----------
    variances : array, shape (parts, m)
        At the places, relative to those of the outputs' processes.
    """

    def __init__(self, parts: Sequence[Kriging], at: Array, *, single: bool = False) -> None:
        self._kind = np.float32 if single else np.float64
        held = [part.predictor(at) for part in parts]
        self._weights = [weights.astype(self._kind) for weights, _ in held]
        self.variances = np.stack([variance for _, variance in held]).astype(self._kind)

    def means(self, levels: Levels) -> Array:
        """Mean of outputs on each level, the coarsest first, shape (parts, m, c)."""
        shape = len(levels.parts), len(self._weights[0]), levels.outputs[0].shape[1]
        found = np.empty(shape, self._kind)
        for i, (weights, held) in enumerate(zip(self._weights, levels.outputs, strict=False)):
            np.matmul(weights, centred(held).astype(self._kind), out=found[i])
            # weights add up to 1
            found[i] += held.mean(axis=0).astype(self._kind)
            if i:
                found[i] += found[i - 1]
        return found

    def __call__(self, levels: Levels, only_coarsest: bool = False) -> tuple[Array, Array]:
        """Mean and standard deviation of outputs, shape (m, c)."""
        levels = levels.coarsest() if only_coarsest else levels
        parts = zip(self.variances, levels.scales, strict=False)
        variance = sum(at[:, None] * scale.astype(self._kind) for at, scale in parts)
        return self.means(levels)[-1], np.sqrt(variance)


def scaled_paths(parts: Sequence[Kriging], at: Array, count: int, seed: int = 0) -> list[Array]:
    """Paths of each part for outputs of variance one, shape (m, count) each; the same for all outputs."""
    rng = np.random.default_rng(seed)
    return [part.paths(at, rng.standard_normal((len(at), count))) for part in parts]
