# ruff: noqa: E501 - a message is one line
import re

import pytest
from messages import messages

from pipeline.scenario.scenario import BadInput, load

GOOD = """\
name: good
terrain: {profile: plane, angle: 30}
domain: {x: [0, 10], y: [-2, 2]}
points: {layout: lattice, spacing: 0.5}
release: {shape: box, x: [1, 2], y: [-1, 1], height: 1}
material: {bed_friction: 20, internal_friction: 30}
boundaries: {x_min: wall}
time: {end: 1}
"""
BEND = "terrain: {profile: bend, angle: 30, start: 5, end: 8}"
PLANE = "terrain: {profile: plane, angle: 30}"
RELEASE = "release: {shape: box, x: [1, 2], y: [-1, 1], height: 1}"
MATERIAL = "material: {bed_friction: 20, internal_friction: 30}"
TIME = "time: {end: 1}"
TABLE = "terrain: {profile: table, file: missing.csv, smoothing: 1}"
SHAPES = "hemisphere, cap, paraboloid, box, cylinder, polygons"
SECTIONS = "gravity, terrain, release, inflow, material, erodible_bed, structures, boundaries, scheme"


@pytest.mark.parametrize(
    ("old", "new", "message"),
    [
        pytest.param(
            PLANE,
            "terrain: {profile: plane, angle: 30, angel: 3}",
            "2:38: terrain.angel: expected one of the keys profile, angle, found 'angel'. Did you mean 'angle'?",
            id="unknown key",
        ),
        pytest.param(
            TIME,
            "time: {end: 1}\nspeed: 3",
            "9:1: speed: expected one of the keys name, description, gravity, terrain, domain, points, release, inflow, sections, material, erodible_bed, structures, boundaries, scheme, time, output, sweep, sample, weights, return_periods, receptors, georeference, hazard, report, found 'speed'. Did you mean 'hazard.speed'?",
            id="unknown section",
        ),
        pytest.param(
            MATERIAL,
            "material: {friction: {law: bingham, yield_stress: 900, viscosity: 50}, earth_pressure: isotropic}",
            "6:1: material.density: expected a density with friction bingham, found nothing",
            id="a law of stress without a density",
        ),
        pytest.param(
            MATERIAL + "\nboundaries: {x_min: wall}\ntime: {end: 1}",
            "material: {friction: {law: manning, manning_n: 0.05}, earth_pressure: isotropic}",
            "1:1: time.end: expected a time, as manning friction stops nothing, found nothing",
            id="a law that stops nothing without an end",
        ),
        pytest.param(
            MATERIAL,
            "material: {bed_friction: 20, earth_pressure: isotropic, zones: [{polygon: [[1, 1], [2, 2], [2, 1], [1, 2]], bed_friction: 25}]}",
            "6:75: material.zones.0.polygon: expected corners of a simple polygon, found Self-intersection[1.5 1.5]",
            id="a zone that crosses itself",
        ),
        pytest.param(
            MATERIAL,
            "material: {bed_friction: 20, earth_pressure: isotropic, zones: [{polygon: [[21, 1], [22, 1], [22, 2]], bed_friction: 25}]}",
            "6:75: material.zones.0.polygon: expected a zone in the domain, found one outside, which changes nothing",
            id="a zone outside",
        ),
        pytest.param(
            TIME,
            "time: {end: 1}\ngeoreference: {crs: Swiss, origin: [1, 2], azimuth: 90}",
            "9:21: georeference.crs: expected a code as EPSG:2056, found 'Swiss'",
            id="a reference system without a code",
        ),
        pytest.param(
            TIME,
            "time: {end: 1}\ngeoreference: {crs: 2056, origin: [2600000, 1200000], azimuth: 90}",
            '9:21: georeference.crs: expected text, found 2056. Write "EPSG:2056"',
            id="a reference system as a number",
        ),
        pytest.param(
            TIME,
            "time: {end: 1}\nreceptors: [{name: yard, polygon: [[1, 0], [2, 1], [2, 0], [1, 1]]}]",
            "9:35: receptors.0.polygon: expected corners of a simple polygon, found Self-intersection[1.5 0.5]",
            id="a receptor that crosses itself",
        ),
        pytest.param(
            TIME,
            "time: {end: 1}\nreceptors: [{name: yard, polygon: [[1, 0], [2, 0], [3, 0]]}]",
            "9:35: receptors.0.polygon: expected corners of a simple polygon, found one of no area",
            id="a receptor of no area",
        ),
        pytest.param(
            TIME,
            "time: {end: 1}\nreceptors: [{name: yard, point: [2600123.5, 1200045.25]}]",
            "9:13: receptors.0: expected places in the domain, x [0, 10] and y [-2, 2], found [2600123.5, 1200045.25]",
            id="a receptor on the map, its digits kept",
        ),
        pytest.param(
            TIME,
            "time: {end: 1}\nhazard: {intensity: {depth: [1, 0.5]}}",
            "9:29: hazard.intensity.depth: expected ascending numbers, found 1, 0.5",
            id="edges that do not ascend",
        ),
        pytest.param(
            TIME,
            "time: {end: 1}\nhazard: {intensity: {classes: [[1, 2]]}}",
            "9:31: hazard.intensity.classes: expected 2 rows of 2 values, found 1 rows of [2]",
            id="a matrix of another shape",
        ),
        pytest.param(
            TIME,
            "time: {end: 1}\ntime: {end: 2}",
            "9:1: time: expected each key once, found it again after line 8, column 1",
            id="duplicate section",
        ),
        pytest.param(
            PLANE,
            "terrain: {profile: plane, angle: 30, angle: 31}",
            "2:38: terrain.angle: expected each key once, found it again after line 2, column 27",
            id="duplicate key",
        ),
        pytest.param(
            TIME,
            "time: {end: [1}",
            "8:15: expected YAML, found a fault (while parsing a flow sequence, expected ',' or ']', but got '}')",
            id="no YAML",
        ),
        pytest.param(GOOD, "", "1:1: expected a mapping of keys, found an empty file", id="empty"),
        pytest.param(
            "spacing: 0.5",
            "spacing: 1e-5",
            "4:36: points.spacing: expected at most 100,000,000 points, found 4e+11",
            id="too many points",
        ),
        pytest.param(
            "end: 1",
            "end: 1, output_every: 1e-9",
            "8:30: time.output_every: expected at most 100,000 frames, found 1e+09",
            id="too many frames",
        ),
        pytest.param(GOOD, "- 1", "1:1: expected a mapping of keys, found a list", id="a list"),
        pytest.param(MATERIAL, "", "1:1: material: expected a value, found nothing", id="missing section"),
        pytest.param(
            MATERIAL, "material:", "6:10: material: expected a mapping, found nothing", id="empty section"
        ),
        pytest.param(
            MATERIAL,
            "material: {bed_friction: 20}",
            "6:1: material.internal_friction: expected a value with earth_pressure mohr-coulomb, found nothing",
            id="missing angle",
        ),
        pytest.param(
            "angle: 30}",
            "angle: steep}",
            "2:34: terrain.angle: expected a number, found 'steep'",
            id="wrong type",
        ),
        pytest.param(
            "angle: 30}", "angle: true}", "2:34: terrain.angle: expected a number, found true", id="a boolean"
        ),
        pytest.param(
            "angle: 30}",
            "angle: '30'}",
            "2:34: terrain.angle: expected a number, found '30'",
            id="a quoted number",
        ),
        pytest.param(
            "angle: 30}",
            "angle: 90}",
            "2:34: terrain.angle: expected a number below 90, found 90",
            id="steep",
        ),
        pytest.param(
            "end: 1", "end: .inf", "8:13: time.end: expected a finite number, found .inf", id="infinite"
        ),
        pytest.param(
            "end: 1", "end: .nan", "8:13: time.end: expected a finite number, found .nan", id="not a number"
        ),
        pytest.param(
            "end: 1", "end: 1e999", "8:13: time.end: expected a finite number, found .inf", id="overflow"
        ),
        pytest.param(
            "end: 1", "end: " + "9" * 400, "8:13: time.end: expected a finite number, found .inf", id="long"
        ),
        pytest.param(
            "end: 1",
            "end: 1, stop_at_rest: no",
            "8:30: time.stop_at_rest: expected true or false, found 'no'",
            id="YAML 1.1 boolean",
        ),
        pytest.param(
            "end: 1",
            "end: 1, output_every: 2",
            "8:30: time.output_every: expected at most end (1), found 2",
            id="frames beyond the end",
        ),
        pytest.param(
            "spacing: 0.5",
            "spacing: 0",
            "4:36: points.spacing: expected a number above 0, found 0",
            id="spacing",
        ),
        pytest.param(
            "layout: lattice",
            "layout: scatter",
            "4:18: points.layout: expected one of lattice, poisson-disc, graded, file, found 'scatter'",
            id="layout",
        ),
        pytest.param(
            "x: [0, 10]",
            "x: [10, 0]",
            "3:13: domain.x: expected a lower bound below the upper one, found [10, 0]",
            id="bounds",
        ),
        pytest.param("x: [0, 10]", "x: [0]", "3:13: domain.x: expected 2 values, found 1", id="one bound"),
        pytest.param(
            "x: [0, 10]", "x: [0, 1, 2]", "3:13: domain.x: expected 2 values, found 3", id="three bounds"
        ),
        pytest.param("x: [0, 10]", "x: 10", "3:13: domain.x: expected a list, found 10", id="no bounds"),
        pytest.param(
            "x: [0, 10]",
            "x: [0, ten]",
            "3:17: domain.x.1: expected a number, found 'ten'",
            id="item of a list",
        ),
        pytest.param(
            "profile: plane",
            "profile: hill",
            "2:20: terrain.profile: expected one of plane, bend, segments, table, elevation, found 'hill'",
            id="profile",
        ),
        pytest.param(
            "profile: plane, ",
            "",
            "2:1: terrain.profile: expected one of plane, bend, segments, table, elevation, found nothing",
            id="no profile",
        ),
        pytest.param(
            "shape: box",
            "shape: cone",
            f"5:18: release.shape: expected one of {SHAPES}, found 'cone'",
            id="shape",
        ),
        pytest.param(
            RELEASE,
            "release: [{shape: cone}]",
            f"5:19: release.0.shape: expected one of {SHAPES}, found 'cone'",
            id="shape in a list",
        ),
        pytest.param(
            RELEASE, "release: []", "5:10: release: expected 1 or more values, found 0", id="no release"
        ),
        pytest.param(
            RELEASE,
            "release: {shape: cap, centre: [3, 0], radius: 1, height: 2}",
            "5:58: release.height: expected at most radius (1), found 2",
            id="overhanging cap",
        ),
        pytest.param(
            RELEASE,
            "release: {shape: paraboloid, centre: [3, 0], radii: [1, -1], height: 2}",
            "5:57: release.radii.1: expected a number above 0, found -1",
            id="radii",
        ),
        pytest.param(
            RELEASE,
            "release: {shape: hemisphere, centre: [30, 0], radius: 1}",
            "5:10: release: expected a release inside the domain, x [0, 10] and y [-2, 2], found one wholly outside it",
            id="release outside",
        ),
        pytest.param(
            PLANE,
            BEND.replace("end: 8", "end: 4"),
            "2:52: terrain.end: expected a number above start (5), found 4",
            id="bend",
        ),
        pytest.param(
            PLANE,
            "terrain: {profile: segments, joint: 2, segments: [{start: 0, angle: 9}, {start: 0, angle: 3}]}",
            "2:81: terrain.segments.1.start: expected at least 1 (clear of the joint before), found 0",
            id="joints",
        ),
        pytest.param(
            "bed_friction: 20",
            "bed_friction: 90",
            "6:26: material.bed_friction: expected a number below 90, found 90",
            id="friction angle",
        ),
        pytest.param(
            "bed_friction: 20",
            "bed_friction: -1",
            "6:26: material.bed_friction: expected a number of at least 0, found -1",
            id="negative friction angle",
        ),
        pytest.param(
            "bed_friction: 20",
            "bed_friction: 31",
            "6:26: material.bed_friction: expected at most internal_friction (30) with earth_pressure mohr-coulomb, found 31",
            id="phi below delta",
        ),
        pytest.param(
            "x_min: wall",
            "x_min: fence",
            "7:21: boundaries.x_min: expected one of open, wall, no-slip, found 'fence'",
            id="boundary",
        ),
        pytest.param(
            "x_min: wall",
            "x_min: {depth: -1}",
            "7:29: boundaries.x_min.depth: expected a number of at least 0, found -1",
            id="boundary depth",
        ),
        pytest.param(
            "x_min: wall",
            "x_min: {deep: 1}",
            "7:14: boundaries.x_min.depth: expected a value, found nothing",
            id="boundary key",
        ),
        pytest.param(
            "name: good",
            "name: a b",
            "1:7: name: expected letters, digits, - _ and . with a letter or digit first, found 'a b'",
            id="name",
        ),
        pytest.param(
            "name: good",
            "name: ../a",
            "1:7: name: expected letters, digits, - _ and . with a letter or digit first, found '../a'",
            id="name that leads elsewhere",
        ),
        pytest.param("name: good", "name: 1", "1:7: name: expected text, found 1", id="number as a name"),
        pytest.param(
            TIME,
            "time: {end: 1}\noutput: {fields: [depth, height]}",
            "9:26: output.fields.1: expected one of depth, velocity_x, velocity_y, max_depth, max_speed, max_momentum_flux, arrival_time, deposit_depth, erosion_depth, bed_change, found 'height'",
            id="field",
        ),
        pytest.param(
            PLANE,
            TABLE,
            "2:33: terrain.file: expected a readable file, found none: missing.csv",
            id="missing table",
        ),
    ],
)
def test_a_mistake_is_told_with_its_place(tmp_path, old, new, message):
    assert old in GOOD
    assert messages(tmp_path, GOOD.replace(old, new))[0] == f"a.yaml:{message}"


