"""Domains on elevation models that a scenario gives none for: found from the flow, on the model's cells."""

import threading
from types import SimpleNamespace

import numpy as np
import pytest
import xarray as xr
from elevation_files import DOMAIN, NORTH, SIDE, TEXT, WEST, ground, write_polygons, write_raster, written

import pipeline
from pipeline.inputs import elevation_raster
from pipeline.runs import domain_search
from pipeline.runs.runs import expand
from pipeline.scenario.scenario import load
from pipeline.store.verify import verify

NONE = (f"{DOMAIN}\n", "")
ROWS, COLUMNS = 160, 200


@pytest.fixture
def folder(tmp_path):
    """A valley far longer and wider than a small slide comes."""
    write_raster(tmp_path / "dem.tif", ground(ROWS, COLUMNS))
    write_polygons(tmp_path / "releases.gpkg", {"slide": (20, -420, 50, -380), "upper": (20, -450, 40, -425)})
    write_polygons(tmp_path / "huts.gpkg", {"barn": (110, -405, 120, -395), "far": (900, -20, 910, -10)})
    return tmp_path


def run(folder, *changes, more="", name="small", out="results"):
    text = TEXT.replace("name: small", f"name: {name}") + more
    path = written(folder, text, *changes)
    file = path.rename(folder / f"{name}.yaml")
    return pipeline.run(file, folder / out, workers=1, quiet=True, warn=lambda line: None)


def opened(folder, name="small", out="results"):
    return xr.open_zarr(folder / out / f"{name}.zarr", consolidated=False).load()


def test_it_holds_the_flow_and_changes_nothing(folder):
    run(folder, NONE)
    found = opened(folder)
    whole = f"domain: {{x: [{WEST + 2.5}, {WEST + 997.5}], y: [{NORTH - 797.5}, {NORTH - 2.5}]}}"
    run(folder, (DOMAIN, whole), name="whole")
    given = opened(folder, "whole")
    assert found.sizes["x"] < given.sizes["x"] / 2
    assert found.sizes["y"] < given.sizes["y"] / 2
    # on the centres of the elevation model's cells
    assert not (np.mod(found["x"] - WEST - SIDE / 2, SIDE)).any()
    same = given.sel(x=found["x"], y=found["y"])
    for name in ("depth", "max_depth", "max_speed", "arrival_time", "elevation", "area"):
        np.testing.assert_array_equal(found[name], same[name])
    assert float(given["max_depth"].astype(float).sum()) == float(same["max_depth"].astype(float).sum())
    assert found["volume_out"].to_numpy().tolist() == [0.0]
    # nothing but dry cells beside the edge
    rim = np.ones(found["max_depth"].shape[1:], bool)
    rim[2:-2, 2:-2] = False
    assert not found["max_depth"].to_numpy()[0][rim].any()


def test_what_lies_far_from_the_flow_is_not_read(folder, monkeypatch):
    shapes = []
    read = elevation_raster.read

    def counted(*arguments):
        found = read(*arguments)
        shapes.append(found.elevation.shape)
        return found

    monkeypatch.setattr(elevation_raster, "read", counted)
    run(folder, NONE)
    assert shapes
    assert max(rows * columns for rows, columns in shapes) < ROWS * COLUMNS / 2
    # the hash of the content is that of the part that decides the results
    before = load([folder / "small.yaml"])[0]
    elevation = ground(ROWS, COLUMNS)
    elevation[:, -3:] += 1.0
    write_raster(folder / "dem.tif", elevation)
    assert load([folder / "small.yaml"])[0].digest == before.digest
    told = []
    pipeline.run(folder / "small.yaml", folder / "results", workers=1, quiet=True, warn=told.append)


def test_another_ground_where_the_flow_comes_is_a_changed_scenario(folder):
    run(folder, NONE)
    elevation = ground(ROWS, COLUMNS)
    elevation[80, 20] += 0.5
    write_raster(folder / "dem.tif", elevation)
    with pytest.raises(pipeline.ChangedError, match=r"content of dem\.tif around the domain has changed"):
        pipeline.run(folder / "small.yaml", folder / "results", workers=1, quiet=True)


def test_what_is_left_is_done_on_the_domain_of_the_store(folder, monkeypatch):
    run(folder, NONE, more="receptors: huts.gpkg\n")
    first = opened(folder)
    monkeypatch.setattr("pipeline.runs.domain_search.MARGIN", 1.0)
    run(folder, NONE, more="receptors: {file: huts.gpkg, layer: huts}\n")
    assert opened(folder).sizes == first.sizes
    assert verify(folder / "results" / "small.zarr").faults == ()
    receptors = pipeline.assessment_tables(folder / "results")["receptors"]
    # the other lies where no flow comes
    assert list(receptors["receptor"]) == ["barn"]


