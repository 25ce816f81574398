"""The page on paper, as a browser prints it; and names with umlauts, or long ones, in all that is written."""

import asyncio
import copy
import json
import re
import shutil
import sqlite3
import subprocess
from xml.etree import ElementTree as Xml

import pytest
from heaps import HEAP
from PIL import Image

import pipeline
from pipeline.store.zarr_store import open_store
from pipeline.studies.browser import installed, tab
from pipeline.studies.pages import SCREENS, measure

LONG = "Übergangsunterkunft der Forstverwaltung Oberpfälzer Wald, Nebengebäude Süd"
HEADINGS = re.compile(r"<h[1-4][^>]*>(.*?)</h[1-4]>")


@pytest.fixture(scope="module")
def place(tmp_path_factory):
    """A place whose receptors have umlauts, and one a long name."""
    out = tmp_path_factory.mktemp("print") / "results"
    heap = copy.deepcopy(HEAP)
    heap["receptors"].append({"name": LONG, "point": [70, 10]})
    pipeline.run(heap, out, workers=1, quiet=True)
    pipeline.write_report(out, title="Hang über Größ", author="Büro Müller", date="2026-03-31")
    return out


@pytest.fixture(scope="module")
def sheets(place, tmp_path_factory):
    """The sheets of the printed page, with places of texts and pictures."""
    folder = tmp_path_factory.mktemp("pdf")

    async def printed():
        async with tab() as shown:
            await shown.show(place / "report.html")
            await shown.print(folder / "page.pdf")

    asyncio.run(printed())
    command = ["pdftohtml", "-xml", "-q", folder / "page.pdf", folder / "page"]
    subprocess.run(command, check=True, capture_output=True)
    text = (folder / "page.xml").read_text(encoding="utf-8").partition("<pdf2xml")
    return list(Xml.fromstring("<pdf2xml" + text[2]).iter("page"))


def words(text):
    return " ".join("".join(text.itertext()).split())


def top(item):
    return int(item.get("top"))


@pytest.mark.skipif(installed() is None, reason="there is no headless browser (chromium)")
@pytest.mark.skipif(shutil.which("pdftohtml") is None, reason="pdftohtml is not installed (poppler-utils)")
class TestOnPaper:
    def test_below_every_heading_stands_what_it_is_of(self, place, sheets):
        page = (place / "report.html").read_text(encoding="utf-8")
        headings = {" ".join(found.split()) for found in HEADINGS.findall(page)}
        found = []
        for sheet in sheets:
            shown = sorted([*sheet.iter("text"), *sheet.iter("image")], key=top)
            for text in sheet.iter("text"):
                # table heads are bold too, but not as large
                if words(text) in headings and text.find("b") is not None:
                    found.append(words(text))
                    below = [each for each in shown if top(each) > top(text)]
                    assert below, words(text)
                    assert words(below[0]) not in headings or words(below[0]) == "Häusli"
        unseen = {each for each in headings if each == "To look and ask" or "in motion" in each}
        assert headings - unseen <= set(found)
        assert {"What was found", "Receptors", "Each receptor", "Versions and hashes"} <= set(found)

    def test_no_picture_is_lost_and_none_is_cut(self, place, sheets):
        page = (place / "report.html").read_text(encoding="utf-8")
        pictures = [(sheet, image) for sheet in sheets for image in sheet.iter("image")]
        moving = page.count("data:image/webp")
        assert len(pictures) == page.count("<img ") - moving
        assert len(pictures) > 10
        for sheet, image in pictures:
            for start, size in (("top", "height"), ("left", "width")):
                end = int(image.get(start)) + int(image.get(size))
                assert 0 < int(image.get(start)) < end < int(sheet.get(size))

    def test_no_text_is_cut_and_names_are_whole(self, sheets):
        for sheet in sheets:
            for text in sheet.iter("text"):
                assert int(text.get("left")) + int(text.get("width")) < int(sheet.get("width"))
        printed = " ".join(words(text) for sheet in sheets for text in sheet.iter("text"))
        for name in ("Hang über Größ", "Büro Müller", "Häusli", LONG):
            assert name in printed


@pytest.mark.skipif(installed() is None, reason="there is no headless browser (chromium)")
def test_pages_are_measured_on_both_screens_and_drawn(place, tmp_path):
    rows = asyncio.run(measure([place / "report.html"], 1, tmp_path))
    size = (place / "report.html").stat().st_size / 1e6
    assert [row[:2] for row in rows] == [["results", f"{size:.2f}"]] * len(SCREENS)
    for row, screen in zip(rows, SCREENS, strict=True):
        loaded, ready = map(float, row[3:])
        assert 0 < loaded < 60
        assert 0 < ready < 60
        with Image.open(tmp_path / f"results-{screen.name}-0.png") as picture:
            assert picture.width == screen.width * screen.density
            # letters and maps are on it
            assert len(picture.convert("RGB").getcolors(1 << 24)) > 100
    assert (tmp_path / "results.pdf").read_bytes().startswith(b"%PDF")


@pytest.fixture(scope="module")
def written(place):
    """The place with its maps and tables."""
    pipeline.hazard_maps(place, to=place / "hazard")
    pipeline.assessment_tables(place, to=place / "tables")
    return place


class TestNames:
    """A receptor with umlauts and a long name, in every output."""

    def test_are_whole_in_tables(self, written):
        for path in (written / "tables").iterdir():
            if path.stem.startswith("receptor"):
                text = path.read_text(encoding="utf-8")
                assert LONG in text
                assert "Häusli" in text

    def test_are_whole_in_the_geopackage_and_in_netcdf(self, written):
        with sqlite3.connect(written / "hazard" / "heap" / "maps.gpkg") as base:
            names = {name for (name,) in base.execute("SELECT name FROM receptor_points")}
        base.close()
        assert names == {"Häusli", LONG}
        maps = pipeline.hazard_maps(written)["heap"]
        assert [each["name"] for each in json.loads(maps.attrs["receptors"])] == ["Häusli", "road", LONG]

    def test_do_not_widen_pictures(self, written, tmp_path):
        named = written / "hazard" / "heap" / "depth_above_0.2.png"
        plain = copy.deepcopy(HEAP)
        del plain["receptors"]
        pipeline.run(plain, tmp_path / "plain", workers=1, quiet=True)
        pipeline.hazard_maps(tmp_path / "plain", to=tmp_path / "maps")
        sizes = []
        for path in (named, tmp_path / "maps" / "heap" / "depth_above_0.2.png"):
            with Image.open(path) as picture:
                sizes.append(picture.size)
        assert sizes[0][0] <= 1.02 * sizes[1][0]

    def test_are_whole_in_the_page_and_its_map(self, written):
        text = (written / "report.html").read_text(encoding="utf-8")
        # findings, tables and sheets; once more in what the map is made of
        assert text.count(LONG) >= 2
        held = re.search(r'<script type="application/json">(.*?)</script>', text, re.DOTALL)
        assert held is not None
        names = [each["name"] for each in json.loads(held[1])["receptors"]]
        assert names == ["Häusli", "road", LONG]
        with open_store(written / "heap.zarr") as store:
            assert store.attrs["title"] == "heap"