@pytest.mark.parametrize(
    ("sweep", "message"),
    [
        (
            "material.frictions: [1]",
            f"10:3: sweep.material.frictions: expected a key of the scenario below {SECTIONS}, "
            "found 'material.frictions'. Did you mean 'friction'?",
        ),
        (
            "release.1.height: [1]",
            f"10:3: sweep.release.1.height: expected a key of the scenario below {SECTIONS}, "
            "found 'release.1.height'",
        ),
        (
            "points.spacing: [1]",
            f"10:3: sweep.points.spacing: expected a key of the scenario below {SECTIONS}, "
            "found 'points.spacing'",
        ),
        (
            "gravity.z: [1]",
            f"10:3: sweep.gravity.z: expected a key of the scenario below {SECTIONS}, found 'gravity.z'",
        ),
        ("gravity: 9", "10:12: sweep.gravity: expected a list, found 9"),
        ("gravity: []", "10:12: sweep.gravity: expected 1 or more values, found 0"),
        (
            "gravity: [9, [1]]",
            "10:16: sweep.gravity.1: expected a finite number, a word or true or false, found a list",
        ),
        (
            "gravity: [9, .nan]",
            "10:16: sweep.gravity.1: expected a finite number, a word or true or false, found .nan",
        ),
        ("gravity: [9, -1]", "10:16: sweep.gravity.1: expected a number above 0, found -1"),
        ("gravity: [9, 9.0]", "10:16: sweep.gravity.1: expected each value once, found 9 again"),
        (
            "release.centre: [1]",
            "10:3: sweep.release.centre: expected a key of the scenario below "
            f"{SECTIONS}, found 'release.centre'",
        ),
        ("material: [3]", "10:14: sweep.material.0: expected a mapping, found 3"),
        (
            "material.bed_friction: [10, 40]",
            "10:31: sweep.material.bed_friction.1: expected at most "
            "internal_friction (30) with earth_pressure mohr-coulomb, found 40",
        ),
        (
            "release.x.0: [1.5, 3]",
            "10:22: sweep.release.x.0.1: expected a lower bound below the upper one, found [3, 2]",
        ),
    ],
)
def test_a_mistake_of_a_sweep_is_told_at_its_entry(tmp_path, sweep, message):
    assert messages(tmp_path, f"{GOOD}sweep:\n  {sweep}\n") == [f"a.yaml:{message}"]


