from functools import partial

import numpy as np
import pytest
import zarr
from batches import counts, run
from stub_solvers import gliding

import pipeline
from pipeline.batch import driver
from pipeline.errors import OptionError
from pipeline.scenario.scenario import load
from pipeline.store import run_table, zarr_store
from pipeline.store.place import store_path
from pipeline.store.status import survey
from pipeline.store.variables import Status
from pipeline.store.verify import verify

SAMPLED = """\
output: {threshold: 0.1}
sample:
  count: 32
  values: {material.bed_friction: {distribution: uniform, lower: 20, upper: 28}}
receptors:
  - {name: school, point: [6, 0]}
  - {name: never, point: [9.5, 1.5]}
"""
FOR = "school: depth > 0.5"


@pytest.fixture(autouse=True)
def _few_draws(monkeypatch):
    """Choose among fewer draws: one quantity of one place."""
    monkeypatch.setattr("pipeline.emulation.next_runs.DRAWS", 2048)


@pytest.fixture
def file(scenario_file):
    return scenario_file(more=SAMPLED)


@pytest.fixture
def do(file, out, log, monkeypatch):
    """Run the scenario by a stub of the solver, in this process."""
    monkeypatch.setitem(driver.complete.__kwdefaults__, "solve", partial(gliding, log=log))

    def with_options(count=4, text=FOR, **options):
        return pipeline.run(
            options.pop("file", file), out, workers=1, quiet=True, next=count, for_=text, **options
        )

    return with_options


@pytest.fixture
def sampled(file, out, log):
    run(out, file, solve=partial(gliding, log=log))


@pytest.mark.usefixtures("sampled")
def test_chosen_runs_lie_within_the_store_of_the_sample_and_are_no_part_of_it(do, out):
    plain = pipeline.assessment_tables(out)["receptors"]
    results = do()
    assert [*results] == ["box", "box/chosen-1"]
    with zarr_store.open_store(store_path(out, "box")) as store:
        assert store.sizes["run"] == 32
    with zarr_store.open_store(store_path(out, "box/chosen-1")) as chosen:
        # the depth is 0.5 m there at 22.5 degree
        assert chosen["bed_friction"].to_numpy()[0] == pytest.approx(22.5, abs=1)
        assert chosen["weight"].to_numpy().tolist() == [0.0] * 4
        assert chosen.attrs["chosen_for"] == FOR
        assert chosen.attrs["chosen_from"].startswith("32 of 32 runs done at 0.5 m: probability 0.3")
        assert chosen.attrs["threshold"] == 0.1
    table = run_table.read(out)
    assert table[table["weight"] == 0]["scenario"].tolist() == ["box/chosen-1"] * 4
    assert f"chosen for {FOR}; no part of the sample" in str([*survey(out)][1])
    assert not verify(store_path(out, "box/chosen-1")).faults
    after = pipeline.assessment_tables(out)["receptors"]
    assert (after.pop("runs_chosen_left_out") == 4).all()
    assert after.equals(plain)
    maps = pipeline.hazard_maps(out)["box"]
    assert maps.attrs["comment"] == "32 of 32 runs done; 4 chosen runs left out"


@pytest.mark.usefixtures("sampled")
def test_a_choice_goes_on_where_it_stopped_and_a_further_one_learns_from_it(do, out, log):
    do()
    path = store_path(out, "box/chosen-1")
    before = zarr_store.attributes(path)
    with zarr_store.open_store(path) as chosen:
        values = chosen["bed_friction"].to_numpy()
    # as if the batch had been killed
    zarr.open_group(path, mode="r+")["status"][2] = Status.PENDING
    assert counts(path)[Status.PENDING] == 1
    ended = len(log.read_text().split())
    do()
    assert len(log.read_text().split()) == ended + 1
    assert counts(path) == {Status.DONE: 4}
    assert zarr_store.attributes(path) == before
    assert [*do(3, "school: depth > 0.6")] == ["box", "box/chosen-1", "box/chosen-2"]
    with zarr_store.open_store(store_path(out, "box/chosen-2")) as further:
        assert "4 of 4 chosen runs done" in further.attrs["chosen_from"]
        assert not np.isin(further["bed_friction"].to_numpy(), values).any()
    # a plain run knows them too
    assert [*do(None, None)] == ["box", "box/chosen-1", "box/chosen-2"]


@pytest.mark.usefixtures("sampled")
def test_a_store_that_is_replaced_takes_its_chosen_runs_with_it(do, out, scenario_file):
    do()
    changed = scenario_file(more=SAMPLED.replace("upper: 28", "upper: 27"))
    with pytest.raises(pipeline.ChangedError):
        do(file=changed)
    results = pipeline.run(changed, out, overwrite=True, quiet=True, workers=1)
    assert [*results] == ["box"]
    assert [each.name for each in survey(out)] == ["box"]
    assert load([changed])[0].digest == zarr_store.attributes(store_path(out, "box"))["scenario_hash"]


def test_a_choice_without_runs_is_refused_and_nothing_is_written(do, out):
    with pytest.raises(OptionError, match="expected runs of box to choose by, found none"):
        do()
    assert not [*out.glob("*.zarr")]


@pytest.mark.usefixtures("sampled")
def test_what_cannot_be_chosen_for_is_told(do, out):
    for count, text, told in (
        (4, "scool: depth > 1", "expected a receptor of school, never, found 'scool'. Did you mean 'school'"),
        (4, "school: dept > 1", "expected one of depth, speed, pressure, found 'dept'. Did you mean 'depth'"),
        (4, "school depth", "expected a place, a quantity and a threshold as 'school: depth > 1.2'"),
        (4, "school: depth > 1 kPa", "expected a number in m, found '1 kPa'"),
        (4, "school: depth > 0", "expected a threshold above 0, found '0'"),
        (4, "school: depth > 0.001", "too low to be told from dry"),
        (4, "never: depth > 1", "leave-one-out does not support choosing runs: all runs are alike"),
        (4, None, "expected with --for"),
        (None, FOR, "expected with --next"),
        (0, FOR, "expected 1 to 10,000 runs, found 0"),
    ):
        with pytest.raises(OptionError, match=told):
            do(count, text)
    assert [path.name for path in out.rglob("*.zarr")] == ["box.zarr"]


def test_a_scenario_without_a_sample_and_several_are_refused(do, scenario_file):
    with pytest.raises(OptionError, match="expected a scenario with a sample, found none in box"):
        do(file=scenario_file(20, 21))
    with pytest.raises(OptionError, match="expected one scenario, found 2"):
        do(file=[scenario_file(more=SAMPLED), scenario_file(name="other", more=SAMPLED)])
