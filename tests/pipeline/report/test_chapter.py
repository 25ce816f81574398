"""What the page says of a scenario: findings, section, sheets, inputs, and what stands at its head."""

import copy
import html
import re
import shutil
import subprocess

import numpy as np
import pytest
import xarray as xr
from commands import pipeline as command
from heaps import HEAP
from PIL import Image

import pipeline
from pipeline.assess.ensemble import ensemble
from pipeline.assess.receptors import reached
from pipeline.hazard.mapping import map_hazard
from pipeline.hazard.place_maps import of_place
from pipeline.report.findings import _doubts, by_period, findings
from pipeline.report.section import _along_profile, _along_surface, section
from pipeline.report.tables.inputs import inputs, method
from pipeline.report.tables.receptors import receptors, sheets
from pipeline.report.tables.runs import quantiles
from pipeline.report.tables.table import short
from pipeline.scenario.scenario import stored
from pipeline.store.variables import Status
from pipeline.store.zarr_store import open_store

pytestmark = pytest.mark.usefixtures("few_pictures")

NOWHERE = {"name": "chapel", "point": [156, 20]}


@pytest.fixture(scope="module")
def place(tmp_path_factory):
    out = tmp_path_factory.mktemp("chapter") / "results"
    heap = copy.deepcopy(HEAP)
    heap["receptors"].append(NOWHERE)
    heap["report"] = {"title": "Hang über dem Dorf", "author": "Büro Müller", "date": "2026-03-31"}
    pipeline.run(heap, out, workers=1, quiet=True)
    return out


@pytest.fixture(scope="module")
def store(place):
    with open_store(place / "heap.zarr") as opened:
        yield opened.load()


@pytest.fixture(scope="module")
def found(place):
    return dict(of_place(place, {}))["heap"]


@pytest.fixture(scope="module")
def page(place, tmp_path_factory):
    to = tmp_path_factory.mktemp("page") / "page.html"
    return html.unescape(pipeline.write_report(place, to).read_text(encoding="utf-8"))


