"""Laws of friction and zones as they stand in scenario files."""

from dataclasses import MISSING, fields, replace
from typing import get_type_hints

import numpy as np
import pytest
import yaml

from pipeline.runs.runs import expand
from pipeline.scenario.scenario import load
from pipeline.scenario.schema_errors import check
from pipeline.scenario.strict_yaml import parse
from pipeline.settings.generated import tag
from pipeline.settings.zones import ErosionZone, Zone
from solver.kernels.friction import law_at
from solver.physics import earth_pressure, erosion, friction
from solver.physics.resistance import Quadratic, area_weighted

BASE = """\
name: a
terrain: {profile: plane, angle: 10}
domain: {x: [0, 40], y: [-10, 10]}
points: {spacing: 1}
release: {shape: box, x: [5, 10], y: [-3, 3], height: 1}
"""
TRIANGLE = [[20, -9], [30, -9], [30, 9]]


def problems(material, **more):
    data = yaml.safe_load(BASE) | {"material": material} | more
    found = check(parse(yaml.safe_dump(data), "a.yaml").data)
    if not isinstance(found, list):
        return found
    return {".".join(map(str, problem.path)): problem.message for problem in found}


def isotropic(**material):
    return {"earth_pressure": "isotropic", **material}


LAWS = {
    "coulomb": ({"friction_coefficient": 0.2}, friction.Coulomb(friction.friction_angle(0.2))),
    "voellmy": (
        {"bed_friction": 8, "turbulent_friction": 200, "cohesion": 300},
        friction.Voellmy(8, 200, 300, 2000),
    ),
    "chezy": ({"chezy_coefficient": 20}, friction.Chezy(20)),
    "manning": ({"manning_n": 0.05}, friction.Manning(0.05)),
    "obrien": (
        {"yield_stress": 900, "viscosity": 50, "manning_n": 0.05},
        friction.OBrien(900, 50, 0.05, 24, 2000),
    ),
    "bingham": (
        {"yield_stress": 900, "viscosity": 50, "form": "linear", "factor": 1.5},
        friction.Bingham(900, 50, "linear", 1.5, 2000),
    ),
    "herschel-bulkley": (
        {"yield_stress": 900, "consistency": 200, "flow_index": 0.4},
        friction.HerschelBulkley(900, 200, 0.4, 2000),
    ),
    "pouliquen": (
        {"angles": [21, 30.7], "beta": 0.136, "length": 0.00065},
        friction.Pouliquen((21, 30.7), 0.136, 0.00065),
    ),
    "edwards": (
        {"angles": [21, 30, 24], "beta": 0.136, "length": 0.5, "beta_star": 0.1},
        friction.Edwards((21, 30, 24), 0.136, 0.5, 0.1),
    ),
}


@pytest.mark.parametrize("law", LAWS)
def test_every_law_is_chosen_by_its_name(law):
    keys, expected = LAWS[law]
    found = problems(isotropic(density=2000, friction={"law": law, **keys}), time={"end": 10})
    assert found.material.laws()[0] == expected


@pytest.mark.parametrize("law", ["chezy", "manning"])
def test_a_law_that_stops_nothing_needs_an_end(law):
    found = problems(isotropic(friction={"law": law, **LAWS[law][0]}))
    assert found == {"time.end": f"expected a time, as {law} friction stops nothing, found nothing"}


@pytest.mark.parametrize("law", ["voellmy", "obrien", "bingham", "herschel-bulkley"])
def test_a_law_of_stress_needs_a_density(law):
    found = problems(isotropic(friction={"law": law, **LAWS[law][0]}))
    assert found == {"material.density": f"expected a density with friction {law}, found nothing"}


@pytest.mark.parametrize("law", [law for law in LAWS if law not in ("coulomb", "voellmy")])
def test_mohr_coulomb_pressure_and_collocation_go_with_coulomb_and_voellmy_alone(law):
    material = {"density": 2000, "friction": {"law": law, **LAWS[law][0]}}
    found = problems(material | {"internal_friction": 40}, time={"end": 10})
    assert found == {"material.earth_pressure": f"expected isotropic with friction {law}, found mohr-coulomb"}
    found = problems(isotropic(**material), time={"end": 10}, scheme={"form": "collocation"})
    assert found == {"material.friction": f"expected coulomb or voellmy with form collocation, found {law}"}


