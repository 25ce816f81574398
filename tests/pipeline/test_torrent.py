"""A small elevation model, from a scenario file to a store, tables, hazard maps and a report."""

import json

import numpy as np
import pandas as pd
import pyogrio
import pytest
import rasterio
import rioxarray  # noqa: F401 - gives arrays their reference system
import shapely
import xarray as xr
from commands import pipeline as command
from elevation_files import (
    COLUMNS,
    DOMAIN,
    NORTH,
    ROWS,
    SIDE,
    TEXT,
    WEST,
    ground,
    write_polygons,
    write_raster,
    written,
)
from few_pictures import drawn_once
from rasterio.transform import from_origin
from root import ROOT

import pipeline
from pipeline.errors import BadInput
from pipeline.report.comparison import draw
from pipeline.runs.runs import expand, share
from pipeline.runs.scene_of_run import build_scene
from pipeline.scenario.scenario import load
from pipeline.store.verify import verify
from pipeline.studies import torrent_terrain


@pytest.fixture
def folder(tmp_path):
    """Folder of a scenario's files."""
    write_raster(tmp_path / "dem.tif", ground())
    write_polygons(tmp_path / "releases.gpkg", {"slide": (20, -120, 50, -80), "other": (20, -60, 40, -45)})
    write_polygons(tmp_path / "buildings.gpkg", {"barn": (110, -105, 120, -95), "far": (5000, 0, 5010, 9)})
    return tmp_path


def refused(folder, *changes):
    with pytest.raises(BadInput) as caught:
        load([written(folder, TEXT, *changes)])
    (line,) = str(caught.value).splitlines()
    return line


@pytest.fixture(scope="module")
def place(tmp_path_factory):
    """Results of a small sweep and a sample, as a user gets them."""
    folder = tmp_path_factory.mktemp("torrent")
    write_raster(folder / "dem.tif", ground())
    write_polygons(folder / "releases.gpkg", {"slide": (20, -120, 50, -80)})
    write_polygons(folder / "buildings.gpkg", {"barn": (110, -105, 120, -95), "hut": (270, -20, 280, -10)})
    more = """\
sweep: {release.volume: [1000, 2500]}
return_periods: {release.volume: [30, 300]}
sample: {design: latin-hypercube, count: 2, seed: 1, values: {material.bed_friction:
  {distribution: uniform, lower: 14, upper: 18}}}
receptors: buildings.gpkg
"""
    out = folder / "results"
    pipeline.run(written(folder, TEXT + more), out, workers=1, quiet=True)
    return out


@pytest.fixture(scope="module")
def maps(place):
    """Hazard maps of these results as the second of two commands writes them, and their folder."""
    done = command("report", place, "--maps")
    assert done.exit_code == 0, done.output
    folder = place / "hazard" / "small"
    for beside in (place / "hazard" / "hazard.qgs", folder / "hazard_level.png", place / "report.html"):
        assert f"{beside}\n" in done.stdout
    with xr.open_dataset(folder / "hazard.nc") as found:
        return {"small": found.load()}, folder


