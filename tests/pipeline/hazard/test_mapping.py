import shutil
import subprocess
import sys
from functools import partial

import numpy as np
import pytest
import xarray as xr
from batches import run
from stores import POINTS, SCATTERED, store_of
from stub_solvers import FAILS, OVERRUNS, RAISES, by_friction
from typer.testing import CliRunner

from pipeline.assess import ensemble as ensembles
from pipeline.assess.ensemble import NotTogetherError, counts, ensemble, together
from pipeline.assess.probability import BOUNDS, quantiles
from pipeline.assess.receptors import reached
from pipeline.cli.app import app
from pipeline.hazard.intensity import UNKNOWN
from pipeline.hazard.layers import layers
from pipeline.hazard.mapping import map_hazard, nowhere
from pipeline.hazard.netcdf import FILE, write
from pipeline.settings.hazard import Hazard, Intensity
from pipeline.store.variables import Status

DROP, GRAVITY = 50.0, 9.81
STEEPEST, FLATTEST = np.tan(np.radians([30.0, 20.0]))
DISTANCE = np.linspace(1, 150, 60)


def store(depth, speed=None, status=None, weight=None, return_period=None, **more):
    """Make a store of runs over one row of cells: maxima of shape (runs, cells)."""
    depth = np.asarray(depth, np.float32)
    speed = np.zeros_like(depth) if speed is None else np.asarray(speed, np.float32)
    runs, cells = depth.shape
    dims = ("run", "y", "x")
    on_run = {"weight": weight, "return_period": return_period}
    return xr.Dataset(
        {
            "max_depth": (dims, depth[:, None]),
            "max_speed": (dims, speed[:, None]),
            "arrival_time": (dims, np.where(depth > 0, 1.0 + np.arange(cells), np.nan)[:, None]),
            "status": ("run", np.ones(runs, np.int8) if status is None else np.asarray(status, np.int8)),
        },
        coords={
            "x": ("x", np.arange(float(cells))),
            "y": ("y", [0.0]),
            "elevation": ("x", -np.arange(float(cells))),
            "horizontal_distance": ("x", np.arange(float(cells))),
            **{name: ("run", np.asarray(v, float)) for name, v in on_run.items() if v is not None},
        },
        attrs={"title": "made", **more},
    )


def mapped(*arguments, settings=None, **options):
    return map_hazard(ensemble(store(*arguments, **options)), settings or Hazard())


def sliding_blocks(count):
    """Let a block fall from a height and slide on the flat; its friction is even in its coefficient.

    Its speed squared after a distance x is 2 g (H - mu x), which gives every probability in closed form.
    """
    friction = FLATTEST + (STEEPEST - FLATTEST) * (np.arange(count) + 0.5) / count
    height = DROP - friction[:, None] * DISTANCE
    return np.where(height > 0, 1.5, 0), np.sqrt(2 * GRAVITY * np.maximum(height, 0))


def share_below(friction):
    return np.clip((friction - FLATTEST) / (STEEPEST - FLATTEST), 0, 1)


