"""Elevation models read from rasters, and what is no elevation model."""

import numpy as np
import pytest
import rasterio
import xarray as xr
from rasterio.transform import Affine, from_origin

from pipeline.inputs.elevation_raster import ElevationRasterError, extent, read

Z = np.arange(24 * 30, dtype=np.float32).reshape(24, 30) + 1000


def write(path, values=Z, crs="EPSG:2056", transform=None, nodata=None, driver="GTiff"):
    transform = transform or from_origin(2600000, 1200120, 5, 5)
    bands = values if values.ndim == 3 else values[None]
    count, rows, columns = bands.shape
    about = {"count": count, "height": rows, "width": columns, "dtype": bands.dtype, "nodata": nodata}
    with rasterio.open(path, "w", driver=driver, crs=crs, transform=transform, **about) as target:
        target.write(bands)
    return path


def test_rows_go_north_and_coordinates_are_of_the_centres(tmp_path):
    found = read(write(tmp_path / "dem.tif"))
    assert found.crs == "EPSG:2056"
    assert (found.x[0], found.x[-1]) == (2600002.5, 2600147.5)
    assert (found.y[0], found.y[-1]) == (1200002.5, 1200117.5)
    np.testing.assert_array_equal(found.elevation, Z[::-1])


def test_an_asc_takes_its_system_from_the_scenario(tmp_path):
    path = write(tmp_path / "dem.asc", crs=None, driver="AAIGrid", nodata=-9999)
    with pytest.raises(ElevationRasterError, match=r"found none in the file; write it as `crs: EPSG:2056`"):
        read(path)
    assert read(path, "EPSG:2056").crs == "EPSG:2056"


def test_of_a_system_with_heights_the_part_in_plan_counts(tmp_path):
    # LV95 with heights of LN02
    path = write(tmp_path / "dem.tif", crs="EPSG:2056+5728")
    assert read(path).crs == extent(path).crs == "EPSG:2056"
    assert read(path).digest == read(write(tmp_path / "plain.tif")).digest


def test_the_part_around_a_rectangle_is_that_of_the_whole(tmp_path):
    path = write(tmp_path / "dem.tif")
    whole, part = read(path), read(path, x=(2600050, 2600080), y=(1200040, 1200060))
    assert part.elevation.shape == (12, 14)
    rows, columns = np.isin(whole.y, part.y), np.isin(whole.x, part.x)
    np.testing.assert_array_equal(part.elevation, whole.elevation[np.ix_(rows, columns)])
    assert part.digest != whole.digest == read(path).digest


def test_no_data_declared_or_usual_is_nan(tmp_path):
    values = Z.copy()
    values[2, 3], values[4, 5] = -9999, 7777
    found = read(write(tmp_path / "dem.tif", values, nodata=7777)).elevation[::-1]
    assert np.isnan(found[2, 3])
    assert np.isnan(found[4, 5])
    assert np.isnan(found).sum() == 2


@pytest.mark.filterwarnings("ignore:The given matrix")
@pytest.mark.parametrize(
    ("given", "words"),
    [
        ({"crs": "EPSG:4326", "transform": from_origin(7, 46, 5e-5, 5e-5)}, "degrees; gdalwarp"),
        ({"crs": "EPSG:2225"}, "found US survey foot"),
        ({"crs": 'LOCAL_CS["site",UNIT["metre",1]]'}, "expected a projected reference system, found 'site'"),
        ({"values": np.stack([Z, Z, Z])}, "found 3 bands"),
        ({"transform": from_origin(2600000, 1200120, 5, 8)}, "square cells north up"),
        ({"transform": Affine(4, 3, 2600000, 3, -4, 1200000)}, "square cells north up"),
        ({"values": np.full_like(Z, -9999)}, "found no data alone"),
        ({"values": Z + 20000}, "found 21000 to 21719; where 21719 means no data.*-a_nodata 21719"),
        ({"transform": Affine.identity()}, "without corner and cell size; gdal_edit.py -a_ullr"),
    ],
)
def test_what_is_no_elevation_model_is_told(tmp_path, given, words):
    with pytest.raises(ElevationRasterError, match=words):
        read(write(tmp_path / "dem.tif", **given))