class TestStore:
    def test_lies_on_the_cells_of_the_elevation_model(self, place):
        with xr.open_zarr(place / "small.zarr", consolidated=False) as store:
            np.testing.assert_array_equal(store["x"], WEST + SIDE * (np.arange(COLUMNS) + 0.5))
            np.testing.assert_array_equal(store["y"][::-1], NORTH - SIDE * (np.arange(ROWS) + 0.5))
            np.testing.assert_array_equal(store["elevation"], ground()[::-1])
            assert store["elevation"].dims == store["area"].dims == ("y", "x")
            assert store["x"].attrs["standard_name"] == "projection_x_coordinate"
            assert store["max_depth"].attrs["grid_mapping"] == "spatial_ref"
            assert "LV95" in store["spatial_ref"].attrs["crs_wkt"]
            assert store["max_depth"].rio.crs.to_epsg() == 2056
            assert not [name for name, v in store.variables.items() if "arc length" in str(v.attrs)]

    def test_volumes_are_by_the_area_of_the_bed(self, place):
        with xr.open_zarr(place / "small.zarr", consolidated=False) as store:
            held = (store["depth"].isel(time=0).astype(float) * store["area"]).sum(("y", "x"))
            np.testing.assert_allclose(held, store["volume_released"], rtol=1e-6)
            np.testing.assert_allclose(store["volume_released"], [1000, 1000, 2500, 2500], rtol=1e-12)
            assert float(abs(store["volume_error"]).max()) < 1e-14
            assert float(store["area"].min()) >= SIDE**2
            vertical = store["depth"].isel(time=0).astype(float) * store["vertical_extent"]
            np.testing.assert_allclose(vertical.sum(("y", "x")) * SIDE**2, held, rtol=1e-12)

    def test_reach_and_drop_are_from_the_crown_to_the_toe(self, place):
        with xr.open_zarr(place / "small.zarr", consolidated=False) as store:
            one = store.isel(run=3).load()
        z, deposit = one["elevation"].to_numpy(), one["deposit_depth"].to_numpy() > 0.05
        release = one["depth"].isel(time=0).to_numpy() > 0
        crown = np.unravel_index(np.where(release, z, -np.inf).argmax(), z.shape)
        toe = np.unravel_index(np.where(deposit, z, np.inf).argmin(), z.shape)
        runout = SIDE * np.hypot(crown[0] - toe[0], crown[1] - toe[1])
        # the toe is one of two cells beside the middle of the valley
        assert abs(float(one["runout_distance"]) - runout) < SIDE
        assert float(one["drop_height"]) == pytest.approx(z[crown] - z[toe])
        angle = np.degrees(np.arctan2(float(one["drop_height"]), float(one["runout_distance"])))
        assert float(one["reach_angle"]) == pytest.approx(angle)
        assert float(one["deposit_area"]) == SIDE**2 * deposit.sum()
        assert float(one["affected_area"]) == SIDE**2 * (one["max_depth"] > 0.05).sum()
        assert float(one["lowest_elevation"]) <= z[toe]
        straight = np.hypot(float(one["flow_runout_distance"]), z[crown] - float(one["lowest_elevation"]))
        assert straight < float(one["flow_path_length"]) < 1.2 * straight
        assert np.isnan([float(one[name]) for name in ("front_x", "deposit_length", "flow_front_x")]).all()

    def test_is_verified_and_nothing_is_left_to_do(self, place):
        assert verify(place / "small.zarr").faults == ()
        table = pipeline.run_table(place)
        assert table["status"].isin(["done", "done_but_overrun", "cut_off"]).all()
        assert (table["runout_distance"] > 50).all()


