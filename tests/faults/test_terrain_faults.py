"""What is wrong or doubtful of elevation models and polygons: one line with file, feature and what to do."""

import numpy as np
import pyogrio
import pytest
import rasterio
import shapely
from elevation_files import (
    COLUMNS,
    DOMAIN,
    NORTH,
    ROWS,
    TEXT,
    WEST,
    ground,
    write_polygons,
    write_raster,
    written,
)

from pipeline.errors import BadInput
from pipeline.runs.runs import expand
from pipeline.scenario.scenario import load
from pipeline.scenario.solver_objects import outlined

SEARCHED = (f"{DOMAIN}\n", "")


@pytest.fixture
def folder(tmp_path):
    write_raster(tmp_path / "dem.tif", ground())
    write_polygons(tmp_path / "releases.gpkg", {"slide": (20, -120, 50, -80)})
    return tmp_path


def line(folder, *changes):
    """The one line that a scenario is refused with, whether its domain is given or found."""
    lines = []
    for more in ((), (SEARCHED,)):
        with pytest.raises(BadInput) as caught:
            load([written(folder, TEXT, *changes, *more)])
        (one,) = str(caught.value).splitlines()
        lines.append(one.partition(": ")[2])
    assert lines[0].partition(":")[0] == lines[1].partition(":")[0]
    return lines[0]


def told(folder, *changes):
    (scenario,) = load([written(folder, TEXT, *changes)])
    return "\n".join(scenario.warnings)


def shapes(folder, *geometries, crs="EPSG:2056", name="releases.gpkg"):
    made = np.array(shapely.to_wkb(list(geometries)), dtype=object)
    names = np.array(["slide"] * len(geometries), dtype=object)
    kind = geometries[0].geom_type
    pyogrio.raw.write(folder / name, made, [names], ["name"], crs=crs, geometry_type=kind)


DEPTH = ("name: slide", "name: slide, depth: 1")


def test_elevations_in_feet(folder):
    with rasterio.open(folder / "dem.tif", "r+") as raster:
        raster.units = ("ft",)
    found = line(folder)
    assert "terrain.elevation: expected elevations in metres, found 'ft'; gdal_calc.py" in found
    assert found.endswith("(dem.tif)")


def test_coordinates_in_feet(folder):
    write_raster(folder / "dem.tif", ground(), crs="EPSG:2225")
    assert "expected coordinates in metres, found US survey foot" in line(folder)


def test_a_polygon_that_crosses_itself(folder):
    bow = [
        (WEST + 20, NORTH - 120),
        (WEST + 60, NORTH - 80),
        (WEST + 60, NORTH - 120),
        (WEST + 20, NORTH - 80),
    ]
    shapes(folder, shapely.Polygon(bow))
    found = line(folder, DEPTH)
    assert "release.polygons: expected simple polygons, found feature 1 ('slide') of releases.gpkg" in found
    assert "Self-intersection" in found


@pytest.mark.filterwarnings("ignore:'crs' was not provided")
def test_polygons_without_a_reference_system(folder):
    shapes(folder, shapely.box(WEST + 20, NORTH - 120, WEST + 50, NORTH - 80), crs=None, name="releases.shp")
    found = line(folder, DEPTH, ("releases.gpkg", "releases.shp"))
    assert "expected a reference system, found none in releases.shp; a Shapefile has it in .prj" in found


def test_polygons_in_another_reference_system_are_brought_to_that_of_the_elevation_model(folder):
    from rasterio.warp import transform

    corners = [
        (WEST + 20, NORTH - 120),
        (WEST + 50, NORTH - 120),
        (WEST + 50, NORTH - 80),
        (WEST + 20, NORTH - 80),
    ]
    lon, lat = transform("EPSG:2056", "EPSG:4326", *zip(*corners, strict=True))
    shapes(
        folder, shapely.Polygon(list(zip(lon, lat, strict=True))), crs="EPSG:4326", name="releases.geojson"
    )
    (scenario,) = load([written(folder, TEXT, DEPTH, ("releases.gpkg", "releases.geojson"))])
    (held,) = scenario.ground.outlines.values()
    found = sorted(map(tuple, np.round(held[0].rings[0], 1)))
    assert found == sorted(corners)


def test_a_slanted_polygon_that_lies_wholly_on_the_elevation_model_loses_nothing(folder):
    corners = np.array([(20.0, -120.7), (70.9, -106.3), (59.6, -49.8), (10.1, -73.4)])
    shapes(folder, shapely.Polygon(corners + np.array([WEST, NORTH])))
    assert "are lost" not in told(folder, DEPTH)


