from dataclasses import replace

import numpy as np
import pytest
from scipy.integrate import dblquad

from solver.points.cloud import random_points
from solver.points.lattice import Lattice
from solver.release.initial_state import initial_state
from solver.release.shapes import Box, Cap, Cylinder, Hemisphere, Paraboloid

LATTICE = Lattice((0, 10), (-5, 5), 0.5)
SHAPES = [
    Hemisphere((4, 0), 1.85),
    Cap((4.1, 0), 2, 0.5),
    Paraboloid((4.1, 0), (2, 3), 1.3),
    Cylinder((4.1, 0), 2, 0.7),
    Box((1.1, 4.3), (-2.2, 2.2), 0.7),
]
NAMES = [type(shape).__name__ for shape in SHAPES]


@pytest.fixture(params=SHAPES, ids=NAMES)
def shape(request):
    return request.param


def test_the_cells_hold_the_volume_of_the_shape(shape):
    laid = initial_state([shape], LATTICE)
    assert laid.volume == pytest.approx(shape.shape_volume, rel=1e-5)
    assert laid.volume_asked == shape.shape_volume
    assert laid.volume_lost == 0


def test_each_cell_holds_the_average_of_the_depth_over_it(shape):
    averages = shape.cell_averages(LATTICE)
    n = 200
    offsets = (np.arange(n) + 0.5) / n - 0.5
    for j, i in ((10, 8), (8, 6), (13, 10)):
        x = LATTICE.x_points[i] + LATTICE.dx * offsets
        y = LATTICE.y_points[j] + LATTICE.dy * offsets
        assert averages[j, i] == pytest.approx(shape.depth(x, y[:, None]).mean(), abs=3e-3)


@pytest.mark.parametrize("shape", SHAPES[:3], ids=NAMES[:3])
def test_a_cell_inside_a_shape_is_averaged_to_quadrature_accuracy(shape):
    x, y = LATTICE.x_points[8], LATTICE.y_points[10]
    exact, _ = dblquad(lambda y, x: float(shape.depth(x, y)), x - 0.25, x + 0.25, y - 0.25, y + 0.25)
    assert shape.cell_averages(LATTICE)[10, 8] == pytest.approx(exact / LATTICE.cell_area, rel=1e-9)


@pytest.mark.parametrize("spacing", [0.5, 0.31, 0.2])
def test_a_shape_centred_in_y_is_laid_mirror_symmetric_to_the_last_bit(shape, spacing):
    depth = initial_state([shape], Lattice((0, 10), (-5, 5), spacing)).depth
    assert (depth == depth[::-1]).all()
    assert depth.min() == 0 < depth.max()


def test_the_mirror_image_of_a_shape_is_laid_as_the_mirror_image():
    right = initial_state([Cap((4, 1.3), 2, 0.5)], LATTICE).depth
    left = initial_state([Cap((4, -1.3), 2, 0.5)], LATTICE).depth
    assert (right == left[::-1]).all()


def test_a_shape_given_by_its_volume_is_scaled_to_it(shape):
    laid = initial_state([replace(shape, volume=3.0)], LATTICE)
    assert laid.volume == pytest.approx(3.0, rel=1e-14)
    assert laid.volume_asked == 3.0
    np.testing.assert_allclose(
        laid.depth, initial_state([shape], LATTICE).depth * 3 / shape.shape_volume, rtol=1e-5
    )


def test_a_box_whose_edges_cut_cells_is_exact():
    depth = initial_state([Box((1.1, 4.3), (-2.2, 2.0), 0.7)], LATTICE).depth
    assert depth[10, 5] == 0.7
    assert depth[10, 2] == pytest.approx(0.7 * (1.25 - 1.1) / 0.5, rel=1e-12)
    assert depth[10, 9] == pytest.approx(0.7 * (4.3 - 4.25) / 0.5, rel=1e-12)
    assert depth[6, 2] == pytest.approx(0.7 * 0.3 * (2.2 - 1.75) / 0.5, rel=1e-12)
    assert depth[14, 5] == pytest.approx(0.7 * (2.0 - 1.75) / 0.5, rel=1e-12)


def test_a_box_with_edges_on_cell_edges_leaves_nothing_in_the_next_cells():
    lattice = Lattice((0, 3), (-0.3, 0.3), 0.1)
    depth = initial_state([Box((0.35, 1.25), (-0.15, 0.15), 1.0)], lattice).depth
    assert set(depth.ravel()) == {0.0, 1.0}
    assert depth.sum() == 9 * 3


def test_a_box_to_the_bounds_is_continued_to_the_edges_of_the_outer_cells():
    laid = initial_state([Box((0, 10), (-5, 5), 0.5, velocity=(0.3, 0.1))], LATTICE)
    assert set(laid.depth.ravel()) == {0.5}
    assert set(laid.velocity_x.ravel()) == {0.3}
    assert set(laid.velocity_y.ravel()) == {0.1}
    assert laid.volume == pytest.approx(0.5 * 10.5**2)
    assert laid.volume_lost == 0


