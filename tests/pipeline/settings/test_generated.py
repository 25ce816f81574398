import pickle
from typing import ClassVar, Literal

import numpy as np
import pytest
from pydantic import ValidationError, create_model
from pydantic_core import PydanticCustomError

from pipeline.runs.runs import expand
from pipeline.scenario.scenario import load
from pipeline.scenario.schema_errors import check
from pipeline.scenario.sweep import meaning_of
from pipeline.settings.generated import keys_of, section_of, summary, tag, union_of
from pipeline.settings.generated import made as make
from pipeline.settings.section import Section, sections_of
from solver.parameters import Alternative, Checked, Parameter, ParameterError, parameter, parametric
from solver.physics import earth_pressure, friction, terrain
from solver.physics.terrain import Segment, Segments
from solver.release import shapes
from solver.scheme import SCHEMES, WeightedResidual


@parametric
class HalfPipe(Checked):
    """A half pipe, as for tests."""

    advice: ClassVar[str] = "tests"

    radius: float = parameter(
        "radius",
        "m",
        above=0,
        alternative=Alternative("diameter", Parameter(meaning="twice the radius", unit="m"), lambda d: d / 2),
    )
    length: float = parameter("length", "m", default=3.0)
    number: int = parameter("number", default=1, choices={1: "one", 2: "two"})
    shape: Literal["round", "flat"] = parameter("shape", key="form", default="round")

    def __post_init__(self) -> None:
        super().__post_init__()
        if self.length < self.radius:
            raise ParameterError(f"expected at least radius, found {self.length:g}", "length", "radius")


@parametric
class Ramp(Checked):
    """A ramp."""

    pieces: tuple[Segment, ...] = parameter("pieces", min_items=1)


SECTIONS = [section_of(HalfPipe, "kind"), section_of(Ramp, "kind", default=True)]
OPEN, SHUT = (
    create_model("Settings", __base__=Section, bed=(kind, ...))
    for kind in (union_of("kind", SECTIONS, default="ramp"), union_of("kind", SECTIONS))
)


def made(data, model=OPEN):
    return model.model_validate({"bed": data}).bed.make()


def errors(data, model=OPEN):
    with pytest.raises(ValidationError) as caught:
        model.model_validate({"bed": data})
    return [
        (".".join(map(str, e["loc"])), e["type"], e.get("ctx", {}).get("keys", ()))
        for e in caught.value.errors()
    ]


def test_a_class_is_chosen_by_its_name_and_made_from_its_keys():
    assert made({"kind": "half-pipe", "radius": 2, "form": "flat"}) == HalfPipe(2.0, shape="flat")
    assert made({"pieces": ({"start": 0, "angle": 3},)}) == Ramp((Segment(0.0, 3.0),))
    assert tag(WeightedResidual) == "weighted-residual"
    assert summary(HalfPipe) == "A half pipe, as for tests."


def test_a_parameter_may_be_given_in_a_second_way_but_not_in_both():
    assert made({"kind": "half-pipe", "diameter": 4}).radius == 2
    assert errors({"kind": "half-pipe", "diameter": 4, "radius": 2}) == [
        ("bed.half-pipe", "relation", ("diameter", "radius"))
    ]
    assert errors({"kind": "half-pipe"}) == [("bed.half-pipe", "relation", ("radius",))]
    assert OPEN.model_validate({"bed": {"kind": "half-pipe", "radius": 2}}).model_dump() == {
        "bed": {"kind": "half-pipe", "radius": 2.0, "length": 3.0, "number": 1, "form": "round"}
    }


def test_bounds_choices_relations_and_unknown_keys_are_strict():
    whole = {"kind": "half-pipe", "radius": 2}
    assert errors({**whole, "radius": -1}) == [("bed.half-pipe.radius", "greater_than", ())]
    assert errors({**whole, "number": 3}) == [("bed.half-pipe.number", "literal_error", ())]
    assert errors({**whole, "width": 3}) == [("bed.half-pipe.width", "extra_forbidden", ())]
    assert errors({**whole, "length": 1}) == [("bed.half-pipe", "relation", ("length", "radius"))]
    assert errors({**whole, "length": "3"}) == [("bed.half-pipe.length", "float_type", ())]
    assert errors({"pieces": ()}) == [("bed.ramp.pieces", "too_short", ())]
    # the key that holds the value is the one to change
    assert errors({"kind": "half-pipe", "diameter": 8}) == [
        ("bed.half-pipe", "relation", ("length", "diameter"))
    ]
    assert errors({"pieces": ()}, SHUT) == [("bed", "union_tag_not_found", ())]


def test_the_schema_has_units_choices_and_advice():
    properties = SECTIONS[0].model_json_schema()["properties"]
    assert properties["radius"]["unit"] == "m"
    assert properties["number"]["enum"] == [1, 2]
    assert properties["number"]["choices"] == {"1": "one", "2": "two"}
    assert SECTIONS[0].advice == "tests"
    assert [loc for loc, _ in sections_of(OPEN)] == [
        (),
        ("bed", "half-pipe"),
        ("bed", "ramp"),
        ("bed", "ramp", "pieces"),
    ]