def test_coordinates_that_the_reference_system_cannot_hold(folder):
    shapes(folder, shapely.box(1e12, 1e12, 2e12, 2e12), crs="EPSG:3035")
    assert "of releases.gpkg" in line(folder, DEPTH)


def test_an_elevation_model_far_from_where_its_reference_system_is_used(folder):
    write_raster(folder / "dem.tif", ground(), crs="EPSG:31287")
    shapes(folder, shapely.box(WEST + 20, NORTH - 120, WEST + 50, NORTH - 80), crs="EPSG:31287")
    assert "but EPSG:31287 is used in Austria: check the system" in told(folder, DEPTH)
    assert "check the system" not in told(folder_of(folder), DEPTH)


def test_a_reference_system_whose_lengths_are_not_those_on_the_ground(folder):
    for crs, said in (("EPSG:3857", True), ("EPSG:2056", False)):
        write_raster(folder / "dem.tif", ground(), crs=crs)
        shapes(folder, shapely.box(WEST + 20, NORTH - 120, WEST + 50, NORTH - 80), crs=crs)
        found = told(folder, DEPTH)
        # at y = 1,200,300 m Web Mercator is 1 / cos 10.7 degrees too long
        assert ("lengths in EPSG:3857 are 1.02 times those on the ground there: gdalwarp" in found) == said
        assert ("ground there" in found) == said


def test_a_system_with_heights_is_that_of_its_part_in_plan(folder):
    write_raster(folder / "dem.tif", ground(), crs="EPSG:2056+5728")
    change = ("elevation: dem.tif", "elevation: dem.tif, crs: EPSG:%s")
    assert told(folder, (change[0], change[1] % 2056)) == ""
    assert told(folder, (change[0], change[1] % "2056+5728")) == ""
    own = "+proj=tmerc +lat_0=46.95 +lon_0=7.43 +x_0=2600000 +y_0=1200000 +ellps=bessel +units=m +type=crs"
    write_raster(folder / "dem.tif", ground(), crs=own)
    found = line(folder, (change[0], change[1] % 2056))
    assert found.startswith("terrain.crs: expected 'unknown', the reference system of the file itself")


def test_an_unknown_system_beside_that_of_the_file_is_told(folder):
    found = line(folder, ("elevation: dem.tif", "elevation: dem.tif, crs: EPSG:99999"))
    wanted = "expected a reference system, as EPSG:2056"
    assert found == f"terrain.crs: {wanted}, found 'EPSG:99999', which is none"


def test_sides_of_a_dam_in_radians_are_warned_of(folder):
    dam = f"kind: dam, line: [[{WEST + 100}, {NORTH - 60}], [{WEST + 100}, {NORTH - 120}]], height: 2"
    for angle, said in ((0.6, True), (34, False)):
        found = told(folder, ("time:", f"structures: [{{{dam}, side_slope: {angle}}}]\ntime:"))
        wanted = "structures.0.side_slope: 0.6 degrees are nearly none: write degrees, no radians"
        assert (wanted in found) == said


def test_a_folder_in_place_of_an_elevation_model(folder):
    found = line(folder, ("elevation: dem.tif", "elevation: ."))
    assert found == "terrain.elevation: expected a file that can be read, found the folder ."


MISSING = (
    ("dem.tif", "a.tif"),
    ("releases.gpkg", "b.gpkg"),
    ("time: {end: 60}", """\
inflow: {name: creek, section: [[1, 2], [3, 4]], hydrograph: {file: c.csv}}
receptors: {file: d.gpkg, layer: houses}
erodible_bed: {polygons: e.gpkg, depth: f.tif, law: {model: growth-rate, growth: 0.02}}
structures: [{kind: dam, line: g.gpkg, height: 5, side_slope: 34}]
"""),
)  # fmt: skip


@pytest.mark.parametrize("more", [(), (("bed_friction", "bed_fricton"),)], ids=["alone", "with a typo"])
def test_all_files_that_are_missing_are_told_at_once(folder, more):
    with pytest.raises(BadInput) as caught:
        load([written(folder, TEXT, *MISSING, *more)])
    missing = [each for each in caught.value.mistakes if "found none" in each.message]
    assert [(each.line, each.key) for each in missing] == [
        (2, "terrain.elevation"),
        (5, "release.polygons"),
        (8, "inflow.hydrograph.file"),
        (9, "receptors"),
        (10, "erodible_bed.polygons"),
        (10, "erodible_bed.depth"),
        (11, "structures.0.line"),
    ]
    assert missing[0].message == f"expected a readable file, found none: {folder / 'a.tif'}"
    typed = any("Did you mean 'bed_friction'" in each.message for each in caught.value.mistakes)
    assert typed == bool(more)


