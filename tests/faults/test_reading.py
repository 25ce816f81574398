"""Files of others: what they meant is read, or the fix is told; nothing is found out only by a later command."""
# ruff: noqa: E501 - a message is one line

import shutil

import numpy as np
import pandas as pd
import pytest
from commands import pipeline

from pipeline.mistakes import BadInput
from pipeline.runs.runs import expand, share
from pipeline.runs.scene_of_run import build_scene
from pipeline.runs.summary import summarise
from pipeline.scenario.scenario import load
from pipeline.scenario.solver_objects import releases

TABLE = "{profile: table, file: p.csv, smoothing: 20}"
PLANE = "{profile: plane, angle: 20}"
BOX = "{shape: box, x: [20, 60], y: [-15, 15], height: 2}"


def text(*, terrain=PLANE, domain="{x: [0, 400], y: [-40, 40]}", release=BOX, friction=20, end=60, more=""):
    return f"""\
name: f
terrain: {terrain}
{f"domain: {domain}" if domain else ""}
points: {{spacing: 4}}
release: {release}
material: {{bed_friction: {friction}, earth_pressure: isotropic}}
time: {{end: {end}}}
{more}
"""


@pytest.fixture
def read(tmp_path):
    """Load a scenario, with a table beside it."""

    def do(table="", **changes):
        (tmp_path / "p.csv").write_text(table)
        path = tmp_path / "f.yaml"
        path.write_text(text(**changes))
        (scenario,) = load([path])
        return scenario

    return do


@pytest.fixture
def refused(read, tmp_path):
    """Give the lines that refuse a scenario."""

    def do(table="", **changes):
        with pytest.raises(BadInput) as caught:
            read(table, **changes)
        return str(caught.value).replace(f"{tmp_path}/", "").splitlines()

    return do


@pytest.fixture
def warned(read, tmp_path):
    """Give the lines that warn of a scenario."""

    def do(table="", **changes):
        return [line.replace(f"{tmp_path}/", "") for line in read(table, **changes).warnings]

    return do


@pytest.mark.parametrize(
    ("more", "message"),
    [
        ("receptors: [{name: c, polygon: [[60, 0], [70, 10]]}]", "8:32: receptors.0.polygon: expected 3 or more corners, found 2"),
        ("receptors: [{name: c, polygon: [[60, 0]]}]", "8:32: receptors.0.polygon: expected 3 or more corners, found 1"),
        ("receptors: [{name: c, polygon: []}]", "8:32: receptors.0.polygon: expected 3 or more corners, found 0"),
        ("receptors: [{name: c, line: [[60, 0]]}]", "8:29: receptors.0.line: expected 2 or more corners, found 1"),
        ("output: {fields: []}", "8:18: output.fields: expected 1 or more values, found 0"),
        ("weights: []", "8:10: weights: expected 1 or more values, found 0"),
        ("return_periods: {release.volume: []}", "8:34: return_periods.release.volume: expected 1 or more values, found 0"),
        ("hazard: {intensity: {depth: []}}", "8:29: hazard.intensity.depth: expected 1 or more values, found 0"),
        ("hazard: {levels: {return_periods: []}}", "8:35: hazard.levels.return_periods: expected 1 or more values, found 0"),
        ("sample: {count: 4, values: {}}", "8:28: sample.values: expected 1 or more values, found 0"),
        ("sample: {count: 4, values: {release.volume: {distribution: discrete, values: []}}}", "8:78: sample.values.release.volume.values: expected 1 or more values, found 0"),
    ],
)  # fmt: skip
def test_a_list_that_is_too_short_is_told(refused, more, message):
    assert refused(domain="{x: [0, 100], y: [-40, 40]}", more=more)[0] == f"f.yaml:{message}"


def test_a_file_whose_only_mistake_has_no_name_is_refused_all_the_same(read, monkeypatch):
    monkeypatch.setattr("pipeline.scenario.scenario.checks.check_document", lambda *_: _Nothing())
    with pytest.raises(
        BadInput, match=r"f.yaml:1:1: expected a scenario, found one whose mistake has no name"
    ):
        read()