class TestFindings:
    def test_say_who_is_reached_how_likely_and_by_what(self, store, found, tmp_path):
        said = findings(store, found, tmp_path / "none.csv")
        rows = reached(store)
        road = rows[rows["receptor"] == "road"]["reached"].to_numpy(bool)
        # run 3 is of 30 years, 1 and 2 of 100, 0 of 300
        chances = (road[3], road[1:3].mean(), road[0])
        (line,) = (one for one in said if one.startswith("road:"))
        numbers = re.findall(r"([\d.]+) at (\d+) years", line)
        assert [float(chance) for chance, _ in numbers] == [float(each) for each in chances]
        assert [int(years) for _, years in numbers] == [30, 100, 300]
        first = float(rows[rows["receptor"] == "road"]["arrival_time"].min())
        assert f"at the earliest after {short(first)} s" in line
        assert "Not reached in any run: chapel." in said

    def test_say_how_far_the_flow_goes_and_on_how_much_ground(self, store, found, tmp_path):
        said = "\n".join(findings(store, found, tmp_path / "none.csv"))
        assert re.search(r"The run-out is [\d.]+ m in the median; 5 % of the events stay below", said)
        assert "of the runs stay below" not in said
        high = float((found["hazard_level"] == 4).sum()) * 4 / 10_000
        assert f"high on {short(high)} ha" in said

    def test_say_what_drives_the_run_out_above_noise(self, store, found, tmp_path):
        indices = tmp_path / "sensitivity.csv"
        head = "scenario,quantity,parameter,method,index,noise\n"
        rows = ("bed_friction,pawn,0.6,0.2", "volume,pawn,0.1,0.2", "bed_friction,sobol total,0.9,0")
        indices.write_text(head + "".join(f"heap,runout_distance,{row}\n" for row in rows))
        (line,) = (one for one in findings(store, found, indices) if "drives" in one)
        assert line == "What drives the run-out, by PAWN's index: bed friction (0.60)."

    def test_say_what_is_missing(self, store, found, tmp_path):
        states = store["status"].copy(data=[Status.FAILED, Status.CUT_OFF, Status.DONE, Status.DONE])
        said = "\n".join(findings(store.assign(status=states), found, tmp_path / "none.csv"))
        assert "1 run failed" in said
        assert "1 still moved at their end" in said
        # what is not known in full may be deeper than all that was computed
        assert "m in the deepest computed run, and" in said
        assert "at most" not in said
        whole = "\n".join(findings(store, found, tmp_path / "none.csv"))
        assert "m at most, and up to" in whole

    @pytest.mark.parametrize(
        ("chances", "said"),
        [
            ((0.2, 0.5, 0.9), "reached by half of the events or more from a return period of 30 years on"),
            ((0.6, 0.4, 0.9), "half of the events or more at 10 years, 100 years and at no other return"),
            ((0.6, 0.4, 0.1), "half of the events or more at 10 years and at no other return period"),
            ((0.1, 0.4, 0.1), "reached by less than half of the events of each return period"),
        ],
    )
    def test_return_periods_are_named_as_far_as_the_events_reach(self, chances, said):
        rows = [
            {"shortest_return_period": years, "return_period": years, "probability": chance}
            | {"probability_lower": chance, "probability_upper": chance}
            for years, chance in zip((10.0, 30.0, 100.0), chances, strict=True)
        ]
        assert said in by_period("road", rows, {"probability": 0.0})

    @pytest.mark.parametrize(
        ("bounds", "said"),
        [
            (
                ((0, 1), (0, 1), (0, 1)),
                "it is not known of any return period whether half of the events reach",
            ),
            (
                ((0, 0.3), (0, 0.7), (0, 1)),
                "of each return period but 30 years, 100 years, of which it is not",
            ),
            (
                ((0, 0.3), (0.2, 0.7), (1, 1)),
                "from a return period of 100 years on; of 30 years it is not known",
            ),
            (
                ((0.6, 1), (0, 0.7), (0, 0)),
                "half of the events or more at 10 years; of 30 years it is not known",
            ),
        ],
    )
    def test_return_periods_that_missing_runs_decide_are_told_as_not_known(self, bounds, said):
        rows = [
            {"shortest_return_period": years, "return_period": years, "probability": lower}
            | {"probability_lower": lower, "probability_upper": upper}
            for years, (lower, upper) in zip((10.0, 30.0, 100.0), bounds, strict=True)
        ]
        found = by_period("road", rows, {"probability": 0.0})
        assert said in found
        assert found.count("unknown (0.00 to 1.00)") == bounds.count((0, 1))

    def test_say_nothing_as_a_fact_where_every_run_was_cut_off(self, store, tmp_path):
        cut = store.assign(status=store["status"].copy(data=[Status.CUT_OFF] * 4))
        # as of an end before anything arrives at the receptors
        cut["arrival_time"] = cut["arrival_time"].where(cut["x"] < 50)
        held = map_hazard(ensemble(cut), stored(store.attrs).hazard)
        said = findings(cut, held, tmp_path / "none.csv")
        (line,) = (one for one in said if one.startswith("road:"))
        assert "it is not known of any return period" in line
        assert line.count("unknown (0.00 to 1.00)") == 3
        (levels,) = (one for one in said if one.startswith("The level of hazard"))
        low, high = (
            short(float((held[f"hazard_level{end}"] == 4).sum()) * 4 / 10_000) for end in ("_lower", "_upper")
        )
        assert low != high
        assert f"high on {low} ({low} to {high}) ha" in levels
        table = receptors(cut)
        assert "0 of 4 runs done (4 still moving at time.end)" in table.note
        assert not any("4 of 4" in cell for row in table.rows for cell in row)

    def test_say_where_material_was_lost(self, store, found, tmp_path):
        overrun = store.assign(status=store["status"].copy(data=[Status.OVERRUN] * 4))
        (line,) = (one for one in findings(overrun, found, tmp_path / "none.csv") if "lost material" in one)
        assert line.startswith("4 runs lost material through open sides")
        # on an elevation model no data are an end of it as its sides are
        flat = xr.zeros_like(overrun["max_depth"].isel(run=0, drop=True))
        on_ground = overrun.assign_coords(elevation=flat)
        line, *_ = _doubts(on_ground)
        assert line.startswith("4 runs lost material where the domain or the data end")