def test_values_that_break_only_together_are_told_at_the_key_to_blame(tmp_path):
    sweep = "sweep:\n  material.internal_friction: [25, 35]\n  material.bed_friction: [20, 30, 40]\n"
    found = messages(tmp_path, GOOD + sweep)
    assert [line.partition(": expected at most internal_friction ")[::2] for line in found] == [
        ("a.yaml:11:31: sweep.material.bed_friction.1", "(25) with earth_pressure mohr-coulomb, found 30"),
        ("a.yaml:11:35: sweep.material.bed_friction.2", "(25) with earth_pressure mohr-coulomb, found 40"),
    ]


def test_a_wrong_entry_is_told_once_whatever_it_meets_in_the_runs(tmp_path):
    text = GOOD.replace(MATERIAL, "material: {bed_friction: 24, earth_pressure: isotropic}")
    sweep = "sweep: {material.bed_friction: [-1, 24, 95], gravity: [1, 2, 3], terrain.angle: [20, 30, 200]}\n"
    assert messages(tmp_path, text + sweep) == [
        "a.yaml:9:33: sweep.material.bed_friction.0: expected a number of at least 0, found -1",
        "a.yaml:9:41: sweep.material.bed_friction.2: expected a number below 90, found 95",
        "a.yaml:9:90: sweep.terrain.angle.2: expected a number below 90, found 200",
    ]
    law = "{law: pouliquen, angles: [21, 30], beta: 0.136, length: 0.5}"
    text = GOOD.replace(MATERIAL, f"material: {{friction: {law}, earth_pressure: isotropic}}")
    sweep = "sweep: {material.friction.angles.0: [20, 35], material.friction.angles.1: [30, 33], gravity: [1, 2]}\n"
    assert messages(tmp_path, text + sweep) == [
        "a.yaml:9:42: sweep.material.friction.angles.0.1: expected a lower bound below the upper one, "
        "found [35, 30]"
    ]


