"""What makes a result on a surface doubtful."""

from dataclasses import replace

import numpy as np

from solver import Coulomb, ElevationModel, Lattice, Scene, simulate
from solver.checks.plausibility import doubts

PLACES = np.arange(0.0, 101.0, 4.0)


def slid():
    """Let a heap slide down a slope of 20 degrees; its fall is at most 40 m."""
    surface = ElevationModel(PLACES, PLACES, np.tile(-np.tan(np.radians(20)) * PLACES, (len(PLACES), 1)))
    points = Lattice((0, 100), (0, 100), 4.0)
    x, y = points.coordinates
    depth = np.maximum(0.0, 2 - ((x - 24) ** 2 + (y - 50) ** 2) / 100)
    scene = Scene(points, surface, depth, 0 * depth, 0 * depth, Coulomb(15.0))
    return scene, simulate(scene, [6.0])


def test_a_run_is_plausible_and_one_faster_than_its_fall_is_not():
    scene, result = slid()
    assert list(doubts(scene, result)) == []
    fastest = result.max_speed.max()
    assert 2 < fastest < np.sqrt(2 * 9.81 * 40)
    (line,) = doubts(scene, replace(result, max_speed=result.max_speed * 50 / fastest))
    assert line.startswith("a speed of 50 m s-1 is")
