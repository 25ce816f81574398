import pandas as pd
import pytest
from catalogue import SCENARIOS

from pipeline.scenario.scenario import load
from pipeline.store.zarr_store import open_store
from solver.verification.exact_solutions import DamBreak, TravellingShock, cell_means

NAMES = [path.stem for path in SCENARIOS]
CLOUDS = ("chute-graded", "chute-irregular")


@pytest.fixture
def opened(shipped):
    return lambda name: open_store(shipped.out / f"{name}.zarr")


def test_each_file_is_named_as_its_scenario():
    assert [scenario.name for scenario in load(SCENARIOS)] == NAMES


# exact cases and the paper's chute end at the times they are compared at
CUT_OFF = {
    *("cap-frictionless", "dam-break", "shock"),
    *("chute", "chute-graded", "chute-irregular", "chute-printed", "chute-sweep"),
}


def test_every_run_is_computed_without_a_warning_and_hazard_examples_come_to_rest(shipped):
    assert shipped.shown.returncode == 0, shipped.shown.stdout + shipped.shown.stderr
    assert shipped.shown.stderr == ""
    table = pd.read_csv(shipped.out / "summary.csv")
    assert set(table["scenario"]) == set(NAMES)
    assert set(table["status"]) == {"done", "cut_off"}
    assert set(table["scenario"][table["status"] == "cut_off"]) == CUT_OFF
    assert "shock: 1 of 1 runs still moved at time.end (8 s)" in shipped.shown.stdout


def test_volume_is_kept_to_round_off(shipped):
    table = pd.read_csv(shipped.out / "summary.csv")
    assert table["volume_error"].abs().max() <= 1e-12
    assert (table["volume_lost"] == 0).all()


@pytest.mark.parametrize("name", [name for name in NAMES if name not in CLOUDS])
def test_a_mirrored_scene_stays_mirrored_to_the_last_bit(opened, name):
    with opened(name) as store:
        for field, sign in (("depth", 1), ("velocity_x", 1), ("velocity_y", -1), ("max_momentum_flux", 1)):
            values = store[field].to_numpy()
            assert (values == sign * values[..., ::-1, :]).all(), field


@pytest.mark.parametrize("name", CLOUDS)
def test_the_chute_on_a_cloud_ends_where_it_does_on_a_lattice(opened, name):
    with opened("chute") as lattice, opened(name) as cloud:
        for field, close in (("front_x", 0.2), ("deposit_max_depth", 0.1), ("deposit_centroid_x", 0.1)):
            assert cloud[field].item() == pytest.approx(lattice[field].item(), abs=close), field


def test_the_heap_at_rest_does_not_change_a_bit(opened):
    with opened("heap-at-rest") as store:
        depth = store["depth"].isel(run=0).to_numpy()
        assert (depth.view("int32") == depth[0].view("int32")).all()
        assert store["max_speed"].max() == 0


def test_the_uniform_layer_slides_as_far_as_the_closed_form(opened):
    with opened("uniform-layer") as store:
        depth = store["depth"].to_numpy()
        assert (depth == depth[0, 0, 0, 0]).all()
        width = 2.5
        assert store["volume_in"].item() == pytest.approx(2.28773 * 0.5 * width, rel=1e-3)
        assert store["volume_out"].item() == pytest.approx(store["volume_in"].item(), rel=1e-12)
        assert 1.525 <= store["rest_time"].item() <= 1.7


def test_the_dam_break_is_the_exact_one(opened):
    with opened("dam-break") as store:
        x, depth = store["x"].to_numpy(), store["depth"].isel(run=0, time=-1, y=2).to_numpy()
    exact = cell_means(DamBreak(), x, 0.5, 5.0)
    assert abs(depth - exact).sum() / exact.sum() < 2.4e-3


def test_the_shock_is_where_it_should_be_and_leaves_rest_behind(opened):
    shock = TravellingShock()
    with opened("shock") as store:
        x = store["x"].to_numpy()
        for time in (2, 4, 6, 8):
            place, frame = shock.speed * time, store.isel(run=0, y=2).sel(time=time)
            below = x[(frame["depth"] > (0.3 + 1) / 2).to_numpy()][0]
            assert abs(below - place) < 0.2
            behind = frame["velocity_x"].to_numpy()[x > place + 0.8]
            assert abs(behind).max() < 2e-3 * shock.arriving


def test_less_turbulent_friction_is_faster(opened):
    with opened("voellmy") as store:
        assert store["turbulent_friction"].to_numpy().tolist() == [200, 400, 800]
        assert (store["peak_speed"].diff("run") > 1).all()
