"""Files of maps, opened by the programs that they are for."""

import hashlib
import json
import os
import re
import shutil
import sqlite3
import subprocess
from pathlib import Path
from xml.etree import ElementTree as Xml

import numpy as np
import pyogrio
import pytest
import rasterio
import xarray as xr
from PIL import Image
from root import ROOT

from pipeline.assess.ensemble import ensemble
from pipeline.gis.qml import raster_style
from pipeline.gis.raster import OUTSIDE, UNKNOWN
from pipeline.gis.stac import EXTENSIONS, SHA_256
from pipeline.gis.symbology import of_differences
from pipeline.hazard.layers import layers
from pipeline.hazard.map_files import write_differences, write_maps, write_place
from pipeline.hazard.mapping import map_hazard
from pipeline.settings.hazard import Georeference, Hazard

X, Y = np.arange(0.0, 401, 5), np.arange(-100.0, 101, 5)
GROUND = Georeference(crs="EPSG:2056", origin=(2_700_000, 1_200_000), azimuth=120)
RECEPTORS = [
    {"name": "Schützenhaus", "point": [150, 20], "line": None, "polygon": None},
    {"name": "road", "point": None, "line": [[250, -90], [250, 90]], "polygon": None},
    {"name": "school", "point": None, "line": None, "polygon": [[300, -10], [320, -10], [310, 10]]},
]
# Python of the system, which Debian's QGIS belongs to
SYSTEM = "/usr/bin/python3"


def has_qgis() -> bool:
    command = [SYSTEM, "-c", "import qgis.core"]
    alone = {name: value for name, value in os.environ.items() if name != "PYTHONPATH"}
    return Path(SYSTEM).exists() and subprocess.run(command, env=alone, capture_output=True).returncode == 0


def mapped(thresholds=(1.0,), status=(1, 1, 1, 2)):
    """Map four runs along a plane, of which one failed."""
    reach = np.array([100, 200, 300, 350])[:, None, None]
    wet = (reach >= X) & (np.abs(Y)[:, None] <= 60)
    dims = ("run", "y", "x")
    runs = xr.Dataset(
        {
            "max_depth": (dims, np.where(wet, 1.5, 0).astype(np.float32)),
            "max_speed": (dims, np.where(wet, 2.0, 0).astype(np.float32)),
            "arrival_time": (dims, np.where(wet, X / 10, np.nan).astype(np.float32)),
            "status": ("run", np.array(status, np.int8)),
        },
        coords={
            "x": X,
            "y": Y,
            "elevation": ("x", 800 - 0.3 * X),
            "horizontal_distance": ("x", 0.95 * X),
            "return_period": ("run", [30.0, 100.0, 300.0, 1000.0]),
        },
        attrs={"title": "plane"},
    )
    found = map_hazard(ensemble(runs), Hazard(depth=thresholds, speed=(), quantiles=(0.5,)))
    return found.assign_attrs(
        title="plane",
        georeference=GROUND.model_dump_json(),
        receptors=json.dumps(RECEPTORS),
        releases=json.dumps([[[0, -20], [40, -20], [40, 20], [0, 20], [0, -20]]]),
    )


@pytest.fixture(scope="module")
def place(tmp_path_factory):
    """Folder of maps of one scenario, with project and item."""
    folder = tmp_path_factory.mktemp("place")
    (folder / "plane").mkdir()
    written = write_maps(mapped(), folder / "plane")
    write_place([written], folder, "place")
    return folder


def test_every_raster_has_one_band_and_a_style_of_its_own(place):
    rasters = sorted((place / "plane").glob("*.tif"))
    names = {path.stem for path in rasters}
    assert {"depth_above_1", "depth_above_1_lower", "depth_above_1_upper", "elevation"} <= names
    # what no missing run can change has no bounds
    assert "earliest_arrival_time_upper" not in names
    for path in rasters:
        with rasterio.open(path) as opened:
            assert (opened.count, opened.crs.to_epsg()) == (1, 2056)
            assert opened.descriptions[0]
        style = Xml.parse(path.with_suffix(".qml"))
        assert style.find("pipe/rasterrenderer") is not None


def test_classes_have_colours_and_names_in_the_file(place):
    path = place / "plane" / "hazard_level.tif"
    with rasterio.open(path) as opened:
        colours = opened.colormap(1)
        assert opened.nodata == OUTSIDE
        assert opened.colorinterp[0].name == "palette"
        assert [*opened.overviews(1)] == [2] or opened.shape[0] < 129
    assert colours[4] == (0xD7, 0x35, 0x2B, 255)
    assert colours[0] == (255, 255, 255, 255)
    table = Xml.parse(path.with_name(f"{path.name}.aux.xml")).find("PAMRasterBand/GDALRasterAttributeTable")
    words = {row.findall("F")[0].text: row.findall("F")[1].text for row in table.iter("Row")}
    assert words["4"] == "high (red)"
    assert words[str(UNKNOWN)] == "not computed"


