import json
import shutil
import subprocess
from dataclasses import replace

import numpy as np
import pyogrio.raw
import pytest
import rasterio
import shapely
import xarray as xr
from matplotlib.colors import to_hex
from PIL import Image

from pipeline.assess.ensemble import ensemble
from pipeline.assess.georeference import Frame, GeoreferenceError, frame, north_up
from pipeline.gis.raster import OUTSIDE, UNKNOWN
from pipeline.gis.symbology import CLASSES, UNKNOWN_COLOUR
from pipeline.gis.vectors import outline
from pipeline.hazard import geo_files, map_panel, pictures
from pipeline.hazard.layers import layers
from pipeline.hazard.map_files import write_maps
from pipeline.hazard.map_panel import round_below
from pipeline.hazard.mapping import map_hazard, without_buildings
from pipeline.hazard.netcdf import read, write
from pipeline.hazard.pictures import draw
from pipeline.settings.hazard import Georeference, Hazard
from pipeline.store.variables import Status

X, Y = np.arange(0.0, 1201, 5), np.arange(-150.0, 151, 5)
SLOPE = 20.0
GROUND = Georeference(crs="EPSG:2056", origin=(2_700_000, 1_200_000), azimuth=120)
ORIGIN = np.array(GROUND.origin)


def place(s, y, azimuth=GROUND.azimuth):
    """Go from the origin downslope and to the left."""
    down = np.array([np.sin(np.radians(azimuth)), np.cos(np.radians(azimuth))])
    return ORIGIN + s * down + y * np.array([-down[1], down[0]])


def made(status=(1, 1, 1, 1), ground=GROUND):
    """Map four runs that reach 300, 500, 700 and 900 m along a plane, within 60 m of its middle."""
    reach = np.array([300, 500, 700, 900])[:, None, None]
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
            "elevation": ("x", 800 - np.sin(np.radians(SLOPE)) * X),
            "horizontal_distance": ("x", np.cos(np.radians(SLOPE)) * X),
            "return_period": ("run", [30.0, 100.0, 300.0, 1000.0]),
        },
        attrs={"title": "plane"},
    )
    text = "" if ground is None else ground.model_dump_json()
    found = map_hazard(ensemble(runs), Hazard(depth=(1.0,), speed=(), quantiles=(0.5,)))
    return found.assign_attrs(title="plane", georeference=text)


def few(found):
    """Keep the maps of arrival."""
    return found[[name for name in found if "arrival" in name]]


@pytest.fixture(scope="module")
def written(tmp_path_factory):
    """Maps of a plane where one of four runs failed, with all files."""
    folder = tmp_path_factory.mktemp("maps")
    found = read(write(made((1, 1, 1, 2)), folder))
    assert {path.name for path in write_maps(found, folder).paths} < {path.name for path in folder.iterdir()}
    return folder, found


class TestTheFrame:
    @pytest.mark.parametrize("azimuth", [0, 37, 90, 120, 200, 300])
    def test_takes_horizontal_distance_and_grows_to_the_left(self, azimuth):
        ground = GROUND.model_copy(update={"azimuth": azimuth})
        laid = frame(made(ground=None), ground)
        x = np.array([0.0, 600.0, 601.0])
        found = np.stack(laid.on_map(x, np.array([0.0, 50.0, -50.0])), axis=1)
        s = x * np.cos(np.radians(SLOPE))
        expected = [place(s[0], 0, azimuth), place(s[1], 50, azimuth), place(s[2], -50, azimuth)]
        np.testing.assert_allclose(found, expected, atol=1e-6)

    def test_finds_its_points_again(self):
        laid = frame(made(ground=None), GROUND)
        x, y = np.meshgrid(X, Y)
        row, column, inside = laid.indices(*laid.on_map(x, y))
        assert inside.all()
        np.testing.assert_allclose(row, np.broadcast_to(np.arange(len(Y))[:, None], x.shape), atol=1e-6)
        np.testing.assert_allclose(column, np.broadcast_to(np.arange(len(X)), x.shape), atol=1e-6)

    def test_refuses_profiles_that_differ_between_runs(self):
        with pytest.raises(GeoreferenceError, match="differs between the runs"):
            frame(made().drop_vars("horizontal_distance"), GROUND)


