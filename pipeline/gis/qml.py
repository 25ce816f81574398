"""Styles of QGIS: how a raster or a vector layer is drawn, as XML."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from typing import Literal
from xml.etree import ElementTree as Xml

import numpy as np
from matplotlib.colors import to_rgb

from pipeline.gis.symbology import UNKNOWN_COLOUR, UNKNOWN_WORDS, Style

VERSION = "3.22.0"
DOCTYPE = "<!DOCTYPE qgis PUBLIC 'http://mrcc.com/qgis.dtd' 'SYSTEM'>\n"
# above every value of a map
INFINITE = "inf"
# where nothing is drawn; and the part of a class that is no difference
FREE, NONE = "#ffffff", 1e-3
UNKNOWN = 254
Geometry = Literal["Point", "Line", "Polygon"]


@dataclass(frozen=True)
class Mark:
    """How features of one kind are drawn.

    Parameters
    ----------
    filter : str
        Which ones, as an expression of QGIS; "" for all.
    fill : str
        Colour, or "" for none.
    """

    label: str
    fill: str = ""
    line: str = "#333333"
    width: float = 0.3
    filter: str = ""
    opacity: float = 1.0
    dashed: bool = False


def to_text(root: Xml.Element) -> str:
    """Write a style or a project."""
    Xml.indent(root)
    return DOCTYPE + Xml.tostring(root, encoding="unicode") + "\n"


def raster_style(style: Style | None) -> Xml.Element:
    """Make the style of a raster; a hillshade where there is no legend."""
    root = Xml.Element("qgis", version=VERSION, styleCategories="AllStyleCategories")
    root.append(raster_pipe(style))
    Xml.SubElement(root, "blendMode").text = "0"
    return root


def raster_pipe(style: Style | None) -> Xml.Element:
    """Make what stands in a style and in a project for a raster."""
    pipe = Xml.Element("pipe")
    if style is None:
        light = {"azimuth": "315", "angle": "45", "zfactor": "1", "multidirection": "0"}
        Xml.SubElement(pipe, "rasterrenderer", _renderer("hillshade", opacity=0.6) | light)
    elif style.discrete:
        renderer = Xml.SubElement(pipe, "rasterrenderer", _renderer("paletted"))
        palette = Xml.SubElement(renderer, "colorPalette")
        for each in style.entries:
            _entry(palette, "paletteEntry", f"{each.lower:g}", each.colour, each.label)
        _entry(palette, "paletteEntry", str(UNKNOWN), UNKNOWN_COLOUR, UNKNOWN_WORDS)
    else:
        low, high = style.edges[0], style.edges[-2 if np.isinf(style.edges[-1]) else -1]
        renderer = Xml.SubElement(
            pipe,
            "rasterrenderer",
            _renderer("singlebandpseudocolor")
            | {"classificationMin": f"{low:g}", "classificationMax": f"{high:g}"},
        )
        shader = Xml.SubElement(
            Xml.SubElement(renderer, "rastershader"),
            "colorrampshader",
            colorRampType="DISCRETE",
            classificationMode="1",
            clip="0",
            minimumValue=f"{low:g}",
            maximumValue=f"{high:g}",
        )
        for value, colour, label, alpha in _items(style):
            _entry(shader, "item", value, colour, label, alpha)
    Xml.SubElement(pipe, "brightnesscontrast", brightness="0", contrast="0", gamma="1")
    Xml.SubElement(pipe, "huesaturation", saturation="0", colorizeOn="0")
    Xml.SubElement(pipe, "rasterresampler", maxOversampling="2")
    if style is None:
        # slopes of elevations between which nothing is interpolated are steps
        Xml.SubElement(pipe, "resamplingStage").text = "provider"
        ways = {f"zoomed{way}ResamplingMethod": "cubic" for way in ("In", "Out")}
        given = {"enabled": "true", "maxOversampling": "2", **ways}
        Xml.SubElement(Xml.SubElement(pipe, "provider"), "resampling", given)
    return pipe


def _items(style: Style) -> Iterator[tuple[str, str, str, int]]:
    """Give value, colour, label and opacity of each step: a colour reaches up to its value."""
    low = style.edges[0]
    if low >= 0:
        yield f"{low:.9g}", FREE, f"up to {low:g}", 0
    for each in style.entries:
        upper = INFINITE if np.isinf(each.upper) else f"{each.upper:.9g}"
        if each.lower < 0 < each.upper:
            # of differences: what is none
            yield upper, FREE, each.label, 0
        elif low < 0 and each.upper == 0:
            none = NONE * (each.upper - each.lower)
            yield f"{-none:.9g}", each.colour, each.label, 255
            yield f"{none:.9g}", FREE, "0", 0
        else:
            yield upper, each.colour, each.label, 255


def _renderer(kind: str, opacity: float = 1.0) -> dict[str, str]:
    return {"type": kind, "band": "1", "opacity": f"{opacity:g}", "alphaBand": "-1", "nodataColor": ""}


def _entry(parent: Xml.Element, tag: str, value: str, colour: str, label: str, alpha: int = 255) -> None:
    Xml.SubElement(parent, tag, value=value, color=colour, alpha=str(alpha), label=label)


def vector_style(
    marks: Sequence[Mark], geometry: Geometry, aliases: Mapping[str, str], labelled: str = ""
) -> Xml.Element:
    """Make the style of a vector layer.

    Parameters
    ----------
    marks : sequence of Mark
        Each with the features that it is for.
    geometry : str
        Kind of the features.
    aliases : mapping of str to str
        What fields are called for people.
    labelled : str
        Field whose value is written at each feature; "" for none.
    """
    root = Xml.Element(
        "qgis",
        version=VERSION,
        styleCategories="AllStyleCategories",
        labelsEnabled="1" if labelled else "0",
    )
    for part in vector_parts(marks, geometry, aliases, labelled):
        root.append(part)
    return root


def vector_parts(
    marks: Sequence[Mark], geometry: Geometry, aliases: Mapping[str, str], labelled: str = ""
) -> list[Xml.Element]:
    """Make what stands in a style and in a project for a vector layer."""
    renderer = Xml.Element(
        "renderer-v2", type="RuleRenderer", symbollevels="0", enableorderby="0", forceraster="0"
    )
    rules = Xml.SubElement(renderer, "rules", key="root")
    symbols = Xml.SubElement(renderer, "symbols")
    for i, mark in enumerate(marks):
        rule = {"key": f"rule{i}", "label": mark.label, "symbol": str(i)}
        Xml.SubElement(rules, "rule", rule | ({"filter": mark.filter} if mark.filter else {}))
        symbols.append(_symbol(mark, geometry, str(i)))
    named = Xml.Element("aliases")
    for i, (field, words) in enumerate(aliases.items()):
        Xml.SubElement(named, "alias", field=field, index=str(i), name=words)
    parts = [renderer, named]
    if labelled:
        parts.insert(1, _labels(labelled, geometry))
    return parts


def _symbol(mark: Mark, geometry: Geometry, name: str) -> Xml.Element:
    kinds = {"Point": "marker", "Line": "line", "Polygon": "fill"}
    symbol = Xml.Element(
        "symbol",
        type=kinds[geometry],
        name=name,
        alpha=f"{mark.opacity:g}",
        clip_to_extent="1",
        force_rhr="0",
    )
    line = {"line_color": _rgba(mark.line), "line_width": f"{mark.width:g}", "line_width_unit": "MM"}
    outline = {f"outline_{name.removeprefix('line_')}": value for name, value in line.items()}
    style = "dash" if mark.dashed else "solid"
    if geometry == "Point":
        given = {"name": "circle", "color": _rgba(mark.fill or mark.line), "size": "2.4", **outline}
        layer = _symbol_layer("SimpleMarker", given)
    elif geometry == "Line":
        layer = _symbol_layer("SimpleLine", {**line, "line_style": style})
    else:
        fill = {"color": _rgba(mark.fill or "#ffffff"), "style": "solid" if mark.fill else "no"}
        layer = _symbol_layer("SimpleFill", {**fill, **outline, "outline_style": style})
    symbol.append(layer)
    return symbol


def _symbol_layer(kind: str, given: Mapping[str, str]) -> Xml.Element:
    layer = Xml.Element("layer", {"class": kind, "enabled": "1", "locked": "0", "pass": "0"})
    options = Xml.SubElement(layer, "Option", type="Map")
    for name, value in given.items():
        Xml.SubElement(options, "Option", name=name, type="QString", value=value)
    return layer


def _labels(field: str, geometry: Geometry) -> Xml.Element:
    labelling = Xml.Element("labeling", type="simple")
    settings = Xml.SubElement(labelling, "settings")
    style = Xml.SubElement(
        settings, "text-style", fieldName=field, fontSize="9", fontSizeUnit="Point", textColor="20,20,20,255"
    )
    Xml.SubElement(
        style,
        "text-buffer",
        bufferDraw="1",
        bufferSize="0.8",
        bufferSizeUnits="MM",
        bufferColor="255,255,255,255",
    )
    # around a point, along a line, within an area
    where = {"Point": "0", "Line": "2", "Polygon": "1"}
    Xml.SubElement(settings, "placement", placement=where[geometry], placementFlags="10", dist="1")
    return labelling


def _rgba(colour: str) -> str:
    return ",".join(str(round(255 * part)) for part in to_rgb(colour)) + ",255"