def test_what_was_written_is_told_where_it_stands(folder):
    write_raster(folder / "dem.tif", ground(), crs=None)
    found = line(folder, ("elevation: dem.tif", "elevation: dem.tif, crs: LV95"))
    assert found == "terrain.crs: expected a reference system, as EPSG:2056, found 'LV95', which is none"
    folder_of(folder)
    found = line(folder, ("name: slide", "name: slice"))
    assert (
        found
        == "release: expected one of the polygons slide, found 'slice'. Did you mean 'slide'? (releases.gpkg)"
    )
    turned = f"domain: {{x: [{WEST + 297.5}, {WEST + 2.5}], y: [{NORTH - 197.5}, {NORTH - 2.5}]}}"
    with pytest.raises(BadInput, match=r"below the upper one, found \[2600297\.5, 2600002\.5\]"):
        load([written(folder, TEXT, (DOMAIN, turned))])


def folder_of(folder):
    write_raster(folder / "dem.tif", ground())
    write_polygons(folder / "releases.gpkg", {"slide": (20, -120, 50, -80)})
    return folder


@pytest.mark.parametrize("change", [(), (SEARCHED,)])
def test_lines_in_place_of_polygons(folder, change):
    shapes(folder, shapely.LineString([(WEST, NORTH), (WEST + 9, NORTH)]))
    with pytest.raises(BadInput, match=r"expected polygons, found a LineString in feature 1 \('slide'\)"):
        load([written(folder, TEXT, DEPTH, *change)])


def test_a_release_outside_of_the_elevation_model(folder):
    write_polygons(folder / "releases.gpkg", {"slide": (900, 0, 950, 50)})
    found = line(folder)
    assert "release: expected a release" in found
    assert "found 'slide' of releases.gpkg outside" in found


def test_a_release_whose_depth_is_empty(folder):
    write_polygons(folder / "releases.gpkg", {"slide": (20, -120, 50, -80)}, depth=np.nan)
    assert "found 'slide' whose attribute depth is empty (releases.gpkg)" in line(folder)


def test_a_release_on_no_data(folder):
    elevation = ground()
    elevation[10:30, :15] = -9999.0
    write_raster(folder / "dem.tif", elevation)
    assert "where there is data, found 'slide' of releases.gpkg outside or on no data" in line(folder)


def test_a_polygon_smaller_than_a_cell(folder):
    write_polygons(folder / "releases.gpkg", {"slide": (20, -100, 24, -96)})
    assert "expected polygons of a cell, 25 m2, or more, found 'slide' of releases.gpkg" in line(folder)


def test_steep_ground_and_no_data_in_the_domain(folder):
    elevation = ground()
    elevation[:, 40:44] = -9999.0
    elevation[5:8, 20:23] += 40
    write_raster(folder / "dem.tif", elevation)
    found = told(folder)
    assert "dem.tif: 6.7 % of the domain have no data; what flows there has left: fill them" in found
    assert "% of the cells are steeper than 60 degrees: where that are no cliffs, check the unit" in found


def test_a_finer_spacing_than_the_elevation_model_shows(folder):
    assert "more than 4 times finer than the elevation model of 5 m" in told(
        folder, ("spacing: 5", "spacing: 1")
    )
    assert "times finer" not in told(folder, ("spacing: 5", "spacing: 1.25"))


def test_more_points_than_can_be(folder):
    found = line(folder, ("spacing: 5", "spacing: 0.01"))
    assert found.startswith("points.spacing: expected at most 100,000,000 points, found 5.75e+08")


def test_elevation_models_that_are_none(folder):
    (folder / "dem.tif").write_text("no raster")
    assert "expected an elevation model as GeoTIFF, ASC or NetCDF, found dem.tif" in line(folder)
    write_raster(folder / "dem.tif", np.full((ROWS, COLUMNS), -9999.0))
    assert "expected elevations, found no data alone" in line(folder)
    write_raster(folder / "dem.tif", 100 * ground())
    assert "expected elevations between -500 and 9000 m" in line(folder)


# the elevation model reaches 300 m east and 200 m south of WEST, NORTH
FAR_OFF = "[[2700000, 1300000], [2700000, 1300050]]"
EXCHANGED = f"[[{NORTH - 100}, {WEST + 50}], [{NORTH - 60}, {WEST + 50}]]"
SECTION = "\nsections: [{name: bridge, line: %s}]\n"
HOUSE = "\nreceptors: [{name: house, polygon: %s}]\n"
DAM = "\nstructures: [{kind: dam, line: %s, height: 2, side_slope: 34, crest_width: 1}]\n"
BUILDING = "\nstructures: [{kind: building, polygon: %s}]\n"