def test_places_outside_of_a_domain_that_runs_were_cut_off_in_stay_with_open_bounds(folder):
    file = written(folder, TEXT + "receptors: huts.gpkg\n", NONE, ("end: 60", "end: 4"))
    lines, out = [], folder / "results"
    pipeline.run(file, out, workers=1, quiet=True, warn=lines.append)
    lines.clear()
    scenario = domain_search.settled(load([file])[0], None, lines.append)
    (told,) = [line for line in lines if "'far'" in line]
    assert told == (
        "small: outside of the domain: 'barn', 'far'; whether flow comes there is not known, as 1 of 1 runs "
        "that looked for it were cut off, overrun or failed"
    )
    assert [each.name for each in scenario.settings.places] == ["barn", "far"]
    # as well where the runs go on in the domain of their store
    known = domain_search.settled(load([file])[0], out / "small.zarr", lines.append)
    assert [each.name for each in known.settings.places] == ["barn", "far"]
    far = pipeline.assessment_tables(out)["receptors"].set_index("receptor").loc["far"]
    assert (far["probability_lower"], far["probability_upper"]) == (0, 1)


def test_scenarios_of_one_command_lie_on_the_same_cells(folder):
    files = []
    for name, friction in (("smooth", 12), ("small", 16)):
        text = TEXT.replace("name: small", f"name: {name}").replace("friction: 16", f"friction: {friction}")
        files.append(written(folder, text, NONE).rename(folder / f"{name}.yaml"))
    out = folder / "results"
    pipeline.run(files, out, workers=1, quiet=True)
    one, other = opened(folder), opened(folder, "smooth")
    np.testing.assert_array_equal(one["x"], other["x"])
    assert "all scenarios" in pipeline.hazard_maps(out)
    table = pipeline.run_table(out).set_index("scenario")
    assert (table["volume_out"] == 0).all()


def test_a_flow_that_comes_to_the_end_of_the_elevation_model_is_overrun(folder):
    write_raster(folder / "dem.tif", ground(ROWS, 28))
    table = run(folder, NONE, ("friction: 16", "friction: 5")).table
    assert table["status"].str.contains("overrun").all()
    assert opened(folder)["x"][-1] == WEST + SIDE * 27.5


def test_all_polygons_of_a_sweep_are_held(folder):
    results = run(folder, NONE, more="sweep: {release.name: [slide, upper]}\n")
    assert (results.table["volume_lost"] < 1e-9).all()
    assert (results.table["volume_out"] == 0).all()


def test_levels_need_a_domain(folder):
    levels = "sample: {levels: [{spacing: 10, count: 8}, {spacing: 5, count: 4}], values: "
    levels += "{material.bed_friction: {distribution: uniform, lower: 14, upper: 18}}}\n"
    with pytest.raises(pipeline.BadInput, match="expected a domain, which all levels share"):
        load([written(folder, TEXT + levels, NONE)])


def test_elevation_models_can_be_swept(folder):
    later = ground(ROWS, COLUMNS)
    later[60:100, 30:34] += 6.0
    write_raster(folder / "later.tif", later)
    results = run(folder, NONE, more="sweep: {terrain.elevation: [dem.tif, later.tif]}\n")
    store = opened(folder)
    assert store["elevation"].dims == store["area"].dims == ("run", "y", "x")
    raised = (store["elevation"][1] - store["elevation"][0]).to_numpy()
    assert set(np.unique(raised)) == {0.0, 6.0}
    assert list(store["terrain_elevation"].to_numpy()) == ["dem.tif", "later.tif"]
    # a bank across the valley holds the slide back
    assert results.table["runout_distance"][1] < results.table["runout_distance"][0]
    assert (results.table["volume_error"].abs() < 1e-13).all()
    # each raster is read once for all of its runs
    shared = {id(each) for each in load([folder / "small.yaml"])[0].ground.rasters.values()}
    assert len(shared) == 2
    assert [each.settings.terrain.elevation for each in expand(load([folder / "small.yaml"])[0])] == [
        "dem.tif",
        "later.tif",
    ]
    maps = pipeline.hazard_maps(folder / "results")
    assert float(maps["small"]["depth_exceedance"].max()) == 1.0
    alone = run(folder, NONE, ("elevation: dem.tif", "elevation: later.tif"), name="alone", out="alone")
    assert alone.table["runout_distance"][0] == results.table["runout_distance"][1]


