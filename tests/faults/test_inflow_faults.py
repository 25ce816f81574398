"""Inflows and sections that cannot be: each is refused with its place, before anything is written."""
# ruff: noqa: E501 - a message is one line

import json
import pickle

import numpy as np
import pytest

from pipeline.mistakes import BadInput
from pipeline.runs.duplicates import _digest, _plain
from pipeline.runs.runs import expand
from pipeline.runs.size import size
from pipeline.scenario import solver_objects
from pipeline.scenario.scenario import load
from pipeline.scenario.sweep import meaning_of
from solver.inflow.conditions import Inflow, rating_of
from solver.inflow.hydrograph import Hydrograph
from solver.physics.friction import Voellmy

BASE = """\
name: a
terrain: {profile: plane, angle: 15}
domain: {x: [0, 100], y: [-10, 10]}
points: {spacing: 2}
material: {friction_coefficient: 0.1, turbulent_friction: 300, earth_pressure: isotropic}
time: {end: 60}
"""
INFLOW = """\
inflow:
  - {name: apex, section: [[20, -8], [20, 8]], hydrograph: {file: q.csv}}
"""
TABLE = "time,discharge\n0,0\n5,10\n20,0\n"


@pytest.fixture
def refused(tmp_path):
    """Give the lines that refuse a scenario beside a table."""

    def do(text, table=TABLE):
        (tmp_path / "q.csv").write_text(table)
        (tmp_path / "a.yaml").write_text(text)
        with pytest.raises(BadInput) as caught:
            load([tmp_path / "a.yaml"])
        return str(caught.value).replace(f"{tmp_path}/", "").splitlines()

    return do


@pytest.mark.parametrize(
    ("old", "new", "message"),
    [
        (INFLOW, "", "a.yaml:1:1: release: expected a release or an inflow, found neither"),
        (
            "time: {end: 60}",
            "structures: [{kind: building, polygon: [[18, -2], [26, -2], [26, 2], [18, 2]]}]",
            "a.yaml:8:27: inflow.0.section: expected a section clear of buildings, found one that meets a building",
        ),
        (
            "[20, 8]",
            "[200, 8]",
            "a.yaml:8:27: inflow.0.section: expected a section inside the domain, x [-1, 101] and y [-11, 11], found [200, 8]",
        ),
        (
            "[20, 8]",
            "[20, -8]",
            "a.yaml:8:27: inflow.0.section: expected a line with two ends, found one whose ends coincide",
        ),
        (
            "friction_coefficient: 0.1, turbulent_friction: 300",
            "bed_friction: 8",
            "a.yaml:8:27: inflow.0.section: expected froude or speed at inflow apex, as there is no normal depth with this law of friction",
        ),
        (
            "angle: 15",
            "angle: 4",
            "a.yaml:8:27: inflow.0.section: expected froude or speed at inflow apex, as the bed falls by 4 degrees there, where friction holds the flow and there is no normal depth",
        ),
        (
            "q.csv}",
            "q.csv}, depth: 1, froude: 2",
            "a.yaml:8:93: inflow.0.froude: expected one of depth, froude and speed, found depth and froude",
        ),
        ("q.csv}", "q.csv}, froude: -1", "a.yaml:8:83: inflow.0.froude: expected a number above 0, found -1"),
        (
            "file: q.csv",
            "volume: 100",
            "a.yaml:8:48: inflow.0.hydrograph.shape: expected one of file, list, triangle, found nothing",
        ),
        (
            "file: q.csv",
            "shape: triangle, volume: 9, peak_discharge: rickenmann",
            "a.yaml:8:105: inflow.0.hydrograph.peak_discharge: expected one of rickenmann-1999, mizuyama-1992-granular, mizuyama-1992-muddy, found 'rickenmann'",
        ),
        (
            "file: q.csv",
            "shape: triangle, volume: 9, peak_discharge: -1",
            "a.yaml:8:105: inflow.0.hydrograph.peak_discharge: expected a number above 0, found -1",
        ),
        (
            "time:",
            "scheme: {form: collocation}\ntime:",
            "a.yaml:6:16: scheme.form: expected form weighted-residual with inflow, found collocation",
        ),
        (
            "domain: {x: [0, 100], y: [-10, 10]}\n",
            "",
            "a.yaml:1:1: domain: expected a domain with inflow, found none",
        ),
        (
            INFLOW,
            f"{INFLOW}{INFLOW.splitlines()[1]}\n",
            "a.yaml:9:12: inflow.1.name: expected a name of its own, found 'apex' again",
        ),
        (
            INFLOW,
            f"{INFLOW}sections: [{{name: b, line: [[50, -30], [50, 5]]}}]\n",
            "a.yaml:9:28: sections.0.line: expected a section inside the domain, x [-1, 101] and y [-11, 11], found [50, -30]",
        ),
        (
            INFLOW,
            f"{INFLOW}sweep: {{material.friction_coefficient: [0.1, 0.5]}}\n",
            "a.yaml:9:46: sweep.material.friction_coefficient.1: expected froude or speed at inflow apex, as the bed falls by 15 degrees there, where friction holds the flow and there is no normal depth",
        ),
        (
            INFLOW,
            f"{INFLOW}sweep: {{inflow.froude: [1, 2]}}\n",
            "a.yaml:9:9: sweep.inflow.froude: expected a key of the scenario below gravity, terrain, release, inflow, material, erodible_bed, structures, boundaries, scheme, found 'inflow.froude'. Did you mean 'inflow.0.froude'?",
        ),
    ],
)
def test_what_cannot_be_is_refused_at_its_place(refused, old, new, message):
    assert refused((BASE + INFLOW).replace(old, new, 1)) == [message]


