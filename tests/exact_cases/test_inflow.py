"""Inflow through sections against exact cases: volumes, normal depth, steady profiles, an unsteady front."""

from dataclasses import replace
from itertools import pairwise

import numpy as np
import pytest
from scipy.integrate import solve_ivp
from sections import DISCHARGE, slow_depth, slow_inflow

import solver
from solver.inflow.conditions import Inflow, rating_of
from solver.inflow.entrance import entrance
from solver.inflow.hydrograph import Hydrograph
from solver.inflow.uniform_flow import DEPTHS, law_along, table_of, uniform_speed
from solver.kernels.friction import resistance
from solver.physics.constants import GRAVITY as G
from solver.physics.friction import (
    Bingham,
    Chezy,
    Coulomb,
    Edwards,
    Friction,
    HerschelBulkley,
    Manning,
    OBrien,
    Pouliquen,
    Voellmy,
)
from solver.verification.inflow_cases import (
    STEADY,
    ZONED,
    fed,
    front_errors,
    front_exact,
    steady_errors,
    voellmy,
    zone_errors,
)

BINGHAM = Bingham(1000.0, 100.0, density=2000.0)
HERSCHEL = HerschelBulkley(1000.0, 500.0, 1 / 3, 2000.0)
BEADS = Pouliquen((21.0, 30.7), 0.136, 0.65e-3)
# laws that hold thin layers, each on a slope in degrees
YIELDING = [
    (BINGHAM, 10),
    (replace(BINGHAM, form="linear", factor=1.5), 10),
    (HERSCHEL, 10),
    (replace(HERSCHEL, flow_index=1.5), 3),
    (OBrien(1000.0, 100.0, 0.05, 24.0, 2000.0), 10),
    (Voellmy(4.0, 300.0, 1000.0, 2000.0), 15),
    (replace(BEADS, gamma=0.77), 25),
]
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


def named(value):
    if isinstance(value, tuple):
        return f"{type(value[0]).__name__}, {value[1]}"
    return type(value).__name__ if isinstance(value, Friction) else None


def normally():
    hydrograph = Hydrograph(np.array([0.0, 1.0]), np.array([1.0, 1.0]))
    return Inflow("apex", ((0.0, 0.0), (0.0, 1.0)), hydrograph, "normal")


@pytest.mark.parametrize("law", YIELDING, ids=named)
def test_the_normal_depth_is_where_the_resistance_of_the_kernel_balances_gravity(law):
    """Of every law that holds thin layers, from a millionth above the depth that it holds on."""
    friction, slope = law
    along, normal = G * np.sin(np.radians(slope)), G * np.cos(np.radians(slope))
    depths, speeds = table_of(law_along(friction, G), along, normal)
    some = slice(0, -1, 100)
    balanced = [
        resistance(friction.resistance(G), s, h, normal)
        for s, h in zip(speeds[some], depths[some], strict=True)
    ]
    np.testing.assert_allclose(balanced, along, rtol=1e-11)
    held = depths[0] / (1 + 1e-6)
    assert np.isnan(
        uniform_speed(law_along(friction, G), np.array([held * (1 - 1e-12)]), along, normal)
    ).all()
    # the depth of a discharge, between the depths of the table
    rating = rating_of(normally(), friction, along, normal, G)
    for times in (1.0001, 1.013, 1.5, 2.0, 7.7, 40.0):
        depth = np.array([times * held])
        speed = uniform_speed(law_along(friction, G), depth, along, normal)
        assert rating.depth(float((speed * depth)[0])) == pytest.approx(float(depth[0]), rel=2e-5)


@pytest.mark.parametrize(
    ("slope", "friction", "depth", "speed"),
    [
        (10, BINGHAM, 1, 6.50018),
        (10, BINGHAM, 2, 35.4982),
        (10, replace(BINGHAM, form="linear", factor=1.5), 1, 6.35659),
        (10, replace(BINGHAM, form="linear"), 1, 8.02326),
        (10, HERSCHEL, 1, 16.9197),
        (10, replace(HERSCHEL, flow_index=1 / 2), 1, 4.49350),
        (24, BEADS, 0.01, 0.258783),
    ],
    ids=named,
)
def test_normal_depth_by_laws_that_hold_thin_layers(slope, friction, depth, speed):
    scene = fed(slope, friction, depth * speed, depth="normal")
    made = entrance(scene.inflows[0], scene.points, scene.terrain, friction, G)
    assert made.rating.depth(depth * speed) == pytest.approx(depth, rel=1e-5)


