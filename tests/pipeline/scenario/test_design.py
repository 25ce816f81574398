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