@pytest.mark.parametrize(
    ("old", "new", "message"),
    [
        (
            "[20, 8]",
            "[200, 8]",
            "inflow.0.section: expected a section inside the domain, x [0, 100] and y [-10, 10], found [200, 8]",
        ),
        (
            "friction_coefficient: 0.1, turbulent_friction: 300",
            "bed_friction: 8",
            "inflow.0.section: expected froude or speed at inflow apex, as there is no normal depth with this law of friction",
        ),
        (
            "angle: 15",
            "angle: 4",
            "inflow.0.section: expected froude or speed at inflow apex, as the bed falls by 4 degrees there, where friction holds the flow and there is no normal depth",
        ),
    ],
)
def test_the_same_is_refused_on_a_cloud(refused, old, new, message):
    text = (BASE + INFLOW).replace("{spacing: 2}", "{layout: poisson-disc, spacing: 2}")
    assert refused(text.replace(old, new, 1)) == [f"a.yaml:8:27: {message}"]


@pytest.mark.parametrize(
    ("table", "messages"),
    [
        (
            "time,discharge\n0,0\n5,-10\n20,x\n",
            [
                "q.csv:3:3: expected a discharge of 0 or more, found -10",
                "q.csv:4:4: expected a finite number, found 'x'",
            ],
        ),
        (
            "time,discharge\n0,0\n5,10\n5,3\n",
            ["q.csv:4:1: expected times that increase, found 5 s after 5 s"],
        ),
        (
            "time,q,flow\n0,0\n5,10\n",
            [
                "q.csv:1:1: expected the headings time and discharge, found time, q, flow more than once for discharge"
            ],
        ),
        (
            "time (d),discharge\n0,0\n5,1\n",
            ["q.csv:1:1: expected s, min or h as the unit of a heading, found time (d)"],
        ),
        (
            "time,discharge\n0,0,0,0\n12,5,60,5\n30\n60,0\n",
            [
                "q.csv:2:5: expected 2 values, time, discharge, found 4; decimals take a point, not a comma",
                "q.csv:3:6: expected 2 values, time, discharge, found 4; decimals take a point, not a comma",
                "q.csv:4:1: expected 2 values, time, discharge, found 1",
            ],
        ),
        ("time,discharge\n0,0\n5,0\n", ["q.csv:1:1: expected a discharge above 0, found none"]),
        (
            "time,discharge\n0,1\n",
            ["q.csv:1:1: expected a line of headings and two or more of numbers, found 1 of numbers"],
        ),
        (
            "time,discharge\n60,0\n70,5\n",
            [
                "a.yaml:8:60: inflow.0.hydrograph: expected a hydrograph that begins before the end of the run, 60 s, found one from 60 s on"
            ],
        ),
    ],
)
def test_a_table_that_is_no_hydrograph_is_refused_at_its_lines(refused, table, messages):
    assert refused(BASE + INFLOW, table) == messages


