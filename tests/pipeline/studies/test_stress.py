"""The stress harness: what it draws, what it checks, and the scenes that once broke a law."""

from dataclasses import replace
from math import comb

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from root import ROOT
from scenes import SCENES, all_sides, scene

from pipeline.studies.stress.campaign import Row, is_repeated, perform, shrunk
from pipeline.studies.stress.draws.beds import EROSION
from pipeline.studies.stress.repeats import FEW_STEPS, ROOTS, STEPS, repeat, steps_within
from pipeline.studies.stress.report import largest_rate, rate
from pipeline.studies.stress.scenes import LAYOUTS, Drawn, draw, prepared, read
from pipeline.studies.stress.shrink import shrink
from pipeline.studies.stress.watch import Watched, watch
from solver.checks.heights import unseen as unseen_on
from solver.checks.invariants import Laws
from solver.checks.states import Check, State, state_of_run
from solver.forms import begin
from solver.physics.erosion import ErodibleBed, GrowthRate
from solver.physics.friction import Coulomb
from solver.physics.terrain import Plane, Segment, Segments
from solver.points.lattice import Lattice

SMALL = 1e5
ONCE_BROKEN = sorted((ROOT / "scenarios" / "stress").glob("*.yaml"))


def test_the_same_seed_and_number_draw_the_same_scene():
    assert draw(1, 7).text == draw(1, 7).text
    assert draw(1, 7).text != draw(2, 7).text
    assert {draw(1, k).labels["points"] for k in range(150)} == {
        *LAYOUTS,
        "surface",
        "surface, poisson-disc",
        "surface, graded",
    }
    assert 0.05 < np.mean([is_repeated(1, k) for k in range(400)]) < 0.15


@pytest.mark.parametrize(("lattice", "low", "high"), [(True, 0.25, 0.55), (False, 0.1, 0.3)])
def test_a_share_of_the_scenes_has_inflows_beside_a_release_or_alone(lattice, low, high):
    drawn = [draw(1, k) for k in range(300)]
    apart = "surface", "collocation, lattice", "collocation, cloud"
    assert not any("inflow" in each.data for each in drawn if each.labels["points"] in apart[1:])
    kept = [each for each in drawn if each.labels["points"] not in apart]
    kept = [each for each in kept if (each.labels["points"] == "lattice") == lattice]
    fed = [each for each in kept if "inflow" in each.data]
    assert low < len(fed) / len(kept) < high
    alone = [each for each in fed if "release" not in each.data]
    assert 0 < len(alone) < len(fed)
    assert {"at a side", "inside"} <= {each.labels["inflow"].partition(",")[0] for each in fed}


def test_a_drawn_scene_is_a_scenario_file(tmp_path):
    drawn = next(d for d in (draw(1, k) for k in range(50)) if d.points is not None)
    again = read(drawn.write(tmp_path))
    np.testing.assert_array_equal(again.points, drawn.points)
    one, two = prepared(drawn).scene, prepared(again).scene
    np.testing.assert_array_equal(one.depth, two.depth)
    assert one.friction == two.friction


# each kind of scene is compiled; scenes that nobody has seen are those of the commit's own seed
@pytest.mark.slow
@settings(max_examples=15, deadline=None, derandomize=True, database=None)
@given(st.integers(0, 100_000))
def test_a_random_scene_keeps_the_laws_of_the_conservative_form(number):
    row = perform(draw(5, number), False, SMALL)
    assert not row.conservative or not row.broken, row.drawn.text


@pytest.mark.parametrize("file", ONCE_BROKEN, ids=lambda path: path.stem)
def test_a_scene_that_once_broke_a_law_keeps_them_all(file):
    ready = prepared(read(file))
    assert watch(ready.scene, float(ready.times[-1]), 2e6).violations == {}


def test_what_underflows_does_not_hang_on_units():
    """Ahead of the layer from a side of given depth, velocities decay below what doubles can hold."""
    checks = repeat(read(next(path for path in ONCE_BROKEN if path.stem == "spray-that-underflows")))
    assert {check.law: check.value for check in checks if not check.kept} == {}
    assert {"gravity scales time", "length scales"} <= {check.law for check in checks}


@pytest.mark.parametrize("number", [1, 8])
def test_repeating_a_scene_gives_the_same(number):
    checks = repeat(draw(1, number))
    assert len(checks) >= 3
    assert [check for check in checks if not check.kept] == []


def test_what_costs_much_is_repeated_for_fewer_steps():
    assert steps_within(2e6, 1000, 2_000_000) == STEPS
    assert steps_within(2e6, 40, 2_000_000) == 40
    assert steps_within(2e6, 3, 2_100_000) == FEW_STEPS
    assert steps_within(2e6, 0, 0) in range(FEW_STEPS, STEPS + 1)