@pytest.mark.parametrize(
    ("more", "key", "found"),
    [
        (SECTION % FAR_OFF, "sections.0.line: expected a section", "x from 2700000 to 2700000"),
        (SECTION % EXCHANGED, "sections.0.line: expected a section", "exchange them: eastings come first"),
        (
            HOUSE % FAR_OFF.replace("]]", "], [2700050, 1300050]]"),
            "receptors.0: expected a receptor",
            "found 'house' outside, x from 2700000 to 2700050",
        ),
        (
            HOUSE % EXCHANGED.replace("]]", f"], [{NORTH - 60}, {WEST + 90}]]"),
            "receptors.0: expected a receptor",
            "exchange them: eastings come first",
        ),
        (DAM % FAR_OFF, "structures.0.line: expected a dam", "y from 1300000 to 1300050 m"),
        (
            BUILDING % FAR_OFF.replace("]]", "], [2700050, 1300050]]"),
            "structures.0.polygon: expected a building",
            "found one outside",
        ),
    ],
)
def test_what_lies_off_an_elevation_model_whose_domain_is_found(folder, more, key, found):
    with pytest.raises(BadInput) as caught:
        load([written(folder, TEXT + more, SEARCHED)])
    (one,) = str(caught.value).splitlines()
    assert f"{key} on the elevation model, which covers x from {WEST:.12g} to" in one
    assert found in one


CHECK = "check the reference systems of releases.gpkg and of the elevation model, EPSG:2056"
EASTINGS = "exchange them: eastings come first"


@pytest.mark.parametrize(
    ("release", "said"),
    [
        ((NORTH - 120, WEST + 20, NORTH - 80, WEST + 50), f"y from 2600020 to 2600050 m; {EASTINGS}"),
        ((390_000, 5_200_000, 390_050, 5_200_050), f"y from 5200000 to 5200050 m; {CHECK}"),
    ],
    ids=["exchanged", "another system"],
)
def test_a_release_outside_of_a_domain_is_told_with_its_place(folder, release, said):
    shapes(folder, shapely.box(*release))
    west, _, east, _ = release
    where = f"outside, x from {west:.12g} to {east:.12g} and {said}"
    assert line_of(folder, TEXT.replace(*DEPTH)).endswith(f"found 'slide' of releases.gpkg {where}")


@pytest.mark.parametrize(
    ("more", "key"),
    [
        (SECTION % EXCHANGED, "sections.0.line"),
        (DAM % EXCHANGED, "structures.0.line"),
        (HOUSE % EXCHANGED.replace("]]", f"], [{NORTH - 60}, {WEST + 90}]]"), "receptors.0"),
    ],
)
def test_coordinates_that_are_exchanged_are_told_within_a_domain(folder, more, key):
    found = line_of(folder, TEXT + more)
    assert key in found
    assert found.endswith(EASTINGS)


def test_a_domain_off_the_elevation_model_is_told_with_what_may_be_meant(folder):
    west, south, east, north = WEST + 2.5, NORTH - 197.5, WEST + 297.5, NORTH - 2.5
    exchanged = f"domain: {{x: [{south}, {north}], y: [{west}, {east}]}}"
    assert line_of(folder, TEXT.replace(DOMAIN, exchanged)).endswith(EASTINGS)
    degrees = "domain: {x: [7.43, 7.45], y: [46.9, 47]}"
    assert line_of(folder, TEXT.replace(DOMAIN, degrees)).endswith(
        "found [7.43, 7.45]; write coordinates of its reference system, EPSG:2056"
    )


def line_of(folder, text):
    with pytest.raises(BadInput) as caught:
        load([written(folder, text)])
    (one,) = str(caught.value).splitlines()
    return one


def test_a_release_of_another_reference_system_than_it_says(folder):
    shapes(folder, shapely.box(7.4, 46.9, 7.5, 47.0))
    with pytest.raises(BadInput) as caught:
        load([written(folder, TEXT, DEPTH, SEARCHED)])
    found = str(caught.value)
    assert "release: expected a release on the elevation model, which covers x from" in found
    assert "found 'slide' of releases.gpkg outside, x from 7.4 to 7.5 and y from 46.9 to 47 m" in found
    assert "check the reference systems of releases.gpkg and of the elevation model, EPSG:2056" in found


