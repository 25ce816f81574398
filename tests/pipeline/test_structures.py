"""Structures from a scenario file to a store, receptors and maps, and two scenarios beside each other."""

import json

import numpy as np
import pandas as pd
import pyogrio
import pytest
import rasterio
import shapely
import xarray as xr
from rasterio.transform import from_origin
from typer.testing import CliRunner

import pipeline
from pipeline.assess.ensemble import NotTogetherError
from pipeline.cli.app import app
from pipeline.errors import BadInput
from pipeline.hazard.differences import FILE, TABLE
from pipeline.hazard.intensity import UNKNOWN
from pipeline.scenario.scenario import load

WEST, SOUTH, SIDE = 2_600_000.0, 1_200_000.0, 4.0
ROWS, COLUMNS = 40, 60
TEXT = """\
name: {name}
terrain: {{elevation: dem.tif, curvature_length: 20}}
domain: {{x: [2600002, 2600238], y: [1200002, 1200158]}}
points: {{spacing: 4}}
release: {{polygons: releases.gpkg}}
material: {{bed_friction: 12, earth_pressure: isotropic}}
output: {{threshold: 0.05}}
time: {{end: 40, output_every: 20}}
"""
HOUSES = "structures:\n  - {kind: building, polygon: houses.gpkg}\n"
# in the release, where the ground is steep
CORNER = [[2600020, 1200070], [2600024, 1200095], [2600012, 1200090]]
DAM = "  - {kind: dam, line: dam.gpkg, height: 5, side_slope: 34, crest_width: 2}\n"
PROFILE = """\
name: slope
terrain: {profile: plane, angle: 20}
domain: {x: [0, 60], y: [-20, 20]}
points: {spacing: 1}
release: {shape: cap, centre: [10, 0], radius: 6, height: 2}
material: {bed_friction: 25, internal_friction: 30}
time: {end: 3, output_every: 3}
structures:
  - {kind: building, polygon: [[25, -4], [32, -4], [32, 4], [25, 4]]}
"""


def write_shapes(path, shapes, kind):
    pyogrio.raw.write(
        path, np.array(shapely.to_wkb(list(shapes.values())), dtype=object),
        [np.array(list(shapes), dtype=object)], ["name"], crs="EPSG:2056", geometry_type=kind,
    )  # fmt: skip


def box(west, south, east, north):
    return shapely.box(WEST + west, SOUTH + south, WEST + east, SOUTH + north)


def write_ground(folder):
    """A plane that falls to the east and flattens, with a release, two houses and a dam before them."""
    x = SIDE * (np.arange(COLUMNS) + 0.5)
    z = np.broadcast_to(1000 - 0.45 * 90 * (1 - np.exp(-x / 90)), (ROWS, COLUMNS))
    with rasterio.open(
        folder / "dem.tif", "w", driver="GTiff", count=1, height=ROWS, width=COLUMNS, dtype="float64",
        nodata=-9999.0, crs="EPSG:2056", transform=from_origin(WEST, SOUTH + SIDE * ROWS, SIDE, SIDE),
    ) as target:  # fmt: skip
        target.write(z, 1)
    write_shapes(folder / "releases.gpkg", {"slide": box(12, 60, 40, 100)}, "Polygon")
    write_shapes(
        folder / "houses.gpkg", {"inn": box(120, 72, 136, 88), "hut": box(120, 20, 132, 30)}, "Polygon"
    )
    line = shapely.LineString([(WEST + 90, SOUTH + 100), (WEST + 104, SOUTH + 52)])
    write_shapes(folder / "dam.gpkg", {"dam": line}, "LineString")


@pytest.fixture
def folder(tmp_path):
    write_ground(tmp_path)
    return tmp_path


def scenario(folder, more="", name="small", *, text=TEXT):
    path = folder / f"{name}.yaml"
    content = text.format(name=name) if text is TEXT else text
    path.write_text(content.replace("releases.gpkg}", "releases.gpkg, depth: 1.5}") + more)
    return path


def one(structure):
    return f"structures:\n  - {{{structure}}}\n"


def refused(path):
    with pytest.raises(BadInput) as caught:
        load([path])
    (line,) = str(caught.value).splitlines()
    return line


