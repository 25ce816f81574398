"""Resistance laws through the whole scheme: sheets on uniform slopes, and what rests."""

from dataclasses import replace

import numpy as np
import pytest

from solver.forms import begin
from solver.physics.elevation import ElevationModel
from solver.physics.friction import (
    Bingham,
    Chezy,
    Edwards,
    HerschelBulkley,
    Manning,
    OBrien,
    Pouliquen,
    Voellmy,
    friction_angle,
)
from solver.physics.terrain import Plane
from solver.points.cloud import random_points
from solver.points.lattice import Lattice
from solver.scene import Boundaries, Collocation, Scene, WeightedResidual
from solver.simulation import simulate

DENSITY = 2000.0
BINGHAM = Bingham(1000.0, 100.0, density=DENSITY)
HERSCHEL = HerschelBulkley(1000.0, 500.0, 1 / 3, DENSITY)
OBRIEN = OBrien(1000.0, 100.0, 0.05, 24.0, DENSITY)
COHESIVE = Voellmy(friction_angle(0.2), 200.0, 1000.0, DENSITY)
ANGLES = tuple(map(friction_angle, (0.2, 0.5)))
COARSE = Pouliquen(ANGLES, 0.136, 0.5)
EDWARDS = Edwards((*ANGLES, friction_angle(0.25)), 0.136, 0.5, 0.136)
OPEN, WALLS = Boundaries(), Boundaries("wall", "wall", "wall", "wall")


def sheet(law, angle, h, u=0.0, length=60.0, spacing=1.0, **changes):
    """Lay a sheet on a row of cells, so long that nothing comes from its upper end to its lower one."""
    row = Lattice((0, length), (0, 2 * spacing), spacing)
    depth = np.full(row.shape, float(h))
    return Scene(row, Plane(angle), depth, np.full(row.shape, float(u)), 0 * depth, law, **changes)


def at_the_end(result):
    return result.velocity_x[-1][0, -2]


# law, inclination (degrees), depth (m), first speed (m s-1), time (s), speed (m s-1)
MOVING = [
    (Voellmy(friction_angle(0.1), 200.0), 20, 1, 0, 5, 6.61203),
    (Manning(0.05), 5, 2, 0, 5, 4.00129),
    (BINGHAM, 10, 1, 0, 3, 2.51552),
    (HERSCHEL, 10, 1, 0, 3, 2.07712),
    (OBRIEN, 10, 1, 0, 3, 2.71818),
    (Pouliquen((21.0, 30.7), 0.136, 0.65e-3), 24, 0.01, 0, 0.5, 0.156554),
    (EDWARDS, 16, 2, 0.3, 5, 0.848259),
]
NAMES = [type(law).__name__ for law, *_ in MOVING]


@pytest.mark.parametrize(("law", "angle", "h", "first", "time", "speed"), MOVING, ids=NAMES)
def test_a_sheet_speeds_up_as_it_should_at_first_order_in_the_step(law, angle, h, first, time, speed):
    length, spacing = (1.0, 0.01) if h < 0.1 else (60.0, 1.0)
    errors = []
    for cfl in (0.8, 0.4, 0.2):
        scheme = WeightedResidual(cfl=cfl)
        run = simulate(sheet(law, angle, h, first, length, spacing, scheme=scheme), [time])
        assert run.failure is None
        errors.append(at_the_end(run) / speed - 1)
    assert np.abs(errors[0]) < 0.03
    assert errors[1] / errors[2] == pytest.approx(2.0, abs=0.25)
    # what is left of the error after the first order is taken off
    assert abs(2 * errors[2] - errors[1]) < 3e-4


STEADY = [
    (Chezy(np.sqrt(500.0)), 5, 2, 9.33572),
    (Manning(0.05), 5, 2, 9.37270),
    (COHESIVE, 20, 1, 4.76040),
    (BINGHAM, 10, 1, 6.50018),
    (Bingham(1000.0, 100.0, "linear", 1.5, DENSITY), 10, 1, 6.35659),
    (HERSCHEL, 10, 1, 16.9197),
    (OBRIEN, 10, 1, 4.58545),
    (EDWARDS, 16, 2, 0.960986),
]


@pytest.mark.parametrize(
    ("law", "angle", "h", "speed"), STEADY, ids=[type(law).__name__ for law, *_ in STEADY]
)
def test_a_sheet_at_its_terminal_speed_keeps_it(law, angle, h, speed):
    run = simulate(sheet(law, angle, h, speed, 100.0, 2.0), [2.0])
    assert run.failure is None
    assert run.steps > 5
    assert at_the_end(run) == pytest.approx(speed, rel=1e-5)