def test_a_sweep_is_not_blamed_for_the_section_it_leads_through(tmp_path):
    text = GOOD.replace(PLANE, "terrain: steep") + "sweep: {terrain.angle: [3, 4], gravity: [9, -1]}\n"
    assert messages(tmp_path, text) == [
        "a.yaml:2:10: terrain: expected a mapping, found 'steep'",
        "a.yaml:9:45: sweep.gravity.1: expected a number above 0, found -1",
    ]


def test_a_sweep_that_moves_the_release_out_is_told_at_its_entry(tmp_path):
    text = GOOD.replace(RELEASE, "release: {shape: hemisphere, centre: [3, 0], radius: 1}")
    found = messages(tmp_path, text + "sweep:\n  release.centre.0: [3, 30]\n")
    assert len(found) == 1
    assert found[0].startswith("a.yaml:10:25: sweep.release.centre.0.1: expected a release inside the domain")


def test_all_mistakes_of_all_files_come_in_the_order_of_their_places(tmp_path):
    first = GOOD.replace("end: 1", "end: -1").replace("angle: 30", "angle: 100, curvature: true")
    found = messages(tmp_path, first, GOOD, GOOD.replace("height: 1", "height: 0"))
    places = [line.split(": ")[0] for line in found]
    assert places == ["a.yaml:2:34", "a.yaml:2:39", "a.yaml:8:13", "b.yaml:1:7", "c.yaml:1:7", "c.yaml:5:54"]