def test_a_table_is_part_of_its_scenario(tmp_path):
    digests = []
    commented = "# gauge 7\n\n# 12 May\n" + TABLE.replace("5,10", "# peak\n5,10")
    headed = "# gauge 7\n# " + TABLE
    named = TABLE.replace("time,discharge", "Time (s), Q (m3/s)")
    for table in (TABLE, TABLE.replace("10", "11"), named, commented, headed):
        (tmp_path / "q.csv").write_text(table)
        (tmp_path / "a.yaml").write_text(BASE + INFLOW)
        digests.append(load([tmp_path / "a.yaml"])[0].digest)
    assert digests[0] != digests[1]
    assert digests[0] == digests[2] == digests[3] == digests[4]


def test_what_comes_in_after_the_end_is_warned_of(tmp_path):
    (tmp_path / "q.csv").write_text("time,discharge\n0,1\n80,1\n")
    (tmp_path / "a.yaml").write_text(BASE + INFLOW)
    (scenario,) = load([tmp_path / "a.yaml"])
    (warning,) = scenario.warnings
    assert "inflow.0.hydrograph: 25 % of the volume come in after the end of the run" in warning


def test_runs_without_an_end_go_on_past_the_last_of_what_comes_in(tmp_path):
    (tmp_path / "q.csv").write_text("time,discharge\n0,1\n100000,1\n")
    text = (BASE + INFLOW).replace("time: {end: 60}\n", "")
    (tmp_path / "a.yaml").write_text(text)
    (scenario,) = load([tmp_path / "a.yaml"])
    assert scenario.warnings == ()
    # 200 sqrt(100 m/g) are 640 s
    assert scenario.settings.latest_end == 110_000
    assert expand(scenario)[0].settings.latest_end == 110_000
    shapes = "hydrograph: {shape: triangle, volume: 1000, peak_discharge: 1}"
    swept = "sweep: {inflow.0.hydrograph.volume: [1000, 50000]}\n"
    (tmp_path / "a.yaml").write_text(text.replace("hydrograph: {file: q.csv}", shapes) + swept)
    (scenario,) = load([tmp_path / "a.yaml"])
    # one end of all runs, whose frames are alike
    assert {run.settings.latest_end for run in expand(scenario)} == {110_000}
    few = pickle.loads(pickle.dumps(expand(scenario)[0].settings))
    assert few.latest_end == 110_000


def test_nearly_all_that_is_left_out_is_no_whole(tmp_path):
    (tmp_path / "q.csv").write_text("time,discharge\n0,1\n100000,1\n")
    (tmp_path / "a.yaml").write_text(BASE + INFLOW)
    (warning,) = load([tmp_path / "a.yaml"])[0].warnings
    assert "more than 99 % of the volume come in after the end of the run" in warning


SECTIONS = BASE + INFLOW + "sections: [{name: low, line: [[60, -8], [60, 8]]}]\n"


@pytest.mark.parametrize(
    ("time", "told"),
    [
        (
            "time: {end: 60}",
            "expected at most 1,000,000 samples until 60 s, found 6e+06; write 6e-05 or more",
        ),
        ("", "expected at most 1,000,000 samples until 660 s, found 6.6e+07; write 0.00066 or more"),
    ],
)
def test_samples_at_sections_have_a_largest_number(refused, time, told):
    text = SECTIONS.replace("time: {end: 60}", time)
    lines = refused(text + "output: {section_every: 0.00001}\n")
    assert [line.partition("output.section_every: ")[2] for line in lines] == [told]


