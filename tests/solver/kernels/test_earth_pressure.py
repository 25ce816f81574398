import pytest

from solver.kernels.earth_pressure import earth_pressure
from solver.kernels.state import Material

MATERIAL = Material(0.5, 0.0, (1.0, 2.0, 3.0, 4.0, 5.0, 6.0), 0.1)


@pytest.mark.parametrize(
    ("u_x", "v_y", "factors"),
    [(1, 1, (1, 3)), (1, -1, (1, 4)), (-1, 1, (2, 5)), (-1, -1, (2, 6)), (0, 0, (1, 3))],
)
def test_what_extends_is_active_and_what_shortens_passive(u_x, v_y, factors):
    expected = tuple(10.0 * factor for factor in factors)
    assert earth_pressure(float(u_x), float(v_y), 0.0, 1.0, 10.0, MATERIAL) == expected


def test_a_dry_cell_and_a_gradient_within_round_off_are_active():
    assert earth_pressure(-1.0, -1.0, 0.0, 0.1, 10.0, MATERIAL) == (10.0, 30.0)
    assert earth_pressure(-1e-9, -2e-9, 1e-9, 1.0, 10.0, MATERIAL) == (10.0, 40.0)