@pytest.mark.parametrize("part", [{}, {"x": (2600050, 2600080), "y": (1200040, 1200060)}])
def test_scale_and_offset_make_metres_of_what_is_stored(tmp_path, part):
    stored = np.round((Z - 900) * 10).astype(np.int16)
    stored[12, 15] = -32768
    plain = read(write(tmp_path / "plain.tif", stored, nodata=-32768), **part).elevation
    path = write(tmp_path / "dem.tif", stored, nodata=-32768)
    with rasterio.open(path, "r+") as raster:
        raster.scales, raster.offsets = (0.1,), (900.0,)
    found = read(path, **part).elevation
    np.testing.assert_array_equal(found, plain * 0.1 + 900)
    assert np.isnan(found).sum() == 1


def test_scale_and_offset_of_netcdf(tmp_path):
    sides = {"x": 2600002.5 + 5 * np.arange(30), "y": 1200117.5 - 5 * np.arange(24)}
    places = {
        name: (name, side, {"units": "m", "standard_name": f"projection_{name}_coordinate"})
        for name, side in sides.items()
    }
    packed = {"scale_factor": 0.1, "add_offset": 1000.0, "dtype": "int16", "_FillValue": -32768}
    data = xr.Dataset({"elevation": (("y", "x"), Z, {"units": "m"})}, places)
    data.to_netcdf(tmp_path / "dem.nc", encoding={"elevation": packed})
    found = read(tmp_path / "dem.nc", "EPSG:2056")
    np.testing.assert_allclose(found.elevation, Z[::-1], atol=1e-9)
    (data.assign(slope=data["elevation"] * 0)).to_netcdf(tmp_path / "two.nc")
    with pytest.raises(ElevationRasterError, match=r"found elevation, slope; .* NETCDF:two\.nc:elevation "):
        read(tmp_path / "two.nc", "EPSG:2056")


@pytest.mark.parametrize("unit", ["", "m", "Metre", "[m]", "meters", "m a.s.l."])
def test_units_that_are_metres(tmp_path, unit):
    with rasterio.open(write(tmp_path / "dem.tif"), "r+") as raster:
        raster.units = (unit,)
    np.testing.assert_array_equal(read(tmp_path / "dem.tif").elevation, Z[::-1])


@pytest.mark.parametrize(
    ("unit", "told"),
    [
        ("usft", r"found 'usft'; gdal_calc\.py --calc 'A\*0\.3048' makes metres of feet"),
        ("survey feet", "makes metres of feet"),
        (
            "cm",
            r"found 'cm'; gdal_calc\.py makes metres of others, and gdal_edit\.py -units m dem\.tif says so",
        ),
        ("millimetre", "found 'millimetre'"),
    ],
)
def test_units_that_are_none(tmp_path, unit, told):
    with rasterio.open(write(tmp_path / "dem.tif"), "r+") as raster:
        raster.units = (unit,)
    with pytest.raises(ElevationRasterError, match=told):
        read(tmp_path / "dem.tif")


def test_a_file_that_is_cut_off(tmp_path):
    path = write(tmp_path / "dem.tif")
    path.write_bytes(path.read_bytes()[:1500])
    with pytest.raises(ElevationRasterError, match="cannot be read to its end: it is cut off or damaged"):
        read(path)


def test_other_files_and_places_are_told(tmp_path):
    (tmp_path / "table.csv").write_text("distance,elevation\n0,100\n")
    with pytest.raises(ElevationRasterError, match=r"found table\.csv, which is none"):
        read(tmp_path / "table.csv")
    path = write(tmp_path / "dem.tif")
    with pytest.raises(ElevationRasterError, match="covers the domain, found one of x 2600000 to 2600150"):
        read(path, x=(100, 200), y=(100, 200))
    with pytest.raises(ElevationRasterError, match="found 'nowhere', which is none"):
        read(write(tmp_path / "bare.tif", crs=None), "nowhere")