@pytest.mark.skipif(shutil.which("gdalinfo") is None, reason="gdalinfo is not installed (gdal-bin)")
def test_gdal_reads_the_attribute_table(place):
    command = ["gdalinfo", "-json", place / "plane" / "hazard_level.tif"]
    shown = json.loads(subprocess.run(command, capture_output=True, text=True, check=True).stdout)
    assert shown["rat"]["row"][4]["f"][:2] == [4, "high (red)"]
    assert shown["bands"][0]["colorInterpretation"] == "Palette"


def test_the_geopackage_has_a_layer_a_map_and_what_is_marked(place):
    path = place / "plane" / "maps.gpkg"
    held = dict(pyogrio.list_layers(path))
    maps = {layer.name for layer in layers(mapped())}
    marks = {"receptor_points", "receptor_lines", "receptor_polygons", "release", "profile_line", "domain"}
    assert maps | marks | {"layer_styles"} == set(held)
    about = pyogrio.read_info(path, layer="depth_quantile_0.5")
    assert {"class", "lower", "upper", "units", "bound", "area_m2", "runs_done"} <= set(about["fields"])
    assert pyogrio.read_info(path, layer="receptor_points")["encoding"] == "UTF-8"
    with sqlite3.connect(path) as base:
        styles = dict(base.execute("SELECT f_table_name, styleQML FROM layer_styles WHERE useAsDefault"))
        titles = dict(base.execute("SELECT column_name, title FROM gpkg_data_columns"))
        (name,) = base.execute("SELECT name FROM receptor_points").fetchone()
    base.close()
    assert set(styles) == maps | marks
    for text in styles.values():
        assert Xml.fromstring(text.partition("\n")[2]).find("renderer-v2/symbols/symbol") is not None
    assert titles["area_m2"] == "area (m²)"
    assert name == "Schützenhaus"


def test_polygons_of_a_map_cover_its_classes(place):
    _, _, shapes, columns = pyogrio.raw.read(place / "plane" / "maps.gpkg", layer="depth_quantile_0.5")
    about = pyogrio.read_info(place / "plane" / "maps.gpkg", layer="depth_quantile_0.5")
    rows = [dict(zip(about["fields"], row, strict=True)) for row in zip(*columns, strict=True)]
    # half of the events, which is the most frequent one, reach 100 m at 1.5 m deep
    deepest = [row for row in rows if row["bound"] == "estimate" and row["class"] == "1 to 2"]
    assert len(shapes) == len(rows)
    assert deepest[0]["area_m2"] == pytest.approx(100 * 0.95 * 120, rel=0.07)


def test_the_project_names_files_beside_it(place):
    root = Xml.fromstring((place / "hazard.qgs").read_text(encoding="utf-8").partition("\n")[2])
    sources = [layer.findtext("datasource") for layer in root.iter("maplayer")]
    assert len(sources) > 30
    for source in sources:
        assert source.startswith("./plane/")
        assert (place / source.partition("|")[0]).exists()
    listed = {leaf.get("id") for leaf in root.iter("layer-tree-layer")}
    assert listed == {layer.findtext("id") for layer in root.iter("maplayer")}
    assert root.find("projectCrs/spatialrefsys/authid").text == "EPSG:2056"


@pytest.fixture(scope="module")
def item(place):
    return json.loads((place / "item.json").read_text(encoding="utf-8"))