def test_both_ways_to_give_friction_at_once_are_refused():
    found = problems(isotropic(bed_friction=10, friction={"law": "manning", "manning_n": 0.05}))
    assert found == {"material.bed_friction": "expected either friction or bed_friction, found both"}


@pytest.mark.parametrize(
    ("law", "changed", "key", "said"),
    [
        ("edwards", {"angles": [21, 30, 31]}, "angles.2", "expected the third angle between the first"),
        ("pouliquen", {"angles": [31, 30]}, "angles", "expected a lower bound below the upper one"),
        ("bingham", {"factor": 2}, "factor", "expected a number of at most 1.5, found 2"),
        ("bingham", {"form": "cubic"}, "form", "expected one of exact, linear, found 'cubic'"),
        ("manning", {"manning_n": 0}, "manning_n", "expected a number above 0, found 0"),
        ("herschel-bulkley", {"flow_index": 0.01}, "flow_index", "expected a number of at least 0.1"),
    ],
)
def test_a_parameter_out_of_range_is_refused_at_its_key(law, changed, key, said):
    section = {"law": law, **LAWS[law][0], **changed}
    found = problems(isotropic(density=2000, friction=section), time={"end": 10})
    ((path, message),) = found.items()
    assert path == f"material.friction.{key}"
    assert message.startswith(said)


def test_a_zone_changes_what_it_names_of_the_law_of_the_material():
    # written out twice, as files may hold no references
    other = [list(corner) for corner in TRIANGLE]
    zones = [
        {"polygon": TRIANGLE, "friction_coefficient": 0.3},
        {"polygon": other, "turbulent_friction": 90},
    ]
    found = problems(isotropic(bed_friction=8, turbulent_friction=200, zones=zones))
    assert found.material.zone_laws() == (
        friction.Voellmy(friction.friction_angle(0.3), 200),
        friction.Voellmy(8, 90),
    )


@pytest.mark.parametrize(
    ("law", "name", "value"),
    [
        ("obrien", "viscosity", 200),
        ("bingham", "viscosity", 200),
        ("bingham", "yield_stress", 100),
        ("herschel-bulkley", "consistency", 40),
        ("pouliquen", "angles", [25, 35]),
        ("chezy", "chezy_coefficient", 10),
        ("voellmy", "cohesion", 900),
        ("herschel-bulkley", "flow_index", 0.3),
        ("pouliquen", "beta", 0.2),
        ("pouliquen", "length", 0.001),
        ("pouliquen", "gamma", 0.77),
        ("edwards", "angles", [22, 31, 25]),
        ("edwards", "length", 0.4),
        ("edwards", "beta_star", 0.2),
        ("edwards", "kappa", 2),
    ],
)
def test_zones_change_every_number_of_a_law(law, name, value):
    keys, of_material = LAWS[law]
    material = isotropic(
        density=2000, friction={"law": law, **keys}, zones=[{"polygon": TRIANGLE, name: value}]
    )
    found = problems(material, time={"end": 10})
    given = tuple(value) if isinstance(value, list) else value
    expected = replace(of_material, **{name: given})
    assert found.material.zone_laws() == (expected,)
    # whose forms are those of the kernels: what differs between cells is among what these take from each
    forms = [each.resistance(9.81) for each in (of_material, expected)]
    zoned = area_weighted(forms[0], [(forms[1], np.array([0.0, 1.0]))])
    assert [law_at(zoned, i) for i in (0, 1)] == forms
    assert forms[0] != forms[1]


def test_a_parameter_of_a_zone_sweeps(tmp_path):
    keys = {"law": "bingham", **LAWS["bingham"][0]}
    material = isotropic(density=2000, friction=keys, zones=[{"polygon": TRIANGLE, "viscosity": 10.0}])
    data = yaml.safe_load(BASE) | {"material": material, "time": {"end": 10}}
    data["sweep"] = {"material.zones.0.viscosity": [10.0, 300.0]}
    (scenario,) = load([data])
    assert [run.settings.material.zone_laws()[0].viscosity for run in expand(scenario)] == [10.0, 300.0]


