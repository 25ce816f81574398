"""What runs that erode keep: the volume of flow and bed, mirror images, rest, and all else as it was."""

from dataclasses import fields, replace

import numpy as np
import pytest
from checkpoints import CLOUD, other
from scenes import FOUR, LATTICE, SCENES, scene

from solver.lattice.run import LatticeRun
from solver.parameters import ParameterError
from solver.physics.erosion import (
    Egashira,
    ErodibleBed,
    ErosionLimits,
    ErosionZone,
    GrowthRate,
    JumpCondition,
    ShearStress,
    ShearWork,
)
from solver.physics.friction import Coulomb, Voellmy
from solver.physics.terrain import Plane
from solver.points.lattice import Lattice
from solver.result import Result
from solver.scene import Boundaries, Collocation, Scene, WeightedResidual, Zone
from solver.simulation import simulate
from solver.verification.surfaces import Bowl, Inclined

SLOW = ErosionLimits(minimum_speed=0.01)
LAW = {
    "growth rate": GrowthRate(0.05),
    "shear stress": ShearStress(critical_stress=100.0, density=2000.0),
    "shear stress of friction": ShearStress(critical_stress=100.0, stress="friction", density=2000.0),
    "shear work": ShearWork(200.0),
    "Egashira": Egashira(),
    "jump condition": JumpCondition(0.1),
}


def eroding(case, law=LAW["growth rate"], depth=0.3, limits=SLOW):
    """A scene on a bed whose erodible depth differs from cell to cell, but not between mirror images."""
    x, y = case.points.coordinates
    middle = (y.max() + y.min()) / 2
    there = depth * (1 + 0.5 * np.sin(x)) * (np.abs(y - middle) < 3)
    return replace(case, erodible_bed=ErodibleBed(there, law, limits))


def on_surface(surface, start=0.0):
    points = Lattice((-15.0, 45.0), (-20.0, 20.0), 1.0)
    x, y = points.coordinates
    depth = np.maximum(0.0, 2.0 - ((x - start) ** 2 + (y - 1) ** 2) / 20)
    return Scene(points, surface, depth, 0 * depth, 0 * depth, Coulomb(15.0))


ERODING = {name: (eroding(*case[:1]), case[1]) for name, case in SCENES.items()}
PLACES = {
    "lattice": (scene(Plane(30), Voellmy(10, 200.0), FOUR), 2.0),
    "cloud": (other(CLOUD, WeightedResidual()), 1.5),
    "surface": (on_surface(Inclined(30.0, 30.0)), 3.0),
    "hollow": (on_surface(Bowl(60.0), 32.0), 3.0),
}


@pytest.mark.parametrize("name", SCENES)
def test_flow_and_bed_keep_their_volume_to_round_off(name):
    case, end = ERODING[name]
    run = simulate(case, [end])
    assert run.ledger.entrained > 0
    assert abs(run.ledger.error) < 1e-14
    assert abs(run.ledger.bed_error) < 1e-14
    assert (run.erosion_depth >= 0).all()
    assert (run.erosion_depth <= case.erodible_bed.depth).all()


@pytest.mark.parametrize("law", LAW)
@pytest.mark.parametrize("place", PLACES)
def test_every_law_does_so_everywhere(place, law):
    case, end = PLACES[place]
    case = eroding(case, LAW[law])
    run = simulate(case, np.linspace(0.0, end, 5))
    assert run.failure is None
    assert run.ledger.entrained > 1e-3 * run.ledger.released
    assert abs(run.ledger.error) < 1e-13
    assert abs(run.ledger.bed_error) < 1e-13
    assert run.entrained[0] == 0.0
    assert (np.diff(run.entrained) >= 0).all()
    assert run.entrained[-1] == run.ledger.entrained
    still = ~(run.max_speed > 0)
    assert (run.erosion_depth[still] == 0).all()


def test_on_a_surface_depth_counts_by_the_area_on_the_bed():
    case, end = PLACES["surface"]
    run = simulate(eroding(case), [end])
    plan = case.points.cell_area
    # a plane of 30 degrees has cells larger by 1/cos(30)
    area = plan / np.cos(np.radians(30))
    assert run.ledger.eroded == pytest.approx(area * run.erosion_depth.sum(), rel=1e-12)
    change = plan * run.bed_change.sum()
    assert change == pytest.approx(run.ledger.now - run.ledger.entrained, rel=1e-12)