def test_sheets_are_of_the_receptors_that_are_reached(store):
    made = {sheet.title: sheet for sheet in sheets(store)}
    assert set(made) == {"Häusli", "road"}
    rows = reached(store)
    depths = rows[(rows["receptor"] == "road") & rows["reached"].fillna(False)]["max_depth"]
    first = made["road"].rows[0]
    assert first[0] == "largest depth (m)"
    assert (first[1], first[-1]) == (short(depths.min()), short(depths.max()))


def test_inputs_have_units_and_meanings(store):
    rows = {row[0]: row[1:] for row in inputs(store).rows}
    assert rows["terrain.angle"][0] == "35°"
    assert rows["points.spacing"][0] == "2 m"
    assert rows["material.bed_friction"] == ["24, 26, 28, 31", "each of these values (sweep)"]
    assert rows["georeference.crs"][0] == "EPSG:2056"
    assert not any(name.startswith(("receptors", "report")) for name in rows)
    words = " ".join(method(store))
    assert "81 x 25 points of 2 m spacing" in words
    assert "collocation" not in words


def test_inputs_have_coordinates_with_all_digits_and_no_unit_behind_words():
    scene = """\
name: creek
terrain: {elevation: dem.tif}
points: {spacing: 5}
inflow:
  - name: creek
    section: [[2600300, 1200655.25], [2600300, 1200690]]
    hydrograph: {file: q.csv}
    depth: normal
structures: [{kind: building, polygon: houses.gpkg}]
material: {bed_friction: 8.123456, earth_pressure: isotropic}
receptors: [{name: house, point: [2601060, 1200640]}]
"""
    domain = '{"x": [2600002.5, 2601242.5], "y": [1200512.5, 1200797.5]}'
    rows = {
        row[0]: row[1]
        for row in inputs(
            xr.Dataset(attrs={"title": "creek", "scenario": scene, "domain": domain, "crs": "EPSG:2056"})
        ).rows
    }
    assert rows["inflow.0.section"] == "(2600300, 1200655.25), (2600300, 1200690) m"
    assert rows["inflow.0.depth"] == "normal"
    assert rows["structures.0.polygon"] == "houses.gpkg"
    assert rows["material.bed_friction"] == "8.123456°"
    assert rows["domain.x"] == "2600002.5, 2601242.5 m"
    assert rows["domain.y"] == "1200512.5, 1200797.5 m"
    assert rows["terrain.crs"] == "EPSG:2056"


@pytest.mark.parametrize(
    ("status", "note"),
    [
        (
            [Status.DONE] * 4,
            "Of all planned runs. 1 run was not wholly at rest at the end and counted as done",
        ),
        (
            [Status.CUT_OFF, Status.FAILED, Status.DONE, Status.DONE],
            "Of all planned runs; above is what runs that were cut off or failed leave open.",
        ),
    ],
)
def test_quantiles_say_which_runs_leave_them_open(store, status, note):
    rest = store["rest_time"].copy(data=[np.nan, 20.0, 21.0, 22.0])
    changed = store.assign(rest_time=rest, status=store["status"].copy(data=status))
    told = quantiles(changed).note
    assert told.startswith(note)
    # the limit is that of the status
    assert ("no more than 2 % of the volume still moved" in told) == (status[0] is Status.DONE)
    assert told.endswith("above that end.") == (status[0] is Status.DONE)


