from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
import zarr
from templates import row, template

from pipeline.store import zarr_store
from pipeline.store.layout import Template, create, group_size
from pipeline.store.storage import storage_of
from pipeline.store.variables import COORDINATES, STATUS, TIMINGS, Status, kept


def files(path: Path) -> dict[str, bytes]:
    return {str(p.relative_to(path)): p.read_bytes() for p in sorted(path.rglob("*")) if p.is_file()}


@pytest.fixture
def path(tmp_path: Path) -> Path:
    return tmp_path / "trial.zarr"


def test_a_run_never_written_is_pending_and_nan_not_dry(path):
    create(path, template())
    with zarr_store.open_store(path) as opened:
        assert opened["status"].dtype == np.int8
        assert (opened["status"] == Status.PENDING).all()
        for name, variable in opened.data_vars.items():
            if variable.dtype.kind == "f":
                assert variable.isnull().all(), name
        assert (opened["failure_reason"] == "").all()


def test_every_variable_has_its_metadata_in_the_store(path):
    create(path, template())
    with zarr_store.open_store(path) as opened:
        for variable in (*COORDINATES, *kept()):
            assert opened[variable.name].dims == variable.dims
            assert opened[variable.name].attrs["long_name"] == variable.long_name
            assert opened[variable.name].attrs.get("units", "") == variable.units


def test_written_runs_read_back_and_the_others_stay_pending(path):
    create(path, template())
    zarr_store.write(path, kept(), {2: row(2)}, {2: Status.DONE})
    assert zarr_store.statuses(path).tolist() == [0, 0, 1, 0, 0]
    with zarr_store.open_store(path) as opened:
        assert (opened["depth"][2] == 2.5).all()
        assert opened["depth"].dtype == np.float32
        assert opened["steps"][2] == 12
        assert opened["velocity_x"][2].isnull().all()
        assert opened["depth"][[0, 1, 3, 4]].isnull().all()
        assert len(opened["digest"][2].item()) == 64


def test_status_is_written_last(path, monkeypatch):
    create(path, template(group=2))
    begun, ended = [], []
    put = zarr_store._put

    async def noted(array, *rest):
        begun.append(array.basename)
        whole = await put(array, *rest)
        ended.append(array.basename)
        return whole

    monkeypatch.setattr(zarr_store, "_put", noted)
    zarr_store.write(path, kept(), {2: row(2), 3: row(3)}, {2: Status.DONE, 3: Status.DONE})
    assert begun == [v.name for v in kept()]
    assert ended[-2:] == ["digest", "status"]
    assert len(ended) == len(begun)


def test_a_write_that_breaks_off_leaves_the_group_pending(path, monkeypatch):
    create(path, template(group=2))
    put = zarr_store._put

    async def refuse(array, *rest):
        if array.basename == "volume_in":
            raise OSError(28, "No space left on device")
        return await put(array, *rest)

    monkeypatch.setattr(zarr_store, "_put", refuse)
    with pytest.raises(OSError, match="No space"):
        zarr_store.write(path, kept(), {0: row(0), 1: row(1)}, {0: Status.DONE, 1: Status.DONE})
    assert (zarr_store.statuses(path) == Status.PENDING).all()


def test_a_group_owns_its_chunks_of_every_variable(path):
    create(path, template(runs=5, group=2))
    root = zarr.open_group(path, mode="r")
    for variable in kept():
        array = root[variable.name]
        assert (array.shards or array.chunks)[0] == 2
    before = files(path)
    zarr_store.write(path, kept(), {2: row(2), 3: row(3)}, {2: Status.DONE, 3: Status.DONE})
    new = set(files(path)) - set(before)
    assert new <= {f"{v.name}/c/1{'/0' * (len(v.dims) - 1)}" for v in kept()}
    assert {"depth/c/1/0/0/0", "steps/c/1", "digest/c/1", "status/c/1"} <= new


def test_runs_of_two_groups_are_never_written_together(path):
    create(path, template(group=2))
    with pytest.raises(ValueError, match="not of one group"):
        zarr_store.write(path, kept(), {1: row(1), 2: row(2)}, {1: Status.DONE, 2: Status.DONE})
    assert (zarr_store.statuses(path) == Status.PENDING).all()