class TestMaps:
    def test_a_geotiff_is_the_lattice_itself(self, maps, place):
        found, folder = maps
        depth = found["small"]["depth_quantile"].isel(quantile=-1).to_numpy()
        with rasterio.open(folder / "depth_quantile_0.9.tif") as raster:
            assert raster.crs.to_epsg() == 2056
            assert raster.transform == from_origin(WEST, NORTH, SIDE, SIDE)
            np.testing.assert_array_equal(raster.read(1), depth[::-1])
            # deepest where the store says it is, by GDAL's own coordinates
            row, column = np.unravel_index(raster.read(1).argmax(), raster.shape)
            x, y = raster.xy(row, column)
        with xr.open_zarr(place / "small.zarr", consolidated=False) as store:
            at = store["max_depth"].sel(x=x, y=y, method="nearest", tolerance=1e-6)
            assert float(at.max()) >= depth.max() > 0

    def test_netcdf_has_a_grid_mapping(self, maps):
        with xr.open_dataset(maps[1] / "hazard.nc", decode_coords="all") as found:
            assert found["depth_exceedance"].rio.crs.to_epsg() == 2056
            assert found["elevation"].dims == ("y", "x")

    def test_outlines_are_where_the_flow_is(self, maps):
        _, _, shapes, _ = pyogrio.raw.read(maps[1] / "maps.gpkg", layer="depth_above_0.5")
        bounds = shapely.total_bounds(shapely.from_wkb(shapes))
        assert (bounds[:2] > (WEST, NORTH - SIDE * ROWS)).all()
        assert (bounds[2:] < (WEST + SIDE * COLUMNS, NORTH)).all()

    def test_pictures_and_report_are_drawn(self, maps, place):
        assert (maps[1] / "hazard_level.png").stat().st_size > 20_000
        page = (place / "report.html").read_text()
        assert "hazard" in page
        assert "barn" in page

    def test_tables_have_receptors_of_the_file(self, place):
        tables = pipeline.assessment_tables(place)
        rows = tables["receptors"].set_index("receptor")
        assert set(rows.index) == {"barn", "hut"}
        assert rows.loc["barn", "probability"] > 0
        assert rows.loc["hut", "probability"] == 0
        assert {"lowest_elevation", "lifted_share"} <= set(tables["scenarios"]["quantity"])
        assert "deposit_length" not in set(tables["scenarios"]["quantity"])


def test_what_comes_to_no_data_has_left_and_scenarios_are_laid_over_each_other(folder):
    elevation = ground()
    elevation[:, 25:30] = -9999.0
    write_raster(folder / "dem.tif", elevation)
    files = [written(folder)]
    files.append(files[0].with_name("other.yaml"))
    files[1].write_text(TEXT.replace("name: small", "name: other").replace("friction: 16", "friction: 14"))
    out = folder / "results"
    told = []
    results = pipeline.run(files, out, workers=1, quiet=True, warn=told.append)
    assert "8.3 % of the domain have no data" in told[0]
    table = results.table.set_index("scenario")
    assert (table["status"] == "done_but_overrun").all()
    assert (table["volume_out_open"] > 0.1 * table["volume_released"]).all()
    np.testing.assert_allclose(table["share_out"], table["volume_out_open"] / table["volume_released"])
    assert table["volume_error"].abs().max() < 1e-14
    gap = np.isnan(results["small"]["elevation"]).to_numpy()
    assert (gap == np.isin(np.arange(COLUMNS), range(25, 30))).all()
    # nothing flows beyond
    assert float(results["small"]["max_depth"].isel(x=slice(31, None)).max()) == 0
    with drawn_once():
        maps = pipeline.hazard_maps(results, to=folder / "maps")
    assert set(maps) == {"small", "other", "all scenarios"}
    assert maps["all scenarios"].attrs["crs"] == "EPSG:2056"


@pytest.fixture(scope="module")
def observed(place, tmp_path_factory):
    """The deposit of one of the runs as if it had been observed, as outline and as depths."""
    folder = tmp_path_factory.mktemp("observed")
    with xr.open_zarr(place / "small.zarr", consolidated=False) as store:
        deposit = store["deposit_depth"].isel(run=2).astype(float).load()
    cells = [
        shapely.box(x, y, x + SIDE, y + SIDE)
        for y, x in np.argwhere(deposit.to_numpy() > 0.05) * SIDE + (NORTH - SIDE * ROWS, WEST)
    ]
    whole = np.array([shapely.to_wkb(shapely.union_all(cells))], dtype=object)
    pyogrio.raw.write(
        folder / "outline.gpkg", whole, [np.array(["seen"], dtype=object)], ["name"], crs="EPSG:2056",
        geometry_type="MultiPolygon" if shapely.union_all(cells).geom_type != "Polygon" else "Polygon",
    )  # fmt: skip
    write_raster(folder / "depth.tif", deposit.to_numpy()[::-1])
    deposit.rename("depth").drop_vars([c for c in deposit.coords if c not in ("x", "y")]).to_netcdf(
        folder / "depth.nc"
    )
    return folder


