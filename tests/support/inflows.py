"""Slopes one cell wide in effect, fed through a section at x = 0 or inside."""

import numpy as np

import solver

G = 9.81


def fed(
    slope,
    friction,
    discharge,
    *,
    spacing=1.0,
    length=100.0,
    end=100.0,
    at=0.0,
    start=(0.0, 0.0),
    x_max="open",
    cfl=0.9,
    sections=(),
    times=(),
    hydrograph=None,
    **condition,
):
    """A plane of three rows between walls; ``discharge`` per width, from time 0 until after ``end``.

    start : depth and velocity on it. condition : of the inflow.
    """
    half = spacing / 2
    lattice = solver.Lattice((half, length - half), (-spacing, spacing), spacing)
    width, flat = 3 * spacing, np.zeros(lattice.shape)
    if hydrograph is None:
        hydrograph = solver.Hydrograph(np.array([0.0, end + 1]), np.full(2, discharge * width))
    line = ((at, -width / 2), (at, width / 2))
    return solver.Scene(
        lattice,
        solver.Plane(slope),
        flat + start[0],
        flat + start[1],
        flat,
        friction,
        gravity=G,
        boundaries=solver.Boundaries(x_max=x_max, y_min="wall", y_max="wall"),
        scheme=solver.WeightedResidual(cfl=cfl),
        inflows=(solver.Inflow("top", line, hydrograph, **condition),),
        sections=tuple(solver.Section(f"at {x}", ((x, -width / 2), (x, width / 2))) for x in sections),
        section_times=times,
    )


def voellmy(coefficient, turbulent_friction):
    return solver.Voellmy(float(np.degrees(np.arctan(coefficient))), turbulent_friction)


def middle(scene, field):
    """Centres of the cells, and a field (ny, nx) of the last frame along the middle row."""
    return scene.points.x_points, field[-1][1]