class TestTheGridNorthUp:
    def test_reproduces_what_is_linear_and_is_missing_outside(self):
        laid = Frame(GROUND, X, X * 0.9, Y)
        x, y = np.meshgrid(X, Y)
        field = (0.3 * x - 0.7 * y).astype(np.float32)
        classes = (x > 600).astype(np.int8)
        given = xr.Dataset({"field": (("y", "x"), field), "class": (("y", "x"), classes)}, {"x": X, "y": Y})
        grid = north_up(given, laid)
        assert (np.diff(grid["y"]) == -5).all()
        assert (np.diff(grid["x"]) == 5).all()
        east, north = np.meshgrid(grid["x"] - ORIGIN[0], grid["y"] - ORIGIN[1])
        (de, dn), _ = place(1, 0) - ORIGIN, None
        s, across = east * de + north * dn, north * de - east * dn
        inner = (s >= 0) & (s <= 0.9 * X[-1]) & (np.abs(across) <= 150)
        outer = (s < -2.26) | (s > 0.9 * X[-1] + 2.26) | (np.abs(across) > 152.51)
        np.testing.assert_allclose(grid["field"].values[inner], (s / 3 - 0.7 * across)[inner], atol=2e-3)
        assert np.isnan(grid["field"].values[outer]).all()
        assert (grid["class"].values[outer] == -1).all()
        assert (grid["class"].values[inner & (s > 545)] == 1).all()
        assert (grid["class"].values[inner & (s < 535)] == 0).all()


class TestTheGeoTiff:
    def test_is_cloud_optimised_north_up_and_says_its_runs(self, written):
        folder, _ = written
        with rasterio.open(folder / "depth_above_1.tif") as opened:
            assert opened.crs.to_epsg() == 2056
            assert opened.tags(ns="IMAGE_STRUCTURE")["LAYOUT"] == "COG"
            assert opened.overviews(1)
            assert opened.transform.a == -opened.transform.e == 5
            assert (opened.transform.b, opened.transform.d) == (0, 0)
            assert opened.descriptions == ("share of events with a largest depth above 1 m",)
            assert opened.tags()["comment"] == "3 of 4 runs done (1 failed)"
            assert opened.tags()["units"] == "1"
            assert np.isnan(opened.nodata)

    def test_has_the_values_at_their_places(self, written):
        folder, _ = written
        along = [200, 400, 600, 800, 1000]
        at = [place(x * np.cos(np.radians(SLOPE)), 20) for x in along]
        found = []
        for bound in ("", "_lower", "_upper"):
            with rasterio.open(folder / f"depth_above_1{bound}.tif") as opened:
                found.append([value[0] for value in opened.sample(at)])
                beyond = np.array(list(opened.sample([place(400, 180), place(-50, 0)])))
                assert np.isnan(beyond).all()
        # the rarest event, which failed, weighs 30/1000 of the most frequent one
        lower = np.array([0.97, 0.27, 0.07, 0, 0])
        expected = np.stack([lower / 0.97, lower, lower + 0.03], axis=1)
        np.testing.assert_allclose(np.transpose(found), expected, atol=1e-6)

    def test_has_classes_as_whole_numbers(self, written):
        folder, _ = written
        with rasterio.open(folder / "intensity.tif") as opened:
            assert (opened.dtypes[0], opened.nodata, opened.count) == ("uint8", OUTSIDE, 1)
            assert set(np.unique(opened.read(1))) == {OUTSIDE, 0, 3}
        with rasterio.open(folder / "intensity_1000_years.tif") as opened:
            assert set(np.unique(opened.read(1))) == {OUTSIDE, UNKNOWN}


def test_the_netcdf_has_a_grid_mapping(written):
    folder, _ = written
    with xr.open_dataset(folder / geo_files.MAP, decode_coords="all") as opened:
        assert opened["spatial_ref"].attrs["projected_crs_name"] == "CH1903+ / LV95"
        assert opened["depth_exceedance"].encoding["grid_mapping"] == "spatial_ref"
        assert opened["x"].attrs["standard_name"] == "projection_x_coordinate"
        assert opened["y"].values[0] > opened["y"].values[-1]
        at = place(400 * np.cos(np.radians(SLOPE)), 20)
        found = opened["depth_exceedance"].sel(x=at[0], y=at[1], method="nearest")
        assert found.item() == pytest.approx(0.27 / 0.97, abs=1e-6)


@pytest.mark.skipif(shutil.which("ncdump") is None, reason="ncdump is not installed (netcdf-bin)")
def test_ncdump_reads_the_grid_mapping(written):
    command = ["ncdump", "-h", written[0] / geo_files.MAP]
    shown = subprocess.run(command, capture_output=True, text=True, check=True).stdout
    assert 'depth_exceedance:grid_mapping = "spatial_ref" ;' in shown
    assert 'spatial_ref:grid_mapping_name = "oblique_mercator" ;' in shown


