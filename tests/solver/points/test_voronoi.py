import numpy as np
import pytest
from clouds import clouds
from hypothesis import given, settings
from scipy.spatial import ConvexHull, Voronoi

from solver.points.cloud import given_points, random_points
from solver.points.voronoi import SIDE_NORMALS, control_volumes


def assert_closed(cloud):
    """Areas fill the domain, every cell is closed, faces lie half way between their points."""
    cells, points = cloud.control_volumes, cloud.points
    assert cells.area.sum() == pytest.approx(cloud.domain_area, rel=1e-13)
    assert (cells.area > 0).all()
    middle = np.array([cloud.x, cloud.y]).mean(axis=1)
    np.testing.assert_allclose(
        (cells.area[:, None] * (cells.centroid - middle)).sum(axis=0) / cloud.domain_area, 0, atol=1e-12
    )
    outward, around = np.zeros(points.shape), np.zeros(len(points))
    for cell, normal, length in (
        (cells.left, cells.normal, cells.length),
        (cells.right, -cells.normal, cells.length),
        (cells.side_cell, SIDE_NORMALS[cells.side], cells.side_length),
    ):
        np.add.at(outward, cell, normal * length[:, None])
        np.add.at(around, cell, length)
    assert np.all(np.abs(outward) <= 1e-12 * around[:, None])
    assert (cells.left < cells.right).all()
    assert (np.diff(cells.left) >= 0).all()
    to_left, to_right = (np.hypot(*(cells.midpoint - points[p]).T) for p in (cells.left, cells.right))
    np.testing.assert_allclose(to_left, to_right, rtol=1e-8)
    np.testing.assert_allclose(np.hypot(*cells.normal.T), 1, rtol=1e-14)
    on_side = np.einsum("bk,bk->b", cells.side_midpoint, SIDE_NORMALS[cells.side])
    sides = np.array([-cloud.x[0], cloud.x[1], -cloud.y[0], cloud.y[1]])
    np.testing.assert_allclose(on_side, sides[cells.side], rtol=0, atol=1e-12 * (1 + np.abs(sides).max()))
    for side, length in enumerate([np.ptp(cloud.y)] * 2 + [np.ptp(cloud.x)] * 2):
        assert cells.side_length[cells.side == side].sum() == pytest.approx(length, rel=1e-13)


@settings(derandomize=True, deadline=None, max_examples=60)
@given(clouds())
def test_cells_fill_the_domain_and_are_closed(cloud):
    assert_closed(cloud)


@settings(derandomize=True, deadline=None, max_examples=25)
@given(clouds())
def test_cells_are_those_of_mirrored_points(cloud):
    """The Voronoi cells of the points and their mirror images at all sides, by another algorithm."""
    points, n = cloud.points, len(cloud)
    touching = np.any((points == [cloud.x[0], cloud.y[0]]) | (points == [cloud.x[1], cloud.y[1]]), axis=1)
    if touching.any():  # qhull has no cells for coincident images
        points = np.array([cloud.x, cloud.y]).mean(axis=1) * 1e-3 + points * (1 - 1e-3)
    images = [points]
    for k, bounds in enumerate((cloud.x, cloud.y)):
        for bound in bounds:
            image = points.copy()
            image[:, k] = 2 * bound - image[:, k]
            images.append(image)
    diagram = Voronoi(np.concatenate(images))
    cells = control_volumes(points, cloud.x, cloud.y)
    hulls = [ConvexHull(diagram.vertices[diagram.regions[diagram.point_region[i]]]) for i in range(n)]
    np.testing.assert_allclose(cells.area, [h.volume for h in hulls], rtol=1e-7)
    ours = {(a, b): s for a, b, s in zip(cells.left, cells.right, cells.length, strict=True)}
    for pair, ridge in zip(diagram.ridge_points, diagram.ridge_vertices, strict=True):
        if max(pair) < n:
            length = np.hypot(*np.diff(diagram.vertices[ridge], axis=0)[0])
            assert ours.pop(tuple(sorted(pair)), 0.0) == pytest.approx(length, abs=1e-6)
    assert max(ours.values(), default=0.0) < 1e-6


def test_moments_of_cells_are_those_of_samples():
    cloud = random_points((0, 3), (1, 3), 25, 2)
    cells = cloud.control_volumes
    k = (np.arange(1500) + 0.5) / 1500
    samples = np.stack(np.meshgrid(3 * k, 1 + 2 * k), axis=-1).reshape(-1, 2)
    owner = cloud.nearest(1, samples)[:, 0]

    def mean(values):
        return np.bincount(owner, values) / np.bincount(owner)

    x, y = (samples - cells.centroid[owner]).T
    np.testing.assert_allclose(cells.area, np.bincount(owner) * 6 / 1500**2, rtol=3e-3)
    np.testing.assert_allclose([mean(x), mean(y)], 0, atol=1e-3)
    for k, product in enumerate((x * x, x * y, y * y)):
        np.testing.assert_allclose(cells.second_moment[:, k], mean(product), atol=3e-4)


def test_lattice_cells_are_rectangles_with_four_faces():
    x, y = np.meshgrid(np.arange(6.0), np.arange(5.0))
    cloud = given_points(np.c_[x.ravel(), y.ravel()], (-0.5, 5.5), (-0.5, 4.5))
    assert_closed(cloud)
    cells = cloud.control_volumes
    np.testing.assert_allclose(cells.area, 1, rtol=1e-14)
    np.testing.assert_allclose(cells.length, 1, rtol=1e-14)
    np.testing.assert_allclose(cells.centroid, cloud.points, atol=1e-14)
    np.testing.assert_allclose(cells.second_moment, [[1 / 12, 0, 1 / 12]] * 30, atol=1e-14)
    assert (len(cells.left), len(cells.side)) == (5 * 5 + 6 * 4, 22)


def test_a_cell_may_have_any_number_of_faces():
    angle = np.linspace(0, 2 * np.pi, 201)[:-1]
    points = np.concatenate([[[0, 0]], np.c_[np.cos(angle), np.sin(angle)]])
    cloud = given_points(points, (-2, 2), (-2, 2))
    assert_closed(cloud)
    cells = cloud.control_volumes
    middle = np.flatnonzero(np.hypot(*cloud.points.T) < 0.5)[0]
    assert np.sum((cells.left == middle) | (cells.right == middle)) == 200
    assert cells.area[middle] == pytest.approx(200 * np.tan(np.pi / 200) / 4, rel=1e-12)


def test_cells_do_not_depend_on_where_the_domain_lies():
    cloud = random_points((0, 4), (0, 4), 100, 1)
    shift = 2.0**20
    away = control_volumes(np.round(cloud.points, 3) + shift, (shift, shift + 4), (shift, shift + 4))
    here = control_volumes(np.round(cloud.points, 3), (0, 4), (0, 4))
    np.testing.assert_allclose(away.area, here.area, rtol=1e-8)
    assert away.area.sum() == pytest.approx(16, rel=1e-13)
