import numpy as np
import pytest
from scipy import stats

from pipeline.scenario.design import design, draw, saltelli
from pipeline.settings.sample import Sample
from pipeline.settings.settings import Settings


def sample(values, **more):
    return Sample.model_validate({"values": values, "count": 512, **more})


@pytest.mark.parametrize("kind", ["latin-hypercube", "sobol", "random"])
@pytest.mark.parametrize(
    ("given", "known"),
    [
        ({"distribution": "uniform", "lower": 2.0, "upper": 5.0}, stats.uniform(2, 3)),
        ({"distribution": "normal", "mean": 3.0, "deviation": 0.5}, stats.norm(3, 0.5)),
        (
            {"distribution": "normal", "mean": 3.0, "deviation": 1.0, "lower": 2.0, "upper": 3.5},
            stats.truncnorm(-1, 0.5, 3, 1),
        ),
        ({"distribution": "lognormal", "median": 9.0, "deviation": 0.4}, stats.lognorm(0.4, scale=9)),
        (
            {"distribution": "triangular", "lower": 1.0, "mode": 2.0, "upper": 5.0},
            stats.triang(0.25, 1, 4),
        ),
    ],
)
def test_draws_follow_their_distribution(given, known, kind):
    (drawn,) = draw(sample({"gravity": given}, design=kind, seed=4)).values()
    # layers hold a draw each, so that the empirical distribution is off by one in n at most
    most = stats.kstest(drawn, known.cdf).statistic
    assert most < (0.06 if kind == "random" else 1.01 / 512 if kind == "latin-hypercube" else 0.01)


def test_one_of_a_list_comes_as_often_as_its_weight_says():
    given = {"distribution": "discrete", "values": ("open", "wall"), "weights": (3.0, 1.0)}
    (drawn,) = draw(sample({"boundaries.x_min": given})).values()
    assert drawn.count("open") == 384
    assert drawn.count("wall") == 128


def test_correlated_keys_keep_their_distributions():
    values = {
        "gravity": {"distribution": "lognormal", "median": 9.0, "deviation": 0.4},
        "material.bed_friction": {"distribution": "uniform", "lower": 10.0, "upper": 20.0},
    }
    pair = {"between": tuple(values), "value": -0.7}
    drawn = draw(sample(values, design="sobol", correlations=(pair,), count=2048))
    first = np.log(np.array(drawn["gravity"]) / 9) / 0.4
    second = stats.norm.ppf((np.array(drawn["material.bed_friction"]) - 10) / 10)
    assert np.corrcoef(first, second)[0, 1] == pytest.approx(-0.7, abs=0.01)
    assert stats.kstest(second, stats.norm.cdf).statistic < 0.01


def test_the_same_seed_gives_the_same_draws():
    values = {"gravity": {"distribution": "uniform", "lower": 1.0, "upper": 2.0}}
    assert draw(sample(values, seed=1)) == draw(sample(values, seed=1))
    assert draw(sample(values, seed=1)) != draw(sample(values, seed=2))


@pytest.mark.parametrize("correlated", [False, True])
def test_the_first_draws_of_the_default_design_are_those_of_a_smaller_one(correlated):
    values = {
        f"release.{i}.volume": {"distribution": "lognormal", "median": 9, "deviation": 1} for i in (0, 1)
    }
    more = {"correlations": ({"between": tuple(values), "value": 0.5},)} if correlated else {}
    larger = draw(sample(values, count=64, **more))
    for count in (1, 12, 32):
        smaller = draw(sample(values, count=count, **more))
        assert all(smaller[key] == larger[key][:count] for key in values)


def test_saltelli_s_rows_take_one_coordinate_after_the_other_from_the_second_half():
    rows = saltelli(np.array([[1.0, 2.0, 11.0, 12.0], [3.0, 4.0, 13.0, 14.0]]))
    assert rows.tolist() == [[1, 2], [11, 2], [1, 12], [11, 12], [3, 4], [13, 4], [3, 14], [13, 14]]


def test_each_entry_of_a_sweep_has_all_draws():
    settings = Settings.model_validate(
        {
            "name": "a",
            "terrain": {"profile": "plane", "angle": 30},
            "domain": {"x": (0, 10), "y": (-2, 2)},
            "points": {"spacing": 1},
            "release": {"shape": "box", "x": (1, 2), "y": (-1, 1), "height": 1},
            "material": {"bed_friction": 20, "internal_friction": 30},
            "time": {"end": 1},
            "sweep": {"gravity": (1, 2)},
            "sample": {
                "count": 3,
                "values": {
                    "material.bed_friction": {"distribution": "uniform", "lower": 10.0, "upper": 20.0}
                },
            },
        }
    )
    made = design(settings)
    rows = [made[i] for i in range(len(made))]
    assert made.keys == ("gravity", "material.bed_friction")
    assert [row[0] for row in rows] == [1, 1, 1, 2, 2, 2]
    assert [row[1] for row in rows[:3]] == [row[1] for row in rows[3:]]
    assert len({row[1] for row in rows}) == 3


@pytest.mark.parametrize(
    ("given", "known"),
    [
        # 8 and 40 deviations above the mean, 40 below it, and a lognormal one 6 above
        ({"mean": 20.0, "deviation": 0.62, "lower": 25.0, "upper": 40.0}, [25.001, 25.052, 25.338]),
        ({"mean": 20.0, "deviation": 0.62, "lower": 45.0}, [45.0002, 45.0106, 45.0707]),
        ({"mean": 20.0, "deviation": 0.62, "upper": -5.0}, [-5.0707, -5.0106, -5.0002]),
        ({"median": 9.0, "deviation": 0.4, "lower": 100.0}, [100.065, 104.549, 132.630]),
    ],
)
def test_quantiles_far_out_in_a_tail_are_those_of_the_survival_function(given, known):
    kind = "lognormal" if "median" in given else "normal"
    (drawn,) = draw(
        sample({"gravity": {"distribution": kind, **given}}, count=2**14, design="sobol")
    ).values()
    assert len(set(drawn)) == len(drawn)
    assert np.quantile(drawn, [0.01, 0.5, 0.99]) == pytest.approx(known, abs=0.003 * np.ptp(known))


@pytest.mark.parametrize("count", [1, 2, 3, 4, 20, 512])
def test_correlated_latin_hypercubes_keep_their_layers(count):
    values = {
        f"release.{i}.volume": {"distribution": "uniform", "lower": 0.0, "upper": 1.0} for i in range(3)
    }
    wanted = {(0, 1): -0.7, (0, 2): 0.5, (1, 2): -0.2}
    pairs = tuple(
        {"between": (f"release.{i}.volume", f"release.{j}.volume"), "value": value}
        for (i, j), value in wanted.items()
    )
    drawn = np.array(
        list(draw(sample(values, design="latin-hypercube", correlations=pairs, count=count)).values())
    )
    layers = np.sort((drawn * count).astype(int), axis=1)
    assert (layers == np.arange(count)).all()
    if count == 512:
        found = np.corrcoef(stats.norm.ppf(drawn))
        assert [found[pair] for pair in wanted] == pytest.approx(list(wanted.values()), abs=0.01)
