"""Uniform flows on a slope that take up their bed: the numbers that are known, and runs by the time step.

The errors of a split after the whole step are of first order in its length.
"""

from dataclasses import replace

import numpy as np
import pytest

from solver.physics.erosion import Egashira
from solver.verification.erosion_cases import CASES, growth_by_coulomb

COULOMB = CASES["growth rate, Coulomb"]
# depth less that at the start, and speed, to six digits; found by a quadrature elsewhere
KNOWN = [
    ("growth rate, Coulomb", 10, 0.39300, 11.9718),
    ("growth rate, Coulomb", 20, 1.88089, 16.1274),
    ("growth rate, Voellmy", 10, 0.32771, 7.41884),
    ("growth rate, Voellmy", 30, 2.21160, 10.5040),
    ("shear stress, depth and slope", 10, 0.25, 7.49635),
    ("shear stress, depth and slope", 69.4370, 1.73592, 11.2702),
    ("shear stress, friction", 10, 0.25, 7.49635),
    ("shear stress, friction", 59.5359, 1.48840, 10.7308),
    ("Egashira", 5, 2.82488, 4.55561),
    ("Egashira", 10, 6.46389, 6.18045),
]
# cases and the largest error of what the last two time steps extrapolate to
EVERYWHERE = ("growth rate, Voellmy", "shear stress, friction", "Egashira")


@pytest.mark.parametrize(("name", "time", "eroded", "speed"), KNOWN)
def test_the_equations_give_the_known_numbers(name, time, eroded, speed):
    h, u = CASES[name].at(time)
    assert h - CASES[name].depth == pytest.approx(eroded, abs=5.1e-6)
    assert u == pytest.approx(speed, rel=1e-5)


def test_growth_under_coulomb_friction_has_a_closed_form():
    for time in (3.0, 10.0, 20.0):
        assert COULOMB.at(time) == pytest.approx(growth_by_coulomb(25, 0.3, 0.005, time), rel=1e-9)


def test_the_way_of_growth_under_coulomb_friction_is_the_one_known():
    """``s = ln cosh(w t)/G``, and by runs the sum of the speeds over the time steps."""
    known = {10.0: 66.2917, 20.0: 211.620}
    for time, way in known.items():
        assert np.log(growth_by_coulomb(25, 0.3, 0.005, time)[0]) / 0.005 == pytest.approx(way, rel=2.6e-6)
    ways = [np.trapezoid(over_time(COULOMB, step)[1], dx=step) for step in (0.25, 0.125)]
    assert abs(ways[1] - known[10.0]) < 0.55 * abs(ways[0] - known[10.0])
    assert 2 * ways[1] - ways[0] == pytest.approx(known[10.0], rel=1e-4)


def test_the_bed_ends_at_the_time_and_speed_known():
    found = []
    for step in (0.25, 0.125):
        depths, speeds = over_time(replace(COULOMB, time=12.0), step)
        times = step * np.arange(len(depths))
        end = np.interp(np.log(1.5), np.log(depths), times)
        found.append((end, np.interp(end, times, speeds)))
    time = 10 * np.arccosh(1.5) / np.arccosh(growth_by_coulomb(25, 0.3, 0.005, 10.0)[0])
    assert time == pytest.approx(11.1932, abs=5.1e-5)
    assert growth_by_coulomb(25, 0.3, 0.005, time) == pytest.approx((1.5, 12.8176), rel=4e-6)
    np.testing.assert_allclose(2 * np.array(found[1]) - found[0], (11.1932, 12.8176), rtol=2e-4)


def test_the_errors_of_voellmy_friction_by_the_time_step_are_those_known():
    """From rest at t = 2 s, without anything to erode."""
    case = replace(CASES["growth rate, Voellmy"], bed=0.0, time=2.0, step=0.4)
    errors = [case.at(2.0)[1] - case.run("lattice", step)[1] for step in (0.2, 0.1, 0.05, 0.025)]
    assert np.round(errors, 3).tolist() == [0.057, 0.029, 0.014, 0.007]


def over_time(case, step):
    """Depth and speed far from the upper side at each time step, (2, steps + 1)."""
    result = case.run("lattice", step)[2]
    return np.array([result.depth[:, 1, -5], result.velocity_x[:, 1, -5]])


def test_what_is_eroded_at_equilibrium_slope_is_nothing():
    assert np.degrees(np.arctan(Egashira().equilibrium_slope)) == pytest.approx(17.2564, abs=5e-5)


@pytest.mark.parametrize(
    ("name", "layout"),
    [(name, "lattice") for name in CASES]
    + [(name, layout) for layout in ("cloud", "surface") for name in EVERYWHERE],
)
def test_errors_halve_with_the_time_step(name, layout):
    case = CASES[name]
    known, found = np.array(case.at(case.time)), case.runs(layout)
    errors = np.abs(found - known)
    # what a fixed rate takes up is exact at any step, and in the third case the speed of the friction cancels
    first_order = errors[0] > 1e-5
    assert first_order[1]
    ratios = errors[:-1, first_order] / errors[1:, first_order]
    assert (ratios > 1.8).all(), ratios
    assert (ratios < 2.2).all(), ratios
    assert (errors[:, ~first_order] < 1e-6).all()
    np.testing.assert_allclose(2 * found[-1] - found[-2], known, rtol=3e-4)


def test_the_bed_is_taken_up_to_its_end_and_no_farther():
    case = replace(COULOMB, bed=0.5, time=20.0, step=1.0)
    known, found = np.array(case.at(20.0)), case.runs("lattice")
    assert known == pytest.approx([1.5, 25.8396], rel=1e-5)
    np.testing.assert_allclose(found[:, 0], 1.5, rtol=1e-14)
    errors = np.abs(found[:, 1] - known[1])
    assert (errors[1:] < 0.65 * errors[:-1]).all()
    result = case.run("lattice", 1.0)[2]
    assert (result.erosion_depth <= 0.5).all()
    assert result.erosion_depth[:, -5:].min() == 0.5


@pytest.mark.parametrize("name", ["shear stress, depth and slope", "shear stress, friction"])
def test_the_shear_stress_law_ends_where_the_stress_says(name):
    case = replace(CASES[name], time=100.0, step=1.0)
    h, u, _ = case.run("lattice", 0.5)
    # e_m0/(1 - k) where the stress is that of the slope, which friction comes to as well
    most = 0.2 * 9.81 * np.sin(np.radians(20))
    eroded = (most - 0.1) / (1 - most)
    assert eroded == pytest.approx(1.73592, rel=1e-5)
    assert h - 1 == pytest.approx(eroded, abs=1e-9 if "slope" in name else 0.02)
    assert u == pytest.approx(case.at(69.4370)[1], rel=0.06)