def test_map_coordinates_in_a_file_that_says_degrees(folder):
    shapes(
        folder,
        shapely.box(WEST + 20, NORTH - 120, WEST + 50, NORTH - 80),
        crs="EPSG:4326",
        name="releases.geojson",
    )
    found = line(folder, DEPTH, ("releases.gpkg", "releases.geojson"))
    assert "expected degrees, as in EPSG:4326, which GeoJSON is in where it says nothing else" in found
    assert f"feature 1 ('slide') of releases.geojson at {WEST + 20:.12g}, {NORTH - 120:.12g}" in found


def test_a_reference_system_beside_another_one_of_the_file_is_not_passed_over(folder):
    change = ("elevation: dem.tif", "elevation: dem.tif, crs: EPSG:%s")
    found = line(folder, (change[0], change[1] % 21781))
    assert found.startswith("terrain.crs: expected EPSG:2056, the reference system of the file itself")
    assert "found EPSG:21781; leave it out (dem.tif)" in found
    assert told(folder, (change[0], change[1] % 2056)) == told(folder)


@pytest.mark.parametrize("kind", ["building", "basin"])
def test_corners_of_a_structure_that_cross(folder, kind):
    corners = [(60, -100), (90, -70), (90, -100), (60, -70)]
    written_as = ", ".join(f"[{WEST + x:.12g}, {NORTH + y:.12g}]" for x, y in corners)
    more = {"building": "", "basin": ", depth: 2, side_slope: 34"}[kind]
    text = f"\nstructures: [{{kind: {kind}, polygon: [{written_as}]{more}}}]\n"
    for change in ((), (SEARCHED,)):
        with pytest.raises(BadInput, match=r"structures\.0\.polygon: expected corners of a simple polygon"):
            load([written(folder, TEXT + text, *change)])


def test_ground_at_exactly_0_beside_high_ground_is_warned_of(folder):
    elevation = ground()
    elevation[:, 40:44] = 0.0
    write_raster(folder / "dem.tif", elevation)
    assert "6.7 % of the domain are at exactly 0 m beside ground above 50 m: if this means no data" in told(
        folder
    )
    write_raster(folder / "dem.tif", ground())
    assert "exactly 0 m" not in told(folder)
    # near the sea 0 is an elevation
    elevation = ground() - ground().min()
    write_raster(folder / "dem.tif", elevation)
    assert "exactly 0 m" not in told(folder)


def test_a_section_outside_a_given_domain_keeps_its_digits(folder):
    text = TEXT + SECTION % f"[[{WEST + 900}, {NORTH - 50}], [{WEST + 900}, {NORTH - 40}]]"
    with pytest.raises(BadInput) as caught:
        load([written(folder, text)])
    expected = f"x [{WEST:.12g}, {WEST + 300:.12g}] and y [{NORTH - 200:.12g}, {NORTH:.12g}]"
    assert f"expected a section inside the domain, {expected}, found [2600900, 1200350]" in str(caught.value)


def test_a_receptor_whose_coordinates_are_exchanged(folder):
    place = f"\nreceptors: [{{name: house, point: [{NORTH - 100}, {WEST + 100}]}}]\n"
    with pytest.raises(BadInput, match=r"receptors\.0: expected places in .* eastings come first$"):
        load([written(folder, TEXT + place)])


def boxes(folder, *extents, layer=None, **fields):
    """Write polygons with attributes: a list of values for each."""
    made = [shapely.box(WEST + w, NORTH + s, WEST + e, NORTH + n) for w, s, e, n in extents]
    columns = [np.array(v, dtype=object if isinstance(v[0], str) else None) for v in fields.values()]
    pyogrio.raw.write(
        folder / "releases.gpkg", np.array(shapely.to_wkb(made), dtype=object), columns, list(fields),
        crs="EPSG:2056", geometry_type="Polygon", layer=layer, append=layer is not None,
    )  # fmt: skip


ALL = (", name: slide", "")