class TestTheItem:
    def test_has_all_that_stac_asks_for(self, place, item):
        assert (item["type"], item["stac_version"], item["id"]) == ("Feature", "1.0.0", "place")
        assert {"geometry", "bbox", "properties", "links", "assets"} <= set(item)
        assert re.fullmatch(r"\d{4}-\d\d-\d\dT\d\d:\d\d:\d\dZ", item["properties"]["datetime"])
        west, south, east, north = item["bbox"]
        assert 8.7 < west < east < 8.8
        assert 46.9 < south < north < 47.0
        ring = item["geometry"]["coordinates"][0]
        assert ring[0] == ring[-1]
        for asset in item["assets"].values():
            assert (place / asset["href"]).exists()
            assert asset["type"]
        assert "3 of 4 runs done (1 failed)" in item["properties"]["description"]

    def test_passes_the_schema_of_stac(self, item):
        pystac = pytest.importorskip("pystac", reason="pystac is not installed")
        validation = pytest.importorskip("pystac.validation.stac_validator")
        # schemas of the newest version come with pystac; items of 1.0.0 are brought to it without loss
        newest = pystac.Item.from_dict(item, migrate=True).to_dict()
        check = validation.JsonSchemaSTACValidator().validate_core
        kind = pystac.STACObjectType.ITEM
        check(newest, kind, newest["stac_version"])
        with pytest.raises(pystac.STACValidationError):
            check({**newest, "geometry": None, "bbox": [1]}, kind, newest["stac_version"])

    def test_says_where_the_cells_of_each_raster_lie(self, place, item):
        assert item["properties"]["proj:epsg"] == 2056
        for path in (place / "plane").glob("*.tif"):
            asset = item["assets"][f"plane/{path.name}"]
            with rasterio.open(path) as opened:
                assert asset["proj:shape"] == [*opened.shape]
                assert asset["proj:transform"] == [*opened.transform][:6]
                (band,) = asset["raster:bands"]
                assert band["data_type"] == opened.dtypes[0]
                assert str(band["nodata"]) == f"{opened.nodata:g}"
                assert band.get("unit", "") == (opened.units[0] or "")
                assert band["spatial_resolution"] == opened.res[0]

    def test_names_classes_with_their_colours(self, item):
        (band,) = item["assets"]["plane/hazard_level.tif"]["raster:bands"]
        classes = {each["value"]: each for each in band["classification:classes"]}
        assert classes[4] == {"value": 4, "description": "high (red)", "color_hint": "d7352b"}
        assert all(re.fullmatch("[0-9a-f]{6}", each["color_hint"]) for each in classes.values())

    def test_has_sizes_and_digests_of_all_files(self, place, item):
        assert {each.partition("/v")[0].rpartition("/")[2] for each in EXTENSIONS} == {
            *("projection", "file", "raster", "classification")
        }
        for asset in item["assets"].values():
            held = (place / asset["href"]).read_bytes()
            assert asset["file:size"] == len(held)
            assert asset["file:checksum"] == SHA_256 + hashlib.sha256(held).hexdigest()


def test_maps_of_other_thresholds_are_removed_and_nothing_else(tmp_path):
    for name in ("notes.txt", "depth_above_my_house.png", "outlines.gpkg"):
        (tmp_path / name).write_text("kept")
    write_maps(mapped((0.5, 1.0)), tmp_path)
    before = {path.name for path in tmp_path.iterdir()}
    write_maps(mapped((1.0,), status=(1, 1, 1, 1)), tmp_path)
    gone = before - {path.name for path in tmp_path.iterdir()}
    assert {"depth_above_0.5.tif", "depth_above_0.5.qml", "depth_above_0.5.png"} <= gone
    # no run is missing any more
    assert {"depth_above_1_lower.tif", "depth_above_1_upper.qml"} <= gone
    kept = {path.name for path in tmp_path.iterdir()}
    assert {"notes.txt", "depth_above_my_house.png", "depth_above_1.tif", "depth_above_1.png"} <= kept
    assert "outlines.gpkg" not in kept


GDAL = all(map(shutil.which, ("gdalinfo", "ogrinfo")))


@pytest.mark.skipif(not GDAL, reason="gdalinfo and ogrinfo are not installed (gdal-bin)")
def test_gdal_opens_every_file(place):
    opened = 0
    for path in sorted((place / "plane").iterdir()):
        if path.suffix in (".tif", ".png", ".nc"):
            command = ["gdalinfo", path]
        elif path.suffix == ".gpkg":
            command = ["ogrinfo", "-so", "-al", path]
        else:
            continue
        shown = subprocess.run(command, capture_output=True, text=True, check=False)
        assert shown.returncode == 0, shown.stderr
        assert "ERROR" not in shown.stderr
        assert (
            "Coordinate System is" in shown.stdout or "Layer SRS WKT" in shown.stdout or path.suffix != ".tif"
        )
        opened += 1
    assert opened > 20


