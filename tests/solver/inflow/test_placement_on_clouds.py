"""Sections on a cloud: which faces stand for a line, and which way flow goes through them."""

import numpy as np
import pytest
from hypothesis import assume, given
from hypothesis import strategies as st
from sections import HEADINGS, SLOPE

import solver
from solver.inflow.clouds import place_on_cloud
from solver.inflow.placement import place
from solver.points.cloud import given_points, random_points

CLOUD = random_points((0, 20), (-5, 5), 200, 3)
inside = st.tuples(st.floats(2, 18), st.floats(-4, 4))


def placed(line, terrain=SLOPE, cloud=CLOUD):
    return place_on_cloud(line, cloud, terrain, 9.81)


def faces_of(found, cloud=CLOUD):
    """Length times normal of the faces in the direction of the flow, and their ends."""
    volumes = cloud.control_volumes
    normal = volumes.outward[found.face]
    length = np.concatenate([volumes.length, volumes.side_length])[found.face]
    start, end = (ends[found.face] for ends in volumes.edges)
    return found.sign[:, None] * length[:, None] * normal, start, end


@given(inside, inside)
def test_the_faces_of_a_line_lead_from_end_to_end_whichever_it_was_drawn_from(start, end):
    assume(abs(end[1] - start[1]) > 0.1)
    found, again = placed((start, end)), placed((end, start))
    for name in ("face", "sign", "downstream", "width"):
        assert np.array_equal(getattr(found, name), getattr(again, name))
    vectors, first, second = faces_of(found)
    # each corner of the chain belongs to two faces, but for its two ends
    corners = np.round(np.concatenate([first, second]), 6)
    _, count = np.unique(corners, axis=0, return_counts=True)
    assert (count <= 2).all()
    assert (count == 1).sum() == 2
    # what is wide across the flow adds up to the line, but for less than a cell at its ends
    assert (vectors @ found.direction > 0).all()
    assert found.width.sum() == pytest.approx(np.hypot(end[0] - start[0], end[1] - start[1]), abs=3)
    # flow goes down the bed, through faces near the line
    assert found.direction[0] > 0
    normal = np.array(found.direction)
    assert np.abs((0.5 * (first + second) - start) @ normal).max() < 1.5


@pytest.mark.parametrize("x", [0.0, 20.0])
def test_a_line_on_a_side_is_its_boundary_faces_inward(x):
    found = placed(((x, -5), (x, 5)))
    inner = len(CLOUD.control_volumes.left)
    assert (found.face >= inner).all()
    assert found.direction == pytest.approx((1, 0) if x == 0 else (-1, 0))
    assert found.width.sum() == pytest.approx(10, rel=1e-12)
    assert (found.downstream >= 0).all()


@HEADINGS
def test_flow_goes_inward_at_a_side_else_down_the_bed_else_to_the_right_hand(line, terrain, way):
    found = placed(line, terrain)
    assert found.direction == pytest.approx(way)
    vectors, _, _ = faces_of(found)
    assert (vectors @ found.direction > 0).all()


def test_across_the_whole_slope_a_section_is_as_wide_as_the_slope():
    for x in np.linspace(1, 19, 30):
        assert placed(((x, -5), (x, 5))).width.sum() == pytest.approx(10, rel=1e-9)


def test_the_faces_of_a_bent_line_are_one_chain_too():
    found = placed(((7, -5), (9, 0), (7, 5)))
    vectors, first, second = faces_of(found)
    corners = np.round(np.concatenate([first, second]), 6)
    _, count = np.unique(corners, axis=0, return_counts=True)
    assert (count == 1).sum() == 2
    assert vectors.sum(axis=0)[0] == pytest.approx(10, rel=1e-9)


@pytest.mark.parametrize("line", [((10, -2), (10, 2)), ((0, -2), (0, 2)), ((10.5, -1.5), (10.5, 1.5))])
def test_on_the_points_of_a_lattice_the_faces_are_those_of_the_lattice(line):
    lattice = solver.Lattice((0.5, 19.5), (-4.5, 4.5), 1)
    x, y = lattice.coordinates
    cloud = given_points(np.stack([x.ravel(), y.ravel()], axis=1), *lattice.extent)
    wanted, found = place(line, lattice, SLOPE, 9.81), placed(line, cloud=cloud)
    row, column = wanted.downstream
    cells = {
        (float(lattice.x_points[i]), float(lattice.y_points[j])) for j, i in zip(row, column, strict=True)
    }
    assert {tuple(point) for point in cloud.points[found.downstream]} == cells
    assert found.width.sum() == pytest.approx(wanted.width.sum(), rel=1e-12)


def test_a_line_shorter_than_a_cell_is_a_section():
    for x in np.linspace(1, 19, 50):
        assert len(placed(((x, 0.01), (x, 0.02))).face)


def test_a_line_outside_is_refused():
    with pytest.raises(ValueError, match=r"inside the domain.*found \[30, 2\]"):
        placed(((10, -2), (30, 2)))
