"""What cells of an elevation model do not show of a flow: narrow channels, and where it lifts off."""

import numpy as np
import pytest
from elevation_files import WEST, ground, write_polygons, write_raster, written

import pipeline
from pipeline.runs.surface_summary import NARROW, lifted_share, narrow, note, path_length
from solver.physics.elevation import ElevationModel
from solver.points.lattice import Lattice

CELL, BANK = 5.0, 3.0
MIDDLE = (slice(12, -12),) * 2


def channel(width, azimuth):
    """Bed and flow depth of a parabolic channel so many cells wide at its banks, on a slope of 0.3, m."""
    rows, columns = np.mgrid[:80, :80] - 40.0
    turn = np.radians(azimuth)
    along = np.cos(turn) * columns + np.sin(turn) * rows
    across = (np.cos(turn) * rows - np.sin(turn) * columns) / (width / 2)
    banks = np.minimum(BANK * across**2, BANK + 0.1 * CELL * width * np.maximum(np.abs(across) - 1, 0))
    return 500 - 0.3 * CELL * along + banks, np.maximum(0.0, 2.5 - BANK * across**2)


@pytest.mark.parametrize("azimuth", [0, 30, 45, 60, 90])
@pytest.mark.parametrize(("width", "told"), [(2, True), (3, True), (6, False), (8, False)])
def test_channels_of_less_than_four_cells_are_found_whatever_their_direction(width, told, azimuth):
    bed, depth = channel(width, azimuth)
    found = narrow(bed, depth, depth > 0.1)[MIDDLE]
    # all along it, one cell a row or column at least
    assert (found.sum() >= 56) if told else not found.any()


def test_a_smooth_slope_and_no_data_are_no_channel():
    rows, columns = np.mgrid[:40, :40]
    bed = 100 - 2.0 * columns + 0.5 * rows
    bed[:, 20:] = np.nan
    assert not narrow(bed, np.ones_like(bed), np.ones(bed.shape, bool)).any()


def test_a_run_through_a_gully_of_three_cells_says_so(tmp_path):
    elevation = ground(40, 100)
    elevation[18:21, 14:] -= 6.0
    write_raster(tmp_path / "dem.tif", elevation)
    write_polygons(tmp_path / "releases.gpkg", {"slide": (40, -115, 70, -85)})
    table = pipeline.run(written(tmp_path), tmp_path / "out", workers=1, quiet=True).table
    assert NARROW in table["warning"][0]
    assert f"x = {WEST:.8g}"[:8] in table["warning"][0]
    maps = pipeline.hazard_maps(tmp_path / "out")
    assert note(table["warning"]) in maps["small"].attrs["comment"]
    assert note(table["warning"]) == "; channels narrower than 4 cells on the flow's way in 1"


class TestPathLength:
    """Of the shortest way over the ground within what was reached."""

    def test_on_a_slope_it_is_longer_than_in_plan(self):
        _, columns = np.mgrid[:9, :41]
        bed, reached = -0.75 * CELL * columns, np.ones((9, 41), bool)
        assert path_length(CELL, bed, reached, (4, 0), (4, 40)) == pytest.approx(40 * CELL * 1.25)

    @pytest.mark.parametrize("turn", [0, 13, 22.5, 45, 70, 90])
    def test_it_is_nearly_straight_in_every_direction(self, turn):
        end = tuple(np.rint(60 * np.array([np.sin(np.radians(turn)), np.cos(np.radians(turn))])).astype(int))
        flat, reached = np.zeros((62, 62)), np.ones((62, 62), bool)
        found = path_length(1.0, flat, reached, (0, 0), end)
        assert np.hypot(*end) <= found * (1 + 1e-12) <= 1.03 * np.hypot(*end)

    def test_it_goes_around_what_was_not_reached(self):
        reached = np.zeros((21, 21), bool)
        reached[0], reached[:, 20], reached[20] = True, True, True
        found = path_length(1.0, np.zeros((21, 21)), reached, (0, 0), (20, 0))
        assert found == pytest.approx(60, rel=0.05)
        reached[10] = False
        assert np.isnan(path_length(1.0, np.zeros((21, 21)), reached, (0, 0), (20, 0)))


@pytest.mark.parametrize(("speed", "share"), [(12.0, 0.0), (20.0, 1.0)])
def test_a_flow_lifts_off_a_crest_at_the_speed_of_a_point(speed, share):
    # a cylinder of radius R falls away below u^2 = g R cos(slope)
    x = np.arange(-30, 31) * 1.0
    surface = ElevationModel(x, x, np.broadcast_to(np.sqrt(40.0**2 - x**2), (61, 61)))
    lattice = Lattice((5, 15), (-10, 10), 1.0)
    reached, fast = np.ones(lattice.shape, bool), np.full(lattice.shape, speed)
    assert lifted_share(surface, lattice, reached, fast, 9.81) == share
    nothing = ElevationModel(x, x, surface.elevation, None)
    assert lifted_share(nothing, lattice, reached, fast, 9.81) == 0
