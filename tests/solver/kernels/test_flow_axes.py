"""Earth pressure with the axes of the flow: a tensor, whatever the frame that it is written in."""

import numpy as np
import pytest
from dense_pressure import earth_pressure, stretching
from scenes import material

from solver.kernels.flow_axes import pressure_along_axes, rise_along, strain_along_axes, traction_axes
from solver.physics.earth_pressure import MohrCoulombFlow

LAW = MohrCoulombFlow(40.0, 30.0)
H, NORMAL, DECREASE = 0.7, 8.0, 0.3
PLANE = (1.0, 0.0, 1.0)
rng = np.random.default_rng(5)


def matrix(tensor):
    xx, yy, xy = tensor
    return np.array([[xx, xy], [xy, yy]])


def turned(angle):
    c, s = np.cos(angle), np.sin(angle)
    return np.array([[c, -s], [s, c]])


def level(velocity, pull, gradient):
    """Pressure tensor where both sides count alike: ``gradient[a, b]`` is the derivative of a along b."""
    rise = 1e-9 * np.array([0.6, -0.8])
    axes = traction_axes(tuple(velocity), H, tuple(pull), NORMAL, tuple(rise), True)
    mean_x, mean_y = tuple(gradient[:, 0]), tuple(gradient[:, 1])
    nothing = (0.0, 0.0)
    rates = strain_along_axes(axes, mean_x, mean_y, nothing, nothing, tuple(rise), PLANE)
    k = pressure_along_axes(axes, *rates, LAW.transition().steepness * DECREASE, NORMAL, rise, material(LAW))
    return matrix(k[:3])


@pytest.mark.parametrize("angle", np.radians([30.0, 45.0, 107.0]))
def test_the_tensor_turns_with_the_frame(angle):
    for _ in range(50):
        velocity, pull, gradient = rng.normal(0, 2, 2), rng.normal(0, 4, 2), rng.normal(0, 2, (2, 2))
        turn = turned(angle)
        here = level(velocity, pull, gradient)
        there = level(turn @ velocity, turn @ pull, turn @ gradient @ turn.T)
        np.testing.assert_allclose(there, turn @ here @ turn.T, atol=1e-7)


def test_it_is_the_projection_of_both_coefficients_where_the_flow_goes_down_the_slope():
    """K = K_s s s^T + K_n n n^T, with the states by s.D.s and n.D.n."""
    way = turned(0.7) @ [1.0, 0.0]
    across = turned(0.7) @ [0.0, 1.0]
    gradient = rng.normal(0, 1, (2, 2))
    rates = way @ gradient @ way, across @ gradient @ across
    b_s, b_n, _, _ = earth_pressure(LAW, *rates, DECREASE, NORMAL, (0.0, 0.0))
    found = level(3.0 * way, 2.0 * way, gradient)
    np.testing.assert_allclose(found, b_s * np.outer(way, way) + b_n * np.outer(across, across), rtol=1e-9)


def test_along_x_it_is_the_pressure_of_the_profile():
    for _ in range(50):
        mean_x, mean_y, half_x, half_y = rng.normal(0, 2, (4, 2))
        rise = rng.normal(0, 0.1), 0.0
        axes = traction_axes((rng.normal(), 0.0), H, (rng.normal(), 0.0), NORMAL, rise, True)
        assert axes == (1.0, 0.0, 0.0)
        along, across = strain_along_axes(
            axes, tuple(mean_x), tuple(mean_y), tuple(half_x), tuple(half_y), rise, PLANE
        )
        assert along == pytest.approx(stretching(mean_x[0], half_x[0], rise[0]), rel=1e-13, abs=1e-13)
        assert across == stretching(mean_y[1], half_y[1], 0.0)
        decrease = LAW.transition().steepness * DECREASE
        k = pressure_along_axes(axes, along, across, decrease, NORMAL, rise, material(LAW))
        wanted = earth_pressure(LAW, along, across, DECREASE, NORMAL, (abs(rise[0]), 0.0))
        np.testing.assert_allclose(k, [*wanted[:2], 0.0, *wanted[2:]], rtol=1e-13)