class TestCalibration:
    """The deposit of one of the runs as if it had been observed."""

    @pytest.mark.parametrize("name", ["outline.gpkg", "depth.tif", "depth.nc"])
    def test_finds_the_run_again(self, place, observed, name):
        scores = pipeline.calibrate(place / "small.zarr", observed / name)["scores"].set_index("run")
        assert scores.index[0] == 2
        assert scores.loc[2, "critical_success_index"] == 1
        assert scores.loc[2, "runout_misfit"] == 0
        # less volume with much the same friction stops higher up
        assert scores.loc[0, "runout_misfit"] < 0
        assert scores.loc[0, "critical_success_index"] < 1
        if name != "outline.gpkg":
            assert abs(scores.loc[2, "volume_misfit"]) < 1e-6
            assert scores.loc[0, "volume_misfit"] < -0.3

    def test_a_deposit_elsewhere_is_refused(self, place, folder):
        write_polygons(folder / "far.gpkg", {"seen": (5000, -100, 5050, -50)})
        with pytest.raises(ValueError, match="is outside the domain of small"):
            pipeline.calibrate(place / "small.zarr", folder / "far.gpkg")


def test_runs_are_compared_in_figures(place, tmp_path):
    names = {path.name for path in draw(place, tmp_path)}
    assert {"terrain.png", "depth-small-0.png", "volume-error.png", "comparison.csv"} <= names
    assert not {"profile.png", "points.png"} & names
    table = pd.read_csv(tmp_path / "comparison.csv")
    assert (table["volume_error"].abs() < 1e-6).all()
    with xr.open_zarr(place / "small.zarr", consolidated=False) as store:
        frame = store.isel(time=-1)
        body = frame["depth"] > 0.05
        np.testing.assert_allclose(table["body_area"], SIDE**2 * body.sum(("y", "x")))
        np.testing.assert_allclose(
            table["lowest_elevation"], frame["elevation"].where(body).min(("y", "x")), rtol=1e-12
        )


def test_depth_and_the_curvature_length_can_be_varied(folder):
    varied = (
        "time:",
        "sweep: {terrain.curvature_length: [0, 40], release.name: [slide, other]}\n"
        "sample: {count: 2, values: {release.depth: {distribution: uniform, lower: 1, upper: 2}}}\ntime:",
    )
    scenario = load([written(folder, TEXT, varied)])[0]
    runs = expand(scenario)
    assert len(runs) == 8
    shared = share(scenario, runs[:1])
    prepared = [build_scene(run, shared) for run in runs]
    assert [each.terrain.curvature_length for each in prepared] == [0] * 4 + [40] * 4
    for run, each in zip(runs, prepared, strict=True):
        assert each.scene.depth.max() == pytest.approx(run.parameters["release_depth"])
    # one raster for all runs
    assert len({id(each.terrain.elevation) for each in prepared}) == 1


