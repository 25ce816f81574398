import numpy as np
import pytest
from known_maps import places
from scipy.optimize import approx_fprime

from solver.emulator.correlation import matern
from solver.emulator.kriging import Kriging, _misfit, fit
from solver.emulator.levels import Levels, Predictor


def outputs(at):
    x, y = at.T
    return np.stack([np.sin(3 * x) + y**2, np.exp(-x) * (1 + y), 3 + 2 * x - y], axis=1)


def test_the_correlation_is_one_at_a_place_and_the_known_function_of_distance():
    at = np.array([[0.0], [0.3]])
    r = np.sqrt(5) * 0.3 / 0.7
    known = (1 + r + r**2 / 3) * np.exp(-r)
    assert matern(at, at, np.array([0.7])) == pytest.approx(np.array([[1, known], [known, 1]]), rel=1e-14)


@pytest.mark.parametrize("trend", ["constant", "linear"])
def test_leave_one_out_in_closed_form_is_that_of_predictors_without_the_run(trend):
    at = places(16)
    held = outputs(at) + np.random.default_rng(1).normal(0, 0.05, (16, 3))
    whole = Kriging(at, np.array([0.8, 1.3]), 0.01, trend)
    mean, deviation = whole.leave_one_out(held)
    for i in range(16):
        rest = np.arange(16) != i
        without = Kriging(at[rest], whole.lengths, whole.nugget, trend)
        weights, variance = without.predictor(at[i : i + 1])
        assert mean[i] == pytest.approx((weights @ held[rest])[0], rel=1e-8, abs=1e-8)
        assert deviation[i] ** 2 == pytest.approx(variance * without.scale(held[rest]), rel=1e-8)


def test_without_a_nugget_runs_are_met_and_a_linear_function_everywhere():
    at, elsewhere = places(16), places(32, seed=3)
    kriging = Kriging(at, np.array([0.8, 1.3]), 1e-12)
    weights, variance = kriging.predictor(at)
    assert weights @ outputs(at) == pytest.approx(outputs(at), abs=1e-6)
    assert variance == pytest.approx(0, abs=1e-6)
    weights, _ = kriging.predictor(elsewhere)
    assert (weights @ outputs(at))[:, 2] == pytest.approx(outputs(elsewhere)[:, 2], abs=1e-6)


def test_variance_and_covariance_of_predictions_agree():
    kriging, elsewhere = Kriging(places(16), np.array([0.5, 0.9]), 0.02), places(8, seed=5)
    assert np.diag(kriging.covariance(elsewhere)) == pytest.approx(kriging.predictor(elsewhere)[1], rel=1e-9)


def test_paths_have_the_covariance_of_predictions():
    kriging, elsewhere = Kriging(places(16), np.array([0.5, 0.9]), 0.02), places(4, seed=5)
    normal = np.random.default_rng(2).standard_normal((4, 20_000))
    assert np.cov(kriging.paths(elsewhere, normal)) == pytest.approx(kriging.covariance(elsewhere), abs=0.01)


@pytest.mark.parametrize("trend", ["constant", "linear"])
def test_the_slope_of_the_likelihood_is_that_of_its_differences(trend):
    at = places(16)
    held = outputs(at)
    logs = np.log([0.6, 1.4, 0.01])
    value, slope = _misfit(logs, at, held, trend)
    differences = approx_fprime(logs, lambda x: _misfit(x, at, held, trend)[0], 1e-6)
    assert np.isfinite(value)
    assert slope == pytest.approx(differences, rel=1e-4, abs=1e-4)


def test_a_smooth_function_is_predicted_from_few_runs():
    at, elsewhere = places(64), places(256, seed=7)
    found = fit(at, outputs(at))
    weights, variance = found.predictor(elsewhere)
    error = weights @ outputs(at) - outputs(elsewhere)
    assert np.sqrt(np.mean(error**2, axis=0)) == pytest.approx(0, abs=0.01)
    assert found.nugget < 0.001
    # an input that does nothing is one that outputs are correlated along for long
    flat = fit(at, np.sin(4 * at[:, :1]))
    assert flat.lengths[1] > 3 * flat.lengths[0]
    assert (variance > 0).all()


def test_noise_is_left_to_the_nugget():
    at = places(128)
    held = at[:, :1] + np.random.default_rng(0).normal(0, 0.3, (128, 1))
    found = fit(at, held)
    mean, deviation = found.leave_one_out(held)
    assert float(np.mean(deviation)) == pytest.approx(0.3, rel=0.2)
    assert np.std(mean - held) == pytest.approx(0.3, rel=0.2)


def test_too_few_runs_are_refused():
    with pytest.raises(ValueError, match="4 runs are too few for 2 inputs"):
        fit(places(4), np.ones((4, 1)))


def test_coordinates_of_millions_of_metres_keep_the_digits_of_what_differs():
    at, elsewhere = places(64), places(8, seed=5)
    kriging = Kriging(at, np.array([0.8, 1.3]), 1e-6)
    near, far = outputs(at), outputs(at) + 2.6e6
    assert kriging.scale(far) == pytest.approx(kriging.scale(near), rel=1e-5, abs=1e-9)
    for one, other in zip(
        kriging.leave_one_out(near), kriging.leave_one_out(far) - np.array([[[2.6e6]], [[0]]]), strict=True
    ):
        assert other == pytest.approx(one, abs=1e-6)
    predictor = Predictor([kriging], elsewhere)
    mean, deviation = predictor(Levels((kriging,), (far,)))
    assert mean - 2.6e6 == pytest.approx(predictor(Levels((kriging,), (near,)))[0], abs=1e-6)
    assert (deviation < 0.05).all()


def test_a_run_that_alone_has_a_value_is_predicted_by_the_others_alone():
    at = np.concatenate([places(32), np.zeros((32, 1))], axis=1)
    at[5, 2] = 1.0
    held = outputs(at[:, :2])
    mean, deviation = fit(at, held).leave_one_out(held)
    others = np.delete(held, 5, axis=0)
    assert mean[5] == pytest.approx(others.mean(axis=0))
    assert deviation[5] == pytest.approx(others.std(axis=0, ddof=1))
    assert np.delete(mean - held, 5, axis=0) == pytest.approx(0, abs=0.1)


def test_inputs_that_do_not_vary_by_themselves_are_refused():
    at = places(32)
    for column in (np.full(32, 0.3), 1 - at[:, 0], np.zeros(32)):
        with pytest.raises(ValueError, match="32 runs do not vary in all of 3 inputs, each by itself"):
            fit(np.column_stack([at, column]), np.ones((32, 1)))
