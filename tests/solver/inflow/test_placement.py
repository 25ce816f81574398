"""Sections on a lattice: which faces stand for a line, and which way flow goes through them."""

import numpy as np
import pytest
from hypothesis import assume, given
from hypothesis import strategies as st
from sections import HEADINGS, SLOPE

import solver
from solver.inflow.placement import place

LATTICE = solver.Lattice((0, 20), (-5, 5), 1)


def placed(line, terrain=SLOPE, lattice=LATTICE):
    return place(line, lattice, terrain, 9.81)


def test_a_line_across_the_slope_is_the_faces_above_the_cells_that_hold_it():
    found = placed(((10, -2), (10, 2)))
    assert found.along_x.all()
    assert (found.sign == 1).all()
    assert found.direction == (1, 0)
    # the line goes through the middle of these cells, and they are below it
    assert {*zip(*found.downstream, strict=True)} == {(row, 10) for row in range(3, 8)}
    assert found.width.sum() == pytest.approx(5)


@HEADINGS
def test_flow_goes_inward_at_a_side_else_down_the_bed_else_to_the_right_hand(line, terrain, way):
    assert placed(line, terrain).direction == pytest.approx(way)


@given(
    st.tuples(st.floats(2, 18), st.floats(-4, 4)),
    st.tuples(st.floats(2, 18), st.floats(-4, 4)),
)
def test_the_faces_of_a_line_lead_from_end_to_end_whichever_it_was_drawn_from(start, end):
    assume(abs(end[1] - start[1]) > 0.1)
    found, again = placed((start, end)), placed((end, start))
    # the vectors of the faces add up to that of the line, but for its ends
    x = (found.sign * found.along_x * LATTICE.dy).sum()
    y = (found.sign * ~found.along_x * LATTICE.dx).sum()
    assert x * found.direction[0] + y * found.direction[1] > 0
    # it is widened to whole cells, by less than one at each end in either direction
    for total, length, side in ((y, end[0] - start[0], LATTICE.dx), (x, end[1] - start[1], LATTICE.dy)):
        assert abs(total) == pytest.approx(abs(length), abs=2 * side)
    for name in ("row", "column", "sign", "along_x", "width"):
        assert np.array_equal(getattr(found, name), getattr(again, name))


def test_a_line_outside_is_refused():
    with pytest.raises(ValueError, match=r"inside the domain.*found \[30, 2\]"):
        placed(((10, -2), (30, 2)))


def test_on_an_elevation_model_a_section_stays_off_the_drains():
    x = np.arange(12) * 2.0
    model = solver.ElevationModel(x, x, 50 - 0.3 * np.broadcast_to(x, (12, 12)))
    lattice = solver.Lattice((0, 22), (0, 22), 2)
    found = place(((-1, 6), (-1, 14)), lattice, model, 9.81)
    assert (found.downstream[1] == 1).all()
    assert found.along / found.normal == pytest.approx(0.3, rel=1e-12)
    assert np.ptp(found.bottom) == pytest.approx(0, abs=1e-9)
