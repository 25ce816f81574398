"""Inflow on clouds against exact cases: volumes, uniform, steady and backwater flow, an unsteady front."""

from itertools import pairwise

import numpy as np
import pytest
from sections import DISCHARGE, slow_depth, slow_inflow

import solver
from solver.verification.inflow_cases import (
    distances,
    fed,
    front_errors,
    scattered,
    steady_errors,
    voellmy,
)

RISE = solver.Hydrograph(np.array([0.0, 5.0, 20.0]), np.array([0.0, 10.0, 0.0]))
PLACES = pytest.mark.parametrize("at", [0.0, 7.0], ids=["boundary", "inside"])


@pytest.mark.parametrize("cfl", [0.9, 0.31])
@PLACES
def test_the_volume_of_a_triangle_comes_in_at_any_steps(at, cfl):
    scene = scattered(
        fed(15, voellmy(0.1, 300), 0, length=40, at=at, hydrograph=RISE, cfl=cfl, depth="normal"), seed=2
    )
    graph = scene.inflows[0].hydrograph
    times = np.sort(np.random.default_rng(3).uniform(0, 25, 40))
    result = solver.simulate(scene, times)
    assert result.ledger.inflow == pytest.approx(200, rel=1e-13)
    assert abs(result.ledger.error) < 1e-13
    # nothing has left the slope by the first times: what is there is what has come in
    early = times < 3
    volumes = result.depth @ scene.points.cell_area
    expected = np.array([graph.volume_until(t) for t in times])
    assert volumes[early] == pytest.approx(expected[early], rel=1e-12)


@PLACES
def test_normal_flow_stays_uniform_where_it_is_faster_than_its_waves(at):
    scene = scattered(fed(15, voellmy(0.1, 500), 10, end=40, at=at, depth="normal"), seed=1)
    depth, x = solver.simulate(scene, [0, 40]).depth[-1], distances(scene)
    # inside, the faces of a section are not in one line, and what comes in takes some metres to even out
    close = 1e-6 if at == 0 else 1e-2
    assert depth[x > at + 10] == pytest.approx(1.0722666, rel=close)
    assert depth[x > 90] == pytest.approx(1.0722666, rel=1e-6 if at == 0 else 1e-4)
    assert not depth[x < at - 2].any()


def test_the_steady_profile_below_a_section_of_given_depth_converges_in_second_order():
    errors = [np.abs(steady_errors(d, seed=0))[:3] for d in (2.0, 1.0, 0.5)]
    steep = [np.log2(a / b) for a, b in pairwise(errors)]
    assert (np.array(steep) > 1.7).all()
    # with fewer cells than a lattice has to be as near
    assert (errors[1] < np.abs(steady_errors(1.0))[:3]).all()


def test_below_a_section_inside_the_steady_profile_converges_in_first_order():
    # faces stand half a cell off the line at most, on either side, where the depth rises by 0.015 a metre
    errors = [
        np.sqrt(np.mean([steady_errors(d, 10.0, seed=k)[:3] ** 2 for k in range(2)]))
        for d in (1.0, 0.5, 0.25)
    ]
    assert errors[0] > 1.8 * errors[1] > 1.8**2 * errors[2]
    assert errors[-1] < 0.1 * 0.015 * 0.25


@pytest.mark.parametrize("share", [0.9, 1.3])
def test_slow_inflow_takes_its_depth_from_below(share):
    errors = []
    for spacing in (2.0, 1.0, 0.5):
        scene = scattered(slow_inflow(share, spacing), seed=0)
        result = solver.simulate(scene, [0, 200])
        x = distances(scene)
        exact = slow_depth(share, x)
        errors.append(np.abs(result.depth[-1] - exact)[x < 90].mean())
        # the discharge is that of the section, whatever the depth
        assert result.sections.discharge[0, 1] == pytest.approx(6 * spacing * DISCHARGE, rel=1e-7)
    # largest beside the end of given depth, which counts for more than on a lattice
    assert errors[-1] < 5e-4
    assert errors[0] > 1.9 * errors[1] > 1.9**2 * errors[2]


@pytest.mark.parametrize("at", [0.0, 10.0], ids=["boundary", "inside"])
def test_flow_on_to_a_dry_bed_converges(at):
    errors = np.abs([front_errors(d, at, seed=0) for d in (1.0, 0.5, 0.25)])
    # L1 of depth, depth and speed at x = 50: over two halvings, as no two clouds are alike
    assert (errors[0, :3] / errors[2, :3] > 1.8**2).all()
    assert (errors[:-1, :3] > 1.3 * errors[1:, :3]).all()
    assert errors[-1, 0] < 0.006
    assert (errors[:, 3] < 1e-13).all()