def test_the_normal_depth_of_grains_is_a_power_of_the_discharge():
    """``q = beta h^(5/2) sqrt(g cos)/h_stop`` without a shift: the first table is exact."""
    xi = np.radians(24)
    stop = 0.65e-3 * (np.tan(np.radians(30.7)) - np.tan(xi)) / (np.tan(xi) - np.tan(np.radians(21)))
    rating = rating_of(normally(), BEADS, G * np.sin(xi), G * np.cos(xi), G)
    for depth in (0.002, 0.0123, 0.3):
        discharge = 0.136 * depth**2.5 * np.sqrt(G * np.cos(xi)) / stop
        assert rating.depth(discharge) == pytest.approx(depth, rel=1e-12)


def test_zones_of_a_yield_stress_count_with_their_shares_of_a_section():
    weak, strong = replace(BINGHAM, yield_stress=500), replace(BINGHAM, yield_stress=1500)
    gravity = G * np.sin(0.2), G * np.cos(0.2), G
    mixed = rating_of(replace(normally(), zones=((strong, 0.5),)), weak, *gravity)
    assert mixed.depth(7.0) == pytest.approx(rating_of(normally(), BINGHAM, *gravity).depth(7.0), rel=1e-12)


@pytest.mark.parametrize(
    ("friction", "slope", "why"),
    [
        (Coulomb(8), 10, "no normal depth with this law"),
        (Edwards((12, 26, 15), 0.136, 0.5, 0.136), 20, "no normal depth with this law"),
        (BEADS, 20, "falls by 20 degrees there, where friction holds the flow"),
        (BEADS, 31, "falls by 31 degrees there, where no speed is enough for friction to balance gravity"),
    ],
    ids=named,
)
def test_what_has_no_normal_depth_is_refused(friction, slope, why):
    xi = np.radians(slope)
    with pytest.raises(ValueError, match=why):
        rating_of(normally(), friction, G * np.sin(xi), G * np.cos(xi), G)


@pytest.mark.slow
def test_bingham_flow_at_its_normal_depth_stays_uniform():
    """Faster than its waves, so that depth and speed are those that come in."""
    scene = fed(15, BINGHAM, 10, end=20, depth="normal")
    run = solver.simulate(scene, [20.0])
    depth = entrance(scene.inflows[0], scene.points, scene.terrain, BINGHAM, G).rating.depth(10)
    _, inside = middle(scene, run.depth)
    assert 10 / depth > np.sqrt(G * np.cos(np.radians(15)) * depth)
    np.testing.assert_allclose(inside, depth, rtol=1e-6)


def test_uniform_speed_is_found_from_the_resistance_alone():
    friction, xi = voellmy(0.1, 200), np.radians(20)
    law, normal = law_along(friction, G), G * np.cos(xi)
    exact = np.sqrt(200 * DEPTHS * np.cos(xi) * (np.tan(xi) - 0.1))
    assert uniform_speed(law, DEPTHS, G * np.sin(xi), normal) == pytest.approx(exact, rel=1e-12)
    assert np.isnan(uniform_speed(law, DEPTHS, 0.09 * normal, normal)).all()


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
    errors = [np.abs(zone_errors(d, seed)) for d in (2.0, 1.0, 0.5)]
    assert errors[-1].max() < 4e-5
    # on a cloud over two halvings, as no two are alike
    if seed is None:
        assert errors[0].max() > 3.2 * errors[1].max()
        # 100 m below, where the depth is the one that is known to six digits
        assert errors[-1][4] < 6e-6
    assert errors[0].max() > 9 * errors[2].max()


def test_the_steady_profiles_are_those_of_the_equation():
    x, xi, q = np.array([*STEADY]), np.radians(15), 10.0
    drop, normal = G * np.sin(xi), G * np.cos(xi)
    for profile, first, coefficient in ((STEADY, 0.6, 0.1), (ZONED, 1.0722666, 0.2)):

        def slope(_, h, mu=coefficient):
            return (h * (drop - mu * normal) - G * q**2 / (500 * h**2)) / (normal * h - q**2 / h**2)

        found = solve_ivp(slope, (0, 100), [first], t_eval=x, rtol=1e-10, atol=1e-12).y[0]
        np.testing.assert_allclose(found, [*profile.values()], rtol=5.1e-6)


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
