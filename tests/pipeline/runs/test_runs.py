import pickle

import numpy as np
import pytest

from pipeline.runs.runs import expand, share
from pipeline.runs.scene_of_run import build_scene, output_times
from pipeline.scenario.scenario import load
from pipeline.scenario.sweep import coordinate_names
from solver.physics.earth_pressure import Isotropic, MohrCoulomb
from solver.physics.friction import Coulomb, Voellmy
from solver.physics.terrain import Bend, Segment, Segments
from solver.physics.terrain_table import Table


@pytest.fixture
def scenario(scenario_file):
    def make(*replace, more=""):
        return load([scenario_file(replace=replace or ("", ""), more=more)])[0]

    return make


@pytest.fixture
def runs(scenario):
    return lambda *replace, more="": expand(scenario(*replace, more=more))


@pytest.fixture
def built(scenario):
    """Build the scene of a scenario's first run."""

    def make(*replace, more=""):
        loaded = scenario(*replace, more=more)
        runs = expand(loaded)
        return build_scene(runs[0], share(loaded, runs))

    return make


def test_a_scenario_without_a_sweep_is_one_run(runs):
    (run,) = runs()
    assert (run.index, run.parameters, run.table) == (0, {}, None)


def test_runs_are_the_product_of_all_lists_the_last_varying_fastest(runs):
    made = runs(more="sweep:\n  material.bed_friction: [26, 30]\n  release.volume: [6.6, 13.26, 1]\n")
    assert [run.index for run in made] == list(range(6))
    assert [tuple(run.parameters.items()) for run in made][:4] == [
        (("bed_friction", 26.0), ("volume", 6.6)),
        (("bed_friction", 26.0), ("volume", 13.26)),
        (("bed_friction", 26.0), ("volume", 1.0)),
        (("bed_friction", 30.0), ("volume", 6.6)),
    ]
    assert [(run.settings.material.bed_friction, run.settings.release.volume) for run in made] == [
        tuple(run.parameters.values()) for run in made
    ]
    assert not any(run.settings.sweep for run in made)


def test_sections_that_are_left_out_and_items_of_lists_can_be_swept(runs):
    made = runs(more="sweep: {boundaries.x_min: [wall, open], scheme.cfl: [0.4, 0.5], release.y.1: [1, 2]}\n")
    last = made[-1].settings
    assert (last.boundaries.x_min, last.scheme.cfl, last.release.y) == ("open", 0.5, (-1.0, 2.0))
    assert list(made[0].parameters) == ["x_min", "cfl", "release_y_1"]


@pytest.mark.parametrize(
    ("keys", "names"),
    [
        (["material.bed_friction", "release.volume"], ["bed_friction", "volume"]),
        (["release.0.volume", "release.1.volume"], ["release_0_volume", "release_1_volume"]),
        (["release.0.volume"], ["volume"]),
        (["release.centre.0"], ["release_centre_0"]),
        (["boundaries.x_min.depth"], ["boundaries_x_min_depth"]),
        (["gravity"], ["gravity"]),
    ],
)
def test_a_coordinate_is_named_by_the_last_part_of_its_key_unless_that_is_taken(keys, names):
    assert list(coordinate_names(keys).values()) == names


@pytest.mark.parametrize(
    ("time", "expected"),
    [
        ("{end: 24, output_every: 3}", [0, 3, 6, 9, 12, 15, 18, 21, 24]),
        ("{end: 1, output_every: 0.4}", [0, 0.4, 0.8, 1]),
        ("{end: 0.3, output_every: 0.1}", [0, 0.1, 0.2, 0.3]),
        ("{end: 2, output_every: 2}", [0, 2]),
        ("{end: 5}", [0, 0.5, 1, 1.5, 2, 2.5, 3, 3.5, 4, 4.5, 5]),
    ],
)
def test_output_times_run_from_zero_to_the_end(runs, time, expected):
    (run,) = runs("{end: 1, output_every: 0.5}", time)
    times = output_times(run.settings)
    np.testing.assert_allclose(times, expected, rtol=1e-15)
    assert times[-1] == run.settings.time.end


