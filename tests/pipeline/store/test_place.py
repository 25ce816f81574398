"""Places and stores as a user writes them, and what both kinds of storage promise."""

import os
from pathlib import Path
from uuid import uuid4

import pytest
from commands import pipeline
from stores import store_of
from templates import template

from pipeline.store import layout, lock_objects, zarr_store
from pipeline.store.folder import Folder
from pipeline.store.lock_files import TakenError
from pipeline.store.object_store import ObjectStore
from pipeline.store.place import store_paths
from pipeline.store.storage import located, storage_of


@pytest.mark.parametrize(
    ("text", "expected"),
    [
        ("s3:/", "s3:/: expected a URL as s3://bucket/path, or a folder"),
        ("s3://", "s3://: expected a URL as s3://bucket/path, or a folder"),
        ("s3:/bucket/runs", "s3:/bucket/runs: expected a URL as s3://bucket/runs, or a folder"),
        ("gs:/bucket", "gs:/bucket: expected a URL as gs://bucket, or a folder"),
    ],
)
def test_half_a_url_is_answered_with_a_whole_one(text, expected, scenario_file):
    with pytest.raises(ValueError, match="expected a URL") as found:
        located(text)
    assert str(found.value) == expected
    for command in (("run", scenario_file(), "--out", text), ("status", text), ("plot", text)):
        result = pipeline(*command)
        assert (result.exit_code, result.stderr) == (2, f"{expected}\n")


@pytest.mark.parametrize("text", ["results", "/srv/runs", "a:b", "C:/runs", "../x.zarr", "run 1: last"])
def test_a_folder_is_a_folder_whatever_is_in_its_name(text):
    assert located(text) == Path(text)


def test_a_file_url_is_a_folder():
    assert located("file:///srv/runs") == located("file:/srv/runs") == Path("/srv/runs")


def test_a_package_that_is_missing_is_named_with_its_extra(monkeypatch):
    def missing(name):
        raise ImportError(f"No module named '{name}'")

    monkeypatch.setattr("pipeline.store.objects.import_module", missing)
    with pytest.raises(
        ImportError, match=r"^s3://a/b: No module named 'upath'; for S3: pip install 'lmls\[s3\]'$"
    ):
        located("s3://a/b")


def test_a_store_given_as_place_is_answered_with_its_place(scenario_file, tmp_path):
    store_of(scenario_file(), tmp_path).close()
    store = tmp_path / "box.zarr"
    expected = f"{store}: expected the place that stores lie in, {tmp_path}, found the store of one scenario"
    for command in (("run", scenario_file(), "--out", store), ("status", store), ("summary", store)):
        result = pipeline(*command)
        assert (result.exit_code, result.stderr) == (2, f"{expected}\n")
    store.rename(tmp_path / "box")
    with pytest.raises(FileNotFoundError, match="expected the place that stores lie in"):
        store_paths(tmp_path / "box")


def test_a_place_given_as_store_is_answered_with_its_stores(scenario_file, tmp_path):
    store_of(scenario_file(), tmp_path).close()
    result = pipeline("plot", tmp_path)
    expected = f"{tmp_path}: expected a store, found a place; its stores are {tmp_path / 'box.zarr'}\n"
    assert (result.exit_code, result.stderr) == (2, expected)
    nowhere = tmp_path / "nowhere.zarr"
    result = pipeline("plot", nowhere)
    expected = f"{nowhere}: expected the store of a scenario, as <out>/<name>.zarr, found none\n"
    assert (result.exit_code, result.stderr) == (2, expected)


def test_a_file_given_as_place_is_told(scenario_file):
    file = scenario_file()
    result = pipeline("run", file, "--out", file)
    assert (result.exit_code, result.stderr) == (2, f"{file}: expected a folder, found a file\n")


@pytest.fixture(params=["folder", "objects"])
def place(request, tmp_path):
    """A place of each kind of storage."""
    return tmp_path if request.param == "folder" else located(f"memory://{uuid4().hex}")


class TestEitherStorage:
    def test_is_chosen_by_the_kind_of_location(self, tmp_path):
        assert storage_of(tmp_path) == Folder(tmp_path)
        assert isinstance(storage_of(located("memory://a")), ObjectStore)

    def test_writes_files_whole(self, place):
        for data in (b"one", b"two"):
            storage_of(place / "a.csv").put(data)
            assert (place / "a.csv").read_bytes() == data
        assert [each.name for each in place.iterdir()] == ["a.csv"]

    def test_publishes_a_store_and_replaces_it_when_asked(self, place):
        path = place / "trial.zarr"
        assert not storage_of(path).is_made()
        layout.create(path, template(runs=5), replace=False)
        assert storage_of(path).is_made()
        layout.create(path, template(runs=3), replace=False)
        assert len(zarr_store.statuses(path)) == 5
        layout.create(path, template(runs=2))
        assert len(zarr_store.statuses(path)) == 2
        assert [each.name for each in place.iterdir()] == ["trial.zarr"]

    def test_removes_what_is_there_and_is_silent_where_nothing_is(self, place):
        layout.create(place / "trial.zarr", template())
        for _ in range(2):
            storage_of(place / "trial.zarr").remove()
            assert not (place / "trial.zarr").exists()

    def test_sweeps_what_killed_drivers_left(self, place):
        (place / ".trial.points.partial").write_bytes(b"points")
        (place / "summary.csv").write_bytes(b"")
        assert storage_of(place).sweep() == 1
        assert [each.name for each in place.iterdir()] == ["summary.csv"]

    def test_is_held_by_one(self, place, monkeypatch):
        monkeypatch.setattr(lock_objects, "BEAT_SECONDS", 0.2)
        monkeypatch.setattr(lock_objects, "DEAD_SECONDS", 2.0)
        storage = storage_of(place)
        assert storage.holder() is None
        with storage.held():
            assert storage.holder().startswith(f"process {os.getpid()} on ")
            with (
                pytest.raises(TakenError, match=f"{place} is in use by process {os.getpid()} on "),
                storage.held(),
            ):
                pass
            with pytest.raises(TakenError), storage.held_in_part(1, 2, "a"):
                pass
        assert storage.holder() is None
        with (
            storage.held_in_part(1, 2, "a"),
            storage.held_in_part(2, 2, "a"),
            pytest.raises(TakenError),
            storage.held_in_part(2, 2, "a"),
        ):
            pass


def test_a_file_that_cannot_be_written_is_told_by_its_own_name(tmp_path):
    (tmp_path / "a.csv").mkdir()
    with pytest.raises(OSError, match=r"a\.csv'$") as found:
        storage_of(tmp_path / "a.csv").put(b"")
    assert "partial" not in str(found.value)
    with pytest.raises(FileNotFoundError, match=r"nowhere/a\.csv: expected a file in a folder that is there"):
        storage_of(tmp_path / "nowhere" / "a.csv").put(b"")


def test_only_storage_tells_a_folder_from_a_url():
    """What differs between them is asked of a storage, not tested for."""
    root = Path(layout.__file__).parents[1]
    storage = {"storage.py", "folder.py", "object_store.py", "objects.py"}
    branching = [
        path.name
        for path in root.rglob("*.py")
        if path.name not in storage and any(word in path.read_text() for word in ("is_url", "UPath", "upath"))
    ]
    assert branching == []