@pytest.fixture(scope="module")
def place(tmp_path_factory):
    """Results without a dam, with it, and with its height swept."""
    folder = tmp_path_factory.mktemp("structures")
    write_ground(folder)
    receptors = "receptors: houses.gpkg\nhazard: {pressure: [1], depth: [0.5]}\n"
    friction = "sweep: {material.bed_friction: [11, 13]}\n"
    files = [
        scenario(folder, HOUSES + receptors + friction, "without"),
        scenario(folder, HOUSES + DAM + receptors + friction, "with"),
        scenario(folder, HOUSES + DAM + receptors + "sweep: {structures.1.height: [0, 5]}\n", "swept"),
    ]
    out = folder / "results"
    pipeline.run(files, out, workers=1, quiet=True)
    return out


def opened(place, name):
    return xr.open_zarr(place / f"{name}.zarr", consolidated=False)


class TestStore:
    def test_nothing_flows_in_buildings_and_what_flows_is_kept(self, place):
        with opened(place, "without") as store:
            built = store["building"].to_numpy() == 1
            # 16 m by 16 m and 12 m by 10 m, whose upper row covers half a cell
            assert built.sum() == 16 + 9
            assert (store["max_depth"].to_numpy()[:, built] == 0).all()
            assert float(abs(store["volume_error"]).max()) < 1e-14
            assert store["building"].attrs["flag_meanings"] == "ground building"

    def test_elevation_holds_the_dam(self, place):
        with opened(place, "without") as plain, opened(place, "with") as dammed:
            change = dammed["elevation"].to_numpy() - plain["elevation"].to_numpy()
        # above the ground along the crest, from which the slope falls away
        assert 4 < change.max() < 5.5
        assert change.min() == 0
        assert 15 < (change > 0).sum() < 120

    def test_a_swept_height_has_a_bed_of_each_run_and_none_is_no_dam(self, place):
        with opened(place, "swept") as store, opened(place, "without") as plain:
            assert store["elevation"].dims == store["area"].dims == ("run", "y", "x")
            np.testing.assert_array_equal(store["vertical_extent"] * 16, store["area"])
            np.testing.assert_array_equal(store["elevation"][0], plain["elevation"])
            np.testing.assert_array_equal(store["area"][0], plain["area"])
            assert float((store["elevation"][1] - store["elevation"][0]).max()) > 4
            np.testing.assert_array_equal(store["height"], [0, 5])
            moved = store["max_depth"].to_numpy()
        assert np.abs(moved[1] - moved[0]).max() > 0.3


class TestReceptors:
    def test_a_building_is_read_by_the_cells_around_it(self, place):
        with opened(place, "without") as store:
            deepest = store["max_depth"].to_numpy()
            built = store["building"].to_numpy() == 1
            x, y = np.meshgrid(store["x"] - WEST, store["y"] - SOUTH)
        rows = pipeline.assessment_tables(place)["receptor-runs"]
        inn = rows[(rows["scenario"] == "without") & (rows["receptor"] == "inn")].sort_values("run")
        ring = (abs(x - 128) < 12) & (abs(y - 80) < 12) & ~built
        assert ring.sum() == 20
        np.testing.assert_array_equal(inn["max_depth"], deepest[:, ring].max(axis=1).astype(float))
        assert (inn["max_depth"] > 0.5).all()
        assert (inn["max_pressure"] > 0).all()

    def test_maps_know_nothing_of_the_inside_of_buildings(self, place, tmp_path):
        with pytest.warns(UserWarning, match="differ in elevation"):
            maps = pipeline.hazard_maps(place, to=tmp_path, pictures=False)
        built = maps["with"]["building"].to_numpy() == 1
        assert np.isnan(maps["with"]["depth_exceedance"].to_numpy()[:, built]).all()
        assert np.isfinite(maps["with"]["depth_exceedance"].to_numpy()[:, ~built]).all()
        assert (maps["with"]["intensity"].to_numpy()[built] == UNKNOWN).all()
        # the runs of a swept dam share a map, with the dam
        assert maps["swept"]["elevation"].dims == ("y", "x")


