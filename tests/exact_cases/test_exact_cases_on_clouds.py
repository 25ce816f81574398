"""Shocks and dam breaks (exact cases 5 and 8) on random points, whose errors are held against a lattice's."""

from dataclasses import replace

import numpy as np
import pytest

from solver.physics.constants import GRAVITY
from solver.physics.earth_pressure import MohrCoulomb
from solver.points.cloud import random_points
from solver.scene import Boundaries
from solver.simulation import simulate
from solver.verification import exact_solutions as exact
from solver.verification.cases import measure, slide
from solver.verification.exact_cases import CASES

SHOCKED = Boundaries("open", "wall", "wall", "wall")


@pytest.mark.parametrize("name", ["Ritter", "Stoker"])
def test_dam_breaks_have_about_the_errors_of_a_lattice(name):
    case, _ = CASES[name]
    errors = []
    for spacing in (1.0, 0.5):
        cloud, lattice = (measure(case, points(spacing)) for points in (case.cloud, case.lattice))
        assert cloud.depth < 1.25 * lattice.depth
        assert cloud.momentum < 1.25 * lattice.momentum
        assert abs(cloud.run.ledger.error) <= 1e-14
        errors.append(cloud.depth_l1)
    assert errors[1] < 0.55 * errors[0]


def test_a_granular_shock_keeps_its_place_within_a_spacing():
    solution, offsets, behind = exact.TravellingShock(), [], []
    end = 6.0 / abs(solution.speed)
    signal = np.sqrt(GRAVITY * np.cos(np.radians(solution.angle)) * solution.downstream)
    bounds, width = (-np.ceil(6 + end * (solution.arriving + 2 * signal)), 20.0), 3.0
    for spacing in (0.4, 0.2):
        count = round((bounds[1] - bounds[0]) * width / spacing**2)
        cloud = random_points(bounds, (0, width), count, 1)
        x = cloud.control_volumes.centroid[:, 0]
        depth, velocity = solution(x, 0.0)
        run = simulate(slide(cloud, depth, velocity, solution.angle, solution.angle, SHOCKED), [end])
        near = np.abs(x - solution.speed * end) < 6 * spacing
        missing = ((solution(x, end)[0] - run.depth[0]) * cloud.cell_area)[near].sum() / width
        offsets.append(abs(missing) / (solution.downstream - solution.upstream))
        passed = x > solution.speed * end + 4 * spacing
        speed = np.hypot(run.velocity_x[0], run.velocity_y[0])
        behind.append(speed[passed].max() / solution.arriving)
        assert offsets[-1] < spacing
        # ahead of the start-up wave everything is at rest, bit for bit
        assert not speed[x > signal * end + 50 * spacing].any()
    assert offsets[1] < offsets[0]
    # a lattice leaves 1e-3; cells of all shapes are not shocked alike
    assert max(behind) < 2e-2
    assert behind[1] <= behind[0]


def test_earth_pressure_that_jumps_across_a_shock_makes_no_oscillations():
    spacing, width = 0.2, 2.0
    cloud = random_points((-60, 30), (0, width), round(90 * width / spacing**2), 1)
    x = cloud.control_volumes.centroid[:, 0]
    ahead = x < 0
    scene = slide(cloud, np.where(ahead, 0.3, 1.0), np.where(ahead, 4.0, 0.0), 20.0, 20.0, SHOCKED)
    depth = simulate(replace(scene, earth_pressure=MohrCoulomb(40.0, 20.0)), [3.0]).depth[0]
    strips = np.digitize(x, np.arange(-60, 30, 2 * spacing))
    area = np.bincount(strips, cloud.cell_area)[1:]
    places, mean = (np.bincount(strips, cloud.cell_area * a)[1:] / area for a in (x, depth))
    shock = places[np.argmax(np.abs(np.diff(mean)))]
    before = mean[(places > shock - 15) & (places < shock - 8 * spacing)]
    behind = mean[places > shock + 8 * spacing]
    jump = behind[0] - before[-1]
    assert jump > 0.3
    for side in (before, behind):
        steps = np.diff(side)
        assert min(steps[steps > 0].sum(), -steps[steps < 0].sum()) < 0.01 * jump
