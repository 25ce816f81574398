"""Numbers of the reconstruction at faces: shape functions, limiter and front rules."""

from __future__ import annotations

# The shape functions of eq. 23 at the far face of the middle of three cells, degree 2, from cell means.
BEHIND, MIDDLE, AHEAD = -1 / 6, 5 / 6, 1 / 3
# Nothing passes from a cell at the front into a dry one until it holds this share of the depth behind it.
FRONT = 0.45
# A cell that shows this multiple of its mean depth at a face has next to nothing anywhere else.
ALL = 1.9
# Share of its depth that a cell shows at least where it moves to.
LEAST = 0.1
