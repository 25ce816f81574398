"""Pictures of docs/gallery.md, from the places of the shipped examples.

``python -m pipeline.studies.gallery RESULTS DOCS`` takes ``RESULTS/torrent``, ``RESULTS/valley`` and
``RESULTS/dam``, and writes to ``DOCS/torrent`` and ``DOCS/valley``.
"""

from __future__ import annotations

import argparse
import asyncio
import tempfile
from io import BytesIO
from pathlib import Path

import xarray as xr
from PIL import Image

from pipeline.gis.layer import Layer
from pipeline.hazard.differences import compare, difference_layers
from pipeline.hazard.layers import layers
from pipeline.hazard.map_files import ground
from pipeline.hazard.pictures import draw
from pipeline.hazard.place_maps import of_place
from pipeline.report.chapter import median_run
from pipeline.report.figures import encoded, film, runout_curve
from pipeline.report.page import write_report
from pipeline.report.section import section
from pipeline.scenario.scenario import stored
from pipeline.settings.report import Report
from pipeline.store.place import store_path
from pipeline.store.zarr_store import open_store
from pipeline.studies.browser import Tab, tab
from pipeline.studies.pages import SCREENS

COLOURS, QUALITY = 256, 80
# pictures of the page, and films, are no wider
WIDEST, FILM_WIDTH = 1000, 520
# maps of each place
MAPS = {
    "torrent": ("depth_above_0.5", "hazard_level"),
    "valley": ("depth_above_0.5", "intensity", "earliest_arrival_time"),
}
DAM = ("without-dam", "with-dam")
DIFFERENCE = "depth_above_0.5_difference"
# shares of all runs, and the values at a place that most runs reach
ALL_RUNS = """(async () => {
  const one = explorers[0], box = one.canvas.getBoundingClientRect();
  one.root.querySelector('[data-mode="all"]').click();
  one.pick(...one.toMap(0.7 * one.canvas.width, 0.44 * one.canvas.height));
  return box.width;
})()"""


def small(opened: Image.Image, path: Path, widest: int | None = None) -> Path:
    """Write an opened picture not wider than so many pixels: PNG with a palette, or WebP."""
    with opened:
        picture = opened.convert("RGB")
    if widest and picture.width > widest:
        height = round(picture.height * widest / picture.width)
        picture = picture.resize((widest, height), Image.Resampling.LANCZOS)
    if path.suffix == ".webp":
        # of a page with its shades
        picture.save(path, "WEBP", quality=QUALITY, method=6)
    else:
        picture.quantize(COLOURS, method=Image.Quantize.MAXCOVERAGE).save(path, "PNG", optimize=True)
    return path


def draw_map(layer: Layer, found: xr.Dataset, path: Path) -> Path:
    """Draw a map to a small file."""
    with tempfile.TemporaryDirectory() as folder:
        picture = Image.open(draw(layer, found, ground(found), Path(folder) / "map.png"))
        return small(picture, path)


def draw_place(place: Path, name: str, to: Path) -> list[Path]:
    """Draw maps, section and run-out of a scenario."""
    to.mkdir(parents=True, exist_ok=True)
    found = dict(of_place(place, {}))[name]
    held = {layer.name: layer for layer in layers(found)}
    made = [draw_map(held[layer], found, to / f"{layer}.png") for layer in MAPS[name]]
    with open_store(store_path(place, name)) as store:
        figures = {
            "section": section(store, found, stored(store.attrs).hazard),
            "runout": runout_curve(store),
        }
        for file, content in figures.items():
            if content is not None:
                made.append(small(Image.open(BytesIO(content)), to / f"{file}.png", WIDEST))
        run = median_run(store)
        pictures = None if run is None else film(store, run, ground(found), found)
    if pictures is not None:
        height = round(pictures[0].height * FILM_WIDTH / pictures[0].width)
        size = (FILM_WIDTH, height)
        frames = [each.resize(size, Image.Resampling.LANCZOS) for each in pictures]
        (to / "film.gif").write_bytes(encoded(frames, "gif"))
        made.append(to / "film.gif")
    return made


async def _explorer(shown: Tab, path: Path) -> Path:
    with tempfile.TemporaryDirectory() as folder:
        picture = Image.open(await shown.picture(".explorer", Path(folder) / "shot.png"))
        return small(picture, path, WIDEST)


async def draw_pages(place: Path, to: Path) -> list[Path]:
    """Draw the map of the report on a desktop, with all runs, and on a phone, with one."""
    made = []
    with tempfile.TemporaryDirectory() as folder:
        page = Path(folder) / "page.html"
        write_report(place, page, given=Report(title="Hazard of the torrent"))
        async with tab() as shown:
            for screen in SCREENS:
                await shown.size(screen.width, screen.height)
                await shown.show(page)
                if screen is SCREENS[0]:
                    await shown.script(ALL_RUNS)
                made.append(await _explorer(shown, to / f"page-{screen.name}.webp"))
    return made


def main() -> None:
    """Draw all pictures, and print their paths and sizes."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawTextHelpFormatter)
    parser.add_argument("results", type=Path)
    parser.add_argument("docs", type=Path)
    given = parser.parse_args()
    made = []
    for name in MAPS:
        made += draw_place(given.results / name, name, given.docs / name)
    made += asyncio.run(draw_pages(given.results / "torrent", given.docs / "torrent"))
    found = compare((given.results / "dam",) * 2, DAM, {}).maps
    held = {layer.name: layer for layer in difference_layers(found)}
    made.append(draw_map(held[DIFFERENCE], found, given.docs / "torrent" / "dam_difference.png"))
    for path in made:
        print(path, f"{path.stat().st_size / 1e3:.0f} kB")


if __name__ == "__main__":
    main()