class _Nothing:
    settings = None
    mistakes = ()


def test_swapped_columns_are_read_by_their_headings(read):
    swapped = read("elevation,distance\n65,0\n70,200\n90,300\n140,400\n200,500\n", terrain=TABLE)
    plain = read("distance,elevation\n0,65\n200,70\n300,90\n400,140\n500,200\n", terrain=TABLE)
    assert swapped.warnings == plain.warnings
    assert swapped.content == plain.content


def test_a_profile_without_data_is_refused_before_it_is_run(refused):
    assert refused("distance,elevation\n0,200\n100,-9999\n200,90\n500,65\n", terrain=TABLE) == [
        "p.csv:3:5: elevation: expected an elevation, found -9999, which means no data; leave the row out"
    ]


def test_doubts_of_a_profile_are_told_at_the_key_that_names_it(warned):
    told = warned("distance,elevation\n100,200\n110,90\n700,65\n", terrain=TABLE)
    assert [line.partition(": p.csv: ")[0] for line in told] == 2 * ["f.yaml:2:33: terrain.file"]
    assert "distances begin at 100 m" in told[0]
    assert "steeper than 60 degrees, the steepest 84.8 degrees from distance 100 to 110 m" in told[1]


PROFILE = [(0, 260), (100, 200), (200, 140), (300, 90), (400, 70), (600, 65)]


def outcome(scenario, solve):
    """Summaries of the first run of a scenario."""
    runs = expand(scenario)
    prepared = build_scene(runs[0], share(scenario, runs))
    result = solve(prepared.scene, prepared.times, arrival_depth=prepared.threshold)
    x = prepared.scene.points.x_points
    bed = prepared.terrain.elevation(x), prepared.terrain.horizontal_distance(x)
    fields = prepared.scene.depth, result.deposit_depth, result.max_depth, result.max_speed
    return summarise(prepared.scene.points, *bed, *fields, prepared.threshold)


def test_a_profile_digitised_from_below_gives_the_run_out_of_its_mirror_image(read):
    from solver.simulation import simulate

    def written(rows):
        return "distance,elevation\n" + "".join(f"{d},{z}\n" for d, z in rows)

    turned = written((600 - d, z) for d, z in reversed(PROFILE))
    up = read(
        turned,
        terrain=TABLE,
        domain="{x: [0, 640], y: [-40, 40]}",
        release="{shape: box, x: [560, 600], y: [-15, 15], height: 2}",
    )
    length = build_scene(expand(up)[0], share(up, expand(up))).terrain.length
    box = f"{{shape: box, x: [{length - 600}, {length - 560}], y: [-15, 15], height: 2}}"
    down = read(
        written(PROFILE),
        terrain=TABLE,
        domain=f"{{x: [{length - 640}, {length}], y: [-40, 40]}}",
        release=box,
    )
    found, mirrored = outcome(up, simulate), outcome(down, simulate)
    # before: -399.8 m and 157 degrees
    assert (found["runout_distance"], found["reach_angle"]) == pytest.approx((427.8, 21.39), abs=0.05)
    for name in ("runout_distance", "drop_height", "reach_angle", "flow_runout_distance", "deposit_length"):
        assert found[name] == pytest.approx(mirrored[name], rel=1e-6), name
    assert found["front_x"] == pytest.approx(length - mirrored["front_x"])


@pytest.mark.parametrize(
    ("more", "expected"),
    [
        (
            "output: {fields: [deposit_depth]}\nreceptors: [{name: a, point: [150, 0]}]",
            [
                "leaves out max_depth, max_speed, arrival_time, without which receptors have no results",
                "leaves out all maxima, so that there is nothing to map",
            ],
        ),
        (
            "output: {fields: [max_depth, deposit_depth]}\nreceptors: [{name: a, point: [150, 0]}]",
            ["leaves out max_speed, arrival_time, without which receptors have no results"],
        ),
        (
            "output: {fields: [max_depth, deposit_depth]}\nhazard: {pressure: [10], momentum_flux: [5]}",
            ["leaves out max_speed, max_momentum_flux, which the maps asked for under hazard need"],
        ),
        ("output: {fields: [max_depth]}", ["leaves out deposit_depth, which a calibration needs"]),
        ("output: {fields: [max_depth, deposit_depth]}", []),
        ("receptors: [{name: a, point: [150, 0]}]", []),
    ],
)
def test_fields_that_later_commands_need_are_told(warned, more, expected):
    assert warned(more=more) == [f"f.yaml:8:18: output.fields: {line}" for line in expected]


