"""A stream that meets an oblique obstacle: a staircase of cells of a building, or a dam in the terrain.

``python -m solver.verification.deflection_cases`` prints the table of docs/method.md. On flat ground without
friction, beside the oblique shock of a plane, upright wall (`solver.verification.wall_cases.turned`).
"""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from solver.arrays import Array
from solver.physics.constants import GRAVITY
from solver.physics.earthworks import Dam, reshaped
from solver.physics.elevation import ElevationModel
from solver.physics.friction import Coulomb
from solver.points.lattice import Lattice
from solver.result import Result
from solver.scene import Scene
from solver.simulation import simulate
from solver.structures import building_cells
from solver.verification.wall_cases import Shock, turned

C = float(np.sqrt(GRAVITY))
# Length of the obstacle, m; times that the stream passes it.
LONG, PASSES = 60.0, 2.2
# The stream is wider than the obstacle by this on the side that it is turned away from, m.
BESIDE = 16.0
# of the dam, m and degrees
HEIGHT, SIDE_SLOPES = 5.0, (34.0, 60.0)
CASES, SPACINGS = ((3.0, 15.0), (3.0, 20.0)), (1.0, 0.5)
# where the shock is looked at, as shares of the length of the obstacle, and what lies behind it
FIRST, LAST, NEAR, FAR = 0.35, 0.7, 0.6, 0.85


def deflect(froude: float, deflection: float, spacing: float, side_slope: float | None) -> Shock:
    """Let a stream of unit depth along x meet an obstacle.

    Parameters
    ----------
    froude, deflection, spacing
        Of the stream; angle of the obstacle to it, radians; of the lattice, m.
    side_slope : float or None
        Of a dam, degrees; None for a building.
    """
    run, lattice = stream(froude, deflection, spacing, side_slope)
    along, off = (
        np.array([np.cos(deflection), np.sin(deflection)]),
        np.array([-np.sin(deflection), np.cos(deflection)]),
    )
    exact = turned(froude, deflection)
    stations = np.linspace(FIRST, LAST, 25) * LONG
    distances = np.arange(0.0, 1.5 * LONG * np.tan(exact.angle - deflection), spacing / 4)
    places = stations[:, None, None] * along + distances[:, None] * off
    depth, u, v = (_at(lattice, field[-1], places) for field in (run.depth, run.velocity_x, run.velocity_y))
    front = np.array([distances[np.flatnonzero(row > 0.5 * (1 + exact.ratio)).max()] for row in depth])
    slope = float(np.polyfit(stations, front, 1)[0])
    share = distances / (slope * stations[:, None])
    behind = (share > NEAR) & (share < FAR)
    speed = np.hypot(u, v)[behind]
    return Shock(
        float(depth[behind].mean()),
        float(np.arctan(slope)) + deflection,
        float((speed / np.sqrt(GRAVITY * depth[behind])).mean()),
    )


def stream(
    froude: float, deflection: float, spacing: float, side_slope: float | None, height: float = HEIGHT
) -> tuple[Result, Lattice]:
    """Give the run, with one frame at its end, and the lattice; the obstacle begins at the origin."""
    duration = PASSES * LONG / (froude * C)
    end = LONG * np.array([np.cos(deflection), np.sin(deflection)])
    west, east = (froude + 1) * C * duration, end[0] + 2
    north = end[1] + LONG * np.tan(turned(froude, deflection).angle) + C * duration
    south = 2 * BESIDE
    columns, rows = (round(float(size) / spacing) for size in (west + east, south + north))
    x, y = (
        np.asarray(spacing * (np.arange(count) + 0.5 - round(float(before) / spacing)), np.float64)
        for count, before in ((columns, west), (rows, south))
    )
    lattice = Lattice((x[0], x[-1]), (y[0], y[-1]), spacing)
    flat = ElevationModel(x, y, np.zeros((rows, columns)))
    across = lattice.coordinates[1] + 0 * lattice.coordinates[0]
    depth = np.where(
        (across > -BESIDE) & (lattice.coordinates[0] < -HEIGHT / np.tan(np.radians(34))), 1.0, 0.0
    )
    terrain, buildings = flat, None
    if side_slope is None:
        corners = np.array([[0.0, 0.0], [end[0], 0.0], end])
        buildings = building_cells([corners], lattice)
    else:
        terrain = reshaped(flat, [Dam((np.array([[0.0, 0.0], end]),), height, side_slope)])
    scene = Scene(
        *(lattice, terrain, depth, froude * C * depth, 0 * depth, Coulomb(0.0)),
        buildings=buildings,
    )
    return simulate(scene, [duration], stop_at_rest=False), lattice


def _at(lattice: Lattice, field: Array, places: Array) -> Array:
    """Field at places (..., 2), linear between the points."""
    from scipy.ndimage import map_coordinates

    columns = (places[..., 0] - lattice.x_points[0]) / lattice.dx
    rows = (places[..., 1] - lattice.y_points[0]) / lattice.dy
    return np.asarray(map_coordinates(field, [rows, columns], order=1, mode="nearest"))


def table() -> Iterator[str]:
    """Write the cases by obstacle and spacing."""
    yield "| Fr, degrees | obstacle | spacing, m | angle of the shock | h2/h1 | Fr2 |"
    yield "|---|---|---|---|---|---|"
    for froude, degrees in CASES:
        deflection = float(np.radians(degrees))
        for side_slope in (None, *SIDE_SLOPES):
            named = "building" if side_slope is None else f"dam, {side_slope:g} degrees"
            for spacing in SPACINGS:
                shock = deflect(froude, deflection, spacing, side_slope)
                yield f"| {froude:g}, {degrees:g} | {named} | {spacing:g} | {in_words(shock)} |"
        yield f"| {froude:g}, {degrees:g} | plane wall, exact | | {in_words(turned(froude, deflection))} |"


def in_words(shock: Shock) -> str:
    """Write a shock as cells of a row."""
    return f"{np.degrees(shock.angle):.1f} | {shock.ratio:.3f} | {shock.froude:.3f}"


if __name__ == "__main__":
    print("\n".join(table()))
