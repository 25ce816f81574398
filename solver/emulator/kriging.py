"""Universal kriging of many outputs with one correlation: parallel partial emulation.

Each output c is ``z_c(t) = H(t) b_c + sigma_c g(t)``, with g a Gaussian process whose correlation
``R = prod_j Matern(|dt_j| / l_j) + nugget I`` all outputs share. ``b_c`` and ``sigma_c`` are known in closed
form, so that thousands of outputs cost little more than one.

References
----------
Gu & Berger 2016, Parallel partial Gaussian process emulation for computer models with massive output,
https://doi.org/10.1214/16-AOAS934
Dubrule 1983, Cross validation of kriging in a unique neighborhood, https://doi.org/10.1007/BF01033232
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from typing import Literal

import numpy as np
from numpy.typing import NDArray
from scipy.linalg import cholesky, solve_triangular
from scipy.linalg.lapack import dpotri
from scipy.optimize import minimize

from solver.emulator.correlation import matern, matern_slopes

Array = NDArray[np.float64]
Trend = Literal["constant", "linear"]

# outputs that are predicted at once, and that the correlation is fitted to
OUTPUTS_AT_ONCE = 500
MOST_FITTED = 150
# of scaled inputs, and of the variance of an output
LENGTHS, NUGGETS = (0.05, 20.0), (1e-6, 1.0)
# medians and deviations of the logarithms of weak priors: lengths of the range, nearly no noise
PRIOR_LENGTH, PRIOR_NUGGET = (1.0, 1.5), (1e-3, 3.0)
STARTS = (0.4, 1.5)
MOST_ITERATIONS = 60
# variance of an output that does not vary
LEAST_VARIANCE = 1e-18
# part of what a run says that the trend must leave to the other runs
LEAST_KNOWN = 1e-8


@dataclass(frozen=True)
class Kriging:
    """Predictor of outputs at any place from outputs at given places.

    Parameters
    ----------
    inputs : (n, inputs) array
        Places of the runs, scaled to about one.
    lengths : (inputs,) array
        Correlation lengths.
    nugget : float
        Variance at one place, relative to that of the process: what the inputs do not explain.
    trend : Trend
        Whether the mean of an output is constant or linear in the inputs.
    """

    inputs: Array
    lengths: Array
    nugget: float
    trend: Trend = "linear"

    @property
    def free(self) -> int:
        """Degrees of freedom that are left beside the trend."""
        runs, width = map(int, self.inputs.shape)
        return runs - (1 if self.trend == "constant" else 1 + width)

    def basis(self, at: Array) -> Array:
        """Functions of the trend at places, shape (m, functions)."""
        ones = np.ones((len(at), 1))
        return ones if self.trend == "constant" else np.concatenate([ones, at], axis=1)

    @cached_property
    def _inverse(self) -> Array:
        """Inverse of the correlation of the runs, shape (n, n)."""
        whole = matern(self.inputs, self.inputs, self.lengths) + self.nugget * np.eye(len(self.inputs))
        return _inverse_by(cholesky(whole, lower=True))

    @cached_property
    def _trend(self) -> tuple[Array, Array]:
        """Covariance of the coefficients of the trend, and what gives them from outputs, (functions, n)."""
        basis = self.basis(self.inputs)
        covariance: Array = np.asarray(np.linalg.inv(basis.T @ self._inverse @ basis), np.float64)
        return covariance, covariance @ basis.T @ self._inverse

    @cached_property
    def precision(self) -> Array:
        """Inverse of the correlation with the trend projected out, shape (n, n)."""
        _, coefficients = self._trend
        found: Array = self._inverse - self._inverse @ self.basis(self.inputs) @ coefficients
        return found

    def predictor(self, at: Array) -> tuple[Array, Array]:
        """Weights of the runs in the mean at places, and variances there.

        Parameters
        ----------
        at : array, shape (m, inputs)
            Places.

        Returns
        -------
        weights : array, shape (m, n)
            ``weights @ outputs`` is the mean.
        variance : array, shape (m,)
            Of a prediction relative to that of the output, nugget included.
        """
        known, rest = self._known(at)
        weighted = known @ self._inverse
        weights = weighted + rest @ self._trend[1]
        variance = 1 + self.nugget - np.einsum("ij,ij->i", weighted, known)
        variance += np.einsum("ij,ij->i", rest @ self._trend[0], rest)
        return weights, np.maximum(variance, 1e-12)

    def covariance(self, at: Array) -> Array:
        """Covariance of predictions at places, relative likewise, shape (m, m)."""
        known, rest = self._known(at)
        found = matern(at, at, self.lengths) - known @ self._inverse @ known.T
        found += rest @ self._trend[0] @ rest.T
        found[np.diag_indices_from(found)] += self.nugget
        return found

    def _known(self, at: Array) -> tuple[Array, Array]:
        known = matern(at, self.inputs, self.lengths)
        return known, self.basis(at) - known @ (self._inverse @ self.basis(self.inputs))

    def scale(self, outputs: Array) -> Array:
        """Variance of each output's process, shape (c,), from outputs of the runs, shape (n, c)."""
        moved = centred(outputs)
        found = np.einsum("ic,ic->c", moved, self.precision @ moved) / self.free
        scale: Array = np.maximum(found, LEAST_VARIANCE)
        return scale

    def leave_one_out(self, outputs: Array) -> tuple[Array, Array]:
        """Mean and standard deviation of each run's outputs as predicted from the other runs.

        In closed form: with Q the `precision`, the error of run i is ``(Q z)_i / Q_ii``, its variance
        ``sigma_-i^2 / Q_ii`` with the variance of the process estimated without the run as well. Correlation
        lengths and nugget are those of all runs.

        Parameters
        ----------
        outputs : array, shape (n, c)
            Of the runs.

        Returns
        -------
        mean, deviation : array, shape (n, c)
        """
        held = np.diag(self.precision)[:, None].copy()
        alone = held[:, 0] < LEAST_KNOWN * np.diag(self._inverse)
        held[alone] = 1.0
        mean, deviation = np.empty(outputs.shape), np.empty(outputs.shape)
        for start in range(0, outputs.shape[1], OUTPUTS_AT_ONCE):
            part = slice(start, start + OUTPUTS_AT_ONCE)
            moved = centred(outputs[:, part])
            residual = self.precision @ moved
            error = residual / held
            without = np.einsum("ic,ic->c", moved, residual) - residual * error
            variance = np.maximum(without / (self.free - 1), LEAST_VARIANCE) / held
            mean[:, part], deviation[:, part] = outputs[:, part] - error, np.sqrt(variance)
        for run in np.flatnonzero(alone):
            others = np.delete(outputs, run, axis=0)
            mean[run] = others.mean(axis=0)
            deviation[run] = np.sqrt(np.maximum(others.var(axis=0, ddof=1), LEAST_VARIANCE))
        return mean, deviation

    def paths(self, at: Array, normal: Array) -> Array:
        """Deviations from the mean that belong together, for an output of variance one.

        Parameters
        ----------
        at : array, shape (m, inputs)
            Places.
        normal : array, shape (m, k)
            Independent standard normal numbers.

        Returns
        -------
        array, shape (m, k)
        """
        covariance = self.covariance(at)
        # places that coincide but for round-off have no definite covariance
        covariance[np.diag_indices_from(covariance)] += 1e-9
        found: Array = cholesky(covariance, lower=True) @ normal
        return found


