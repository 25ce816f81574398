from functools import partial

import numpy as np
import pytest
from batches import run
from known_maps import depths, places
from sampled_stores import CLOSE, SPACING, THINNER, sheet
from stub_solvers import by_friction

from pipeline.assess.observed import Observed
from pipeline.emulation.calibrated import posterior_table
from pipeline.emulation.emulate import emulate, of_place
from pipeline.emulation.errors import NotEmulatedError
from pipeline.emulation.inputs import Inputs
from pipeline.emulation.sampled import Sampled
from pipeline.scenario.scenario import stored
from pipeline.store.variables import Status

pytestmark = pytest.mark.usefixtures("few_pictures")

LARGEST = 6


def of(stores):
    settings = stored(stores[0].attrs)
    return Sampled(settings, tuple(stores))


def made(stores):
    runs = of(stores)
    return emulate(runs, runs.settings.hazard, 1024)


def truth(threshold, x, thinner=0.0):
    many = depths(places(8192, seed=3), np.array([x]), np.array([0.0]), thinner)
    return float((many > threshold).mean())


@pytest.fixture(scope="module")
def whole():
    return made(sheet())


@pytest.fixture(scope="module")
def two():
    return made(sheet(levels="both"))


@pytest.fixture(scope="module")
def lacking():
    (store,) = sheet()
    volume = store["volume"].to_numpy() + 0.001 * store["turbulent_friction"].to_numpy()
    status = np.full(64, Status.DONE)
    status[np.argsort(volume)[-LARGEST:]] = Status.FAILED
    return made(sheet(status=status))


def test_leave_one_out_comes_first_and_speaks_of_all_that_is_asked(whole):
    first = next(iter(whole.tables))
    assert first == "leave-one-out"
    table = whole.tables[first].set_index("what")
    assert {"depth above 0.5 m, map", "depth above 0.1 m, far", "runout_distance"} <= {*table.index}
    assert table.loc["depth above 0.5 m, map", "verdict"] == "supported"
    assert table.loc["runout_distance", "q2"] > 0.99


def test_what_stays_plain_is_named_with_its_reason(whole):
    table = whole.tables["leave-one-out"].set_index("what")
    plain = table[table["verdict"] == "not emulated"]
    assert [*plain.index] == ["arrival times", "classes of intensity"]
    assert "nothing arrives" in plain.loc["arrival times", "reason"]
    assert not [line for line in whole.refused if "arrival" in line]
    (store,) = sheet()
    store["return_period"] = ("run", np.full(64, 30.0))
    store["erosion_depth"] = 0.1 * store["max_depth"]
    store["section_peak_discharge"] = (("run", "section"), np.ones((64, 1)))
    told = made([store]).tables["leave-one-out"]["what"]
    assert [*told.iloc[-3:]] == [
        "depth of erosion",
        "peaks, volumes and arrival at sections",
        "events of each return period, levels of hazard",
    ]


def test_chosen_runs_sharpen_what_is_emulated_and_change_no_share(whole):
    (sample,) = sheet()
    more = sheet(96)[0].isel(run=np.arange(64, 96)).assign_attrs(chosen_for="far: depth > 0.1")
    runs = Sampled(stored(sample.attrs), (sample,), (more,))
    assert runs.weight(runs.usable[0])[64:].tolist() == [0.0] * 32
    found = emulate(runs, runs.settings.hazard, 1024)
    before, after = (
        each.tables["emulated-receptors"].set_index(["receptor", "threshold"]).loc[("far", 0.1)]
        for each in (whole, found)
    )
    for name in ("probability", "probability_lower", "probability_upper"):
        assert after[name] == before[name]
    assert after["emulated"] != before["emulated"]
    assert "32 of 32 chosen runs done at 4 m, which count in no share" in found.comment
    assert found.maps["depth_exceedance"].equals(whole.maps["depth_exceedance"])


def test_receptors_have_probabilities_with_errors_beside_those_of_the_runs(whole):
    rows = whole.tables["emulated-receptors"].set_index(["receptor", "threshold"])
    for place, x in (("near", 48.0), ("far", 84.0)):
        row = rows.loc[(place, 0.1)]
        assert abs(row["emulated"] - truth(0.1, x)) <= row["emulated_error"]
        assert row["probability_lower"] == row["probability"] == row["probability_upper"]
    assert rows.loc[("far", 0.1), "verdict"] == "supported"
    # one spacing says nothing of its error
    assert rows["emulated_discretisation"].isna().all()