ENDLESS = "and the flow goes on for"


@pytest.mark.parametrize(
    "changes",
    [
        {"terrain": "{profile: plane, angle: 30}"},
        {"terrain": "{profile: plane, angle: -30}"},
        {"terrain": "{profile: bend, angle: 40, start: 200, end: 300, runout_angle: 21}"},
        {
            "terrain": "{profile: segments, joint: 10, segments: [{start: 0, angle: 30}, {start: 200, angle: 25}]}"
        },
        {"terrain": TABLE, "table": "distance,elevation\n0,500\n200,400\n600,180\n"},
        {"friction": 0},
        {"friction": "10, turbulent_friction: 500", "terrain": "{profile: plane, angle: 30}"},
        {"more": "sweep: {material.bed_friction: [10, 30]}", "friction": 30},
        {"more": "sweep: {terrain.angle: [10, 30]}", "terrain": "{profile: plane, angle: 10}"},
    ],
)
def test_a_flow_that_does_not_end_is_told_at_once(refused, changes):
    (line,) = refused(domain="", end=1e6, **changes)
    assert ENDLESS in line
    assert "np." not in line


@pytest.mark.parametrize(
    "changes",
    [
        {"terrain": "{profile: bend, angle: 30, start: 200, end: 300}"},
        {"terrain": TABLE, "table": "distance,elevation\n0,500\n200,400\n600,390\n"},
        {"terrain": "{profile: plane, angle: 30}", "end": 20},
        {"friction": 30},
        {"terrain": "{profile: plane, angle: 30}", "domain": "{x: [0, 100], y: [-40, 40]}"},
    ],
)
def test_a_flow_that_ends_or_has_a_domain_is_not_refused(read, changes):
    read(**{"domain": "", "end": 1e6, **changes})


@pytest.mark.parametrize(
    ("shape", "part"),
    [
        ("point: [150, 0]", 1),
        ("point: [150, 41]", 0),
        ("line: [[150, -40], [150, 40]]", 1),
        ("line: [[150, -90], [150, 90]]", 0.5),
        ("line: [[150, -90], [150, -41]]", 0),
        ("line: [[-50, 0], [150, 90], [450, 0]]", 0.5),
        ("line: [[-90, 100], [-50, 0], [150, 300]]", 0),
        ("polygon: [[-10, -90], [900, -90], [900, 90], [-10, 90]]", 0.5),
        ("polygon: [[390, 30], [900, 30], [900, 90]]", 0.5),
        ("polygon: [[401, 30], [900, 30], [900, 90]]", 0),
    ],
)
def test_receptors_are_clipped_to_the_domain_or_refused_outside(read, refused, warned, shape, part):
    more = f"receptors: [{{name: road, {shape}}}]"
    bounds = "x [0, 400] and y [-40, 40]"
    if part == 0:
        (line,) = refused(more=more)
        assert line.startswith(f"f.yaml:8:13: receptors.0: expected places in the domain, {bounds}, found [")
    elif part == 1:
        assert warned(more=more) == []
    else:
        assert warned(more=more) == [
            f"f.yaml:8:13: receptors.0: sticks out of the domain, {bounds}; the part inside counts"
        ]


