"""Buildings and dams beside exact solutions: a stream that is stopped, one that is turned, and what rests."""

import numpy as np
import pytest

from solver import Coulomb, Lattice, Plane, Scene, simulate
from solver.physics.elevation import ElevationModel
from solver.scene import Boundaries
from solver.verification.deflection_cases import deflect
from solver.verification.wall_cases import stop, stopped, turn, turned


@pytest.mark.parametrize(("froude", "ratio"), [(2, 3.49396), (3, 4.86399), (5, 7.64977)])
def test_the_ratio_at_a_wall_is_the_known_one(froude, ratio):
    assert stopped(froude) == pytest.approx(ratio, abs=5e-6)


@pytest.mark.parametrize(
    ("froude", "degrees", "angle", "ratio", "behind"),
    [
        (3, 15, 34.3560, 1.94592, 1.88178),
        (3, 20, 40.3342, 2.29118, 1.61121),
        (5, 20, 30.6923, 3.14373, 2.46781),
        (5, 30, 41.9293, 4.25136, 1.84393),
    ],
)
def test_the_oblique_shock_is_the_known_one(froude, degrees, angle, ratio, behind):
    shock = turned(froude, np.radians(degrees))
    assert np.degrees(shock.angle) == pytest.approx(angle, abs=5e-5)
    assert shock.ratio == pytest.approx(ratio, abs=5e-6)
    assert shock.froude == pytest.approx(behind, abs=5e-6)


@pytest.mark.parametrize("froude", [2, 3, 5])
def test_a_stream_against_a_building_sends_the_bore_back(froude):
    ratio = stopped(froude)
    speed = froude / (ratio - 1)
    coarse, fine = stop(froude, 1.0), stop(froude, 0.25)
    assert fine.ratio == pytest.approx(ratio, rel=5e-4)
    assert fine.speed == pytest.approx(speed, rel=1e-3)
    assert abs(fine.ratio - ratio) < abs(coarse.ratio - ratio)
    assert abs(fine.speed - speed) < abs(coarse.speed - speed)
    assert abs(fine.volume_error) < 1e-15


@pytest.mark.parametrize(("froude", "degrees"), [(3, 15), (3, 20), (5, 20), (5, 30)])
def test_a_stream_along_a_building_is_turned_by_the_oblique_shock(froude, degrees):
    exact = turned(froude, np.radians(degrees))
    fine, coarse = (turn(froude, np.radians(degrees), spacing) for spacing in (0.25, 1.0))
    assert np.degrees(fine.angle) == pytest.approx(np.degrees(exact.angle), abs=0.15)
    assert fine.ratio == pytest.approx(exact.ratio, rel=6e-3)
    assert fine.froude == pytest.approx(exact.froude, rel=6e-3)
    errors = [
        sum(abs(getattr(each, name) / getattr(exact, name) - 1) for name in ("angle", "ratio", "froude"))
        for each in (fine, coarse)
    ]
    assert errors[0] < 0.5 * errors[1]


@pytest.mark.parametrize("froude", [2, 3, 5])
def test_a_stream_against_a_building_on_a_cloud_sends_the_bore_back(froude):
    ratio = stopped(froude)
    speed = froude / (ratio - 1)
    coarse, fine = stop(froude, 1.0, seed=1), stop(froude, 0.25, seed=1)
    assert fine.ratio == pytest.approx(ratio, rel=8e-3)
    assert fine.speed == pytest.approx(speed, rel=6e-3)
    assert abs(fine.ratio - ratio) < 0.5 * abs(coarse.ratio - ratio)
    assert abs(fine.speed - speed) < 0.5 * abs(coarse.speed - speed)
    assert abs(fine.volume_error) < 5e-16


@pytest.mark.parametrize(("froude", "degrees"), [(3, 15), (3, 20), (5, 20), (5, 30)])
def test_a_stream_along_a_building_on_a_cloud_is_turned_by_the_oblique_shock(froude, degrees):
    exact = turned(froude, np.radians(degrees))
    fine, coarse = (turn(froude, np.radians(degrees), spacing, seed=1) for spacing in (0.25, 1.0))
    assert np.degrees(fine.angle) == pytest.approx(np.degrees(exact.angle), abs=0.15)
    assert fine.ratio == pytest.approx(exact.ratio, rel=6e-3)
    assert fine.froude == pytest.approx(exact.froude, rel=2.5e-2)
    errors = [
        sum(abs(getattr(each, name) / getattr(exact, name) - 1) for name in ("angle", "ratio", "froude"))
        for each in (fine, coarse)
    ]
    assert errors[0] < 0.5 * errors[1]


