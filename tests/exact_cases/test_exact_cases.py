"""The scheme against exact solutions, over spacings, with fitted orders."""

from dataclasses import replace
from itertools import pairwise

import numpy as np
import pytest
from scenes import material

from solver.kernels.earth_pressure import at_rest
from solver.physics.earth_pressure import MohrCoulomb
from solver.physics.friction import Coulomb, Voellmy
from solver.physics.terrain import Plane
from solver.points.lattice import Lattice
from solver.scene import Boundaries, Scene
from solver.simulation import simulate
from solver.verification import exact_cases
from solver.verification import exact_solutions as exact
from solver.verification.cases import (
    CONSERVATIVE,
    WALLED,
    cap,
    compare,
    dam_break,
    measure,
    relative_l2,
    slide,
)
from solver.verification.exact_cases import CASES, COLUMNS, column_collapse, order, row, travelling_shock

# case: largest error at the finest spacing, and least order, of depth in L2, momentum in L2, depth in L1
LIMITS = {
    "frictionless cap": ((2.7e-3, 2.4e-3, 1.3e-3), (1.25, 1.25, 1.6)),
    "dam break 22/21": ((2.2e-3, 7.5e-3, 1.177e-3), (0.9, 0.9, 1.0)),
    "dam break 30/20": ((2.6e-3, 3.5e-3, 1.15e-3), (0.95, 0.95, 1.05)),
    "parabolic cap": ((4.4e-4, 4.2e-4, 1.6e-4), (1.2, 1.2, 1.5)),
    "Ritter": ((4.8e-3, 2.3e-2, 3.6e-3), (0.95, 0.95, 1.05)),
    "Stoker": ((1.8e-2, 7.8e-2, 3.9e-3), (0.4, 0.3, 0.95)),
}


@pytest.fixture(scope="module", params=CASES)
def ladder(request):
    case, spacings = CASES[request.param]
    return request.param, spacings, [measure(case, case.lattice(spacing)) for spacing in spacings]


def test_errors_fall_at_the_stated_order_to_the_stated_size(ladder):
    name, spacings, measured = ladder
    largest, least = LIMITS[name]
    for norm, limit, slope in zip(("depth", "momentum", "depth_l1"), largest, least, strict=True):
        errors = [getattr(one, norm) for one in measured]
        assert errors[-1] <= limit, norm
        assert order(errors, spacings) >= slope, norm


def test_the_frictionless_cap_converges_on_fine_lattices_too():
    """Films that stopped beside the flow braked its sides, the more the finer: 7.96e-4 at 0.5 m."""
    case, spacings = cap(), (2.0, 1.0, 0.5)
    runs = [measure(case, case.lattice(spacing)) for spacing in spacings]
    errors = [one.depth for one in runs]
    assert errors[-1] < 5e-4
    assert min(a / b for a, b in pairwise(errors)) > 2.2
    # nothing is left of the tail that rears had, 2.5e-6 of the volume at 1 m
    solution, points = exact.FrictionlessCap(), case.lattice(1.0)
    way = 9.81 * np.sin(np.radians(solution.angle)) * case.time**2 / 2
    x, y = points.coordinates
    edge = np.sqrt((case.expected(points, CONSERVATIVE)[0] > 0).sum() / np.pi)
    behind = (x < way) & (np.hypot(x - way, y) > edge + 2)
    h = runs[1].run.depth[-1]
    wet = h > CONSERVATIVE.wet_limit * solution.height
    assert h[behind & wet].sum() < 1e-8 * h.sum()


def test_most_of_the_error_of_a_dam_break_is_made_while_it_opens():
    case, start, solution = dam_break(), 0.5, exact.DamBreak()
    points = case.lattice(0.25)
    whole = case.scene(points, CONSERVATIVE)
    x = points.coordinates[0]
    # from then on its opening spans cells enough
    depth = exact.cell_means(solution, x.ravel(), points.dx, start).reshape(x.shape)
    opened = replace(whole, depth=depth, velocity_x=solution(x, start)[1])
    late = compare(case, opened, simulate(opened, [case.time - start]))
    assert late.depth_l1 < 0.25 * compare(case, whole, simulate(whole, [case.time])).depth_l1