def test_the_part_of_a_line_outside_adds_no_cells():
    import xarray as xr

    from pipeline.assess.receptors import Cells
    from pipeline.settings.receptor import Receptor

    store = xr.Dataset(coords={"x": np.arange(0, 101, 10.0), "y": np.arange(-20, 21, 10.0)})
    within, beyond = (
        Cells(store).of(Receptor(name="road", line=((30.0, 0.0), (x, y)))) for x, y in ((30, 20), (30, 90))
    )
    assert within.tolist() == beyond.tolist()
    # before: the way along the upper side, whose nearest cells are those of the edge
    turned = Cells(store).of(Receptor(name="road", line=((30.0, 0.0), (30.0, 90.0), (90.0, 90.0))))
    assert turned.tolist() == within.tolist()


GROUND = "georeference: {{crs: 'EPSG:{}', origin: [{}, {}], azimuth: 90}}"


@pytest.mark.parametrize(
    ("crs", "message"),
    [
        ("99999", "crs: expected the code of a known reference system, found 'EPSG:99999'"),
        (
            "4326",
            "crs: expected a projected reference system with metres, found EPSG:4326, one that is not projected",
        ),
        (
            "2264",
            "crs: expected a projected reference system with metres, found EPSG:2264, one of US survey foot",
        ),
    ],
)
def test_a_reference_system_without_metres_is_told(refused, crs, message):
    pytest.importorskip("rasterio")
    assert refused(more=GROUND.format(crs, 2600000, 1200000)) == [f"f.yaml:8:21: georeference.{message}"]


MAP = "georeference: {crs: 'EPSG:2056', origin: [2600000, 1200000], azimuth: 120, receptors: map, releases: map}"
SLOPE = "distance,elevation\n" + "".join(f"{d},{z}\n" for d, z in PROFILE)


def on_map(x, y, slope):
    """Easting and northing by hand: along the azimuth, y to the left of it."""
    along, turn = float(slope.horizontal_distance(x)), np.radians(120)
    return (
        2600000 + along * np.sin(turn) - y * np.cos(turn),
        1200000 + along * np.cos(turn) + y * np.sin(turn),
    )


def test_releases_and_receptors_on_the_map_are_those_on_the_bed(read):
    from pipeline.scenario.scenario import stored

    bed = {"release": "{shape: cap, centre: [60, 5], radius: 15, height: 2}", "terrain": TABLE}
    lines = "receptors: [{name: a, point: [250, 10]}, {name: b, line: [[300, -30], [300, 30]]}]"
    plain = read(SLOPE, **bed, more=lines)
    slope = build_scene(expand(plain)[0], share(plain, expand(plain))).terrain
    e, n = on_map(60, 5, slope)
    (pe, pn), (e0, n0), (e1, n1) = (on_map(*place, slope) for place in ((250, 10), (300, -30), (300, 30)))
    lines = f"{MAP}\nreceptors: [{{name: a, point: [{pe}, {pn}]}}, {{name: b, line: [[{e0}, {n0}], [{e1}, {n1}]]}}]"
    placed = read(
        SLOPE, terrain=TABLE, release=f"{{shape: cap, centre: [{e}, {n}], radius: 15, height: 2}}", more=lines
    )
    assert placed.settings.release.centre == pytest.approx((60, 5), abs=1e-6)
    (release,) = releases(expand(placed)[0].settings)
    assert release.extent == pytest.approx((45, 75, -10, 20), abs=1e-6)
    assert placed.settings.receptors[0].point == pytest.approx((250, 10), abs=1e-6)
    assert np.array(placed.settings.receptors[1].line) == pytest.approx(
        np.array([[300, -30], [300, 30]]), abs=1e-6
    )
    assert placed.warnings == ()
    # a store has the text alone; its receptors come out on the bed all the same
    from pipeline.scenario.scenario import said

    assert stored({"title": "f", **said(placed)}).receptors == placed.settings.receptors


