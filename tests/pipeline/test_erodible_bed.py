"""Erodible beds from scenario files to stores, tables and hazard maps, on profiles and elevation models."""

import numpy as np
import pandas as pd
import pyogrio
import pytest
import rasterio
from commands import pipeline as command
from elevation_files import ROWS, SIDE, TEXT, ground, write_polygons, write_raster, written

import pipeline
from pipeline.hazard.differences import difference_layers
from pipeline.hazard.layers import layers
from pipeline.report.tables.receptors import sheets
from pipeline.runs.runs import expand, share
from pipeline.runs.scene_of_run import build_scene
from pipeline.scenario.scenario import load
from pipeline.scenario.sweep import coordinate_names
from pipeline.store.verify import verify
from pipeline.store.zarr_store import open_store

PROFILE = """\
name: bed
terrain: {profile: plane, angle: 28}
domain: {x: [0, 60], y: [-6, 6]}
points: {spacing: 1}
release: {shape: box, x: [4, 10], y: [-3, 3], height: 1}
material: {density: 2000, bed_friction: 20, earth_pressure: isotropic}
erodible_bed: {depth: 0.4, region: {x: [15, 40], y: [-4.5, 4.5]}, law: {model: growth-rate, growth: 0.03}}
time: {end: 6, output_every: 1}
output: {threshold: 0.01}
receptors:
  - {name: pier, polygon: [[18, -2], [22, -2], [22, 2], [18, 2]]}
  - {name: apart, point: [50, 5.5]}
"""
BED = "erodible_bed: {polygons: bed.gpkg, law: {model: growth-rate, growth: 0.02}}\n"


@pytest.fixture(scope="module")
def results(tmp_path_factory):
    """Runs over the erodible depth, the first with nothing to erode, a slow law, and one without a bed."""
    folder = tmp_path_factory.mktemp("bed")
    swept = "sweep: {erodible_bed.depth: [0.0, 0.02, 0.4]}\n"
    bare = "".join(line + "\n" for line in PROFILE.splitlines() if "erodible" not in line)
    slow = PROFILE.replace("growth: 0.03", "growth: 0.01")
    texts = {"bed": PROFILE + swept, "slow": slow + swept, "bare": bare}
    for name, text in texts.items():
        (folder / f"{name}.yaml").write_text(text.replace("name: bed", f"name: {name}"))
    out = folder / "results"
    pipeline.run([folder / f"{name}.yaml" for name in texts], out, workers=1, quiet=True)
    return out


@pytest.fixture
def store(results):
    with open_store(results / "bed.zarr") as opened:
        yield opened


@pytest.fixture
def folder(tmp_path):
    """Files of a scenario on an elevation model, with two reaches of loose bed."""
    write_raster(tmp_path / "dem.tif", ground())
    write_polygons(tmp_path / "releases.gpkg", {"slide": (20, -120, 50, -80)})
    boxes = {"upper": (60, -115, 100, -85), "lower": (120, -110, 162.5, -90)}
    write_polygons(tmp_path / "bed.gpkg", boxes, depth=0.6)
    return tmp_path


def laid(folder, *changes, more=BED):
    """Erodible depth of the first run of a scenario, and the area of its cells on the bed."""
    (scenario,) = load([written(folder, TEXT + more, *changes)])
    runs = expand(scenario)
    prepared = build_scene(runs[0], share(scenario, runs))
    x, y = prepared.scene.points.x_points, prepared.scene.points.y_points
    edges = [np.append(a - SIDE / 2, a[-1] + SIDE / 2) for a in (x, y)]
    z = prepared.terrain.corners(*edges)
    b_x = (z[1:, 1:] + z[:-1, 1:] - z[1:, :-1] - z[:-1, :-1]) / (2 * SIDE)
    b_y = (z[1:, 1:] + z[1:, :-1] - z[:-1, 1:] - z[:-1, :-1]) / (2 * SIDE)
    return prepared.scene.erodible_bed.depth, SIDE**2 * np.sqrt(1 + b_x**2 + b_y**2)


