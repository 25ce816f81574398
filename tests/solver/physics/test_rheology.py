import numpy as np
import pytest

from solver.physics.earth_pressure import Isotropic, MohrCoulomb
from solver.physics.friction import Chezy, Coulomb, Voellmy


def test_equal_angles_of_30_degrees_leave_one_state_along_and_two_across():
    k = MohrCoulomb(30, 30).coefficients()
    # where the root vanishes, round-off in its square leaves its own root
    np.testing.assert_allclose([k.x_active, k.x_passive], 5 / 3, rtol=1e-7)
    np.testing.assert_allclose([k.y_active_active, k.y_passive_active], 2 / 3, rtol=1e-7)
    np.testing.assert_allclose([k.y_active_passive, k.y_passive_passive], 2, rtol=1e-7)


def test_known_values_at_40_and_20_degrees():
    k = MohrCoulomb(40, 20).coefficients()
    assert k.x_active == pytest.approx(0.43, abs=5e-3)
    assert k.x_passive == pytest.approx(4.38, abs=5e-3)


def test_a_smooth_bed_has_rankines_coefficients():
    phi = np.radians(35)
    active, passive = (1 - np.sin(phi)) / (1 + np.sin(phi)), (1 + np.sin(phi)) / (1 - np.sin(phi))
    k = MohrCoulomb(35, 0).coefficients()
    np.testing.assert_allclose(k, [active, passive, active, 1, 1, passive], rtol=1e-13)


@pytest.mark.parametrize(("phi", "delta"), [(40, 20), (35, 30), (25, 5), (30, 30)])
def test_both_circles_touch_coulombs_line_and_pass_through_the_state_at_the_bed(phi, delta):
    """Mohr's circle through (1, tan delta) and (K, -tan delta) touches the line at the internal friction."""
    k = MohrCoulomb(phi, delta).coefficients()
    tangent = np.tan(np.radians(delta))
    for k_x in (k.x_active, k.x_passive):
        centre, radius = (1 + k_x) / 2, np.hypot((1 - k_x) / 2, tangent)
        assert radius == pytest.approx(centre * np.sin(np.radians(phi)), rel=1e-12)
    for k_x, *across in (
        (k.x_active, k.y_active_active, k.y_active_passive),
        (k.x_passive, k.y_passive_active, k.y_passive_passive),
    ):
        centre, radius = (1 + k_x) / 2, np.hypot((1 - k_x) / 2, tangent)
        np.testing.assert_allclose(across, [centre - radius, centre + radius], rtol=1e-12)


def test_active_pressure_is_the_lesser():
    for phi in range(1, 89, 4):
        for delta in range(0, phi + 1, 3):
            k = MohrCoulomb(phi, delta).coefficients()
            assert 0 < k.x_active <= k.x_passive
            assert 0 < k.y_active_active <= k.y_active_passive
            assert 0 < k.y_passive_active <= k.y_passive_passive


def test_isotropic_pressure_is_hydrostatic():
    assert set(Isotropic().coefficients()) == {1.0}


@pytest.mark.parametrize("angles", [(20, 25), (90, 20), (30, -1), (np.nan, 20), (30, np.nan)])
def test_mohr_coulomb_refuses_angles_without_a_root(angles):
    with pytest.raises(ValueError, match=r"^(bed|internal)_friction: expected"):
        MohrCoulomb(*angles)


def test_friction_is_the_tangent_of_its_angle():
    assert Coulomb(0).tangent == 0
    assert Coulomb(45).tangent == pytest.approx(1, rel=1e-15)
    assert Voellmy(30, 400).tangent == Coulomb(30).tangent


@pytest.mark.parametrize("angle", [-1, 90, np.nan])
def test_friction_refuses_angles_out_of_range(angle):
    with pytest.raises(ValueError, match=r"^bed_friction: expected a"):
        Coulomb(angle)
    with pytest.raises(ValueError, match=r"^bed_friction: expected a"):
        Voellmy(angle, 400)


@pytest.mark.parametrize("coefficient", [0, -400, np.nan])
def test_voellmy_refuses_a_coefficient_that_is_not_above_zero(coefficient):
    with pytest.raises(ValueError, match=r"^turbulent_friction: expected a (number above 0|finite number)"):
        Voellmy(20, coefficient)


def test_the_drag_of_chezy_scales_with_gravity_to_the_last_bit():
    """A power of two by the C library is not always the product: results would depend on units."""
    assert 2.759**2 != 2.759 * 2.759
    for gravity in (0.025, 0.03, 1.0, 9.81):
        assert Chezy(2 * 2.759).resistance(4 * gravity) == Chezy(2.759).resistance(gravity)