@pytest.mark.parametrize(
    ("changes", "message"),
    [
        ({}, "releases: expected bed, as a box has no centre and lies along the bed, found map"),
        (
            {"release": "{shape: cap, centre: [2600040, 1200000], radius: 15, height: 2}", "sweep": "release.centre.0: [2600040, 2600050]"},
            "releases: expected bed, as a centre is varied, found map",
        ),
        (
            {"release": "{shape: cap, centre: [2600040, 1200000], radius: 15, height: 2}", "sweep": "terrain.angle: [20, 21]"},
            "receptors: expected bed, as the terrain is varied, found map",
        ),
    ],
)  # fmt: skip
def test_what_has_no_single_place_on_the_bed_is_refused_on_the_map(refused, changes, message):
    sweep = changes.pop("sweep", None)
    more = MAP.replace("azimuth: 120", "azimuth: 90") + (f"\nsweep: {{{sweep}}}" if sweep else "")
    assert f"georeference.{message}" in "\n".join(refused(more=more, **changes))


def test_a_receptor_on_the_map_outside_the_domain_is_refused(refused):
    more = MAP.replace("releases: map", "releases: bed") + "\nreceptors: [{name: a, point: [100, 100]}]"
    (line,) = refused(more=more)
    assert line.startswith(
        "f.yaml:9:13: receptors.0: expected places in the domain, x [0, 400] and y [-40, 40], found ["
    )


@pytest.mark.parametrize("release", ["{shape: hemisphere, centre: [50, 0], radius: 1e200}", "{shape: cap, centre: [50, 0], radius: 1e-200, height: 1e-200}", "{shape: paraboloid, centre: [50, 0], radii: [1e300, 1e300], height: 1e300}"])  # fmt: skip
def test_sizes_that_cannot_be_computed_with_are_told(refused, release):
    assert "f.yaml:5:10: release: expected " in refused(release=release)[0]


def test_bounds_that_leave_nothing_of_a_distribution_are_told(warned):
    more = "sample: {count: 4, values: {release.volume: {distribution: normal, mean: 20, deviation: 0.62, lower: 25, upper: 40}}}"
    (line,) = warned(more=more)
    assert "sample.values.release.volume: its bounds hold 3.7e-16 of the distribution" in line
    assert warned(more=more.replace("lower: 25", "lower: 19")) == []


def test_validate_says_how_large_a_scenario_is(tmp_path):
    (tmp_path / "f.yaml").write_text(text())
    (tmp_path / "g.yaml").write_text(
        text(domain="", terrain="{profile: bend, angle: 30, start: 100, end: 140}").replace(
            "name: f", "name: g"
        )
    )
    result = pipeline("validate", tmp_path / "f.yaml", tmp_path / "g.yaml")
    first, second = result.stdout.splitlines()
    # 101 by 21 points; 8 frames of 3 fields of 8 bytes beside 210 bytes a point
    assert first.endswith(": f: 1 run, about 2,121 points, memory 1.01 MB a run, results 375 kB or less")
    assert second.endswith(": g: 1 run, points known once the domain is found")


def test_a_flow_beyond_its_profile_is_told_by_run_table_and_maps(tmp_path):
    """As well in a domain that was found as in a given one."""
    (tmp_path / "p.csv").write_text("distance,elevation\n0,100\n120,40\n160,35\n")
    changes = {
        "terrain": TABLE,
        "friction": 18,
        "release": "{shape: box, x: [20, 40], y: [-10, 10], height: 2}",
    }
    shutil.copy(tmp_path / "p.csv", tmp_path / "q.csv")
    for name, domain in (("given", "{x: [0, 240], y: [-40, 40]}"), ("found", "")):
        (tmp_path / f"{name}.yaml").write_text(
            text(domain=domain, **changes).replace("name: f", f"name: {name}")
        )
    out = tmp_path / "out"
    result = pipeline("run", tmp_path / "given.yaml", tmp_path / "found.yaml", "--out", out, "--workers", "1")
    assert result.exit_code == 0, result.stderr
    for name in ("given", "found"):
        assert f"{name}: 1 run; flow beyond the surveyed profile in 1" in result.stdout
    assert "found: flow beyond the profile, which covers x from 0 to" in result.stdout
    table = pd.read_csv(out / "summary.csv")
    assert table["warning"].str.startswith("flow beyond the profile, which covers x from 0 to 174").all()
    assert table["warning"].str.endswith("m below its end, where the end slopes go on").all()
    mapped = pipeline("hazard", out, "--no-maps")
    assert mapped.stdout.count("; flow beyond the surveyed profile in 1") >= 2


