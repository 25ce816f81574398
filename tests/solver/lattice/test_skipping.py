"""What a scene does not need is left out, and the result is the same to the last bit."""

from dataclasses import astuple, fields, replace

import numpy as np
import pytest
from scenes import SCENES, heap

from solver.kernels.runge_kutta import NOT_FINITE
from solver.lattice.run import LatticeRun
from solver.physics.earth_pressure import Isotropic, MohrCoulomb
from solver.physics.friction import Coulomb, Voellmy
from solver.physics.terrain import Bend
from solver.points.lattice import Lattice
from solver.result import Result
from solver.scene import Boundaries, Scene
from solver.simulation import simulate

COSTS = {"wall_time", "cpu_time", "cell_stages"}


def assert_same(some: Result, whole: Result) -> None:
    for field in fields(Result):
        if field.name not in COSTS:
            found, wanted = getattr(some, field.name), getattr(whole, field.name)
            if isinstance(found, np.ndarray):
                np.testing.assert_array_equal(found, wanted, err_msg=field.name)
            elif field.name == "ledger":
                assert astuple(found) == pytest.approx(astuple(wanted), rel=1e-14)
                assert found.now == wanted.now
            else:
                assert str(found) == str(wanted), field.name


@pytest.mark.parametrize("name", SCENES)
def test_a_window_on_the_lattice_gives_the_same(name, monkeypatch):
    monkeypatch.setattr("solver.lattice.run.LEAST_GROWTH", 2)
    case, end = SCENES[name]
    times = np.linspace(0, end, 4)
    some, whole = (simulate(case, times, arrival_depth=0.01, skip=skip) for skip in (True, False))
    assert_same(some, whole)


def chute(width, length, spacing=0.4, **changes):
    lattice = Lattice((0, length), (-width / 2, width / 2), spacing)
    depth = heap(lattice, (4, 0), 1.85, 1.5)
    bed, static = Bend(35, 17.5, 21.5), 0 * depth
    laws = {"earth_pressure": MohrCoulomb(30, 30), "gravity": 1.0} | changes
    return Scene(lattice, bed, depth, static, static, Coulomb(30), **laws)


@pytest.mark.parametrize("side", ["wall", "open"])
def test_a_window_grows_with_the_flow_and_gives_the_same(side):
    case = chute(12.0, 28.0, boundaries=Boundaries("open", "open", side, side))
    times = np.arange(0.0, 25.0, 4.0)
    assert_same(simulate(case, times), simulate(case, times, skip=False))


def test_a_domain_much_too_large_has_the_work_and_the_arrays_of_a_fitting_one():
    def run(width, length):
        made = LatticeRun(chute(width, length), 8.0, 0.01)
        made.advance(8.0, None)
        return made

    fitting, large = run(16.0, 32.0), run(160.0, 320.0)
    assert large.progress.cell_stages[0] <= 1.02 * fitting.progress.cell_stages[0]
    assert large.now.h.size < 1.5 * fitting.now.h.size
    assert large.now.h.size < large.lattice.shape[0] * large.lattice.shape[1] / 20
    assert large.progress.steps[0] == fitting.progress.steps[0]


def test_a_failure_in_a_window_is_placed_on_the_lattice(monkeypatch):
    monkeypatch.setattr("solver.lattice.run.LEAST_GROWTH", 2)
    run = LatticeRun(chute(12.0, 28.0), 1.0, 0.0)
    assert run.window.south > 0
    assert run.window.west > 0
    row, column = np.argwhere(run.state[0] > 0.5)[-1]
    run.now.u[(row - run.window.south + 2) * run.grid.stride + column - run.window.west + 2] = np.nan
    assert run.advance(1.0, None) == NOT_FINITE
    at = run.lattice.x_points[column], run.lattice.y_points[row]
    # what is not finite spreads by two cells a stage
    assert run.place == pytest.approx(at, abs=6 * 0.4)


