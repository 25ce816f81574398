import numpy as np
import pandas as pd
import pyogrio
import pytest
import rasterio
import shapely
import xarray as xr
from rasterio.transform import from_origin
from rasterio.warp import transform
from synthetic import store

from pipeline.assess.calibration import posterior, score
from pipeline.assess.observed import ObservationError, read
from pipeline.store.variables import Status

SCORES = ["hit_rate", "false_alarm_ratio", "runout_misfit"]


@pytest.fixture
def made():
    """Deposits of depth 1 over x 3..4, 3..5, ... 3..7 m and all y; the last run failed."""
    deposits = np.zeros((6, 5, 10))
    for run in range(6):
        deposits[run, :, 3 : 5 + run] = 1
    status = np.array([Status.DONE] * 5 + [Status.FAILED])
    return store({"bed_friction": 20.0 + np.arange(6)}, status, deposit_depth=deposits)


@pytest.fixture
def outline(tmp_path):
    path = tmp_path / "outline.csv"
    path.write_text("x,y\n2.5,-1\n6.5,-1\n6.5,5\n2.5,5\n")
    return path


def test_runs_are_scored_by_their_overlap_with_an_outline(made, outline):
    table = score(made, read(outline, made, 0.1), 0.1)
    assert table["run"].tolist()[:2] == [2, 1] or table["run"].tolist()[:2] == [2, 3]
    rows = table.set_index("run")
    assert rows["critical_success_index"].dropna().to_dict() == pytest.approx(
        {0: 2 / 4, 1: 3 / 4, 2: 1, 3: 4 / 5, 4: 4 / 6}
    )
    assert rows.loc[0, SCORES].tolist() == [0.5, 0, -2]
    assert rows.loc[4, SCORES].tolist() == pytest.approx([1, 1 / 3, 2])
    assert rows.loc[5, "status"] == "failed"
    assert np.isnan(rows.loc[5, "critical_success_index"])


def test_surveyed_depths_score_volume_too(made, tmp_path):
    x, y = np.meshgrid(np.arange(-0.25, 9.5, 0.5), np.arange(-0.25, 4.5, 0.5))
    depth = np.where((x > 2.4) & (x < 6.4), 2.0, 0.0)
    csv, netcdf = tmp_path / "survey.csv", tmp_path / "survey.nc"
    pd.DataFrame({"x": x.ravel(), "y": y.ravel(), "depth": depth.ravel()}).to_csv(csv)
    xr.Dataset({"depth": (("y", "x"), depth)}, {"x": x[0], "y": y[:, 0]}).to_netcdf(netcdf)
    first, second = (score(made, read(path, made, 0.1), 0.1).set_index("run") for path in (csv, netcdf))
    xr.testing.assert_equal(first.to_xarray(), second.to_xarray())
    assert first["critical_success_index"].idxmax() == 2
    assert first.loc[2, "volume_misfit"] == pytest.approx(-0.5)
    assert first.loc[2, "depth_rmse"] == pytest.approx(1)


GROUND = "georeference: {crs: 'EPSG:2056', origin: [2700000, 1200000], azimuth: 90}\n"


def on_map(made):
    # with an azimuth of 90 degrees x points east and y north
    return made.assign_attrs(scenario=made.attrs["scenario"] + GROUND)


@pytest.mark.parametrize(("name", "crs"), [("a.gpkg", "EPSG:2056"), ("a.geojson", "EPSG:4326")])
def test_polygons_on_the_map_are_outlines_in_any_reference_system(made, outline, tmp_path, name, crs):
    corners = [(2.5, -1), (6.5, -1), (6.5, 5), (2.5, 5), (2.5, -1)]
    x, y = transform("EPSG:2056", crs, *zip(*((2700000 + x, 1200000 + y) for x, y in corners), strict=True))
    shape = shapely.to_wkb(shapely.Polygon(list(zip(x, y, strict=True))))
    path = tmp_path / name
    pyogrio.raw.write(path, np.array([shape], object), [], [], crs=crs, geometry_type="Polygon")
    found = read(path, on_map(made), 0.1)
    assert (found.covered == read(outline, made, 0.1).covered).all()
    assert found.depth is None
    with pytest.raises(ObservationError, match="expected a scenario with a georeference"):
        read(path, made, 0.1)


@pytest.mark.parametrize("name", ["depth.tif", "DEPTH.TIF"])
def test_a_raster_on_the_map_is_a_survey(made, tmp_path, name):
    path = tmp_path / name
    # cells of 1 m, row 0 in the north; nodata beyond x = 6
    depth = np.full((5, 10), -9999.0, np.float32)
    depth[:, 3:7] = 2
    depth[:, :3] = 0
    place = {"crs": "EPSG:2056", "transform": from_origin(2699999.5, 1200004.5, 1, 1), "nodata": -9999}
    size = {"height": 5, "width": 10, "count": 1, "dtype": "float32"}
    with rasterio.open(path, "w", "GTiff", **size, **place) as raster:
        raster.write(depth, 1)
    found = read(path, on_map(made), 0.1)
    assert found.depth.reshape(5, 10).tolist() == [[0, 0, 0, 2, 2, 2, 2, 0, 0, 0]] * 5
    assert score(made, found, 0.1).loc[0, "volume_misfit"] == pytest.approx(-0.5)
    # in centimetres, by the scale of the file
    with rasterio.open(path, "w", "GTiff", **{**size, "dtype": "int16"}, **place) as raster:
        raster.write(np.where(depth > 0, depth * 100, depth).astype(np.int16), 1)
        raster.scales = (0.01,)
    np.testing.assert_allclose(read(path, on_map(made), 0.1).depth, found.depth, rtol=1e-12)
    with rasterio.open(path, "w", "GTiff", **size, **place) as raster:
        raster.write(depth, 1)
    path.write_bytes(path.read_bytes()[:-60])
    with pytest.raises(ObservationError, match="found none, or one that is cut off or damaged"):
        read(path, on_map(made), 0.1)


