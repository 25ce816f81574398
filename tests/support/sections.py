"""Lines and scenes that sections are tested with on lattices and on clouds, 0 to 20 by -5 to 5 m."""

import pytest

import solver
from solver.verification.inflow_cases import backwater, fed, voellmy

FLAT, SLOPE = solver.Plane(0), solver.Plane(20)
HEADINGS = pytest.mark.parametrize(
    ("line", "terrain", "way"),
    [
        (((10, 2), (10, -2)), SLOPE, (1, 0)),
        (((10, -2), (10, 2)), solver.Plane(-20), (-1, 0)),
        (((10, -2), (10, 2)), FLAT, (1, 0)),
        (((10, 2), (10, -2)), FLAT, (-1, 0)),
        (((20, -5), (20, 5)), SLOPE, (-1, 0)),
        (((5, -5), (9, -5)), SLOPE, (0, 1)),
        (((5, 5), (9, 5)), FLAT, (0, -1)),
    ],
)
# Of slow inflow, m2 s-1: its Froude number is 0.62, so that its depth comes from the outgoing invariant.
DISCHARGE = 5.0
_NORMAL, _SLOPE, _COEFFICIENT, _TURBULENT = 1.8846553, 5, 0.05, 100


def slow_inflow(share, spacing):
    """A scene with slow inflow above a given depth, a share of the normal one."""
    return fed(
        _SLOPE,
        voellmy(_COEFFICIENT, _TURBULENT),
        DISCHARGE,
        spacing=spacing,
        end=200,
        start=(_NORMAL, DISCHARGE / _NORMAL),
        x_max=share * _NORMAL,
        depth="normal",
        sections=(50,),
        times=(199, 200),
    )


def slow_depth(share, x):
    """Its steady depth at x, m."""
    return backwater(share * _NORMAL, DISCHARGE, _SLOPE, _COEFFICIENT, _TURBULENT, x)
