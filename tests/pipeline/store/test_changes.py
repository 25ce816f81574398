import json

from pipeline.scenario.scenario import load
from pipeline.store.changes import differences


def test_differences_are_told_key_by_key(scenario_file):
    before = load([scenario_file(26, 30)])[0]
    after = load([scenario_file(26, 28, 30, replace=("end: 1,", "end: 2,"), more="gravity: 1\n")])[0]
    assert differences(before.content, before.content) == []
    assert differences(before.content, after.content) == [
        "gravity: was 9.81, is 1",
        "time.end: was 1, is 2",
        "sweep.material.bed_friction.1: was 30, is 28",
        "sweep.material.bed_friction.2: was nothing, is 30",
    ]


def test_of_files_and_draws_it_is_told_what_changed_and_not_what_follows():
    one, other = "a" * 64, "b" * 64
    held = {"terrain": {"elevation": "dem.tif"}, "map_files": {"elevation": one}, "sample": {"count": 4}}
    before = {**held, "draws": one}

    def told(**new):
        return differences(json.dumps(before), json.dumps({**before, **new}))

    content = "map_files.elevation: the content of dem.tif around the domain has changed"
    assert told(map_files={"elevation": other}) == [content]
    assert told(sample={"count": 8}, draws=other) == ["sample.count: was 4, is 8"]
    assert told(draws=other) == ["draws: the values drawn have changed, as with another version of SciPy"]
    moved = told(map_files={"elevation": other}, terrain={"elevation": "new.tif"})
    assert moved == ["terrain.elevation: was 'dem.tif', is 'new.tif'"]
