"""Flow against walls of buildings: a stream that is stopped, and one that is turned, beside the exact shocks.

``python -m solver.verification.wall_cases`` prints the tables of docs/method.md. The ground is flat and
without friction; on a slope as steep as friction a stream is the same. The speed of waves is ``sqrt(g h)``.
On a cloud its cells end at the walls, and what it makes is looked at on the lattice of the same spacing.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.optimize import brentq

from solver.arrays import Array
from solver.lmls.gridding import gridding
from solver.physics.constants import GRAVITY
from solver.physics.friction import Coulomb
from solver.physics.terrain import Plane
from solver.points.cloud import PointCloud, graded_points
from solver.points.lattice import Lattice
from solver.scene import Boundaries, Scene
from solver.simulation import simulate
from solver.structures import building_cells

C = float(np.sqrt(GRAVITY))
# Cells that the building across a stream is thick.
THICK = 2
# Distance of the edge of a wall from where the stream comes in, m; times that the stream passes the wall.
EDGE, PASSES = 3.0, 3.0
STOPPED, SPACINGS = (2.0, 3.0, 5.0), (1.0, 0.5, 0.25)
# Of the clouds.
SEED = 1
TURNED = ((3.0, 15.0), (3.0, 20.0), (5.0, 20.0), (5.0, 30.0))


@dataclass(frozen=True)
class Shock:
    """A stationary or moving shock: ratio of the depths, and what the case is measured by.

    Parameters
    ----------
    angle : float
        Between the shock and the stream before it, radians.
    froude : float
        Behind it.
    """

    ratio: float
    angle: float = np.nan
    froude: float = np.nan


def stopped(froude: float) -> float:
    """Ratio of depths across the bore that runs back from a wall across a stream of unit depth.

    With ``s = c Fr/(r - 1)`` the bore's speed it solves ``Fr + s/c = sqrt(r (r + 1)/2)``.
    """

    def excess(ratio: float) -> float:
        return froude + froude / (ratio - 1) - float(np.sqrt(ratio * (ratio + 1) / 2))

    return float(brentq(excess, 1 + 1e-9, 10 + 10 * froude))


def turned(froude: float, deflection: float) -> Shock:
    """Oblique shock of a stream that a wall turns by an angle in radians, the weaker of the two (Ippen 1949).

    Normal to the shock ``r = (sqrt(1 + 8 Fr^2 sin^2 b) - 1)/2``, and ``tan b = r tan(b - deflection)``.
    """

    def ratio(b: float) -> float:
        return float(np.sqrt(1 + 8 * (froude * np.sin(b)) ** 2) - 1) / 2

    def excess(b: float) -> float:
        return float(np.tan(b) - ratio(b) * np.tan(b - deflection))

    angles = np.linspace(max(deflection, np.arcsin(1 / froude)) + 1e-9, np.pi / 2 - 1e-6, 4000)
    signs = np.sign([excess(b) for b in angles])
    first = int(np.flatnonzero(signs[1:] != signs[:-1])[0])
    angle = float(brentq(excess, angles[first], angles[first + 1]))
    behind = froude * np.cos(angle) / np.cos(angle - deflection) / np.sqrt(ratio(angle))
    return Shock(ratio(angle), angle, float(behind))


@dataclass(frozen=True)
class Stopped:
    """What a lattice or a cloud makes of a stream against a wall.

    Parameters
    ----------
    ratio : float
        Of depths, at the wall.
    speed : float
        Of the bore from 4 m to 8 m, over that of waves.
    volume_error : float
        Of the ledger.
    """

    ratio: float
    speed: float
    volume_error: float


def stop(froude: float, spacing: float, seed: int | None = None) -> Stopped:
    """Let a stream of unit depth run against a building until its bore is 8 m away.

    seed : of a cloud; a lattice without one.
    """
    exact = stopped(froude)
    duration = 8.0 / (C * froude / (exact - 1))
    # what leaves no trace of the end of the stream near the wall
    count = round(((froude + 1) * C * duration + 12) / spacing)
    lattice = Lattice(
        (spacing / 2, (count + THICK - 0.5) * spacing), (0, (3 if seed is None else 7) * spacing), spacing
    )
    corners = _box(count * spacing, lattice.extent[1][0] - 1, np.inf, np.inf, lattice)
    points, building = _points(lattice, corners, seed)
    stream = np.where(building, 0.0, 1.0)
    scene = Scene(
        *(points, Plane(0.0), stream, froude * C * stream, 0 * stream, Coulomb(0.0)),
        buildings=building,
        boundaries=Boundaries("open", "open", "wall", "wall"),
    )
    run = simulate(scene, [duration / 2, duration], stop_at_rest=False)
    from_wall = np.asarray(spacing * (np.arange(count) + 0.5), np.float64)
    depths = _on(lattice, scene, run.depth).mean(axis=1)[:, count - 1 :: -1]
    half, whole = (_height(depth, from_wall, 0.5 * (1 + exact)) for depth in depths)
    ratio = float(depths[1, : round(4 / spacing)].mean())
    return Stopped(ratio, (whole - half) / (duration / 2) / C, run.ledger.error)


def turn(
    froude: float, deflection: float, spacing: float, long: float = 24.0, seed: int | None = None
) -> Shock:
    """Let a stream of unit depth run obliquely against a building along the lattice, until it is steady.

    The building is one cell thick and begins `EDGE` m behind the side that the stream comes in by; before it
    the stream leaves through the open side.

    Parameters
    ----------
    froude, deflection, spacing
        Of the stream; by which angle the wall turns it, radians; of the points, m.
    long : float
        Length of the wall, m.
    seed : int, optional
        Of a cloud; a lattice without one.
    """
    exact = turned(froude, deflection)
    rows = round(1.7 * long * float(np.tan(exact.angle - deflection)) / spacing)
    columns = round((EDGE + long) / spacing)
    lattice = Lattice(
        (spacing / 2, (columns - 0.5) * spacing), (-spacing / 2, (rows - 0.5) * spacing), spacing
    )
    x, y = lattice.coordinates
    points, building = _points(lattice, _box(EDGE, -np.inf, np.inf, 0.0, lattice), seed)
    stream = np.where(building, 0.0, 1.0)
    u, v = (froude * C * part * stream for part in (np.cos(deflection), -np.sin(deflection)))
    scene = Scene(
        *(points, Plane(0.0), stream, u, v, Coulomb(0.0)),
        buildings=building,
        boundaries=Boundaries(1.0, "open", "open", 1.0),
    )
    run = simulate(scene, [PASSES * long / (froude * C)], stop_at_rest=False)
    h, v_x, v_y = (_on(lattice, scene, f)[0, 1:] for f in (run.depth, run.velocity_x, run.velocity_y))
    there = (x[0] > EDGE + 0.4 * long) & (x[0] < EDGE + 0.9 * long)
    front = np.array([_height(column, y[1:, 0], 0.5 * (1 + exact.ratio)) for column in h[:, there].T])
    slope = float(np.polyfit(x[0, there], front, 1)[0])
    # well behind the shock
    behind = there & (y[1:] < 0.7 * slope * (x[1:] - EDGE)) & (y[1:] > 0.1 * slope * (x[1:] - EDGE))
    speed = np.hypot(v_x, v_y)[behind]
    froude_behind = float((speed / np.sqrt(GRAVITY * h[behind])).mean())
    return Shock(float(h[behind].mean()), float(np.arctan(slope)) + deflection, froude_behind)


def _box(west: float, south: float, east: float, north: float, lattice: Lattice) -> Array:
    """Corners of a rectangle, no farther out than a metre from the cells of a lattice."""
    (x_0, x_1), (y_0, y_1) = lattice.extent
    west, south, east, north = (
        max(west, x_0 - 1),
        max(south, y_0 - 1),
        min(east, x_1 + 1),
        min(north, y_1 + 1),
    )
    return np.array([[west, south], [east, south], [east, north], [west, north]])


def _points(
    lattice: Lattice, corners: Array, seed: int | None
) -> tuple[Lattice | PointCloud, NDArray[np.bool_]]:
    """Give a lattice, or a cloud of its extent and spacing, and which of the cells are a building."""
    points: Lattice | PointCloud = lattice
    if seed is not None:
        points = graded_points(*lattice.extent, lattice.dx, seed=seed, outlines=[corners])
    return points, building_cells([corners], points)


def _on(lattice: Lattice, scene: Scene, frames: Array) -> Array:
    """Give frames of a scene on a lattice, (frames, ny, nx)."""
    if isinstance(scene.points, Lattice):
        return frames
    grid = gridding(scene.points, lattice, scene.buildings)
    return np.stack([grid.within_range(frame.astype(np.float64)) for frame in frames])


def _height(depth: Array, y: Array, level: float) -> float:
    """Where the depth of a column falls to a level, linear between cells, m."""
    last = int(np.flatnonzero(depth > level).max())
    share = (depth[last] - level) / (depth[last] - depth[last + 1])
    return float(y[last] + share * (y[last + 1] - y[last]))


def tables() -> Iterator[str]:
    """Write both cases as tables, spacing by spacing."""
    yield "| stream against a wall, Fr | spacing, m | lattice: h2/h1 | bore over c | cloud: h2/h1 | bore |"
    yield "|---|---|---|---|---|---|"
    for froude in STOPPED:
        ratio = stopped(froude)
        for spacing in SPACINGS:
            both = (stop(froude, spacing, seed) for seed in (None, SEED))
            told = " | ".join(f"{found.ratio:.4f} | {found.speed:.4f}" for found in both)
            yield f"| {froude:g} | {spacing:g} | {told} |"
        yield f"| {froude:g} | exact | {ratio:.4f} | {froude / (ratio - 1):.4f} | | |"
    yield ""
    yield (
        "| stream turned by a wall, Fr, degrees | spacing, m | lattice: angle of the shock | h2/h1 | Fr2 "
        "| cloud: angle | h2/h1 | Fr2 |"
    )
    yield "|---|---|---|---|---|---|---|---|"
    for froude, degrees in TURNED:
        deflection = float(np.radians(degrees))
        named = f"{froude:g}, {degrees:g}"
        for spacing in SPACINGS:
            shocks = [turn(froude, deflection, spacing, seed=seed) for seed in (None, SEED)]
            yield f"| {named} | {spacing:g} | {' | '.join(map(_row, shocks))} |"
        yield f"| {named} | exact | {_row(turned(froude, deflection))} | | | |"


def _row(shock: Shock) -> str:
    return f"{np.degrees(shock.angle):.2f} | {shock.ratio:.4f} | {shock.froude:.4f}"


if __name__ == "__main__":
    print("\n".join(tables()))
