import numpy as np
import pytest
import xarray as xr
from stores import POINTS, SCATTERED, store_of

from pipeline.assess.frames import cell_area, follow
from pipeline.assess.gridding import gridded
from pipeline.store.variables import Status
from solver.lmls.gridding import gridding
from solver.points.cloud import random_points
from solver.points.lattice import Lattice

CLOUD = random_points((0, 10), (-2, 2), 900, 5)
GRID = gridding(CLOUD, Lattice((0, 10), (-2, 2), 0.1))


@pytest.fixture
def store(scenario_file, tmp_path):
    file = scenario_file(20, 22, replace=(POINTS, SCATTERED))
    with store_of(file, tmp_path) as opened:
        yield opened


def test_a_linear_field_is_reproduced():
    x, y = CLOUD.control_volumes.centroid.T
    found = np.einsum("ms,ms->m", GRID.value, (1 + 2 * x - 3 * y)[GRID.neighbours])
    at_x, at_y = GRID.lattice.coordinates
    np.testing.assert_allclose(found.reshape(at_x.shape), 1 + 2 * at_x - 3 * at_y, atol=1e-11)


def test_volume_is_kept_and_no_value_leaves_the_range():
    x, y = CLOUD.control_volumes.centroid.T
    depth = np.where((x - 4) ** 2 + y**2 < 1, 1.0, 0.0)
    found = GRID.keeping_integral(depth)
    assert found.sum() * GRID.lattice.cell_area == pytest.approx(depth @ CLOUD.cell_area, rel=1e-12)
    assert found.min() == 0
    plain = GRID.within_range(depth)
    assert (plain.min(), plain.max()) == (0, 1)


def test_velocity_is_that_of_what_flows():
    x, _ = CLOUD.control_volumes.centroid.T
    depth, velocity = np.where(x < 5, 1.0, 0.0), np.where(x < 5, 3.0, 0.0)
    found = GRID.velocity(depth, velocity)
    np.testing.assert_allclose(found[:, GRID.lattice.x_points < 4.5], 3, rtol=1e-12)
    assert not found[:, GRID.lattice.x_points > 5.6].any()
    assert np.isnan(GRID.velocity(depth * np.nan, velocity)).all()
    assert not GRID.keeping_integral(0 * depth).any()


class TestAStoreOfACloud:
    def test_has_points_with_their_areas(self, store):
        assert dict(store.sizes) == {"run": 2, "time": 3, "point": 907}
        assert {"x", "y", "area", "elevation"} <= set(store.coords)
        assert float(store["area"].sum()) == pytest.approx(40, rel=1e-13)
        assert store["area"].attrs["units"] == "m2"
        assert (store["status"] == Status.CUT_OFF).all()
        volumes = (store["depth"].astype(float) * store["area"]).sum("point")
        np.testing.assert_allclose(volumes, 2.0, rtol=1e-6)
        assert np.abs(store["volume_error"]).max() < 1e-12
        np.testing.assert_allclose(store["elevation"], -np.sin(np.pi / 6) * store["x"], atol=1e-12)

    def test_is_gridded_with_its_volume_kept(self, store):
        grid = gridded(store, 0.25)
        assert dict(grid.sizes) == {"run": 2, "time": 3, "y": 17, "x": 41}
        for name in ("depth", "deposit_depth"):
            kept = (grid[name].astype(float) * cell_area(grid)).sum(["y", "x"])
            held = (store[name].astype(float) * store["area"]).sum("point")
            np.testing.assert_allclose(kept, held, rtol=1e-6)
        assert grid["depth"].attrs == store["depth"].attrs
        np.testing.assert_allclose(grid["elevation"], -np.sin(np.pi / 6) * grid["x"], atol=1e-9)
        assert (grid["bed_friction"] == store["bed_friction"]).all()
        assert float(grid["max_speed"].max()) <= float(store["max_speed"].max())
        first = float(store["arrival_time"].min())
        assert float(grid["arrival_time"].min()) == first == 0

    def test_is_gridded_lazily_where_it_is_open_lazily(self, store):
        lazy = gridded(store.chunk({"run": 1}), 0.25)
        assert lazy["depth"].chunks is not None
        xr.testing.assert_identical(lazy["depth"].compute(), gridded(store, 0.25)["depth"])

    def test_frames_that_were_not_computed_stay_missing(self, store):
        missing = store[["depth", "velocity_x"]].load().where(store["time"] < 0.15)
        grid = gridded(missing.assign_coords(store.coords), 0.25)
        assert grid["depth"].isel(time=-1).isnull().all()
        assert grid["velocity_x"].isel(time=-1).isnull().all()
        assert grid["depth"].isel(time=0).notnull().all()

    def test_is_followed_as_that_of_a_lattice(self, store, scenario_file, tmp_path):
        file = scenario_file(20, 22, name="other", replace=("spacing: 0.5", "spacing: 0.2"))
        with store_of(file, tmp_path) as lattice:
            mine, other = follow(store), follow(lattice)
            for name in ("front_x", "tail_x", "half_width"):
                assert np.abs(mine[name] - other[name]).max() <= 0.4, name
            assert np.abs(mine["volume_error"]).max() < 1e-6
            with pytest.raises(ValueError, match="not that of a cloud"):
                gridded(lattice, 0.2)