class TestAttributes:
    """Of the polygons: name, volume and return period."""

    SWEEP = ("time:", "return_periods: polygons\nsweep: {release.name: [small, large]}\ntime:")
    SMALL = ("name: slide", "name: small")

    @pytest.fixture
    def attributed(self, folder):
        def write(periods=(30.0, 300.0)):
            boxes = [shapely.box(WEST + 20, NORTH - 120, WEST + e, NORTH - 80) for e in (40, 60)]
            fields = {"name": ["small", "large"], "volume": [500.0, 2000.0], "return_period": list(periods)}
            pyogrio.raw.write(
                folder / "releases.gpkg", np.array(shapely.to_wkb(boxes), dtype=object),
                [np.array(v, dtype=object if k == "name" else float) for k, v in fields.items()],
                list(fields), crs="EPSG:2056", geometry_type="Polygon",
            )  # fmt: skip
            return folder

        return write

    def test_are_used_and_swept(self, attributed):
        (scenario,) = load([written(attributed(), TEXT, self.SWEEP, self.SMALL)])
        assert scenario.settings.return_periods == (30.0, 300.0)
        runs = expand(scenario)
        shared = share(scenario, runs[:1])
        laid = [build_scene(run, shared).volume_laid for run in runs]
        np.testing.assert_allclose(laid, [500, 2000], rtol=1e-12)

    def test_of_volume_are_part_of_what_decides(self, attributed):
        before = load([written(attributed(), TEXT, self.SWEEP, self.SMALL)])[0]
        assert (
            load([written(attributed((10.0, 20.0)), TEXT, self.SWEEP, self.SMALL)])[0].digest == before.digest
        )

    def test_without_a_return_period_is_refused(self, attributed):
        line = refused(attributed((30.0, np.nan)), self.SWEEP, self.SMALL)
        assert "expected an attribute return_period of each polygon above 0" in line
        assert "found 'large' whose attribute return_period is empty" in line

    def test_of_several_return_periods_in_a_run_are_refused(self, attributed):
        all_of_them = ("time:", "return_periods: polygons\ntime:"), (", name: slide", "")
        line = refused(attributed(), *all_of_them)
        assert "expected polygons of one return period in each run, found 30 and 300" in line

    def test_are_of_elevation_models_alone(self, folder):
        text = TEXT.replace("{elevation: dem.tif, curvature_length: 20}", "{profile: plane, angle: 20}")
        text = text.replace(
            "polygons: releases.gpkg, name: slide", "shape: box, x: [1, 2], y: [1, 2], height: 1"
        )
        line = refused_text(folder, text.replace(DOMAIN, "domain: {x: [0, 9], y: [0, 9]}"))
        assert "expected numbers, as polygons need an elevation model" in line


def refused_text(folder, text):
    with pytest.raises(BadInput) as caught:
        load([written(folder, text + "return_periods: polygons\n")])
    return str(caught.value)


def test_depth_may_be_measured_vertically(folder):
    plan = 30 * 40 * 1.5
    volumes = [
        build_scene(runs[0], share(scenario, runs[:1])).volume_laid
        for measured in ("normal", "vertical")
        for scenario in load([written(folder, TEXT, ("name: slide", f"name: slide, measured: {measured}"))])
        for runs in [expand(scenario)]
    ]
    assert volumes[1] == pytest.approx(plan)
    assert volumes[0] > 1.05 * plan


def test_the_hash_of_both_files_is_part_of_a_scenario(folder):
    before = load([written(folder)])[0]
    write_polygons(folder / "releases.gpkg", {"slide": (20, -120, 50, -80)}, depth=1.6)
    deeper = load([written(folder)])[0]
    elevation = ground()
    elevation[3, 50] += 0.01
    write_raster(folder / "dem.tif", elevation)
    rougher = load([written(folder)])[0]
    assert len({before.digest, deeper.digest, rougher.digest}) == 3
    # what a scenario has nothing of is no part of it
    assert "each" not in json.loads(before.content)["release"]


def test_a_domain_is_moved_on_to_the_cells(folder):
    wanted = f"domain: {{x: [{WEST + 1}, {WEST + 203}], y: [{NORTH - 180}, {NORTH - 20}]}}"
    domain = load([written(folder, TEXT, (DOMAIN, wanted))])[0].settings.domain
    assert domain.x == (WEST + 2.5, WEST + 202.5)
    assert domain.y == (NORTH - 177.5, NORTH - 22.5)


def test_places_of_a_file_outside_the_domain_are_left_out_and_told(folder):
    scenario = load([written(folder, TEXT + "receptors: buildings.gpkg\n")])[0]
    assert [each.name for each in scenario.settings.places] == ["barn"]
    assert "of 2 places of buildings.gpkg 1 lie outside the domain" in "\n".join(scenario.warnings)