class TestOutlines:
    def test_are_read_with_their_reference_system_and_runs(self, written):
        path = written[0] / geo_files.PACKAGE
        about, _, shapes, columns = pyogrio.raw.read(path, layer="depth_above_1")
        assert about["crs"] == "EPSG:2056"
        rows = [dict(zip(about["fields"], row, strict=True)) for row in zip(*columns, strict=True)]
        kinds = {(row["share"], row["bound"]) for row in rows}
        assert {(0.5, "estimate"), (0.5, "lower bound"), (0.5, "upper bound")} <= kinds
        assert {(row["runs_done"], row["runs_planned"], row["threshold"]) for row in rows} == {(3, 4, 1.0)}
        (half,) = (
            shapely.from_wkb(shape)
            for shape, row in zip(shapes, rows, strict=True)
            if (row["share"], row["bound"]) == (0.5, "estimate")
        )
        flat = np.cos(np.radians(SLOPE))
        assert half.contains(shapely.Point(place(280 * flat, 0)))
        assert not half.contains(shapely.Point(place(320 * flat, 0)))
        # between two points of the lattice at most
        assert 300 * flat * 120 < half.area < 305 * flat * 130

    def test_have_the_area_of_a_rectangle_and_of_a_hole(self):
        laid = Frame(GROUND, X, X * 0.5, Y)
        falling = np.broadcast_to(1 - X / X[-1], (len(Y), len(X)))
        shape = outline(xr.DataArray(falling, dims=("y", "x")), 0.5, laid)
        assert shape.area == pytest.approx(0.5 * 600 * 300, rel=1e-9)
        hollow = np.abs(X[:, None] - 600).T * 0 + np.hypot(X - 600, Y[:, None]) / 1000
        shape = outline(xr.DataArray(hollow, dims=("y", "x")), 0.1, Frame(GROUND, X, X, Y))
        assert len(shape.geoms[0].interiors) == 1
        assert shape.area == pytest.approx(1200 * 300 - np.pi * 100**2, rel=1e-3)

    def test_of_nothing_are_empty(self):
        nothing = xr.DataArray(np.zeros((len(Y), len(X))), dims=("y", "x"))
        assert outline(nothing, 0.1, Frame(GROUND, X, X, Y)).is_empty


class TestPictures:
    def test_there_is_one_a_map(self, written):
        folder, found = written
        names = {layer.name for layer in layers(found)}
        assert names == {
            *("depth_above_1", "depth_quantile_0.5", "speed_quantile_0.5"),
            *("arrival_share", "arrival_rate", "arrival_time", "earliest_arrival_time"),
            *("intensity", "hazard_level"),
            *(f"intensity_{years}_years" for years in (30, 100, 300, 1000)),
        }
        for name in names:
            with Image.open(folder / f"{name}.png") as picture:
                colours = picture.convert("RGB").getcolors(1 << 24)
            assert len(colours) > 30, f"{name} is empty"

    def test_levels_have_their_colours(self, written):
        with Image.open(written[0] / "hazard_level.png") as picture:
            counts = {colour: count for count, colour in picture.convert("RGB").getcolors(1 << 24)}
        levels = CLASSES["hazard_level"]
        red, yellow = (tuple(bytes.fromhex(levels[i].colour[1:])) for i in (3, 1))
        assert counts[red] > 20 * counts.get(yellow, 0) > 0

    @pytest.mark.parametrize("status", [(1, 1, 1, 1), (1, 1, 1, 2)], ids=["all done", "one failed"])
    def test_show_buildings_as_such_and_not_computed_in_no_grey(self, status, tmp_path, monkeypatch):
        told = []
        legend = pictures.Axes.legend
        monkeypatch.setattr(
            pictures.Axes,
            "legend",
            lambda panel, **given: told.extend(given["handles"]) or legend(panel, **given),
        )
        stands = np.zeros((len(Y), len(X)), np.int8)
        stands[28:34, 100:106] = 1
        found = without_buildings(made(status).assign_coords(building=(("y", "x"), stands)))
        (layer,) = (each for each in layers(found) if each.name == "hazard_level")
        draw(layer, found, frame(found, GROUND), tmp_path / "map.png")
        entries = {each.get_label(): to_hex(each.get_facecolor()) for each in told}
        assert entries["building"] == to_hex(map_panel.BUILDING_COLOUR)
        assert ("not computed" in entries) == (Status.FAILED in status)
        red, green, blue = (
            int(entries.get("not computed", UNKNOWN_COLOUR)[at : at + 2], 16) for at in (1, 3, 5)
        )
        assert max(red, green, blue) - min(red, green, blue) > 60

    def test_mark_receptors(self, tmp_path):
        found = few(made())
        places = {"point": [700, 100], "line": None, "polygon": None}
        road = {"point": None, "line": [[500, -150], [500, 150]], "polygon": None}
        named = [{"name": "house", **places}, {"name": "road", **road}]
        (layer, *_) = layers(found)
        plain, marked = (
            np.asarray(Image.open(draw(layer, found.assign_attrs(receptors=text), None, path)).convert("RGB"))
            for text, path in ((json.dumps(named), tmp_path / "a.png"), ("[]", tmp_path / "b.png"))
        )
        assert plain.shape == marked.shape
        changed = np.flatnonzero((plain != marked).any(axis=(0, 2)))
        assert changed.size > 20

    def test_work_without_a_georeference_and_without_any_run(self, tmp_path):
        written = write_maps(few(made((2, 2, 0, 0), ground=None)), tmp_path)
        names = ("arrival_share", "arrival_rate", "arrival_time", "earliest_arrival_time")
        assert [path.name for path in written.paths] == [f"{name}.png" for name in names]
        assert written.group is None


