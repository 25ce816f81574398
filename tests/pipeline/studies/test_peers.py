"""The comparison with another code: its files, footprints on common cells, and tables put into a page."""

import json

import numpy as np
import pandas as pd
import pytest
import xarray as xr

from pipeline.studies.peers.__main__ import together, with_table
from pipeline.studies.peers.sites import on_cells, overlap, peers, write_parabola


@pytest.fixture
def folder(tmp_path):
    """Results of another code as its files hold them, and a variant."""
    peak = np.zeros((30, 40), np.float32)
    peak[10:20, 5:25] = 2.0
    about = {"loop_cpu": 12.0, "end": 60.0}
    ring = [[1320.0, -25.0], [1400.0, -25.0], [1400.0, 25.0], [1320.0, 25.0], [1320.0, -25.0]]
    polygon = json.dumps({"type": "Polygon", "coordinates": [ring]})
    for name in ("code-parabolaup_coulomb24", "code-parabolaup_coulomb24_other-1", "code-parabolaup_unknown"):
        np.savez(
            tmp_path / f"{name}.npz", pft=peak, x0=1212.5, y0=-72.5, cell=5.0, polygon=polygon,
            summary=json.dumps(about),
        )  # fmt: skip
    return tmp_path


def test_results_of_known_laws_are_read_with_their_places(folder):
    first, variant = peers(folder)
    assert (first.code, first.site, first.law, first.variant) == ("code", "parabolaup", "coulomb24", "")
    assert variant.variant == "other-1"
    assert (first.x[0], first.y[-1], first.peak.max()) == (1215.0, 75.0, 2.0)
    assert first.summary["loop_cpu"] == 12.0


def test_footprints_are_compared_on_cells_that_hold_both(folder):
    (peer, _) = peers(folder)
    # the same flow two cells farther along x, on a smaller lattice
    field = np.zeros((12, 24))
    field[1:11, 2:22] = 1.0
    axes = {"x": peer.x[5:29], "y": peer.y[9:21]}
    store = xr.Dataset({"max_depth": (("y", "x"), field)}, axes)
    x, y, ours, theirs = together(store, peer)
    assert (x[0], x[-1], y[0], y[-1]) == (peer.x[0], peer.x[-1], peer.y[0], peer.y[-1])
    assert overlap(ours, theirs) == pytest.approx(18 / 22)
    np.testing.assert_array_equal(theirs, peer.peak)


def test_what_lies_beyond_a_field_is_nothing():
    values = np.ones((2, 2))
    found = on_cells(
        values, np.array([0.0, 1.0]), np.array([0.0, 1.0]), np.arange(-1.0, 3.0), np.array([0.0])
    )
    assert found.tolist() == [[0, 1, 1, 0]]


def test_the_parabola_falls_to_its_plane(folder, tmp_path):
    import rasterio

    at = write_parabola(folder, tmp_path / "made")
    with rasterio.open(at / "parabolaup.tif") as raster:
        z = raster.read(1)
        (top, middle, foot) = (next(raster.sample([(x, 0.0)]))[0] for x in (1000.0, 2125.0, 3250.0))
    assert (top, middle, foot) == (1000.0, 250.0, 0.0)
    assert np.ptp(z, axis=0).max() == 0


def test_a_table_takes_the_place_of_the_one_before():
    page = "a\n<!-- peers: one -->\nold\n<!-- end -->\nb\n<!-- peers: two -->\n<!-- end -->\n"
    found = with_table(page, "one", pd.DataFrame({"site": ["kot"], "overlap": [0.5]}))
    assert "old" not in found
    assert "| kot | 0.5 |\n<!-- end -->\nb\n<!-- peers: two -->\n<!-- end -->\n" in found
    with pytest.raises(ValueError, match="no place for the table three"):
        with_table(page, "three", pd.DataFrame({"site": ["kot"]}))
