import numpy as np
import pytest
from elevation_files import NORTH, TEXT, WEST, ground, write_polygons, write_raster, written

import pipeline
from pipeline.scenario.plausibility import of_depths

MUD = {
    "name": "mud",
    "terrain": {"profile": "plane", "angle": 10},
    "domain": {"x": [0, 60], "y": [-10, 10]},
    "points": {"spacing": 2},
    "release": {"shape": "box", "x": [10, 20], "y": [-5, 5], "height": 2},
    "material": {
        "density": 2000,
        "friction": {"law": "bingham", "yield_stress": 500, "viscosity": 80},
        "earth_pressure": "isotropic",
    },
    "time": {"end": 10},
}


def warned(**changed):
    (scenario,) = pipeline.load({**MUD, **changed})
    return scenario.warnings


def test_usual_values_are_not_warned_of():
    assert warned() == ()
    no_yield = {"law": "bingham", "yield_stress": 0, "viscosity": 80}
    assert warned(material={**MUD["material"], "friction": no_yield}) == ()


@pytest.mark.parametrize(
    ("key", "value", "told"),
    [
        ("yield_stress", 0.5, "yield_stress: 0.5 Pa is far from what is usual, 5 to 20000 Pa"),
        ("viscosity", 5e4, "viscosity: 50000 Pa s is far"),
        ("density", 2.0, "material.density: 2 kg m-3 is far"),
    ],
)
def test_values_of_another_unit_are_warned_of(key, value, told):
    material = dict(MUD["material"])
    if key == "density":
        material[key] = value
    else:
        material["friction"] = {**material["friction"], key: value}
    (line,) = warned(material=material)
    assert told in line
    assert line.endswith("check the unit")


def test_a_release_that_no_slide_is_as_deep_as_is_warned_of():
    box = {"shape": "box", "x": [10, 20], "y": [-5, 5]}
    said = "release: a depth of 200 m is far from what is usual, 100 m at most: check the unit"
    for deep in ({"height": 200}, {"height": 1, "volume": 20000}):
        (line,) = warned(release={**box, **deep})
        assert said in line


def test_swept_values_are_warned_of_too():
    (line,) = warned(sweep={"material.friction.yield_stress": [0.5, 500]})
    assert "0.5 Pa is far" in line


def test_erosion_by_stress_in_kilopascal_is_warned_of():
    law = {"model": "shear-stress", "depth_per_stress": 0.1, "critical_stress": 1}
    lines = warned(erodible_bed={"depth": 0.3, "law": law})
    assert len(lines) == 2
    assert "erodible_bed.law.depth_per_stress: 0.1 m Pa-1 is far" in lines[0]
    assert "erodible_bed.law.critical_stress: 1 Pa is far" in lines[1]


def test_larger_events_that_come_more_often_are_warned_of():
    key = "release.0.volume"
    release = [{**MUD["release"], "volume": 100}]
    sweep = {key: [50, 100, 200]}
    assert warned(release=release, sweep=sweep, return_periods={key: [10, 30, 100]}) == ()
    (line,) = warned(release=release, sweep=sweep, return_periods={key: [100, 30, 10]})
    assert f"return_periods.{key}: the larger event, 100, has the shorter return period, 30 years" in line
    assert warned(release=release, sweep={key: [200, 50]}, return_periods={key: [100, 10]}) == ()


def test_two_densities_are_warned_of():
    assert warned(hazard={"density": 2000}) == ()
    (line,) = warned(hazard={"density": 1800})
    assert "hazard.density: pressures are computed with 1800 kg m-3 in all runs" in line
    assert "material.density is 2000" in line
    (line,) = warned(hazard={"density": 2000}, sweep={"material.density": [1800, 2000]})
    assert "material.density differs between the runs: leave it out" in line


def test_thresholds_of_erosion_need_its_depth():
    (line,) = warned(hazard={"erosion_depth": [0.25]})
    assert "hazard.erosion_depth: nothing is eroded without an erodible_bed" in line
    bed = {"depth": 0.3, "law": {"model": "growth-rate", "growth": 0.01}}
    output = {"fields": ["max_depth", "max_speed", "deposit_depth"]}
    assert warned(erodible_bed=bed, hazard={"erosion_depth": [0.25]}) == ()
    (line,) = warned(erodible_bed=bed, hazard={"erosion_depth": [0.25]}, output=output)
    assert "output.fields: leaves out erosion_depth, which the maps asked for under hazard need" in line
    place = [{"name": "pier", "point": [20, 0]}]
    output["fields"].append("arrival_time")
    (line,) = warned(erodible_bed=bed, receptors=place, output=output)
    assert "output.fields: leaves out erosion_depth and bed_change: receptors will not say what" in line


VOELLMY = {"friction_coefficient": 0.1, "turbulent_friction": 300, "earth_pressure": "isotropic"}
ZONE = [[0, -10], [20, -10], [20, 10], [0, 10]]
GRAINS = {"beta": 0.65, "length": 0.01}


def with_zone(**keys):
    return {**VOELLMY, "zones": [{"polygon": ZONE, **keys}]}


def named(**keys):
    return {"friction": keys, "earth_pressure": "isotropic"}


