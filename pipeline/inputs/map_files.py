"""Files on the map that a scenario names, each read once: elevation models, outlines, classes and places."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import Any, Literal, TypeVar

from pipeline.inputs import elevation_raster, outlines
from pipeline.inputs.elevation_raster import (
    ElevationRaster,
    ElevationRasterError,
    RasterExtent,
    UnknownSystemError,
)
from pipeline.inputs.outlines import Outline, OutlineError, Place
from pipeline.mistakes import Problem
from pipeline.settings.section import Pair

T = TypeVar("T")
Key = tuple[str | int, ...]
Kind = Literal["polygons", "lines", "classes"]
_READ: dict[Kind, Callable[..., tuple[Outline, ...]]] = {
    "polygons": outlines.read,
    "lines": outlines.read_lines,
}


class MapFiles:
    """Reads files that are named relative to a folder; what is wrong with one is a `Problem`.

    What is doubtful is in ``doubts``, by the path of a key and what it is of.

    Parameters
    ----------
    folder : Path
        That names of files are relative to.
    """

    def __init__(self, folder: Path) -> None:
        self.folder = folder
        self.doubts: dict[tuple[Key, str], str] = {}
        self._held: dict[Any, Any] = {}

    def extent(self, name: str, crs: str | None, path: Key) -> RasterExtent | Problem:
        """Read where an elevation model lies; ``path`` : of the key that names it."""
        return self._once(("extent", name, crs), name, path, lambda file: elevation_raster.extent(file, crs))

    def raster(
        self, name: str, crs: str | None, bounds: tuple[Pair, Pair], path: Key
    ) -> ElevationRaster | Problem:
        """Read the part of a raster around a rectangle with bounds along x and y, m."""
        return self._once(
            ("raster", name, crs, bounds, path),
            name,
            path,
            lambda file: elevation_raster.read(file, crs, *bounds),
        )

    def outlines(
        self, name: str, layer: str | None, crs: str, path: Key, kind: Kind = "polygons"
    ) -> tuple[Outline, ...] | Problem:
        """Read the polygons of a file, its lines, or the classes of a raster, in a reference system."""

        def read(file: Path) -> tuple[Outline, ...]:
            if kind == "classes":
                return outlines.read_classes(file, crs)
            return _READ[kind](file, crs, layer, lambda line: self.doubts.update({(path, name): line}))

        return self._once((kind, name, layer, crs), name, path, read)

    def places(self, name: str, layer: str | None, crs: str, path: Key) -> tuple[Place, ...] | Problem:
        """Read the points, lines and polygons of a file of receptors, in a reference system."""

        def read(file: Path) -> tuple[Place, ...]:
            return outlines.read_places(
                file, crs, layer, lambda line: self.doubts.update({(path, "shapes"): line})
            )

        return self._once(("places", name, layer, crs), name, path, read)

    def _once(self, key: Any, name: str, path: Key, read: Callable[[Path], T]) -> T | Problem:
        if key not in self._held:
            file = self.folder / name
            if not file.exists():
                self._held[key] = Problem(path, f"expected a readable file, found none: {file}")
            else:
                try:
                    self._held[key] = read(file)
                except UnknownSystemError as error:
                    self._held[key] = Problem((*path[:-1], "crs"), str(error))
                except (ElevationRasterError, OutlineError) as error:
                    folder = f"expected a file that can be read, found the folder {name}"
                    self._held[key] = Problem(path, folder if file.is_dir() else f"{error} ({name})")
        found: T | Problem = self._held[key]
        return found
