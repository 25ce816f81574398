import pytest

import pipeline

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
