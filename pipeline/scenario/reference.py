"""The reference of scenario files: every key with unit, default and meaning, from the settings themselves.

``python -m pipeline.scenario.reference > docs/scenario.md`` makes the page.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Sequence
from inspect import cleandoc
from types import NoneType, UnionType
from typing import Annotated, Any, Literal, Union, get_args, get_origin

from pydantic import BaseModel
from pydantic.fields import FieldInfo

from pipeline.mistakes import describe
from pipeline.scenario.schema_errors import sections
from pipeline.settings.section import ANY_KEY, choosing_key, kind

_HEADER = """# Keys of a scenario file

One YAML file is one scenario. This page is made by `python -m pipeline.scenario.reference`;
`pipeline schema` prints the same as a JSON Schema for editors.

Keys whose default is `required` must be there. A list is written as `[1, 2]`, a number with a decimal point
and without separators. Angles are in degrees.

On an elevation model a scenario lies on the map: `domain`, points and `receptors` are in eastings and
northings of its reference system, and releases are polygons, as in `scenarios/torrent/torrent.yaml`:

```yaml
terrain: {elevation: terrain.tif, curvature_length: 20}
points: {spacing: 4}
release: {polygons: releases.gpkg, name: slide, volume: 12000}
material: {bed_friction: 7, turbulent_friction: 250, earth_pressure: isotropic}
receptors: buildings.gpkg
```

Files are found relative to the scenario file; their content is part of the scenario. Polygons and receptors
may be in any reference system. Where spacings agree the points are the centres of the elevation model's
cells, the domain being moved on to them. It takes a lattice, or points of layout `poisson-disc` or `graded`
with a spacing, the weighted-residual form, earth pressure `isotropic` or `mohr-coulomb-flow`, and open
sides. `terrain.elevation`, its curvature length, the polygons and their depth or volume may be varied; all
runs lie on the cells of the scenario's own elevation model.
Attributes of polygons are used where the scenario says nothing else, in capitals or not: `name`, `depth`,
`volume`, and `return_period` with `return_periods: polygons`. Keys of `sweep` and `sample` may call a
release by the name or the layer that it asks for, and one of its polygons by its own name, as
`release.slide.depth` or, of a list, `release.0.slide.volume`. What polygons that overlap release adds up.
Without a `domain` only the part of the raster is read that
the flow comes to.

A flow takes up its bed where there is an `erodible_bed`, as in `scenarios/torrent/erosion.yaml`:

```yaml
material: {density: 2000, bed_friction: 7, turbulent_friction: 250, earth_pressure: isotropic}
erodible_bed:
  depth: 1.5
  law: {model: shear-stress, rate: 0.025, depth_per_stress: 1.0e-4, critical_stress: 1000}
  minimum_depth: 0.1
  minimum_speed: 0.1
```

`docs/method.md`, "Erosion", has the equations of the laws, with usual values and sources.

Dams, basins and buildings are a list. Dams and basins change an elevation model. Buildings stand on any
terrain and any points; on a profile their corners are given along and across the bed. A second scenario
without one of them, compared by `pipeline compare`, says what it does:

```yaml
structures:
  - {kind: building, polygon: buildings.gpkg}
  - {kind: dam, line: dam.gpkg, height: 5, side_slope: 34, crest_width: 3}
sweep: {structures.1.height: [0, 3, 5]}
```

What comes in through a section, and where discharge is measured, are lists. `release` may be left out beside
`inflow`. Both take the weighted-residual form, any layout of points, and on a slope profile a `domain`:

```yaml
inflow:
  - {name: apex, section: [[120, -8], [120, 8]], hydrograph: {file: q.csv}, depth: normal}
  - name: tributary
    section: [[60, -20], [80, -20]]
    hydrograph: {shape: triangle, volume: 4000, peak_discharge: 60}
    froude: 1.5
sections: [{name: bridge, line: [[600, -20], [600, 20]]}]
```

with `q.csv` as