def test_the_deeper_side_along_an_axis_decides():
    """A flow along the diagonal is stretched ahead alone; the slope along it says which side counts."""
    axes = traction_axes((1.0, 1.0), H, (0.0, 0.0), NORMAL, (0.0, 0.0), True)
    # the velocity (1, 1) f(x + y), with derivatives 1 ahead of the cell and 0 behind it
    mean, half = (0.5, 0.5), (0.5, 0.5)
    # deeper ahead, though it falls along y
    ahead, _ = strain_along_axes(axes, mean, mean, half, half, (0.5, -0.2), PLANE)
    behind, _ = strain_along_axes(axes, mean, mean, half, half, (-0.5, 0.2), PLANE)
    assert ahead == pytest.approx(2.0)
    assert behind == pytest.approx(0.0, abs=1e-15)


def test_axes_have_trace_one_and_no_direction_cancels():
    for _ in range(50):
        velocity, pull, rise = rng.normal(0, 2, (3, 2))
        axes = traction_axes(tuple(velocity), H, tuple(pull), NORMAL, tuple(rise), True)
        shares = np.linalg.eigvalsh(matrix(axes))
        assert shares.sum() == pytest.approx(1.0)
        assert shares.min() >= -1e-15
        np.testing.assert_allclose(rise_along(axes, rise), matrix(axes) @ rise, rtol=1e-12)
    against = traction_axes((-2.0, 0.0), H, (2.0 * np.sqrt(NORMAL / H), 0.0), NORMAL, (0.0, 0.0), True)
    assert against == (1.0, 0.0, 0.0)


def test_what_has_no_direction_is_pushed_as_along_the_flow():
    for wet in (True, False):
        assert traction_axes((0.0, 0.0), H, (0.0, 0.0), NORMAL, (0.0, 0.0), wet) == (1.0, 1.0, 0.0)
    slope = 1e-9
    k = LAW.coefficients()
    rest = NORMAL * (k.x_active + k.x_passive) / 2
    axes = traction_axes((0.0, 0.0), H, (0.0, 0.0), NORMAL, (0.0, slope), True)
    found = pressure_along_axes(axes, 0.0, 0.0, 1.0, NORMAL, (0.0, slope), material(LAW))
    # as a slope of the depth goes to nothing, what it pushes with goes over into that of no direction
    np.testing.assert_allclose(matrix(found[:3]) @ [0.0, slope], [0.0, rest * slope])


def test_the_push_of_a_layer_at_rest_never_weakens_as_it_steepens():
    """The slope of the depth takes part in the axes: what that adds leaves the waves of depth real."""
    least, most = np.inf, 0.0
    for phi, delta in ((30.0, 30.0), (40.0, 30.0), (40.0, 20.0), (45.0, 30.0), (38.0, 10.0)):
        law = MohrCoulombFlow(phi, delta)
        largest = NORMAL * max(law.coefficients())
        for _ in range(200):
            angle, slope, ratio = rng.uniform(0, np.pi), rng.uniform(0, 0.9), 10.0 ** rng.uniform(-1.5, 1.5)
            rise = slope * np.array([np.cos(angle), np.sin(angle)])
            pull = (ratio * slope * NORMAL, 0.0)
            way = turned(rng.uniform(0, np.pi)) @ [1.0, 0.0]
            rates = rng.uniform(-3, 3, 2)

            def push(rise, pull=pull, rates=rates, law=law):
                axes = traction_axes((0.0, 0.0), H, pull, NORMAL, tuple(rise), True)
                found = pressure_along_axes(axes, *rates, 0.5, NORMAL, tuple(rise), material(law))
                return matrix(found[:3]) @ rise

            step = 1e-6 * slope
            square = way @ (push(rise + step * way) - push(rise - step * way)) / (2 * step)
            least, most = min(least, square / NORMAL), max(most, square / largest)
    assert least > 0.0
    assert most < 1.13
