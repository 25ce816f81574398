"""Clouds on elevation models, from scenario files to maps: they say what a lattice says."""

import json

import numpy as np
import pytest
import xarray as xr
from elevation_files import DOMAIN, NORTH, TEXT, WEST, ground, write_polygons, write_raster, written

import pipeline
from pipeline.assess.frames import follow, mean_spacing, on_surface
from pipeline.scenario.scenario import load
from solver.physics.elevation import ElevationModel
from solver.points.cloud import PointCloud

LATTICE = "points: {spacing: 5}"
EVEN = (LATTICE, "points: {layout: poisson-disc, spacing: 4}")
GRADED = (
    LATTICE,
    "points: {layout: graded, spacing: 12, refine: [{region: {x: [2600010, 2600250], "
    "y: [1200260, 1200340]}, spacing: 4}]}",
)
HOUSE = f"receptors: [{{name: house, point: [{WEST + 130}, {NORTH - 100}]}}]\n"
HUT = (
    "structures: [{kind: building, polygon: [[2600100, 1200200], [2600120, 1200200], [2600120, 1200220]]}]\n"
)
DAM = (
    "structures: [{kind: dam, line: [[2600150, 1200250], [2600150, 1200350]], height: 8, side_slope: 35, "
    "crest_width: 4}]\n"
)


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    path = tmp_path_factory.mktemp("cloud")
    write_raster(path / "dem.tif", ground())
    write_polygons(path / "releases.gpkg", {"slide": (20, -120, 60, -80)})
    return path


def run(folder, name, *changes, more=""):
    text = TEXT.replace("name: small", f"name: {name}") + more
    file = written(folder, text, *changes).rename(folder / f"{name}.yaml")
    pipeline.run(file, folder / name, workers=1, quiet=True, warn=lambda line: None)
    return xr.open_zarr(folder / name / f"{name}.zarr", consolidated=False).load()


@pytest.fixture(scope="module")
def even(folder):
    return run(folder, "even", EVEN, more=HOUSE)


@pytest.fixture(scope="module")
def lattice(folder):
    return run(folder, "lattice", more=HOUSE)


def test_summaries_are_about_those_of_a_lattice(folder, even, lattice):
    graded = run(folder, "graded", GRADED)
    assert graded.sizes["point"] < 0.7 * even.sizes["point"]
    for cloud in (even, graded):
        assert on_surface(cloud)
        for name, within in (
            ("volume_released", 1e-4),
            ("reach_angle", 0.05),
            ("deposit_area", 0.08),
            ("deposit_volume", 0.02),
            ("peak_depth", 0.08),
        ):
            np.testing.assert_allclose(cloud[name], lattice[name], rtol=within, err_msg=name)
        for name in ("runout_distance", "flow_runout_distance", "flow_path_length"):
            # two cells
            np.testing.assert_allclose(cloud[name], lattice[name], atol=10, err_msg=name)
        # what the slope of 0.4 falls on two cells
        np.testing.assert_allclose(cloud["drop_height"], lattice["drop_height"], atol=4)
        assert float(cloud["volume_error"].max()) < 1e-14


def test_points_stand_closer_around_a_receptor_of_a_file(folder):
    write_polygons(folder / "houses.gpkg", {"house": (120, -110, 140, -90)})
    around = "points: {layout: graded, spacing: 12, refine: [{receptor: house, margin: 20, spacing: 3}]}"
    store = run(folder, "around", (LATTICE, around), more="receptors: houses.gpkg\n")
    x, y = store["x"] - WEST, store["y"] - NORTH
    near = (abs(x - 130) < 25) & (abs(y + 100) < 25)
    far = (abs(x - 130) > 120) | (abs(y + 100) > 120)
    assert float(store["plan_area"][near].mean()) == pytest.approx(9, rel=0.1)
    assert float(store["plan_area"][far].mean()) > 100