def test_a_file_with_faulty_yaml_does_not_hide_the_mistakes_of_another(tmp_path):
    found = messages(tmp_path, "a: [", GOOD.replace("end: 1", "end: 0"))
    assert [line.split(": ")[0] for line in found] == ["a.yaml:1:5", "b.yaml:8:13"]


def test_two_files_with_one_name_are_told_at_the_second(tmp_path):
    assert messages(tmp_path, GOOD, GOOD) == [
        "b.yaml:1:7: name: expected a name of its own, found 'good' of a.yaml again"
    ]


def test_a_missing_file_and_a_file_that_is_no_text_are_told(tmp_path):
    (tmp_path / "b.yaml").write_bytes(b"name: x\nti\xffme: 1")
    with pytest.raises(BadInput) as caught:
        load([tmp_path / "a.yaml", tmp_path / "b.yaml"])
    assert str(caught.value).replace(f"{tmp_path}/", "").splitlines() == [
        "a.yaml:1:1: expected a readable file, found No such file or directory",
        "b.yaml:2:3: expected UTF-8 text, found the byte 0xff",
    ]


@pytest.mark.parametrize(
    ("rows", "message"),
    [
        ("d,z\n0,5\n1,4\n1,3\n", "t.csv:4:1: distance: expected a number above 1, the one before, found 1"),
        ("d,z\n0,5\n1,low\n", "t.csv:3:3: elevation: expected a finite number, found 'low'"),
        ("d,z\n0,5\n1,nan\n", "t.csv:3:3: elevation: expected a finite number, found 'nan'"),
        ("d,z\n0,5\n1\n", "t.csv:3:1: expected 2 values, d, z, found 1"),
        (
            "d,z\n0,5\n",
            "t.csv:1:1: expected a line of headings and two or more of numbers, found 1 of numbers",
        ),
        ("0,5\n1,4\n2,3\n", "t.csv:1:1: expected a line of headings, found '0,5'"),
    ],
)
def test_a_mistake_of_a_table_is_told_with_its_line(tmp_path, rows, message):
    (tmp_path / "t.csv").write_text(rows)
    text = GOOD.replace(PLANE, "terrain: {profile: table, file: t.csv, smoothing: 1}")
    assert messages(tmp_path, text) == [message]


SAMPLE = "sample: {count: 4, values: {gravity: {distribution: uniform, lower: 9, upper: 10}}"