```csv
time (s),discharge (m3/s)
0,0
20,60
200,0
```
"""
_TABLE = "| key | unit | values | default | meaning |\n|---|---|---|---|---|"


def markdown() -> str:
    """Give the page of all keys, as it stands in ``docs/scenario.md``."""
    parts = [_HEADER.rstrip()]
    walked = list(sections())
    for loc, model in walked:
        if (title := _title(loc, model)) is None:
            continue
        chosen = [other for at, other in walked if at[:-1] == loc[:-1] and _is_one_of(at, other)]
        if _is_one_of(loc, model) and chosen[0] is model:
            parts.append(f"\n## `{_dotted(loc[:-1])}`: one of\n\n" + "\n".join(map(_choice, chosen)))
        doc = cleandoc(model.__doc__ or "")
        parts.append(f"\n## {title}\n\n{doc}\n\n{_TABLE}\n" + "\n".join(_rows(model)))
    return "\n".join(parts) + "\n"


def _is_one_of(loc: tuple[str, ...], model: type[BaseModel]) -> bool:
    """Whether a section is one of several that may stand in its place."""
    return bool(loc) and choosing_key(model) != "" and kind(model) == loc[-1]


def _choice(model: type[BaseModel]) -> str:
    """Describe one of several sections in a line."""
    what = cleandoc(model.__doc__ or "").partition("\n\n")[0].replace("\n", " ")
    advice = getattr(model, "advice", "")
    return f"- `{choosing_key(model)}: {kind(model)}`: {what}" + (f" For {advice}." if advice else "")


def _dotted(loc: tuple[str, ...]) -> str:
    return ".".join(part for part in loc if part not in ("one", ANY_KEY))


def _title(loc: tuple[str, ...], model: type[BaseModel]) -> str | None:
    """Name a section as a user sees it; None where it is a second way to one that has its table."""
    match loc:
        case ():
            return "The file"
        case (*_, "given") | (_, "many", _) | ("inflow" | "release", "many", *_):
            return None
        case _ if _is_one_of(loc, model):
            return f"`{_dotted(loc[:-1])}`, {choosing_key(model)} `{loc[-1]}`"
        case ("release", _, "polygons", "each", _):
            return "`release.each`, by name of a polygon"
        case ("points", "graded", *rest):
            return f"`points`, `{'.'.join(rest)}` of layout `graded`"
        case ("inflow", "one") | ("sections",):
            return f"Each of `{loc[0]}`"
        case ("sample", "correlations") | ("receptors", "list"):
            return f"Each of `{'.'.join(part for part in loc if part != 'list')}`"
        case ("receptors", "layer"):
            return "`receptors`, a layer of a file"
        case ("terrain", "segments", name):
            return f"`terrain`, each of `{name}`"
        case _:
            return f"`{'.'.join(loc)}`"


def _rows(model: type[BaseModel]) -> list[str]:
    """List a section's keys, required ones first."""
    fields = sorted(model.model_fields.items(), key=lambda item: not item[1].is_required())
    return [
        " | ".join(
            cell.replace("|", "\\|")
            for cell in (f"`{name}`", _unit(info), _values(info), _default(info), _meaning(info))
        ).join(("| ", " |"))
        for name, info in fields
    ]


def _extra(info: FieldInfo, name: str) -> Any:
    extra = info.json_schema_extra
    return extra.get(name) if isinstance(extra, dict) else None


def _meaning(info: FieldInfo) -> str:
    """Give what a key means, and a word on what to choose."""
    advice = _extra(info, "advice")
    return f"{info.description}. {advice}" if advice else str(info.description)


def _values(info: FieldInfo) -> str:
    """Say which values a key takes."""
    if choices := _extra(info, "choices"):
        return "; ".join(f"`{value}`: {word}" for value, word in choices.items())
    return _taken(info.annotation, info.metadata)


def _taken(hint: Any, metadata: Sequence[Any] = ()) -> str:
    """Say which values a type takes, with the bounds that its metadata give."""
    origin, inner = get_origin(hint), get_args(hint)
    if origin is Annotated:
        return _taken(inner[0], [*metadata, *_flat(inner[1:])])
    if origin is Literal:
        return ", ".join(f"`{value}`" for value in inner)
    if origin in (Union, UnionType):
        kinds = [each for each in inner if each is not NoneType and not (each is int and float in inner)]
        return " or ".join(dict.fromkeys(_taken(each, metadata) for each in kinds))
    if origin is tuple:
        what = _taken(inner[0])
        return f"list: {what}" if Ellipsis in inner else f"list of {len(inner)}: {what}"
    if origin is dict:
        return f"mapping of keys to {_taken(inner[1])}"
    if isinstance(hint, type) and issubclass(hint, BaseModel):
        return "section"
    plain = {float: "number", int: "whole number", bool: "`true`, `false`", str: "text"}[hint]
    return ", ".join([plain, *_bounds(metadata)]) if hint in (int, float) else plain


def _bounds(metadata: Sequence[Any]) -> Iterator[str]:
    words = {"gt": "above", "ge": "at least", "lt": "below", "le": "at most"}
    for item in metadata:
        for name, word in words.items():
            if (bound := getattr(item, name, None)) is not None:
                yield f"{word} {bound:g}"


def _flat(metadata: Iterable[Any]) -> Iterator[Any]:
    """Take apart pydantic's own metadata, which hold several bounds."""
    for item in metadata:
        yield from item.metadata if isinstance(item, FieldInfo) else (item,)


def _unit(info: FieldInfo) -> str:
    return str(_extra(info, "unit") or "-")


def _default(info: FieldInfo) -> str:
    if info.is_required():
        return "required"
    value = info.default
    if value is None:
        return "see meaning"
    if isinstance(value, BaseModel | dict):
        return "-"
    if isinstance(value, tuple):
        return ", ".join(_item(item) for item in value) or "-"
    return describe(value).strip("'") or "-"


def _item(value: object) -> str:
    if isinstance(value, tuple):
        return f"[{', '.join(map(_item, value))}]"
    return describe(value).strip("'")


if __name__ == "__main__":
    print(markdown(), end="")
