"""Dams and basins on elevation models: volumes, heights and slopes that are known."""

import numpy as np
import pytest

from solver.parameters import ParameterError
from solver.physics.earthworks import Basin, Dam, crest_left, reshaped
from solver.physics.elevation import ElevationModel

X, Y = np.arange(-60.0, 61.0), np.arange(-40.0, 41.0)
LINE = np.array([[-20.0, 0.0], [20.0, 10.0]])


def model(slope=0.0, along=(1.0, 0.0)):
    fall = along[0] * X[None, :] + along[1] * Y[:, None]
    return ElevationModel(X, Y, -slope * fall)


def change(ground, *works, spacing=0.5, first=0.0):
    x, y = np.arange(-60 + first, 60.1, spacing), np.arange(-40 + first, 40.1, spacing)
    return x, y, reshaped(ground, works).corners(x, y) - ground.corners(x, y)


@pytest.mark.parametrize("slope", [30.0, 34.0, 60.0])
def test_a_dam_on_level_ground_has_the_volume_of_its_prism_and_of_a_cone(slope):
    k, length = np.tan(np.radians(slope)), np.hypot(40, 10)
    _, _, dz = change(model(), Dam((LINE,), 4.0, slope))
    assert dz.sum() / 4 == pytest.approx(16 / k * length + np.pi * 64 / k**2 / 3, rel=1e-3)
    assert dz.max() <= 4.0
    assert dz.min() == 0.0


def test_a_crest_has_its_width():
    line = np.array([[-30.0, 0.0], [30.0, 0.0]])
    _, y, dz = change(model(), Dam((line,), 3.0, 45.0, 4.0))
    middle = dz[:, 120]
    np.testing.assert_allclose(middle, np.clip(3 - np.maximum(0, abs(y) - 2), 0, None), atol=1e-12)


@pytest.mark.parametrize("along", [(1.0, 0.0), (0.0, 1.0), (0.8, 0.6)])
def test_on_a_slope_the_crest_is_above_the_ground_and_the_sides_have_their_slope(along):
    ground = model(0.3, along)
    line = np.array([[-30.0, 0.0], [30.0, 0.0]])
    dam = Dam((line,), 4.0, 34.0)
    x, y, dz = change(ground, dam, spacing=0.25)
    middle = np.argmin(abs(y))
    # away from its ends
    np.testing.assert_allclose(dz[middle, 160:320], 4.0, atol=1e-9)
    z = reshaped(ground, [dam]).corners(x, y)
    north, east = np.gradient(z, 0.25)
    side = (dz > 0.6) & (dz < 3.4) & (abs(x) < 15)
    np.testing.assert_allclose(np.hypot(north, east)[side], np.tan(np.radians(34)), rtol=1e-6)


def test_a_line_written_the_other_way_is_the_same_dam_to_the_last_bit():
    line = np.array([[-20.0, 3.0], [5.0, 3.0], [20.0, 10.0]])
    _, _, one = change(model(0.2), Dam((line,), 4.0, 34.0))
    _, _, two = change(model(0.2), Dam((line[::-1],), 4.0, 34.0))
    np.testing.assert_array_equal(one, two)


def test_mirror_images_of_a_dam_agree_to_the_last_bit():
    line = np.array([[-20.0, 3.0], [5.0, 3.0], [20.0, 10.0]])
    box = np.array([[0.0, -20.0], [10.0, -20.0], [10.0, -10.0], [0.0, -10.0]])
    images = []
    for sign in (1, -1):
        turned = (box * [1, sign])[::sign]
        works = Dam((line * [1, sign],), 4.0, 34.0), Basin((turned,), 3.0, 40.0)
        # on corners of the cells of the raster itself
        images.append(change(model(0.2), *works, spacing=1.0, first=0.5)[2][::sign])
    np.testing.assert_array_equal(*images)


def test_a_basin_is_cut_to_its_depth_with_its_slopes():
    box = np.array([[-10.0, -10.0], [10.0, -10.0], [10.0, 10.0], [-10.0, 10.0]])
    x, y, dz = change(model(0.1), Basin((box,), 3.0, 45.0), spacing=0.5)
    inner = np.minimum(10 - abs(x[None, :]), 10 - abs(y[:, None]))
    np.testing.assert_allclose(dz, -np.clip(inner, 0, 3), atol=1e-9)
    _, _, upright = change(model(0.1), Basin((box,), 3.0))
    assert set(np.unique(upright.round(9))) == {-3.0, 0.0}
    hole = np.array([[-2.0, -2.0], [-2.0, 2.0], [2.0, 2.0], [2.0, -2.0]])
    _, _, kept = change(model(0.1), Basin((box, hole), 3.0))
    assert kept[80, 120] == 0.0


def test_later_works_stand_on_what_earlier_ones_left():
    box = np.array([[-10.0, -10.0], [10.0, -10.0], [10.0, 10.0], [-10.0, 10.0]])
    line = np.array([[-5.0, 0.0], [5.0, 0.0]])
    basin, dam = Basin((box,), 3.0), Dam((line,), 2.0, 45.0)
    _, y, first_cut = change(model(), basin, dam)
    assert first_cut[np.argmin(abs(y)), 120] == pytest.approx(-1.0)
    _, _, first_built = change(model(), dam, basin)
    assert first_built[np.argmin(abs(y)), 120] == pytest.approx(-1.0)


def test_no_height_is_the_model_itself():
    ground = model(0.1)
    assert reshaped(ground, [Dam((LINE,), 0.0, 34.0)]) is ground


def test_the_raster_holds_the_dam_for_the_curvature():
    built = reshaped(model(), [Dam((LINE,), 4.0, 34.0)])
    assert 3.5 < built.elevation.max() <= 4.0
    assert abs(built.hessian(X, Y)[0]).max() > 0.1


def test_what_is_left_of_a_crest_on_wide_cells_is_less():
    ground, dam = model(), Dam((LINE,), 4.0, 34.0)
    built = reshaped(ground, [dam])
    shares = [crest_left(dam, built, ground, *(np.arange(-32, 32.1, d),) * 2) for d in (8.0, 4.0, 1.0)]
    assert shares == sorted(shares)
    assert shares[0] < 0.75 < 0.93 < shares[-1] < 1


def test_what_makes_no_dam_is_refused():
    with pytest.raises(ValueError, match="meet the ground"):
        change(model(0.6), Dam((LINE,), 4.0, 34.0))
    with pytest.raises(ValueError, match="two places"):
        change(model(), Dam((LINE[[0, 0]],), 4.0, 34.0))
    for name, values in {"height": (-1.0, 34.0), "side_slope": (4.0, 90.0)}.items():
        with pytest.raises(ParameterError, match=name):
            Dam((LINE,), *values)
