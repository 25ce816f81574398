"""Erosion in one cell: the laws by a plain twin, exact where they are, and never more than there is."""

import numpy as np
import pytest

from solver.kernels.erosion import erode_cell, erosion_of
from solver.kernels.state import Material
from solver.physics.earth_pressure import Isotropic
from solver.physics.erosion import (
    LAWS,
    Egashira,
    ErodibleBed,
    ErosionLimits,
    GrowthRate,
    JumpCondition,
    ShearStress,
    ShearWork,
)
from solver.physics.resistance import DryTurbulent

G, DRAG, TANGENT = 9.81, 0.05, 0.2
MATERIAL = Material(DryTurbulent(TANGENT, DRAG), Isotropic().coefficients(), Isotropic().transition(), 1e-4)
LAW = {
    "growth rate": GrowthRate(0.01),
    "shear stress, slope": ShearStress(density=2000.0),
    "shear stress, friction": ShearStress(stress="friction", density=2000.0),
    "shear work": ShearWork(),
    "Egashira": Egashira(),
    "jump condition": JumpCondition(0.1, 100.0, 0.5, 2000.0),
}


def bed(law, depth=100.0, done=0.0, **limits):
    limits = ErosionLimits(**({"minimum_speed": 1e-6} | limits))
    made = ErodibleBed(np.array([depth]), law, limits)
    return erosion_of(made, np.array([depth]), np.array([done]), np.zeros(1))


def erode(erosion, cell, dt, angle=25.0, turn=0.0):
    xi = np.radians(angle)
    gravity = G * np.sin(xi) * np.cos(turn), G * np.sin(xi) * np.sin(turn), G * np.cos(xi)
    return erode_cell(erosion, 0, cell, gravity, gravity[2], dt, MATERIAL)


def expected(law, h, u, v, xi, dt):
    """The same by the equations as they are written in docs/method.md."""
    speed = np.hypot(u, v)
    tau = h * TANGENT * G * np.cos(xi) + DRAG * speed**2
    along = np.arcsin(np.sin(xi) * u / speed)
    match law:
        case GrowthRate(growth=growth):
            return growth * h * speed * dt
        case ShearStress() as s:
            stress = s.density * (tau if s.stress == "friction" else h * G * np.sin(along))
            return min(s.rate * dt, s.depth_per_stress * (stress - s.critical_stress))
        case ShearWork(erosion_energy=energy):
            return tau * speed * dt / energy
        case Egashira() as e:
            rate = np.tan(along - np.arctan(e.equilibrium_slope))
            return np.sqrt(h * h + 2 * h * speed * dt * max(rate, 0.0)) - h
        case JumpCondition() as j:
            strength = j.bed_cohesion / j.density + j.strength_coefficient * h * G * np.cos(xi)
            return (tau - strength) * dt / (j.slip * speed)


def test_every_law_has_a_twin():
    assert {type(law) for law in LAW.values()} == set(LAWS)


@pytest.mark.parametrize("name", LAW)
def test_a_cell_erodes_by_the_equations(name):
    rng = np.random.default_rng(5)
    eroded = 0
    for _ in range(100):
        h, speed, turn = rng.uniform(0.1, 3), rng.uniform(0.1, 15), rng.uniform(0, 2 * np.pi)
        u, v, angle = speed * np.cos(turn), speed * np.sin(turn), rng.uniform(0, 60)
        dt = rng.uniform(0.001, 0.5)
        erosion = bed(LAW[name])
        after, u_1, v_1, gained = erode(erosion, (h, u, v), dt, angle)
        wanted = max(0.0, expected(LAW[name], h, u, v, np.radians(angle), dt))
        assert gained == pytest.approx(wanted, rel=1e-9, abs=1e-13)
        assert (after, erosion.eroded[0]) == (h + gained, gained)
        np.testing.assert_allclose([after * u_1, after * v_1], [h * u, h * v], rtol=1e-14)
        eroded += gained > 0
    assert eroded > 10


@pytest.mark.parametrize("law", [GrowthRate(0.01), Egashira()])
def test_many_steps_of_a_law_that_is_exact_are_one(law):
    whole, parts = bed(law), bed(law)
    once = erode(whole, (1.0, 8.0, 0.0), 3.0)
    cell = (1.0, 8.0, 0.0)
    for _ in range(64):
        *cell, _ = erode(parts, tuple(cell), 3.0 / 64)
    np.testing.assert_allclose(cell, once[:3], rtol=1e-13)


def test_a_constant_stress_of_5_kpa_takes_up_0_4_m_in_16_s():
    # the stress of friction does not change where drag alone makes it: 0.05 u^2 = 2.5 m2 s-2
    material = MATERIAL._replace(law=DryTurbulent(0.0, DRAG))
    law = ShearStress(stress="friction", density=2000.0)
    erosion, depths = bed(law), []
    for _ in range(200):
        erode_cell(erosion, 0, (1.0, np.sqrt(50.0), 0.0), (1.0, 0.0, 9.0), 9.0, 0.1, material)
        depths.append(erosion.eroded[0])
    assert depths[99] == pytest.approx(0.25, rel=1e-12)
    assert depths[158] < 0.4 - 1e-3
    assert depths[160] == depths[-1] == pytest.approx(0.4, rel=1e-12)


@pytest.mark.parametrize("name", LAW)
def test_no_more_is_taken_up_than_there_is(name):
    erosion = bed(LAW[name], depth=0.01, done=0.004)
    for _ in range(100):
        erode(erosion, (2.0, 12.0, 1.0), 1.0, angle=35.0)
    assert erosion.eroded[0] == 0.01
    assert erode(erosion, (2.0, 12.0, 1.0), 1.0, angle=35.0) == (2.0, 12.0, 1.0, 0.0)


def test_what_is_thin_or_slow_does_not_erode():
    erosion = bed(GrowthRate(0.1), minimum_depth=0.1, minimum_speed=0.5)
    for cell in ((0.1, 9.0, 0.0), (1.0, 0.3, 0.4), (1.0, 0.0, 0.0), (0.0, 0.0, 0.0)):
        assert erode(erosion, cell, 1.0) == (*cell, 0.0)
    assert erode(erosion, (0.11, 0.4, 0.4), 1.0)[3] > 0


@pytest.mark.parametrize("name", ["shear stress, slope", "Egashira"])
def test_a_flow_that_climbs_does_not_erode_by_the_slope(name):
    assert erode(bed(LAW[name]), (2.0, -8.0, 1.0), 1.0)[3] == 0.0
    assert erode(bed(LAW[name]), (2.0, 8.0, 1.0), 1.0)[3] > 0.0


@pytest.mark.parametrize("name", LAW)
def test_only_the_angle_between_flow_and_slope_counts(name):
    turn = 0.7
    one = erode(bed(LAW[name]), (1.5, 6.0, 2.0), 0.2)
    u, v = 6.0 * np.cos(turn) - 2.0 * np.sin(turn), 6.0 * np.sin(turn) + 2.0 * np.cos(turn)
    two = erode(bed(LAW[name]), (1.5, u, v), 0.2, turn=turn)
    assert two[3] == pytest.approx(one[3], rel=1e-12)
