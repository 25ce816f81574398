"""Zones of friction: what they change, and what they leave as it is to the last bit."""

from dataclasses import replace

import numpy as np
import pytest

from solver.forms import begin
from solver.kernels.friction import law_at
from solver.physics.earth_pressure import MohrCoulomb
from solver.physics.elevation import ElevationModel
from solver.physics.friction import (
    Bingham,
    Coulomb,
    Edwards,
    HerschelBulkley,
    Manning,
    Pouliquen,
    Voellmy,
    friction_coefficient,
)
from solver.physics.resistance import DryTurbulent, area_weighted
from solver.physics.terrain import Plane
from solver.points.cloud import random_points
from solver.points.lattice import Lattice
from solver.scene import Collocation, Scene, Zone
from solver.simulation import simulate

SMOOTH, ROUGH = Voellmy(8.0, 400.0), Voellmy(20.0, 150.0)
LATTICE = Lattice((0, 60), (-10, 10), 2.0)
TIMES = [2.0, 5.0]


def scene(points, terrain, law=SMOOTH):
    x, y = (a + np.zeros(points.shape) for a in points.coordinates)
    depth = 2 * np.maximum(0, 1 - ((x - 12) ** 2 + y**2) / 64)
    return Scene(points, terrain, depth, 0 * depth, 0 * depth, law)


def beyond(points, x):
    return np.where(points.coordinates[0] + np.zeros(points.shape) > x, 1.0, 0.0)


def ground():
    x, y = np.arange(-10.0, 71, 2.0), np.arange(-20.0, 21, 2.0)
    return ElevationModel(x, y, np.broadcast_to(-0.4 * x, (len(y), len(x))).copy())


PLACES = {
    "lattice": (LATTICE, Plane(20)),
    "cloud": (random_points((0.0, 60.0), (-10.0, 10.0), 300, 1), Plane(20)),
    "surface": (LATTICE, ground()),
}


def same(one, two):
    return all(
        (a == b).all()
        for a, b in zip(
            (one.depth, one.velocity_x, one.velocity_y, one.max_speed),
            (two.depth, two.velocity_x, two.velocity_y, two.max_speed),
            strict=True,
        )
    )


@pytest.mark.parametrize("kind", PLACES)
def test_a_zone_that_covers_all_is_the_law_itself_to_the_last_bit(kind):
    points, terrain = PLACES[kind]
    plain = scene(points, terrain, ROUGH)
    zoned = replace(plain, friction=SMOOTH, zones=(Zone(ROUGH, np.ones(points.shape)),))
    assert same(simulate(plain, TIMES), simulate(zoned, TIMES))


@pytest.mark.parametrize("kind", PLACES)
def test_a_rough_zone_ahead_slows_the_flow_there_and_not_before(kind):
    points, terrain = PLACES[kind]
    smooth = scene(points, terrain)
    zoned = replace(smooth, zones=(Zone(ROUGH, beyond(points, 30.0)),))
    free, held = simulate(smooth, TIMES), simulate(zoned, TIMES)
    x = points.coordinates[0] + np.zeros(points.shape)
    assert held.failure is None
    assert held.max_speed[x > 36].max() < 0.8 * free.max_speed[x > 36].max()
    assert held.max_speed[x < 20].max() == pytest.approx(free.max_speed[x < 20].max(), rel=1e-3)
    assert held.ledger.now == pytest.approx(held.ledger.released - held.ledger.outflow, rel=1e-12)


def test_what_is_a_zone_and_what_the_rest_makes_no_difference_nor_does_what_is_skipped():
    smooth = scene(LATTICE, Plane(20))
    east = beyond(LATTICE, 30.0)
    one = simulate(replace(smooth, zones=(Zone(ROUGH, east),)), TIMES)
    other = replace(smooth, friction=ROUGH, zones=(Zone(SMOOTH, 1 - east),))
    assert same(one, simulate(other, TIMES))
    assert same(one, simulate(other, TIMES, skip=False))


def test_a_zone_on_one_side_leaves_the_scene_unsymmetric_and_its_mirror_image_the_mirror_image():
    y = LATTICE.coordinates[1] + np.zeros(LATTICE.shape)
    sides = [
        replace(scene(LATTICE, Plane(20)), zones=(Zone(ROUGH, 1.0 * (sign * y > 2)),)) for sign in (1, -1)
    ]
    one, other = (simulate(each, TIMES) for each in sides)
    assert (one.depth[-1] != one.depth[-1][::-1]).any()
    assert (one.depth[-1] == other.depth[-1][::-1]).all()
    assert (one.velocity_y[-1] == -other.velocity_y[-1][::-1]).all()


