import dense
import numpy as np
import pytest

from solver.kernels.limiter import AHEAD, BEHIND, MIDDLE, lead, least_shown
from solver.kernels.state import FaceValues
from solver.lattice.reconstruction import face_values, steps_to_faces
from solver.lmls.shape_functions import shape_functions

DRY = 1e-4


def reconstruct(h, n, t, along_y=False, beta=9.81):
    """The kernel over all inner cells, along x or along y: face values, then the wave speed of the cells."""
    rows, m = h.shape
    out, flat = FaceValues(*np.zeros((7, rows * m))), [q.ravel() for q in (h, n, t, beta + 0 * h)]
    for j in range(1, rows - 1):
        first = j * m + 1
        face_values(*flat, first, m if along_y else 1, m - 2, DRY, out, first)
    return [q.reshape(rows, m)[1:-1, 1:-1] for q in out]


def random_cells(seed=0, shape=(24, 31)):
    rng = np.random.default_rng(seed)
    h = 10.0 ** rng.uniform(-6, 1, shape) * (rng.random(shape) < 0.8)
    flat = rng.random(shape) < 0.2
    n, t = rng.normal(0, 3, (2, *shape)) * ((h > DRY) & (rng.random(shape) < 0.8))
    return np.where(flat, 0.5, h), np.where(flat, 1.5, n), t


@pytest.mark.parametrize("along_y", [False, True], ids=["along x", "along y"])
def test_face_values_are_their_twin(along_y):
    h, n, t = random_cells()
    if along_y:
        expected = [q.T[:, 1:-1] for q in dense.face_values(h.T, n.T, t.T, DRY, 4.0)]
    else:
        expected = [q[1:-1] for q in dense.face_values(h, n, t, DRY, 4.0)]
    *faces, speed = reconstruct(h, n, t, along_y, beta=4.0)
    for actual, wanted in zip(faces, expected, strict=True):
        np.testing.assert_allclose(actual, wanted, rtol=1e-14, atol=1e-16)
    np.testing.assert_array_equal(speed, 2 * np.sqrt(h[1:-1, 1:-1]))


@pytest.mark.parametrize("weight_shape", [1.0, 9.0])
def test_the_unlimited_weights_are_the_lmls_shape_functions_of_cell_means(weight_shape):
    cells = np.array([-1.0, 0.0, 1.0]) * 0.3
    high = shape_functions(cells - 0.15, 0.0, 2, width=0.3, weight_shape=weight_shape)
    low = shape_functions(cells + 0.15, 0.0, 2, width=0.3, weight_shape=weight_shape)
    np.testing.assert_allclose(high, [BEHIND, MIDDLE, AHEAD], rtol=1e-12)
    np.testing.assert_allclose(low, [AHEAD, MIDDLE, BEHIND], rtol=1e-12)


def test_smooth_means_are_reconstructed_without_limiting_and_quadratics_exactly():
    edges = np.linspace(1, 3, 22)
    cubes = np.diff(edges**3) / np.diff(edges) / 3
    means = np.tile(cubes, (3, 1))
    h_low, h_high, n_low, n_high, t_low, t_high, _ = reconstruct(means, means, means)
    for low in (h_low, n_low, t_low):
        np.testing.assert_allclose(low[0], edges[1:-2] ** 2, rtol=1e-13)
    for high in (h_high, n_high, t_high):
        np.testing.assert_allclose(high[0], edges[2:-1] ** 2, rtol=1e-13)
    unlimited = [BEHIND, MIDDLE, AHEAD] @ np.stack([cubes[:-2], cubes[1:-1], cubes[2:]])
    np.testing.assert_allclose(h_high[0], unlimited, rtol=1e-14)


