"""Cells beside buildings: which they are, their images, and that nothing changes without them."""

import numpy as np
import pytest
from checkpoints import with_and_without_a_restart

from solver import Coulomb, Lattice, MohrCoulomb, Plane, Scene, simulate
from solver.lattice.walls import EAST, NORTH, SOUTH, WEST, wall_flux, walls_of
from solver.physics.elevation import ElevationModel
from solver.scene import Boundaries, Collocation

POINTS = Lattice((-15, 15), (-12, 12), 1.0)


def bed(kind):
    if kind == "plane":
        return Plane(20.0)
    x, y = np.arange(-20.0, 21.0), np.arange(-20.0, 21.0)
    z = (
        -0.36 * x
        + 0.01 * y[:, None] ** 2
        + np.random.default_rng(2).normal(0, 0.05, 21)[abs(np.arange(-20, 21))][:, None]
    )
    return ElevationModel(x, y, z, 4.0)


def scene(kind, built, **more):
    x, y = POINTS.coordinates
    depth = np.where(built, 0.0, np.maximum(0.0, 3 - ((x + 8) ** 2 + (y - 1) ** 2) / 8))
    return Scene(POINTS, bed(kind), depth, 0 * depth, 0 * depth, Coulomb(12.0), buildings=built, **more)


def houses():
    x, y = POINTS.coordinates
    return (
        ((abs(x - 1) < 3) & (abs(y - 3) < 2)) | ((x == 2) & (y == -4)) | ((abs(x - 6) < 1) & (abs(y + 1) < 5))
    )


def test_cells_beside_buildings_are_found_once_each_with_their_walls():
    buildings = np.zeros((8, 9), bool)
    buildings[4, 4] = buildings[3, 6] = True
    walls = walls_of(buildings)
    found = {int(cell): blocked.tolist() for cell, blocked in zip(walls.cell, walls.blocked, strict=True)}
    sides = {WEST: 4 * 9 + 5, EAST: 4 * 9 + 3, SOUTH: 5 * 9 + 4, NORTH: 3 * 9 + 4}
    for side, cell in sides.items():
        assert found[cell][side], side
    assert walls.first[-1] == len(walls.cell) == len(found)
    assert found[3 * 9 + 5] == [False, True, False, False]
    for row in range(8):
        assert (walls.cell[walls.first[row] : walls.first[row + 1]] // 9 == row).all()


def test_the_flux_at_a_wall_is_hll_between_a_state_and_its_image():
    h, n, c = 1.3, 2.1, 3.4
    slow, fast = -(n + c), n + c
    # HLL with opposite momentum on the far side
    impulse = (fast * h * n * n - slow * h * n * n + fast * slow * (-h * n - h * n)) / (fast - slow)
    push, pressed = wall_flux(h, n, c)
    assert push == pytest.approx(impulse, rel=1e-14)
    assert pressed == pytest.approx(h * h / 2)


@pytest.mark.parametrize("kind", ["plane", "surface"])
def test_mirror_images_agree_to_the_last_bit(kind):
    built = houses()
    one = simulate(scene(kind, built), [1.0, 4.0])
    start = scene(kind, built)
    flipped = Scene(
        *(
            POINTS,
            start.terrain,
            start.depth[::-1].copy(),
            start.velocity_x,
            start.velocity_y,
            start.friction,
        ),
        buildings=built[::-1].copy(),
    )
    two = simulate(flipped, [1.0, 4.0])
    assert one.steps == two.steps > 10
    assert (one.max_depth[:, 20:] > 0).any()
    np.testing.assert_array_equal(one.depth, two.depth[:, ::-1])
    np.testing.assert_array_equal(one.velocity_x, two.velocity_x[:, ::-1])
    np.testing.assert_array_equal(one.velocity_y, -two.velocity_y[:, ::-1])


@pytest.mark.parametrize("kind", ["plane", "surface"])
@pytest.mark.parametrize("skip", [True, False])
def test_no_building_changes_no_bit(kind, skip):
    none = np.zeros(POINTS.shape, bool)
    plain = scene(kind, none)
    one = simulate(plain, [3.0], skip=skip)
    two = simulate(
        Scene(POINTS, plain.terrain, plain.depth, plain.velocity_x, plain.velocity_y, plain.friction), [3.0]
    )
    np.testing.assert_array_equal(one.depth, two.depth)
    np.testing.assert_array_equal(one.max_speed, two.max_speed)


@pytest.mark.parametrize("kind", ["plane", "surface"])
def test_skipping_and_growing_change_no_bit(kind, monkeypatch):
    monkeypatch.setattr("solver.lattice.run.LEAST_GROWTH", 2)
    one, two = (simulate(scene(kind, houses()), [1.0, 5.0], skip=skip) for skip in (True, False))
    np.testing.assert_array_equal(one.depth, two.depth)
    np.testing.assert_array_equal(one.max_momentum_flux, two.max_momentum_flux)


@pytest.mark.parametrize("kind", ["plane", "surface"])
def test_ten_steps_are_five_and_a_restart_and_five(kind, monkeypatch):
    monkeypatch.setattr("solver.lattice.run.LEAST_GROWTH", 2)
    whole, second = with_and_without_a_restart(scene(kind, houses()), 30.0, 24)
    for one, two in zip(whole.state, second.state, strict=True):
        np.testing.assert_array_equal(one, two)


@pytest.mark.parametrize("pressure", [{}, {"earth_pressure": MohrCoulomb(30, 12)}])
def test_a_building_along_a_side_is_a_wall_side(pressure):
    long, short = Lattice((0, 32), (0, 5), 1.0), Lattice((0, 29), (0, 5), 1.0)

    def run(lattice, built, side):
        x, y = lattice.coordinates
        depth = np.where((x > 12) & (x < 30), 1.0 + 0.1 * np.sin(y), 0.0)
        start = Scene(
            *(lattice, Plane(0.0), depth, 5.0 * (depth > 0), 0 * depth, Coulomb(0.0)),
            buildings=built,
            boundaries=Boundaries("open", side, "wall", "wall"),
        )
        return simulate(start, [1.5], stop_at_rest=False)

    built = (long.coordinates[0] >= 30) & (long.coordinates[1] >= 0)
    one, two = run(long, built, "open"), run(short, None, "wall")
    np.testing.assert_allclose(one.depth[0][:, :30], two.depth[0], atol=1e-12)


def test_what_buildings_cannot_have_is_refused():
    built = houses()
    start = scene("plane", built)
    state = start.velocity_x, start.velocity_y, start.friction
    with pytest.raises(ValueError, match="no material"):
        simulate(Scene(POINTS, start.terrain, start.depth + 1.0, *state, buildings=built), [1.0])
    with pytest.raises(ValueError, match="true or false"):
        simulate(Scene(POINTS, start.terrain, start.depth, *state, buildings=built[1:]), [1.0])
    side = built.copy()
    side[:, -1] = True
    with pytest.raises(ValueError, match="given depth"):
        simulate(scene("plane", side, boundaries=Boundaries(x_max=1.0)), [1.0])
    with pytest.raises(ValueError, match="weighted-residual form"):
        simulate(scene("plane", built, scheme=Collocation()), [1.0])