class TestStore:
    def test_holds_what_the_flow_took_up(self, store):
        depth, taken = store["erosion_depth"], store["volume_entrained"].to_numpy()
        held = depth.astype(float).sum(("y", "x")) * 1.0
        np.testing.assert_allclose(held, taken, rtol=1e-6)
        assert taken[0] == 0 < taken[1] < taken[2]
        np.testing.assert_array_equal(store["entrained"].isel(time=-1), taken)
        assert (store["entrained"].isel(time=0) == 0).all()
        np.testing.assert_allclose(store["erosion_max_depth"], depth.max(("y", "x")), rtol=1e-6)
        assert float(depth.isel(run=1).max()) == np.float32(0.02)

    def test_erodes_within_the_region_alone(self, store):
        outside = (store["x"] < 14.5) | (store["x"] > 40.5) | (abs(store["y"]) > 5)
        assert float(store["erosion_depth"].where(outside).max()) == 0

    def test_ledger_closes(self, store):
        assert float(abs(store["volume_error"]).max()) < 1e-14
        now = store["volume_released"] + store["volume_entrained"] - store["volume_out"]
        held = store["deposit_depth"].astype(float).sum(("y", "x"))
        np.testing.assert_allclose(held, now, rtol=1e-6)

    def test_change_of_the_ground_is_vertical(self, store):
        normal = store["deposit_depth"].astype(float) - store["erosion_depth"]
        np.testing.assert_allclose(store["bed_change"], normal / np.cos(np.radians(28)), rtol=1e-5, atol=1e-7)

    def test_a_bed_with_nothing_to_erode_is_no_bed(self, results, store):
        with open_store(results / "bare.zarr") as bare:
            for name in ("depth", "velocity_x", "max_speed", "arrival_time", "deposit_depth"):
                np.testing.assert_array_equal(bare[name].isel(run=0), store[name].isel(run=0), name)
            assert not {"erosion_depth", "bed_change", "entrained"} & set(bare.variables)
            assert bare["volume_entrained"].item() == 0
            assert np.isnan(bare["erosion_max_depth"].item())

    def test_is_as_it_was_written(self, results):
        assert verify(results / "bed.zarr").faults == ()

    def test_what_was_never_computed_is_missing(self, tmp_path):
        (tmp_path / "bed.yaml").write_text(
            PROFILE.replace("output_every: 1", "output_every: 1, max_steps: 9")
        )
        pipeline.run(tmp_path / "bed.yaml", tmp_path / "out", workers=1, quiet=True)
        with open_store(tmp_path / "out" / "bed.zarr") as failed:
            assert np.isnan(failed["entrained"].isel(time=-1).item())
            assert failed["entrained"].isel(time=0).item() == 0
            assert np.isnan(failed["erosion_max_depth"].item())
            # the last good state is told as it is
            assert np.isfinite(failed["erosion_depth"]).all()

    def test_fields_that_are_not_asked_for_are_not_kept(self, tmp_path):
        fields = "fields: [max_depth, max_speed, arrival_time, deposit_depth, erosion_depth]"
        text = PROFILE.replace("output: {", f"output: {{{fields}, ")
        (tmp_path / "bed.yaml").write_text(text)
        pipeline.run(tmp_path / "bed.yaml", tmp_path / "out", workers=1, quiet=True)
        with open_store(tmp_path / "out" / "bed.zarr") as store:
            assert "erosion_depth" in store
            assert not {"bed_change", "depth"} & set(store.variables)


