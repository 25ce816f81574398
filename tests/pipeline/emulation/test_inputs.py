"""Values that no computed run has, and runs that are the only ones of their kind."""

import numpy as np
import pytest
from sampled_stores import sheet

from pipeline.emulation.emulate import emulate
from pipeline.emulation.errors import NotEmulatedError
from pipeline.emulation.sampled import Sampled, sampled
from pipeline.scenario.scenario import stored
from pipeline.store.variables import Status

pytestmark = pytest.mark.usefixtures("few_pictures")

DISCRETE = "\n    material.%s: {distribution: discrete, values: %s, weights: "
PRESSURE = DISCRETE % ("earth_pressure", "[isotropic, mohr-coulomb-flow]") + "%s}"
DENSITY = DISCRETE % ("density", "[1000, 2000]") + "%s}"


def of(stores):
    return Sampled(stored(stores[0].attrs), tuple(stores))


def failed(key, value, more):
    """Give a sheet whose runs with a value have failed."""
    (whole,) = sheet(more=more)
    return of(sheet(status=np.where(whole[key] == value, Status.FAILED, Status.DONE), more=more))


@pytest.mark.parametrize(
    ("key", "value", "more", "told"),
    [
        ("earth_pressure", "mohr-coulomb-flow", PRESSURE, "material.earth_pressure mohr-coulomb-flow"),
        # the first word of all is a draw like any other
        ("earth_pressure", "isotropic", PRESSURE, "material.earth_pressure isotropic"),
        ("density", 2000, DENSITY, r"material.density 2000(\.0)?"),
    ],
)
def test_a_value_that_no_computed_run_has_is_not_taken_for_another(key, value, more, told):
    runs = failed(key, value, more % "[1, 1]")
    with pytest.raises(NotEmulatedError, match=rf"no computed run has {told}, which 50 % of the events have"):
        emulate(runs, runs.settings.hazard, 1024)


def test_a_value_that_is_rarer_than_any_error_tells_is_left():
    runs = of(sheet(more=PRESSURE % "[9999, 1]"))
    assert set(runs.stores[0]["earth_pressure"].to_numpy()) == {"isotropic"}
    draws = runs.inputs.draws(1024)
    assert draws.at.shape == (1024, 2)


def test_a_word_that_all_runs_have_is_no_input():
    more = "\n    material.earth_pressure: {distribution: discrete, values: [isotropic]}"
    runs = of(sheet(more=more))
    assert runs.at(0).shape == (64, 2)
    assert runs.inputs.by_key["material.earth_pressure"].columns == 0
    assert runs.inputs.draws(256).at.shape == (256, 2)


def test_words_of_chosen_runs_are_known():
    (sample,) = sheet(more=PRESSURE % "[9999, 1]")
    beside = sample.isel(run=[0, 1]).copy(deep=True)
    beside["earth_pressure"] = beside["earth_pressure"].copy(data=np.array(["mohr-coulomb-flow"] * 2, object))
    runs = Sampled(stored(sample.attrs), (sample,), (beside,))
    assert runs.at(0)[:, -1].tolist() == [0.0] * 64 + [1.0] * 2


def test_runs_that_vary_in_no_parameter_by_itself_are_told(monkeypatch, tmp_path):
    (store,) = sheet()
    # one parameter follows from the other
    store["volume"] = store["volume"].copy(data=0.5 + (store["turbulent_friction"].to_numpy() - 200) / 1000)
    monkeypatch.setattr("pipeline.emulation.sampled.open_store", lambda path: store)
    monkeypatch.setattr("pipeline.emulation.sampled.chosen_paths", lambda path: ())
    with (
        pytest.raises(NotEmulatedError, match="64 runs do not vary in all of 2 inputs, each by itself"),
        sampled(tmp_path / "sheet.zarr"),
    ):
        pass


def test_few_runs_on_the_closer_spacing_make_its_numbers_doubtful_or_are_left_out(monkeypatch, tmp_path):
    coarse, fine = sheet(levels="both")
    monkeypatch.setattr("pipeline.emulation.sampled.chosen_paths", lambda path: ())
    monkeypatch.setattr("pipeline.emulation.sampled.is_made", lambda path: True)
    for count, doubts, left_out in (
        (5, ("5 runs of the finer spacing are few (8)",), ""),
        (3, (), "fewer than 4 at 2 m, to which nothing is corrected"),
        (16, (), ""),
    ):
        some = fine.copy()
        some["status"] = ("run", np.where(np.arange(16) < count, Status.DONE, Status.PENDING))
        stores = iter((coarse, some))
        monkeypatch.setattr("pipeline.emulation.sampled.open_store", lambda path, held=stores: next(held))
        with sampled(tmp_path / "sheet.zarr") as runs:
            assert runs.doubts == doubts
            assert runs.left_out == left_out
            assert (left_out in runs.words) or not left_out
            assert len(runs.stores) == (1 if left_out else 2)


def test_few_pairs_are_a_reason_of_every_verdict():
    coarse, fine = sheet(levels="both")
    fine["status"] = ("run", np.where(np.arange(16) < 5, Status.DONE, Status.PENDING))
    runs = of([coarse, fine])
    table = emulate(runs, runs.settings.hazard, 256).tables["leave-one-out"]
    judged = table[~table["verdict"].isin(["refused", "not emulated"])]
    assert {"depth above 0.5 m, map", "depth above 0.1 m, far", "runout_distance"} <= {*judged["what"]}
    assert (judged["verdict"] == "doubtful").all()
    assert judged["reason"].str.contains("5 runs of the finer spacing are few").all()


def test_runs_without_a_deposit_have_no_run_out_that_could_be_predicted():
    (store,) = sheet()
    reach = store["runout_distance"].to_numpy().copy()
    reach[:3] = np.nan
    store["runout_distance"] = store["runout_distance"].copy(data=reach)
    runs = of([store])
    found = emulate(runs, runs.settings.hazard.model_copy(update={"depth": ()}), 256)
    row = found.tables["leave-one-out"].set_index("what").loc["runout_distance"]
    assert row["verdict"] == "refused"
    assert row["reason"] == "3 runs end without any runout_distance"


def test_emulated_maps_know_nothing_of_the_inside_of_buildings():
    (store,) = sheet()
    stands = np.zeros((21, 26), np.int8)
    stands[9:12, 11:13] = 1
    store = store.assign_coords(building=(("y", "x"), stands))
    depth = np.where(stands == 1, 0.0, store["max_depth"].to_numpy())
    store["max_depth"] = store["max_depth"].copy(data=depth)
    runs = of([store])
    maps = emulate(runs, runs.settings.hazard, 256).maps
    assert maps is not None
    for name in ("depth_emulated", "depth_emulated_error", "depth_exceedance"):
        assert np.array_equal(np.isnan(maps[name].to_numpy()[0]), stands == 1)