@pytest.mark.skipif(not has_qgis(), reason="QGIS is not installed (python3-qgis)")
def test_qgis_opens_all_of_it_and_shows_the_colours_of_the_classes(place, tmp_path):
    picture = tmp_path / "seen.png"
    wanted = ["scenario_0_hazard_level"]
    command = [SYSTEM, ROOT / "tests" / "support" / "qgis_look.py", place / "hazard.qgs", picture, *wanted]
    alone = {name: value for name, value in os.environ.items() if name != "PYTHONPATH"}
    shown = subprocess.run(
        command,
        capture_output=True,
        text=True,
        check=False,
        env=alone | {"QT_QPA_PLATFORM": "offscreen"},
        timeout=180,
    )
    assert shown.returncode == 0, shown.stderr
    seen = json.loads(shown.stdout.strip().splitlines()[-1])
    assert seen["read"] is True
    assert seen["crs"] == "EPSG:2056"
    assert {
        "scenario_0_receptor_points",
        "scenario_0_release",
        "scenario_0_depth_above_1",
        "scenario_0_elevation",
    } <= set(seen["checked"])
    # each leaf of the tree is a layer, and each layer is in the tree
    assert set(seen["listed"]) == set(seen["layers"])
    assert all(each["valid"] and each["crs"] == "EPSG:2056" for each in seen["layers"].values())
    opened = seen["opened"]
    assert all(each["valid"] for each in opened.values())
    assert opened["hazard_level.tif"]["classes"]["high (red)"] == "#d7352b"
    assert opened["depth_above_1.tif"]["renderer"] == "singlebandpseudocolor"
    assert opened["elevation.tif"]["renderer"] == "hillshade"
    assert opened["maps.gpkg|hazard_level"]["renderer"] == "RuleRenderer"
    with Image.open(picture) as image:
        colours = {colour for count, colour in image.convert("RGB").getcolors(1 << 24) if count > 50}
    assert (0xD7, 0x35, 0x2B) in colours


class TestDifferences:
    """Maps of two scenarios beside each other, of shares that go from all runs to none."""

    def test_colour_all_but_where_nothing_differs(self):
        style = of_differences("share", "1", 1.0)
        items = [
            (float(item.get("value")), int(item.get("alpha"))) for item in raster_style(style).iter("item")
        ]
        # a colour reaches from the value before it up to its own
        drawn = {
            value: next(alpha for upper, alpha in items if value <= upper) for value in (-1, -0.5, 0, 0.5, 1)
        }
        assert drawn == {-1: 255, -0.5: 255, 0: 0, 0.5: 255, 1: 255}

    def test_of_values_keep_zero_free_where_it_is_an_edge(self):
        style = of_differences("depth", "m", 0.8)
        assert 0 in style.edges
        items = [
            (float(item.get("value")), int(item.get("alpha"))) for item in raster_style(style).iter("item")
        ]
        assert [value for value, _ in items] == sorted(value for value, _ in items)
        drawn = {
            value: next(alpha for upper, alpha in items if value <= upper) for value in (-0.8, -0.1, 0, 0.1)
        }
        assert drawn == {-0.8: 255, -0.1: 255, 0: 0, 0.1: 255}

    def test_are_written_as_hazard_maps_are(self, tmp_path):
        one, other = mapped((1.0,), status=(1, 1, 1, 1)), mapped((1.0,), status=(1, 1, 1, 1))
        found = xr.Dataset(coords=one.coords)
        for bound in ("", "_lower", "_upper"):
            name = f"depth_exceedance{bound}"
            less = other[name] * 0 - one[name]
            about = {"long_name": "difference of the share", "units": "1"}
            found[f"depth_exceedance_difference{bound}"] = less.assign_attrs(about)
        about = {**one.attrs, "title": "without less with", "comment": "4 of 4 runs done"}
        (tmp_path / "speed_above_1_difference.tif").write_text("of other thresholds")
        written = write_differences(found.assign_attrs(about), tmp_path, "without-with")
        names = {path.name for path in written}
        assert {
            "depth_above_1_difference.tif",
            "depth_above_1_difference.qml",
            "maps.gpkg",
            "hazard.qgs",
        } <= names
        assert not (tmp_path / "speed_above_1_difference.tif").exists()
        with rasterio.open(tmp_path / "depth_above_1_difference.tif") as opened:
            assert np.nanmin(opened.read(1)) == -1
        _, _, shapes, columns = pyogrio.raw.read(tmp_path / "maps.gpkg", layer="depth_above_1_difference")
        fields = pyogrio.read_info(tmp_path / "maps.gpkg", layer="depth_above_1_difference")["fields"]
        areas = dict(
            zip(columns[list(fields).index("class")], columns[list(fields).index("area_m2")], strict=True)
        )
        # what all events reach is of the lowest class, and what none reaches of none
        assert areas["-1 to -0.9"] == pytest.approx(100 * 0.95 * 120, rel=0.1)
        assert not any("-0.01 to" in each for each in areas)
        assert len(shapes) == len(areas)