@pytest.mark.parametrize(
    ("material", "path", "said"),
    [
        ({"zones": [{"polygon": TRIANGLE}]}, "zones.0.polygon", "expected one of bed_friction, "),
        (
            {"zones": [{"polygon": TRIANGLE, "manning_n": 0.1}]},
            "zones.0.manning_n",
            "expected, with friction coulomb, bed_friction; found manning_n",
        ),
        (
            {"bed_friction": None, "friction": {"law": "edwards", **LAWS["edwards"][0]},
             "zones": [{"polygon": TRIANGLE, "angles": [21, 30]}]},
            "zones.0.angles",
            "expected 3 values, found 2",
        ),
        (
            {"bed_friction": None, "friction": {"law": "pouliquen", **LAWS["pouliquen"][0]},
             "zones": [{"polygon": TRIANGLE, "angles": [30, 21]}]},
            "zones.0.angles",
            "expected a lower bound below the upper one",
        ),
        ({"zones": [{"polygon": TRIANGLE[:2], "bed_friction": 9}]}, "zones.0.polygon", "expected 3 or more"),
        (
            {"zones": [{"polygon": "forest.gpkg", "bed_friction": 9}]},
            "zones.0.polygon",
            "expected corners, as a file of polygons needs an elevation model",
        ),
        (
            {"zones": [{"polygon": TRIANGLE, "bed_friction": 9, "friction_coefficient": 0.2}]},
            "zones.0.friction_coefficient",
            "expected either bed_friction or friction_coefficient, found both",
        ),
        (
            {"zones": [{"polygon": TRIANGLE, "bed_friction": 9}], "earth_pressure": "mohr-coulomb",
             "internal_friction": 30},
            "earth_pressure",
            "expected isotropic with zones, found mohr-coulomb",
        ),
    ],
)  # fmt: skip
def test_a_zone_that_cannot_be_is_refused_at_its_key(material, path, said):
    found = problems({"bed_friction": 8, "earth_pressure": "isotropic", **material})
    ((at, message),) = found.items()
    assert at == f"material.{path}"
    assert message.startswith(said)


def test_pressure_along_the_flow_goes_with_the_conservative_form_alone():
    material = {"bed_friction": 25, "internal_friction": 35, "earth_pressure": "mohr-coulomb-flow"}
    _, law = problems(material).material.laws()
    assert law == earth_pressure.MohrCoulombFlow(35, 25)
    found = problems(material, time={"end": 10}, scheme={"form": "collocation"})
    assert found == {
        "material.earth_pressure": "expected another law with form collocation, found mohr-coulomb-flow"
    }
    found = problems(material | {"bed_friction": 40})
    assert found == {
        "material.bed_friction": "expected at most internal_friction (35) with earth_pressure "
        "mohr-coulomb-flow, found 40"
    }


def test_every_number_of_every_law_is_a_key_of_zones():
    keys = set(Zone.names)
    for law in friction.LAWS:
        hints = get_type_hints(law)
        numbers = {each.name for each in fields(law) if hints[each.name] not in (str, float | None)}
        assert numbers - {"form"} <= keys, law
    assert "density" not in keys
    for law in erosion.LAWS:
        assert {each.name for each in fields(law)} - {"stress", "density"} <= {*ErosionZone.names}, law
    assert Zone.model_fields["kappa"].default is None


def test_cohesion_of_a_zone_alone_makes_the_law_quadratic_and_needs_a_density():
    zones = [{"polygon": TRIANGLE, "cohesion": 600}]
    material = isotropic(bed_friction=8, turbulent_friction=200, zones=zones)
    assert problems(material) == {
        "material.density": "expected a density with voellmy friction of a zone, found nothing"
    }
    found = problems(material | {"density": 2000})
    law, (zone,) = found.material.laws()[0], found.material.zone_laws()
    assert zone == friction.Voellmy(8, 200, 600, 2000)
    zoned = area_weighted(law.resistance(9.81), [(zone.resistance(9.81), np.array([0.0, 0.25, 1.0]))])
    assert zoned.values[1].tolist() == [0.0, 0.25 * 0.3, 0.3]
    assert isinstance(zoned.law, Quadratic)
    assert law_at(zoned, 2) == zone.resistance(9.81)


