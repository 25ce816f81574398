import asyncio
from functools import partial
from html.parser import HTMLParser
from io import BytesIO

import numpy as np
import pytest
import xarray as xr
from batches import run
from PIL import Image
from stub_solvers import FAILS, OVERRUNS, by_friction
from typer.testing import CliRunner

from pipeline.assess.ensemble import ensemble
from pipeline.cli.app import app
from pipeline.hazard.map_files import ground
from pipeline.readable import number
from pipeline.report.figures import animation
from pipeline.report.page import write_report
from pipeline.report.tables.runs import failures, volume_ledger
from pipeline.report.tables.table import MOST_ROWS
from pipeline.settings.hazard import Georeference
from pipeline.store.zarr_store import open_store
from pipeline.studies.browser import installed, tab

pytestmark = pytest.mark.usefixtures("few_pictures")

GROUND = "georeference: {crs: 'EPSG:2056', origin: [2700000, 1200000], azimuth: 30}\n"
HAZARD = "hazard: {depth: [0.4], speed: []}\n"
PICTURES = (1 + 6 + 3 + 3) + (1 + 2 + 1 + 2) + 3
FEW_FIELDS = "output: {fields: [depth, max_depth]}\n"


class Page(HTMLParser):
    """What a page refers to, and its words."""

    def __init__(self, text: str) -> None:
        super().__init__()
        self.references: list[tuple[str, str]] = []
        self.anchors: set[str] = set()
        self.words: list[str] = []
        self.undescribed = 0
        self.feed(text)

    def handle_starttag(self, tag, attrs):
        given = dict(attrs)
        self.references += [(tag, given[key]) for key in ("src", "href") if key in given]
        self.anchors |= {given["id"]} if "id" in given else set()
        self.undescribed += tag == "img" and not given.get("alt")
        assert tag != "script" or "src" not in given

    def handle_data(self, data):
        self.words.append(data)


def moving(scene, times, *, log, **options):
    """Leave the release where it is, one half of it at the end, so that the frames differ."""
    result = by_friction(scene, times, log=log, **options)
    result.depth[1:] /= 2
    return result


@pytest.fixture(scope="module")
def place(tmp_path_factory, cluster):
    """Two scenarios on one lattice, with failed and overrun runs; one has words that are no HTML."""
    from contextlib import contextmanager

    from catalogue import SCENARIO

    from pipeline.batch import dask_pool, driver

    @contextmanager
    def given(count):
        yield cluster

    folder = tmp_path_factory.mktemp("report")
    files = []
    for name, angles, more in (("box", [20, 21, FAILS, OVERRUNS], ""), ("other", [22, 23], FEW_FIELDS)):
        text = SCENARIO.format(name=name).replace("a box on a plane", '"depth < 1 & <b>bold</b>"')
        files.append(folder / f"{name}.yaml")
        files[-1].write_text(f"{text}sweep: {{material.bed_friction: {angles}}}\n{GROUND}{HAZARD}{more}")
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(dask_pool, "workers", given)
        patch.setattr(driver, "FEW_RUNS", 0)
        patch.setattr(driver, "LITTLE_WORK", -1.0)
        run(folder / "out", *files, solve=partial(moving, log=folder / "log"))
    shown = CliRunner().invoke(app, ["report", str(folder / "out"), "--run", "1"])
    assert shown.exit_code == 0, shown.output
    assert shown.stdout == f"{folder / 'out' / 'report.html'}\n"
    return folder / "out"


@pytest.fixture(scope="module")
def page(place):
    return Page((place / "report.html").read_text(encoding="utf-8"))


def test_the_page_needs_nothing_beside_itself(page):
    pictures = [target for tag, target in page.references if tag == "img"]
    # location, maps, others folded out, section, run-out and motion; maps of what both kept
    assert len(pictures) == PICTURES
    assert all(target.startswith("data:image/") for target in pictures)
    others = [target for tag, target in page.references if tag != "img"]
    assert all(target.startswith(("#", "data:")) for target in others)
    assert {target[1:] for target in others if target.startswith("#")} == page.anchors
    assert page.anchors == {"scenario-box", "scenario-other", "scenario-all-scenarios"}
    assert page.undescribed == 0


def test_the_page_says_what_became_of_the_runs(page):
    text = " ".join(" ".join(page.words).split())
    assert "3 of 4 runs done (1 of them overrun, 1 failed)" in text
    assert "2 of 2 runs done" in text
    assert "5 of 6 runs done (1 of them overrun, 1 failed)" in text
    assert "not finite" in text
    assert "depth < 1 & <b>bold</b>" in text
    assert "sweep: {material.bed_friction: [20, 21" in text
    for heading in ("Volume", "Failed runs", "Versions and hashes"):
        assert heading in text