class TestAssessment:
    def test_tables_have_quantiles_of_what_was_taken_up(self, results):
        tables = pipeline.assessment_tables(results)
        quantities = tables["scenarios"].groupby("scenario")["quantity"].agg(set)
        assert {"volume_entrained", "erosion_max_depth"} <= quantities["bed"]
        assert not {"volume_entrained", "erosion_max_depth"} & quantities["bare"]
        runs = tables["runs"].set_index(["scenario", "run"])["volume_entrained"]
        assert runs["bare", 0] == runs["bed", 0] == 0 < runs["bed", 1]

    def test_the_summary_has_what_was_taken_up(self, results):
        table = pd.read_csv(results / "summary.csv")
        assert {"erodible_bed_depth", "volume_entrained", "erosion_max_depth"} <= set(table.columns)

    def test_maps_of_the_depth_of_erosion(self, results, store):
        maps = pipeline.hazard_maps(results, erosion_depth=[0.01, 0.1])
        eroded = store["erosion_depth"].to_numpy()
        np.testing.assert_allclose(
            maps["bed"]["erosion_depth_exceedance"],
            [(eroded > limit).mean(axis=0) for limit in (0.01, 0.1)],
            rtol=1e-6,
        )
        median = maps["bed"]["erosion_depth_quantile"].sel(quantile=0.5)
        np.testing.assert_array_equal(median, np.sort(eroded, axis=0)[1])
        assert "erosion_depth_exceedance" not in maps["bare"]
        titles = {layer.name: layer.title for layer in layers(maps["bed"])}
        assert titles["erosion_depth_above_0.1"] == "share of runs with a depth of erosion above 0.1 m"
        assert titles["erosion_depth_quantile_0.5"] == "depth of erosion that 0.5 of the runs keep to"

    def test_maps_of_the_change_of_the_ground(self, results, store):
        maps = pipeline.hazard_maps(results)
        change = store["bed_change"].to_numpy().astype(float)
        assert change.min() < -0.05 < 0.05 < change.max()
        np.testing.assert_allclose(maps["bed"]["bed_change_mean"], change.mean(axis=0), rtol=1e-5, atol=1e-7)
        # runs that are cut off may have filled or eroded more
        known = np.isin(store["status"], (1, 3))
        assert not known.any()
        median = maps["bed"]["bed_change_quantile"].sel(quantile=0.5)
        np.testing.assert_allclose(median, np.sort(change, axis=0)[1], rtol=1e-6)
        for bound in ("_lower", "_upper"):
            assert np.isnan(maps["bed"][f"bed_change_quantile{bound}"]).all()
        assert "bed_change_mean" not in maps["bare"]
        listed = {layer.name: layer for layer in layers(maps["bed"])}
        shown = listed["bed_change_mean"]
        assert shown.title == "mean change of the ground's elevation"
        assert shown.style.caption == "change of the ground's elevation (m)"
        assert shown.style.edges[0] == -shown.style.edges[-1] <= change.mean(axis=0).min()

    def test_thresholds_of_erosion_without_an_erodible_bed_are_refused(self, results, tmp_path):
        alone = tmp_path / "results"
        alone.mkdir()
        (alone / "bare.zarr").symlink_to(results / "bare.zarr")
        shown = command("hazard", alone, "--erosion-depth", "0.5", "--no-maps")
        assert shown.exit_code == 2
        assert shown.stderr == "--erosion-depth: there is no depth of erosion: bare has no erodible_bed\n"
        assert not (alone / "hazard").exists()
        for names in (("bed", "bare"), ("bare", "bed")):
            with pytest.raises(pipeline.OptionError, match="there is no depth of erosion: bare has no erodi"):
                pipeline.compare(results, names, erosion_depth=[0.1])

    def test_receptors_are_told_what_was_eroded_there(self, results, store):
        rows = pipeline.assessment_tables(results)["receptor-runs"]
        pier = rows[(rows["scenario"] == "bed") & (rows["receptor"] == "pier")].sort_values("run")
        inside = (abs(store["x"] - 20) < 2.5) & (abs(store["y"]) < 2.5)
        depth, change = (store[name].where(inside) for name in ("erosion_depth", "bed_change"))
        np.testing.assert_allclose(pier["erosion_depth"], depth.max(("y", "x")), rtol=1e-6)
        np.testing.assert_allclose(pier["bed_change"], change.mean(("y", "x")), rtol=1e-5)
        assert pier["erosion_depth"].iloc[-1] > 0.1
        assert pier["bed_change"].iloc[-1] < 0
        assert rows[rows["scenario"] == "bare"]["erosion_depth"].isna().all()
        table = pipeline.assessment_tables(results)["receptors"].set_index(["scenario", "receptor"])
        row = table.loc["bed", "pier"]
        assert row["largest_erosion_depth"] == pier["erosion_depth"].max()
        assert row["median_bed_change"] == pier["bed_change"].median()
        assert row["lowest_bed_change"] == pier["bed_change"].min()
        with open_store(results / "bed.zarr") as opened:
            (sheet,) = [each for each in sheets(opened) if each.title == "pier"]
        assert [row[0] for row in sheet.rows[-2:]] == [
            "depth of erosion (m)", "change of the ground's elevation (m)"
        ]  # fmt: skip

    def test_scenarios_differ_in_what_was_eroded(self, results, store):
        maps, receptors, sections = pipeline.compare(results, ("slow", "bed"), erosion_depth=[0.01])
        with open_store(results / "slow.zarr") as slow:
            other = {name: slow[name].to_numpy().astype(float) for name in ("erosion_depth", "bed_change")}
        one = {name: store[name].to_numpy().astype(float) for name in other}
        share = [(each["erosion_depth"] > 0.01).mean(axis=0) for each in (other, one)]
        found = maps["erosion_depth_exceedance_difference"].to_numpy()[0]
        np.testing.assert_allclose(found, share[1] - share[0], atol=1e-6)
        assert found.max() > 0.3
        mean = maps["bed_change_mean_difference"]
        known = (one["bed_change"] - other["bed_change"]).mean(axis=0)
        np.testing.assert_allclose(mean, known, rtol=1e-4, atol=1e-6)
        names = {layer.name for layer in difference_layers(maps)}
        assert {"bed_change_mean_difference", "erosion_depth_above_0.01_difference"} <= names
        rows = receptors.set_index(["receptor", "quantity"])
        row = rows.loc["pier", "largest_erosion_depth"]
        assert row["difference"] == row["second"] - row["first"] > 0
        # what moves on may erode more, and nothing less
        assert row["first_lower"] == row["first"]
        assert np.isnan(row["first_upper"])
        assert np.isnan(rows.loc["pier", "lowest_bed_change"]["first_lower"])
        assert rows.loc["apart", "largest_erosion_depth"]["second"] == 0
        assert not len(sections)

    def test_what_only_one_scenario_has_is_told(self, results):
        maps, receptors, _ = pipeline.compare(results, ("bed", "bare"))
        told = (
            "no depth of erosion and no change of the ground's elevation compared: bare has no erodible_bed"
        )
        assert told in maps.attrs["comment"]
        assert not receptors["quantity"].str.contains("erosion").any()
        assert not [name for name in maps if "erosion" in str(name)]