def test_accepted_runs_that_left_no_deposit_at_rest_are_counted(made, outline):
    made["status"][[2, 4]] = Status.CUT_OFF
    (row,) = posterior(made, score(made, read(outline, made, 0.1), 0.1), accepted=0.6).to_dict("records")
    assert (row["runs_accepted"], row["runs_accepted_overrun_or_cut_off"]) == (3, 1)


def test_accepted_runs_narrow_the_parameters(made, outline):
    scores = score(made, read(outline, made, 0.1), 0.1)
    (row,) = posterior(made, scores, accepted=0.6).to_dict("records")
    assert (row["runs_planned"], row["runs_done"], row["runs_accepted"]) == (6, 5, 3)
    assert row["best_run"] == 22
    assert (row["prior_q05"], row["prior_q95"]) == (20, 25)
    assert (row["posterior_q05"], row["posterior_q95"]) == (21, 23)


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("x,z\n1,2\n", "expected x, y and perhaps depth"),
        ("x,y\n1,2\n3,4\n", "expected 3 or more corners of an outline, found 2"),
        ("x,y\n1,1\n1.1,1\n1.1,1.1\n", "no cell of synthetic is part of the deposit"),
        ("x,y\n2700100,1\n2700101,1\n2700101,2\n", "is outside the domain of synthetic, x -1 to 10 m"),
        (
            "x,y\n2,0\n12,0\n12,4\n2,4\n",
            "20 % of the observed deposit, x 2 to 12 m and y 0 to 4 m",
        ),
        ("x,y,depth\n8,1,0.5\n9,1,0.5\n14,1,0.5\n", "33 % of the observed deposit"),
        ("x,y,depth\n20,1,0\n21,1,0\n", "expected places in the domain of synthetic, found none"),
        ("x,y,depth\n1,1,2\n2,1,-9999\n", "expected depths of at least 0 m, found -9999 in 1 of 2 places"),
        ("x,y,depth\n1,2,nan\n", "expected finite numbers"),
        ("x,y\n1,a\n", "expected x, y and perhaps depth"),
        ("x,y\n1,2\n1,2,3,4\n", "in m: found lines of another number of values"),
        ("x,y,depth\n1,2,0,5\n1,3,0,5\n", "in m: found lines of another number of values"),
        (
            "x,y\n2,0\n6,4\n6,0\n2,4\n",
            r"expected the corners of an outline in turn around the deposit, found Self-intersection\[4 2\]",
        ),
        ("x,y\n2,0\n6,0\n8,0\n", "found one of no area"),
    ],
)
def test_an_observation_that_cannot_be_used_is_told(made, tmp_path, text, message):
    path = tmp_path / "deposit.csv"
    path.write_text(text)
    with pytest.raises(ObservationError, match=message):
        read(path, made, 0.1)


def test_the_deposit_of_a_run_itself_is_met_whatever_film_lies_around_it(made, tmp_path):
    film = made["deposit_depth"].where(made["deposit_depth"] > 0, 0.05)
    made = made.assign(deposit_depth=film)
    x, y = np.meshgrid(made["x"], made["y"])
    depth = film[2].to_numpy()
    rows = pd.DataFrame({"x": x.ravel(), "y": y.ravel(), "depth": depth.ravel()})
    for name, kept in (("whole", rows), ("deposit", rows[rows["depth"] > 0.1])):
        path = tmp_path / f"{name}.csv"
        kept.to_csv(path, index=False)
        best = score(made, read(path, made, 0.1), 0.1).iloc[0]
        assert (best["run"], best["critical_success_index"]) == (2, 1)
        assert (best["volume_misfit"], best["depth_rmse"]) == (0, 0)


def test_an_observation_that_no_run_reaches_is_told_with_how_far_off_the_toes_are(made, tmp_path):
    path = tmp_path / "outline.csv"
    path.write_text("x,y\n8.5,-1\n9.5,-1\n9.5,5\n8.5,5\n")
    scores = score(made, read(path, made, 0.1), 0.1)
    with pytest.raises(ObservationError) as caught:
        posterior(made, scores, 1.0)
    # the observed toe is at 9 m, those of the runs at 4 to 8 m
    assert "no run overlaps the observed deposit: their toes lie -5 to -1 m from its own" in str(caught.value)
    scores = score(made, read(path, made, 0.1), 2.0)
    with pytest.raises(ObservationError, match="observed deposit: no run has a deposit above the threshold"):
        posterior(made, scores, 1.0)