def test_the_page_has_the_hashes_of_its_stores(place, page):
    with open_store(place / "box.zarr") as store:
        assert store.attrs["scenario_hash"] in page.words
        assert store.attrs["solver_hash"] in page.words


def test_a_run_that_is_not_there_is_told(place):
    shown = CliRunner().invoke(app, ["report", str(place), "--run", "9"])
    assert (shown.exit_code, shown.stderr) == (2, "no scenario has frames of a run 9\n")


def test_a_place_without_stores_is_told(tmp_path):
    shown = CliRunner().invoke(app, ["report", str(tmp_path)])
    assert (shown.exit_code, shown.stderr) == (2, f"no results in {tmp_path}\n")


def test_a_place_where_nothing_is_done_yet_has_a_page(scenario_file, out, shared_workers):
    run(
        out,
        scenario_file(FAILS, more=HAZARD + FEW_FIELDS),
        solve=partial(by_friction, log=out.parent / "log"),
    )
    text = write_report(out, out / "page.html").read_text(encoding="utf-8")
    assert "0 of 1 run done (1 failed)" in text


class TestTheMotion:
    def test_has_a_picture_a_frame(self, place):
        with open_store(place / "box.zarr") as store:
            shown = animation(store, 0, None)
            assert shown is not None
            with Image.open(BytesIO(shown)) as film:
                assert (film.n_frames, film.format) == (3, "WEBP")
                pictures = []
                for i in range(3):
                    film.seek(i)
                    pictures.append(np.asarray(film.convert("RGB")))
        assert (pictures[0] != pictures[1]).any()
        assert (pictures[0][:3] == 255).all()

    def test_lies_on_the_ground(self, place):
        georeference = Georeference(crs="EPSG:2056", origin=(2_700_000, 1_200_000), azimuth=30)
        with open_store(place / "box.zarr") as store:
            found = ensemble(store).assign_attrs(georeference=georeference.model_dump_json())
            level, slanted = (animation(store, 0, frame) for frame in (None, ground(found)))
        heights = []
        for shown in (level, slanted):
            with Image.open(BytesIO(shown)) as film:
                heights.append(film.height)
        assert heights[1] > 1.5 * heights[0]

    def test_is_left_out_without_frames(self, place):
        with open_store(place / "box.zarr") as store:
            assert animation(store.drop_vars("depth"), 0, None) is None
            assert animation(store.isel(time=[0]), 0, None) is None


def test_many_runs_are_tabled_by_their_least_median_and_largest(place):
    with open_store(place / "other.zarr") as store:
        many = xr.concat([store.load()] * (MOST_ROWS // 2 + 1), "run")
    table = volume_ledger(many)
    assert [row[0] for row in table.rows] == ["least", "median", "largest"]
    assert f"Over {MOST_ROWS + 2} runs" in table.note


def test_many_failures_are_cut_short(place):
    with open_store(place / "box.zarr") as store:
        many = xr.concat([store.isel(run=[2]).load()] * (MOST_ROWS + 3), "run")
    table = failures(many)
    assert (len(table.rows), table.note) == (MOST_ROWS, "And 3 more.")


def test_numbers_are_written_for_people():
    assert [number(v) for v in (0.12345678, np.float64("nan"), 3, "word")] == ["0.1235", "–", "3", "word"]
    assert [number(v) for v in (12345.6, -1234567.0, 9999.4)] == ["12,350", "-1,235,000", "9999"]


LOOK = """({
  pictures: document.images.length,
  missing: [...document.images].filter((one) => !one.complete || !one.naturalWidth).length,
  too_wide: document.documentElement.scrollWidth > innerWidth,
  font: getComputedStyle(document.body).fontFamily.includes("sans-serif"),
})"""


@pytest.mark.skipif(installed() is None, reason="there is no headless browser (chromium)")
@pytest.mark.parametrize(("width", "height"), [(1280, 900), (390, 844)])
def test_a_browser_shows_the_page_whole_and_without_a_complaint(place, width, height):
    async def look():
        async with tab() as shown:
            await shown.size(width, height)
            await shown.show(place / "report.html")
            return await shown.script(LOOK), shown.said

    seen, said = asyncio.run(look())
    assert said == []
    assert seen == {"pictures": PICTURES, "missing": 0, "too_wide": False, "font": True}