def test_the_size_of_results_holds_the_samples_at_sections(tmp_path):
    (tmp_path / "q.csv").write_text(TABLE)
    (tmp_path / "a.yaml").write_text(SECTIONS + "output: {section_every: 0.0001}\n")
    found = size(load([tmp_path / "a.yaml"])[0])
    # volume, discharge and time of 600,001 samples
    assert 3 * 8 * 600_001 < found.results < 1.1 * 3 * 8 * 600_001


@pytest.mark.parametrize(
    ("base", "zone", "x", "same"),
    [
        # a zone over all of the section has its law there
        (0.3, 0.1, [0, 100], 0.1),
        (0.1, 0.2, [0, 100], 0.2),
        # one that is beside it has none
        (0.1, 0.3, [30, 100], 0.1),
    ],
)
def test_a_normal_depth_has_the_friction_of_the_zone_of_its_section(tmp_path, base, zone, x, same):
    (tmp_path / "q.csv").write_text(TABLE)
    corners = [[x[0], -10], [x[1], -10], [x[1], 10], [x[0], 10]]
    zones = f", zones: [{{polygon: {corners}, friction_coefficient: {zone}}}]"
    depths = []
    for mu, more in ((base, zones), (same, "")):
        text = (BASE + INFLOW).replace("friction_coefficient: 0.1", f"friction_coefficient: {mu}")
        (tmp_path / "a.yaml").write_text(text.replace("isotropic}", f"isotropic{more}}}"))
        (scenario,) = load([tmp_path / "a.yaml"])
        points = solver_objects.points(scenario.settings)
        bed = solver_objects.slope(scenario.settings.terrain)
        depths.append(solver_objects.deepest_inflow(scenario.settings, points, bed, scenario.hydrographs))
    assert depths[0] == pytest.approx(depths[1], rel=1e-9)


def test_a_zone_over_half_of_a_section_counts_by_half():
    hydrograph = Hydrograph(np.array([0.0, 1.0]), np.array([1.0, 1.0]))
    line = ((0.0, 0.0), (0.0, 1.0))
    mixed = Inflow("a", line, hydrograph, "normal", zones=((Voellmy(10.0, 200.0), 0.5),))
    steep, flat = (np.tan(np.radians(angle)) for angle in (4.0, 10.0))
    mean = Voellmy(np.degrees(np.arctan((steep + flat) / 2)), 2 / (1 / 400 + 1 / 200))
    gravity = 9.81 * np.sin(0.3), 9.81 * np.cos(0.3), 9.81
    found = rating_of(mixed, Voellmy(4.0, 400.0), *gravity)
    known = rating_of(Inflow("a", line, hydrograph, "normal"), mean, *gravity)
    assert found.depth(5.0) == pytest.approx(known.depth(5.0), rel=1e-12)


@pytest.mark.parametrize(
    ("old", "new", "message"),
    [
        (
            "[[20, -8], [20, 8]]",
            "[[20, -8], [20, 8], [24, 0], [16, 0]]",
            "a.yaml:8:27: inflow.0.section: expected a line that does not cross itself, found one that does",
        ),
        (
            "[[60, -8], [60, 8]]",
            "[[60, -8], [60, 8], [60, 0]]",
            "a.yaml:9:30: sections.0.line: expected a line that does not cross itself, found one that does",
        ),
        (
            "[[20, -8], [20, 8]], hydrograph: {file: q.csv}}\n",
            "[[0, -8], [0, 8]], hydrograph: {file: q.csv}}\nboundaries: {x_min: {depth: 1}}\n",
            "a.yaml:8:27: inflow.0.section: expected a section off x_min, which holds a depth, found one on it; write open or wall for the side, or move the section inward",
        ),
    ],
)
def test_lines_that_make_no_section_are_refused(refused, old, new, message):
    assert old in SECTIONS
    assert refused(SECTIONS.replace(old, new)) == [message]