@pytest.mark.parametrize(
    ("crs", "word"), [("EPSG:4326", "projected reference system with metres"), ("EPSG:1", "is not known")]
)
def test_a_reference_system_without_metres_is_refused(tmp_path, crs, word):
    wrong = made(ground=GROUND.model_copy(update={"crs": crs}))
    with pytest.raises(GeoreferenceError, match=word):
        write_maps(wrong, tmp_path)


@pytest.mark.parametrize(("value", "expected"), [(240, 200), (0.07, 0.05), (1, 1), (19.9, 10), (5e5, 5e5)])
def test_a_scale_bar_has_a_round_length(value, expected):
    assert round_below(value) == pytest.approx(expected)


@pytest.mark.parametrize("status", [(1, 1, 1, 1), (1, 1, 0, 1)], ids=["one panel", "with bounds"])
@pytest.mark.parametrize("ground", [GROUND, None], ids=["on the ground", "along the bed"])
def test_a_picture_is_the_same_whether_its_panels_were_arranged_before(status, ground, tmp_path):
    found = made(status, ground)
    layer = next(layers(found))
    where = frame(found, ground) if ground else None
    map_panel.arranged.clear()
    for name in ("first", "second"):
        pictures.drawn.clear()
        draw(layer, found, where, tmp_path / f"{name}.png")
        assert len(map_panel.arranged) == 1
    assert (tmp_path / "first.png").read_bytes() == (tmp_path / "second.png").read_bytes()


def test_panels_are_arranged_anew_around_other_names(tmp_path):
    map_panel.arranged.clear()
    for name in ("inn", "a house of which the name is long"):
        place = json.dumps([{"name": name, "point": [1190, 140], "line": None, "polygon": None}])
        found = made().assign_attrs(receptors=place)
        draw(next(layers(found)), found, frame(found, GROUND), tmp_path / "map.png")
    assert len(map_panel.arranged) == 2


def test_a_map_that_was_drawn_is_not_drawn_again_and_any_other_one_is(tmp_path, monkeypatch):
    calls = []
    monkeypatch.setattr(pictures, "drawn", {})
    monkeypatch.setattr(pictures, "_draw", lambda *given: calls.append(given) or b"%d" % (len(calls) - 1))
    found = made()

    def shows(found=found, ground=GROUND, **other):
        layer = replace(next(layers(found)), **other)
        return draw(layer, found, frame(found, ground) if ground else None, tmp_path / "map.png").read_bytes()

    assert shows() == shows() == shows(made()) == b"0"
    turned = Georeference(crs="EPSG:2056", origin=GROUND.origin, azimuth=121)
    others = [
        {"found": made((1, 1, 0, 1))},
        {"found": found.assign_attrs(comment="of other runs")},
        {"found": found.assign_coords(elevation=found["elevation"] + 1)},
        {"ground": turned},
        {"ground": None},
        {"title": "another"},
        {"largest": 9.0},
    ]
    assert [shows(**other) for other in others] == [b"%d" % k for k in range(1, len(others) + 1)]
    assert shows() == b"0"
    assert len(calls) == 1 + len(others)