def test_pressures_are_of_the_density_of_each_run():
    (store,) = sheet(more="\n    material.density: {distribution: uniform, lower: 1000, upper: 2400}")
    runs = of([store])
    found = emulate(runs, runs.settings.hazard.model_copy(update={"depth": (), "pressure": (20.0,)}), 1024)
    rows = found.tables["emulated-receptors"].set_index(["receptor", "quantity"])
    row = rows.loc[("near", "pressure")]
    at, density = places(4096), 1000 + 1400 * np.random.default_rng(0).random(4096)
    speed = 5 * depths(at, np.array([48.0]), np.array([0.0]))[:, 0, 0]
    known = np.mean(density * speed**2 / 1000 > 20)
    assert 0.1 < known < 0.9
    assert row["emulated"] == pytest.approx(known, abs=0.01)
    at_cell = found.maps.sel(x=48.0, y=0.0, pressure_threshold=20.0)
    assert float(at_cell["pressure_exceedance"]) == pytest.approx(row["probability"], abs=1e-6)
    # the speed at a mean density has another share
    assert abs(np.mean(1700 * speed**2 / 1000 > 20) - known) > 0.01


def test_quantiles_stand_beside_those_of_the_runs(whole):
    rows = whole.tables["emulated-scenarios"].set_index(["quantity", "share"])
    row = rows.loc[("runout_distance", 0.95)]
    assert row["emulated"] == pytest.approx(50 + 40 * 0.95, abs=0.5)
    assert row["quantile_lower"] == row["quantile_upper"]
    assert abs(row["emulated"] - row["quantile"]) < 3


def test_maps_hold_the_share_of_the_runs_and_its_bounds_too(whole):
    held = whole.maps.sel(depth_threshold=0.5)
    at = {"x": 48.0, "y": 0.0}
    error = float(held["depth_emulated_error"].sel(at))
    assert abs(float(held["depth_emulated"].sel(at)) - truth(0.5, 48.0)) <= error
    for name in ("depth_exceedance", "depth_exceedance_lower", "depth_exceedance_upper"):
        assert 0 <= float(held[name].sel(at)) <= 1
    assert held.sizes == {"x": 26, "y": 21}
    assert np.isnan(held["depth_emulated_discretisation"]).all()
    assert not np.isnan(held["depth_emulated_error"]).any()


def test_missing_runs_are_filled_in_beside_their_bounds(lacking):
    rows = lacking.tables["emulated-missing"]
    assert len(rows) == LARGEST
    assert (rows["status"] == "failed").all()
    assert rows["extrapolated"].any()
    known = 50 + 40 * (rows["turbulent_friction"] - 200) / 1000
    assert rows["runout_distance"].to_numpy() == pytest.approx(known.to_numpy(), abs=0.5)
    row = lacking.tables["emulated-receptors"].set_index(["receptor", "threshold"]).loc[("far", 0.1)]
    assert abs(row["emulated"] - truth(0.1, 84.0)) < abs(row["probability"] - truth(0.1, 84.0))
    assert row["probability_upper"] - row["probability_lower"] == pytest.approx(LARGEST / 64)
    assert (
        f"{LARGEST} missing runs filled in, {rows['extrapolated'].sum()} of them extrapolated"
        in lacking.comment
    )
    assert lacking.maps.attrs["comment"] in lacking.comment


def test_what_runs_that_were_cut_off_do_not_exceed_is_unknown(whole):
    found = made(sheet(status=np.full(64, Status.CUT_OFF)))
    said = "64 of 64 computed runs were overrun or cut off"
    assert found.comment.endswith(f"probabilities are lower bounds, as {said}")
    checks = found.tables["leave-one-out"].set_index("what")
    assert (checks["runs_cut_off"] == 64).all()
    before, after = (
        each.tables["emulated-receptors"].set_index(["receptor", "threshold"]).loc[("far", 0.1)]
        for each in (whole, found)
    )
    assert after["emulated"] == before["emulated"] == before["emulated_upper"]
    assert after["emulated_upper"] == pytest.approx(1)
    assert after["emulated_error"] == pytest.approx(before["emulated_error"] + 1 - after["emulated"])
    assert (before["verdict"], after["verdict"]) == ("supported", "doubtful")
    assert f"a lower bound: {said}, which may add up to " in after["reason"]
    assert checks.loc["depth above 0.5 m, map", "verdict"] == "doubtful"
    # but where all runs exceed it, and none is open
    upper, share = found.maps["depth_emulated_upper"], found.maps["depth_exceedance"]
    np.testing.assert_allclose(upper.where(share < 1, 1.0), 1, rtol=1e-6)
    assert checks.loc["depth above 0.5 m, map", "reason"].endswith("more than the error of 0.0025")
    assert whole.maps["depth_emulated_upper"].equals(whole.maps["depth_emulated"])