@pytest.mark.parametrize(
    ("law", "name", "value"),
    [
        (erosion.GrowthRate(0.01), "growth", 0.02),
        (erosion.ShearStress(), "rate", 0.05),
        (erosion.ShearStress(), "depth_per_stress", 2e-4),
        (erosion.ShearStress(), "critical_stress", 500.0),
        (erosion.ShearWork(), "erosion_energy", 900.0),
        (erosion.Egashira(), "bed_angle", 30.0),
        (erosion.Egashira(), "concentration", 0.5),
        (erosion.Egashira(), "density_ratio", 2.5),
        (erosion.JumpCondition(0.2), "strength_coefficient", 0.3),
        (erosion.JumpCondition(0.2), "bed_cohesion", 100.0),
        (erosion.JumpCondition(0.2), "slip", 0.5),
    ],
)
def test_zones_change_every_number_of_a_law_of_erosion(law, name, value):
    # the other keys of the law are those of the bed
    needed = {each.name: getattr(law, each.name) for each in fields(law) if each.default is MISSING}
    bed = {
        "depth": 1,
        "minimum_speed": 0.1,
        "law": {"model": tag(type(law)), **needed},
        "zones": [{"polygon": TRIANGLE, name: value}],
    }
    found = problems(isotropic(bed_friction=8, density=2000), erodible_bed=bed)
    density = {"density": 2000} if hasattr(law, "density") else {}
    assert found.erodible_bed.zone_laws(2000) == (replace(law, **{name: value}, **density),)


def test_a_zone_of_erosion_that_cannot_be_is_refused_at_its_key():
    def told(zone, **material):
        bed = {"depth": 1, "law": {"model": "growth-rate", "growth": 0.01}, "zones": [zone]}
        return problems(isotropic(bed_friction=8), erodible_bed=bed | material)

    assert told({"polygon": TRIANGLE, "rate": 0.1}) == {
        "erodible_bed.zones.0.rate": "expected, with model growth-rate, growth; found rate"
    }
    assert told({"polygon": "a.gpkg", "growth": 0.1}) == {
        "erodible_bed.zones.0.polygon": "expected corners, as a file of polygons needs an elevation model, "
        "found a file"
    }
    jump = {"model": "jump-condition", "strength_coefficient": 0.1}
    zone = {"polygon": TRIANGLE, "bed_cohesion": 100}
    assert told(zone, law=jump, minimum_speed=0.1, zones=[zone]) == {
        "material.density": "expected a density with erosion by jump-condition, found nothing"
    }


def test_numbers_of_zones_sweep_and_are_sampled(tmp_path):
    bed = {
        "depth": 1,
        "law": {"model": "growth-rate", "growth": 0.01},
        "zones": [{"polygon": TRIANGLE, "growth": 0.02}],
    }
    keys = {"law": "herschel-bulkley", **LAWS["herschel-bulkley"][0]}
    own = [list(corner) for corner in TRIANGLE]
    material = isotropic(density=2000, friction=keys, zones=[{"polygon": own, "flow_index": 0.5}])
    data = yaml.safe_load(BASE) | {"material": material, "time": {"end": 10}, "erodible_bed": bed}
    data["sweep"] = {"erodible_bed.zones.0.growth": [0.02, 0.03]}
    uniform = {"distribution": "uniform", "lower": 0.3, "upper": 0.6}
    data["sample"] = {"count": 2, "seed": 1, "values": {"material.zones.0.flow_index": uniform}}
    (scenario,) = load([data])
    runs = [run.settings for run in expand(scenario)]
    assert [run.erodible_bed.zone_laws()[0].growth for run in runs] == [0.02, 0.02, 0.03, 0.03]
    drawn = [run.material.zone_laws()[0].flow_index for run in runs]
    assert drawn[:2] == drawn[2:]
    assert drawn[0] != drawn[1]
    assert all(0.3 <= n <= 0.6 for n in drawn)