def test_a_cell_on_an_edge_has_the_area_weighted_mean_of_what_resistance_is_linear_in():
    share = np.array([0.0, 0.25, 1.0])
    values = area_weighted(SMOOTH.resistance(9.81), [(ROUGH.resistance(9.81), share)]).values
    mu = [friction_coefficient(8.0), friction_coefficient(20.0)]
    np.testing.assert_allclose(values[0], [mu[0], 0.75 * mu[0] + 0.25 * mu[1], mu[1]], rtol=1e-15)
    np.testing.assert_allclose(values[1] / 9.81, [1 / 400, 0.75 / 400 + 0.25 / 150, 1 / 150], rtol=1e-15)
    for small, large, field in ((Manning(0.03), Manning(0.06), 5), (stress(500.0), stress(900.0), 0)):
        laws = [law.resistance(9.81) for law in (small, large)]
        values = area_weighted(laws[0], [(laws[1], share)]).values
        np.testing.assert_allclose(
            values[field][1], 0.75 * laws[0][field] + 0.25 * laws[1][field], rtol=1e-15
        )
        assert values[:, 0].tolist() == list(laws[0])
        assert values[:, 2].tolist() == list(laws[1])


def stress(value):
    return Bingham(value, 50.0, density=2000.0)


def test_zones_that_cannot_be_are_refused():
    smooth = scene(LATTICE, Plane(20))
    full = np.ones(LATTICE.shape)

    def made(**changes):
        return begin(replace(smooth, **changes), 1.0, 0.0, True)

    with pytest.raises(ValueError, match="zones must not overlap"):
        made(zones=(Zone(ROUGH, full), Zone(SMOOTH, 0.5 * full)))
    with pytest.raises(ValueError, match="zones must be of the same law of friction"):
        made(zones=(Zone(Manning(0.05), full),))
    with pytest.raises(ValueError, match="shares of a zone must have the points' shape"):
        made(zones=(Zone(ROUGH, np.ones(3)),))
    with pytest.raises(ValueError, match="takes one friction angle, and no zones"):
        made(friction=Coulomb(20), earth_pressure=MohrCoulomb(30, 20), zones=(Zone(Coulomb(25), full),))
    with pytest.raises(ValueError, match="the collocation form knows no zones"):
        made(scheme=Collocation(support=9, degree=1), zones=(Zone(ROUGH, full),))


def test_parameters_of_other_classes_are_not_mixed():
    with pytest.raises(ValueError, match="the same law"):
        area_weighted(DryTurbulent(0.1, 0.0), [(stress(1.0).resistance(9.81), np.ones(2))])


WIDE = {
    "lattice": Lattice((0, 60), (-30, 30), 2.0),
    "cloud": random_points((0.0, 60.0), (-30.0, 30.0), 1200, 1),
}
COVER = {
    "cohesion": (Voellmy(8, 400, 200, 2000), {"cohesion": 900.0}),
    "flow_index": (HerschelBulkley(500, 100, 1 / 3, 2000), {"flow_index": 0.5, "consistency": 60.0}),
    "beta": (Pouliquen((10, 25), 0.136, 0.3), {"beta": 0.5}),
    "length": (Pouliquen((10, 25), 0.136, 0.3), {"length": 0.8}),
    "kappa": (Edwards((10, 25, 12), 0.136, 0.3, 0.1), {"kappa": 2.0, "beta_star": 0.2, "gamma": 0.1}),
}


# a law on a cloud takes half a minute to compile: clouds share the mechanism, and one law shows that
@pytest.mark.parametrize(("kind", "name"), [*(("lattice", name) for name in COVER), ("cloud", "cohesion")])
def test_other_parameters_everywhere_are_those_of_the_law_to_the_last_bit(kind, name):
    points, terrain = PLACES[kind]
    law, changed = COVER[name]
    plain = scene(points, terrain, replace(law, **changed))
    zoned = replace(plain, friction=law, zones=(Zone(plain.friction, np.ones(points.shape)),))
    assert same(simulate(plain, TIMES), simulate(zoned, TIMES))
    assert not same(simulate(replace(plain, friction=law), TIMES), simulate(zoned, TIMES))