class TestCompare:
    def test_the_dam_takes_the_flow_from_the_inn(self, place, tmp_path):
        found, table, _ = pipeline.compare(place, ("without", "with"), to=tmp_path)
        rows = table.set_index(["receptor", "quantity"])
        assert rows.loc[("inn", "largest_depth"), "difference"] < -0.2
        for end in ("first", "second"):
            speed, pressure = (rows.loc[("inn", f"largest_{name}"), end] for name in ("speed", "pressure"))
            assert pressure == pytest.approx(2 * speed**2)
        with pytest.warns(UserWarning, match="differ in elevation"):
            maps = pipeline.hazard_maps(place)
        one, two = (maps[name]["depth_exceedance"].to_numpy()[0] for name in ("without", "with"))
        np.testing.assert_allclose(found["depth_exceedance_difference"].to_numpy()[0], two - one)
        assert np.nanmin(two - one) == -1
        assert (tmp_path / FILE).exists()
        assert len(pd.read_csv(tmp_path / TABLE)) == len(table) == 2 * 7
        assert (tmp_path / "depth_above_0.5_difference.png").stat().st_size > 20_000
        assert (tmp_path / "pressure_quantile_0.9_difference.png").exists()

    def test_a_scenario_does_not_differ_from_itself(self, place):
        found, table, _ = pipeline.compare(place, ("with", "with"), place)
        assert not np.nan_to_num(found["depth_quantile_difference"].to_numpy()).any()
        assert (table["difference"] == 0).all()

    def test_bounds_hold_whatever_missing_runs_do(self, place, folder):
        # one of the two runs of the second scenario fails
        with opened(place, "with") as store:
            steps = int(store["steps"].min())
        more = "receptors: houses.gpkg\nhazard: {pressure: [1], depth: [0.5]}\n"
        path = scenario(folder, HOUSES + DAM + more + "sweep: {material.bed_friction: [11, 13]}\n", "with")
        path.write_text(path.read_text().replace("end: 40,", f"end: 40, max_steps: {steps},"))
        pipeline.run(path, folder / "results", workers=1, quiet=True)
        with opened(folder / "results", "with") as store:
            states = store["status"].to_numpy()
        assert sorted(states == 2) == [False, True]
        found, table, _ = pipeline.compare(place, ("without", "with"), folder / "results")
        whole = pipeline.compare(place, ("without", "with")).maps
        ends = {
            end: found[f"depth_exceedance_difference{end}"].to_numpy() for end in ("", "_lower", "_upper")
        }
        true = whole["depth_exceedance_difference"].to_numpy()
        known = np.isfinite(true)
        assert (ends["_lower"][known] <= true[known] + 1e-6).all()
        assert (ends["_upper"][known] >= true[known] - 1e-6).all()
        assert np.nanmax(ends["_upper"] - ends["_lower"]) > 0.499
        row = table.set_index(["receptor", "quantity"]).loc[("inn", "probability")]
        assert row["runs_failed_second"] == 1
        assert row["difference_lower"] < row["difference_upper"]

    def test_what_cannot_be_compared_is_refused(self, place, folder):
        files = [
            scenario(folder, HOUSES + "hazard: {density: 1900}\n", "denser"),
            scenario(folder, HOUSES, "shorter"),
        ]
        shorter = files[1].read_text().replace("2600238", "2600200")
        files[1].write_text(shorter + "hazard: {pressure: [1], depth: [0.5]}\n")
        files.append(scenario(folder, HOUSES + "hazard: {pressure: [1], depth: [0.5]}\n", "thicker"))
        files[2].write_text(files[2].read_text().replace("threshold: 0.05", "threshold: 0.1"))
        out = folder / "results"
        pipeline.run(files, out, workers=1, quiet=True)
        for name, words in {
            "denser": "hazard",
            "shorter": "same cells",
            "thicker": "output.threshold",
        }.items():
            with pytest.raises(NotTogetherError, match=words):
                pipeline.compare(place, ("without", name), out)
        shown = CliRunner().invoke(
            app, ["compare", str(place), str(out), "--scenarios", "without", "thicker"]
        )
        assert shown.exit_code == 2
        assert "give both the same output.threshold" in shown.stderr
        shown = CliRunner().invoke(app, ["compare", str(place), "--scenarios", "without", "nothing"])
        assert shown.exit_code == 2
        assert "nothing" in shown.stderr

    def test_the_command_writes_maps_and_table(self, place, tmp_path):
        arguments = [
            "compare",
            str(place),
            "--scenarios",
            "without",
            "with",
            "--to",
            str(tmp_path),
            "--no-maps",
        ]
        shown = CliRunner().invoke(app, [*arguments, "--depth", "0.2"])
        assert shown.exit_code == 0
        assert "2 of 2 runs done" in shown.stdout
        with xr.open_dataset(tmp_path / FILE) as found:
            assert found["depth_threshold"].to_numpy().tolist() == [0.2]
            assert found.attrs["first_scenario"] == "without"
            assert json.loads(found.attrs["receptors"])[0]["name"] == "inn"


