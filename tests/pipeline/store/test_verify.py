from pathlib import Path

import pytest
import zarr
from commands import pipeline
from templates import row, template

from pipeline.store import zarr_store
from pipeline.store.layout import create
from pipeline.store.variables import Status, kept
from pipeline.store.verify import verify


@pytest.fixture(params=[1, 2])
def path(tmp_path, request):
    """A store of five runs, the last pending, in groups of one or two."""
    path = tmp_path / "trial.zarr"
    create(path, template(group=request.param))
    for start in range(0, 4, request.param):
        runs = range(start, start + request.param)
        rows = {run: row(run) | {"failure_reason": "öl"} for run in runs}
        zarr_store.write(
            path, kept(), rows, {run: Status.FAILED if run == 1 else Status.DONE for run in runs}
        )
    return path


def faults(path: Path) -> list[str]:
    report = verify(path)
    assert report.runs == 4
    return [line.removeprefix(f"{path}: ") for line in report.faults]


def rot(file: Path, at: int = -10) -> None:
    """Turn one bit of a file."""
    data = bytearray(file.read_bytes())
    data[at] ^= 1
    file.write_bytes(data)


def test_what_was_written_is_found_so(path):
    assert faults(path) == []


def test_a_value_changed_unnoticed_is_found_in_its_run_alone(path):
    root = zarr.open_group(path, mode="r+")
    for name, run in (("max_depth", 1), ("steps", 2)):
        values = root[name][run]
        root[name][run] = values + 1
    root["wall_time"][0] = 3.0
    assert faults(path) == [f"run {run}: not the values that were written" for run in (1, 2)]


@pytest.mark.parametrize("name", ["depth", "max_depth", "steps", "volume_out", "failure_reason", "digest"])
def test_a_lost_chunk_is_found(path, name):
    for file in (path / name / "c").rglob("*"):
        if file.is_file():
            file.unlink()
    assert faults(path) == [f"run {run}: not the values that were written" for run in range(4)]


def test_a_bit_turned_in_a_chunk_is_found_within_its_group(path):
    rot(path / "depth" / "c" / "0" / "0" / "0" / "0")
    runs = {line.split(":")[0] for line in faults(path)}
    assert set() < runs <= {f"run {run}" for run in range(zarr_store.group(path))}


def test_a_chunk_that_does_not_decode_is_found_in_every_run_of_its_group(path):
    (path / "depth" / "c" / "0" / "0" / "0" / "0").write_bytes(b"nothing that zstd has written")
    found = faults(path)
    assert [line.split(":")[0] for line in found] == [f"run {run}" for run in range(zarr_store.group(path))]
    assert all("depth cannot be read" in line for line in found)


def test_a_changed_status_is_found(path):
    zarr.open_group(path, mode="r+")["status"][1] = Status.DONE
    assert faults(path) == ["run 1: not the values that were written"]


def test_a_changed_coordinate_or_scenario_is_found(path):
    root = zarr.open_group(path, mode="r+")
    root["x"][0] = 17.0
    assert faults(path) == ["a coordinate is not the one that was written"]
    root["x"][0] = 0.0
    root.attrs["scenario_content"] = "{1}"
    assert faults(path) == ["the scenario is not the one that was written"]


def test_the_command_reports_each_store_and_says_so_by_its_exit_code(path):
    good = pipeline("verify", path.parent)
    assert (good.exit_code, good.stdout) == (0, "trial: 4 ended runs, no faults\n")
    zarr.open_group(path, mode="r+")["steps"][2] = 5
    bad = pipeline("verify", path.parent)
    assert (bad.exit_code, bad.stdout) == (1, "trial: 4 ended runs, 1 faults\n")
    assert bad.stderr == f"{path}: run 2: not the values that were written\n"
    assert pipeline("verify", path.parent / "nowhere").exit_code == 2