class TestOnElevationModels:
    def test_polygons_hold_their_volume(self, folder):
        depth, _ = laid(folder)
        # 40 by 30 m and 42.5 by 20 m of 0.6 m, by the area on the bed
        inside = depth / 0.6
        assert (inside * SIDE**2).sum() == pytest.approx(40 * 30 + 42.5 * 20, rel=1e-12)
        assert set(np.round(np.unique(inside), 9)) == {0.0, 0.5, 1.0}

    def test_vertical_depths_hold_the_volume_in_plan(self, folder):
        depth, area = laid(folder, ("law:", "measured: vertical, law:"))
        assert (depth * area).sum() == pytest.approx(0.6 * (40 * 30 + 42.5 * 20), rel=1e-12)
        normal, _ = laid(folder)
        assert (depth[normal > 0] < normal[normal > 0]).all()

    def test_one_polygon_and_a_depth_for_all(self, folder):
        depth, _ = laid(folder, ("law:", "name: lower, depth: 0.25, law:"))
        assert depth.sum() * SIDE**2 == pytest.approx(0.25 * 42.5 * 20, rel=1e-12)

    def test_a_raster_of_depths_within_polygons(self, folder):
        x = np.arange(60)
        depths = np.tile(np.where(x < 20, 0.01 * x, -9999.0), (ROWS, 1))
        write_raster(folder / "depth.tif", depths)
        everywhere, _ = laid(folder, ("polygons: bed.gpkg", "depth: depth.tif"))
        np.testing.assert_allclose(everywhere[:, :20], np.tile(0.01 * x[:20], (ROWS, 1)), atol=1e-12)
        assert not everywhere[:, 20:].any()
        within, _ = laid(folder, ("polygons: bed.gpkg", "polygons: bed.gpkg, depth: depth.tif"))
        np.testing.assert_allclose(within[20, 12:20], 0.01 * x[12:20], atol=1e-12)
        assert not within[:, :12].any()

    def test_the_content_of_the_files_is_part_of_the_scenario(self, folder):
        first = load([written(folder, TEXT + BED)])[0].digest
        write_polygons(folder / "bed.gpkg", {"upper": (60, -115, 100, -85)}, depth=0.7)
        assert load([written(folder, TEXT + BED)])[0].digest != first

    def test_runs_end_with_what_was_eroded(self, folder):
        out = folder / "results"
        pipeline.run(written(folder, TEXT + BED), out, workers=1, quiet=True)
        with open_store(out / "small.zarr") as store:
            one, plan = store.isel(run=0), SIDE**2
            taken = one["volume_entrained"].item()
            assert taken > 1
            eroded = one["erosion_depth"].astype(float)
            assert float((eroded * one["area"]).sum()) == pytest.approx(taken, rel=1e-6)
            now = one["volume_released"].item() + taken - one["volume_out"].item()
            assert float(one["bed_change"].astype(float).sum()) * plan == pytest.approx(now - taken, rel=1e-5)
            assert store["erosion_depth"].attrs["grid_mapping"] == "spatial_ref"
            assert abs(one["volume_error"].item()) < 1e-13
        maps = pipeline.hazard_maps(out, to=folder / "maps")
        assert float(maps["small"]["erosion_depth_quantile"].max()) == pytest.approx(float(eroded.max()))
        with rasterio.open(folder / "maps" / "small" / "bed_change_mean.tif") as raster:
            held = raster.read(1)
        np.testing.assert_allclose(np.nanmin(held), one["bed_change"].min(), rtol=1e-6)
        np.testing.assert_allclose(np.nanmax(held), one["bed_change"].max(), rtol=1e-6)
        assert np.nanmin(held) < 0
        listed = pyogrio.list_layers(folder / "maps" / "small" / "maps.gpkg")[:, 0].tolist()
        assert {"bed_change_mean", "bed_change_quantile_0.5"} <= {*listed}


def test_parameters_of_a_bed_have_names_of_their_own():
    keys = ("erodible_bed.depth", "erodible_bed.law.rate")
    assert list(coordinate_names(keys).values()) == ["erodible_bed_depth", "rate"]