def fit(inputs: Array, outputs: Array, trend: Trend = "linear", start: Kriging | None = None) -> Kriging:
    """Find correlation lengths and nugget that outputs agree on.

    They maximise the likelihood with trend and variance integrated out, the logarithm averaged over outputs
    (of many a fixed choice), times weak log-normal priors. An average of outputs counts as one: neighbouring
    cells tell nearly the same, and a sum over them would drown the priors.

    Parameters
    ----------
    inputs : array, shape (n, inputs)
        Places of the runs, scaled to about one.
    outputs : array, shape (n, c)
        Of the runs.
    trend : {"linear", "constant"}
        Form of the mean.
    start : Kriging, optional
        One of similar outputs, from whose lengths the search starts.

    Raises
    ------
    ValueError
        If there are not more runs than functions of the trend, by two, or the runs do not determine them, or
        an output is not finite.
    """
    if not np.isfinite(outputs).all():
        raise ValueError("expected finite outputs of all runs, found others")
    runs, width = inputs.shape
    if Kriging(inputs, np.ones(width), 1.0, trend).free < 2:
        raise ValueError(f"{runs} runs are too few for {width} inputs and a {trend} trend")
    if trend == "linear" and not independent(inputs):
        raise ValueError(f"{runs} runs do not vary in all of {width} inputs, each by itself")
    spread = outputs.std(axis=0)
    varied = np.flatnonzero(spread > 0)
    if len(varied) > MOST_FITTED:
        varied = np.sort(np.random.default_rng(0).choice(varied, MOST_FITTED, replace=False))
    scaled = (outputs[:, varied] - outputs[:, varied].mean(axis=0)) / spread[varied]
    if not len(varied):
        return Kriging(inputs, np.full(width, PRIOR_LENGTH[0]), PRIOR_NUGGET[0], trend)
    bounds = [tuple(np.log(LENGTHS))] * width + [tuple(np.log(NUGGETS))]
    if start is None:
        begins = [np.log([*[length] * width, 1e-2]) for length in STARTS]
    else:
        begins = [np.log([*start.lengths, start.nugget])]
    best = min(
        (
            minimize(
                _misfit,
                begin,
                (inputs, scaled, trend),
                method="L-BFGS-B",
                jac=True,
                bounds=bounds,
                options={"maxiter": MOST_ITERATIONS},
            )
            for begin in begins
        ),
        key=lambda found: found.fun,
    )
    return Kriging(inputs, np.exp(best.x[:-1]), float(np.exp(best.x[-1])), trend)


