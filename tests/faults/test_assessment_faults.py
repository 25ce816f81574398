"""What an assessment claims of runs that say less than all: cut off, overrun, of unequal size or rarity."""

import numpy as np
import pytest
from stores import store_of

from pipeline.assess.ensemble import counts, ensemble, together
from pipeline.assess.receptors import reached
from pipeline.assess.tables import quantiles, receptors, receptors_by_period, values
from pipeline.hazard.mapping import map_hazard
from pipeline.settings.hazard import Hazard
from pipeline.store.variables import Status

BLOCK = """\
name: {name}
terrain: {{profile: bend, angle: 30, start: 200, end: 240}}
domain: {{x: [0, {length}], y: [-{width}, {width}]}}
points: {{spacing: 4}}
release: {{shape: box, x: [20, 50], y: [-11, 11], height: 2}}
material: {{bed_friction: {friction}, earth_pressure: isotropic}}
{more}
"""
HOUSE = "receptors: [{name: house, point: [260, 0]}, {name: church, point: [480, 30]}]"
CAP = """\
name: {name}
terrain: {{profile: bend, angle: 30, start: 100, end: 140}}
domain: {{x: [{x}], y: [-60, 60]}}
points: {{spacing: 4}}
release: {{shape: cap, centre: [35, 0], radius: 12, height: 3}}
material: {{bed_friction: 18, earth_pressure: isotropic}}
{more}
"""
PERIODS = {10: 200, 100: 600, 300: 2000}
ROAD = "receptors: [{name: road, line: [[180, -60], [180, 60]]}]\noutput: {threshold: 0.05}"


@pytest.fixture
def made(tmp_path):
    def make(text, name="fault", **options):
        file = tmp_path / f"{name}.yaml"
        file.write_text(text.format(name=name, **options))
        return store_of(file, tmp_path)

    return make


def probabilities(store):
    rows = {row["receptor"]: row for row in receptors(store, reached(store))}
    return {
        name: tuple(row[f"probability{end}"] for end in ("_lower", "", "_upper"))
        for name, row in rows.items()
    }


def in_words(store, quantity):
    row = next(row for row in quantiles(store) if row["quantity"] == quantity)
    return [row[f"{name}_in_words"] for name in ("q05", "q50", "q95")]


class TestARunCutOffWhileItMoves:
    def block(self, made, end, length=500, friction=20):
        more = f"time: {{end: {end}}}\n" if end else ""
        return made(
            BLOCK, f"end-{end}-{length}", length=length, width=80, friction=friction, more=more + HOUSE
        )

    def test_is_not_done_and_its_reach_is_a_lower_bound(self, made):
        # a block is as fast as 9.81 (sin 30 - cos 30 tan 20) 10 = 18 m/s by then
        with self.block(made, 10) as store:
            assert store["status"].item() == Status.CUT_OFF
            assert str(counts(store)) == "0 of 1 run done (1 still moving at time.end)"
            assert store["volume_moving"].item() > 0.99 * store["volume_released"].item()
            assert probabilities(store)["house"] == (0, 0, 1)
            assert in_words(store, "runout_distance") == [f"above {store['runout_distance'].item():.4g}"] * 3
            assert in_words(store, "reach_angle")[1].startswith("below")
            assert in_words(store, "deposit_length") == ["unknown"] * 3

    @pytest.mark.parametrize("end", [100, None])
    def test_is_done_where_it_may_come_to_rest(self, made, end):
        with self.block(made, end) as store:
            assert store["status"].item() == Status.DONE
            # 24.7 on a lattice of 0.5 m
            assert store["rest_time"].item() == pytest.approx(24.7, abs=2)
            assert store["volume_moving"].item() == 0
            assert probabilities(store)["house"] == (1, 1, 1)

    def test_may_have_left_the_domain_too(self, made):
        with made(BLOCK, length=120, width=80, friction=20, more="time: {end: 7}") as store:
            assert store["status"].item() == Status.OVERRUN_AND_CUT_OFF
            assert str(counts(store)) == "0 of 1 run done (1 overrun, 1 still moving at time.end)"

    def test_has_frames_while_it_moves_without_an_end(self, made):
        with self.block(made, None) as store:
            # 200 sqrt(500/9.81) is 1428, in two digits 1500
            assert store["time"].to_numpy().tolist() == pytest.approx([*(15.0 * np.arange(11)), 1500])