@pytest.mark.parametrize("rows", [29, 30])
@pytest.mark.parametrize("sides", ["wall", "open", "no-slip", 0.2])
def test_a_mirrored_scene_runs_on_its_half(rows, sides):
    lattice = Lattice((0, 12), (-0.2 * (rows - 1), 0.2 * (rows - 1)), 0.4)
    assert lattice.shape[0] == rows
    two = heap(lattice, (4, 2.2), 1.85, 1.5)
    depth = np.maximum(two, two[::-1])
    y = lattice.coordinates[1]
    case = Scene(
        lattice,
        Bend(35, 6, 9),
        depth,
        0 * y + 1.5,
        np.where(depth > 0, -1.5 * (y - y[::-1]) / 2, 0.0),
        Coulomb(30),
        MohrCoulomb(35, 30),
        gravity=1.0,
        boundaries=Boundaries("open", "open", sides, sides),
    )
    half = LatticeRun(case, 1.0, 0.0)
    assert half.part.kind == "half"
    assert half.grid.rows <= (rows + 1) // 2 + 4
    times = np.arange(0.0, 13.0, 2.0)
    some, whole = (simulate(case, times, arrival_depth=0.01, skip=skip) for skip in (True, False))
    assert_same(some, whole)
    assert some.cell_stages < 0.6 * whole.cell_stages
    for name in ("depth", "velocity_y"):
        assert getattr(some, name).tobytes() == (getattr(whole, name) + 0.0).tobytes()


def test_half_of_what_is_no_mirror_image_is_not_enough():
    even = chute(12.0, 28.0)
    assert LatticeRun(even, 1.0, 0.0).part.kind == "half"
    uneven = even.depth.copy()
    uneven[np.unravel_index(uneven.argmax(), uneven.shape)[0] + 1] *= 1 + 1e-15
    for change in (
        {"depth": uneven},
        {"velocity_y": 0.0 * even.depth + 0.1},
        {"boundaries": Boundaries(y_min="wall")},
        {"boundaries": Boundaries(y_min=0.1, y_max=0.2)},
    ):
        assert LatticeRun(replace(even, **change), 1.0, 0.0).part.kind == "whole"


@pytest.mark.parametrize("sides", ["wall", "open"])
@pytest.mark.parametrize("pressure", [MohrCoulomb(35, 30), Isotropic()])
def test_a_scene_that_does_not_vary_across_the_slope_runs_as_one_row(sides, pressure):
    lattice = Lattice((0, 15), (-2, 2), 0.5)
    x = lattice.coordinates[0]
    depth = np.maximum(0, 1 - ((x - 5) / 3) ** 2)
    case = Scene(
        lattice,
        Bend(35, 8, 12),
        depth,
        0.5 + 0 * x,
        0 * x,
        Voellmy(20, 300.0),
        pressure,
        boundaries=Boundaries("wall", "open", sides, sides),
    )
    assert LatticeRun(case, 1.0, 0.0).grid.rows == 5
    times = np.linspace(0, 8, 5)
    some, whole = (simulate(case, times, arrival_depth=0.01, skip=skip) for skip in (True, False))
    assert whole.ledger.outflow > 0.1
    assert_same(some, whole)
    assert some.cell_stages <= whole.cell_stages / 9
    for change in ({"velocity_y": 0 * x + 0.1}, {"boundaries": Boundaries(y_min="no-slip")}):
        assert LatticeRun(replace(case, **change), 1.0, 0.0).part.kind != "row"


def test_frames_that_are_not_asked_for_are_not_kept():
    case, end = SCENES["frictionless"]
    times = np.linspace(0, end, 3)
    whole, some = simulate(case, times), simulate(case, times, frames=["velocity_x"])
    assert some.depth.shape == some.velocity_y.shape == (0, *case.points.shape)
    np.testing.assert_array_equal(some.velocity_x, whole.velocity_x)
    np.testing.assert_array_equal(some.deposit_depth, whole.deposit_depth)
    assert simulate(case, times, frames=()).steps == whole.steps
