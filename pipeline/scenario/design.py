"""The design of a batch: which values the varied keys take in each run, and how much each run counts."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from functools import lru_cache
from math import erfc, prod, sqrt
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from pipeline.scenario.sweep import Value
from pipeline.settings.sample import Discrete, Distribution, Lognormal, Normal, Sample, Triangular, Uniform

if TYPE_CHECKING:
    from pipeline.settings.settings import Settings

Array = NDArray[np.float64]
Draws = Mapping[str, tuple[Value, ...]]


@dataclass(frozen=True)
class ChosenRuns:
    """Runs that were chosen beside a sample, and are no part of it.

    Parameters
    ----------
    target : str
        What they were chosen for, ``school: depth > 1.2``.
    draws : mapping of str to tuple
        Their values by varied key, in the order of the design.
    origin : str
        From which runs they were chosen, and what these said of the target.
    """

    target: str
    draws: Draws
    origin: str = ""


@dataclass(frozen=True)
class Design:
    """Values of the varied keys by run: the product of lists, and for each of its entries all draws.

    The last list varies fastest but for the draws, which vary faster still.

    Parameters
    ----------
    lists : Mapping[str, tuple[Value, ...]]
        Values of each swept key.
    draws : Draws
        Values of each sampled key, equally many.
    """

    lists: Mapping[str, tuple[Value, ...]]
    draws: Draws

    @property
    def keys(self) -> tuple[str, ...]:
        """The varied keys: swept ones, then sampled ones."""
        return (*self.lists, *self.draws)

    @property
    def rows(self) -> int:
        """Number of draws; 1 where nothing is sampled."""
        return len(next(iter(self.draws.values()), (None,)))

    def __len__(self) -> int:
        return prod(map(len, self.lists.values())) * self.rows

    def __getitem__(self, run: int) -> tuple[Value, ...]:
        """Values of a run in the order of the keys."""
        entries, row = self.place(range(len(self))[run])
        swept = (values[k] for values, k in zip(self.lists.values(), entries, strict=True))
        return (*swept, *(values[row] for values in self.draws.values()))

    def place(self, run: int) -> tuple[tuple[int, ...], int]:
        """Position of a run in each list, and its draw."""
        rest, row = divmod(run, self.rows)
        entries: list[int] = []
        for values in reversed(list(self.lists.values())):
            rest, k = divmod(rest, len(values))
            entries.insert(0, k)
        return tuple(entries), row


def design(settings: Settings) -> Design:
    """Make the design of a scenario."""
    return Design(settings.sweep, {} if settings.sample is None else draw(settings.sample))


def weights(settings: Settings) -> Array:
    """Give the share of each run in probabilities, shape (runs,); their sum is 1."""
    found = np.ones(settings.run_count) if settings.weights is None else _numbers(settings, settings.weights)
    share: Array = found / found.sum()
    return share


def return_periods(settings: Settings) -> Array | None:
    """Give the return period of each run, shape (runs,), years; None where there are none."""
    periods = settings.return_periods
    if isinstance(periods, str):
        raise ValueError("return periods of polygons are known once these are read")
    if isinstance(periods, int | float):
        return np.full(settings.run_count, float(periods))
    return None if periods is None else _numbers(settings, periods)


def _numbers(settings: Settings, given: tuple[float, ...] | Mapping[str, tuple[float, ...]]) -> Array:
    """Numbers of each run from one a run, or from one an entry of some lists, which multiply."""
    if isinstance(given, tuple):
        return np.array(given, np.float64)
    found = np.ones(1)
    for key, values in settings.sweep.items():
        found = np.outer(found, given.get(key, (1.0,) * len(values))).ravel()
    return np.repeat(found, 1 if settings.sample is None else settings.sample.rows)


def draw(sample: Sample) -> Draws:
    """Draw the values of every sampled key.

    Correlated keys are drawn through normal scores with the given correlations (a Gaussian copula), which
    keeps each key's own distribution. In a Latin hypercube the scores only decide which values are paired,
    so that each layer of each key holds one draw as it does without correlations.

    Returns
    -------
    dict of str to tuple
        ``sample.rows`` values by key.
    """
    return _drawn(_Drawable(sample.model_dump_json(), sample))


@dataclass(frozen=True)
class _Drawable:
    """A sample that is known by its JSON."""

    text: str
    sample: Sample = field(compare=False)


@lru_cache(maxsize=8)
def _drawn(given: _Drawable) -> Draws:
    """Draw once what checks, hashes and every list of the runs ask for."""
    from scipy.special import ndtr, ndtri

    sample = given.sample
    uniform = _uniform(sample)
    if sample.correlations:
        if sample.design == "latin-hypercube":
            uniform = paired(uniform, sample.correlation)
        else:
            scores = ndtri(uniform) @ np.linalg.cholesky(sample.correlation).T
            uniform = np.clip(ndtr(scores), _LEAST, 1 - _LEAST)
    return {key: _quantile(each, uniform[:, i]) for i, (key, each) in enumerate(sample.values.items())}


# no quantile of an unbounded distribution is infinite
_LEAST = 2.0**-53


def _uniform(sample: Sample) -> Array:
    """Cover the unit cube, shape (rows, keys)."""
    from scipy.stats import qmc

    rng, keys = np.random.default_rng(sample.seed), len(sample.values)
    if sample.design == "random":
        points = rng.random((sample.count, keys))
    elif sample.design == "latin-hypercube":
        points = qmc.LatinHypercube(keys, rng=rng).random(sample.count)
    elif sample.design == "sobol":
        points = _sobol(keys, sample.count, rng)
    else:
        points = saltelli(_sobol(2 * keys, sample.count, rng))
    clipped: Array = np.clip(points, _LEAST, 1 - _LEAST)
    return clipped


def _sobol(keys: int, count: int, rng: np.random.Generator) -> Array:
    """Give the first points of a scrambled Sobol sequence, shape (count, keys)."""
    from scipy.stats import qmc

    # SciPy warns of counts between the powers of 2, which the sequence goes through in order as well
    points: Array = qmc.Sobol(keys, rng=rng).random(1 << (count - 1).bit_length())[:count]
    return points


def paired(points: Array, correlation: Array) -> Array:
    """Reorder each coordinate of points so that their normal scores have a correlation.

    The values of each coordinate stay what they are.

    Parameters
    ----------
    points : array, shape (n, keys)
        In the open unit cube, the coordinates independent.
    correlation : array, shape (keys, keys)
        Wanted correlation of the normal scores.

    Returns
    -------
    array, shape (n, keys)
        With the same values in each column.

    References
    ----------
    Iman & Conover 1982, A distribution-free approach to inducing rank correlation among input variables,
    https://doi.org/10.1080/03610918208812265
    """
    from scipy.special import ndtri

    rows, keys = points.shape
    scores = ndtri(points)
    # with few rows the scores are dependent by chance, and their own correlation has no inverse
    if rows > keys + 1:
        chance = np.linalg.cholesky(np.corrcoef(scores, rowvar=False))
        scores = np.linalg.solve(chance, scores.T).T
    wanted = scores @ np.linalg.cholesky(correlation).T
    ranks = wanted.argsort(axis=0, kind="stable").argsort(axis=0, kind="stable")
    return np.take_along_axis(np.sort(points, axis=0), ranks, axis=0)


def saltelli(points: Array) -> Array:
    """Arrange points for Sobol's sensitivity indices of first and total order.

    Parameters
    ----------
    points : array, shape (n, 2 keys)
        In the unit cube.

    Returns
    -------
    array, shape (n (keys + 2), keys)
        For each point its first half A, A with one coordinate after the other taken from the second half B,
        and B.

    References
    ----------
    Saltelli et al. 2010, Variance based sensitivity analysis of model output,
    https://doi.org/10.1016/j.cpc.2009.09.018
    """
    first, second = np.split(points, 2, axis=1)
    keys = first.shape[1]
    rows = np.repeat(first[:, None, :], keys + 2, axis=1)
    for i in range(keys):
        rows[:, i + 1, i] = second[:, i]
    rows[:, -1, :] = second
    return rows.reshape(-1, keys)


def _quantile(distribution: Distribution, share: Array) -> tuple[Value, ...]:
    """Values of a distribution below which given shares lie."""
    if isinstance(distribution, Discrete):
        parts = np.cumsum(distribution.weights or np.ones(len(distribution.values)))
        chosen = np.searchsorted(parts / parts[-1], share, side="right")
        return tuple(distribution.values[min(i, len(distribution.values) - 1)] for i in chosen)
    return tuple(_continuous(distribution, share).tolist())


def _continuous(distribution: Uniform | Normal | Lognormal | Triangular, share: Array) -> Array:
    from scipy import stats

    found: Array
    match distribution:
        case Uniform(lower=low, upper=high):
            found = stats.uniform(low, high - low).ppf(share)
        case Normal(mean=mean, deviation=deviation, lower=lower, upper=upper):
            found = mean + deviation * _score(
                share, _over(lower, mean, deviation), _over(upper, mean, deviation)
            )
        case Lognormal(median=median, deviation=deviation, lower=lower, upper=upper):
            middle = float(np.log(median))
            bounds = (None if bound is None else float(np.log(bound)) for bound in (lower, upper))
            scores = _score(share, *(_over(bound, middle, deviation) for bound in bounds))
            found = np.exp(middle + deviation * scores)
        case Triangular(lower=low, mode=mode, upper=high):
            found = stats.triang((mode - low) / (high - low), low, high - low).ppf(share)
    # bounds are met but for round-off
    if distribution.lower is None and distribution.upper is None:
        return found
    return np.clip(found, distribution.lower, distribution.upper)


def share_within(distribution: Distribution) -> float:
    """Share of a distribution that its bounds hold, 1 where nothing is cut off."""
    match distribution:
        case Normal(mean=middle, deviation=deviation, lower=lower, upper=upper):
            low, high = _over(lower, middle, deviation), _over(upper, middle, deviation)
        case Lognormal(median=median, deviation=deviation, lower=lower, upper=upper):
            middle = float(np.log(median))
            low, high = (
                None if bound is None else _over(float(np.log(bound)), middle, deviation)
                for bound in (lower, upper)
            )
        case _:
            return 1.0
    below, above = (
        0.0 if score is None else 0.5 * erfc(sign * score / sqrt(2)) for score, sign in ((low, -1), (high, 1))
    )
    # far out in the upper tail both are near 1, and their difference is lost
    if low is not None and low > 0:
        return 0.5 * erfc(low / sqrt(2)) - above
    return 1.0 - below - above if high is None or high > 0 else 0.5 * erfc(-high / sqrt(2)) - below


def _over(bound: float | None, middle: float, deviation: float) -> float | None:
    return None if bound is None else (bound - middle) / deviation


def _score(share: Array, lower: float | None, upper: float | None) -> Array:
    """Quantiles of the standard normal distribution between two bounds, however far out they lie."""
    from scipy import stats

    if lower is None and upper is None:
        return np.asarray(stats.norm.ppf(share))
    low, high = -np.inf if lower is None else lower, np.inf if upper is None else upper
    # takes the survival function above the median, and logarithms of both
    return np.asarray(stats.truncnorm(low, high).ppf(share))