@pytest.mark.parametrize(
    ("text", "message"),
    [
        (
            "sample: {count: 4, values: {gravity: {distribution: normal, mean: 9, sigma: 1}}}",
            "9:29: sample.values.gravity.deviation: expected a value, found nothing",
        ),
        (
            "sample: {count: 4, values: {gravity: {distribution: weibull}}}",
            "9:53: sample.values.gravity.distribution: expected one of uniform, normal, lognormal, triangular, discrete, found 'weibull'",
        ),
        (
            "sample: {count: 4, values: {gravity: {distribution: uniform, lower: 10, upper: 9}}}",
            "9:80: sample.values.gravity.upper: expected a number above lower (10), found 9",
        ),
        (
            "sample: {count: 4, values: {gravity: {distribution: uniform, lower: -9, upper: 9}}}",
            "9:38: sample.values.gravity: expected a number above 0, found -1.62090740539134 in run 0",
        ),
        (
            "sample: {count: 4, values: {material.frictions: {distribution: uniform, lower: 9, upper: 10}}}",
            f"9:29: sample.values.material.frictions: expected a key of the scenario below {SECTIONS}, found 'material.frictions'",
        ),
        (
            "sample: {count: 4, values: {material.bed_friction: {distribution: uniform, lower: 9, upper: 40}}}",
            "9:52: sample.values.material.bed_friction: expected at most internal_friction (30) with earth_pressure mohr-coulomb, found 3",
        ),
        (
            f"sweep: {{gravity: [9, 10]}}\n{SAMPLE}}}",
            "10:29: sample.values.gravity: expected a key that is not swept, found 'gravity'",
        ),
        (
            f"{SAMPLE.replace('4', '6')}, design: saltelli}}",
            "9:17: sample.count: expected a power of 2 with design saltelli, found 6",
        ),
        (
            f"{SAMPLE}, design: orthogonal}}",
            "9:93: sample.design: expected one of sobol, latin-hypercube, saltelli, random, found 'orthogonal'",
        ),
        (
            f"{SAMPLE}, correlations: [{{between: [gravity, terrain.angle], value: 0.5}}]}}",
            "9:110: sample.correlations.0.between: expected two of gravity, found gravity and terrain.angle",
        ),
        ("weights: [1, 2]", "9:10: weights: expected 1 values, one a run, found 2"),
        (
            "weights: {gravity: [1, 2]}",
            "9:20: weights.gravity: expected a key of the sweep (none), found 'gravity'",
        ),
        (
            "sweep: {gravity: [9, 10]}\nweights: {gravity: [1]}",
            "10:20: weights.gravity: expected 2 values, one an entry of the sweep's list, found 1",
        ),
        (
            "sweep: {gravity: [9, 10]}\nreturn_periods: [30, 0]",
            "10:22: return_periods.1: expected a number above 0, found 0",
        ),
        (
            "receptors: [{name: road, point: [1, 20]}]",
            "9:13: receptors.0: expected places in the domain, x [0, 10] and y [-2, 2], found [1, 20]",
        ),
        (
            "receptors: [{name: road}]",
            "9:13: receptors.0: expected one of point, line and polygon, found none",
        ),
        (
            "receptors: [{name: road, point: [1, 2], line: [[1, 2], [2, 3]]}]",
            "9:47: receptors.0.line: expected one of point, line and polygon, found point and line",
        ),
        (
            "receptors: [{name: road, point: [1, 2]}, {name: road, point: [1, 2]}]",
            "9:49: receptors.1.name: expected a name of its own, found 'road' again",
        ),
    ],
)
def test_a_mistake_of_what_is_said_of_all_runs_is_told_at_its_place(tmp_path, text, message):
    found = messages(tmp_path, f"{GOOD}{text}\n")
    assert found[0].startswith(f"a.yaml:{message}")


@pytest.mark.parametrize(
    ("points", "sides", "message"),
    [
        ("spacing: 0.5", "x_min: wall", "1:1: domain: expected a domain, as a side is not open"),
        (
            "layout: poisson-disc, count: 500",
            "x_min: open",
            "1:1: domain: expected a domain, as the points have no spacing of their own",
        ),
    ],
)
def test_a_domain_is_left_out_only_where_it_can_be_found(tmp_path, points, sides, message):
    text = GOOD.replace("domain: {x: [0, 10], y: [-2, 2]}\n", "").replace("x_min: wall", sides)
    text = text.replace("layout: lattice, spacing: 0.5", points)
    assert messages(tmp_path, text) == [f"a.yaml:{message}"]


