from functools import partial

import pytest
from batches import run
from stub_solvers import by_friction

from pipeline.batch.driver import ChangedError
from pipeline.store import run_table, zarr_store
from pipeline.store.place import store_path
from pipeline.store.status import survey
from pipeline.store.verify import verify

LEVELS = """\
output: {threshold: 0.1}
sample:
  levels: [{spacing: 1, count: 4}, {spacing: 0.5, count: 2}]
  values: {material.bed_friction: {distribution: uniform, lower: 20, upper: 28}}
"""


@pytest.mark.usefixtures("any_workers")
def test_levels_are_runs_of_one_store_that_is_resumed_and_replaced_as_one(scenario_file, out, log):
    file, solve = scenario_file(more=LEVELS), partial(by_friction, log=log, harm=False)
    assert run(out, file, solve=solve).exit_code == 0
    assert [path.name for path in out.glob("*.zarr")] == ["box.zarr"]
    with zarr_store.open_store(out / "box.zarr" / "0.5m.zarr") as fine:
        assert fine.sizes["run"] == 2
        with zarr_store.open_store(out / "box.zarr") as coarse:
            assert coarse["bed_friction"].to_numpy()[:2].tolist() == fine["bed_friction"].to_numpy().tolist()
            assert coarse.sizes["x"] < fine.sizes["x"]
    assert [each.name for each in survey(out)] == ["box", "box/0.5m"]
    assert run_table.read(out)["scenario"].tolist() == ["box"] * 4 + ["box/0.5m"] * 2
    assert not any(verify(store_path(out, name)).faults for name in ("box", "box/0.5m"))
    done = len(log.read_text().split())
    assert run(out, file, solve=solve).exit_code == 0
    assert len(log.read_text().split()) == done == 6
    # a store that is replaced takes its finer level with it
    changed = scenario_file(more=LEVELS.replace("count: 4", "count: 8"))
    with pytest.raises(ChangedError):
        run(out, changed, solve=solve)
    assert run(out, changed, solve=solve, overwrite=True).exit_code == 0
    assert [sum(each.statuses.values()) for each in survey(out)] == [8, 2]
    assert all(each.finished for each in survey(out))
    # what is no level of the scenario any more goes on as it was
    deeper = LEVELS.replace("count: 4", "count: 8").replace("count: 2", "count: 4")
    assert run(out, scenario_file(more=deeper), solve=solve, overwrite=True).exit_code == 0
    assert [sum(each.statuses.values()) for each in survey(out)] == [8, 4]
