"""Pages of reports as browsers show them: size, time to load, pictures at both widths, and the print.

``python -m pipeline.studies.pages results/report.html`` prints a table of sizes and times; with
``--pictures FOLDER`` it writes pictures of the whole page at each width, and the page as it is printed (PDF).
"""

from __future__ import annotations

import argparse
import asyncio
from dataclasses import dataclass
from pathlib import Path

from pipeline.readable import number
from pipeline.studies.browser import Tab, tab

MEGABYTE = 1e6


@dataclass(frozen=True)
class Screen:
    """A screen, in CSS pixels, and how many times its processor is slower than that of this machine."""

    name: str
    width: int
    height: int
    slower: float = 1.0
    density: float = 1.0


SCREENS = (Screen("desktop", 1280, 900), Screen("phone", 390, 844, slower=4.0, density=2.0))
# when the page had loaded, and when its last map could be used, ms
TIMES = (
    "[performance.getEntriesByType('navigation')[0].loadEventEnd, "
    "Math.max(0, ...performance.getEntriesByName('map ready').map((one) => one.startTime))]"
)


async def load_times(shown: Tab, page: Path, repeats: int) -> tuple[float, float]:
    """Give the shortest times, of some, until a page has loaded and until its maps can be used, s."""
    found = []
    for _ in range(repeats):
        await shown.show(page)
        found.append(await shown.script(TIMES))
    return min(each[0] for each in found) / 1000, min(each[1] for each in found) / 1000


async def measure(pages: list[Path], repeats: int, pictures: Path | None) -> list[list[str]]:
    """Measure pages on every screen, and write their pictures where a folder is given."""
    rows = []
    async with tab() as shown:
        for page in pages:
            for screen in SCREENS:
                await shown.size(screen.width, screen.height, slower=screen.slower, density=screen.density)
                loaded, ready = await load_times(shown, page, repeats)
                rows.append(
                    [
                        page.parent.name,
                        f"{page.stat().st_size / MEGABYTE:.2f}",
                        f"{screen.name}, {screen.width} px",
                        number(loaded),
                        number(ready),
                    ]
                )
                if pictures is not None:
                    await shown.pictures(pictures / f"{page.parent.name}-{screen.name}")
            if pictures is not None:
                await shown.print(pictures / f"{page.parent.name}.pdf")
        if shown.said:
            raise SystemExit("\n".join(shown.said))
    return rows


def main() -> None:
    """Measure the pages that are named, and print a table."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawTextHelpFormatter)
    parser.add_argument("pages", nargs="+", type=Path)
    parser.add_argument("--pictures", type=Path)
    parser.add_argument("--repeats", type=int, default=5)
    given = parser.parse_args()
    if given.pictures:
        given.pictures.mkdir(parents=True, exist_ok=True)
    head = ["page", "size (MB)", "screen", "loaded (s)", "map ready (s)"]
    rows = asyncio.run(measure(given.pages, given.repeats, given.pictures))
    for row in (head, ["---"] * len(head), *rows):
        print(f"| {' | '.join(row)} |")


if __name__ == "__main__":
    main()