# what hysteresis makes of the step differs between its parameters
@pytest.mark.parametrize(
    ("kind", "name"),
    [*(("lattice", name) for name in COVER if name != "kappa"), ("cloud", "cohesion")],
)
def test_halves_are_the_runs_with_the_parameters_of_each_to_round_off(kind, name):
    points = WIDE[kind]
    law, changed = COVER[name]
    x, y = (a + np.zeros(points.shape) for a in points.coordinates)
    # heaps that do not meet; the deep one between has one law in all runs, and the fastest waves, so that
    # all runs take the same steps
    heaps = [(0, 7.0), (-20, 1.5), (20, 1.5)]
    depth = sum(top * np.maximum(0, 1 - ((x - 20) ** 2 + (y - c) ** 2) / 36) for c, top in heaps)
    start = replace(scene(points, Plane(20), law), depth=depth)
    laws = {"one": law, "other": replace(law, **changed)}

    def computed(south, north):
        zones = Zone(laws[south], 1.0 * (y < -11)), Zone(laws[north], 1.0 * (y > 11))
        return simulate(replace(start, zones=zones), [0.4, 0.8])

    halves = computed("one", "other")
    assert halves.failure is None
    both = {each: computed(each, each) for each in laws}
    for field in ("depth", "velocity_x", "velocity_y"):
        found, one, other = (getattr(each, field)[-1] for each in (halves, both["one"], both["other"]))
        np.testing.assert_allclose(found[y < 0], one[y < 0], rtol=0, atol=1e-12)
        np.testing.assert_allclose(found[y > 0], other[y > 0], rtol=0, atol=1e-12)
    north = (y > 11) & (halves.depth[-1] > 0.01)
    assert north.sum() > 5
    assert np.abs(halves.velocity_x[-1] - both["one"].velocity_x[-1])[north].max() > 1e-4


def test_a_cell_on_an_edge_has_the_exponent_of_most_of_it_with_the_parameters_that_go_with_it():
    thin, middle, thick = (HerschelBulkley(500, k, n, 2000) for k, n in ((200, 0.3), (300, 0.3), (60, 0.5)))
    parts = [(middle.resistance(9.81), np.array([0.3, 0.3, 0.1, 0.0])),
             (thick.resistance(9.81), np.array([0.4, 0.5, 0.6, 0.3]))]  # fmt: skip
    zoned = area_weighted(thin.resistance(9.81), parts)
    assert zoned.values[2].tolist() == [0.3, 0.5, 0.5, 0.3]
    # 0.3 of each of two, the half that the later part has, 0.6 of the last, and all that is not in zones
    expected = [0.125, 0.03, 0.03, 0.1]
    np.testing.assert_allclose(zoned.values[1], expected, rtol=1e-15)
    # without different exponents there are means of all
    for fluid in (
        lambda k: Bingham(500.0, k, density=2000.0),
        lambda k: HerschelBulkley(500.0, k, 1.0, 2000),
    ):
        laws = [fluid(k).resistance(9.81) for k in (50, 100)]
        zoned = area_weighted(laws[0], [(laws[1], np.array([0.3, 0.1 + 0.2]))])
        np.testing.assert_allclose(zoned.values[1], 0.0325, rtol=1e-15)
    assert zoned.values[2].tolist() == [1.0, 1.0]
    assert [law_at(zoned, i).exponent for i in (0, 1)] == [1.0, 1.0]


def test_grains_have_means_of_length_and_of_the_flow_rule_but_not_of_the_exponent():
    share = np.array([0.25, 0.75])
    laws = [
        Edwards((10, 25, 12), beta, length, star, gamma, 1.0).resistance(9.81)
        for beta, length, star, gamma in ((0.1, 0.2, 0.1, 0.0), (0.5, 0.6, 0.3, 0.4))
    ]
    values = area_weighted(laws[0], [(laws[1], share)]).values
    np.testing.assert_allclose(values[3:7, 0], [0.3, 0.2, 0.1, 0.15], rtol=1e-14)
    values = area_weighted(laws[0], [(laws[1]._replace(kappa=2.0), share)]).values
    assert values[:, 0].tolist() == list(laws[0])
    assert values[:, 1].tolist() == [*laws[1][:-1], 2.0]
