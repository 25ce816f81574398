"""What a batch promises holds on elevation models: kills, engines and parts leave the same store."""

from functools import partial

import pytest
from batches import files, run
from elevation_files import TEXT, ground, write_polygons, write_raster, written
from stub_solvers import dying_after

from pipeline.batch.driver import ChangedError
from pipeline.store.place import Part
from solver.simulation import simulate

SWEEP = ("time: {end: 60}", "time: {end: 20, output_every: 2.5}\nsweep: {release.slide.depth: [1, 2, 3]}")


@pytest.fixture
def file(tmp_path):
    write_raster(tmp_path / "dem.tif", ground())
    write_polygons(tmp_path / "releases.gpkg", {"slide": (20, -120, 50, -80)})
    return written(tmp_path, TEXT, SWEEP)


@pytest.mark.usefixtures("any_workers")
def test_a_run_that_was_killed_goes_on_and_the_store_is_that_of_parts_to_the_last_byte(
    file, out, log, tmp_path, monkeypatch
):
    monkeypatch.setattr("pipeline.runs.template.group_size", lambda *_: 1)
    killed = partial(dying_after, log=log, saves=4)
    assert run(out, file, solve=killed, checkpoint_every=0).exit_code == 0
    # one of four runs that were begun goes on from a snapshot
    *begun, resumed = sorted(map(int, log.read_text().split()))
    assert begun == [0, 0, 0]
    assert resumed > 0
    parts = tmp_path / "parts"
    for number in (1, 2):
        assert run(parts, file, solve=simulate, part=Part(number, 2)).exit_code == 0
    assert files(out / "small.zarr") == files(parts / "small.zarr")


def test_a_store_of_another_surface_or_of_other_polygons_is_not_taken_for_its_own(file, out, log):
    nothing = partial(dying_after, log=log, saves=-1)
    assert run(out, file, solve=nothing, checkpoint_every=0).exit_code == 0
    assert run(out, file, solve=nothing, checkpoint_every=0).exit_code == 0
    assert len(log.read_text().split()) == 3
    rougher = ground()
    rougher[20, 30] += 0.01
    write_raster(file.parent / "dem.tif", rougher)
    with pytest.raises(ChangedError, match=r"map_files\.elevation"):
        run(out, file, solve=nothing)
    write_raster(file.parent / "dem.tif", ground())
    write_polygons(file.parent / "releases.gpkg", {"slide": (20, -120, 50, -85)})
    with pytest.raises(ChangedError, match=r"map_files\.polygons"):
        run(out, file, solve=nothing)
    assert len(log.read_text().split()) == 3