def test_a_template_whose_groups_could_share_a_chunk_is_refused():
    class Shared(Template):
        def chunk(self, variable):
            return (3, *super().chunk(variable)[1:]) if variable is STATUS else super().chunk(variable)

    good = template(group=2)
    with pytest.raises(AssertionError, match="owns its chunks of status"):
        Shared(good.variables, good.coordinates, good.sizes, good.group, good.attributes)
    with pytest.raises(AssertionError, match="status is written last"):
        replace(good, variables=good.variables[::-1])


def test_part_of_a_group_is_redone_without_touching_the_rest(path):
    create(path, template(group=3))
    outcome = {0: Status.DONE, 1: Status.FAILED, 2: Status.OVERRUN}
    zarr_store.write(path, kept(), {0: row(0), 1: {"failure_reason": "went wrong: é"}, 2: row(2)}, outcome)
    zarr_store.write(path, kept(), {1: row(1)}, {1: Status.DONE})
    assert zarr_store.statuses(path).tolist() == [1, 1, 3, 0, 0]
    with zarr_store.open_store(path) as opened:
        assert opened["depth"][:3, 0, 0, 0].to_numpy().tolist() == [0.5, 1.5, 2.5]
        assert opened["failure_reason"][1] == ""


def test_a_store_written_twice_is_the_same_but_for_its_timings(path, tmp_path):
    other = tmp_path / "other.zarr"
    for each, order in ((path, (0, 1, 2)), (other, (2, 0, 1))):
        create(each, template(runs=3))
        for run in order:
            zarr_store.write(each, kept(), {run: row(run)}, {run: Status.DONE})
    one, two = files(path), files(other)
    assert one.keys() == two.keys()
    assert {name.split("/")[0] for name in one if one[name] != two[name]} == {"wall_time"} <= TIMINGS


def test_runs_too_large_for_a_chunk_are_sharded_by_run(path):
    large = template(runs=2, time=11, y=700, x=700)
    depth = large.variables[0]
    assert large.chunk(depth) == (1, 8, 700, 700)
    assert large.shard(depth) == (1, 16, 700, 700)
    create(path, large)
    values = np.zeros((11, 700, 700))
    values[10] = 2
    zarr_store.write(path, kept(), {1: {"depth": values}}, {1: Status.DONE})
    assert (path / "depth/c/1/0/0/0").exists()
    with zarr_store.open_store(path) as opened:
        assert opened["depth"].shape == (2, 11, 700, 700)
        assert opened["depth"][1, 10].mean() == 2


@pytest.mark.parametrize(
    ("runs", "seconds", "nbytes", "expected"),
    [
        (10_000, 0.1, 10_000, 450),
        (10, 0.1, 10_000, 1),
        (10_000, 0.1, 5_000_000, 4),
        (10_000, 3.0, 10_000, 15),
        (500, 3.0, 10_000, 1),
        (10_000, 30.0, 10_000, 1),
    ],
)
def test_short_runs_share_a_task_if_they_are_many_and_fit_a_chunk(runs, seconds, nbytes, expected):
    assert group_size(runs, seconds, nbytes) == expected


def test_replacing_a_store_leaves_nothing_of_the_old_one(path):
    create(path, template())
    zarr_store.write(path, kept(), {0: row(0)}, {0: Status.DONE})
    create(path, template(runs=2))
    assert zarr_store.statuses(path).tolist() == [0, 0]
    assert [p.name for p in path.parent.iterdir()] == ["trial.zarr"]


def test_leftovers_of_killed_writers_are_swept(path):
    create(path, template())
    before = files(path)
    (path / "depth" / "abc.partial").write_bytes(b"torn")
    (path.parent / ".trial.zarr.xyz.partial").mkdir()
    (path.parent / ".trial.zarr.xyz.partial" / "zarr.json").write_text("{}")
    assert storage_of(path.parent).sweep() == 2
    assert files(path) == before
    assert [p.name for p in path.parent.iterdir()] == ["trial.zarr"]
