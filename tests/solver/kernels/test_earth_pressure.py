"""The choice of the earth-pressure coefficients: its limits and its waves."""

import numpy as np
import pytest
from scenes import material

from solver.kernels.earth_pressure import at_rest, earth_pressure, stretching
from solver.physics.earth_pressure import STEEPEST, Isotropic, MohrCoulomb

ANGLES = [(30.0, 30.0), (32.0, 30.0), (35.0, 15.0), (40.0, 20.0), (40.0, 30.0), (45.0, 30.0), (38.0, 0.0)]
FALL, NORMAL = 0.3, 8.0


def pressure(law, along, across, rises=(0.0, 0.0)):
    """K along and across, and the waves, for rates in units of 1 / FALL."""
    decrease = law.transition().steepness * FALL
    k = earth_pressure(along / FALL, across / FALL, decrease, NORMAL, *rises, material(law))
    return np.array(k) / [NORMAL, NORMAL, 1.0, 1.0]


@pytest.mark.parametrize("width", [0.0, 0.2, 1.0])
@pytest.mark.parametrize("angles", ANGLES)
def test_what_is_strained_fast_is_in_the_limiting_states_of_the_paper(angles, width):
    law = MohrCoulomb(*angles, pressure_transition=width)
    k = law.coefficients()
    assert pressure(law, 9.0, 9.0)[:2] == pytest.approx([k.x_active, k.y_active_active])
    assert pressure(law, 9.0, -9.0)[:2] == pytest.approx([k.x_active, k.y_active_passive])
    assert pressure(law, -9.0, 9.0)[:2] == pytest.approx([k.x_passive, k.y_passive_active])
    assert pressure(law, -9.0, -9.0)[:2] == pytest.approx([k.x_passive, k.y_passive_passive])
    assert not pressure(law, -9.0, -9.0, (0.5, 0.5))[2:].any()


def test_the_bare_sign_jumps_and_zero_counts_as_active():
    law = MohrCoulomb(40.0, 30.0, pressure_transition=0.0)
    k = law.coefficients()
    assert pressure(law, 0.0, 0.0)[:2] == pytest.approx([k.x_active, k.y_active_active])
    assert pressure(law, -1e-9, 1e-9)[:2] == pytest.approx([k.x_passive, k.y_passive_active])


def test_rest_is_continuous_with_slow_motion():
    law = MohrCoulomb(40.0, 30.0)
    rest = at_rest(material(law))
    for along, across in ((1e-9, 1e-9), (-1e-9, 1e-9), (1e-9, -1e-9), (-1e-9, -1e-9)):
        assert pressure(law, along, across)[:2] == pytest.approx(rest, abs=1e-7)
    assert at_rest(material(Isotropic())) == (1.0, 1.0)


@pytest.mark.parametrize("width", [-0.1, np.inf, np.nan])
def test_a_width_is_refused_that_is_none(width):
    with pytest.raises(ValueError, match=r"^pressure_transition: expected a"):
        MohrCoulomb(40.0, 30.0, pressure_transition=width)


def test_a_cell_is_strained_as_on_its_deeper_side_and_evenly_where_the_depth_is_level():
    forth, back = 2.0, -1.0
    mean, half = (forth + back) / 2, (forth - back) / 2
    assert stretching(mean, half, 0.3) == forth
    assert stretching(mean, half, -0.3) == back
    assert stretching(mean, half, 0.0) == mean
    assert stretching(mean, half, 1e-12) == pytest.approx(mean)


def speeds(law, slope, count=20000):
    """Speeds of the waves of eqs. 1-3 over any depth gradient of a size, linear between the states.

    In units of the speed sqrt(g cos xi h), relative to the flow, (count, 3), complex; beside them the bound
    that the time step goes by.
    """
    rng = np.random.default_rng(3)
    way, turn = rng.uniform(0, 2 * np.pi, (2, count))
    n_x, n_y, h_x, h_y = np.cos(way), np.sin(way), slope * np.cos(turn), slope * np.sin(turn)
    rates = rng.uniform(-3, 3, (count, 2)) * rng.choice([1.0, 0.1], (count, 2))
    step, matrices, bounds = 1e-7, np.zeros((count, 3, 3)), np.zeros(count)
    for i, (p, q) in enumerate(rates):
        k = pressure(law, p, q, (abs(h_x[i]), abs(h_y[i])))
        by_p, by_q = ((pressure(law, *moved)[:2] - k[:2]) / step for moved in ((p + step, q), (p, q + step)))
        matrices[i] = [
            [0, n_x[i], n_y[i]],
            [k[0] * n_x[i], h_x[i] * by_p[0] * n_x[i], h_x[i] * by_q[0] * n_y[i]],
            [k[1] * n_y[i], h_y[i] * by_p[1] * n_x[i], h_y[i] * by_q[1] * n_y[i]],
        ]
        # the speed sqrt(g cos xi h) is the fall times g cos xi
        waves, unit = k[2:], FALL * NORMAL
        along, across = (w / unit + np.sqrt((w / unit) ** 2 + b) for w, b in zip(waves, k[:2], strict=True))
        bounds[i] = abs(n_x[i]) * along + abs(n_y[i]) * across
    return np.linalg.eigvals(matrices), bounds


@pytest.mark.parametrize("width", [0.1, 1.0])
@pytest.mark.parametrize("angles", ANGLES)
def test_waves_have_real_speeds_up_to_the_steepest_slope_and_the_step_respects_them(angles, width):
    found, bound = speeds(MohrCoulomb(*angles, pressure_transition=width), 0.99 * STEEPEST, 4000)
    assert np.abs(found.imag).max() < 1e-3
    assert (np.abs(found.real).max(axis=1) <= 1.3 * bound).all()


def test_without_the_wider_coupling_they_would_not(monkeypatch):
    law = MohrCoulomb(40.0, 30.0, pressure_transition=0.1)
    tight = law.transition()._replace(coupling=1.0)
    monkeypatch.setattr(MohrCoulomb, "transition", lambda _: tight)
    assert np.abs(speeds(law, STEEPEST, 2000)[0].imag).max() > 0.1
