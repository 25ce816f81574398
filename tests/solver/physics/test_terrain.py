import numpy as np
import pytest
from scipy.integrate import quad

from solver.physics.terrain import Bend, Plane, Segment, Segments
from solver.physics.terrain_table import Table

ROUGH = np.random.default_rng(0).normal(0, 0.3, 41)
DISTANCES = np.linspace(0, 200, 41)


def segments(starts, angles, joint, **more):
    return Segments(tuple(map(Segment, starts, angles)), joint, **more)


PROFILES = {
    "plane": Plane(35),
    "linear bend": Bend(35, 17.5, 21.5),
    "quadratic bend": Bend(35, 17.5, 21.5, -5, "quadratic"),
    "segments": segments((0, 10, 20, 22), (35, 20, 30, 0), 2.0),
    "table": Table(DISTANCES, 100 * np.exp(-DISTANCES / 80) + ROUGH, 15.0),
}
SMOOTH = [name for name in PROFILES if name != "quadratic bend"]


@pytest.fixture(params=PROFILES)
def profile(request):
    return PROFILES[request.param]


def test_elevation_falls_with_the_sine_of_inclination_and_distance_grows_with_its_cosine(profile):
    breaks = getattr(profile, "_breaks", ())
    for x in (-5.0, 9.7, 19.0, 40.0):
        for grown, rate in (
            (profile.horizontal_distance(x) - profile.horizontal_distance(0), np.cos),
            (profile.elevation(0) - profile.elevation(x), np.sin),
        ):
            exact, _ = quad(
                lambda s, rate=rate: rate(profile.inclination(s)),
                0,
                x,
                points=breaks or None,
                limit=200,
                epsabs=1e-11,
            )
            assert grown == pytest.approx(exact, abs=2e-8)


@pytest.mark.parametrize("name", PROFILES)
def test_curvature_is_the_falling_rate_of_inclination(name):
    x = np.arange(0.013, 40, 0.1)
    step = 1e-6
    rate = (PROFILES[name].inclination(x - step) - PROFILES[name].inclination(x + step)) / (2 * step)
    np.testing.assert_allclose(PROFILES[name].curvature(x), rate, atol=1e-6)


@pytest.mark.parametrize("name", PROFILES)
def test_inclination_is_continuous(name):
    x = np.linspace(0, 40, 40001)
    assert np.abs(np.diff(PROFILES[name].inclination(x))).max() < 1e-3


def test_a_table_has_continuous_curvature():
    x = np.linspace(0, 200, 200001)
    kappa = PROFILES["table"].curvature(x)
    assert np.abs(np.diff(kappa)).max() < 1e-3 * np.ptp(kappa)


def test_values_have_the_common_shape_of_x_and_y(profile):
    x, y = np.linspace(0, 30, 7), np.linspace(-1, 1, 3)[:, None]
    for values in (profile.inclination(x, y), profile.curvature(x, y), profile.lateral_slope(x, y)):
        assert values.shape == (3, 7)
        assert (values == values[0]).all()
    assert not profile.lateral_slope(x, y).any()


def test_the_linear_bend_is_that_of_wang_hutter_and_pudasaini():
    x = np.array([0, 17.5, 18.5, 21.5, 30])
    np.testing.assert_allclose(
        np.degrees(Bend(35, 17.5, 21.5).inclination(x)), [35, 35, 26.25, 0, 0], atol=1e-13
    )


def test_the_quadratic_bend_is_equation_26_as_printed():
    x = np.linspace(17.5, 21.5, 9)
    bend = Bend(35, 17.5, 21.5, transition="quadratic")
    np.testing.assert_allclose(np.degrees(bend.inclination(x)), 35 * (1 - ((x - 17.5) / 4) ** 2), atol=1e-13)


def test_curvature_jumps_by_its_mean_at_the_ends_of_a_bend():
    inside = np.radians(35) / 4
    np.testing.assert_allclose(
        Bend(35, 17.5, 21.5).curvature([17, 17.5, 19, 21.5, 22]), inside * np.array([0, 0.5, 1, 0.5, 0])
    )


@pytest.mark.parametrize(
    "profile",
    [
        Bend(35, 1, 2, with_curvature=False),
        segments((0, 5), (30, 0), 2, with_curvature=False),
        Table(DISTANCES, ROUGH, 15.0, with_curvature=False),
    ],
)
def test_curvature_can_be_left_out(profile):
    x = np.linspace(0, 10, 101)
    assert not profile.curvature(x).any()
    assert np.ptp(profile.inclination(x)) > 0.01


def test_a_table_of_a_straight_slope_is_a_plane():
    d = np.array([10.0, 12, 30, 31, 60])
    table = Table(d, 500 - np.tan(np.radians(30)) * (d - 10), 8.0)
    x = np.linspace(-20, 120, 29)
    np.testing.assert_allclose(table.inclination(x), np.radians(30), rtol=1e-12)
    np.testing.assert_allclose(table.horizontal_distance(x), 10 + x * np.cos(np.radians(30)), atol=1e-10)
    np.testing.assert_allclose(table.elevation(x), 500 - x / 2, atol=1e-10)
    assert table.length == pytest.approx(50 / np.cos(np.radians(30)), rel=1e-12)


def test_a_table_keeps_its_points_where_it_is_straight_and_rounds_its_corner_within_the_smoothing():
    table = Table(np.array([0.0, 50, 100]), np.array([50.0, 0, 0]), 10.0)
    x = np.linspace(0, table.length, 401)
    d, z = table.horizontal_distance(x), table.elevation(x)
    off = z - np.maximum(50 - d, 0)
    np.testing.assert_allclose(off[np.abs(d - 50) >= 5], 0, atol=1e-12)
    assert np.interp(50, d, z) == pytest.approx(10 / 12, rel=3e-3)


def test_a_table_follows_slopes_that_are_nearly_walls():
    table = Table(np.array([0.0, 10, 12, 40]), np.array([100.0, 95, 60, 55]), 3.0)
    x, step = np.linspace(-5, table.length + 5, 501), 1e-5
    for values, rate in ((table.elevation, lambda xi: -np.sin(xi)), (table.horizontal_distance, np.cos)):
        grown = (values(x + step) - values(x - step)) / (2 * step)
        np.testing.assert_allclose(grown, rate(table.inclination(x)), atol=1e-8)


@pytest.mark.parametrize(
    "make",
    [
        lambda: Plane(90),
        lambda: Plane(np.nan),
        lambda: Bend(35, 2, 2),
        lambda: Bend(35, 1, np.inf),
        lambda: Bend(35, 1, 2, transition="cubic"),
        lambda: Segments((), 1),
        lambda: segments((0, 1, 1.5), (3, 2, 1), 1),
        lambda: segments((0, 0), (3, 2), 1),
        lambda: segments((0, 1), (3, 90), 1),
        lambda: segments((0, 1), (3, 2), 0),
        lambda: Table(np.array([0.0, 0]), np.array([0.0, 1]), 1),
        lambda: Table(np.array([0.0]), np.array([0.0]), 1),
        lambda: Table(np.array([0.0, 1]), np.array([0.0, np.nan]), 1),
        lambda: Table(np.array([0.0, 1]), np.array([0.0, 1]), 0),
    ],
)
def test_impossible_profiles_are_refused(make):
    with pytest.raises(ValueError, match="expected "):
        make()


def test_beds_of_the_same_segments_are_the_same():
    pieces = [Segment(0.0, 30.0), Segment(5.0, 0.0)]
    lists, tuples = Segments(pieces, 1.0), Segments(tuple(pieces), 1.0)
    assert lists == tuples
    assert hash(lists) == hash(tuples)