def test_a_building_among_points_that_follow_it_is_judged_by_them(folder):
    # smaller than a cell where the points stand apart
    write_polygons(folder / "huts.gpkg", {"hut": (150, -105, 158, -97)})
    around = "points: {{layout: graded, spacing: 24, refine: [{{{}spacing: 2}}]}}".format
    more = "receptors: huts.gpkg\nstructures: [{kind: building, polygon: huts.gpkg}]\n"
    text = TEXT.replace("name: small", "name: followed") + more
    followed = written(folder, text, (LATTICE, around("receptor: hut, margin: 10, ")))
    (scenario,) = load([followed])
    x0, x1, y0, y1 = WEST + 140, WEST + 168, NORTH - 115, NORTH - 87
    there = written(folder, text, (LATTICE, around(f"region: {{x: [{x0}, {x1}], y: [{y0}, {y1}]}}, ")))
    (same,) = load([there])
    assert scenario.settings.points == same.settings.points
    assert scenario.warnings == same.warnings
    store = run(folder, "followed", (LATTICE, around("receptor: hut, margin: 10, ")), more=more)
    assert float((store["building"] * store["plan_area"]).sum()) == pytest.approx(64, rel=0.2)


def test_a_store_holds_places_on_the_map_and_both_areas(even):
    x, y = even["x"].to_numpy(), even["y"].to_numpy()
    assert (x > WEST).all()
    assert (y < NORTH).all()
    assert even["x"].attrs["standard_name"] == "projection_x_coordinate"
    assert even["max_depth"].attrs["grid_mapping"] == "spatial_ref"
    domain = json.loads(even.attrs["domain"])
    plan, bed = even["plan_area"].to_numpy(), even["area"].to_numpy()
    assert plan.sum() == pytest.approx(np.prod([np.ptp(domain[axis]) for axis in "xy"]), rel=1e-12)
    assert (bed > plan).all()
    released = float((even["depth"].isel(run=0, time=0) * even["area"]).sum())
    assert released == pytest.approx(float(even["volume_released"][0]), rel=1e-6)
    model = ElevationModel(2.5 + 5 * np.arange(60) + WEST, NORTH - 197.5 + 5 * np.arange(40), ground()[::-1])
    cells = PointCloud(np.stack([x, y], axis=1), tuple(domain["x"]), tuple(domain["y"])).control_volumes
    np.testing.assert_allclose(plan, cells.area, rtol=1e-9)
    np.testing.assert_allclose(even["elevation"], model.elevation_at(*cells.centroid.T), atol=1e-6)


def test_on_a_lattice_it_has_the_ground_of_the_elevation_model(even, lattice):
    found = pipeline.to_lattice(even)
    assert found["max_depth"].dims == ("run", "y", "x")
    assert found["elevation"].dims == found["area"].dims == ("y", "x")
    assert float(found["x"].diff("x").mean()) == pytest.approx(mean_spacing(even), rel=0.05)
    inside = {"x": slice(3, -3), "y": slice(3, -3)}
    there = lattice["elevation"].interp(x=found["x"], y=found["y"])
    np.testing.assert_allclose(found["elevation"][inside], there[inside], atol=0.2)
    steep = lattice["area"].interp(x=found["x"], y=found["y"]) / 25
    cell = float(found["x"].diff("x").mean() * found["y"].diff("y").mean())
    np.testing.assert_allclose(found["area"][inside] / cell, steep[inside], atol=0.03)
    np.testing.assert_allclose(found["vertical_extent"], found["area"] / cell, rtol=1e-12)


def test_what_is_followed_is_about_that_of_a_lattice(even, lattice):
    one, other = follow(even).isel(run=0, time=-1), follow(lattice).isel(run=0, time=-1)
    for name, within in (("body_area", 0.08), ("volume", 1e-4), ("lowest_elevation", 1e-3)):
        np.testing.assert_allclose(one[name], other[name], rtol=within)


def test_maps_and_receptors_are_about_those_of_a_lattice(folder, even, lattice):
    maps, tables = {}, {}
    for name in ("even", "lattice"):
        maps[name] = pipeline.hazard_maps(folder / name)[name]
        tables[name] = pipeline.assessment_tables(folder / name)["receptors"]
    one, other = maps["even"]["depth_quantile"][-1], maps["lattice"]["depth_quantile"][-1]
    assert one["x"].attrs["standard_name"] == "projection_x_coordinate"
    there = other.interp(x=one["x"], y=one["y"]).fillna(0)
    both = (one > 0.3) & (there > 0.3)
    assert float(both.sum() / ((one > 0.3) | (there > 0.3)).sum()) > 0.85
    assert float(np.abs(one - there).mean() / there.mean()) < 0.15
    (depths,) = zip(*(tables[name]["median_max_depth"] for name in ("even", "lattice")), strict=True)
    assert depths[0] == pytest.approx(depths[1], rel=0.15)