def start(case):
    run = begin(case, 1.0, 0.0, True)
    state = state_of_run(run)
    return Laws(case, state, 1 / case.points.dx + 1 / case.points.dy), state


def broken(checks):
    return {check.law for check in checks if not check.kept}


FLAT = scene(Plane(0), Coulomb(35), heaps=(((6, 0), 4, 0.5),), boundaries=all_sides("wall"))


def changed(state, **arrays):
    return state._replace(**arrays)


def test_the_laws_see_what_breaks_them():
    laws, state = start(SCENES["frictionless"][0])
    assert broken(laws.of_state(state)) == set()
    wet = state.h > 0.1
    assert broken(laws.of_state(changed(state, h=np.where(wet, np.nan, 0)))) == {"values are finite"}
    assert "depth is not negative" in broken(laws.of_state(changed(state, h=state.h - 1e-20)))
    assert broken(laws.of_state(changed(state, h=state.h * (1 + 1e-11)))) == {"ledger of volume"}
    film = (state.h > 0) & (state.h == state.h[state.h > 1e-3].min())
    fast = changed(state, u=np.where(film, 60.0, state.u))
    assert "speed has a source" in broken(laws.of_state(fast))
    assert broken(laws.of_state(changed(state, u=state.u + 20.0))) >= {"kinetic energy has a source"}


def unseen(case):
    return unseen_on(case, case.terrain)


def test_a_cell_longer_than_a_cliff_may_fall_by_its_length():
    """One of 1 m whose middle stands on the edge of 0.25 m of 80 degrees, and a lattice that resolves it."""
    cliff = Segments((Segment(0.0, 0.0), Segment(2.0, 80.0), Segment(2.25, 0.0)), joint=0.02)
    coarse, fine = (
        scene(cliff, heaps=(((1, 0), 1, 0.1),), lattice=Lattice((0.125, 6.125), (-1, 1), d))
        for d in (1, 0.01)
    )
    steep = 9.81 * np.sin(np.radians(80))
    assert unseen(coarse) == pytest.approx(0.75 * steep, rel=0.05)
    assert unseen(fine) < 0.01 * steep
    assert unseen(FLAT) == 0
    limits = [start(case)[0].speed_limit(0.0) ** 2 / 2 for case in (coarse, fine)]
    assert limits[0] - limits[1] == pytest.approx(0.75 * steep, rel=0.15)


def test_the_laws_of_a_step_see_what_breaks_them():
    laws, state = start(FLAT)
    later = changed(state, time=0.1)
    assert broken(laws.of_step(state, later, False)) == set()
    assert broken(laws.of_step(state, changed(state, time=1e-6), False)) == {"no film sets the step"}
    assert broken(laws.of_step(state, changed(state, time=1e-6), True)) == set()
    assert "what friction holds stays" in broken(
        laws.of_step(state, changed(later, h=state.h + 1e-16), False)
    )
    assert "energy grows by gravity's work" in broken(
        laws.of_step(state, changed(later, u=state.u + 9.0), False)
    )
    assert broken(laws.of_end(1e9, False)) == {"comes to rest"}
    assert broken(laws.of_end(1e9, True)) == broken(laws.of_end(0.1, False)) == set()


@pytest.mark.parametrize(("angle", "side"), [(30.0, -1), (-30.0, 0)])
def test_what_gravity_presses_against_a_wall_may_gain_what_it_gives_in_a_step(angle, side):
    """m a dt (u + a dt/2) of what lies in the cells beside the wall, and nothing for what lies elsewhere."""
    case = scene(Plane(angle), Coulomb(0), heaps=(((6, 0), 4, 0.5),), boundaries=all_sides("wall"))
    laws, state = start(case)
    film = np.zeros_like(state.h)
    film[:, side] = 1e-3
    later = changed(state, h=film, u=np.where(film > 0, 2.0, 0.0), time=0.1)
    a = 9.81 * 0.5
    volume = film.sum() * case.points.dx * case.points.dy
    assert laws.held_up(later, changed(later, time=0.2)) == pytest.approx(volume * 0.1 * a * (2 + 0.05 * a))
    away = changed(later, h=film[:, ::-1])
    assert laws.held_up(away, changed(away, time=0.2)) == 0
    assert start(replace(case, boundaries=all_sides("open")))[0].held_up(later, changed(later, time=0.2)) == 0