class TestMistakes:
    def test_a_missing_file(self, folder):
        assert "terrain.elevation: expected a readable file, found none" in refused(
            folder, ("dem.tif", "no.tif")
        )

    def test_degrees(self, folder):
        write_raster(folder / "dem.tif", ground(), 1e-4, "EPSG:4326")
        assert "found a reference system in degrees" in refused(folder)

    def test_no_reference_system(self, folder):
        write_raster(folder / "dem.tif", ground(), crs=None)
        assert "expected a reference system, found none in the file" in refused(folder)
        assert load([written(folder, TEXT, ("dem.tif", 'dem.tif, crs: "EPSG:2056"'))])

    def test_a_release_outside(self, folder):
        write_polygons(folder / "releases.gpkg", {"slide": (900, 0, 950, 50)})
        line = refused(folder)
        assert "release: expected a release in the domain" in line
        assert "found 'slide' of releases.gpkg outside" in line

    def test_a_release_on_no_data(self, folder):
        elevation = ground()
        elevation[10:30, :15] = -9999.0
        write_raster(folder / "dem.tif", elevation)
        assert "where there is data, found 'slide'" in refused(folder)

    def test_a_release_partly_outside_is_warned_of(self, folder):
        write_polygons(folder / "releases.gpkg", {"slide": (-30, -120, 30, -80)})
        warnings = load([written(folder)])[0].warnings
        assert "50 % of 'slide' of releases.gpkg lie outside the domain" in "\n".join(warnings)

    def test_a_polygon_below_a_cell(self, folder):
        write_polygons(folder / "releases.gpkg", {"slide": (20, -100, 24, -96)})
        assert "expected polygons of a cell, 25 m2, or more, found 'slide'" in refused(folder)

    def test_an_unknown_polygon(self, folder):
        assert "expected one of the polygons slide, other, found 'slid'" in refused(
            folder, ("name: slide", "name: slid")
        )

    def test_no_depth(self, folder):
        write_polygons(folder / "releases.gpkg", {"slide": (20, -120, 50, -80)}, depth=np.nan)
        assert "an attribute depth or volume of each polygon above 0, found 'slide'" in refused(folder)

    def test_a_domain_beyond_the_elevation_model(self, folder):
        wanted = f"domain: {{x: [{WEST - 50}, {WEST + 200}], y: [{NORTH - 180}, {NORTH - 20}]}}"
        assert "expected a domain on the elevation model, which covers x from 2600000" in refused(
            folder, (DOMAIN, wanted)
        )

    def test_a_fine_spacing_is_warned_of(self, folder):
        warnings = load([written(folder, TEXT, ("spacing: 5", "spacing: 1"))])[0].warnings
        assert "more than 4 times finer than the elevation model of 5 m" in "\n".join(warnings)

    def test_elevation_models_in_several_reference_systems(self, folder):
        swept = ("time:", "sweep: {terrain.elevation: [dem.tif, dem2.tif]}\ntime:")
        write_raster(folder / "dem2.tif", ground(), crs="EPSG:32632")
        line = refused(folder, swept)
        assert (
            "expected elevation models in one reference system, EPSG:2056, found EPSG:32632 (dem2.tif)"
            in line
        )
        assert line.split(": ")[1] == "sweep.terrain.elevation.1"

    def test_an_elevation_model_of_a_sweep_that_does_not_cover_the_domain(self, folder):
        swept = ("time:", "sweep: {terrain.elevation: [dem.tif, dem2.tif]}\ntime:")
        write_raster(folder / "dem2.tif", ground()[:, :50])
        assert "expected a domain on the elevation model, which covers x from" in refused(folder, swept)

    @pytest.mark.parametrize(
        ("change", "words"),
        [
            (("spacing: 5", "layout: poisson-disc, count: 100"), "expected a spacing on an elevation model"),
            (
                ("isotropic}", "mohr-coulomb, internal_friction: 30}"),
                "expected isotropic or mohr-coulomb-flow on an elevation model, found mohr-coulomb",
            ),
            (("time:", "boundaries: {x_min: wall}\ntime:"), "expected open"),
            (("time:", "scheme: {form: collocation}\ntime:"), "expected form weighted-residual"),
            (
                ("polygons: releases.gpkg, name: slide", "shape: box, x: [1, 2], y: [1, 2], height: 1"),
                "polygons",
            ),
        ],
    )
    def test_what_is_not_supported(self, folder, change, words):
        assert words in refused(folder, change)


