"""Inflow through sections against exact cases: volumes, normal depth, steady profiles, an unsteady front."""

from itertools import pairwise

import numpy as np
import pytest
from sections import DISCHARGE, slow_depth, slow_inflow

import solver
from solver.inflow.conditions import DEPTHS, resistance_of, uniform_speed
from solver.inflow.entrance import entrance
from solver.physics.constants import GRAVITY as G
from solver.physics.friction import Bingham, Chezy, Manning, OBrien
from solver.verification.inflow_cases import (
    fed,
    front_errors,
    front_exact,
    steady_errors,
    voellmy,
    zone_errors,
)

RISE = solver.Hydrograph(np.array([0.0, 5.0, 20.0]), np.array([0.0, 10.0, 0.0]))


@pytest.mark.parametrize("cfl", [0.9, 0.31])
@pytest.mark.parametrize("at", [0.0, 7.0], ids=["boundary", "inside"])
def test_the_volume_of_a_triangle_comes_in_at_any_steps(at, cfl):
    scene = fed(15, voellmy(0.1, 300), 0, length=40, at=at, hydrograph=RISE, cfl=cfl, depth="normal")
    times = np.sort(np.random.default_rng(3).uniform(0, 25, 40))
    result = solver.simulate(scene, times)
    assert result.ledger.inflow == pytest.approx(100, rel=1e-13)
    assert abs(result.ledger.error) < 1e-13
    # nothing has left the slope by the first times: what is there is what has come in
    early = times < 3
    volumes = result.depth.sum(axis=(1, 2)) * scene.points.cell_area
    expected = [RISE.volume_until(t) for t in times]
    assert volumes[early] == pytest.approx(np.array(expected)[early], rel=1e-12)


@pytest.mark.parametrize(
    ("discharge", "slope", "coefficient", "turbulent_friction", "depth", "froude"),
    [
        (5, 10, 0.08, 200, 1.09632, 1.40138),
        (10, 15, 0.1, 500, 1.07227, 2.92577),
        (10, 15, 0.2, 500, 1.44978, 1.86098),
    ],
)
def test_normal_depth(discharge, slope, coefficient, turbulent_friction, depth, froude):
    friction = voellmy(coefficient, turbulent_friction)
    scene = fed(slope, friction, discharge, depth="normal")
    made = entrance(scene.inflows[0], scene.points, scene.terrain, friction, G)
    found = made.rating.depth(discharge)
    assert found == pytest.approx(depth, rel=1e-5)
    wave = np.sqrt(G * np.cos(np.radians(slope)) * found)
    assert discharge / found / wave == pytest.approx(froude, rel=1e-5)


@pytest.mark.parametrize(
    ("slope", "friction", "speed", "close"),
    [
        (5, Manning(manning_n=0.05), 9.37270, 1e-5),
        (5, Chezy(chezy_coefficient=float(np.sqrt(500))), 9.33572, 1e-5),
        (10, OBrien(density=2000, yield_stress=1000, viscosity=100, manning_n=0.05), 10.4449, 1e-4),
    ],
)
def test_normal_depth_by_other_laws(slope, friction, speed, close):
    """Terminal speeds of 2 m: those of sums of powers are between two depths of a table."""
    scene = fed(slope, friction, 2 * speed, depth="normal")
    made = entrance(scene.inflows[0], scene.points, scene.terrain, friction, G)
    assert made.rating.depth(2 * speed) == pytest.approx(2.0, rel=close)


def test_a_law_without_a_normal_depth_is_refused():
    scene = fed(10, Bingham(density=2000, yield_stress=1000, viscosity=100), 5, depth="normal")
    with pytest.raises(ValueError, match="no normal depth with this law"):
        solver.simulate(scene, [0, 1])


def test_uniform_speed_is_found_from_the_resistance_alone():
    friction, xi = voellmy(0.1, 200), np.radians(20)
    resistance = resistance_of(friction, G * np.cos(xi), G)
    exact = np.sqrt(200 * DEPTHS * np.cos(xi) * (np.tan(xi) - 0.1))
    assert uniform_speed(resistance, DEPTHS, G * np.sin(xi)) == pytest.approx(exact, rel=1e-12)
    assert np.isnan(uniform_speed(resistance, DEPTHS, 0.09 * G * np.cos(xi))).all()