def test_what_lies_outside_the_cells_is_lost():
    half = initial_state([Cylinder((-0.25, 0), 2, 1.0)], LATTICE)
    assert half.volume == pytest.approx(2 * np.pi, rel=1e-4)
    assert half.volume_lost == pytest.approx(2 * np.pi, rel=1e-4)
    box = initial_state([Box((8, 12), (-1, 1), 1.0, volume=16.0)], LATTICE)
    assert box.volume == pytest.approx(9.0)
    assert box.volume_lost == pytest.approx(7.0)
    assert box.volume_asked == 16


@pytest.mark.parametrize("shape", [Box((11, 12), (-1, 1), 1), Cap((12, 7), 2.4, 1), Hemisphere((-9, 0), 2)])
def test_a_release_wholly_outside_the_domain_is_refused(shape):
    with pytest.raises(ValueError, match="wholly outside"):
        initial_state([SHAPES[0], shape], LATTICE)


def test_nothing_to_release_is_refused():
    with pytest.raises(ValueError, match="nothing"):
        initial_state([], LATTICE)


def test_depths_add_up_and_velocities_are_weighted_by_depth():
    laid = initial_state(
        [Box((1, 4), (-2, 2), 1.0, velocity=(2, 0)), Box((3, 6), (-2, 2), 3.0, velocity=(0, 4))], LATTICE
    )
    assert laid.depth[10, [4, 7, 10, 15]].tolist() == [1, 4, 3, 0]
    assert laid.velocity_x[10, [4, 7, 10, 15]].tolist() == [2, 0.5, 0, 0]
    assert laid.velocity_y[10, [4, 7, 10, 15]].tolist() == [0, 3, 4, 0]


def test_a_hemisphere_is_a_cap_as_high_as_its_radius():
    assert Hemisphere((0, 0), 2).shape_volume == pytest.approx(2 / 3 * np.pi * 8)
    assert Hemisphere((0, 0), 2).depth(0, 1) == pytest.approx(np.sqrt(3))


def test_a_flat_cap_has_the_depth_of_a_paraboloid():
    x = np.linspace(-100, 100, 41)
    np.testing.assert_allclose(
        Cap((0, 0), 100, 1e-3).depth(x, 0.0), Paraboloid((0, 0), (100, 100), 1e-3).depth(x, 0.0), rtol=1e-8
    )


@pytest.mark.parametrize(
    "make",
    [
        lambda: Hemisphere((0, 0), 0),
        lambda: Cap((0, 0), 1, 2),
        lambda: Paraboloid((0, 0), (1, -1), 1),
        lambda: Cylinder((0, np.nan), 1, 1),
        lambda: Box((1, 0), (0, 1), 1),
        lambda: Box((0, 1), (0, 1), 1, volume=0),
        lambda: Box((0, 1), (0, 1), 1, velocity=(np.inf, 0)),
    ],
)
def test_impossible_shapes_are_refused(make):
    with pytest.raises(ValueError, match="expected "):
        make()


CLOUD = random_points((0, 10), (-5, 5), 700, seed=3)


def test_a_cloud_holds_the_volume_of_a_shape_to_round_off(shape):
    laid = initial_state([shape], CLOUD)
    assert laid.volume == pytest.approx(
        shape.shape_volume, rel=1e-11 if not hasattr(shape, "radius") else 1e-8
    )
    assert laid.depth.min() == 0


def test_a_cell_of_a_cloud_holds_the_average_of_the_depth_over_it(shape):
    rng = np.random.default_rng(0)
    samples = rng.uniform([0, -5], [10, 5], (1_000_000, 2))
    owner = CLOUD.nearest(1, samples)[:, 0]
    counts = np.bincount(owner, minlength=len(CLOUD))
    found = np.bincount(owner, shape.depth(*samples.T), len(CLOUD)) / counts
    assert np.abs(shape.cell_averages(CLOUD) - found).max() < 5 * shape.depth(4.1, 0) / np.sqrt(counts.min())
    outside = np.hypot(*(CLOUD.points - [4.1, 0]).T) > 5
    assert not shape.cell_averages(CLOUD)[outside].any()


def test_a_cap_scales_with_lengths_to_the_last_bit():
    squared = np.linspace(0, 1, 7)
    # squares of these by the C library are not the products
    for radius in (32.543, 57.086, 42.023, 18.659):
        assert radius**2 != radius * radius
        small, large = (Cap((0, 0), radius=k * radius, height=k * 0.3 * radius) for k in (1, 4))
        assert large.shape_volume == 64 * small.shape_volume
        np.testing.assert_array_equal(large._mean(squared), 4 * small._mean(squared))
        np.testing.assert_array_equal(large._profile(squared), 4 * small._profile(squared))
