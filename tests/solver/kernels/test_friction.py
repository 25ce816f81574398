"""What the friction kernels answer, for every form of resistance."""

import numpy as np
import pytest

from solver.kernels.friction import (
    below_yield,
    faces_below_yield,
    held_momentum,
    raised_rate,
    resistance,
    rest_stress,
    share_left,
    slowed,
)
from solver.physics.friction import LAWS, Coulomb, Edwards, Voellmy
from solver.physics.resistance import (
    BinghamProfile,
    DryTurbulent,
    Hysteretic,
    Inertial,
    Quadratic,
    Viscoplastic,
)

NORMAL = 9.81
FORMS = [
    DryTurbulent(0.3, 0.05),
    Quadratic(tangent=0.2, cohesion=0.5, yield_stress=0.3, viscous=0.05, drag=0.04, rough=0.02),
    BinghamProfile(0.5, 0.05),
    Viscoplastic(0.5, 0.25, 1 / 3),
    Viscoplastic(0.0, 0.25, 1.5),
    Inertial(0.2, 0.5, 0.5, 0.136, 0.7),
    Hysteretic(0.2, 0.5, 0.25, 0.5, 0.136, 0.0, 0.136, 1.0),
    Hysteretic(0.2, 0.5, 0.25, 0.5, 0.136, 0.1, 0.136, 2.0),
]
IDS = [f"{type(law).__name__} {k}" for k, law in enumerate(FORMS)]
each_form = pytest.mark.parametrize("law", FORMS, ids=IDS)


@each_form
def test_resistance_begins_with_that_at_rest(law):
    for h in (0.01, 1.0, 10.0):
        assert resistance(law, 0.0, h, NORMAL) == pytest.approx(rest_stress(law, h, h, NORMAL) / h, rel=1e-12)


@each_form
def test_resistance_grows_with_speed_but_for_hysteresis(law):
    speeds = np.concatenate([[0.0], np.geomspace(1e-6, 50, 60)])
    found = np.diff([resistance(law, s, 1.0, NORMAL) for s in speeds])
    weakens = isinstance(law, Hysteretic)
    turn = np.searchsorted(speeds, 0.136 * np.sqrt(NORMAL)) + 1
    assert (found[turn if weakens else 0 :] >= 0).all()
    assert (found[: turn - 2] < 0).all() == weakens


@each_form
def test_friction_at_rest_takes_the_momentum_of_its_stress_and_no_more(law):
    for h, load in ((1.0, 1.0), (1.0, 0.3), (1.0, 1.7)):
        taken = held_momentum(law, h, load, NORMAL, 0.2)
        assert taken == pytest.approx(0.2 * rest_stress(law, h, load, NORMAL), rel=1e-14)
        assert taken <= 0.2 * rest_stress(law, h, h, NORMAL) * max(1.0, load / h) * (1 + 1e-12)


@each_form
def test_a_velocity_is_slowed_in_its_own_direction(law):
    u, v = slowed(law, 3.0, -4.0, 1.0, 1.0, NORMAL, 0.1)
    assert u / 3.0 == pytest.approx(v / -4.0, rel=1e-15)
    assert np.hypot(u, v) / 5.0 > 0
    if not isinstance(law, DryTurbulent):
        assert np.hypot(u, v) / 5.0 == pytest.approx(share_left(law, 5.0, 1.0, 1.0, NORMAL, 0.1), rel=1e-14)
    assert slowed(law, 0.0, 0.0, 1.0, 1.0, NORMAL, 0.1) == (0.0, 0.0)


@each_form
def test_what_stays_is_driven_by_no_more_than_resistance_at_rest(law):
    h = 0.7
    most = rest_stress(law, h, h, NORMAL) / h
    for angle in (0.0, 1.0, 4.0):
        x, y = np.cos(angle), np.sin(angle)
        assert below_yield(law, most * (1 - 1e-9) * x, most * (1 - 1e-9) * y, h, NORMAL)
        assert (
            not below_yield(law, most * (1 + 1e-9) * x, (most * (1 + 1e-9) + 1e-12) * y, h, NORMAL)
            or most == 0
        )
    assert below_yield(law, 0.0, 0.0, h, NORMAL)


@each_form
def test_every_face_has_to_hold(law):
    h, level = 1.0, ((1.0, 1.0), (1.0, 1.0))
    most = rest_stress(law, h, h, NORMAL)
    holds = [
        faces_below_yield(law, (p * most, q * most), (r * most, s * most), h, *level, NORMAL)
        for p, q, r, s in np.array([(0, 0, 0, 0), (1, 0, 0, 0), (0, 1, 0, 0), (0, 0, 1, 0), (0, 0, 0, 1)])
        * 1.01
    ]
    assert holds == [True, *[most == 0.0] * 4]


def test_the_depth_at_a_face_is_the_mean_of_both_sides_where_the_yield_stress_decides():
    law = BinghamProfile(0.5, 0.05)
    # at the face behind the sheet is 0.5 m deep, and holds twice as much
    drive = 0.5 / 0.75
    assert faces_below_yield(law, (drive, 0.0), (0.0, 0.0), 1.0, (0.5, 1.0), (1.0, 1.0), NORMAL)
    assert not faces_below_yield(law, (drive, 0.0), (0.0, 0.0), 1.0, (1.0, 1.0), (1.0, 1.0), NORMAL)


@each_form
def test_only_hysteresis_limits_the_step(law):
    raised = raised_rate(law, 0.1, 1.0, NORMAL, 1e-4)
    assert (raised > 0.1) == isinstance(law, Hysteretic)
    assert raised_rate(law, 0.1, 1e-3, NORMAL, 1e-4) == 0.1
    assert raised_rate(law, 1e9, 1.0, NORMAL, 1e-4) == 1e9


def test_a_step_within_the_limit_has_one_solution():
    law = Edwards((11.0, 27.0, 14.0), 0.136, 0.5, 0.136).resistance(NORMAL)
    step = 1.0 / raised_rate(law, 0.0, 1.0, NORMAL, 1e-4)
    speeds = np.linspace(0, 2, 4000)
    left = speeds + step * np.array([resistance(law, s, 1.0, NORMAL) for s in speeds])
    assert (np.diff(left) > 0).all()


@pytest.mark.parametrize("law", LAWS, ids=[law.__name__ for law in LAWS])
def test_a_law_says_what_it_is_for_and_whether_it_stops(law):
    assert law.advice
    assert law.comes_to_rest == (law.__name__ not in ("Chezy", "Manning"))


def test_a_stress_needs_a_density():
    assert not Voellmy(10, 200).needs_density
    with pytest.raises(ValueError, match="density: expected a density, found none"):
        Voellmy(10, 200, cohesion=1000).resistance(NORMAL)


def test_voellmy_without_cohesion_is_the_same_form_as_coulomb():
    assert Voellmy(10, 200).resistance(NORMAL)[:1] == Coulomb(10).resistance(NORMAL)[:1]
    assert isinstance(Voellmy(10, 200).resistance(NORMAL), DryTurbulent)
    assert isinstance(Voellmy(10, 200, 100, 2000).resistance(NORMAL), Quadratic)