@pytest.mark.parametrize(
    ("material", "told"),
    [
        (
            {**VOELLMY, "friction_coefficient": 12},
            "material.friction_coefficient: 12 is far from what is usual, up to 1.5: degrees are written as "
            "bed_friction",
        ),
        (named(law="coulomb", friction_coefficient=12), "material.friction.friction_coefficient: 12 is far"),
        (
            named(law="coulomb", bed_friction=0.3),
            "material.friction.bed_friction: 0.3 degrees are nearly none; mu = 0.3 is written as "
            "friction_coefficient",
        ),
        (with_zone(friction_coefficient=12), "material.zones.0.friction_coefficient: 12 is far"),
        (with_zone(bed_friction=0.3), "material.zones.0.bed_friction: 0.3 degrees are nearly none"),
        (
            with_zone(turbulent_friction=2),
            "material.zones.0.turbulent_friction: 2 m s-2 is far from what is usual, 20 to 10000 m s-2",
        ),
        (
            named(law="pouliquen", angles=[0.37, 0.54], **GRAINS),
            "material.friction.angles: 0.37, 0.54 degrees are nearly none: write degrees, no radians",
        ),
        (
            {
                "density": 2000,
                **named(law="voellmy", bed_friction=7, turbulent_friction=300, cohesion=5e5),
            },
            "material.friction.cohesion: 500000 Pa is far from what is usual, 5 to 20000 Pa: check the unit",
        ),
    ],
)
def test_friction_of_another_unit_is_warned_of_in_all_spellings(material, told):
    (line,) = warned(material=material)
    assert told in line


@pytest.mark.parametrize(
    ("key", "section", "told"),
    [
        (
            "terrain",
            {"profile": "bend", "angle": 0.6, "start": 10, "end": 15},
            "terrain.angle: 0.6, 0 degrees are nearly level: write degrees, no radians",
        ),
        (
            "terrain",
            {
                "profile": "segments",
                "joint": 4,
                "segments": [{"start": 0, "angle": 0.5}, {"start": 20, "angle": 0.1}],
            },
            "terrain.segments.0.angle: 0.5, 0.1 degrees are nearly level: write degrees, no radians",
        ),
        (
            "material",
            {"bed_friction": 0.4, "internal_friction": 0.6, "earth_pressure": "mohr-coulomb"},
            "material.internal_friction: 0.6 degrees are nearly none: write degrees, no radians",
        ),
    ],
)
def test_radians_are_warned_of(key, section, told):
    assert any(told in line for line in warned(**{key: section}))


def test_zones_of_usual_friction_are_not_warned_of_for_their_material():
    assert warned(material=with_zone(bed_friction=20)) == ()
    (line,) = warned(material={**with_zone(bed_friction=20), "turbulent_friction": 2})
    assert "material.turbulent_friction: 2 m s-2" in line


TRIANGLE = {"shape": "triangle", "volume": 100, "peak_discharge": 20}


@pytest.mark.parametrize(
    ("inflow", "told"),
    [
        ({"froude": 100}, "inflow.0.froude: 100 is far from what is usual, 0.1 to 10: check the unit"),
        ({"speed": 1000}, "inflow.0.speed: 1000 m s-1 is far from what is usual, 0.01 to 50 m s-1"),
        ({"depth": 500}, "inflow.0.depth: 500 m is far from what is usual, 0.0001 to 50 m"),
        (
            {"hydrograph": {"shape": "triangle", "volume": 1e7, "peak_discharge": 1e7}, "froude": 1},
            "inflow.0.hydrograph: 1e+07 m3 s-1 is far from what is usual, 1e-06 to 200000 m3 s-1",
        ),
    ],
)
def test_inflows_of_another_unit_are_warned_of(inflow, told):
    entry = {"name": "top", "section": [[10, -5], [10, 5]], "hydrograph": TRIANGLE, **inflow}
    (line,) = warned(material=VOELLMY, inflow=[entry])
    assert told in line


def test_depths_of_an_erodible_bed_of_another_kind_are_warned_of():
    law = {"model": "growth-rate", "growth": 0.01}
    (line,) = warned(erodible_bed={"depth": 100, "law": law})
    assert "erodible_bed.depth: 100 m is far from what is usual, 0.001 to 20 m: check the unit" in line
    assert [*of_depths(np.array([[0.5, 1.0], [np.nan, 0.0]]))] == []
    ((path, told),) = of_depths(np.array([[1200.0, 1210.0], [np.nan, 0.0]]))
    assert path == ("erodible_bed", "depth")
    assert told.startswith("half of the depths are above 1205 m, where up to 20 m are usual: depths below")


@pytest.mark.parametrize(("kind", "name", "size"), [("dam", "height", 50), ("basin", "depth", 40)])
def test_structures_of_another_unit_are_warned_of(tmp_path, kind, name, size):
    write_raster(tmp_path / "dem.tif", ground())
    write_polygons(tmp_path / "releases.gpkg", {"slide": (20, -120, 50, -80)})
    corners = [[90, -130], [90, -70]] if kind == "dam" else [[60, -130], [90, -130], [90, -90], [60, -90]]
    place = "line" if kind == "dam" else "polygon"
    at = [[WEST + x, NORTH + y] for x, y in corners]
    more = f"structures: [{{kind: {kind}, {place}: {at}, {name}: {size}, side_slope: 45}}]\n"
    lines = pipeline.load([written(tmp_path, TEXT + more)])[0].warnings
    assert any(f"structures.0.{name}: {size} m is far from what is usual, 0.2 to" in line for line in lines)
