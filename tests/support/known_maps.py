"""Fields of runs in closed form: a smooth sheet whose edge moves with two parameters."""

import numpy as np
from scipy.stats import qmc

X, Y = np.linspace(0, 100, 26), np.linspace(-40, 40, 21)


def places(count, seed=0):
    """Give Sobol points of the unit square, shape (count, 2)."""
    return qmc.Sobol(2, rng=np.random.default_rng(seed)).random(count)


def depths(at, x=X, y=Y, thinner=0.0):
    """Give depths of runs, shape (runs, ny, nx): deepest uphill, farther and wider with either parameter."""
    reach = 35 + 35 * at[:, 0] + 15 * at[:, 1] ** 2
    half = 15 + 12 * at[:, 1]
    along = x[None, None, :] / reach[:, None, None]
    across = y[None, :, None] / half[:, None, None]
    return np.maximum(2.0 - thinner - 1.6 * along - 0.8 * across**2, 0.0)