@pytest.mark.parametrize("seed", range(3))
def test_face_values_make_no_extremum_and_no_negative_depth(seed):
    h, n, t = random_cells(seed)
    *low_high, _ = reconstruct(h, n, t)
    for q, low, high in zip((h, n, t), low_high[::2], low_high[1::2], strict=True):
        around = np.stack([q[1:-1, :-2], q[1:-1, 1:-1], q[1:-1, 2:]])
        least, most = around.min(axis=0), around.max(axis=0)
        if q is h:
            # a front shows a dry cell no depth at all
            least = np.where(least <= DRY, 0.0, least)
        room = 1e-15 * np.abs(around).max(axis=0)
        for face in (low, high):
            assert (face >= least - room).all()
            assert (face <= most + room).all()
    assert min(low_high[0].min(), low_high[1].min()) >= 0


def test_mirrored_cells_have_mirrored_faces_to_the_last_bit():
    h, n, t = random_cells()
    here = reconstruct(h, n, t)
    there = [q[:, ::-1] for q in reconstruct(h[:, ::-1], -n[:, ::-1], t[:, ::-1])]
    for k, sign in ((0, 1), (2, -1), (4, 1)):
        np.testing.assert_array_equal(here[k], sign * there[k + 1])
        np.testing.assert_array_equal(here[k + 1], sign * there[k])


def test_a_flow_that_loses_half_its_speed_is_limited_by_minmod():
    # 4 -> 2.1 loses less than half of it, 4 -> 1.9 more; then the steeper difference counts half
    for ahead, steepness in ((2.1, 2.0), (1.9, 1.0)):
        n = np.array([[4.0, 3.9, ahead]] * 3)
        h = np.array([[1.0, 0.9, 0.2]] * 3)
        high = reconstruct(h, n, n)[1][0, 0]
        assert high == pytest.approx(0.9 - min(0.1 / 6 + 0.7 / 3, steepness / 2 * 0.1), rel=1e-14)


@pytest.mark.parametrize(
    ("back", "forth", "low", "high"),
    [(1, 1, 0.5, 0.5), (1, -1, 0, 0), (0, 1, 0, 0), (1, 8, 1, 1), (-1, -1, -0.5, -0.5), (1, 2, 2 / 3, 5 / 6)],
)
@pytest.mark.parametrize("unit", [1.0, 1e-200])
def test_the_limited_steps_are_within_the_smaller_difference(back, forth, low, high, unit):
    found = steps_to_faces(unit * back, unit * forth, 2.0)
    assert found == pytest.approx((-unit * low, unit * high), rel=1e-15, abs=0.0)


@pytest.mark.parametrize(("front", "shown"), [(0.44, False), (0.46, True)])
@pytest.mark.parametrize("dry", [0.0, DRY / 2])
def test_a_front_shows_a_dry_cell_no_depth_before_it_is_deep_enough(front, shown, dry):
    row = [1.0, 1.0, front, dry, dry]
    for h in (np.array([row] * 3), np.array([row[::-1]] * 3)):
        low, high, *_ = reconstruct(h, 0 * h, 0 * h)
        toward_dry = high[0, 1] if h[0, 0] == 1 else low[0, 1]
        from_dry = low[0, 1] if h[0, 0] == 1 else high[0, 1]
        assert (toward_dry > 0) == shown
        assert from_dry > front


@pytest.mark.parametrize("dry", [0.0, DRY / 2])
def test_a_dry_neighbour_has_no_velocity_to_differ_by(dry):
    n = np.array([[3.0, 2.0, 0.0]] * 3)
    _, _, *shown = reconstruct(np.array([[1.0, 0.9, dry]] * 3), n, 2 * n)[:6]
    np.testing.assert_array_equal([q[0, 0] for q in shown], [2.0, 2.0, 4.0, 4.0])
    # the same cells with a thin one ahead
    _, _, *shown = reconstruct(np.array([[1.0, 0.9, 2 * DRY]] * 3), n, 2 * n)[:6]
    assert shown[1][0, 0] < 2.0 < shown[0][0, 0]
    assert shown[3][0, 0] < 4.0 < shown[2][0, 0]


@pytest.mark.parametrize(("speed", "least"), [(1.0, 0.1), (0.0, 0.0)])
def test_a_cell_shows_a_share_of_its_depth_where_it_moves_to(speed, least):
    h = np.array([[10.0, 0.5, 0.0]] * 3)
    n = np.array([[0.0, speed, 0.0]] * 3)
    low, high, *_ = reconstruct(h, n, n)
    assert high[0, 0] == pytest.approx(0.5 * least, abs=1e-15)
    assert low[0, 0] > 0.5