def test_a_failing_scene_is_shrunk_to_what_fails():
    whole = next(d for d in (draw(1, k) for k in range(200)) if len(d.data["release"]) > 2)
    wanted = whole.data["release"][1]
    small = shrink(whole, lambda drawn: wanted["height"] in [r["height"] for r in drawn.data["release"]])
    assert len(small.data["release"]) == 1
    assert small.data["terrain"]["profile"] == "plane"
    assert set(small.data["boundaries"].values()) == {"open"}


def test_a_shrunk_scene_can_be_run(monkeypatch, tmp_path):
    """Whatever runs breaks a law here, so that nothing but what can be run bounds how small it gets."""
    found = Watched()
    found.note([Check("speed has a source", 2.0, 1.5)], 0.1)
    monkeypatch.setattr("pipeline.studies.stress.campaign.watch", lambda *_, **__: found)
    row = perform(draw(1, 830), False)
    small = shrunk(row)
    assert small.points.size < row.drawn.points.size / 4
    again = read(small.write(tmp_path))
    assert len(again.data["release"]) == 1


@pytest.mark.parametrize(
    ("broken", "scenes", "bound"),
    [
        (0, 300, 9.936e-3),
        (0, 5000, 5.990e-4),
        (1, 150, 3.122e-2),
        (6, 930, 1.269e-2),
        (3, 3, 1.0),
        (0, 0, 1.0),
    ],
)
def test_the_largest_rate_is_that_which_the_campaign_would_contradict(broken, scenes, bound):
    """As many broken or fewer would be found in one of twenty campaigns."""
    found = largest_rate(broken, scenes)
    assert found == pytest.approx(bound, rel=2e-3)
    if scenes > broken:
        fewer = sum(comb(scenes, k) * found**k * (1 - found) ** (scenes - k) for k in range(broken + 1))
        assert fewer == pytest.approx(0.05, rel=1e-6)


def test_the_rate_counts_what_was_run_of_the_conservative_form():
    def row(number, **of):
        return Row(replace(draw(1, number), data={"scheme": of.pop("scheme", {})}), **of)

    bad = Watched()
    bad.note([Check("speed has a source", 2.0, 1.5)], 0.1)
    rows = [row(1, watched=Watched()), row(2, watched=bad), row(3, reason="refused")]
    rows.append(row(4, watched=bad, scheme={"form": "collocation"}))
    told = rate(rows)
    assert "1 of 2 scenes" in told
    assert "a rate of 0.5, at most 0.97 at 95 %" in told


def test_an_error_is_told_as_a_broken_law(monkeypatch):
    def fail(*_):
        raise RuntimeError("no such thing")

    monkeypatch.setattr("pipeline.studies.stress.campaign.watch", fail)
    assert "no such thing" in perform(draw(1, 1), False).broken["no error"]


def test_a_check_of_what_is_not_a_number_is_not_kept():
    assert not Check("", float("nan"), 1.0).kept
    assert isinstance(start(FLAT)[1], State)
    assert isinstance(replace(draw(1, 1), name="other"), Drawn)


@pytest.mark.parametrize("model", EROSION)
def test_a_scene_that_erodes_keeps_its_laws_and_repeats(model):
    found = 0
    for number in range(2000):
        drawn = draw(3, number)
        if drawn.labels["erosion"] != model or drawn.labels["points"] != "lattice":
            continue
        ready = prepared(drawn)
        if ROOTS & set(vars(ready.scene.friction)):
            continue
        run = begin(ready.scene, float(ready.times[-1]), 0.0, True)
        run.advance(run.end, 60)
        if not run.entrained > 1e-3 * run.volume:
            continue
        row = perform(drawn, True, SMALL)
        assert not row.broken, row.broken
        scales = "length scales, with inflow" if "inflow" in drawn.data else "length scales"
        assert {"a restart changes nothing", scales} <= {check.law for check in row.repeats}
        found += 1
        if found == 2:
            return
    raise AssertionError("no scene erodes")


def test_a_bed_that_does_not_lose_what_the_flow_gains_is_told():
    case = scene(Plane(30), Coulomb(20))
    case = replace(case, erodible_bed=ErodibleBed(np.full(case.depth.shape, 0.1), GrowthRate(0.2)))
    run = begin(case, 1.0, 0.0, True)
    laws = Laws(case, state_of_run(run), 1.0)
    run.advance(1.0, None)
    state = state_of_run(run)
    assert state.entrained > 0
    assert all(check.kept for check in laws.of_state(state))
    wrong = {
        "the bed loses what the flow takes up": state._replace(eroded=0.9 * state.eroded),
        "ledger of volume": state._replace(entrained=0.9 * state.entrained),
        "no more is taken up than there is": state._replace(eroded=state.eroded + 0.1),
    }
    for law, changed in wrong.items():
        assert law in {check.law for check in laws.of_state(changed) if not check.kept}