def test_a_scene_holds_what_its_settings_say(built):
    made = built(more="gravity: 2.5\nboundaries: {x_min: wall, x_max: {depth: 0.3}, y_min: no-slip}\n"
                 "scheme: {cfl: 0.5, wet_limit: 1e-3}\noutput: {threshold: 0.02}\n")  # fmt: skip
    scene = made.scene
    assert scene.points.shape == scene.depth.shape == (9, 21)
    assert (scene.gravity, scene.scheme.cfl, scene.scheme.wet_limit) == (2.5, 0.5, 1e-3)
    sides = scene.boundaries
    assert (sides.x_min, sides.x_max, sides.y_min, sides.y_max) == ("wall", 0.3, "no-slip", "open")
    assert scene.friction == Coulomb(25)
    assert scene.earth_pressure == Isotropic()
    assert np.degrees(scene.terrain.inclination(0.0)) == pytest.approx(30)
    assert made.threshold == 0.02
    assert made.stop_at_rest is True
    assert (made.volume_asked, made.volume_lost) == (2.0, 0.0)
    assert made.volume_laid == pytest.approx(2.0)


def test_the_threshold_is_a_hundredth_of_the_largest_release_depth(built):
    assert built().threshold == pytest.approx(0.005)


@pytest.mark.parametrize(
    ("material", "friction", "pressure"),
    [
        ("{bed_friction: 20, internal_friction: 30}", Coulomb(20), MohrCoulomb(30, 20)),
        (
            "{bed_friction: 20, turbulent_friction: 500, earth_pressure: isotropic}",
            Voellmy(20, 500),
            Isotropic(),
        ),
    ],
)
def test_a_material_gives_its_laws(built, material, friction, pressure):
    scene = built("{bed_friction: 25, earth_pressure: isotropic}", material).scene
    assert (scene.friction, scene.earth_pressure) == (friction, pressure)


@pytest.mark.parametrize(
    ("settings", "terrain"),
    [
        ("{profile: bend, angle: 35, start: 2, end: 4, runout_angle: 3, transition: quadratic}",
         Bend(35, 2, 4, 3, "quadratic")),
        ("{profile: segments, segments: [{start: 0, angle: 30}, {start: 5, angle: 10}], joint: 2}",
         Segments((Segment(0, 30), Segment(5, 10)), 2)),
    ],
)  # fmt: skip
def test_a_terrain_gives_its_profile(built, settings, terrain):
    assert built("{profile: plane, angle: 30}", settings).terrain == terrain


def test_runs_over_tables_carry_each_its_own_and_pickle(scenario_file, tmp_path):
    for name, drop in (("low", 1), ("high", 4)):
        (tmp_path / f"{name}.csv").write_text(f"d,z\n0,{drop}\n20,0\n")
    path = scenario_file(
        replace=("{profile: plane, angle: 30}", "{profile: table, file: low.csv, smoothing: 1}"),
        more="sweep: {terrain.file: [low.csv, high.csv]}\n",
    )
    loaded = load([path])[0]
    made = pickle.loads(pickle.dumps(expand(loaded)))
    assert [run.parameters["file"] for run in made] == ["low.csv", "high.csv"]
    terrains = [build_scene(run, share(loaded, made)).terrain for run in made]
    assert all(isinstance(terrain, Table) for terrain in terrains)
    assert [float(terrain.elevation(0.0)) for terrain in terrains] == [1, 4]


def test_releases_of_a_list_add_up(built):
    box, cap = (
        "{shape: box, x: [1, 3], y: [-1, 1], height: 0.5}",
        "{shape: cap, centre: [6, 0], radius: 1, height: 1}",
    )
    assert built(box, f"[{box}, {cap}]").volume_asked == pytest.approx(2 + 2 / 3 * np.pi)