@pytest.mark.parametrize(("wave", "share"), [(1e-9, 1 - 4e-9), (0.05, 0.8), (0.24, 0.1)])
def test_what_has_come_off_shows_up_to_its_mean_depth_where_it_moves_to(wave, share):
    """A cell of speed 1 that nothing follows; ``wave`` is the square of the wave speed behind it."""
    share = max(0.1, share / (1 + 1e-8))
    h = np.array([[10.0, 0.5, 0.01]] * 3)
    n = np.array([[0.0, 1.0, 0.5]] * 3)
    for sign in (1, -1):
        low, high, *_ = reconstruct(h[:, ::sign], sign * n[:, ::sign], n, beta=wave / 10)
        assert (high if sign == 1 else low)[0, 0] == pytest.approx(0.5 * share, rel=1e-12)


@pytest.mark.parametrize(("faster", "share"), [(1e-3, 0.99), (3e-5, 0.1), (1e-16, 0.1), (0.0, 0.1)])
def test_what_is_as_fast_as_what_lies_behind_has_not_come_off_it(faster, share):
    """Nothing is known to lie behind a cell of velocity 1; it is faster than that by some of round-off."""
    assert least_shown(0.5, 1.0, lead(1.0, 1.0 - faster, 1.0), -1e-3) == pytest.approx(0.5 * share, rel=1e-3)


@pytest.mark.parametrize(("ahead", "step"), [(0.0, 3.2 / 2), (0.03, 7 / 6 + 3.2 / 3)])
def test_depth_is_limited_by_minmod_where_a_cell_slips_between_two_at_rest(ahead, step):
    """Depths along a brink, m, where what is behind rests; the third cell shows 17.15 toward the second."""
    h, n = np.array([[26.8, 19.8, 16.6, 15.5]] * 3), np.array([[0.0, 0.04, ahead, 0.0]] * 3)
    low, high, *_ = reconstruct(h, n, 0 * n)
    assert high[0, 0] == pytest.approx(19.8 - step, rel=1e-12)
    assert low[0, 1] == pytest.approx(17.15)


def row_of(values, speed):
    """Depths and velocities of three equal rows."""
    return np.tile(np.asarray(values, float), (3, 1)), np.tile(np.broadcast_to(speed, len(values)), (3, 1))


@pytest.mark.parametrize("way", [1, -1])
def test_at_a_rear_depth_is_on_the_line_that_ends_within_a_cell(way):
    # means of x - 1.5 from there on, in cells of 1 m
    h, n = row_of([0, 0.125, 1, 2, 3, 4][::way], 2.0 * way)
    faces = reconstruct(h, n, 0 * h)
    high = faces[1] if way == 1 else faces[0]
    np.testing.assert_allclose(high[0][::way], [0.5, 1.5, 2.5, 3.5], rtol=1e-14)


def test_a_rear_shows_four_times_its_depth_at_most():
    h, n = row_of([0, 1e-3, 5, 6, 7], 2.0)
    assert reconstruct(h, n, 0 * h)[1][0, 0] == pytest.approx(4e-3, rel=1e-14)


@pytest.mark.parametrize(
    ("depths", "speeds"),
    [
        ([0.0, 0.125, 1, 2], 0.0),
        ([0.0, 0.125, 1, 2], -2.0),
        ([0.0, 0.125, 1, 2], [2.0, 2.0, 0.5, 0.5]),
        ([0.1, 0.125, 1, 2], 2.0),
    ],
    ids=["at rest", "moves to the edge", "is being stopped", "a layer runs into a heap"],
)
def test_what_is_no_rear_keeps_its_limiter(depths, speeds):
    h, n = row_of(depths, speeds)
    # at most once the difference to what is behind
    assert reconstruct(h, n, 0 * h)[1][0, 0] <= 2 * depths[1] - depths[0]