class TestScenario:
    def test_structures_are_part_of_what_decides_and_none_are_not(self, folder):
        plain, dammed = load([scenario(folder, "", "plain"), scenario(folder, HOUSES + DAM, "dammed")])
        assert "structures" not in json.loads(plain.content)
        assert json.loads(dammed.content)["structures"][1]["height"] == 5
        before = dammed.digest
        line = shapely.LineString([(WEST + 90, SOUTH + 100), (WEST + 100, SOUTH + 52)])
        write_shapes(folder / "dam.gpkg", {"dam": line}, "LineString")
        (after,) = load([folder / "dammed.yaml"])
        assert after.digest != before

    def test_what_cells_do_not_show_is_told(self, folder):
        thin = one("kind: building, polygon: thin.gpkg")
        thin += "  - {kind: dam, line: dam.gpkg, height: 2, side_slope: 34}\n"
        write_shapes(
            folder / "thin.gpkg",
            {"wall": box(120, 40, 122.5, 100), "shed": box(122, 22, 123, 23), "far": box(9000, 0, 9010, 9)},
            "Polygon",
        )
        (found,) = load([scenario(folder, thin)])
        told = "\n".join(found.warnings)
        assert "1 ('far') outside the domain, without effect" in told
        assert "1 ('shed') half of no cell of 4 m covered: the flow passes through" in told
        assert "1 ('wall') narrower than a cell of 4 m" in told
        assert "5.93 m wide at its foot, less than two cells of 4 m" in told
        assert "high in the mean on cells of 4 m, of 2 m" in told

    @pytest.mark.parametrize(
        ("more", "words"),
        [
            (one("kind: dam, line: houses.gpkg, height: 3, side_slope: 34"), "expected lines"),
            (one("kind: building, polygon: nothing.gpkg"), "readable file"),
            (one("kind: building, polygon: houses.gpkg, name: mill"), "one of inn, hut"),
            (HOUSES + "sweep: {structures.0.name: [inn, hut]}\n", "one place for all runs"),
            (
                one(f"kind: building, polygon: {CORNER}"),
                "% of 'slide' in cells of buildings",
            ),
            (
                one("kind: basin, polygon: [[1, 2], [3, 4], [5, 2]], depth: 2"),
                "expected a basin in the domain",
            ),
            (
                one(f"kind: dam, line: {CORNER[:2]}, height: 3, side_slope: 15"),
                "sides that meet the ground",
            ),
            (one("kind: dam, line: dam.gpkg, height: -1, side_slope: 34"), "at least 0"),
            (one("kind: wall, line: dam.gpkg"), "dam"),
        ],
    )  # fmt: skip
    def test_mistakes_have_a_line_each(self, folder, more, words):
        line = refused(scenario(folder, more))
        assert words in line
        assert "small.yaml:" in line

    @pytest.mark.parametrize(
        ("change", "words"),
        [
            (("[[25, -4], [32, -4], [32, 4], [25, 4]]", "houses.gpkg"), "a file takes an elevation model"),
            (("domain: {x: [0, 60], y: [-20, 20]}\n", ""), "expected a domain, as there is a building"),
            (("[[25, -4], [32, -4]", "[[5, -4], [12, -4]"), "beside the buildings"),
            (("kind: building, polygon", "kind: dam, height: 2, side_slope: 9, line"), "with a dam"),
            (("time:", "scheme: {form: collocation}\ntime:"), "form collocation"),
        ],
    )  # fmt: skip
    def test_what_a_profile_cannot_have_is_refused(self, tmp_path, change, words):
        text = PROFILE.replace(*change)
        assert text != PROFILE
        assert words in refused(scenario(tmp_path, text=text))

    @pytest.mark.parametrize("points", ["spacing: 1", "layout: poisson-disc, spacing: 1, seed: 1"])
    def test_a_profile_takes_buildings(self, tmp_path, points):
        out, text = tmp_path / "results", PROFILE.replace("spacing: 1", points)
        results = pipeline.run(scenario(tmp_path, text=text), out, workers=1, quiet=True)
        store = results["slope"]
        built = store["building"].to_numpy() == 1
        if "area" in store:
            # the cells end at the building
            assert float(store["area"].to_numpy()[built].sum()) == pytest.approx(7 * 8, rel=1e-9)
        else:
            # all that half of is covered: not the corners
            assert built.sum() == 8 * 9 - 4
        assert (store["max_depth"].to_numpy()[0][built] == 0).all()
        assert float(store["max_depth"].max()) > 1