def centred(outputs: Array) -> Array:
    """Give outputs less their mean over the runs, shape (n, c): a trend takes it up, and round-off is less.

    Coordinates of millions of m that differ by some m would lose all digits of their variance. Outputs that
    all runs agree on become exactly 0.
    """
    found: Array = outputs - outputs[0]
    found -= found.mean(axis=0)
    return found


def independent(inputs: Array) -> bool:
    """Whether runs, (n, inputs), vary in each input by itself, so that they determine a linear trend."""
    basis = np.concatenate([np.ones((len(inputs), 1)), inputs], axis=1)
    return int(np.linalg.matrix_rank(basis)) == 1 + int(inputs.shape[1])


def _misfit(logs: Array, inputs: Array, outputs: Array, trend: Trend) -> tuple[float, Array]:
    """Negative logarithm of the integrated likelihood and the priors, and its gradient."""
    lengths, nugget = np.exp(logs[:-1]), float(np.exp(logs[-1]))
    whole, factors = matern_slopes(inputs, lengths)
    kriging = Kriging(inputs, lengths, nugget, trend)
    basis, free = kriging.basis(inputs), kriging.free
    root = cholesky(whole + nugget * np.eye(len(whole)), lower=True, check_finite=False)
    inverse = _inverse_by(root)
    weighted = inverse @ basis
    root_of_trend = cholesky(basis.T @ weighted, lower=True, check_finite=False)
    known = solve_triangular(root_of_trend, weighted.T, lower=True, check_finite=False)
    precision = inverse - known.T @ known
    residual = precision @ outputs
    held = np.maximum(np.einsum("ic,ic->c", outputs, residual), 1e-12)
    value = float(np.log(np.diag(root)).sum() + np.log(np.diag(root_of_trend)).sum())
    value += 0.5 * free * float(np.mean(np.log(held)))
    # of half the logarithm of both determinants, and of the mean logarithm of the sums of squares
    slope = 0.5 * precision - 0.5 * free * (residual / held) @ residual.T / outputs.shape[1]
    by_length = factors.reshape(len(lengths), -1) @ (slope * whole).ravel()
    gradient = np.append(by_length, nugget * np.trace(slope))
    medians = np.log([PRIOR_LENGTH[0]] * len(lengths) + [PRIOR_NUGGET[0]])
    deviations = np.array([PRIOR_LENGTH[1]] * len(lengths) + [PRIOR_NUGGET[1]])
    offset = (logs - medians) / deviations
    return value + 0.5 * float(offset @ offset), gradient + offset / deviations


def _inverse_by(root: Array) -> Array:
    """Inverse of a symmetric matrix by its lower root, shape (n, n)."""
    found, _ = dpotri(root, lower=1)
    lower: Array = np.tril(found)
    whole: Array = lower + np.tril(lower, -1).T
    return whole
