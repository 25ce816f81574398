"""Settings of receptors: named points, lines and areas on the bed."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Annotated, Any

from pydantic import Field, model_validator

from pipeline.settings.section import Pair, Section, key, relation


class Receptor(Section):
    """A place of which it is wanted what reaches it: a `point`, a `line` or a `polygon` on the bed."""

    name: str = key("name in tables and maps", min_length=1, max_length=100)
    point: Pair | None = key("x (arc length) and y; the cell that holds it counts", "m", None)
    line: Annotated[tuple[Pair, ...], Field(min_length=2)] | None = key(
        "corners of a line, as a road; all cells that it crosses count", "m", None
    )
    polygon: Annotated[tuple[Pair, ...], Field(min_length=3)] | None = key(
        "corners of an area; all cells that it holds or touches count", "m", None
    )

    @property
    def corners(self) -> tuple[Pair, ...]:
        """All places it is given by, m."""
        return (self.point,) if self.point is not None else self.line or self.polygon or ()

    @model_validator(mode="after")
    def _one_shape(self) -> Receptor:
        found = [name for name in ("point", "line", "polygon") if getattr(self, name) is not None]
        if len(found) != 1:
            words = " and ".join(found) or "none"
            raise relation(f"expected one of point, line and polygon, found {words}", *found[1:])
        return self


class LayerOfReceptors(Section):
    """Receptors of one layer of a file."""

    file: str = key("GeoPackage, GeoJSON or Shapefile, relative to the scenario file", min_length=1)
    layer: str | None = key("layer of the file; needed where it has several", default=None)


def source_of(receptors: Any) -> tuple[str, str | None] | None:
    """Give the file and the layer of receptors, of settings or as they were written; None for a list."""
    match receptors:
        case str():
            return receptors, None
        case LayerOfReceptors():
            return receptors.file, receptors.layer
        case Mapping():
            return receptors["file"], receptors.get("layer")
    return None