@pytest.mark.parametrize(
    ("old", "new", "message"),
    [
        (
            INFLOW,
            INFLOW + INFLOW.replace("inflow:\n", "").replace("apex", "other"),
            "inflow.1.section: the line is that of inflow.0 too: both come in there",
        ),
        (
            "[[60, -8], [60, 8]]",
            "[[60, 0], [60, 0.5]]",
            "sections.0.line: 0.5 m are less than 0.5 of a cell, 2 m: the section is as wide as the cells that it parts",
        ),
        (
            "sections:",
            "output: {section_every: 100}\nsections:",
            "output.section_every: 100 s are longer than the run, 60 s",
        ),
    ],
)
def test_sections_that_are_hardly_meant_are_warned_of(tmp_path, old, new, message):
    assert old in SECTIONS
    (tmp_path / "q.csv").write_text(TABLE)
    (tmp_path / "a.yaml").write_text(SECTIONS.replace(old, new))
    (warning,) = load([tmp_path / "a.yaml"])[0].warnings
    assert warning.endswith(message)


SINGLE = BASE + "inflow: {name: apex, section: [[20, -8], [20, 8]], hydrograph: {file: q.csv}}\n"


def test_one_inflow_is_written_without_a_list(tmp_path):
    (tmp_path / "q.csv").write_text(TABLE)
    found = []
    for text in (SINGLE, BASE + INFLOW):
        (tmp_path / "a.yaml").write_text(text)
        found.append(load([tmp_path / "a.yaml"])[0])
    assert found[0].settings.inflow == found[1].settings.inflow
    assert found[0].digest == found[1].digest


def test_keys_of_one_inflow_are_those_of_its_mapping(tmp_path, refused):
    off = "inflow.section: expected a section inside the domain"
    (line,) = refused(SINGLE.replace("[20, 8]", "[200, 8]"))
    assert line.startswith(f"a.yaml:7:31: {off}")
    missing, unknown = refused(SINGLE.replace("hydrograph", "graph"))
    assert "inflow.hydrograph: expected a value, found nothing" in missing
    assert "inflow.graph: expected one of the keys name, section" in unknown
    shape = SINGLE.replace("file: q.csv", "shape: triangle, volume: 100, peak_discharge: 10")
    for key in ("inflow.hydrograph.volume", "inflow.0.hydrograph.volume"):
        (tmp_path / "a.yaml").write_text(shape + f"sweep: {{{key}: [100, 200]}}\n")
        runs = expand(load([tmp_path / "a.yaml"])[0])
        assert [run.settings.inflow[0].hydrograph.volume for run in runs] == [100, 200]
        assert meaning_of(key, runs[0].settings)[0] == "m3"
        data = _plain(json.loads(load([tmp_path / "a.yaml"])[0].content))
        assert _digest(data, runs, 0) != _digest(data, runs, 1)


def test_a_hydrograph_is_written_as_lists_too(tmp_path):
    (tmp_path / "a.yaml").write_text(
        SINGLE.replace("file: q.csv", "times: [0, 5.5, 20], discharges: [0, 10, 0]")
    )
    (scenario,) = load([tmp_path / "a.yaml"])
    (graph,) = solver_objects.graphs(scenario.settings, {})
    assert graph.times.tolist() == [0, 5.5, 20]
    assert graph.volumes[-1] == pytest.approx(100)


@pytest.mark.parametrize(
    ("lists", "message"),
    [
        ("times: [0, 5], discharges: [0, 10, 0]", "discharges: expected 2 values, one a time, found 3"),
        (
            "times: [0, 5, 5], discharges: [0, 10, 0]",
            "times.2: expected times that increase, found 5 after 5",
        ),
        ("times: [0, 5], discharges: [0, 0]", "discharges: expected a discharge above 0, found none"),
        ("times: [0, 5]", "discharges: expected a value, found nothing"),
        ("times: [-1, 5], discharges: [1, 1]", "times.0: expected a number of at least 0, found -1"),
    ],
)
def test_lists_that_make_no_hydrograph_are_refused(refused, lists, message):
    (line,) = refused(SINGLE.replace("file: q.csv", lists))
    assert line.endswith(f"inflow.hydrograph.{message}")
