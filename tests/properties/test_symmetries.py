"""What the equations cannot tell apart, the solver must not either."""

from dataclasses import replace

import numpy as np
import pytest

from solver.physics.earth_pressure import MohrCoulomb
from solver.physics.friction import Coulomb, Voellmy
from solver.physics.terrain import Plane
from solver.points.lattice import Lattice
from solver.release.initial_state import initial_state
from solver.release.shapes import Paraboloid
from solver.scene import Scene
from solver.simulation import simulate
from solver.verification import cases


def chute(spacing=0.25, **changes):
    return replace(cases.chute(cases.CHUTE.lattice(spacing), cases.CONSERVATIVE), **changes)


def patch(centre, x=(0.0, 40.0), y=(-10.0, 10.0), terrain=None):
    """A heap that slides on a plane, far from all sides."""
    lattice = Lattice(x, y, 0.5)
    laid = initial_state([Paraboloid(centre, (3.0, 2.0), 1.0)], lattice)
    return Scene(
        lattice,
        terrain or Plane(32.0),
        laid.depth,
        laid.velocity_x,
        laid.velocity_y,
        Coulomb(25.0),
        MohrCoulomb(35.0, 25.0),
    )


def frames(run):
    return np.stack([run.depth, run.velocity_x, run.velocity_y])


@pytest.mark.parametrize("friction", [Coulomb(30.0), Voellmy(28.0, 50.0)])
@pytest.mark.parametrize("phi", [30.0, 38.0])
def test_a_scene_symmetric_about_the_axis_stays_so_to_the_last_bit(friction, phi):
    scene = chute(friction=friction, earth_pressure=MohrCoulomb(phi, friction.bed_friction))
    run = simulate(scene, [3.0, 9.0, 15.0, 24.0])
    assert (run.depth == run.depth[:, ::-1]).all()
    assert (run.velocity_x == run.velocity_x[:, ::-1]).all()
    assert (run.velocity_y == -run.velocity_y[:, ::-1]).all()


def test_mirroring_the_scene_mirrors_the_result_to_the_last_bit():
    scene = patch((8.0, 3.0))
    mirrored = replace(scene, depth=scene.depth[::-1].copy())
    here, there = simulate(scene, [1.0, 2.5]), simulate(mirrored, [1.0, 2.5])
    assert (here.depth == there.depth[:, ::-1]).all()
    assert (here.velocity_y == -there.velocity_y[:, ::-1]).all()


def test_turning_slope_and_flow_round_turns_the_result_round():
    scene = patch((8.0, 0.0))
    turned = replace(scene, terrain=Plane(-32.0), depth=scene.depth[:, ::-1].copy())
    here, there = simulate(scene, [1.0, 2.5]), simulate(turned, [1.0, 2.5])
    np.testing.assert_allclose(here.depth, there.depth[:, :, ::-1], atol=1e-13)
    np.testing.assert_allclose(here.velocity_x, -there.velocity_x[:, :, ::-1], atol=1e-11)


def test_a_shift_along_a_plane_shifts_the_result():
    here = simulate(patch((8.0, 0.0)), [2.0])
    there = simulate(patch((108.0, 50.0), (100.0, 140.0), (40.0, 60.0)), [2.0])
    np.testing.assert_allclose(here.depth, there.depth, atol=1e-13)
    np.testing.assert_allclose(here.velocity_x, there.velocity_x, atol=1e-10)


def test_a_wider_domain_gives_the_same_flow_to_the_last_bit():
    here = simulate(patch((8.0, 0.0)), [2.0])
    there = simulate(patch((8.0, 0.0), (0.0, 80.0), (-40.0, 40.0)), [2.0])
    inner = there.depth[:, 60:101, :81]
    assert (here.depth == inner).all()
    assert there.depth.sum() == pytest.approx(inner.sum(), rel=1e-15)
    assert here.cell_stages == there.cell_stages


@pytest.mark.parametrize(("factor", "tolerance"), [(4.0, 0.0), (0.25, 0.0), (3.0, 1e-9)])
def test_gravity_scales_time_and_nothing_else(factor, tolerance):
    times = np.array([3.0, 9.0, 18.0])
    slow = simulate(chute(0.4), times)
    fast = simulate(chute(0.4, gravity=factor), times / np.sqrt(factor))
    assert fast.steps == slow.steps
    np.testing.assert_allclose(fast.depth, slow.depth, rtol=0, atol=tolerance)
    np.testing.assert_allclose(
        fast.velocity_x / np.sqrt(factor), slow.velocity_x, rtol=0, atol=1e3 * tolerance
    )


@pytest.mark.parametrize("unit", [4.0, 0.25])
def test_length_scales_with_the_square_of_time(unit):
    scene = patch((8.0, 0.0))
    lattice = Lattice((0.0, 40.0 * unit), (-10.0 * unit, 10.0 * unit), 0.5 * unit)
    large = replace(scene, points=lattice, depth=scene.depth * unit)
    here, there = simulate(scene, [2.0]), simulate(large, [2.0 * np.sqrt(unit)])
    assert (here.depth * unit == there.depth).all()
    assert (here.velocity_x * np.sqrt(unit) == there.velocity_x).all()


def test_the_chute_comes_to_rest_and_its_volume_is_exact():
    run = simulate(chute(), [24.0, 48.0, 60.0])
    assert 30 < run.rest_time < 45
    assert not run.velocity_x[1:].any()
    assert (run.depth[1] == run.depth[2]).all()
    assert abs(run.ledger.error) <= 1e-14
    assert run.ledger.outflow == 0
