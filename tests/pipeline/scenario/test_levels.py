import json

import pytest
from catalogue import SCENARIO

from pipeline.mistakes import BadInput
from pipeline.scenario.design import draw
from pipeline.scenario.scenario import load, stored

LEVELS = """\
output: {threshold: 0.1}
sample:
  levels: [{spacing: 1, count: 8}, {spacing: 0.5, count: 4}]
  values: {material.bed_friction: {distribution: uniform, lower: 20, upper: 28}}
"""


def test_each_level_is_a_scenario_on_its_spacing_with_the_first_draws(scenario_file):
    coarse, fine = load([scenario_file(more=LEVELS)])
    assert [coarse.name, fine.name] == ["box", "box/0.5m"]
    assert [each.settings.points.spacing for each in (coarse, fine)] == [1, 0.5]
    assert [each.settings.run_count for each in (coarse, fine)] == [8, 4]
    (many,), (few,) = (draw(each.settings.sample).values() for each in (coarse, fine))
    assert many[:4] == few
    assert coarse.digest != fine.digest
    # both hold the words of the file, from which the place is read again
    assert len(stored({"title": "box", "scenario": fine.text}).sample.levels) == 2


def test_a_level_is_what_a_scenario_of_its_own_would_be(scenario_file, tmp_path):
    coarse, _ = load([scenario_file(more=LEVELS)])
    alone = LEVELS.replace("levels: [{spacing: 1, count: 8}, {spacing: 0.5, count: 4}]", "count: 8")
    (single,) = load([scenario_file(replace=("spacing: 0.5", "spacing: 1"), more=alone)])
    assert coarse.content == single.content
    assert "levels" not in json.loads(single.content)["sample"]


def test_weak_levels_are_told_at_the_keys_of_the_file(scenario_file):
    wide = LEVELS.replace("spacing: 1, count: 8", "spacing: 2, count: 24").replace("count: 4", "count: 3")
    coarse, fine = load([scenario_file(more=wide)])
    assert fine.warnings == ()
    found = [line.split(": sample.")[1] for line in coarse.warnings]
    even = "Sobol's sequence covers the space evenly at powers of 2: write"
    assert found == [
        f"levels.0.count: {even} 16 or 32",
        "levels.0.count: `pipeline emulate` will say: expected at least 32 computed runs for 1 inputs, "
        "found 24",
        "levels.0.spacing: a spacing of 2 m gives about 18 points, which tell nothing: take a smaller one",
        "levels.1.count: `pipeline emulate` will say: 3 runs of the finer spacing are too few for a "
        "correction (4)",
    ]


@pytest.mark.parametrize(
    ("before", "after", "message"),
    [
        ("{spacing: 1, count: 8}, ", "", "levels: expected two levels or more, found 1"),
        ("{spacing: 1,", "{spacing: 0.5,", "levels.1.spacing: expected a spacing below 0.5, found 0.5"),
        ("count: 4}", "count: 16}", "levels.1.count: expected at most 8 draws, found 16"),
        ("  levels", "  count: 8\n  levels", "count: expected none beside levels, found 8"),
        ("  levels", "  design: latin-hypercube\n  levels", "design: expected sobol or random with levels"),
        (
            "{spacing: 0.5,",
            "{spacing: 0.25,",
            "points.spacing: expected that of the last level, 0.25, found 0.5",
        ),
        ("output: {threshold: 0.1}\n", "", "output.threshold: expected a depth, which all levels share"),
        ("sample:", "weights: [1, 1]\nsample:", "weights: expected"),
        (
            "[{spacing: 1, count: 8}, {spacing: 0.5, count: 4}]",
            "[]",
            "count: expected a number of draws, or levels",
        ),
    ],
)
def test_levels_that_do_not_hold_are_told_at_their_place(scenario_file, before, after, message):
    assert before in LEVELS
    with pytest.raises(BadInput, match=r"box\.yaml:\d+:\d+") as caught:
        load([scenario_file(more=LEVELS.replace(before, after))])
    assert message in str(caught.value)
    assert "{name}" in SCENARIO
