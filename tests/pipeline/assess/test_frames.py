import numpy as np
import xarray as xr

from pipeline.assess.frames import follow


def test_what_came_in_and_what_left_is_no_error_of_volume():
    """Four cells of 1 m2: a closed run, one fed from nothing, one that loses half, one fed and eroding."""
    depth = np.array([[1.0, 1.0, 1.0], [0.0, 1.0, 2.0], [1.0, 0.75, 0.5], [1.0, 2.0, 3.03]])
    frames = depth[:, :, None, None] * np.ones((2, 2))
    over = ("run", "time", "y", "x")
    store = xr.Dataset(
        {
            "depth": (over, frames),
            "velocity_x": (over, 0 * frames),
            "velocity_y": (over, 0 * frames),
            "entrained": (("run", "time"), [[0, 0, 0], [0, 0, 0], [0, 0, 0], [0, 0, 4]]),
            "volume_in": ("run", [0.0, 8.0, 0.0, 4.0]),
            "volume_out": ("run", [0.0, 0.0, 2.0, 0.0]),
            "last_time": ("run", [2.0] * 4),
        },
        {"time": [0.0, 1.0, 2.0], "x": [0.0, 1.0], "y": [0.0, 1.0]},
    )
    found = follow(store, 0.1)["volume_error"].transpose("run", "time").to_numpy()
    unknown = np.nan
    right = [[0, 0, 0], [0, unknown, 0], [0, unknown, 0], [0, unknown, 0.01]]
    np.testing.assert_allclose(found, right, atol=1e-12)
    # what is in a cut-off frame is that of no last state
    store["last_time"] = ("run", [1.5, 3.0, 1.5, 1.5])
    assert np.isnan(follow(store, 0.1)["volume_error"].isel(run=1, time=-1))