def test_on_a_profile_the_change_of_the_ground_is_vertical():
    case, end = PLACES["lattice"]
    run = simulate(eroding(case), [end])
    normal = run.deposit_depth - run.erosion_depth
    np.testing.assert_allclose(run.bed_change, normal / np.cos(np.radians(30)), rtol=1e-14)


def assert_same(one, two, without=()):
    for field in fields(Result):
        if field.name in {"wall_time", "cpu_time", "cell_stages", "ledger", "entrained", *without}:
            continue
        np.testing.assert_array_equal(getattr(one, field.name), getattr(two, field.name), field.name)


@pytest.mark.parametrize("name", [*SCENES, *PLACES])
def test_a_bed_with_nothing_to_erode_changes_nothing(name):
    case, end = (SCENES | PLACES)[name]
    plain, bare = simulate(case, [end / 2, end]), simulate(eroding(case, depth=0.0), [end / 2, end])
    assert_same(plain, bare, without={"erosion_depth", "bed_change"})
    assert plain.ledger == bare.ledger
    assert plain.erosion_depth is plain.entrained is plain.bed_change is None
    assert not bare.erosion_depth.any()


@pytest.mark.parametrize("law", LAW)
@pytest.mark.parametrize("skip", [True, False])
def test_a_symmetric_scene_stays_so_to_the_last_bit(law, skip):
    heaps = (((3, 1.5), 1.4, 1.0), ((3, -1.5), 1.4, 1.0))
    case = eroding(scene(Plane(30), Voellmy(15, 200.0), heaps), LAW[law])
    case = replace(case, depth=np.maximum(case.depth, case.depth[::-1]))
    run = simulate(case, [0.5, 1.5], skip=skip)
    assert LatticeRun(case, 1.5, 0.0).part.kind == "half"
    assert run.erosion_depth.any()
    for values in (*run.depth, *run.velocity_x, run.erosion_depth, run.bed_change):
        assert (values == values[::-1]).all()


def test_a_mirrored_bed_mirrors_the_result_to_the_last_bit():
    case = scene(Plane(30), Voellmy(15, 200.0), (((3, 0.0), 2.0, 1.0),))
    case = replace(case, depth=np.maximum(case.depth, case.depth[::-1]))
    x, y = LATTICE.coordinates
    one_side = 0.3 * (y > 0) * (1 + np.sin(x))
    here, there = (
        simulate(replace(case, erodible_bed=ErodibleBed(bed, GrowthRate(0.2))), [1.5])
        for bed in (one_side, one_side[::-1].copy())
    )
    # the flow is no mirror image of itself, and must not be computed on one half
    assert (here.depth != here.depth[:, ::-1]).any()
    assert (here.depth == there.depth[:, ::-1]).all()
    assert (here.velocity_y == -there.velocity_y[:, ::-1]).all()
    assert (here.erosion_depth == there.erosion_depth[::-1]).all()


@pytest.mark.parametrize("name", SCENES)
def test_a_window_on_the_lattice_gives_the_same(name, monkeypatch):
    monkeypatch.setattr("solver.lattice.run.LEAST_GROWTH", 2)
    case, end = ERODING[name]
    times = np.linspace(0, end, 4)
    some, whole = (simulate(case, times, arrival_depth=0.01, skip=skip) for skip in (True, False))
    assert_same(some, whole)
    np.testing.assert_allclose(some.entrained, whole.entrained, rtol=1e-14)
    assert some.ledger.eroded == whole.ledger.eroded