class TestABlockSlidingWithARandomFriction:
    COUNT = 1000
    LIMIT = 12.0
    REACHED = share_below(DROP / DISTANCE)
    FASTER = share_below((DROP - LIMIT**2 / (2 * GRAVITY)) / DISTANCE)
    ASKED = Hazard(depth=(1.0,), speed=(LIMIT,), pressure=(2 * LIMIT**2,))

    def test_probabilities_are_those_of_the_closed_form(self):
        found = mapped(*sliding_blocks(self.COUNT), settings=self.ASKED).squeeze()
        assert ((self.REACHED > 0.1) & (self.REACHED < 0.9)).sum() > 10
        for name, exact in (
            ("depth_exceedance", self.REACHED),
            ("speed_exceedance", self.FASTER),
            ("pressure_exceedance", self.FASTER),
            ("arrival_share", self.REACHED),
        ):
            for bound in ("", "_lower", "_upper"):
                np.testing.assert_allclose(found[name + bound], exact, atol=0.51 / self.COUNT, err_msg=name)
        assert found.attrs["comment"] == "1000 of 1000 runs done"

    def test_bounds_hold_the_closed_form_where_runs_are_missing(self):
        status = np.ones(self.COUNT)
        status[100::500], status[200::500], status[300::250] = Status.FAILED, Status.PENDING, Status.OVERRUN
        depth, speed = sliding_blocks(self.COUNT)
        depth[status == Status.FAILED] = np.nan
        found = mapped(depth, speed, status, settings=self.ASKED).squeeze()
        sure, overrun = status == Status.DONE, status == Status.OVERRUN
        lower = (depth[sure | overrun] > 1).sum(axis=0) / self.COUNT
        upper = lower + (4 + (depth[overrun] <= 1).sum(axis=0)) / self.COUNT
        np.testing.assert_allclose(found["depth_exceedance_lower"], lower, atol=1e-6)
        np.testing.assert_allclose(found["depth_exceedance_upper"], upper, atol=1e-6)
        known = (depth[sure | overrun] > 1).mean(axis=0)
        np.testing.assert_allclose(found["depth_exceedance"], known, atol=1e-6)
        assert (found["depth_exceedance_lower"] <= self.REACHED + 0.51 / self.COUNT).all()
        assert (found["depth_exceedance_upper"] >= self.REACHED - 0.51 / self.COUNT).all()
        assert found.attrs["comment"] == "996 of 1000 runs done (3 of them overrun, 2 failed, 2 pending)"

    def test_weights_stand_for_runs(self):
        """Half the runs, those of low friction twice as likely."""
        depth, speed = sliding_blocks(self.COUNT)
        twice = np.where(np.arange(self.COUNT) < self.COUNT // 2, 2.0, 1.0)
        found = mapped(depth, speed, weight=twice, settings=self.ASKED).squeeze()
        expected = np.where(self.REACHED < 0.5, self.REACHED * 4 / 3, 2 / 3 + (self.REACHED - 0.5) * 2 / 3)
        np.testing.assert_allclose(found["depth_exceedance"], expected, atol=2 / self.COUNT)

    def test_speed_quantiles_are_those_of_the_closed_form(self):
        found = mapped(*sliding_blocks(self.COUNT), settings=self.ASKED)["speed_quantile"].squeeze()
        for level in (0.5, 0.9):
            # the fast runs are those of low friction
            friction = STEEPEST - level * (STEEPEST - FLATTEST)
            exact = 2 * GRAVITY * np.maximum(DROP - friction * DISTANCE, 0)
            slack = 2 * GRAVITY * DISTANCE * (STEEPEST - FLATTEST) / self.COUNT
            assert (np.abs(found.sel(quantile=level) ** 2 - exact) <= slack + 1e-3).all()


def test_a_batch_with_failed_and_overrun_runs_has_the_right_bounds(scenario_file, out, log, shared_workers):
    file = scenario_file(20, 21, RAISES, FAILS, OVERRUNS)
    run(out, file, solve=partial(by_friction, log=log))
    shown = CliRunner().invoke(app, ["hazard", str(out), "--depth", "0.4,0.6"])
    assert shown.exit_code == 0, shown.output
    assert "box: 3 of 5 runs done (1 of them overrun, 2 failed)" in shown.stdout
    with xr.open_dataset(out / "hazard" / "box" / FILE) as found:
        inside, outside = (found.sel(x=x, y=0) for x in (2, 8))
        bounds = [f"depth_exceedance{bound}" for bound in ("_lower", "", "_upper")]
        for where, threshold, expected in (
            (inside, 0.4, (0.6, 1, 1)),
            (inside, 0.6, (0, 0, 0.6)),
            (outside, 0.4, (0, 0, 0.6)),
        ):
            held = [float(where[name].sel(depth_threshold=threshold)) for name in bounds]
            assert held == pytest.approx(expected, abs=1e-6)
        assert found["depth_exceedance"].attrs["units"] == "1"
        assert (found.attrs["runs_planned"], found.attrs["runs_done"]) == (5, 3)
        assert found["intensity"].attrs["flag_meanings"] == "none weak medium strong"


def test_no_run_at_all_says_nothing_and_not_dry():
    found = mapped(np.full((2, 3), np.nan), status=[Status.FAILED, Status.PENDING])
    assert found["depth_exceedance"].isnull().all()
    assert (found["depth_exceedance_lower"] == 0).all()
    assert (found["depth_exceedance_upper"] == 1).all()
    assert found["depth_quantile"].isnull().all()
    assert (found["intensity"] == UNKNOWN).all()
    assert (found["intensity_upper"] == 3).all()


def test_a_missing_value_of_a_run_that_was_done_is_unknown():
    found = mapped([[2.0, np.nan], [0.0, 2.0]], settings=Hazard(depth=(1.0,))).squeeze()
    assert found["depth_exceedance"].values.tolist() == [0.5, 1]
    assert found["depth_exceedance_lower"].values.tolist() == [0.5, 0.5]
    assert found["depth_exceedance_upper"].values.tolist() == [0.5, 1]


def test_times_of_arrival_are_means_over_the_runs_that_arrive():
    held = store([[1, 1], [1, 0], [1, 0]], status=[1, 1, 2], weight=[0.25, 0.5, 0.25])
    held["arrival_time"][:, 0] = [[4, 8], [1, np.nan], [99, 99]]
    found = map_hazard(ensemble(held), Hazard()).squeeze()
    assert found["arrival_time"].values.tolist() == [2, 8]
    np.testing.assert_allclose(found["arrival_share"], [1, 1 / 3], rtol=1e-6)


@pytest.mark.parametrize("weights", ["equal", "whole"])
def test_quantiles_are_those_of_the_runs_repeated(weights):
    random = np.random.default_rng(3)
    values = random.random((40, 7)).astype(np.float32)
    count = np.ones(40, int) if weights == "equal" else random.integers(0, 5, 40)
    runs = ensemble(store(values, weight=count))
    found = quantiles(runs["max_depth"], [0.1, 0.5, 0.9, 1.0], runs)
    repeated = np.repeat(values, count, axis=0)
    expected = np.quantile(repeated, [0.1, 0.5, 0.9, 1.0], axis=0, method="inverted_cdf")
    for bound in BOUNDS:
        np.testing.assert_array_equal(found[bound].squeeze("y"), expected)


class TestIntensity:
    DEPTH = (0, 0.5, 1, 1.5, 1.5, 0)
    SPEED = (9, 9, 9, 1, 1.5, 0)

    def test_follows_the_swiss_matrix_for_debris_flows(self):
        found = mapped([self.DEPTH], [self.SPEED]).squeeze()
        assert found["intensity"].values.tolist() == [0, 2, 2, 2, 3, 0]
        assert "BUWAL" in found.attrs["intensity_source"]

    def test_follows_a_matrix_of_ones_own(self):
        own = Intensity(depth=(0.7, 1.2), speed=(0, 2), classes=((1, 2), (2, 3)), source="mine")
        found = mapped([self.DEPTH], [self.SPEED], settings=Hazard(intensity=own)).squeeze()
        assert found["intensity"].values.tolist() == [0, 0, 2, 2, 2, 0]
        assert found.attrs["intensity_source"] == "mine"

    def test_is_what_the_asked_share_of_runs_reaches(self):
        depth, speed = [[2.0], [2.0], [0.5], [0.0]], [[2.0], [2.0], [0.5], [0.0]]
        classes = {
            share: mapped(depth, speed, settings=Hazard(share=share))["intensity"].item()
            for share in (0.5, 0.75, 0.9)
        }
        assert classes == {0.5: 3, 0.75: 2, 0.9: 0}

    def test_has_bounds(self):
        depth, speed = [[2.0], [2.0], [np.nan], [np.nan]], [[2.0], [2.0], [np.nan], [np.nan]]
        found = mapped(depth, speed, [1, 1, 2, 2], settings=Hazard(share=0.75))
        assert [found[f"intensity{bound}"].item() for bound in ("_lower", "", "_upper")] == [0, 3, 3]

    def test_makes_levels_with_return_periods(self):
        depth = [[0.0, 0.5, 0.0, 0.0], [2.0, 0.5, 0.5, 0.0], [2.0, 0.5, 2.0, 0.0], [2.0, 2.0, 2.0, 2.0]]
        found = mapped(depth, depth, return_period=[30, 100, 300, 1000]).squeeze()
        assert found["hazard_level"].values.tolist() == [4, 4, 4, 1]
        medium = mapped([[0.5], [0.5]], [[0.5], [0.5]], return_period=[100, 300])
        assert medium["hazard_level"].item() == 3
        assert "hazard_level" not in mapped(depth, depth)

    def test_levels_that_a_missing_run_cannot_change_are_known(self):
        found = mapped([[2.0, 0.0], [np.nan] * 2], [[2.0, 0.0]] * 2, [1, 2], return_period=[30, 1000])
        assert found["hazard_level"].values.ravel().tolist() == [4, UNKNOWN]

    def test_shares_are_of_events_with_return_periods(self):
        depth = [[0.5], [0.0]]
        counted = {
            word: [layer.title for layer in layers(mapped(depth, depth, return_period=periods))]
            for word, periods in (("events", [30, 100]), ("runs", None))
        }
        for word, other in (("events", "runs"), ("runs", "events")):
            shares = [title for title in counted[word] if title.startswith("share of")]
            assert shares
            assert all(title.startswith(f"share of {word} ") for title in shares)
            assert not any(f"share of {other}" in title for title in counted[word])

    def test_levels_of_a_return_period_without_runs_are_unknown_with_bounds(self):
        found = mapped([[0.5], [np.nan]], [[0.5], [np.nan]], [1, 2], return_period=[100, 300])
        assert [found[f"hazard_level{bound}"].item() for bound in ("_lower", "", "_upper")] == [3, UNKNOWN, 4]


class TestScenariosTogether:
    def test_have_equal_weights(self):
        many, few = ensemble(store([[2.0]] * 3)), ensemble(store([[0.0]]))
        found = map_hazard(together({"many": many, "few": few}), Hazard(depth=(1.0,)))
        assert found["depth_exceedance"].item() == pytest.approx(0.5)
        assert found.attrs["runs_planned"] == 4

    def test_have_the_frequencies_of_their_return_periods(self):
        held = {
            str(years): ensemble(store([[depth], [0.0]], return_period=[years, years]))
            for years, depth in ((30, 0.0), (100, 0.0), (300, 2.0))
        }
        weights = together(held)["weight"].to_numpy()
        np.testing.assert_allclose(weights, np.repeat([0.7, 0.2, 0.1], 2) / 2, rtol=1e-12)

    @pytest.mark.parametrize(
        ("other", "word"),
        [
            (store([[1.0, 1.0]]), "differ in x"),
            (store([[1.0]]).assign_coords(elevation=("x", [5.0])), "differ in elevation"),
            (store([[1.0]], return_period=[30]), "only one of"),
        ],
    )
    def test_are_refused_where_they_do_not_fit(self, other, word):
        with pytest.raises(NotTogetherError, match=word):
            together({"one": ensemble(store([[1.0]])), "other": ensemble(other)})


def test_weights_that_are_none_are_refused():
    with pytest.raises(ValueError, match="weights of at least 0"):
        ensemble(store([[1.0], [1.0]], weight=[0, 0]))


def test_a_cloud_is_mapped_on_a_lattice(scenario_file, tmp_path):
    file = scenario_file(20, 22, replace=(POINTS, SCATTERED))
    store_of(file, tmp_path).close()
    shown = CliRunner().invoke(app, ["hazard", str(tmp_path), "--depth", "0.1", "--spacing", "0.25"])
    assert shown.exit_code == 0, shown.output
    with xr.open_dataset(tmp_path / "hazard" / "box" / FILE) as found:
        assert dict(found.sizes) | {"y": 17, "x": 41} == dict(found.sizes)
        assert found["depth_exceedance"].sel(x=2, y=0).item() == 1
        assert found["depth_exceedance"].sel(x=9, y=0).item() == 0


@pytest.mark.parametrize(
    ("arguments", "word"),
    [(["--depth", "1,x"], "--depth: expected numbers above 0"), (["--spacing", "-1"], "--spacing: expected")],
)
def test_wrong_options_are_told(tmp_path, arguments, word):
    shown = CliRunner().invoke(app, ["hazard", str(tmp_path), *arguments])
    assert shown.exit_code == 2
    assert word in shown.stderr


def test_a_place_without_stores_is_told(tmp_path):
    shown = CliRunner().invoke(app, ["hazard", str(tmp_path)])
    assert (shown.exit_code, shown.stderr) == (2, f"no results in {tmp_path}\n")


@pytest.mark.skipif(shutil.which("ncdump") is None, reason="ncdump is not installed (netcdf-bin)")
def test_ncdump_reads_the_file(tmp_path):
    path = write(mapped([[1.0, 2.0]], return_period=[30]), tmp_path)
    shown = subprocess.run(["ncdump", path], capture_output=True, text=True, check=True).stdout
    assert 'depth_exceedance:units = "1" ;' in shown
    assert 'hazard_level:flag_meanings = "none residual low medium high" ;' in shown
    assert 'comment = "1 of 1 run done"' in shown


def test_counts_say_what_became_of_runs():
    assert str(counts(store([[1.0]] * 4, status=[1, 1, 1, 1]))) == "4 of 4 runs done"
    assert ensembles.Counts(0, 0, 1, 0).attributes == {
        "runs_planned": 1,
        "runs_done": 0,
        "runs_overrun": 0,
        "runs_failed": 1,
        "runs_pending": 0,
        "runs_cut_off": 0,
    }
    states = [Status.DONE, Status.OVERRUN, Status.CUT_OFF, Status.OVERRUN_AND_CUT_OFF, Status.FAILED]
    some = counts(store([[1.0]] * 5, status=states))
    assert str(some) == "2 of 5 runs done (2 overrun, 2 still moving at time.end, 1 failed)"
    assert (some.planned, some.computed) == (5, 4)


MEMORY = """
import dask.array as da, numpy as np, xarray as xr
from pipeline.assess.ensemble import ensemble
from pipeline.hazard.mapping import map_hazard, nowhere
from pipeline.settings.hazard import Hazard

RUNS, PER_CHUNK, SHAPE = 1000, 50, (150, 300)


def made(block_info):
    place = block_info[None]
    random = np.random.default_rng(place["array-location"][0])
    return random.random(place["chunk-shape"], dtype=np.float32)


chunks = ((PER_CHUNK,) * (RUNS // PER_CHUNK), *((n,) for n in SHAPE))
depth = da.map_blocks(made, chunks=chunks, dtype=np.float32, meta=np.empty((0, 0, 0), np.float32))
store = xr.Dataset(
    {"max_depth": (("run", "y", "x"), depth), "status": ("run", np.ones(RUNS, np.int8))},
    coords={"x": np.arange(300.0), "y": np.arange(150.0)},
)
found = map_hazard(ensemble(store), Hazard(depth=(0.25, 0.75)))
assert abs(float(found["depth_exceedance"][0].mean()) - 0.75) < 1e-3
assert abs(float(found["depth_quantile"][1].mean()) - 0.9) < 1e-2
# that of a resource usage may be the parent's, from before this began
print(next(line.split()[1] for line in open("/proc/self/status") if line.startswith("VmHWM")))
"""


def test_a_thousand_runs_take_less_than_a_gibibyte():
    shown = subprocess.run([sys.executable, "-c", MEMORY], capture_output=True, text=True, check=False)
    assert shown.returncode == 0, shown.stderr
    assert int(shown.stdout) * 1024 < 2**30


def test_what_is_mapped_may_change_without_a_new_run(scenario_file, out, log, shared_workers):
    solve = partial(by_friction, log=log)
    run(out, scenario_file(20), solve=solve)
    run(out, scenario_file(20, more="hazard: {depth: [0.4], density: 1800}\n"), solve=solve)
    assert log.read_text().split() == ["20"]
    assert CliRunner().invoke(app, ["hazard", str(out)]).exit_code == 0
    with xr.open_dataset(out / "hazard" / "box" / FILE) as found:
        assert found["depth_threshold"].values.tolist() == [0.4]
        assert found.attrs["density"] == 1800


def test_thresholds_that_nothing_exceeds_are_named():
    depth = [[0.4, 1.5, 0.0], [0.2, 2.5, 0.0]]
    found = mapped(depth, np.full((2, 3), 3.0), settings=Hazard(depth=(1, 2, 2.6, 9), speed=(1, 2)))
    assert nowhere(found) == ["no computed run has a largest depth above 2.6, 9 m anywhere"]
    assert nowhere(mapped(depth, settings=Hazard(depth=(1,), speed=(1,)))) == [
        "no computed run has a largest speed above 1 m s-1 anywhere"
    ]


HEAVY = """\
name: heavy
terrain: {{profile: plane, angle: 15}}
domain: {{x: [0, 2], y: [0, 2]}}
points: {{spacing: 1}}
release: {{shape: box, x: [0, 1], y: [0, 1], height: 1}}
material: {{bed_friction: 20, earth_pressure: isotropic{density}}}
receptors: [{{name: house, point: [0, 0]}}]
{more}
"""


@pytest.mark.parametrize(
    ("density", "more", "pressures", "told"),
    [
        ("", "", [200, 200], 2000),
        (", density: 1800", "", [180, 180], 1800),
        (", density: 1800", "hazard: {density: 1000}", [100, 100], 1000),
        (", density: 1800", "sweep: {material.density: [1500, 2500]}", [150, 250], "1500 to 2500"),
    ],
)
def test_pressure_has_the_density_of_the_material_of_its_run(density, more, pressures, told):
    held = store(np.ones((2, 2)), np.full((2, 2), 10.0), scenario=HEAVY.format(density=density, more=more))
    if "sweep" in more:
        held = held.assign_coords(density=("run", [1500.0, 2500.0], {"key": "material.density"}))
    found = map_hazard(ensemble(held), Hazard(pressure=(160.0,), quantiles=(0.5, 1.0))).isel(x=0).squeeze()
    assert float(found["pressure_exceedance"]) == np.mean(np.array(pressures) > 160)
    assert found["pressure_quantile"].values.tolist() == pressures
    assert found.attrs["density"] == told
    wide = xr.concat([held, held.assign_coords(y=[1.0])], "y", data_vars="minimal")
    assert reached(wide)["max_pressure"].tolist() == pressures