def test_elevation_models_can_be_sampled(folder):
    write_raster(folder / "later.tif", ground(ROWS, COLUMNS) + 1.0)
    drawn = "{distribution: discrete, values: [dem.tif, later.tif]}"
    sample = f"sample: {{count: 4, seed: 2, values: {{terrain.elevation: {drawn}}}}}\n"
    table = run(folder, NONE, more=sample).table
    assert set(table["terrain_elevation"]) == {"dem.tif", "later.tif"}
    # ground that is raised as a whole changes nothing but elevations
    assert table["runout_distance"].nunique() == 1
    assert table["lowest_elevation"].nunique() == 2


def test_a_found_domain_holds_one_that_another_scenario_gives(folder):
    given = f"domain: {{x: [{WEST + 3}, {WEST + 403}], y: [{NORTH - 500}, {NORTH - 300}]}}"
    finer = ("spacing: 5", "spacing: 4")
    files = []
    for name, change in (("given", (DOMAIN, given)), ("small", NONE)):
        text = TEXT.replace("name: small", f"name: {name}")
        files.append(written(folder, text, finer, change).rename(folder / f"{name}.yaml"))
    pipeline.run(files, folder / "results", workers=1, quiet=True)
    found, other = opened(folder), opened(folder, "given")
    # but for a part of a cell, where the one that is given lies otherwise
    assert found["x"][0] <= other["x"][0]
    assert found["x"][-1] > other["x"][-1] - 4
    np.testing.assert_allclose(np.diff(found["x"]), 4, rtol=1e-9)


def test_a_raster_that_has_nothing_where_the_flow_comes_is_told(folder):
    (scenario,) = load([written(folder, TEXT, NONE)])
    (folder / "dem.tif").unlink()
    write_raster(folder / "dem.tif", np.full((ROWS, COLUMNS), -9999.0))
    with pytest.raises(
        pipeline.BadInput, match=r"terrain\.elevation: expected elevations, found no data alone"
    ):
        domain_search.settled(scenario, None, lambda line: None)


def test_a_found_domain_of_too_many_points_is_told_before_they_are_made(folder, monkeypatch):
    (scenario,) = load([written(folder, TEXT, NONE)])
    lines = []
    monkeypatch.setattr("pipeline.runs.size.psutil.virtual_memory", lambda: SimpleNamespace(total=1000))
    domain_search.settled(scenario, None, lines.append)
    assert any("kB a run (this machine has 1 kB)" in line and "a larger spacing" in line for line in lines)
    monkeypatch.setattr(type(scenario.settings.points), "most", 500)
    monkeypatch.setattr(type(scenario), "within", None)
    with pytest.raises(
        pipeline.BadInput,
        match=r"points\.spacing: expected at most 500 points, found .* on the domain of the flow",
    ):
        domain_search.settled(scenario, None, lambda line: None)


def test_doubts_of_every_elevation_model_are_told_once_the_domain_is_found(folder):
    elevation = ground(ROWS, COLUMNS)
    elevation[78:80, 30] = -9999.0
    write_raster(folder / "later.tif", elevation)
    text = TEXT + "sweep: {terrain.elevation: [dem.tif, later.tif]}\nreceptors: huts.gpkg\n"
    (scenario,) = load([written(folder, text, NONE)])
    lines = []
    domain_search.settled(scenario, None, lines.append)
    assert [line for line in lines if "no data" in line] == [
        line for line in lines if ": later.tif: " in line
    ]
    assert any("of the domain have no data; what flows there has left" in line for line in lines)


def test_it_does_not_depend_on_how_many_runs_are_done_at_once(folder, monkeypatch):
    text = TEXT + "sweep: {material.bed_friction: [28, 26, 24, 22, 20, 18, 16]}\n"
    (scenario,) = load([written(folder, text, NONE)])
    alone = domain_search.settled(scenario, None, lambda line: None)
    simulate, threads = domain_search.simulate, set()

    def noting(*given, **named):
        threads.add(threading.get_ident())
        return simulate(*given, **named)

    monkeypatch.setattr(domain_search, "simulate", noting)
    together = domain_search.settled(scenario, None, lambda line: None, threads=2)
    assert len(threads) == 2
    assert together.settings.domain == alone.settings.domain