def test_polygons_that_overlap_add_up(folder):
    small, large = (20, -120, 50, -80), (10, -130, 60, -70)
    boxes(folder, small, large, name=["30", "300"], depth=[1.5, 2.0])
    first = (
        "release: '30' of releases.gpkg and '300' of releases.gpkg overlap by 1200 m2, 100 % of the smaller"
    )
    for change in ((ALL,), (ALL, SEARCHED)):
        assert (f"{first}; 1.5 and 2 m add up there: sweep `release.name` for events of their own") in told(
            folder, *change
        )
    assert "overlap" not in told(folder, ("name: slide", "name: '30'"))
    # 4,200 m3 on 1,200 and 3,000 m2
    assert "; 1 and 1 m add up there" in told(folder, (", name: slide", ", volume: 4200"))
    apart = "sweep: {release.name: ['30', '300']}\ntime:"
    assert "overlap" not in told(folder, ("name: slide", "name: '30'"), ("time:", apart))
    # what is shared is a part of a cell
    boxes(folder, small, (49.9, -120, 80, -80), name=["a", "b"], depth=[1.5, 2.0])
    assert "overlap" not in told(folder, ALL)
    boxes(folder, small, small, name=["slide", "slide"], depth=[1.5, 1.5])
    found = told(folder)
    assert "are the same polygon; 1.5 and 1.5 m add up there: leave one out" in found
    assert "2 polygons of releases.gpkg are called 'slide', and all of them are released" in found


def test_depths_that_are_hardly_meant(folder):
    boxes(folder, (20, -120, 50, -80), name=["slide"], depth=[150.0])
    said = "release: releases.gpkg: a depth of {} m is far from what is usual, 100 m at most: check the unit"
    assert said.format(150) in told(folder)
    assert said.format(120) in told(folder, ("name: slide", "name: slide, depth: 120"))
    # 1200 m2
    assert said.format("8.33e+05") in told(folder, ("name: slide", "name: slide, volume: 1.0e9"))
    assert "far from" not in told(folder, ("name: slide", "name: slide, volume: 1.0e5"))


def test_a_polygon_narrower_than_a_cell(folder):
    boxes(folder, (20, -120, 20.5, -60), name=["slide"], depth=[1.5])
    assert "'slide' of releases.gpkg is about 0.5 m wide, narrower than a cell of 5 m" in told(folder)
    boxes(folder, (20, -120, 25, -60), name=["slide"], depth=[1.5])
    assert "wide" not in told(folder)


def test_attributes_are_used_however_they_are_written(folder):
    boxes(folder, (20, -120, 50, -80), NAME=["slide"], DEPTH=[1.5], Return_Period=[30])
    (scenario,) = load([written(folder, TEXT, ("time:", "return_periods: polygons\ntime:"))])
    ((outline,),) = scenario.ground.outlines.values()
    assert outline.attributes == {"NAME": "slide", "depth": 1.5, "return_period": 30}
    assert scenario.settings.return_periods == (30.0,)


@pytest.mark.parametrize(
    ("fields", "said"),
    [
        ({"depth": ["1.5"]}, "found 'slide' with depth '1.5', which is text (releases.gpkg)"),
        ({"depth": [-1.0]}, "found 'slide' with depth -1 (releases.gpkg)"),
        ({"volume": [-5.0]}, "found 'slide' with volume -5 (releases.gpkg)"),
        ({"height": [1.0], "kind": [2]}, "found 'slide' with the attributes name, height, kind (rel"),
    ],
)
def test_attributes_that_are_no_depth(folder, fields, said):
    boxes(folder, (20, -120, 50, -80), name=["slide"], **fields)
    assert said in line(folder)
    periods = ("time:", "return_periods: polygons\ntime:")
    with_depth = ("name: slide", "name: slide, depth: 1")
    with pytest.raises(BadInput, match="return_period of each polygon above 0, in years, found 'slide' with"):
        load([written(folder, TEXT, periods, with_depth)])


def test_features_without_a_shape_are_left_out(folder):
    whole = shapely.box(WEST + 20, NORTH - 120, WEST + 50, NORTH - 80)
    shapes(folder, whole, shapely.Polygon())
    found = told(folder, DEPTH)
    assert "release.polygons: 1 of 2 features of releases.gpkg have no shape and are left out" in found
    shapes(
        folder,
        shapely.box(WEST + 110, NORTH - 105, WEST + 120, NORTH - 95),
        shapely.Polygon(),
        name="huts.gpkg",
    )
    found = told(folder, DEPTH, RECEPTORS)
    assert "receptors: 1 of 2 features of huts.gpkg have no shape and are left out" in found
    shapes(folder, shapely.Polygon())
    assert "expected polygons, found none in releases.gpkg" in line(folder, DEPTH)


def test_doubts_of_each_elevation_model_of_a_sweep(folder):
    elevation = ground()
    elevation[:, 40:44] = -9999.0
    write_raster(folder / "later.tif", elevation)
    found = told(folder, ("time:", "sweep: {terrain.elevation: [dem.tif, later.tif]}\ntime:"))
    assert "terrain.elevation: later.tif: 6.7 % of the domain have no data" in found
    assert "dem.tif: " not in found


RECEPTORS = ("time:", "receptors: huts.gpkg\ntime:")