def test_a_staircase_of_cells_turns_a_stream_nearly_as_a_plane_wall_does():
    exact = turned(3.0, np.radians(20))
    found = deflect(3.0, np.radians(20), 1.0, None)
    assert np.degrees(found.angle) == pytest.approx(np.degrees(exact.angle), abs=1.0)
    # it takes some of the momentum along the wall
    assert 0.93 < found.ratio / exact.ratio < 1.0


def beds():
    x = np.arange(-30.0, 31.0)
    flat = ElevationModel(x, x, np.zeros((61, 61)))
    return [Plane(0.0), flat]


def buildings(lattice):
    x, y = lattice.coordinates
    return ((abs(x - 3) < 4) & (abs(y + 2) < 3)) | ((x == 10) & (abs(y) < 6)) | ((x == -8) & (y == -8))


@pytest.mark.parametrize("bed", beds())
def test_a_lake_beside_buildings_rests_to_the_last_bit(bed):
    lattice = Lattice((-20, 20), (-15, 15), 1.0)
    built = buildings(lattice)
    x, y = lattice.coordinates
    depth = np.where(built | (abs(x) > 17) | (abs(y) > 12), 0.0, 1.7)
    sides = Boundaries() if isinstance(bed, ElevationModel) else Boundaries("wall", "wall", "wall", "wall")
    # friction holds the edges of the lake, where it has some
    scene = Scene(
        *(lattice, bed, depth, 0 * depth, 0 * depth, Coulomb(70.0)), buildings=built, boundaries=sides
    )
    run = simulate(scene, [0.0, 5.0])
    np.testing.assert_array_equal(run.depth[1], depth)
    assert run.rest_time == 0.0


def test_a_lake_without_friction_between_buildings_and_walls_has_no_current():
    lattice = Lattice((-20, 20), (-15, 15), 1.0)
    built = buildings(lattice)
    depth = np.where(built, 0.0, 1.7)
    scene = Scene(
        *(lattice, Plane(0.0), depth, 0 * depth, 0 * depth, Coulomb(0.0)),
        buildings=built,
        boundaries=Boundaries("wall", "wall", "wall", "wall"),
    )
    run = simulate(scene, [5.0], stop_at_rest=False)
    np.testing.assert_array_equal(run.depth[0], depth)
    assert (run.velocity_x == 0).all()
    assert (run.max_speed == 0).all()


@pytest.mark.parametrize("bed", beds())
def test_flow_around_buildings_keeps_volume_and_stays_out_of_them(bed):
    lattice = Lattice((-20, 20), (-15, 15), 1.0)
    built = buildings(lattice)
    x, y = lattice.coordinates
    depth = np.where((x < -10) & (x > -18) & (abs(y) < 9) & ~built, 4.0, 0.0)
    scene = Scene(lattice, bed, depth, 3.0 * (depth > 0), 0 * depth, Coulomb(5.0), buildings=built)
    run = simulate(scene, [2.0, 6.0])
    assert abs(run.ledger.error) < 1e-15
    assert (run.max_depth[built] == 0).all()
    assert (run.max_speed[built] == 0).all()
    assert np.isnan(run.arrival_time[built]).all()
    assert (run.max_depth[~built] > 0.5).sum() > 300


@pytest.mark.parametrize("kind", ["profile", "surface"])
def test_what_leans_on_a_building_rests(kind):
    # steeper than friction: it would slide on without the building, and out of the yard without its sides
    lattice = Lattice((0, 40), (-4, 4), 1.0)
    x, y = lattice.coordinates
    built = (x >= 30) | ((abs(y) == 2) & (x > 10))
    depth = np.where((x > 22) & (x < 30) & (abs(y) < 2), 0.5, 0.0)
    terrain = Plane(25.0) if kind == "profile" else plane(25.0)
    scene = Scene(lattice, terrain, depth, 0 * depth, 0 * depth, Coulomb(20.0), buildings=built)
    run = simulate(scene, [200.0])
    assert run.failure is None
    assert np.isfinite(run.rest_time)
    assert run.ledger.outflow == 0
    # no lower than the wedge that friction holds at its limit, and higher by its fall
    rise = np.tan(np.radians(25)) - np.tan(np.radians(20))
    spacing = 1.0 if kind == "profile" else 1 / np.cos(np.radians(25))
    least = np.sqrt(2 * 7 * 0.5 * spacing * rise) - rise * spacing / 2
    assert least < run.deposit_depth[4, 29] < 1.4 * least


def plane(angle):
    x, y = np.arange(-10.0, 61.0), np.arange(-20.0, 21.0)
    return ElevationModel(x, y, np.broadcast_to(-np.tan(np.radians(angle)) * x, (41, 71)).copy(), None)