def test_a_shapefile_without_its_prj_is_told_by_name(tmp_path):
    pytest.importorskip("pyogrio")
    import pyogrio.raw
    import shapely
    import xarray as xr

    from pipeline.assess.observed import ObservationError
    from pipeline.assess.observed import read as read_observed

    path = tmp_path / "deposit.shp"
    shape = shapely.to_wkb(shapely.box(2600100, 1199990, 2600200, 1200010))
    pyogrio.raw.write(path, np.array([shape], object), [], [], crs="EPSG:2056", geometry_type="Polygon")
    ground = "georeference: {crs: 'EPSG:2056', origin: [2600000, 1200000], azimuth: 90}"
    store = xr.Dataset(
        coords={"x": np.arange(0, 301, 10.0), "y": np.arange(-20, 21, 10.0)},
        attrs={"title": "f", "scenario": text(more=ground)},
    )
    store = store.assign_coords(horizontal_distance=("x", store["x"].to_numpy()))
    assert read_observed(path, store, 0.1).covered.any()
    path.with_suffix(".prj").unlink()
    with pytest.raises(ObservationError) as caught:
        read_observed(path, store, 0.1)
    assert str(caught.value) == (
        f"{path}: expected polygons with a reference system, found none: deposit.prj is missing beside it"
    )


@pytest.mark.parametrize(
    ("data", "found"),
    [
        (b"x;y\n1;2\n3;4\n", "found semicolons; save it as CSV"),
        (b"x;y\n1,5;2,5\n3,5;4,5\n", "found semicolons and decimal commas; save it as CSV"),
        (b"x\ty\n1\t2\n", "found tabs; save it as CSV"),
        (b"PK\3\4" + bytes(40), "found a spreadsheet or another zipped file; save the sheet as CSV"),
    ],
)
def test_points_and_observations_of_another_kind_are_told_as_such(tmp_path, data, found):
    import xarray as xr

    from pipeline.assess.observed import ObservationError
    from pipeline.assess.observed import read as read_observed
    from pipeline.inputs.point_file import read as read_points

    path = tmp_path / "p.csv"
    path.write_bytes(data)
    with pytest.raises(BadInput) as caught:
        read_points(path)
    assert found in str(caught.value)
    store = xr.Dataset(coords={"x": np.arange(0, 31, 10.0), "y": np.arange(-20, 21, 10.0)})
    with pytest.raises(ObservationError) as told:
        read_observed(path, store, 0.1)
    assert found in str(told.value)


@pytest.mark.parametrize(
    ("written", "points"),
    [
        ("x,y\n1,2\n3,4\n5,7\n", [[1, 2], [3, 4], [5, 7]]),
        ("y (m),id,X [m]\n2,a,1\n4,b,3\n7,c,5\n", [[1, 2], [3, 4], [5, 7]]),
        ("x_ft,y_ft\n10,20\n", [[3.048, 6.096]]),
    ],
)
def test_points_are_read_by_their_headings_and_units(tmp_path, written, points):
    from pipeline.inputs.point_file import read as read_points

    (tmp_path / "p.csv").write_text(written)
    assert read_points(tmp_path / "p.csv").points == pytest.approx(np.array(points))


@pytest.mark.parametrize(
    ("rows", "place", "found"), [("1,2,9\n3,4,9\n", "2:1", "more"), ("1,2\n3,4,9\n", "3:1", "3")]
)
def test_rows_with_more_values_than_headings_do_not_shift_points(tmp_path, rows, place, found):
    from pipeline.inputs.point_file import read as read_points

    (tmp_path / "p.csv").write_text(f"x,y\n{rows}")
    with pytest.raises(BadInput) as caught:
        read_points(tmp_path / "p.csv")
    wanted = "expected 2 values a line, one a heading"
    assert str(caught.value).endswith(
        f"p.csv:{place}: {wanted}, found {found}; decimals take a point, not a comma"
    )