def test_volume_is_exact_to_round_off_and_depth_never_negative(ladder):
    for one in ladder[2]:
        assert abs(one.run.ledger.error) <= 1e-14
        assert one.run.depth.min() >= 0


@pytest.mark.parametrize("spacing", [0.4, 0.2, 0.1])
def test_granular_shock_keeps_its_place_and_leaves_the_layer_behind_it_at_rest(spacing):
    shock = travelling_shock(spacing)
    assert shock.offset <= 0.2
    assert shock.behind <= 1e-3
    assert shock.start_up <= 2e-3
    # material further ahead is exactly at rest, bit for bit
    assert shock.precursor <= 50


@pytest.mark.parametrize("spacing", [0.2, 0.1])
def test_earth_pressure_that_jumps_across_a_shock_makes_no_oscillations(spacing):
    lattice = row((-60.0, 30.0), spacing)
    x, pressure = lattice.x_points, MohrCoulomb(40.0, 20.0)
    assert pressure.coefficients().x_passive > 10 * pressure.coefficients().x_active
    sides = Boundaries("open", "wall", "wall", "wall")
    scene = slide(lattice, np.where(x < 0, 0.3, 1.0), np.where(x < 0, 4.0, 0.0), 20.0, 20.0, sides)
    depth = simulate(replace(scene, earth_pressure=pressure), [3.0]).depth[0, 1]
    shock = x[np.argmax(np.abs(np.diff(depth)))]
    before, behind = depth[(x > shock - 15) & (x < shock - 4 * spacing)], depth[x > shock + 4 * spacing]
    jump = behind[0] - before[-1]
    assert jump > 0.3
    for side in (before, behind):
        steps = np.diff(side)
        assert min(steps[steps > 0].sum(), -steps[steps < 0].sum()) < 0.01 * jump


@pytest.mark.parametrize("aspect", [0.2, 0.8])
@pytest.mark.parametrize("kind", COLUMNS)
def test_a_column_runs_out_as_far_as_sand_where_its_deposit_is_a_tenth_as_high(kind, aspect):
    *_, distance = column_collapse(aspect, kind)
    assert distance == pytest.approx(COLUMNS[kind], rel=0.3)


def test_uniform_layer_slides_to_an_exact_stop():
    lattice = row((0.0, 40.0), 0.25)
    x = lattice.x_points
    scene = slide(lattice, 0.5 + 0 * x, 3.0 + 0 * x, 20.0, 30.0, WALLED)
    braking = 9.81 * (np.cos(np.radians(20)) * np.tan(np.radians(30)) - np.sin(np.radians(20)))
    stop = 3.0 / braking
    times = np.linspace(0.1, 1.5, 8) * stop
    run = simulate(scene, times)
    far = x > 25  # what the open rear cannot have reached
    for time, u in zip(times, run.velocity_x[:, 1, far], strict=True):
        np.testing.assert_allclose(u, max(0.0, 3.0 - braking * time), rtol=1e-12, atol=1e-13)
    assert (run.velocity_x[-1][:, far] == 0).all()
    # the distance slid is what went out over the layer's cross section
    width = lattice.dy * lattice.shape[0]
    slid = run.ledger.outflow / (0.5 * width)
    assert slid == pytest.approx(3.0**2 / (2 * braking), rel=1e-4)