def test_receptors_of_a_file_that_lie_off_the_elevation_model(folder):
    write_polygons(folder / "huts.gpkg", {"barn": (110, -105, 120, -95), "far": (9000, -105, 9100, -95)})
    where = "receptors: of 2 places of huts.gpkg 1 lie outside the {} and are left out: 'far'"
    assert where.format("domain") in told(folder, RECEPTORS)
    assert where.format("elevation model") in told(folder, RECEPTORS, SEARCHED)
    write_polygons(folder / "huts.gpkg", {"far": (9000, -105, 9100, -95)})
    for change, place in (((), "in the domain"), ((SEARCHED,), "on the elevation model")):
        with pytest.raises(BadInput, match=f"expected places {place}, found 1 outside"):
            load([written(folder, TEXT, RECEPTORS, *change)])


def test_a_receptor_on_no_data(folder):
    elevation = ground()
    elevation[:, 40:] = -9999.0
    write_raster(folder / "dem.tif", elevation)
    write_polygons(folder / "huts.gpkg", {"barn": (110, -105, 120, -95), "hut": (210, -105, 220, -95)})
    found = "receptors: the elevation model has no data at 'hut', which nothing reaches: fill it"
    assert found in told(folder, RECEPTORS)
    place = f"receptors: [{{name: hut, point: [{WEST + 210}, {NORTH - 100}]}}]\ntime:"
    assert found in told(folder, ("time:", place))
    assert "which nothing reaches" not in told(
        folder, ("time:", place.replace(str(WEST + 210), str(WEST + 110)))
    )


def test_receptors_of_one_layer_of_a_file(folder):
    for layer, east in (("houses", 110), ("roads", 150)):
        box = shapely.box(WEST + east, NORTH - 105, WEST + east + 10, NORTH - 95)
        pyogrio.raw.write(
            folder / "huts.gpkg", np.array([shapely.to_wkb(box)], dtype=object),
            [np.array([layer], dtype=object)], ["name"], layer=layer, crs="EPSG:2056",
            geometry_type="Polygon", append=layer == "roads",
        )  # fmt: skip
    assert "write `receptors: {file: huts.gpkg, layer: houses}`" in line(folder, RECEPTORS)
    change = ("time:", "receptors: {file: huts.gpkg, layer: %s}\ntime:")
    for more in ((), (SEARCHED,)):
        (scenario,) = load([written(folder, TEXT, (change[0], change[1] % "roads"), *more)])
        assert [each.name for each in scenario.settings.places] == ["roads"]
    assert "found 'dams'" in line(folder, (change[0], change[1] % "dams"))
    assert "receptors.name: expected one of the keys file, layer" in line(
        folder, (change[0], change[1] % "roads, name: a")
    )


TWO = {"slide": (20, -120, 50, -80), "rock": (20, -60, 50, -20)}


def swept(*keys, values="[1, 2]"):
    return ("time:", f"sweep: {{{', '.join(f'{key}: {values}' for key in keys)}}}\ntime:")


def released(folder, *changes):
    """Depth or volume of each release of each run, by the south end of the outline, m."""
    (scenario,) = load([written(folder, TEXT, *changes)])
    made = [outlined(run.settings, run.outlines) for run in expand(scenario)]
    return [
        {
            round(float(min(ring[1] for ring in each.rings[0]) - NORTH)): each.depth or each.volume
            for each in run
        }
        for run in made
    ], list(expand(scenario).parameters(0))


def test_keys_of_a_sweep_call_polygons_by_name(folder):
    write_polygons(folder / "releases.gpkg", TWO)
    single = (", name: slide", "")
    for key in ("release.slide.depth", "release.0.slide.depth", "release.each.slide.depth"):
        found = [{-120: depth, -60: 1.5} for depth in (1, 2)]
        assert released(folder, single, swept(key)) == (found, [key.replace(".", "_")])
    assert released(folder, single, swept("release.rock.volume"))[0] == [{-120: 1.5, -60: v} for v in (1, 2)]
    # volume is that of the others
    found, _ = released(folder, (", name: slide", ", volume: 700"), swept("release.slide.depth"))
    assert found == [{-120: d, -60: 700} for d in (1, 2)]
    found, names = released(folder, single, swept("release.slide.depth", "release.rock.depth"))
    assert found == [{-120: a, -60: b} for a in (1, 2) for b in (1, 2)]
    assert names == ["release_slide_depth", "release_rock_depth"]
    # what the release asks for
    for key in ("release.slide.volume", "release.0.slide.volume", "release.volume"):
        assert released(folder, swept(key, values="[700, 900]"))[0] == [{-120: 700}, {-120: 900}]
    several = (
        "release: {polygons: releases.gpkg, name: slide}",
        "release: [{polygons: releases.gpkg, name: slide}, {polygons: releases.gpkg, name: rock}]",
    )
    for key in ("release.rock.depth", "release.1.rock.depth", "release.1.depth"):
        assert released(folder, several, swept(key))[0] == [{-120: 1.5, -60: d} for d in (1, 2)]