@pytest.mark.parametrize(
    ("law", "h", "time"),
    [(BINGHAM, 1, 5.05950), (HERSCHEL, 1, 4.47359), (OBRIEN, 1, 5.34802), (COARSE, 2, 1.55657)],
    ids=["Bingham", "HerschelBulkley", "OBrien", "Pouliquen"],
)
def test_a_sheet_on_flat_ground_stops_exactly_and_in_time(law, h, time):
    last = []
    for cfl in (0.4, 0.2):
        scene = sheet(law, 0, h, 5.0, scheme=WeightedResidual(cfl=cfl))
        times = np.linspace(0.9 * time, 1.1 * time, 201)
        run = simulate(scene, times, stop_at_rest=False)
        speeds = run.velocity_x[:, 0, -2]
        assert speeds[0] > 0
        assert speeds[-1] == 0.0
        last.append(times[np.argmax(speeds == 0.0)])
    assert abs(last[1] / time - 1) < 0.03
    assert abs(last[1] - time) <= abs(last[0] - time) + 0.001 * time


@pytest.mark.parametrize(
    ("law", "angle", "thickness"),
    [(COHESIVE, 20, 0.262539), (BINGHAM, 10, 0.293515), (EDWARDS, 16, 3.58215)],
    ids=["Voellmy", "Bingham", "Edwards"],
)
def test_a_sheet_at_rest_stays_to_the_last_bit_below_its_thickness_and_slides_above(law, angle, thickness):
    for factor, moves in ((1 - 1e-4, False), (1 + 1e-4, True)):
        scene = sheet(law, angle, factor * thickness)
        run = simulate(scene, [1.0])
        assert bool(run.max_speed.any()) == moves
        assert (run.depth[-1] == scene.depth).all() == (not moves)


def test_a_bingham_sheet_rests_in_the_profile_that_its_yield_stress_holds():
    """``h^2 = 2 tau_y (x_f - x)/(rho g)``; 1.00964 m at 10 m from the front."""
    row = Lattice((0.25, 19.75), (0, 1), 0.5)
    x = row.coordinates[0]
    depth = np.sqrt(2 * 1000.0 * np.maximum(0, 15.0 - x) / (DENSITY * 9.81))
    assert np.sqrt(2 * 1000.0 * 10.0 / (DENSITY * 9.81)) == pytest.approx(1.00964, abs=5e-6)
    still = Scene(row, Plane(0), depth, 0 * depth, 0 * depth, BINGHAM, boundaries=WALLS)
    rests = simulate(still, [5.0])
    assert rests.rest_time == 0.0
    assert (rests.depth[-1] == depth).all()
    flows = simulate(replace(still, friction=replace(BINGHAM, yield_stress=990.0)), [5.0])
    assert flows.max_speed.any()


FAMILIES = [
    (COHESIVE, 20, 4.76040),
    (Manning(0.05), 5, None),
    (BINGHAM, 10, 6.50018),
    (EDWARDS, 16, 0.960986),
]


@pytest.mark.slow
@pytest.mark.parametrize(
    ("law", "angle", "speed"), FAMILIES, ids=["cohesive", "Manning", "Bingham", "Edwards"]
)
def test_clouds_and_surfaces_know_the_laws_as_lattices_do(law, angle, speed):
    h = 2.0 if law is EDWARDS else 1.0
    far, times = 40.0, [1.5]
    lattice = Lattice((0, far), (0, 10), 2.0)
    found = []
    for points in (lattice, random_points((0.0, far), (0.0, 10.0), 300, 1)):
        flat = np.zeros(points.shape)
        run = simulate(Scene(points, Plane(angle), h + flat, 0.3 + flat, flat, law), times)
        assert run.failure is None
        x, y = (a + flat for a in points.coordinates)
        inside = (x > 0.7 * far) & (x < 0.9 * far) & (y > 3) & (y < 7)
        found.append(run.velocity_x[-1][inside])
    places = np.arange(-10.0, far + 11, 2.0)
    slope = np.tan(np.radians(angle))
    bed = ElevationModel(places, places, np.broadcast_to(-slope * places, (len(places),) * 2).copy())
    # in plan, so that the way along the bed is the same
    ground = Lattice((0, far), (0, 10), 2.0)
    flat = np.zeros(ground.shape)
    run = simulate(Scene(ground, bed, h + flat, 0.3 + flat, flat, law), times)
    assert run.failure is None
    found.append(run.velocity_x[-1][2, -7:-4])
    expected = found[0].mean()
    assert expected > 0.1
    for values in found:
        assert values == pytest.approx(expected, rel=5e-3)


def test_earth_pressure_and_the_collocation_form_refuse_laws_they_do_not_know():
    from solver.physics.earth_pressure import MohrCoulomb

    scene = sheet(BINGHAM, 10, 1.0)
    with pytest.raises(ValueError, match="mohr-coulomb earth pressure goes with coulomb and voellmy"):
        begin(replace(scene, earth_pressure=MohrCoulomb(30, 20)), 1.0, 0.0, True)
    with pytest.raises(ValueError, match="collocation form knows coulomb and voellmy"):
        begin(replace(scene, scheme=Collocation(support=9, degree=1)), 1.0, 0.0, True)
