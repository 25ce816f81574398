"""The spacing of graded points in plain NumPy."""

from __future__ import annotations

import numpy as np
import shapely

from solver.points.spacing import Corridor


def spacing_twin(spacing, x, y):
    s = np.full(np.broadcast(x, y).shape, spacing.coarsest)
    for r in spacing.refinements:
        if isinstance(r, Corridor):
            line = shapely.LineString(r.line)
            away = shapely.distance(shapely.points(*np.broadcast_arrays(x, y)), line)
            s = np.minimum(s, r.spacing + spacing.growth * np.maximum(away - r.margin, 0))
            continue
        dx = np.maximum(np.maximum(r.x[0] - x, x - r.x[1]), 0)
        dy = np.maximum(np.maximum(r.y[0] - y, y - r.y[1]), 0)
        s = np.minimum(s, r.spacing + spacing.growth * np.sqrt(dx * dx + dy * dy))
    return s