@parametric
class Soft(Checked):
    """A soft law."""

    stiffness: float = parameter("stiffness", above=0)
    width: float = parameter("width", default=0.1, at_least=0)


def test_a_flat_section_has_the_keys_and_defaults_of_a_class_that_needs_them_only_when_chosen():
    flat = create_model("Flat", __base__=Section, law=(str, "soft"), **keys_of(Soft, optional=True))
    assert make(Soft, flat(stiffness=2.0), why="law") == Soft(2.0, 0.1)
    assert flat().model_dump() == {"law": "soft", "stiffness": None, "width": 0.1}
    with pytest.raises(PydanticCustomError, match="expected a value with law soft, found nothing"):
        make(Soft, flat(), why="law")


BASE = {
    "name": "a",
    "terrain": {"profile": "plane", "angle": 30},
    "domain": {"x": (0, 10), "y": (-2, 2)},
    "points": {"spacing": 0.5},
    "release": {"shape": "box", "x": (1, 2), "y": (-1, 1), "height": 1},
    "material": {"bed_friction": 20, "earth_pressure": "isotropic"},
    "time": {"end": 1},
}


def settings(**changed):
    found = check({**BASE, **changed})
    assert not isinstance(found, list), found
    return found


@pytest.mark.parametrize(
    ("material", "friction_law", "pressure"),
    [
        (
            {"bed_friction": 20, "internal_friction": 30},
            friction.Coulomb(20),
            earth_pressure.MohrCoulomb(30, 20),
        ),
        (
            {"bed_friction": 20, "turbulent_friction": 500, "earth_pressure": "isotropic"},
            friction.Voellmy(20, 500),
            earth_pressure.Isotropic(),
        ),
        (
            {
                "friction": {"law": "voellmy", "bed_friction": 20, "turbulent_friction": 500},
                "internal_friction": 30,
            },
            friction.Voellmy(20, 500),
            earth_pressure.MohrCoulomb(30, 20),
        ),
    ],
)
def test_a_material_gives_its_laws_however_it_is_written(material, friction_law, pressure):
    assert settings(material=material).material.laws() == (friction_law, pressure)


@pytest.mark.parametrize("friction_key", [{}, {"turbulent_friction": 200}])
def test_a_friction_coefficient_is_the_tangent_of_the_angle(friction_key):
    short = {"friction_coefficient": 0.155, "earth_pressure": "isotropic", **friction_key}
    law = "voellmy" if friction_key else "coulomb"
    named = {
        "friction": {"law": law, "friction_coefficient": 0.155, **friction_key},
        "earth_pressure": "isotropic",
    }
    for material in (short, named):
        resistance, _ = settings(material=material).material.laws()
        assert resistance.tangent == pytest.approx(0.155, rel=1e-15)
        assert resistance.bed_friction == pytest.approx(np.degrees(np.arctan(0.155)))


def test_a_coefficient_can_be_swept_and_sampled(tmp_path):
    path = tmp_path / "a.yaml"
    path.write_text(
        "name: a\nterrain: {profile: plane, angle: 30}\n"
        "domain: {x: [0, 10], y: [-2, 2]}\npoints: {spacing: 0.5}\n"
        "release: {shape: box, x: [1, 2], y: [-1, 1], height: 1}\ntime: {end: 1}\n"
        "material: {friction_coefficient: 0.2, earth_pressure: isotropic}\n"
        "sweep: {release.0.volume: [1, 2]}\n"
        "sample: {count: 3, values: {material.friction_coefficient: "
        "{distribution: uniform, lower: 0.1, upper: 0.3}}}\n"
    )
    made = expand(load([path])[0])
    assert len(made) == 6
    assert [run.settings.releases[0].volume for run in made] == [1, 1, 1, 2, 2, 2]
    assert all(
        run.settings.material.laws()[0].tangent == pytest.approx(run.parameters["friction_coefficient"])
        for run in made
    )
    assert meaning_of("release.0.volume", made[0].settings)[0] == "m3"
    assert meaning_of("material.friction_coefficient", made[0].settings)[1].startswith(
        "friction coefficient mu"
    )


def test_what_an_alternative_does_not_hold_is_not_in_the_content(tmp_path):
    dumped = settings().material.model_dump()
    assert list(dumped) == [
        "bed_friction",
        "internal_friction",
        "pressure_transition",
        "earth_pressure",
        "turbulent_friction",
    ]


def test_settings_pickle():
    whole = settings(
        terrain={"profile": "segments", "segments": ({"start": 0, "angle": 30},), "joint": 1},
        scheme={"form": "collocation"},
    )
    again = pickle.loads(pickle.dumps(whole))
    assert again == whole
    assert again.terrain.make() == Segments((Segment(0.0, 30.0),), 1.0)


def test_every_class_that_the_solver_lists_can_be_chosen():
    schema = type(settings()).model_json_schema()["$defs"]
    for kinds in (terrain.PROFILES, shapes.SHAPES, friction.LAWS, SCHEMES):
        assert {kind.__name__ for kind in kinds} <= set(schema)
        assert all(kind.advice for kind in kinds)
    assert schema["Material"]["properties"]["earth_pressure"]["enum"] == [
        tag(law) for law in earth_pressure.LAWS
    ]
