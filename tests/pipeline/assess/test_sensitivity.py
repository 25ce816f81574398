import numpy as np
import pytest
from synthetic import store

from pipeline.assess import sensitivity
from pipeline.assess.sensitivity import table_of
from pipeline.scenario.design import saltelli
from pipeline.store.variables import Status

SALTELLI = """\
sample:
  count: 256
  design: saltelli
  values:
    material.bed_friction: {distribution: uniform, lower: 20, upper: 21}
    release.volume: {distribution: uniform, lower: 1, upper: 2}
"""


@pytest.fixture(autouse=True)
def few_resamples(monkeypatch):
    monkeypatch.setattr(sensitivity, "RESAMPLES", 8)


def indices(found, quantity="runout_distance"):
    return found[found["quantity"] == quantity].set_index(["parameter", "method"])


def test_indices_of_a_sum_are_its_shares_of_variance():
    rows = saltelli(np.random.default_rng(1).random((256, 4)))
    given = {"bed_friction": 20 + rows[:, 0], "volume": 1 + rows[:, 1]}
    told = []
    found = table_of(store(given, more=SALTELLI, runout_distance=3 * rows[:, 0] + rows[:, 1]), told.append)
    table = indices(found)
    for method in ("sobol first", "sobol total"):
        assert table.loc[("bed_friction", method), "index"] == pytest.approx(0.9, abs=0.08)
        assert table.loc[("volume", method), "index"] == pytest.approx(0.1, abs=0.08)
    assert table.loc[("bed_friction", "pawn"), "index"] > 2 * table.loc[("volume", "pawn"), "index"]
    assert told == [
        f"synthetic: {name}: the same in all runs"
        for name in ("deposit_area", "deposit_max_depth", "peak_speed")
    ]


def test_sobol_s_indices_are_refused_where_a_run_is_missing():
    rows = saltelli(np.random.default_rng(1).random((256, 4)))
    given = {"bed_friction": 20 + rows[:, 0], "volume": 1 + rows[:, 1]}
    status = np.full(len(rows), Status.DONE)
    status[[3, 700]] = Status.FAILED
    told = []
    found = table_of(store(given, status, SALTELLI, runout_distance=rows[:, 0]), told.append)
    assert set(found["method"]) == {"pawn"}
    assert (found["runs_used"] == 1022).all()
    assert told[0] == "synthetic: 2 of 1024 runs failed or are pending: indices are of the others"
    assert told[1] == (
        "synthetic: runout_distance: no Sobol indices: 2 of 1024 runs are missing, "
        "and the design holds only as a whole"
    )


def test_a_parameter_that_does_nothing_is_within_the_noise_and_one_of_a_list_is_seen():
    rng = np.random.default_rng(2)
    friction, volume = rng.random(200), rng.integers(1, 4, 200).astype(float)
    found = table_of(
        store({"bed_friction": friction, "volume": volume}, runout_distance=volume + 0.1 * rng.random(200)),
        lambda _: None,
    )
    table = indices(found).droplevel("method")
    assert table.loc["bed_friction", "index"] < table.loc["bed_friction", "noise"]
    # its three slices are disjoint: each holds a third of all
    assert table.loc["volume", "index"] == pytest.approx(0.6, abs=0.1)
    assert (table["lower"] < table["index"]).all()


def test_few_runs_have_no_indices():
    told = []
    given = {"bed_friction": np.arange(10.0)}
    assert table_of(store(given, runout_distance=np.arange(10.0)), told.append).empty
    assert told[0] == "synthetic: runout_distance: no indices from 10 runs, at least 40 are needed"


def test_indices_go_by_the_design_in_whatever_order_a_store_lists_its_parameters():
    rows = saltelli(np.random.default_rng(1).random((64, 4)))
    given = {"bed_friction": 20 + rows[:, 0], "volume": 1 + rows[:, 1]}
    for names in (("bed_friction", "volume"), ("volume", "bed_friction")):
        made = store({name: given[name] for name in names}, more=SALTELLI, runout_distance=rows[:, 0])
        table = indices(table_of(made, lambda _: None))
        assert table.loc[("bed_friction", "sobol first"), "index"] == pytest.approx(1, abs=0.25)
        assert table.loc[("volume", "sobol first"), "index"] == pytest.approx(0, abs=1e-6)


def test_a_parameter_with_one_value_keeps_its_place_in_the_design():
    rows = saltelli(np.random.default_rng(1).random((64, 4)))
    given = {"bed_friction": np.full(len(rows), 20.0), "volume": 1 + rows[:, 1]}
    table = indices(table_of(store(given, more=SALTELLI, runout_distance=rows[:, 1]), lambda _: None))
    assert table.loc[("bed_friction", "sobol total"), "index"] == 0
    assert table.loc[("bed_friction", "pawn"), "index"] == 0
    assert table.loc[("volume", "sobol first"), "index"] == pytest.approx(1, abs=0.1)


def test_runs_that_count_unequally_or_went_farther_are_told():
    rng = np.random.default_rng(3)
    states = np.where(np.arange(60) < 5, Status.OVERRUN, Status.DONE)
    made = store({"bed_friction": rng.random(60)}, states, runout_distance=rng.random(60))
    made = made.assign_coords(weight=("run", np.linspace(1, 2, 60) / 90))
    told = []
    table_of(made, told.append)
    assert told[:2] == [
        "synthetic: weights and return periods have no part in the indices: all runs count equally",
        "synthetic: 5 of 60 runs left the domain or still moved at time.end: "
        "indices are of how far they were computed",
    ]