def test_a_dam_holds_the_flow_of_a_cloud(folder, even):
    held = run(folder, "held", EVEN, more=DAM)
    assert float(held["elevation"].max() - even["elevation"].max()) == pytest.approx(0, abs=1)
    crest = float((held["elevation"] - even["elevation"]).max())
    assert 6 < crest < 10
    assert float(held["flow_runout_distance"][0]) < 0.75 * float(even["flow_runout_distance"][0])


def test_an_erodible_bed_is_laid_on_a_cloud(folder):
    bed = "erodible_bed: {depth: 0.5, law: {model: growth-rate, growth: 0.002}}\n"
    eroded = run(folder, "eroded", EVEN, more=bed)
    taken = float((eroded["erosion_depth"][0] * eroded["area"]).sum())
    assert taken == pytest.approx(float(eroded["volume_entrained"][0]), rel=1e-6)
    assert taken > 0.05 * float(eroded["volume_released"][0])


def test_a_domain_is_found_for_a_cloud(folder):
    found = run(folder, "found", EVEN, (f"{DOMAIN}\n", ""))
    assert found["volume_out"].to_numpy().tolist() == [0.0]
    assert np.ptp(found["y"].to_numpy()) < 150


@pytest.mark.parametrize(
    ("points", "more", "said"),
    [
        ("layout: poisson-disc, count: 500", "", "points.count: expected a spacing on an elevation model"),
        ("layout: file, path: points.csv", "", "expected layout lattice, poisson-disc or graded on an elev"),
    ],
)
def test_what_a_cloud_cannot_have_is_refused(folder, points, more, said):
    path = written(folder, TEXT + more, (LATTICE, f"points: {{{points}}}"))
    with pytest.raises(pipeline.BadInput, match=said):
        load([path])


FED = (
    f"inflow: [{{name: apex, section: [[{WEST + 40}, {NORTH - 115}], [{WEST + 40}, {NORTH - 85}]], "
    "hydrograph: {shape: triangle, volume: 800, peak_discharge: 60}, froude: 1.5}]\n"
    f"sections: [{{name: bridge, line: [[{WEST + 120}, {NORTH - 160}], [{WEST + 120}, {NORTH - 40}]]}}]\n"
)
ALONE = ("release: {polygons: releases.gpkg, name: slide}\n", "")


def test_a_hydrograph_comes_in_on_a_cloud_about_as_on_a_lattice(folder):
    found = {
        name: run(folder, f"fed-{name}", ALONE, *points, more=FED)
        for name, points in (("cloud", [EVEN]), ("lattice", []))
    }
    cloud, lattice = found["cloud"], found["lattice"]
    for store in found.values():
        assert float(store["volume_in"][0]) == pytest.approx(800, rel=1e-12)
        assert float(store["volume_error"].max()) < 1e-13
    for name, within in (
        ("section_volume", 1e-3),
        ("section_peak_discharge", 0.05),
        ("section_arrival_time", 0.01),
    ):
        one, other = (float(store[name][0, 0].max()) for store in (cloud, lattice))
        assert one == pytest.approx(other, rel=within), name
    assert float(cloud["section_volume"][0, 0].max()) > 700
    # two cells
    for name in ("runout_distance", "flow_runout_distance"):
        np.testing.assert_allclose(cloud[name], lattice[name], atol=10, err_msg=name)


def test_a_domain_is_found_for_a_hydrograph_on_a_cloud(folder):
    found = run(folder, "fed-found", ALONE, EVEN, (f"{DOMAIN}\n", ""), more=FED)
    assert found["volume_out"].to_numpy().tolist() == [0.0]
    assert float(found["volume_in"][0]) == pytest.approx(800, rel=1e-12)
    assert np.ptp(found["y"].to_numpy()) < 190


