"""What is wrong with an erodible bed, each with one message that says what to write."""

# ruff: noqa: E501 - a message is one line

import numpy as np
import pytest
from elevation_files import ROWS, TEXT, ground, write_polygons, write_raster, written
from messages import messages

from pipeline.errors import BadInput
from pipeline.scenario.scenario import load

LAW = "law: {model: growth-rate, growth: 0.01}"
GOOD = f"""\
name: good
terrain: {{profile: plane, angle: 30}}
domain: {{x: [0, 10], y: [-2, 2]}}
points: {{spacing: 0.5}}
release: {{shape: box, x: [1, 2], y: [-1, 1], height: 1}}
material: {{bed_friction: 20, earth_pressure: isotropic}}
erodible_bed: {{depth: 0.2, {LAW}}}
time: {{end: 1}}
"""
LAWS = "growth-rate, shear-stress, shear-work, egashira, jump-condition"


@pytest.mark.parametrize(
    ("old", "new", "message"),
    [
        ("depth: 0.2, ", "", "7:1: erodible_bed.depth: expected a value, found nothing"),
        ("depth: 0.2", "depth: -0.2", "7:23: erodible_bed.depth: expected a number of at least 0, found -0.2"),
        ("depth: 0.2", "depth: deep.tif", "7:23: erodible_bed.depth: expected a number, as a raster needs an elevation model, found a file"),
        ("depth: 0.2", "polygons: bed.gpkg", "7:26: erodible_bed.polygons: expected a region, as polygons need an elevation model, found polygons"),
        ("depth: 0.2", "depth: 0.2, layer: bed", "7:1: erodible_bed.polygons: expected polygons, as layer is given, found none"),
        (f", {LAW}", "", "7:1: erodible_bed.law: expected a value, found nothing"),
        ("growth-rate", "growth", f"7:41: erodible_bed.law.model: expected one of {LAWS}, found 'growth'"),
        (", growth: 0.01", "", "7:28: erodible_bed.law.growth: expected a value, found nothing"),
        ("model: growth-rate, growth: 0.01", "model: shear-stress", "6:1: material.density: expected a density with erosion by shear-stress, found nothing"),
        ("model: growth-rate, growth: 0.01", "model: jump-condition, strength_coefficient: 0.1", "7:1: erodible_bed.minimum_speed: expected a speed above 0, as the jump condition has no bound at rest, found 0"),
        ("depth: 0.2", "depth: 0.2, region: {x: [11, 12], y: [-1, 1]}", "erodible_bed.region: expected an erodible bed inside the domain, x [0, 10] and y [-2, 2], found a region outside it"),
        ("time:", "scheme: {form: collocation}\ntime:", "8:16: scheme.form: expected form weighted-residual with an erodible bed, as the other does not conserve volume, found collocation"),
        ("time:", "sweep: {erodible_bed.depth: [0.1, -1]}\ntime:", "expected a number of at least 0, found -1"),
    ],
)  # fmt: skip
def test_a_mistake_is_told_by_its_place(tmp_path, old, new, message):
    assert old in GOOD
    (line,) = messages(tmp_path, GOOD.replace(old, new, 1))
    assert message in line


def test_a_field_of_erosion_needs_a_bed(tmp_path):
    bare = "".join(line + "\n" for line in GOOD.splitlines() if "erodible" not in line)
    (line,) = messages(tmp_path, bare + "output: {fields: [max_depth, bed_change]}\n")
    assert "output.fields: expected an erodible bed, as bed_change is kept, found none" in line


@pytest.fixture
def folder(tmp_path):
    write_raster(tmp_path / "dem.tif", ground())
    write_polygons(tmp_path / "releases.gpkg", {"slide": (20, -120, 50, -80)})
    write_polygons(tmp_path / "bed.gpkg", {"reach": (60, -115, 100, -85)}, depth=0.5)
    return tmp_path


def refused(folder, bed):
    with pytest.raises(BadInput) as caught:
        load([written(folder, f"{TEXT}erodible_bed: {{{bed}, {LAW}}}\n")])
    (line,) = str(caught.value).splitlines()
    return line


class TestOnElevationModels:
    def test_no_such_file(self, folder):
        for bed in ("depth: deep.tif", "polygons: none.gpkg"):
            assert "expected a readable file, found none" in refused(folder, bed)

    def test_a_region(self, folder):
        line = refused(folder, "depth: 1, region: {x: [0, 1], y: [0, 1]}")
        assert "erodible_bed.region: expected polygons on an elevation model, found a region" in line

    def test_negative_depths(self, folder):
        write_raster(folder / "deep.tif", np.full((ROWS, 60), -0.5))
        assert "erodible_bed.depth: expected depths of at least 0, found -0.5 (deep.tif)" in refused(
            folder, "depth: deep.tif"
        )

    def test_another_reference_system(self, folder):
        write_raster(folder / "deep.tif", np.ones((ROWS, 60)), crs="EPSG:32632")
        line = refused(folder, "depth: deep.tif")
        assert (
            "expected a raster in the reference system of the elevation model, EPSG:2056, found EPSG:32632"
            in line
        )

    def test_polygons_without_a_depth(self, folder):
        write_polygons(folder / "bed.gpkg", {"reach": (60, -115, 100, -85)}, depth=np.nan)
        assert "or an attribute depth of each polygon of at least 0, found 'reach'" in refused(
            folder, "polygons: bed.gpkg"
        )

    def test_an_unknown_polygon(self, folder):
        line = refused(folder, "polygons: bed.gpkg, name: rich")
        assert "expected one of the polygons reach, found 'rich'" in line

    def test_polygons_outside(self, folder):
        write_polygons(folder / "bed.gpkg", {"reach": (6000, -115, 6100, -85)}, depth=0.5)
        assert "expected an erodible bed in the domain" in refused(folder, "polygons: bed.gpkg")