def test_mohr_coulomb_pressure_along_the_flow_runs_on_an_elevation_model(folder):
    both = "sweep: {material.earth_pressure: [isotropic, mohr-coulomb-flow]}\n"
    phi = ("isotropic}", "isotropic, internal_friction: 35}")
    pipeline.run(written(folder, TEXT + both, phi), folder / "results", workers=1, quiet=True)
    table = pipeline.run_table(folder / "results")
    assert table["status"].isin(["done", "done_but_overrun", "cut_off"]).all()
    assert (abs(table["volume_error"]) < 1e-14).all()
    with xr.open_zarr(folder / "results" / "small.zarr", consolidated=False) as store:
        isotropic, flow = store["max_depth"].to_numpy()
    assert 0.05 < np.abs(flow - isotropic).max() < 0.5 * isotropic.max()


def test_polygons_and_files_of_receptors_need_an_elevation_model(folder):
    plane = ("{elevation: dem.tif, curvature_length: 20}", "{profile: plane, angle: 20}")
    assert "polygons need an elevation model" in refused(folder, plane)


def test_the_shipped_scenario_is_that_of_its_command(tmp_path):
    shipped = ROOT / "scenarios" / "torrent"
    torrent_terrain.write(tmp_path)
    made, held = (load([folder / "torrent.yaml"])[0] for folder in (_copied(shipped, tmp_path), shipped))
    assert json.loads(made.content) == json.loads(held.content)
    assert [each.name for each in held.settings.places] == [name for name, _, _ in torrent_terrain.HOUSES]


def _copied(shipped, folder):
    (folder / "torrent.yaml").write_text((shipped / "torrent.yaml").read_text())
    return folder


PRESSURE = "earth_pressure: isotropic"
ROUGH = (PRESSURE, f"{PRESSURE}, zones: [{{polygon: forest.gpkg, bed_friction: 30}}]")


def test_friction_differs_in_the_polygons_of_a_file(folder):
    write_polygons(folder / "forest.gpkg", {"wood": (100, -150, 202.5, -50), "other": (190, -90, 260, -50)})
    (scenario,) = load([written(folder, TEXT, ROUGH)])
    run = expand(scenario)[0]
    scene = build_scene(run, share(scenario, [run])).scene
    (zone,) = scene.zones
    assert zone.friction.bed_friction == 30
    # overlapping polygons of a layer count once
    area = 25 * zone.share.sum()
    assert area == pytest.approx(102.5 * 100 + (260 - 202.5) * 40, rel=1e-12)
    assert set(np.unique(zone.share)) == {0.0, 0.5, 1.0}
    # what the polygons are is part of the scenario
    (before,) = load([written(folder, TEXT, ROUGH)])
    write_polygons(folder / "forest.gpkg", {"wood": (100, -150, 200, -50)})
    (after,) = load([written(folder, TEXT, ROUGH)])
    assert before.digest == scenario.digest != after.digest