def test_a_section_is_looked_at_before_a_cloud_is_placed(folder):
    outside = FED.replace(f"{WEST + 40}, {NORTH - 115}", f"{WEST - 40}, {NORTH - 115}")
    path = written(folder, TEXT + outside, EVEN, ALONE)
    with pytest.raises(pipeline.BadInput, match=r"inflow\.0\.section: expected a section inside the domain"):
        load([path])
    path = written(folder, TEXT + FED.replace("froude: 1.5", "depth: normal"), EVEN, ALONE)
    with pytest.raises(pipeline.BadInput, match="no normal depth with this law of friction"):
        load([path])


HOUSES = (
    f"structures: [{{kind: building, polygon: [[{WEST + 118}, {NORTH - 112}], [{WEST + 142}, {NORTH - 118}], "
    f"[{WEST + 146}, {NORTH - 88}], [{WEST + 122}, {NORTH - 84}]]}}]\n"
    "hazard: {depth: [0.3]}\n"
)


@pytest.fixture(scope="module")
def built(folder):
    return run(folder, "built", EVEN, more=HOUSE + HOUSES)


def test_nothing_flows_in_a_building_on_a_cloud(built, even):
    stands = built["building"].to_numpy() == 1
    assert built["building"].dims == ("point",)
    area = built["plan_area"].to_numpy()[stands].sum()
    # the cells end at its edges
    assert area == pytest.approx(716, rel=1e-9)
    assert (built["max_depth"].to_numpy()[:, stands] == 0).all()
    assert np.isnan(built["arrival_time"].to_numpy()[:, stands]).all()
    assert float(abs(built["volume_error"]).max()) < 1e-14
    # where flow was without it
    there = pipeline.to_lattice(even)["max_depth"].sel(x=WEST + 132, y=NORTH - 100, method="nearest")
    assert float(there[0]) > 0.3


def test_receptors_on_a_building_are_read_beside_it_and_maps_leave_it_out(folder, built, lattice):
    place = run(folder, "built-lattice", more=HOUSE + HOUSES)
    assert place["building"].dims == ("y", "x")
    found = [
        pipeline.assessment_tables(folder / name)["receptors"].iloc[0] for name in ("built", "built-lattice")
    ]
    assert found[0]["median_max_depth"] > 0.5
    assert found[0]["median_max_depth"] == pytest.approx(found[1]["median_max_depth"], rel=0.3)
    mapped = pipeline.to_lattice(built)
    stands = mapped["building"].to_numpy() == 1
    assert mapped["building"].dims == ("y", "x")
    assert (mapped["max_depth"].to_numpy()[:, stands] == 0).all()
    assert (mapped["area"].to_numpy()[stands] > 0).all()
    maps = pipeline.hazard_maps(folder / "built")["built"]
    stands = maps["building"].to_numpy() == 1
    assert 20 < stands.sum() < 70
    assert np.isnan(maps["depth_quantile"].to_numpy()[..., stands]).all()
    assert not np.isnan(maps["depth_exceedance"].to_numpy()[..., ~stands]).any()


@pytest.mark.parametrize("kind", ["lattice", "cloud"])
def test_what_cannot_be_among_buildings_is_refused_before_a_run(folder, kind):
    points = [] if kind == "lattice" else [EVEN]
    over = HOUSES.replace(f"{WEST + 118}, {NORTH - 112}", f"{WEST + 40}, {NORTH - 112}")
    with pytest.raises(pipeline.BadInput, match=r"expected a release beside the buildings.*'slide'"):
        load([written(folder, TEXT + over, *points)])
    fed = FED.replace(f"{WEST + 40}", f"{WEST + 130}")
    with pytest.raises(pipeline.BadInput, match="clear of buildings"):
        load([written(folder, TEXT + HOUSES + fed, ALONE, *points)])


def test_a_building_finer_than_the_points_is_warned_of(folder):
    sliver = (
        f"structures: [{{kind: building, polygon: [[{WEST + 120}, {NORTH - 120}], "
        f"[{WEST + 120.5}, {NORTH - 120}], [{WEST + 120.5}, {NORTH - 80}]]}}]\n"
    )
    (found,) = load([written(folder, TEXT + sliver, EVEN)])
    assert any("half of no cell covered: the flow passes through" in line for line in found.warnings)