def test_terminal_velocity_of_a_voellmy_layer_is_exact():
    lattice = row((0.0, 50.0), 1.0)
    x = lattice.x_points
    scene = slide(lattice, 2.0 + 0 * x, 0 * x, 30.0, 15.0, Boundaries(2.0, "open", "wall", "wall"))
    run = simulate(replace(scene, friction=Voellmy(15.0, 400.0)), [120.0])
    xi, mu = np.radians(30), np.tan(np.radians(15))
    terminal = np.sqrt(400.0 * 2.0 * (np.sin(xi) - mu * np.cos(xi)))
    np.testing.assert_allclose(run.velocity_x[-1][1, 20:], terminal, rtol=1e-9)


def heap(lattice, slope, k, angle):
    """Cone on a plane whose gradient is ``slope`` of the limit in every direction that drives it most."""
    x, y = np.meshgrid(lattice.x_points, lattice.y_points)
    xi, delta = np.radians([angle, 30.0])
    # downslope of the apex gravity helps, so that the limit is met there
    steepest = (np.tan(delta) - np.tan(xi)) / k * slope
    return np.maximum(0.0, 1.0 - np.hypot(x, y) * steepest)


@pytest.mark.parametrize(("angle", "pressure"), [(0.0, None), (10.0, None), (0.0, MohrCoulomb(40.0, 30.0))])
@pytest.mark.parametrize("slope", [0.9, 1.1])
def test_heap_moves_only_beyond_its_limit_slope(angle, pressure, slope):
    k = at_rest(material(pressure))[0] if pressure else 1.0
    lattice = Lattice((-6.0, 26.0), (-6.0, 6.0), 0.25)
    depth = heap(lattice, slope, k, angle)
    # a slide far away keeps the steps coming
    depth[20:29, 112:120] += 0.5
    still = np.zeros(lattice.shape)
    speed = np.where(lattice.x_points > 20, 3.0, 0.0) * (depth > 0)
    scene = Scene(lattice, Plane(angle), depth, speed, still, Coulomb(30.0))
    if pressure:
        scene = replace(scene, earth_pressure=pressure)
    scene = replace(scene, scheme=replace(scene.scheme, cfl=0.012, rest_share=0.0))
    run = simulate(scene, [0.5])
    assert run.steps >= 1000 or slope > 1
    mine = np.s_[:, : np.searchsorted(lattice.x_points, 12.0)]
    if slope < 1:
        assert run.depth[-1][mine].tobytes() == depth[mine].tobytes()
        assert not run.velocity_x[-1][mine].any()
        assert not run.velocity_y[-1][mine].any()
    else:
        assert np.abs(run.velocity_x[-1][mine]).max() > 1e-3


def test_limit_slope_on_flat_ground_falls_with_the_earth_pressure():
    lattice = Lattice((-6.0, 6.0), (-6.0, 6.0), 0.25)
    depth = np.maximum(0.0, 1.0 - 0.5 * np.abs(lattice.x_points)) * np.ones(lattice.shape)
    still = np.zeros(lattice.shape)
    pressure = MohrCoulomb(30.0, 30.0)
    assert pressure.coefficients().x_active > 1
    held = Scene(lattice, Plane(0.0), depth, still, still, Coulomb(30.0))
    assert simulate(held, [1.0]).rest_time == 0
    # tan 30 / K is 0.35, though tan 30 is 0.58
    assert simulate(replace(held, earth_pressure=pressure), [0.2]).steps > 0


def test_verification_prints_every_case(capsys, monkeypatch):
    monkeypatch.setattr(exact_cases, "CASES", {"dam": (dam_break(), (4.0, 2.0))})
    monkeypatch.setattr(exact_cases, "SHOCK_SPACINGS", (0.8,))
    monkeypatch.setattr(exact_cases, "ASPECTS", (0.2,))
    exact_cases.main()
    printed = capsys.readouterr().out
    assert "| dam | 4 |" in printed
    assert "| 0.8 |" in printed
    assert "| round | 0.2 |" in printed


def test_relative_l2_is_one_for_nothing():
    assert relative_l2(np.zeros(3), np.ones(3)) == 1