def test_keys_of_a_sample_call_polygons_by_names_with_any_signs(folder):
    write_polygons(folder / "releases.gpkg", {"St. Anton / 1": TWO["slide"], "St. Anton - 1": TWO["rock"]})
    draws = "{distribution: discrete, values: [2]}"
    keys = ("release.St. Anton / 1.depth", "release.St. Anton - 1.depth")
    sample = f"sample: {{count: 1, values: {{{', '.join(f'{key}: {draws}' for key in keys)}}}}}\ntime:"
    found, names = released(folder, (", name: slide", ""), ("time:", sample))
    assert found == [{-120: 2, -60: 2}]
    assert names == ["release_St__Anton___1_depth_0", "release_St__Anton___1_depth_1"]


def test_keys_of_a_sweep_call_layers_by_name(folder):
    for layer, box in TWO.items():
        boxes(folder, box, depth=[1.5], layer=layer)
    layered = ("name: slide", "layer: slide")
    assert released(folder, layered, swept("release.slide.depth"))[0] == [{-120: 1}, {-120: 2}]


def test_names_of_polygons_that_are_none_or_several(folder):
    write_polygons(folder / "releases.gpkg", TWO)
    single = (", name: slide", "")
    wanted = "sweep.release.slid.depth.0: expected one of the polygons slide, rock, found 'slid'"
    assert line(folder, single, swept("release.slid.depth", values="[1]")) == (
        f"{wanted}. Did you mean 'slide'? (releases.gpkg)"
    )
    wanted = "sweep.release.rock.depth.0: expected one of the polygons slide, found 'rock' (releases.gpkg)"
    assert line(folder, swept("release.rock.depth", values="[1]")) == wanted
    assert line(folder, swept("release.Slide.deph")).endswith("Did you mean 'depth'?")
    assert "expected one of the polygons slide, rock, found 'Slide'. Did you mean 'slide'?" in line(
        folder, ("name: slide", "name: Slide")
    )
    both = (
        "release: {polygons: releases.gpkg, name: slide}",
        "release: [{polygons: releases.gpkg}, {polygons: releases.gpkg}]",
    )
    found = line(folder, both, swept("release.slide.depth"))
    assert found.endswith("Write release.0.slide.depth or release.1.slide.depth")
    boxes(folder, *TWO.values(), name=["slide", "slide"], depth=[1.5, 1.5])
    assert line(folder, single, swept("release.slide.depth", values="[1]")) == (
        "sweep.release.slide.depth.0: expected one polygon called 'slide', found 2; "
        "give each of them a name of its own (releases.gpkg)"
    )
    assert line(folder, swept("release.slide.depth")) == (
        "sweep.release.slide.depth: expected the name of one polygon, found 'slide' of 2 of releases.gpkg; "
        "give each of them a name of its own"
    )
    for layer in TWO:
        boxes(folder, *TWO.values(), name=list(TWO), depth=[1.5, 1.5], layer=layer)
    assert line(folder, ("name: slide", "layer: slide"), swept("release.slide.depth")) == (
        "sweep.release.slide.depth: expected the name of a layer or of a polygon, found 'slide', which is "
        "that of both; write release.each.slide.depth for the polygon"
    )


def test_what_single_polygons_have_of_their_own(folder):
    write_polygons(folder / "releases.gpkg", TWO)
    own = (", name: slide", ", each: {slide: {depth: 3}}")
    assert released(folder, own)[0] == [{-120: 3, -60: 1.5}]
    where = "release.each.slide"
    neither = own[1].replace("depth: 3", "")
    assert line(folder, (own[0], neither)) == f"{where}.depth: expected depth or volume, found neither"
    both = own[1].replace("3", "3, volume: 2")
    assert line(folder, (own[0], both)) == f"{where}.depth: expected either depth or volume, found both"
    none = "expected one of the polygons slide, rock, found 'slice'. Did you mean 'slide'? (releases.gpkg)"
    assert line(folder, (own[0], own[1].replace("slide", "slice"))) == f"release: {none}"
    assert f"{where}.dept: " in line(folder, (own[0], own[1].replace("depth", "dept")))
