"""Whether a place lies among others, so that what is predicted there is between what is known."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray
from scipy.optimize import linprog

Array = NDArray[np.float64]


def inside(places: Array, known: Array) -> NDArray[np.bool_]:
    """Whether places lie in the convex hull of known ones.

    Parameters
    ----------
    places : array, shape (m, inputs)
        What is asked about.
    known : array, shape (n, inputs)
        What the hull is of.

    Returns
    -------
    array of bool, shape (m,)
    """
    # a mean of the known places with weights of at least 0 that is the place
    rows = np.concatenate([known.T, np.ones((1, len(known)))])
    cost = np.zeros(len(known))
    return np.array(
        [
            linprog(cost, A_eq=rows, b_eq=np.append(place, 1.0), method="highs").status == 0
            for place in places
        ],
        dtype=bool,
    )