def test_a_drop_that_leaves_the_domain_bounds_nothing(made):
    with made(BLOCK, length=500, width=40, friction=24, more="time: {end: 100}\n" + HOUSE) as store:
        assert 0 < store["volume_out_open"].item() < 1e-4 * store["volume_released"].item()
        assert store["status"].item() == Status.DONE
        assert probabilities(store)["church"] == (0, 0, 0)
        found = map_hazard(ensemble(store), Hazard(depth=(0.5,)))
        assert found["depth_exceedance_upper"].min() == 0


def test_a_larger_event_reaches_no_less_than_a_smaller_one(made):
    more = "time: {end: 60}\nsweep: {release.volume: [70, 700, 7000, 20000]}\n" + ROAD.splitlines()[0]
    with made(CAP, x="-20, 400", more=more) as store:
        threshold = store.attrs["threshold"]
        assert threshold == pytest.approx(0.01 * store["max_depth"].isel(run=0).max().item(), rel=0.2)
        arrived = reached(store)["reached"].tolist()
        assert arrived == sorted(arrived)
        depth = reached(store)["max_depth"].to_numpy()
        assert arrived == (depth > threshold).tolist()


def test_quantiles_hold_for_all_runs_and_not_for_survivors_alone(made):
    more = "time: {end: 100}\noutput: {threshold: 0.05}\nsweep: {material.bed_friction: [3, 5, 7, 9, 26]}"
    with made(CAP, x="0, 170", more=more) as store:
        assert store["status"].to_numpy().tolist() == [Status.OVERRUN] * 4 + [Status.DONE]
        reach = values(store, "runout_distance")
        own = store["runout_distance"][4].item()
        assert own == pytest.approx(101.4, abs=0.1)
        found = reach.exceedance([58, own, 140])
        assert found.lower.tolist() == [1, 0.8, 0]
        assert found.upper.tolist() == [1, 0.8, 0.8]
        # the cells end 136 m from the crown
        assert in_words(store, "runout_distance") == ["101.4", "above 135.8", "above 135.8"]
        (row,) = (row for row in quantiles(store) if row["quantity"] == "runout_distance")
        assert row["q50_lower"] == pytest.approx(135.8, abs=0.1)
        assert np.isnan([row["q50"], row["q50_upper"]]).all()


class TestReturnPeriods:
    def whole(self, made):
        more = (
            f"time: {{end: 60}}\nsweep: {{release.volume: {list(PERIODS.values())}}}\n"
            f"return_periods: {{release.volume: {list(PERIODS)}}}\n{ROAD}"
        )
        return made(CAP, "whole", x="-50, 300", more=more)

    def parts(self, made):
        for years, volume in PERIODS.items():
            more = (
                f"time: {{end: 60}}\nsweep: {{release.volume: [{volume}]}}\nreturn_periods: {years}\n{ROAD}"
            )
            yield made(CAP, f"part-{years}", x="-50, 300", more=more)

    def test_weigh_within_a_scenario(self, made):
        with self.whole(made) as store:
            (row,) = receptors(store, reached(store))
            # only the rarest event reaches the road: one in thirty of those of every ten years
            assert row["probability"] == pytest.approx(1 / 30)
            assert row["annual_rate"] == pytest.approx(1 / 300)
            rows = list(receptors_by_period(store, reached(store)))
            assert [(row["return_period"], row["probability"]) for row in rows] == [
                (10, 0),
                (100, 0),
                (300, 1),
            ]
            assert [row["runs_planned"] for row in rows] == [1, 1, 1]
            found = map_hazard(ensemble(store), Hazard(depth=(0.05,)))
            assert found.attrs["events_per_year"] == pytest.approx(0.1)
            there = found.sel(x=180, y=0, method="nearest")
            assert there["depth_exceedance_rate"].item() == pytest.approx(1 / 300, rel=1e-5)
            assert there["period_intensity"].to_numpy().tolist() == [0, 0, 2]
            assert there["hazard_level"].item() == 3

    def test_give_the_same_maps_from_one_file_and_from_three(self, made):
        asked = Hazard(depth=(0.1, 1.0))
        with self.whole(made) as store:
            one = map_hazard(ensemble(store), asked)
        stores = list(self.parts(made))
        three = map_hazard(together({store.attrs["title"]: ensemble(store) for store in stores}), asked)
        for store in stores:
            store.close()
        assert set(one) == set(three)
        for name in one:
            np.testing.assert_allclose(one[name], three[name], rtol=1e-6, err_msg=str(name))