def test_a_run_that_was_cut_off_beyond_a_receptor_leaves_nothing_open_there(whole):
    (store,) = sheet()
    farthest = int(np.argmax((store["max_depth"] > 0.1).sum(["y", "x"]).to_numpy()))
    status = np.full(64, Status.DONE)
    status[farthest] = Status.OVERRUN
    before, after = (
        each.tables["emulated-receptors"].set_index(["receptor", "threshold"]).loc[("near", 0.1)]
        for each in (whole, made(sheet(status=status)))
    )
    names = ["emulated", "emulated_upper", "emulated_error", "verdict", "reason"]
    assert after[names].equals(before[names])


def test_two_spacings_give_the_finer_map_and_a_total_error(two):
    held = two.maps.sel(depth_threshold=0.5)
    assert held.sizes == {"x": 51, "y": 41}
    assert f"64 of 64 runs done at {SPACING:g} m; 16 of 16 runs done at {CLOSE:g} m" in two.comment
    at = {"x": 54.0, "y": 0.0}
    known, coarse = truth(0.5, 54.0, THINNER), float(held["depth_exceedance"].sel(at))
    found, error = (float(held[name].sel(at)) for name in ("depth_emulated", "depth_emulated_error"))
    assert abs(found - known) < 0.3 * abs(coarse - known)
    assert abs(found - known) <= error
    assert error > float(held["depth_emulated_discretisation"].sel(at)) >= abs(coarse - known) / 2
    row = two.tables["emulated-scenarios"].set_index(["quantity", "share"]).loc[("runout_distance", 0.5)]
    assert row["emulated"] == pytest.approx(70 + THINNER, abs=0.1)
    assert row["emulated_error"] >= row["emulated_discretisation"] >= THINNER - 0.01


def test_what_the_runs_do_not_support_is_refused_with_its_figure():
    found = made(sheet(noise=0))
    table = found.tables["leave-one-out"].set_index("what")
    assert table.loc["depth above 0.5 m, map", "verdict"] == "refused"
    assert "above 0.25" in table.loc["depth above 0.5 m, map", "reason"]
    assert any(line.startswith("depth above 0.5 m, map: refused: Brier ratio") for line in found.refused)
    assert found.maps is None
    rows = found.tables["emulated-receptors"]
    assert rows["emulated"].isna().all()
    assert rows["probability"].notna().all()


def test_a_finer_run_is_paired_with_the_coarse_one_of_the_same_draw():
    coarse, fine = sheet(levels="both")
    coarse["status"][3] = Status.FAILED
    fine["status"][5] = Status.PENDING
    runs = of([coarse, fine])
    assert runs.usable[1].tolist() == [i for i in range(16) if i not in (3, 5)]
    (pairs,) = runs.pairs(runs.usable)
    for name in ("volume", "turbulent_friction"):
        held = coarse[name].to_numpy()[runs.usable[0]][pairs]
        assert held.tolist() == fine[name].to_numpy()[runs.usable[1]].tolist()


def test_words_are_inputs_of_one_column_each_but_the_first():
    (store,) = sheet(4)
    store["turbulent_friction"] = store["turbulent_friction"].copy(
        data=np.array(["a", "b", "c", "b"], object)
    )
    found = Inputs(stored(store.attrs), store).of(store)
    assert found[:, :2].tolist() == [[0, 0], [1, 0], [0, 1], [1, 0]]
    assert found.shape == (4, 3)
    assert found[:, 2].min() == 0
    assert found[:, 2].max() == 1


def test_a_scenario_that_is_not_sampled_or_has_few_runs_is_told_why(scenario_file, out, log):
    sample = (
        "sample: {count: 8, values: {material.bed_friction: {distribution: uniform, lower: 20, upper: 28}}}\n"
    )
    files = scenario_file(20, 21, name="swept"), scenario_file(name="few", more=sample)
    run(out, *files, solve=partial(by_friction, log=log, harm=False))
    found = {name: str(error) for name, error in of_place(out, {})}
    assert found["swept"] == "expected a sample, as draws come from its distributions; found none"
    assert found["few"] == "expected at least 32 computed runs for 1 inputs, found 8"
    with pytest.raises(ValueError, match="expected a scenario of few, swept, found 'none'"):
        next(of_place(out, {}, "none"))


