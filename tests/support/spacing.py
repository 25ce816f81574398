"""The spacing of graded points in plain NumPy."""

from __future__ import annotations

import numpy as np


def spacing_twin(spacing, x, y):
    s = np.full(np.broadcast(x, y).shape, spacing.coarsest)
    for r in spacing.refinements:
        dx = np.maximum(np.maximum(r.x[0] - x, x - r.x[1]), 0)
        dy = np.maximum(np.maximum(r.y[0] - y, y - r.y[1]), 0)
        s = np.minimum(s, r.spacing + spacing.growth * np.sqrt(dx * dx + dy * dy))
    return s