def test_rows_of_a_flow_that_does_not_vary_are_one():
    nothing = np.zeros(LATTICE.shape)
    x, _ = LATTICE.coordinates
    case = Scene(LATTICE, Plane(30), nothing + (x < 4), nothing, nothing, Coulomb(20))
    case = replace(
        case,
        boundaries=Boundaries("open", "open", "wall", "wall"),
        erodible_bed=ErodibleBed(nothing + 0.2 + 0.1 * np.cos(x), GrowthRate(0.1)),
    )
    assert LatticeRun(case, 1.0, 0.0).part.kind == "row"
    some, whole = (simulate(case, [1.0], skip=skip) for skip in (True, False))
    assert_same(some, whole)
    assert some.ledger.entrained == pytest.approx(whole.ledger.entrained, rel=1e-13)
    uneven = replace(case.erodible_bed, depth=case.erodible_bed.depth * (LATTICE.coordinates[1] > 0))
    assert LatticeRun(replace(case, erodible_bed=uneven), 1.0, 0.0).part.kind == "whole"


def test_a_heap_that_friction_holds_stays_at_rest_on_an_erodible_bed():
    case = eroding(scene(Plane(10), Coulomb(35), (((5, 0), 3.0, 0.5),)), GrowthRate(10.0))
    run = simulate(case, [5.0])
    assert run.rest_time == 0.0
    assert run.ledger.entrained == 0.0
    np.testing.assert_array_equal(run.deposit_depth, case.depth)


def test_what_is_taken_up_brings_no_momentum():
    # but for films, whose momentum nobody keeps, and cells that run dry within a step
    case = scene(Plane(0), Coulomb(0), (((4, 0), 2.5, 1.0),), speed=(3, 0))
    case = replace(case, scheme=WeightedResidual(wet_limit=1e-9, cfl=0.3))
    run = simulate(eroding(case, GrowthRate(0.5)), [0.4])
    first, last = (case.depth * case.velocity_x).sum(), (run.depth[-1] * run.velocity_x[-1]).sum()
    assert run.ledger.entrained > 0.1 * run.ledger.released
    assert run.ledger.outflow == 0.0
    assert last == pytest.approx(first, rel=1e-10)


@pytest.mark.parametrize(
    "place", ["lattice", *(pytest.param(p, marks=pytest.mark.slow) for p in ("cloud", "surface"))]
)
def test_the_friction_of_a_zone_erodes_as_that_of_a_scene(place):
    case, end = PLACES[place]
    case = eroding(case, LAW["shear work"])
    rough = replace(case.friction, bed_friction=case.friction.bed_friction + 5)
    zoned = replace(case, zones=(Zone(rough, np.ones(case.depth.shape)),))
    plain, of_zone, of_scene = (simulate(c, [end]) for c in (case, zoned, replace(case, friction=rough)))
    np.testing.assert_allclose(of_zone.erosion_depth, of_scene.erosion_depth, rtol=1e-9, atol=1e-12)
    assert np.abs(plain.erosion_depth - of_scene.erosion_depth).max() > 1e-3


def test_the_collocation_form_refuses_an_erodible_bed():
    case = eroding(other(CLOUD, Collocation()))
    with pytest.raises(ValueError, match="knows no erodible bed"):
        simulate(case, [1.0])


def test_a_bed_that_makes_no_sense_is_refused():
    case = scene()
    for depth in (-0.1, np.nan, np.inf):
        with pytest.raises(ParameterError, match="finite depths of at least 0"):
            ErodibleBed(np.full(LATTICE.shape, depth), GrowthRate(0.1))
    with pytest.raises(ParameterError, match="no bound at rest"):
        ErodibleBed(np.ones(LATTICE.shape), JumpCondition(0.1))
    with pytest.raises(ValueError, match="points' shape"):
        simulate(replace(case, erodible_bed=ErodibleBed(np.ones(3), GrowthRate(0.1))), [1.0])


ZONES = {
    "growth rate": (GrowthRate(0.05), {"growth": 0.02}),
    "shear stress": (LAW["shear stress"], {"rate": 0.01, "critical_stress": 2000.0}),
    "shear work": (ShearWork(200.0), {"erosion_energy": 500.0}),
    "Egashira": (Egashira(), {"bed_angle": 30.0}),
    "jump condition": (JumpCondition(0.1), {"strength_coefficient": 0.2, "slip": 0.8}),
}