def test_weights_of_single_draws_are_refused():
    (store,) = sheet()
    store["weight"] = ("run", np.linspace(1, 2, 64) / 96)
    with pytest.raises(NotEmulatedError, match="expected equal weights of all draws"):
        made([store])


def test_an_observed_deposit_narrows_the_parameters_or_is_refused():
    (store,) = sheet()
    store["deposit_depth"] = store["max_depth"]
    runs, truth = of([store]), np.array([[0.5, 0.5]])
    covered = (depths(truth, store["x"].to_numpy(), store["y"].to_numpy())[0] > 0.1).ravel()
    table = posterior_table(runs, Observed(covered, None), 0.1, 4.0, 2**13).set_index("parameter")
    for name, known in (("turbulent_friction", 700.0), ("volume", 1.0)):
        row = table.loc[name]
        assert row["posterior_q05"] < known < row["posterior_q95"]
        narrower = (row["posterior_q95"] - row["posterior_q05"]) / (row["prior_q95"] - row["prior_q05"])
        assert narrower < 0.8
    nowhere = np.zeros((21, 26), bool)
    nowhere[:3, -3:] = True
    with pytest.raises(NotEmulatedError, match=r"deviations from the observation|effective draws"):
        posterior_table(runs, Observed(nowhere.ravel(), None), 0.1, 1.0, 2**13)


def test_a_run_that_lost_material_has_no_deposit_to_be_measured():
    status = np.full(64, Status.DONE)
    status[8:16] = Status.OVERRUN
    (store,) = sheet(status=status)
    whole = store["max_depth"]
    covered = (depths(np.array([[0.5, 0.5]]), store["x"].to_numpy(), store["y"].to_numpy())[0] > 0.1).ravel()
    tables = []
    for left in (whole, whole.where(store["status"] == Status.DONE, 0.2 * whole)):
        store["deposit_depth"] = left
        tables.append(posterior_table(of([store]), Observed(covered, None), 0.1, 4.0, 2**13))
    assert tables[0].equals(tables[1])
    (told,) = set(tables[0]["left_out"])
    assert told.startswith("8 of 64 computed runs were overrun or cut off; the emulator stands for them")


def test_a_posterior_has_what_changes_to_the_closest_spacing():
    stores = sheet(levels="both")
    for store in stores:
        store["deposit_depth"] = store["max_depth"]
    place, wide = np.array([[0.5, 0.5]]), stores[0]
    # what is observed is a deposit of the closest spacing, on the cells of the widest
    seen = depths(place, wide["x"].to_numpy(), wide["y"].to_numpy(), THINNER)[0] > 0.1
    tables = {
        len(levels): posterior_table(of(levels), Observed(seen.ravel(), None), 0.1, 4.0, 2**15).set_index(
            "parameter"
        )
        for levels in (stores, [wide])
    }
    both, alone = (tables[count].loc["volume"] for count in (2, 1))
    assert both["spacing"] == f"from {SPACING:g} to {CLOSE:g} m, by 16 runs on both"
    assert alone["spacing"] == "one spacing: not estimated"
    # a sheet that is thinner on the closest spacing takes more of a volume
    assert both["posterior_q50"] > alone["posterior_q50"]
    change = both["posterior_q50"] - alone["posterior_q50"]
    assert both["posterior_q50_discretisation"] >= 0.9 * change
    assert np.isnan(alone["posterior_q50_discretisation"])


def test_missing_runs_have_what_changes_to_the_closest_spacing(lacking):
    stores = sheet(levels="both")
    volume = stores[0]["volume"].to_numpy()
    status = np.full(64, Status.DONE)
    status[16:][np.argsort(volume[16:])[-LARGEST:]] = Status.FAILED
    (wide,) = sheet(status=status)
    wide.attrs = stores[0].attrs
    rows = made([wide, stores[1]]).tables["emulated-missing"]
    assert len(rows) == LARGEST
    assert rows["runout_distance_discretisation"].to_numpy() == pytest.approx(2 * THINNER, abs=0.02)
    assert (rows["far_reached_discretisation"] >= 0).all()
    assert (rows["spacing"] == f"from {SPACING:g} to {CLOSE:g} m, by 16 runs on both").all()
    alone = lacking.tables["emulated-missing"]
    assert alone["runout_distance_discretisation"].isna().all()
    assert alone["far_reached_discretisation"].isna().all()
    assert (alone["spacing"] == "one spacing: not estimated").all()
