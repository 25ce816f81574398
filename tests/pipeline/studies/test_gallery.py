"""Pictures of the gallery, of a small place."""

import copy

import pytest
from heaps import HEAP
from PIL import Image

import pipeline
from pipeline.studies import gallery


def test_a_place_has_maps_section_curve_and_film_in_few_bytes(tmp_path, monkeypatch):
    pipeline.run(copy.deepcopy(HEAP), tmp_path / "heaps", workers=1, quiet=True)
    monkeypatch.setitem(gallery.MAPS, "heap", ("depth_above_0.2", "hazard_level"))
    made = gallery.draw_place(tmp_path / "heaps", "heap", tmp_path / "docs")
    names = [path.name for path in made]
    assert names == ["depth_above_0.2.png", "hazard_level.png", "section.png", "runout.png", "film.gif"]
    for path in made:
        assert 1_000 < path.stat().st_size < 200_000
    with Image.open(tmp_path / "docs" / "film.gif") as film:
        assert film.width == gallery.FILM_WIDTH
        assert film.n_frames == 7


@pytest.mark.parametrize(("ending", "kind"), [(".png", "PNG"), (".webp", "WEBP")])
def test_pictures_are_no_wider_than_asked(tmp_path, ending, kind):
    path = gallery.small(Image.new("RGB", (400, 200), "#c01020"), tmp_path / f"red{ending}", widest=100)
    with Image.open(path) as picture:
        assert (picture.size, picture.format) == ((100, 50), kind)
        red, green, blue = picture.convert("RGB").getpixel((50, 25))
    assert (abs(red - 0xC0) < 8, abs(green - 0x10) < 8, abs(blue - 0x20) < 8) == (True, True, True)