@pytest.mark.parametrize("name", ZONES)
@pytest.mark.parametrize("place", ["lattice", "cloud", "surface"])
def test_a_zone_that_covers_all_is_the_law_itself_to_the_last_bit(place, name):
    case, end = PLACES[place]
    law, changed = ZONES[name]
    plain = eroding(case, replace(law, **changed))
    held, full = plain.erodible_bed, np.ones(case.points.shape)
    zoned = replace(plain, erodible_bed=replace(held, law=law, zones=(ErosionZone(held.law, full),)))
    one, two = simulate(plain, [end]), simulate(zoned, [end])
    assert one.ledger.entrained > 0
    for field in ("depth", "velocity_x", "velocity_y", "erosion_depth"):
        assert (np.asarray(getattr(one, field)) == np.asarray(getattr(two, field))).all()


@pytest.mark.parametrize("place", ["lattice", "cloud", "surface"])
def test_nothing_is_eroded_in_a_zone_without_growth_and_flow_and_bed_keep_their_volume(place):
    case, end = PLACES[place]
    plain = eroding(case)
    x = case.points.coordinates[0] + np.zeros(case.points.shape)
    firm = 1.0 * (x > np.median(x[plain.depth > 0]))
    held = plain.erodible_bed
    zoned = replace(plain, erodible_bed=replace(held, zones=(ErosionZone(GrowthRate(0.0), firm),)))
    run = simulate(zoned, [end])
    assert run.erosion_depth[firm == 1].max() == 0
    assert run.erosion_depth[firm == 0].max() > 0
    assert abs(run.ledger.error) < 1e-14
    assert abs(run.ledger.bed_error) < 1e-14


def test_a_cell_on_an_edge_of_a_zone_erodes_by_the_mean_over_its_area():
    share, depth = np.array([0.0, 0.25, 1.0]), np.ones(3)
    zones = (ErosionZone(GrowthRate(0.03), share),)
    bed = ErodibleBed(depth, GrowthRate(0.01), zones=zones)
    np.testing.assert_allclose(bed.coefficients[0], [0.01, 0.015, 0.03], rtol=1e-15)
    # the work is linear in one over the energy
    bed = ErodibleBed(depth, ShearWork(1000.0), zones=(ErosionZone(ShearWork(500.0), share),))
    np.testing.assert_allclose(bed.coefficients[0], [1e-3, 1.25e-3, 2e-3], rtol=1e-15)
    laws = ShearStress(density=2000.0), ShearStress(0.05, 2e-4, 500.0, density=2000.0)
    bed = ErodibleBed(depth, laws[0], zones=(ErosionZone(laws[1], share),))
    np.testing.assert_allclose(bed.coefficients[:, 1], [0.03125, 0.25, 0.4375], rtol=1e-15)
    assert ErodibleBed(depth, laws[0]).coefficients is None


def test_zones_of_erosion_that_cannot_be_are_refused():
    depth = np.ones(3)
    with pytest.raises(ValueError, match="zones must be of the same law of erosion"):
        ErodibleBed(depth, GrowthRate(0.1), zones=(ErosionZone(Egashira(), depth),))
    with pytest.raises(ValueError, match="shares of a zone must have the points' shape"):
        ErodibleBed(depth, GrowthRate(0.1), zones=(ErosionZone(GrowthRate(0.2), np.ones(2)),))
    with pytest.raises(ValueError, match="zones must not overlap"):
        ErodibleBed(depth, GrowthRate(0.1), zones=(ErosionZone(GrowthRate(0.2), depth),) * 2)


def test_a_zone_of_erosion_on_one_side_makes_the_mirror_image_of_one_on_the_other():
    points = Lattice((0.0, 30.0), (-8.0, 8.0), 1.0)
    x, y = points.coordinates
    depth = 2 * np.maximum(0.0, 1 - ((x - 8) ** 2 + y**2) / 16)
    plain = eroding(Scene(points, Plane(25), depth, 0 * depth, 0 * depth, Voellmy(10, 200.0)))
    runs = []
    for sign in (1, -1):
        zone = ErosionZone(GrowthRate(0.2), 1.0 * (sign * y > 0.6) + 0.0 * x)
        runs.append(simulate(replace(plain, erodible_bed=replace(plain.erodible_bed, zones=(zone,))), [2.0]))
    one, two = (run.erosion_depth for run in runs)
    assert (one != one[::-1]).any()
    assert (one == two[::-1]).all()
