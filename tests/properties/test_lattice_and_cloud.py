"""Exact case 10, the chute on both layouts; and what graded points save where a flow is smooth in part."""

from dataclasses import replace

import numpy as np

from pipeline.studies.stability import ends
from solver.lmls.gridding import gridding
from solver.points.cloud import graded_points
from solver.points.spacing import Refinement
from solver.scene import WeightedResidual
from solver.simulation import simulate
from solver.verification.cases import CHUTE, dam_break, measure

TIMES, BODY = np.arange(3.0, 25.0, 3.0), 0.02
# the chute, so wide that the flow does not come to the walls
WIDE = replace(CHUTE, y=(-10.0, 10.0))


def extents(depth, lattice):
    """Front, tail and half-width, m."""
    tail, front = ends(lattice.x_points, depth.max(axis=0), BODY)
    low, high = ends(lattice.y_points, depth.max(axis=1), BODY)
    return np.array([front, tail, (high - low) / 2])


def differences(spacing):
    """Largest difference of the extents over all times, m, and of the depth, relative L2."""
    lattice, cloud = WIDE.lattice(spacing), WIDE.cloud(spacing)
    regular, scattered = (
        simulate(CHUTE.scene(points, WeightedResidual()), TIMES) for points in (lattice, cloud)
    )
    grid = gridding(cloud, lattice)
    here = [grid.keeping_integral(depth) for depth in scattered.depth]
    apart = [extents(a, lattice) - extents(b, lattice) for a, b in zip(regular.depth, here, strict=True)]
    norm = [np.linalg.norm(a - b) / np.linalg.norm(a) for a, b in zip(regular.depth, here, strict=True)]
    return np.abs(apart).max(axis=0), max(norm)


def test_lattice_and_cloud_agree_within_a_spacing_and_come_closer():
    coarse, fine = differences(0.4), differences(0.25)
    assert (coarse[0] < 0.4).all()
    assert (fine[0] < 0.25).all()
    assert (fine[0] < coarse[0]).all()
    assert fine[1] < coarse[1] / 1.5


def dam_break_on(cloud):
    """Exact case 3: relative L1 of depth, and the point-steps it took."""
    measured = measure(dam_break(), cloud)
    assert abs(measured.run.ledger.error) < 1e-12
    assert measured.run.depth.min() >= 0
    return measured.depth_l1, measured.run.cell_stages


def test_graded_points_reach_the_error_of_uniform_ones_with_fewer_point_steps():
    bounds = (-60.0, 50.0), (0.0, 10.0)
    # behind the wave that runs up the layer nothing varies
    waves = Refinement((-18.0, 50.0), bounds[1], 0.65)
    uniform, uniform_work = dam_break_on(graded_points(*bounds, 0.7))
    graded, graded_work = dam_break_on(graded_points(*bounds, 3.0, [waves], growth=0.2))
    assert graded <= uniform
    assert graded_work < 0.65 * uniform_work
