"""The maps of a place as one project of QGIS."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field
from pathlib import Path
from xml.etree import ElementTree as Xml

from pipeline.gis.qml import VERSION, raster_pipe, to_text, vector_parts
from pipeline.gis.raster import Grid
from pipeline.gis.symbology import Style
from pipeline.gis.vectors import Features
from pipeline.store.folder import whole

PROJECT = "hazard.qgs"


@dataclass(frozen=True)
class RasterFile:
    """A raster that was written: its title, how it looks, whether it is a bound of another one, its units."""

    path: Path
    title: str
    style: Style | None
    is_bound: bool = False
    units: str = ""


@dataclass(frozen=True, eq=False)
class Group:
    """What was written of one scenario, or of all together; ``runs`` says how many are behind it."""

    name: str
    runs: str
    grid: Grid
    package: Path
    rasters: Sequence[RasterFile]
    features: Sequence[Features]
    paths: Sequence[Path] = field(default=())


def write_project(groups: Sequence[Group], folder: Path) -> Path:
    """Write a project with all maps of a place, the first map of the first scenario shown.

    Files are named relative to the project, so that the folder may be moved.

    Raises
    ------
    OSError
        If it cannot be written.
    """
    path = folder / PROJECT
    root = Xml.Element("qgis", version=VERSION, projectname="Hazard maps")
    Xml.SubElement(root, "homePath", path="")
    Xml.SubElement(root, "title").text = "Hazard maps"
    Xml.SubElement(root, "projectCrs").append(_system(groups[0].grid.crs))
    tree = Xml.SubElement(root, "layer-tree-group")
    layers = Xml.Element("projectlayers")
    for number, group in enumerate(groups):
        _add(group, number, folder, tree, layers)
    canvas = Xml.SubElement(root, "mapcanvas", name="theMapCanvas")
    Xml.SubElement(canvas, "units").text = "meters"
    _extent(canvas, groups[0].grid)
    Xml.SubElement(canvas, "rotation").text = "0"
    Xml.SubElement(canvas, "destinationsrs").append(_system(groups[0].grid.crs))
    root.append(layers)
    properties = Xml.SubElement(root, "properties")
    relative = Xml.SubElement(properties, "Paths")
    Xml.SubElement(relative, "Absolute", type="bool").text = "false"
    # without it the reference system of the project is not read
    projected = Xml.SubElement(properties, "SpatialRefSys")
    Xml.SubElement(projected, "ProjectionsEnabled", type="int").text = "1"
    with whole(path) as aside:
        aside.write_text(to_text(root), encoding="utf-8")
    return path


def _add(group: Group, number: int, folder: Path, tree: Xml.Element, layers: Xml.Element) -> None:
    """Add the layers of a group: what is marked above the maps, the ground below them."""
    shown = number == 0
    branch = _branch(tree, group.name, shown)
    maps = {raster.path.stem for raster in group.rasters}
    marks = [each for each in group.features if each.name not in maps]
    outlines = [each for each in group.features if each.name in maps]
    for each in marks:
        _vector(group, each, _id(number, each.name), folder, branch, layers, shown=shown)
    whole_maps = [each for each in group.rasters if not each.is_bound and each.style is not None]
    for i, raster in enumerate(whole_maps):
        _raster(group, raster, _id(number, raster.path.stem), folder, branch, layers, shown=shown and i == 0)
    bounds = [each for each in group.rasters if each.is_bound]
    if bounds:
        below = _branch(branch, "bounds, for runs that are missing", shown=False)
        for raster in bounds:
            _raster(group, raster, _id(number, raster.path.stem), folder, below, layers, shown=False)
    if outlines:
        below = _branch(branch, "maps as polygons", shown=False)
        for each in outlines:
            _vector(group, each, _id(number, f"polygons_{each.name}"), folder, below, layers, shown=False)
    for raster in (each for each in group.rasters if each.style is None):
        _raster(group, raster, _id(number, raster.path.stem), folder, branch, layers, shown=shown)


def _id(number: int, name: str) -> str:
    """Name a layer of a group; QGIS passes over names of ten characters or fewer."""
    return f"scenario_{number}_{name}"


def _branch(tree: Xml.Element, name: str, shown: bool) -> Xml.Element:
    checked = "Qt::Checked" if shown else "Qt::Unchecked"
    return Xml.SubElement(
        tree, "layer-tree-group", name=name, checked=checked, expanded="1" if shown else "0"
    )


def _leaf(tree: Xml.Element, name: str, title: str, source: str, provider: str, *, shown: bool) -> None:
    checked = "Qt::Checked" if shown else "Qt::Unchecked"
    given = {"id": name, "name": title, "source": source, "providerKey": provider, "checked": checked}
    Xml.SubElement(tree, "layer-tree-layer", {**given, "expanded": "1" if shown else "0"})


def _raster(
    group: Group,
    raster: RasterFile,
    name: str,
    folder: Path,
    tree: Xml.Element,
    layers: Xml.Element,
    *,
    shown: bool,
) -> None:
    source = f"./{raster.path.relative_to(folder).as_posix()}"
    _leaf(tree, name, raster.title, source, "gdal", shown=shown)
    layer = _map_layer(layers, "raster", name, raster.title, source, group.grid)
    Xml.SubElement(layer, "provider").text = "gdal"
    layer.append(raster_pipe(raster.style))
    Xml.SubElement(layer, "blendMode").text = "0"


def _vector(
    group: Group,
    features: Features,
    name: str,
    folder: Path,
    tree: Xml.Element,
    layers: Xml.Element,
    *,
    shown: bool,
) -> None:
    if not features.shapes:
        return
    source = f"./{group.package.relative_to(folder).as_posix()}|layername={features.name}"
    _leaf(tree, name, features.title, source, "ogr", shown=shown)
    layer = _map_layer(layers, "vector", name, features.title, source, group.grid)
    layer.set("geometry", features.geometry)
    layer.set("labelsEnabled", "1" if features.labelled else "0")
    Xml.SubElement(layer, "provider", encoding="UTF-8").text = "ogr"
    named = {each: features.aliases[each] for each in features.fields}
    for part in vector_parts(features.marks, features.geometry, named, features.labelled):
        layer.append(part)


def _map_layer(layers: Xml.Element, kind: str, name: str, title: str, source: str, grid: Grid) -> Xml.Element:
    layer = Xml.SubElement(layers, "maplayer", type=kind)
    _extent(layer, grid)
    for tag, text in (("id", name), ("datasource", source), ("layername", title)):
        Xml.SubElement(layer, tag).text = text
    Xml.SubElement(layer, "srs").append(_system(grid.crs))
    return layer


def _extent(parent: Xml.Element, grid: Grid) -> None:
    extent = Xml.SubElement(parent, "extent")
    for name, value in zip(("xmin", "ymin", "xmax", "ymax"), grid.bounds, strict=True):
        Xml.SubElement(extent, name).text = f"{value:.6f}"


def _system(code: str) -> Xml.Element:
    """Write a reference system as QGIS does; it takes the code first, and then the text."""
    import rasterio.crs

    found = rasterio.crs.CRS.from_user_input(code)
    authority = found.to_authority()
    system = Xml.Element("spatialrefsys")
    Xml.SubElement(system, "wkt").text = found.to_wkt()
    Xml.SubElement(system, "proj4").text = found.to_proj4()
    Xml.SubElement(system, "authid").text = ":".join(authority) if authority else ""
    return system