@pytest.mark.parametrize("at", [0.0, 10.0], ids=["boundary", "inside"])
def test_normal_flow_stays_uniform_where_it_is_faster_than_its_waves(at):
    scene = fed(15, voellmy(0.1, 500), 10, end=40, at=at, depth="normal")
    x, depth = middle(scene, solver.simulate(scene, [0, 40]).depth)
    assert depth[x > at] == pytest.approx(1.0722666, rel=1e-7)
    assert not depth[x < at].any()


def middle(scene, field):
    """Centres of the cells, and a field (ny, nx) of the last frame along the middle row."""
    return scene.points.x_points, field[-1][1]


def test_the_steady_profile_below_a_section_of_given_depth_converges_in_second_order():
    errors = [np.abs(steady_errors(d)) for d in (1.0, 0.5, 0.25)]
    # the exact values have six digits, which the last two places reach
    assert (errors[-1] < [1e-4, 1e-4, 5e-5, 2e-5, 1e-5]).all()
    steep = [np.log2(a[:3] / b[:3]) for a, b in pairwise(errors)]
    assert (np.array(steep) > 1.7).all()


@pytest.mark.parametrize(
    "seed", [pytest.param(None, id="lattice"), pytest.param(0, id="cloud", marks=pytest.mark.slow)]
)
def test_the_steady_profile_in_a_zone_of_rougher_bed_converges_in_second_order(seed):
    errors = [np.abs(zone_errors(d, seed))[:4] for d in (2.0, 1.0, 0.5)]
    assert errors[-1].max() < 4e-5
    # on a cloud over two halvings, as no two are alike
    if seed is None:
        assert errors[0].max() > 3.2 * errors[1].max()
    assert errors[0].max() > 9 * errors[2].max()


@pytest.mark.parametrize("share", [0.9, 1.3])
def test_slow_inflow_takes_its_depth_from_below(share):
    errors = []
    for spacing in (2.0, 1.0, 0.5):
        scene = slow_inflow(share, spacing)
        result = solver.simulate(scene, [0, 200])
        x, depth = middle(scene, result.depth)
        exact = slow_depth(share, x)
        errors.append(np.abs(depth - exact)[x < 90].max())
        # the discharge is that of the section, whatever the depth
        assert result.sections.discharge[0, 1] == pytest.approx(3 * spacing * DISCHARGE, rel=1e-8)
    assert errors[-1] < 1e-3
    assert errors[0] > 1.7 * errors[1] > 1.7**2 * errors[2]


def test_the_front_is_the_one_known():
    x = np.array([25.0912 - 1e-3, 50, 69.8176 - 1e-3, 69.8176 + 1e-3])
    depth, speed = front_exact(x, 5.0)
    assert depth == pytest.approx([1, 0.196324, 0, 0], abs=1e-6)
    assert speed[:2] == pytest.approx([8, 11.3212], rel=1e-5)


@pytest.mark.parametrize("at", [0.0, 10.0], ids=["boundary", "inside"])
def test_flow_on_to_a_dry_bed_converges(at):
    errors = np.abs([front_errors(d, at) for d in (1.0, 0.5, 0.25)])
    # L1 of depth, depth and speed at x = 50
    assert (errors[:-1, :3] / errors[1:, :3] > 1.8).all()
    assert errors[-1, 0] < 0.006
    assert (errors[:, 3] < 1e-13).all()


@pytest.mark.parametrize(
    ("law", "peak"),
    [("rickenmann-1999", 214.783), ("mizuyama-1992-granular", 177.965), ("mizuyama-1992-muddy", 27.1743)],
)
def test_peak_discharges_of_a_volume(law, peak):
    triangle = solver.Triangle(volume=1e4, peak_discharge=law)
    graph = triangle.hydrograph()
    assert graph.discharges.max() == pytest.approx(peak, rel=1e-5)
    assert graph.times[-1] == pytest.approx(2e4 / peak, rel=1e-5)
    assert graph.volumes[-1] == pytest.approx(1e4, rel=1e-14)