@pytest.mark.parametrize(
    ("old", "new", "message"),
    [
        ("bed_friction: 20", "mu: 0.2", "material.mu: expected one of the keys .*, found 'mu'. Did you mean 'friction_coefficient'?"),
        ("bed_friction: 20", "bed_friction: 20, xi: 200", "material.xi: .*, found 'xi'. Did you mean 'turbulent_friction'?"),
        (RELEASE, "release: {shape: cylinder, center: [3, 0], radius: 1, height: 1}", "release.center: .* Did you mean 'centre'?"),
        (RELEASE, "release: [{shape: cylinder, centre: [3, 0], radious: 1, height: 1}]", "release.0.radious: .* Did you mean 'radius'?"),
        (TIME, "time: {end: 1, output-every: 1}", "time.output-every: .* Did you mean 'output_every'?"),
        (TIME, "time: {end: 1}\nmateriel: {}", "materiel: .* Did you mean 'material'?"),
        (TIME, "time: {end: 1}\nmu: 0.2", "mu: .* Did you mean 'material.friction_coefficient'?"),
        ("height: 1", "height: 1, volume: 20,000", "release.000: .* A comma ends a value here: write 20000 for 20,000 and 1.5 for 1,5"),
        (TIME, "time:\n  end: 20,000", "time.end: expected a number, found '20,000'. Write 20000, without separators between digits"),
        (TIME, "time:\n  end: 20'000", "time.end: expected a number, found '20'000'. Write 20000, without separators between digits"),
        (TIME, "time:\n  end: 1,5", "time.end: expected a number, found '1,5'. Write 1.5, with a decimal point"),
        ("end: 1", "end: 30 s", "time.end: expected a number, found '30 s'. Write the number alone: 30"),
        (TIME, "time: {end: 1}\nreceptors: [{name: a, point: [1, 0], threshold: 1}]", "receptors.0.threshold: .* Did you mean 'output.threshold'?"),
        ("end: 1", "end: 10 min", "time.end: expected a number, found '10 min'. Write it in s: 600"),
        ("end: 1", "end: 1, max_wall: 1.5 h", "time.max_wall: expected a number, found '1.5 h'. Write it in s: 5400"),
        ("end: 1", "end: 2 m", "time.end: expected a number, found '2 m'. Write a number in s"),
        ("spacing: 0.5", "spacing: 0.01 km", "points.spacing: expected a number, found '0.01 km'. Write it in m: 10"),
        ("bed_friction: 20", "bed_friction: 20°", "material.bed_friction: .*. Write the number alone: 20"),
        ("bed_friction: 20", "bed_friction: 8%", "material.bed_friction: .*. Write the slope of 8 % in degrees: 4.57"),
        ("bed_friction: 20", "bed_friction: 0.35 rad", "material.bed_friction: .*. Write it in degrees: 20.1"),
        ("bed_friction: 20", "friction_coefficient: 8 %", "material.friction_coefficient: .*. Write it as a share: 0.08"),
        ("bed_friction: 20", "bed_friction: 20, density: 1.8 g/cm^3", "material.density: .*. Write it in kg m-3: 1800"),
        ("bed_friction: 20", "bed_friction: 20, density: 1800 kg/m³", "material.density: .*. Write the number alone: 1800"),
        ("y: [-2, 2]", "y: [-2 m, 2]", "domain.y.0: expected a number, found '-2 m'. Write the number alone: -2"),
        ("y: [-2, 2]", "y: [-2; 2]", "domain.y.0: expected a number, found '-2; 2'. Separate values by commas, not by semicolons"),
        ("y: [-2, 2]", "y: [-2,5, 2,5]", "domain.y: expected 2 values, found 4. Decimals are written with a point: [0.5, 1.5]"),
    ],
)  # fmt: skip
def test_what_is_meant_is_said(tmp_path, old, new, message):
    assert old in GOOD
    found = messages(tmp_path, GOOD.replace(old, new))
    parts = [re.escape(part) for part in message.split(".*")]
    assert any(re.fullmatch(rf"a.yaml:\d+:\d+: {'.*'.join(parts)}", line) for line in found), found


@pytest.mark.parametrize(
    ("sweep", "hint"),
    [
        ("material.mu: [0.2]", "found 'material.mu'. Did you mean 'friction_coefficient'?"),
        ("bed_friction: [20]", "found 'bed_friction'. Did you mean 'material.bed_friction'?"),
        ("centre.0: [1]", "found 'centre.0'. Did you mean 'release.centre'?"),
        ("materials.bed_friction: [20]", "found 'materials.bed_friction'. Did you mean 'material'?"),
        (
            "release.volume: [1]\n  release.0.volume: [2]",
            "expected each key once, found 'release.0.volume' again",
        ),
    ],
)
def test_what_is_meant_in_a_sweep_is_said(tmp_path, sweep, hint):
    (found,) = messages(tmp_path, f"{GOOD}sweep:\n  {sweep}\n")
    assert found.endswith(hint)