def test_erosion_differs_in_the_polygons_of_a_file(folder):
    write_polygons(folder / "forest.gpkg", {"wood": (100, -150, 202.5, -50), "other": (190, -90, 260, -50)})
    law = "law: {model: growth-rate, growth: 0.01}"
    bed = f"erodible_bed: {{depth: 1, {law}, zones: [{{polygon: forest.gpkg, name: wood, growth: 0.001}}]}}"
    (scenario,) = load([written(folder, TEXT, ("release:", f"{bed}\nrelease:"))])
    run = expand(scenario)[0]
    held = build_scene(run, share(scenario, [run])).scene.erodible_bed
    (zone,) = held.zones
    assert 25 * zone.share.sum() == pytest.approx(102.5 * 100, rel=1e-12)
    assert set(np.unique(held.coefficients[0])) == {0.001, 0.0055, 0.01}
    missing = ("release:", f"{bed.replace('wood', 'would')}\nrelease:")
    assert "erodible_bed.zones.0.polygon: expected one of the polygons" in refused(folder, missing)


def test_a_forest_ahead_of_a_slide_stops_it_earlier(folder):
    write_polygons(folder / "forest.gpkg", {"wood": (90, -200, 300, 0)})
    written(folder, TEXT, ROUGH)
    (folder / "bare.yaml").write_text(TEXT.replace("name: small", "name: bare"))
    results = folder / "results"
    pipeline.run([folder / "small.yaml", folder / "bare.yaml"], results, workers=1, quiet=True)
    table = pipeline.run_table(results).set_index("scenario")
    assert set(table["status"]) <= {"done", "cut_off"}
    assert table.loc["small", "runout_distance"] < table.loc["bare", "runout_distance"] - 5


def test_zones_of_files_that_are_not_there_or_hold_no_such_polygon_are_refused(folder):
    assert "expected a readable file, found none" in refused(folder, ROUGH)
    write_polygons(folder / "forest.gpkg", {"wood": (100, -150, 200, -50), "far": (9000, 0, 9100, 100)})
    far = (ROUGH[0], ROUGH[1].replace("forest.gpkg", "forest.gpkg, name: far"))
    assert "expected a zone in the domain, found one outside" in refused(folder, far)
    named = (ROUGH[0], ROUGH[1].replace("forest.gpkg", "forest.gpkg, name: heath"))
    assert "expected one of the polygons wood, far, found 'heath'" in refused(folder, named)


def test_a_raster_of_classes_makes_zones_too(folder):
    land = np.zeros((ROWS, COLUMNS))
    land[10:20, 20:30], land[25:30, 20:30] = 3, 7
    write_raster(folder / "land.tif", land)
    zones = "zones: [{raster: land.tif, bed_friction: 30}, {raster: land.tif, value: 7, bed_friction: 35}]"
    (scenario,) = load([written(folder, TEXT, (PRESSURE, f"{PRESSURE}, {zones}"))])
    run = expand(scenario)[0]
    scene = build_scene(run, share(scenario, [run])).scene
    # rows of the raster go from north to south; the later zone lies over the first
    np.testing.assert_array_equal(scene.zones[0].share, 1.0 * (land[::-1] == 3))
    np.testing.assert_array_equal(scene.zones[1].share, 1.0 * (land[::-1] == 7))
    assert scene.zones[1].friction.bed_friction == 35
    # classes that are stored as something else
    write_raster(folder / "land.tif", land - 1)
    with rasterio.open(folder / "land.tif", "r+") as raster:
        raster.offsets = (1.0,)
    (again,) = load([written(folder, TEXT, (PRESSURE, f"{PRESSURE}, {zones}"))])
    assert again.digest == scenario.digest
    unknown = (PRESSURE, f"{PRESSURE}, {zones.replace('7', '5')}")
    assert "expected one of the polygons 3, 7, found '5'" in refused(folder, unknown)
    write_raster(folder / "land.tif", land + 0.5)
    assert "expected whole numbers as classes" in refused(folder, (PRESSURE, f"{PRESSURE}, {zones}"))
    (folder / "land.tif").write_bytes((folder / "land.tif").read_bytes()[:9000])
    assert "a raster of classes, found one which cannot" in refused(
        folder, (PRESSURE, f"{PRESSURE}, {zones}")
    )
