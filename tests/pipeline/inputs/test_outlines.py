"""Outlines read from files of polygons, and what is none."""

import json

import numpy as np
import pytest

from pipeline.inputs.outlines import OutlineError, read, read_places

SQUARE = [[2600000.0, 1200000.0], [2600040.0, 1200000.0], [2600040.0, 1200030.0], [2600000.0, 1200030.0]]
HOLE = [[2600010.0, 1200010.0], [2600020.0, 1200010.0], [2600020.0, 1200020.0], [2600010.0, 1200020.0]]

CROSSED = [SQUARE[0], SQUARE[2], SQUARE[1], SQUARE[3]]
DEGREES = [[7.43863, 46.95108], [7.43963, 46.95108], [7.43963, 46.95208]]
WORLD = "urn:ogc:def:crs:OGC:1.3:CRS84"


def write(path, *features, crs="urn:ogc:def:crs:EPSG::2056"):
    made = [
        {"type": "Feature", "properties": about, "geometry": {"type": kind, "coordinates": places}}
        for kind, places, about in features
    ]
    system = {"crs": {"type": "name", "properties": {"name": crs}}}
    path.write_text(json.dumps({"type": "FeatureCollection", "features": made} | system))
    return path


def closed(ring):
    return [*ring, ring[0]]


def area(ring):
    x, y = ring.T - ring.T[:, :1]
    return 0.5 * (x * np.roll(y, -1) - np.roll(x, -1) * y).sum()


def test_outer_rings_turn_left_and_holes_right(tmp_path):
    polygon = [closed(SQUARE[::-1]), closed(HOLE)]
    path = write(tmp_path / "a.geojson", ("Polygon", polygon, {"name": "slide", "depth": 1.5}))
    (found,) = read(path, "EPSG:2056")
    assert found.name == "slide"
    assert found.attributes == {"name": "slide", "depth": 1.5}
    assert [area(ring) for ring in found.rings] == pytest.approx([1200, -100])


def test_other_systems_are_brought_to_that_of_the_elevation_model(tmp_path):
    degrees = [[7.43863, 46.95108], [7.43963, 46.95108], [7.43963, 46.95208]]
    path = write(
        tmp_path / "a.geojson", ("Polygon", [closed(degrees)], {}), crs="urn:ogc:def:crs:OGC:1.3:CRS84"
    )
    (found,) = read(path, "EPSG:2056")
    assert found.name == "1"
    np.testing.assert_allclose(found.rings[0][0], [2600000, 1200000], atol=15)


def test_layers_are_named_where_there_are_several(tmp_path):
    import pyogrio

    for number, layer in enumerate(("slide", "other")):
        source = write(tmp_path / "a.geojson", ("Polygon", [closed(SQUARE)], {"number": number}))
        meta, _, geometry, fields = pyogrio.raw.read(source)
        pyogrio.raw.write(
            tmp_path / "a.gpkg", geometry, fields, meta["fields"], layer=layer, crs=meta["crs"],
            geometry_type="Polygon", append=number > 0,
        )  # fmt: skip
    with pytest.raises(OutlineError, match=r"found slide, other; write `layer: slide`"):
        read(tmp_path / "a.gpkg", "EPSG:2056")
    with pytest.raises(OutlineError, match="one of the layers slide, other, found 'dam'"):
        read(tmp_path / "a.gpkg", "EPSG:2056", "dam")
    assert read(tmp_path / "a.gpkg", "EPSG:2056", "other")[0].attributes == {"number": 1}
    with pytest.raises(OutlineError, match=r"write `receptors: {file: a\.gpkg, layer: slide}`"):
        read_places(tmp_path / "a.gpkg", "EPSG:2056")
    assert read_places(tmp_path / "a.gpkg", "EPSG:2056", "slide")[0].kind == "polygon"


def test_a_table_without_shapes_is_no_layer_to_choose(tmp_path):
    import pyogrio

    def add(layer, geometry, fields, names, **about):
        pyogrio.raw.write(tmp_path / "a.gpkg", geometry, fields, names, layer=layer, append=True, **about)

    styles = [np.array(["red"], dtype=object)]
    add("layer_styles", None, styles, ["style"], geometry_type=None, crs=None)
    with pytest.raises(OutlineError, match=r"expected polygons, found none in a\.gpkg"):
        read(tmp_path / "a.gpkg", "EPSG:2056")
    source = write(tmp_path / "a.geojson", ("Polygon", [closed(SQUARE)], {"number": 3}))
    meta, _, geometry, fields = pyogrio.raw.read(source)
    add("slide", geometry, fields, meta["fields"], geometry_type="Polygon", crs=meta["crs"])
    assert read(tmp_path / "a.gpkg", "EPSG:2056")[0].attributes == {"number": 3}


@pytest.mark.parametrize(
    ("feature", "words"),
    [
        (("Point", SQUARE[0], {}), "found a Point in feature 1 of"),
        (("Polygon", [closed(CROSSED)], {"name": "bow"}), r"feature 1 \('bow'\).*Self-intersection"),
    ],
)
def test_what_is_no_simple_polygon_is_told(tmp_path, feature, words):
    with pytest.raises(OutlineError, match=words):
        read(write(tmp_path / "a.geojson", feature), "EPSG:2056")


def test_other_files_are_told(tmp_path):
    (tmp_path / "a.csv").write_text("a,b\n1,2\n")
    with pytest.raises(OutlineError, match="expected"):
        read(tmp_path / "a.csv", "EPSG:2056")
    (tmp_path / "a.txt").write_text("nothing")
    with pytest.raises(OutlineError, match=r"found a\.txt, which is none"):
        read(tmp_path / "a.txt", "EPSG:2056")