def test_a_key_of_a_list_of_releases_is_addressed_by_its_place(tmp_path):
    text = GOOD.replace(RELEASE, f"release: [{RELEASE.removeprefix('release: ')}]")
    (found,) = messages(tmp_path, f"{text}sweep:\n  release.volume: [1, 2]\n")
    assert found.endswith("found 'release.volume'. Did you mean 'release.0.volume'?")


@pytest.mark.parametrize(
    ("material", "message"),
    [
        (
            "friction_coefficient: 0.2, bed_friction: 20, internal_friction: 30",
            "6:34: material.friction_coefficient: expected either bed_friction or friction_coefficient, found both",
        ),
        ("internal_friction: 30", "6:1: material.bed_friction: expected a value, found nothing"),
        (
            "friction_coefficient: -0.2, internal_friction: 30",
            "6:34: material.friction_coefficient: expected a number of at least 0, found -0.2",
        ),
        (
            "friction_coefficient: 1, internal_friction: 30",
            "6:34: material.friction_coefficient: expected at most internal_friction (30) with earth_pressure mohr-coulomb, found 45 (friction_coefficient 1)",
        ),
        (
            "friction: {law: coulomb, bed_friction: 20}, bed_friction: 20, internal_friction: 30",
            "6:70: material.bed_friction: expected either friction or bed_friction, found both",
        ),
        (
            "friction: {law: coulomb, bed_friction: 40}, internal_friction: 30",
            "6:22: material.friction: expected at most internal_friction (30) with earth_pressure mohr-coulomb, found 40",
        ),
        (
            "friction: {law: voellmy, bed_friction: 20}, internal_friction: 30",
            "6:12: material.friction.turbulent_friction: expected a value, found nothing",
        ),
        (
            "friction: {law: chezi}, internal_friction: 30",
            "6:28: material.friction.law: expected one of coulomb, voellmy, chezy, manning, obrien, bingham, herschel-bulkley, pouliquen, edwards, found 'chezi'",
        ),
    ],
)
def test_friction_is_given_in_one_way(tmp_path, material, message):
    (found,) = messages(tmp_path, GOOD.replace(MATERIAL, f"material: {{{material}}}"))
    assert found == f"a.yaml:{message}"


def test_a_coefficient_given_as_an_angle_is_warned_of(tmp_path):
    path = tmp_path / "a.yaml"
    path.write_text(GOOD.replace("bed_friction: 20", "bed_friction: 0.15"))
    assert load([path])[0].warnings == (
        f"{path}:6:26: material.bed_friction: 0.15 degrees are nearly none; mu = 0.15 is written as "
        "friction_coefficient",
    )
    path.write_text(GOOD.replace("bed_friction: 20", "friction_coefficient: 0.15"))
    assert load([path])[0].warnings == ()


def test_a_georeference_where_its_system_is_not_used_is_warned_of(tmp_path):
    file = tmp_path / "good.yaml"
    place = "georeference: {crs: EPSG:2056, origin: [%s], azimuth: 90}\n"
    file.write_text(GOOD + place % "1200000, 2600000")
    (scenario,) = load([file])
    (told,) = scenario.warnings
    assert "9:40: georeference.origin: it lies at longitude" in told
    assert "but EPSG:2056 is used in Liechtenstein; Switzerland: check the system" in told
    file.write_text(GOOD + place % "2600000, 1200000")
    (scenario,) = load([file])
    assert scenario.warnings == ()


def test_a_smoothing_that_leaves_nothing_of_a_table_is_warned_of(tmp_path):
    (tmp_path / "slope.csv").write_text("distance,elevation\n0,40\n20,20\n60,10\n100,8\n")
    file = tmp_path / "good.yaml"
    for smoothing, warned in ((600, True), (26, True), (25, False)):
        table = f"terrain: {{profile: table, file: slope.csv, smoothing: {smoothing}}}"
        file.write_text(GOOD.replace(PLANE, table))
        (scenario,) = load([file])
        found = [each for each in scenario.warnings if "terrain.smoothing: " in each]
        assert bool(found) is warned
        if found:
            assert f"{smoothing} m round off the shape of a table of 100 m; a few distances" in found[0]
            assert "33.3 m in the mean" in found[0]