class TestTheSection:
    def test_is_drawn(self, store, found, tmp_path):
        drawn = section(store, found, stored(store.attrs).hazard)
        path = tmp_path / "section.png"
        path.write_bytes(drawn)
        with Image.open(path) as picture:
            colours = {colour for count, colour in picture.convert("RGB").getcolors(1 << 24) if count > 30}
        # envelope, energy height and energy line
        assert {(0x42, 0x92, 0xC6), (0xCB, 0x18, 0x1D)} <= colours

    def test_takes_the_largest_across_the_profile(self, found):
        line = _along_profile(found)
        field = xr.zeros_like(found["depth_quantile"].isel(quantile=0, drop=True))
        field[3, 7] = 2.0
        largest = line.largest(field)
        assert np.flatnonzero(largest).tolist() == [7]
        assert largest.max() == 2

    def test_follows_a_gully_on_an_elevation_model_downhill(self):
        x, y = np.meshgrid(np.arange(0.0, 400, 4), np.arange(-40.0, 41, 4))
        # a gully that falls to the east, and flow 2 m deep along its middle
        bed, depth = 500 - 0.3 * x + 0.02 * y**2, np.where((np.abs(y) < 9) & (x < 300), 2.0, 0.0)
        found = xr.Dataset(
            {"depth_quantile": (("quantile", "y", "x"), depth[None])},
            coords={"x": x[0], "y": y[:, 0], "elevation": (("y", "x"), bed)},
        )
        line = _along_surface(found)
        assert (np.diff(line.bed) < 0).all()
        assert line.distance[-1] == pytest.approx(296, abs=20)
        assert (line.largest(found["depth_quantile"][0]) == 2).all()
        assert sum(len(rows) for rows, _ in line.across) == (depth > 0).sum()

    def test_is_none_without_speeds(self, store, found):
        assert section(store, found.drop_vars("speed_quantile"), stored(store.attrs).hazard) is None


class TestTheHead:
    def test_is_what_the_scenario_says(self, page):
        assert "<h1>Hang über dem Dorf</h1>" in page
        assert "<dt>author</dt><dd>Büro Müller</dd>" in page
        assert "<dt>date</dt><dd>2026-03-31</dd>" in page

    def test_is_what_options_say_before_that(self, place, tmp_path):
        to = tmp_path / "page.html"
        shown = command("report", place, "--to", to, "--title", "Another", "--date", "2026-04-01")
        assert shown.exit_code == 0, shown.output
        text = to.read_text(encoding="utf-8")
        assert "<h1>Another</h1>" in text
        assert "<dd>2026-04-01</dd>" in text
        assert "Büro Müller" in text

    def test_refuses_a_day_that_is_none(self, place):
        shown = command("report", place, "--date", "31.3.2026")
        assert shown.exit_code == 2
        assert "--date: expected a day as 2026-03-31, found '31.3.2026'" in shown.stderr


def test_a_day_in_a_scenario_is_one(tmp_path):
    with pytest.raises(pipeline.BadInput, match=r"report\.date: expected a day as 2026-03-31"):
        pipeline.load({**HEAP, "report": {"date": "2026-02-30"}})


class TestAFilm:
    def test_has_a_picture_a_frame(self, place, store, tmp_path):
        shown = command("film", place / "heap.zarr", "--run", "0", "--to", tmp_path / "film.gif")
        assert shown.exit_code == 0, shown.output
        with Image.open(tmp_path / "film.gif") as film:
            assert (film.format, film.n_frames) == ("GIF", store.sizes["time"])

    def test_of_an_unknown_kind_is_refused(self, place, tmp_path):
        shown = command("film", place / "heap.zarr", "--to", tmp_path / "film.avi")
        assert shown.exit_code == 2
        assert "expected a file ending in .gif, .webp, .mp4" in shown.stderr

    @pytest.mark.skipif(shutil.which("ffmpeg") is None, reason="ffmpeg is not installed")
    def test_is_one_that_players_take(self, place, tmp_path):
        path = tmp_path / "film.mp4"
        assert command("film", place / "heap.zarr", "--to", path).exit_code == 0
        probe = [
            "ffprobe",
            "-v",
            "error",
            "-show_entries",
            "stream=codec_name,pix_fmt",
            "-of",
            "csv=p=0",
            path,
        ]
        told = subprocess.run(probe, capture_output=True, text=True, check=True).stdout
        assert told.strip() == "h264,yuv420p"

    def test_needs_ffmpeg_for_mp4(self, place, tmp_path, monkeypatch):
        monkeypatch.setattr("pipeline.report.film.shutil.which", lambda name: None)
        shown = command("film", place / "heap.zarr", "--to", tmp_path / "film.mp4")
        assert shown.exit_code == 2
        assert "needs ffmpeg, which is not installed" in shown.stderr
